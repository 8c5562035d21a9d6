"""Guards without memory end a run in an error that names the element, also if several chatter.

Two machines that chatter together move the clock on by some ticks each time; a run that went on
like that would never end.
"""

import numpy as np
import pytest

from gms_fsm import ChartModel, Prescribed, Stribeck, simulate
from gms_fsm.charts.broken import BROKEN
from gms_fsm.errors import LivelockError

SLOWING = Prescribed("0.2*cos(2*pi*t/20)")  # so that s rises


def memoryless(weights):
    return ChartModel(
        BROKEN["memoryless"].chart, {"k": 1.0, "sigma": 0.1, "C": 0.1, "v_c": 1e-6},
        n=len(weights), stribeck=Stribeck(1.0, 1.5, 0.05), weights=np.array(weights),
    )  # fmt: skip


@pytest.mark.parametrize("engine", ["machines", "ifelse", "compiled"])
@pytest.mark.parametrize(("weights", "element", "t"), [([0.5], 1, 2.8799), ([0.5, 0.4], 2, 2.1626)])
def test_the_error_names_the_element_and_says_that_it_chatters(weights, element, t, engine):
    """Which of the two counts is full first, that of the guard or of the machine, is no matter."""
    if engine == "compiled":
        pytest.importorskip("numba", reason="needs the extra fast")
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless(weights), SLOWING, 10.0, engine=engine)
    text, trace = str(caught.value), caught.value.trace
    log = trace.transitions[trace.transitions.element == element - 1]
    assert trace.t[-1] == pytest.approx(t, abs=1e-4)
    assert 50 <= len(log) <= 100
    assert 0.0 < log.t[-1] - log.t[0] < 1e-8
    for part in (
        f"element {element} switched {len(log)} times in ", f"at t = {t}", "chattering",
        f"last by '{log.edge[-1]}' from {log.source[-1]} to {log.target[-1]}", "leave a gap",
    ):  # fmt: skip
        assert part in text
    assert "sliding mode" not in text
