"""A run that cannot continue is an outcome; Ctrl-C stops between two rows; memory is small."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Transition, simulate
from gms_fsm.session.session import Session
from gms_fsm.traces.failures import SimulationError
from tests.helpers import ROOT, same_bits, stick_slip
from tests.inspection.sessions import both_ways, debugger


def test_a_livelock_can_be_inspected_stepped_back_from_and_poked() -> None:
    session = Session(both_ways(), Prescribed("0.15"), 20.0)
    here = session.goto(20.0)
    assert "element 2 at t = 6.6" in str(session.branch.failure)
    assert "switched 100 times" in str(session.branch.failure)
    assert here.t == pytest.approx(1.0 / 0.15)
    assert here.microstep >= 99
    assert session.why(1)[0].fired
    assert session.step() == here  # it stays there
    assert session.prev_transition().microstep == here.microstep - 1
    while session.here.microstep:
        session.back()
    assert session.here.states == ("stick", "stick")
    session.poke({"z": {1: 0.0}})
    assert session.goto(10.0).t > here.t
    assert session.branch.failure is None
    assert not session.branch.ended
    assert "switched 100 times" in str(session.branches[0].failure)
    assert session.goto(20.0).t == pytest.approx(2.0 / 0.15)  # it gets there a second time
    assert "switched 100 times" in str(session.branch.failure)


def test_a_record_that_ends_too_early() -> None:
    t = np.linspace(0, 5, 501)
    session = Session(stick_slip("signed"), Prescribed((t, 0.1 * np.sin(t))), 9.0)
    assert session.goto(9.0).t == 5.0
    assert isinstance(session.branch.failure, SimulationError)
    assert session.branch.failure.t == 5.0
    assert session.back(3).t < 5.0


def on(*edges: Transition, flow: str = "v", **options: object) -> Session:
    states = (State("on", {"z": flow}), State("off", {"z": "0"}))
    chart = Chart("bad", ("v",), ("z",), ("k",), states, edges, {"F": "k * z"})
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 0.1))
    return Session(model, Prescribed("1"), 2.0, **options)


@pytest.mark.parametrize("guard", ["0 / (z - z) > 0", "sqrt(-1 - z) > 0"])
def test_a_run_that_cannot_even_start_has_its_first_row(guard: str) -> None:
    session = on(Transition("go", "on", "off", guard=guard))
    assert session.goto(1.0).row == 0
    assert isinstance(session.branch.failure, SimulationError)
    assert session.step().t == 0.0


def test_a_flow_that_is_not_finite() -> None:
    session = on(flow="z * z", initial={"z": [1.0]})
    assert 0.99 < session.goto(2.0).t < 1.001
    assert session.branch.failure is not None
    session.goto(0.5)
    session.poke({"z": {0: -1.0}})
    assert session.goto(2.0).t == 2.0
    assert session.branch.ended


# --------------------------------------------------------------------------- Ctrl-C
def interrupted(at: float = 40.0) -> Session:
    """A run that presses Ctrl-C once, in the middle of a step."""
    pressed: list[float] = []

    def velocity(t: float) -> float:
        if t > at and not pressed:
            pressed.append(t)
            signal.raise_signal(signal.SIGINT)
        return 0.15 * math.sin(2 * math.pi * t / 25)

    return Session(stick_slip("published"), Prescribed(velocity), 60.0)


MOVES: dict[str, Callable[[Session], object]] = {
    "goto": lambda session: session.goto(60.0),
    "until": lambda session: session.until("z1 > 99"),
    "proceed": lambda session: session.proceed(),
    "step": lambda session: session.step(10_000),
}


@pytest.mark.slow
@pytest.mark.parametrize("move", MOVES)
def test_an_interrupted_move_can_be_repeated(move: str) -> None:
    session = interrupted()
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        MOVES[move](session)
    assert signal.getsignal(signal.SIGINT) is before
    assert not session.branch.ended
    assert 5.0 < session.branch.raw(len(session.branch) - 1)[0] < 50.0
    MOVES[move](session)
    assert session.branch.ended
    whole = interrupted(1e9)
    same_bits(session.branch.trace(), simulate(whole.model, whole.rig, 60.0))


@pytest.mark.slow
@pytest.mark.parametrize("command", ["continue", "goto 60", "run", "until z1 > 99", "step 9999"])
def test_the_debugger_returns_to_its_prompt_at_the_row_reached(command: str) -> None:
    made = debugger(interrupted(), f"{command}\n{command}\nprint t\n")
    assert made.run() == 0
    text = made.stdout.getvalue()  # type: ignore[attr-defined]
    assert "\nstopped\n" in text
    if command != "run":  # which never moves
        assert "(t=60.0000 s) print t\n60 s\n" in text
        stopped = text.split("stopped\n")[1].split("(t=")[1]
        assert "row " in stopped
        assert "t = 0 s" not in stopped
    assert made.session.branch.ended


# --------------------------------------------------------------------------- memory
LONG = """
import resource, sys
from pathlib import Path
from gms_fsm import GMS, GMSParameters, Prescribed
from gms_fsm.session.session import Session
session = Session(GMS(GMSParameters.paper("stick-slip"), law="signed"),
                  Prescribed("0.15*sin(2*pi*t/25)"), 100.0, method="euler", step=1e-3,
                  engine="ifelse")
session.goto(100.0)
session.goto(50.0)
session.poke({"z": {0: 0.1}})
assert len(session.branches[0]) > 100_000, len(session.branches[0])
status = Path("/proc/self/status")
if status.exists():  # without the pages of mapped libraries: llvmlite's are 95 MB
    print(next(int(line.split()[1]) for line in status.open() if "RssAnon" in line) / 1e3)
else:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(peak / (1e6 if sys.platform == "darwin" else 1e3))  # bytes there, kB elsewhere
"""


@pytest.mark.matrix
@pytest.mark.slow
def test_a_session_of_100_000_rows_needs_less_than_150_MB() -> None:
    pytest.importorskip("resource")
    done = subprocess.run(
        [sys.executable, "-c", LONG], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert float(done.stdout) < 150.0
