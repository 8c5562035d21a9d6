"""The reset integrator of Haessig and Friedland: a bond that stretches up to z_0 and then holds.

While the contact sticks, the bond is a spring and a damper, stiffer by the factor 1 + a_0 than in
sliding: that is how the model has stiction. At ``|z| = z_0`` the contact slips, the bond keeps its
length, and the force is the Coulomb friction. At a reversal it sticks again at once.

It shows stiction, pre-sliding as a linear spring, and stick-slip. It cannot show a Stribeck effect
with a width, or frictional lag. The force jumps: from (1 + a_0) F_c to F_c at the break-away, and
back at each reversal, so that the loop it draws has corners that no measurement shows.

The break-away is at ``F_s = (1 + a_0) sigma_0 z_0``, and ``F_c = sigma_0 z_0``.

References
----------
D. A. Haessig, B. Friedland, "On the Modeling and Simulation of Friction", ASME Journal of Dynamic
Systems, Measurement, and Control 113 (1991); as described in
H. Olsson, K. J. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky, "Friction Models and Friction
Compensation", European Journal of Control 4(3), 176-195 (1998), doi:10.1016/S0947-3580(98)70113-X.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

RESET_INTEGRATOR = Chart(
    name="Reset integrator",
    variables=("z",),
    parameters=(
        Parameter("sigma_0", "N/m", "> 0", meaning="stiffness of the bond in sliding"),
        Parameter("sigma_1", "Ns/m", ">= 0", meaning="damping of the bond"),
        Parameter("a_0", "1", ">= 0", meaning="relative increase of the stiffness in stiction"),
        Parameter("z_0", "m", "> 0", meaning="deflection at break-away"),
    ),
    states=(
        State(
            "stick",
            flow={"z": "v"},
            outputs={"F": "(1 + a_0) * sigma_0 * z + sigma_1 * dz"},
        ),
        State("slip_forward", entry={"z": "z_0"}, outputs={"F": "sigma_0 * z"}),
        State("slip_backward", entry={"z": "-z_0"}, outputs={"F": "sigma_0 * z"}),
    ),
    transitions=(
        Transition("break_away_forward", "stick", "slip_forward", guard="z >= z_0 and v > 0"),
        Transition("break_away_backward", "stick", "slip_backward", guard="z <= -z_0 and v < 0"),
        Transition("turn_forward", "slip_forward", "stick", guard="v < 0"),
        Transition("turn_backward", "slip_backward", "stick", guard="v > 0"),
    ),
    reference="Haessig and Friedland (1991)",
)
CHARTS = (
    Entry(
        "reset-integrator",
        RESET_INTEGRATOR,
        Demonstration({"sigma_0": 1e5, "sigma_1": 316.23, "a_0": 0.5, "z_0": 1e-5}, "chosen by us"),
    ),
)
