"""Any Python function of t can drive a compiled run: machine code calls it.

The trace is that of the machines engine, bit for bit. A function that raises, or that returns no
number, ends the run as it does there, and the part before it is kept.
"""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Chart, Contact, Prescribed, State, System, Trace, Transition, simulate
from gms_fsm.foundation.store import CodeFolder
from gms_fsm.lowering import compiling as compiled
from tests.corpus import Run
from tests.helpers import other_parts, stick_slip

pytestmark = pytest.mark.slow

pytest.importorskip("llvmlite", reason="needs the extra fast")

Signal = Callable[[float], float]
MODEL = stick_slip("signed")
TABLE = np.array([0.1, 0.2, -0.2, 0.3])
HERE = [0.1]


def both(*subject: Any, t_end: float = 10.0, **how: Any) -> tuple[Trace, str]:
    """Run machines and machine code; compare traces and errors; return one of them."""
    (one, said), (other, too) = (
        Run(subject, t_end, how).outcome(engine=engine) for engine in ("machines", "compiled")
    )
    assert said == too
    assert other_parts(one, other) == []
    assert one is not None
    return one, said


# --------------------------------------------------------------------------- functions
def _with_branches(t: float) -> float:
    if t < 4:
        return 0.15
    return -0.1 * (t - 4) if t < 7 else 0.2


def _needs_more(t: float, level: float = 0.4) -> float:
    return level * math.sin(t)


def _louder(level: float) -> Signal:
    return lambda t: level * math.sin(t)


class _Callable:
    def __call__(self, t: float) -> float:
        return 0.4 * math.cos(0.5 * t)

    def method(self, t: float) -> float:
        return 0.4 * math.cos(0.5 * t)


FUNCTIONS: dict[str, Signal] = {
    "numpy": lambda t: 0.2 * np.sin(np.pi * t / 10) + np.interp(t, TABLE.cumsum(), TABLE) * 0.1,
    "branches": _with_branches,
    "integers": lambda t: 1 if t < 3 else -1,
    "a callable object": _Callable(),
    "a method": _Callable().method,
    "a partial": functools.partial(_needs_more, level=0.5),
    "two arguments": _needs_more,
    "eval": lambda t: float(eval("0.1")) * t,
    "a ufunc": np.sin,
    "a list that may change": lambda t: HERE[0] * t,
}


@pytest.mark.parametrize("kind", FUNCTIONS)
def test_every_function_gives_the_same_trace(kind: str) -> None:
    trace, said = both(MODEL, Prescribed(FUNCTIONS[kind]), t_end=9.0)
    assert said == ""
    assert len(trace.transitions) > 0


def test_a_function_may_itself_run_machine_code() -> None:
    def nested(t: float) -> float:
        inner = simulate(MODEL, Prescribed(_needs_more), 0.1, engine="compiled")
        return inner.x[-1] + 0.2 * math.sin(t)

    assert both(MODEL, Prescribed(nested), t_end=0.5)[1] == ""


def test_functions_with_the_same_text_are_not_confused() -> None:
    """Closures share their code and their name; their enclosed values are read each time."""
    soft, loud = (both(MODEL, Prescribed(_louder(level)), t_end=4.0)[0] for level in (0.3, 0.5))
    assert other_parts(soft, loud) != []


def test_machine_code_depends_on_no_function(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "store", lambda: CodeFolder.at(tmp_path))
    for factor in (0.1, 0.2):
        rig = Prescribed(functools.partial(lambda factor, t: factor * t, factor))
        simulate(MODEL, rig, 1.0, engine="compiled")
        assert len(list(tmp_path.iterdir())) == 1


def test_threads_have_errors_of_their_own() -> None:
    """They share machine code; a failure in one does not end the run of another."""

    def velocity(t: float) -> float:
        if threading.current_thread().name == "failing" and t > 0.2:
            raise ValueError("here only")
        return 0.1 * t

    outcomes: dict[str, str] = {}

    def run() -> None:
        run_of = Run((MODEL, Prescribed(velocity)), 2.0, {"engine": "compiled"})
        outcomes[threading.current_thread().name] = run_of.outcome()[1]

    threads = [threading.Thread(target=run, name=name) for name in ("first", "failing", "last")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert outcomes["first"] == outcomes["last"] == ""
    assert "here only" in outcomes["failing"]


# --------------------------------------------------------------------------- raising
def _too_late(t: float) -> float:
    if t > 7.0:
        raise ValueError("too late")
    return 0.2 * math.sin(2 * math.pi * t / 20)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (_too_late, ("ValueError", "too late")),
        (lambda t: TABLE[int(t)], ("IndexError", "out of bounds")),
    ],
    ids=["raise", "index"],
)
@pytest.mark.parametrize("rows", [{}, {"t_eval": np.linspace(0, 20, 201)}], ids=["all", "t_eval"])
def test_functions_that_raise_end_the_run_and_keep_the_part_before(
    function: Signal, words: tuple[str, ...], rows: dict[str, Any]
) -> None:
    kept, said = both(MODEL, Prescribed(function), t_end=20.0, **rows)
    assert said.startswith("SimulationError")
    for word in ("signal 'v'", "the function raised", "kept", *words):
        assert word in said
    assert len(kept) > 1
    assert 0.1 < kept.t[-1] < 7.0


def test_with_only_the_end_recorded_time_and_state_match() -> None:
    """The run raises within steps; the recorded state was reached at the recorded time."""
    how = {"engine": "compiled", "output": "end", "method": "rk4", "step": 1e-2}
    end, _ = Run((MODEL, Prescribed(_too_late)), 20.0, how).outcome()
    assert end is not None
    t = float(end.t[-1])
    assert 0.0 <= t <= 7.0
    assert len(end.transitions) == 4
    assert end.x[-1] == pytest.approx(2 / math.pi * (1 - math.cos(math.pi * t / 10)), abs=1e-9)


@pytest.mark.parametrize(
    "function",
    [
        lambda t: 0.1 * math.sqrt(2.0 - t),
        lambda t: math.exp(400 * (t - 2.0)),
        lambda t: None,
        lambda t: (t, t),
        lambda t: "much",
        lambda t: 0.1 if t < 1.0 else math.nan,
    ],
    ids=["negative root", "overflow", "None", "a pair", "a text", "NaN"],
)
def test_no_number_ends_both_runs_with_the_same_words(function: Any) -> None:
    assert both(MODEL, Prescribed(function))[1]


def test_a_function_that_only_a_guard_reads_ends_the_run_where_it_raises() -> None:
    """Machine code does not stop by itself: no state becomes NaN. What it did is taken back."""
    states = State("a", {"z": "v"}), State("b", {"z": "-z"})
    edges = Transition("go", "a", "b", "u > 1"), Transition("back", "b", "a", "u < 0.5")
    chart = Chart("watched", ("v", "u"), ("z",), ("k",), states, edges, {"F": "k * z"})

    def late(t: float) -> float:
        if t > 3.0:
            raise ValueError("too late")
        return 0.5 * t

    system = System(
        "watched",
        bodies=(Body("mass", inertia=1.0, force="sin(t)"),),
        contacts=(Contact("pad", chart, {"k": 1.0}, inputs={"u": "u"}),),
        signals={"u": late},
    )
    kept, said = both(system)
    assert said.startswith("SimulationError")
    assert 2.0 < kept.t[-1] <= 3.0


def test_ctrl_c_in_a_function_keeps_the_rows() -> None:
    def interrupted(t: float) -> float:
        if t > 7.0:
            raise KeyboardInterrupt
        return 0.2 * math.sin(2 * math.pi * t / 20)

    with pytest.raises(KeyboardInterrupt) as caught:
        simulate(MODEL, Prescribed(interrupted), 20.0, engine="compiled")
    kept = caught.value.trace  # type: ignore[attr-defined]
    whole = simulate(MODEL, Prescribed("0.2*sin(2*pi*t/20)"), 20.0)
    assert len(kept.transitions) == 4
    assert 6.0 < kept.t[-1] <= 7.0
    np.testing.assert_array_equal(kept.states, whole.states[: len(kept)])
