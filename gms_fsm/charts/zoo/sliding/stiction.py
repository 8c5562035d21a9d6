"""Coulomb and viscous friction with stiction: the contact is locked while it sticks.

At rest the friction force is whatever holds the contact, up to the stiction F_s; in motion it is
the Coulomb friction F_c against the motion, plus viscous friction. There is no regularization: a
stuck contact is at rest exactly.

It shows stiction, an exact rest, and stick-slip. It cannot show pre-sliding, a Stribeck effect
other than the step from F_s to F_c, frictional lag, or a break-away force that depends on the rate.

Where an impact at another contact reverses the velocity, the contact is not arrested: it slides
the other way. An impact on a stuck contact makes it slide, whatever the stiction: any friction
force is too small against an impulse.

References
----------
H. Olsson, K. J. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky, "Friction Models and Friction
Compensation", European Journal of Control 4(3), 176-195 (1998), doi:10.1016/S0947-3580(98)70113-X.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

STICTION = Chart(
    name="Coulomb friction with stiction",
    parameters=(
        Parameter("F_c", "N", "> 0", per_element=False, meaning="Coulomb friction"),
        Parameter("F_s", "N", ">= F_c", per_element=False, meaning="stiction"),
        Parameter("b", "Ns/m", ">= 0", per_element=False, meaning="viscous friction"),
    ),
    states=(
        State("stuck", locked=True),
        State("forward", outputs={"F": "F_c + b * v"}),
        State("backward", outputs={"F": "-F_c + b * v"}),
    ),
    transitions=(
        Transition("release_forward", "stuck", "forward", guard="F > F_s"),
        Transition("release_backward", "stuck", "backward", guard="F < -F_s"),
        Transition("arrest_forward", "forward", "stuck", guard="v < 0"),
        Transition("arrest_backward", "backward", "stuck", guard="v > 0"),
        # At an impact, which these edges survive and the two above do not.
        Transition("reverse_forward", "forward", "backward", guard="v < 0"),
        Transition("reverse_backward", "backward", "forward", guard="v > 0"),
    ),
    reference="Olsson et al. (1998)",
    layout={"stuck": (190, 0), "backward": (0, 180), "forward": (380, 180)},
)
CHARTS = (
    Entry(
        "stiction",
        STICTION,
        Demonstration({"F_c": 1.0, "F_s": 1.5, "b": 0.1}, "chosen by us"),
    ),
)
