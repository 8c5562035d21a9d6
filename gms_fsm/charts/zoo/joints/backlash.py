"""Backlash with elastic flanks: no force inside the gap, a spring and a damper on each flank.

A flank pushes and never pulls: contact begins when the gap is closed and ends when the force of
the flank would change its sign, which with damping is before the gap opens.

It shows the dead time at a reversal, impacts with finite stiffness, and limit cycles in a control
loop. It cannot show friction or wear on the flanks, or a flank whose stiffness depends on the load.

References
----------
M. Nordin, P.-O. Gutman, "Controlling Mechanical Systems with Backlash - A Survey", Automatica
38(10), 1633-1649 (2002), doi:10.1016/S0005-1098(02)00047-X.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

BACKLASH = Chart(
    name="Backlash with elastic flanks",
    inputs=("x", "v"),
    parameters=(
        Parameter("k", "N/m", "> 0", meaning="stiffness of a flank"),
        Parameter("d", "Ns/m", ">= 0", meaning="damping of a flank"),
        Parameter("gap", "m", "> 0", meaning="half of the gap"),
    ),
    states=(
        State("apart", outputs={"F": "0"}),
        State("right", outputs={"F": "k * (x - gap) + d * v"}),
        State("left", outputs={"F": "k * (x + gap) + d * v"}),
    ),
    transitions=(
        Transition("touch_right", "apart", "right", guard="x >= gap and v > 0"),
        Transition("touch_left", "apart", "left", guard="x <= -gap and v < 0"),
        Transition("leave_right", "right", "apart", guard="F < 0"),
        Transition("leave_left", "left", "apart", guard="F > 0"),
    ),
    reference="Nordin and Gutman (2002)",
)
CHARTS = (
    Entry(
        "backlash",
        BACKLASH,
        Demonstration({"k": 100.0, "d": 1.0, "gap": 0.1}, "chosen by us"),
    ),
)
