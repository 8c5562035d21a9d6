"""The friction modes of Modelica: Coulomb friction under a normal force, with five modes and Free.

The modes are those of ``PartialFriction`` of the Modelica Standard Library: Stuck, StartForward,
Forward, StartBackward, Backward, and Free where nothing presses the surfaces together. The start
modes last for an instant, until v has left 0. A brake or a clutch is this chart with N as an input,
a function of time or of the bodies' motion.

The coefficient of friction is a Stribeck curve, mu_s at rest and mu_c at high speed. A stuck
contact holds up to ``peak mu_s N``.

Where N touches 0 and rises again at once, the contact is free for an instant; a proof reports this
as the only statement that it refutes. Nothing switches endlessly there.

It shows stiction, an exact rest, stick-slip, the Stribeck effect, and how a contact engages and
comes free. It cannot show pre-sliding, frictional lag, or a break-away force that depends on the
rate: friction is a function of v and N alone, as soon as the contact moves.

References
----------
M. Otter, H. Elmqvist, S. E. Mattsson, "Hybrid Modeling in Modelica Based on the Synchronous Data
Flow Principle", IEEE International Symposium on Computer Aided Control System Design, 151-157
(1999).
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import SIGMA_2, Parameter
from gms_fsm.charts.registry import Demonstration, Entry
from gms_fsm.charts.stribeck import stribeck_text

MODELICA = Chart(
    name="Modelica's friction modes",
    inputs=("v", "N"),
    parameters=(
        Parameter("mu_c", "1", "> 0", per_element=False, meaning="coefficient of sliding friction"),
        Parameter("mu_s", "1", ">= mu_c", per_element=False, meaning="coefficient at v = 0"),
        Parameter("v_s", "m/s", "> 0", per_element=False, meaning="Stribeck velocity"),
        Parameter("delta", "1", ">= 0.1 and <= 20", per_element=False, meaning="Stribeck exponent"),
        Parameter("peak", "1", ">= 1", per_element=False, meaning="stiction over mu_s N"),
        SIGMA_2,
    ),
    let={
        "load": "max(N, 0)",
        "F_0": "mu_s * load",
        "F_v": stribeck_text("mu_c", "mu_s", "v_s", "delta", load="load", stops=True),
    },
    states=(
        State("stuck", locked=True),
        State("start_forward", outputs={"F": "F_0"}),
        State("forward", outputs={"F": "F_v + sigma_2 * v"}),
        State("start_backward", outputs={"F": "-F_0"}),
        State("backward", outputs={"F": "-F_v + sigma_2 * v"}),
        State("free", outputs={"F": "0"}),
    ),
    transitions=(
        Transition("lift", ("stuck", "forward", "backward"), "free", guard="N <= 0"),
        Transition("release_forward", "stuck", "start_forward", guard="F > peak * F_0"),
        Transition("release_backward", "stuck", "start_backward", guard="F < -peak * F_0"),
        Transition("move_forward", "start_forward", "forward", guard="v > 0"),
        Transition("move_backward", "start_backward", "backward", guard="v < 0"),
        Transition("fail_forward", "start_forward", "stuck", guard="v <= 0 and a <= 0"),
        Transition("fail_backward", "start_backward", "stuck", guard="v >= 0 and a >= 0"),
        Transition("stop_forward", "forward", "stuck", guard="v <= 0"),
        Transition("stop_backward", "backward", "stuck", guard="v >= 0"),
        # At an impact, which these edges survive and the two above do not.
        Transition("reverse_forward", "forward", "backward", guard="v < 0"),
        Transition("reverse_backward", "backward", "forward", guard="v > 0"),
        Transition("engage_forward", "free", "forward", guard="N > 0 and v > 0"),
        Transition("engage_backward", "free", "backward", guard="N > 0 and v < 0"),
        # At v = 0: the two edges above go first.
        Transition("engage_at_rest", "free", "stuck", guard="N > 0"),
    ),
    reference="Otter, Elmqvist and Mattsson (1999)",
    layout={
        "stuck": (320, 0),
        "start_backward": (0, 190),
        "start_forward": (640, 190),
        "backward": (115, 390),
        "forward": (525, 390),
        "free": (320, 550),
    },
)
CHARTS = (
    Entry(
        "modelica",
        MODELICA,
        Demonstration(
            {"mu_c": 0.1, "mu_s": 0.15, "v_s": 1e-3, "delta": 2.0, "peak": 1.0, "sigma_2": 0.4},
            "chosen by us",
            inputs={"N": "10"},
        ),
    ),
)
