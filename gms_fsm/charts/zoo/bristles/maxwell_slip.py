"""Maxwell-slip (Iwan): a bank of springs, each of which slips at its own Coulomb force.

An element is a spring of stiffness k that is stretched up to F_c and then dragged along: elastic
and perfectly plastic, a generalized stop operator of the displacement. The sum over elements is any
convex initial-loading curve; each element also is a play operator, of the slider that it drags.

It shows pre-sliding hysteresis with nonlocal memory: inner loops close exactly, and the branches
after a reversal are the initial-loading curve, twice as large (Masing). It does not drift and does
not depend on the rate. It cannot show stiction above the sum of F_c, the Stribeck effect,
frictional lag, or a force that rises with speed. The GMS element is this one with a Stribeck curve
and a slip law.

References
----------
W. D. Iwan, "A Distributed-Element Model for Hysteresis and Its Steady-State Dynamic Response", ASME
Journal of Applied Mechanics 33(4), 893-900 (1966), doi:10.1115/1.3625199.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

MAXWELL_SLIP = Chart(
    name="Maxwell-slip element",
    variables=("z",),
    parameters=(
        Parameter("k", "N/m", "> 0", meaning="stiffness"),
        Parameter("F_c", "N", "> 0", meaning="Coulomb friction of the element"),
    ),
    let={"z_c": "F_c / k"},
    states=(
        State("stick", flow={"z": "v"}),
        State("slip_forward", entry={"z": "z_c"}),
        State("slip_backward", entry={"z": "-z_c"}),
    ),
    transitions=(
        Transition("break_away_forward", "stick", "slip_forward", guard="z >= z_c and v > 0"),
        Transition("break_away_backward", "stick", "slip_backward", guard="z <= -z_c and v < 0"),
        Transition("turn_forward", "slip_forward", "stick", guard="v < 0"),
        Transition("turn_backward", "slip_backward", "stick", guard="v > 0"),
    ),
    outputs={"F": "k * z"},
    reference="Iwan (1966)",
)
CHARTS = (
    Entry(
        "maxwell-slip",
        MAXWELL_SLIP,
        Demonstration({"k": (4e4, 3e4, 2e4, 1e4), "F_c": (0.25, 0.25, 0.25, 0.25)}, "chosen by us"),
    ),
)
