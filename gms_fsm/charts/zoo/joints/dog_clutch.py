"""A dog clutch: from t_on to t_off the contact is locked, else it transmits nothing.

Engagement is an impact that keeps the momentum of the bodies. With a ratio in the velocity of the
contact, such as ``v="w_a - 3 * w_b"``, the clutch engages a gear.

It shows the common speed after engagement and the energy lost in it. It cannot show slip, a limit
of the torque, or claws that meet tooth on tooth: that they mesh at any speed is a simplification of
ours.

References
----------
A. Benveniste, B. Caillaud, H. Elmqvist, K. Ghorbal, M. Otter, M. Pouzet, "Multi-Mode DAE Models -
Challenges, Theory and Implementation", in "Computing and Software Science", LNCS 10000, Springer
(2019), doi:10.1007/978-3-319-91908-9_16, on impulses where the number of equations changes.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

DOG_CLUTCH = Chart(
    name="Dog clutch",
    inputs=("t",),
    parameters=(
        Parameter("t_on", "s", per_element=False, meaning="time of engagement"),
        Parameter("t_off", "s", "> t_on", per_element=False, meaning="time of disengagement"),
    ),
    states=(
        State("open", outputs={"F": "0"}),
        State("engaged", locked=True),
    ),
    transitions=(
        Transition("engage", "open", "engaged", guard="t_on <= t < t_off", impulse=True),
        Transition("disengage", "engaged", "open", guard="t >= t_off"),
    ),
    reference="Benveniste et al. (2019)",
)
CHARTS = (
    Entry(
        "dog-clutch",
        DOG_CLUTCH,
        Demonstration({"t_on": 2.0, "t_off": 5.0}, "chosen by us"),
    ),
)
