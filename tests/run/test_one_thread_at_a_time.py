"""A call of a stepping friction during another thread's is refused; no sample is lost."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest

from gms_fsm import FrictionBank, FrictionState
from gms_fsm.errors import ParameterError
from tests.helpers import FASTEST, stick_slip

THREADS, CALLS, DT = 6, 300, 1e-3
ENGINES = ["ifelse"] if FASTEST == "ifelse" else ["ifelse", "compiled"]


def made(kind: Any, engine: str) -> tuple[Any, Any]:
    """Return a friction, and a velocity for it."""
    model = stick_slip("signed")
    if kind is FrictionState:
        return FrictionState(model, engine=engine), 0.1
    return FrictionBank([model] * 2, engine=engine), np.array([0.1, -0.2])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("kind", [FrictionState, FrictionBank])
def test_samples_of_six_threads(kind: Any, engine: str) -> None:
    """Each sample is taken or refused: time and state are those of the samples taken."""
    friction, v = made(kind, engine)
    taken, others = [0] * THREADS, list[BaseException]()
    ready = threading.Barrier(THREADS)

    def work(i: int) -> None:
        ready.wait()
        for _ in range(CALLS):
            try:
                friction.advance(v, v, DT)
                taken[i] += 1
            except ParameterError as error:
                if "another thread" not in error.reason:
                    others.append(error)
            except BaseException as error:
                others.append(error)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(THREADS)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert not others
    alone, _ = made(kind, engine)
    for _ in range(sum(taken)):
        alone.advance(v, v, DT)
    assert friction.t == alone.t
    np.testing.assert_array_equal(friction.to_array(), alone.to_array())


@pytest.mark.parametrize("kind", [FrictionState, FrictionBank])
def test_every_call_from_another_thread_is_refused_meanwhile(kind: Any) -> None:
    friction, v = made(kind, ENGINES[-1])
    friction.advance(v, v, 0.5)
    before, array = friction.snapshot(), friction.to_array()
    calls = {
        "advance": lambda: friction.advance(v, v, DT),
        "advance_to": lambda: friction.advance_to(v, v, 1.0),
        "peek": lambda: friction.peek(v, v, DT),
        "mean_force": lambda: friction.mean_force,
        "dF_dv": lambda: friction.dF_dv,
        "snapshot": friction.snapshot,
        "restore": lambda: friction.restore(before),
        "to_array": friction.to_array,
        "from_array": lambda: friction.from_array(array),
    }
    said = dict[str, str]()

    def call_all() -> None:
        for name, call in calls.items():
            try:
                call()
            except ParameterError as error:
                said[name] = str(error)

    with friction._joints.alone:  # as during a call
        other = threading.Thread(target=call_all)
        other.start()
        other.join()
    assert said.keys() == calls.keys()
    assert all("a friction of its own, or hold a lock" in text for text in said.values())
    np.testing.assert_array_equal(friction.to_array(), array)
    friction.advance(v, v, DT)
