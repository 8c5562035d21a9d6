"""The elasto-plastic model of Dupont et al.: LuGre with a range in which the bristle is elastic.

Up to the deflection z_ba the bristle only bends, and all displacement is recovered. Between z_ba
and the steady-state deflection ``z_ss = s(v) / sigma_0`` a growing part of the motion is plastic,
and beyond it the bristle yields as in LuGre. A contact that turns back is elastic again at once.

It shows what LuGre shows (stiction that depends on the force rate, the Stribeck effect, frictional
lag, stick-slip), and it does not drift under loads below ``sigma_0 z_ba``. It cannot show nonlocal
memory: it has one variable, so an inner loop does not return to the point where it began, unless it
is elastic as a whole.

z_ba must be less than ``F_c / sigma_0``. In steady sliding z tends to z_ss, where the flows of
*mixed* and *plastic* are equal. A guard at z_ss, as in the paper, would then be decided by rounding
and by the errors of the steps. Ours: a bristle is plastic from 0.9999 of the way from z_ba to z_ss,
and mixed again below 0.9998 of it. alpha differs there from 1 by less than 1e-7.

References
----------
P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, "Single State Elastoplastic Friction Models", IEEE
Transactions on Automatic Control 47(5), 787-792 (2002), doi:10.1109/TAC.2002.1000274.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry
from gms_fsm.charts.stribeck import Stribeck

ELASTO_PLASTIC = Chart(
    name="Elasto-plastic model",
    inputs=("v", "s"),
    variables=("z",),
    parameters=(
        Parameter("sigma_0", "N/m", "> 0", meaning="bristle stiffness"),
        Parameter("sigma_1", "Ns/m", ">= 0", meaning="bristle damping"),
        Parameter("z_ba", "m", "> 0", meaning="deflection up to which the bristle is elastic"),
    ),
    let={
        "z_ss": "s / sigma_0",
        "way": "(abs(z) - z_ba) / (z_ss - z_ba)",
        "alpha": "0.5 + 0.5 * sin(pi * (way - 0.5))",
    },
    states=(
        State("elastic", flow={"z": "v"}),
        State("mixed", flow={"z": "v - alpha * abs(v) * z / z_ss"}),
        State("plastic", flow={"z": "v - abs(v) * z / z_ss"}),
    ),
    transitions=(
        Transition("bend", "elastic", "mixed", guard="abs(z) > z_ba and v * z > 0"),
        Transition("yield_", "mixed", "plastic", guard="way >= 0.9999 and v * z > 0"),
        Transition("turn", ("mixed", "plastic"), "elastic", guard="v * z <= 0"),
        Transition("recover", "plastic", "mixed", guard="way < 0.9998 and v * z > 0"),
    ),
    outputs={"F": "sigma_0 * z + sigma_1 * dz"},
    reference="Dupont et al. (2002)",
)
CHARTS = (
    Entry(
        "elasto-plastic",
        ELASTO_PLASTIC,
        Demonstration(
            {"sigma_0": 1e5, "sigma_1": 316.23, "z_ba": 7e-6},
            "chosen by us",
            stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3),
            sigma_2=0.4,
        ),
        domain=("sigma_0 > 0", "z_ba > 0", "s > sigma_0 * z_ba"),
    ),
)
