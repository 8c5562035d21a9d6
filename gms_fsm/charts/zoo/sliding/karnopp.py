"""Karnopp's model: Coulomb friction that sticks inside a window of the velocity.

Inside the window, ``|v| < D``, the friction holds the contact up to the stiction F_s; a load above
F_s is opposed by F_s until the contact has left the window. Outside it, friction is Coulomb and
viscous.

It shows stiction, an exact rest, and stick-slip. It cannot show pre-sliding (a stuck contact does
not move at all), frictional lag, or a Stribeck effect other than the step from F_s to F_c.

The window was made for programs that cannot locate v = 0. Here it is a part of the model: a
contact that enters the window is stopped, and loses the momentum that it has at the speed D. The
original keeps that momentum while its load is below F_s. With D -> 0 both become the chart
``stiction``.

References
----------
D. Karnopp, "Computer Simulation of Stick-Slip Friction in Mechanical Dynamic Systems", ASME Journal
of Dynamic Systems, Measurement, and Control 107(1), 100-103 (1985), doi:10.1115/1.3140698.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import SIGMA_2, Parameter
from gms_fsm.charts.registry import Demonstration, Entry

KARNOPP = Chart(
    name="Karnopp's model",
    parameters=(
        Parameter("F_c", "N", "> 0", per_element=False, meaning="Coulomb friction"),
        Parameter("F_s", "N", ">= F_c", per_element=False, meaning="stiction"),
        SIGMA_2,
        Parameter("D", "m/s", "> 0", per_element=False, meaning="half of the velocity window"),
    ),
    states=(
        State("stuck", locked=True),
        State("start_forward", outputs={"F": "F_s"}),
        State("forward", outputs={"F": "F_c + sigma_2 * v"}),
        State("start_backward", outputs={"F": "-F_s"}),
        State("backward", outputs={"F": "-F_c + sigma_2 * v"}),
    ),
    transitions=(
        Transition("release_forward", "stuck", "start_forward", guard="F > F_s"),
        Transition("release_backward", "stuck", "start_backward", guard="F < -F_s"),
        # The load fell below F_s before the contact left the window.
        Transition(
            "hold_forward", "start_forward", "stuck", guard="a < 0 and v <= D", impulse=True
        ),
        Transition(
            "hold_backward", "start_backward", "stuck", guard="a > 0 and v >= -D", impulse=True
        ),
        Transition("leave_forward", "start_forward", "forward", guard="v > D"),
        Transition("leave_backward", "start_backward", "backward", guard="v < -D"),
        Transition("enter_forward", "forward", "stuck", guard="-D < v < D", impulse=True),
        Transition("enter_backward", "backward", "stuck", guard="-D < v < D", impulse=True),
        # At an impact: the velocity has passed the window at once.
        Transition("reverse_forward", "forward", "backward", guard="v <= -D"),
        Transition("reverse_backward", "backward", "forward", guard="v >= D"),
    ),
    reference="Karnopp (1985)",
    layout={
        "stuck": (250, 0),
        "start_backward": (0, 170),
        "start_forward": (500, 170),
        "backward": (100, 340),
        "forward": (400, 340),
    },
)
CHARTS = (
    Entry(
        "karnopp",
        KARNOPP,
        Demonstration({"F_c": 1.0, "F_s": 1.5, "sigma_2": 0.4, "D": 1e-4}, "chosen by us"),
    ),
)
