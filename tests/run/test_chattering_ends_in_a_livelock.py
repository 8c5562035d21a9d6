"""Guards without memory end a run in an error that names the element, even if several chatter.

Two machines that chatter together advance the clock by a few ticks each time; without the error,
such a run would never end.
"""

import pytest

from gms_fsm import simulate
from gms_fsm.traces.failures import LivelockError
from tests.traces.test_monitors_see_what_happens import SLOWING, memoryless


@pytest.mark.parametrize("engine", ["machines", "ifelse", "compiled"])
@pytest.mark.parametrize(("weights", "element", "t"), [([0.5], 1, 2.8799), ([0.5, 0.4], 2, 2.1626)])
def test_the_error_names_the_element_and_says_that_it_chatters(weights, element, t, engine):
    """Whether the guard's or the machine's count fills up first does not matter."""
    if engine == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless(weights), SLOWING, 10.0, engine=engine)
    text, trace = str(caught.value), caught.value.trace
    log = trace.transitions[trace.transitions.element == element - 1]
    assert trace.t[-1] == pytest.approx(t, abs=1e-4)
    assert 50 <= len(log) <= 100
    assert 0.0 < log.t[-1] - log.t[0] < 1e-8
    for part in (
        f"switched {len(log)} times in ",
        f"element {element} at t = {t}",
        "chattering",
        f"last by '{log.edge[-1]}' from {log.source[-1]} to {log.target[-1]}",
        "by a gap",
    ):
        assert part in text
    assert "sliding mode" not in text


def test_earlier_switches_are_not_counted():
    """At the start it arrests, seconds before it chatters."""
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless([0.5]), SLOWING, 10.0, initial={"states": ["slip"]})
    log = caught.value.trace.transitions
    assert log.t[0] == 0.0
    assert f"switched {len(log) - 1} times in {log.t[-1] - log.t[1]:.3g} s" in str(caught.value)
