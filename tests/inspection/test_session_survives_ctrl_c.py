"""Ctrl-C stops a session between two rows; afterwards it continues bit-identically."""

from __future__ import annotations

import io
import math
import signal
from collections.abc import Callable

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.debugger import Debugger
from gms_fsm.session.session import Session
from tests.helpers import same_bits, stick_slip


def _velocity(interrupt_at: float) -> Callable[[float], float]:
    """A sine that presses Ctrl-C once, in the middle of a step."""
    pressed: list[float] = []

    def velocity(t: float) -> float:
        if t > interrupt_at and not pressed:
            pressed.append(t)
            signal.raise_signal(signal.SIGINT)
        return 0.15 * math.sin(2 * math.pi * t / 25)

    return velocity


MOVES: list[Callable[[Session], object]] = [
    lambda session: session.goto(100.0),
    lambda session: session.until("z1 > 99"),
    lambda session: session.proceed(),
    lambda session: session.step(10_000),
]


@pytest.mark.slow
@pytest.mark.parametrize("move", MOVES, ids=["goto", "until", "proceed", "step"])
def test_an_interrupted_move_can_be_repeated(move: Callable[[Session], object]) -> None:
    session = Session(stick_slip("published"), Prescribed(_velocity(40.0)), 100.0)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        move(session)
    assert signal.getsignal(signal.SIGINT) is before
    assert not session.branch.ended
    assert 5.0 < session.branch.raw(len(session.branch) - 1)[0] < 60.0
    move(session)
    assert session.branch.ended
    whole = simulate(stick_slip("published"), Prescribed(_velocity(1e9)), 100.0)
    same_bits(session.branch.trace(), whole)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["continue", "goto 100", "run", "until z1 > 99", "step 9999"])
def test_the_debugger_returns_to_its_prompt_at_the_row_reached(command: str) -> None:
    session = Session(stick_slip("published"), Prescribed(_velocity(40.0)), 100.0)
    out = io.StringIO()
    assert Debugger(session, "", io.StringIO(f"{command}\n{command}\nprint t\n"), out).run() == 0
    text = out.getvalue()
    assert "\nstopped\n" in text
    if command != "run":  # which never moves
        assert "(t=100.0000 s) print t\n100\n" in text
        stopped = text.split("stopped\n")[1].split("(t=")[1]
        assert "row " in stopped
        assert "t = 0 s" not in stopped
    assert session.branch.ended
