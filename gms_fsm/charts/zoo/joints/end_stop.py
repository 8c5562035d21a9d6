"""A rigid end stop at x = x_s: impacts with restitution, then rest.

An impact reverses the velocity and keeps the momentum of the bodies. Impacts at an ever lower
speed would follow each other without end in a finite time; below the rest speed v_r the contact
is locked instead, until the stop would have to pull.

It shows rebound, the loss of energy in an impact, and rest in finite time. It cannot show the force
and the duration of an impact (the chart ``backlash`` has an elastic flank), or a restitution that
depends on the speed.

References
----------
B. Brogliato, "Nonsmooth Mechanics: Models, Dynamics and Control", 3rd ed., Springer (2016),
doi:10.1007/978-3-319-28664-8, on impact laws. The rest speed is our way to end the sequence of
impacts.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

END_STOP = Chart(
    name="End stop with impacts and rest",
    inputs=("x", "v"),
    parameters=(
        Parameter("x_s", "m", per_element=False, meaning="position of the stop"),
        Parameter("e", "1", ">= 0 and < 1", per_element=False, meaning="restitution"),
        Parameter("v_r", "m/s", "> 0", per_element=False, meaning="rest speed"),
    ),
    states=(
        State("free", outputs={"F": "0"}),
        State("rest", locked=True),
    ),
    transitions=(
        Transition("bounce", "free", "free", guard="x >= x_s and v > v_r", actions={"v": "-e * v"}),
        Transition("settle", "free", "rest", guard="x >= x_s and 0 < v <= v_r", impulse=True),
        Transition("lift", "rest", "free", guard="F < 0"),
    ),
    reference="Brogliato (2016)",
)
CHARTS = (
    Entry(
        "end-stop",
        END_STOP,
        Demonstration({"x_s": 0.5, "e": 0.6, "v_r": 1e-3}, "chosen by us"),
    ),
)
