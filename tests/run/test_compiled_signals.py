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

from gms_fsm import (
    Body,
    Chart,
    Contact,
    Prescribed,
    State,
    System,
    Transition,
    simulate,
    sweep,
)
from gms_fsm.foundation.store import CodeFolder
from gms_fsm.lowering import compiling as compiled
from gms_fsm.traces.failures import NotFiniteError, SimulationError
from tests.helpers import same_bits, stick_slip

pytestmark = pytest.mark.slow

pytest.importorskip("llvmlite", reason="needs the extra fast")

Signal = Callable[[float], float]
TABLE = np.array([0.1, 0.2, -0.2, 0.3])


# --------------------------------------------------------------------------- functions
def _of_numpy(t: float) -> float:
    return 0.2 * np.sin(2 * np.pi * t / 20) + np.interp(t, TABLE.cumsum(), TABLE) * 0.1


def _with_branches(t: float) -> float:
    if t < 4:
        return 0.15
    return -0.1 * (t - 4) if t < 7 else 0.2


def _whole_numbers(t: float) -> int:
    return 1 if t < 3 else -1


def _louder(level: float) -> Signal:
    return lambda t: level * math.sin(t)


class _Callable:
    def __call__(self, t: float) -> float:
        return 0.4 * math.cos(0.5 * t)

    def method(self, t: float) -> float:
        return 0.4 * math.cos(0.5 * t)


def _needs_more(t: float, level: float = 0.4) -> float:
    return level * math.sin(t)


def _of_python(t: float) -> float:
    return float(eval("0.1")) * t


def _of_the_world(t: float) -> float:
    return HERE[0] * t


def _nested(t: float) -> float:
    """A run within the run, by the same machine code."""
    inner = simulate(stick_slip("signed"), Prescribed(_needs_more), 0.1, engine="compiled")
    return inner.x[-1] + 0.2 * math.sin(t)


HERE = [0.1]


FUNCTIONS: dict[str, Signal] = {
    "numpy": _of_numpy,
    "branches": _with_branches,
    "integers": _whole_numbers,
    "a callable object": _Callable(),
    "a method": _Callable().method,
    "a partial": functools.partial(_needs_more, level=0.5),
    "two arguments": _needs_more,
    "eval": _of_python,
    "a ufunc": np.sin,
    "a builtin": math.sin,
    "a list that may change": _of_the_world,
}


@pytest.mark.parametrize("kind", FUNCTIONS)
def test_every_function_gives_the_same_trace(kind: str) -> None:
    model, rig = stick_slip("signed"), Prescribed(FUNCTIONS[kind])
    ours, theirs = (simulate(model, rig, 9.0, engine=e) for e in ("compiled", "machines"))
    same_bits(ours, theirs)
    assert len(ours.transitions) > 0


def test_a_function_may_itself_run_machine_code() -> None:
    model, rig = stick_slip("signed"), Prescribed(_nested)
    ours, theirs = (simulate(model, rig, 0.5, engine=e) for e in ("compiled", "machines"))
    same_bits(ours, theirs)


def test_functions_with_the_same_text_are_not_confused() -> None:
    """Closures share their code and their name; their enclosed values are read each time."""
    model = stick_slip("signed")
    levels = 0.3, 0.5
    found = [
        simulate(model, Prescribed(_louder(level)), 4.0, engine="compiled") for level in levels
    ]
    for level, trace in zip(levels, found, strict=True):
        same_bits(trace, simulate(model, Prescribed(_louder(level)), 4.0))
    assert len(found[0]) != len(found[1]) or (found[0].F != found[1].F).any()


def test_machine_code_depends_on_no_function(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "store", lambda: CodeFolder.at(tmp_path))
    model = stick_slip("signed")
    for factor in (0.1, 0.2):
        rig = Prescribed(functools.partial(lambda factor, t: factor * t, factor))
        simulate(model, rig, 1.0, engine="compiled")
        assert len(list(tmp_path.iterdir())) == 1


def test_threads_have_errors_of_their_own() -> None:
    """They share machine code; a failure in one does not end the run of another."""
    failing = 0.2

    def velocity(t: float) -> float:
        if threading.current_thread().name == "failing" and t > failing:
            raise ValueError("here only")
        return 0.1 * t

    outcomes: dict[str, str] = {}

    def run() -> None:
        name = threading.current_thread().name
        try:
            simulate(stick_slip("signed"), Prescribed(velocity), 2.0, engine="compiled")
            outcomes[name] = "ok"
        except SimulationError as error:
            outcomes[name] = error.reason

    names = ["first", "failing", "last"]
    threads = [threading.Thread(target=run, name=name) for name in names]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert outcomes["first"] == outcomes["last"] == "ok"
    assert "here only" in outcomes["failing"]


# --------------------------------------------------------------------------- raising
def _too_late(t: float) -> float:
    if t > 7.0:
        raise ValueError("too late")
    return 0.2 * math.sin(2 * math.pi * t / 20)


def _out_of_bounds(t: float) -> float:
    return TABLE[int(t)]


@pytest.mark.parametrize(
    ("function", "words"),
    [(_too_late, ("ValueError", "too late")), (_out_of_bounds, ("IndexError", "out of bounds"))],
    ids=["raise", "index"],
)
@pytest.mark.parametrize("rows", [{}, {"t_eval": np.linspace(0, 20, 201)}], ids=["all", "t_eval"])
def test_functions_that_raise_end_the_run_and_keep_the_part_before(
    function: Signal, words: tuple[str, ...], rows: dict[str, Any]
) -> None:
    model, rig = stick_slip("signed"), Prescribed(function)
    kept = []
    for engine in ("machines", "compiled"):
        with pytest.raises(SimulationError) as caught:
            simulate(model, rig, 20.0, engine=engine, **rows)
        for word in ("signal 'v'", "the function raised", "kept", *words):
            assert word in str(caught.value)
        kept.append(caught.value.trace)
    same_bits(*kept)
    assert len(kept[0]) > 1
    assert 0.1 < kept[0].t[-1] < 7.0


def test_with_only_the_end_recorded_time_and_state_match() -> None:
    """The run raises within steps; the recorded state was reached at the recorded time."""
    with pytest.raises(SimulationError) as caught:
        simulate(
            stick_slip("signed"),
            Prescribed(_too_late),
            20.0,
            engine="compiled",
            output="end",
            method="rk4",
            step=1e-2,
        )
    end = caught.value.trace
    t = float(end.t[-1])
    assert 0.0 <= t <= 7.0
    assert len(end.transitions) == 4
    assert end.x[-1] == pytest.approx(2 / math.pi * (1 - math.cos(math.pi * t / 10)), abs=1e-9)


def test_in_a_sweep_it_is_the_outcome_of_its_run() -> None:
    result = sweep(
        stick_slip("signed"),
        Prescribed(_too_late),
        20.0,
        {"sigma_2": [0.1, 0.2, 0.1]},
        output="t_eval",
        t_eval=[0.0, 1.0, 5.0, 10.0],
    )
    assert result.outcome.tolist() == ["SimulationError"] * 3
    assert result.transition_count.tolist() == [4] * 3
    assert np.isfinite(result.rows["F"][:, :3]).all()
    assert np.isnan(result.rows["F"][:, 3]).all()
    np.testing.assert_array_equal(result.rows["F"][0], result.rows["F"][2])
    assert (result.rows["F"][0, 1:3] != result.rows["F"][1, 1:3]).all()


def _nothing(t: float) -> None:
    return None


@pytest.mark.parametrize(
    "function",
    [
        lambda t: 0.1 * math.sqrt(2.0 - t),
        lambda t: math.exp(400 * (t - 2.0)),
        _nothing,
        lambda t: (t, t),
        lambda t: "much",
    ],
    ids=["negative root", "overflow", "None", "a pair", "a text"],
)
def test_no_number_ends_both_runs_with_the_same_words(function: Any) -> None:
    model, rig = stick_slip("signed"), Prescribed(function)
    caught = []
    for engine in ("machines", "compiled"):
        with pytest.raises(SimulationError) as one:
            simulate(model, rig, 10.0, engine=engine)
        caught.append(one.value)
    same_bits(*(each.trace for each in caught))
    assert str(caught[0]) == str(caught[1])
    assert type(caught[0]) is type(caught[1])


def test_a_function_that_only_a_guard_reads_ends_the_run_where_it_raises() -> None:
    """Machine code does not stop by itself: no state becomes NaN. What it did is taken back."""
    chart = Chart(
        "watched",
        ("v", "u"),
        ("z",),
        ("k",),
        (State("a", {"z": "v"}), State("b", {"z": "-z"})),
        (Transition("go", "a", "b", "u > 1"), Transition("back", "b", "a", "u < 0.5")),
        {"F": "k * z"},
    )
    contact = Contact("pad", chart, {"k": 1.0}, inputs={"u": "u"})
    body = Body("mass", inertia=1.0, force="sin(t)")

    def late(t: float) -> float:
        if t > 3.0:
            raise ValueError("too late")
        return 0.5 * t

    system = System("watched", bodies=(body,), contacts=(contact,), signals={"u": late})
    caught = []
    for engine in ("machines", "compiled"):
        with pytest.raises(SimulationError) as one:
            simulate(system, 10.0, engine=engine)
        caught.append(one.value)
    same_bits(*(each.trace for each in caught))
    assert str(caught[0]) == str(caught[1])
    assert 2.0 < caught[0].trace.t[-1] <= 3.0


def test_ctrl_c_in_a_function_keeps_the_rows() -> None:
    def interrupted(t: float) -> float:
        if t > 7.0:
            raise KeyboardInterrupt
        return 0.2 * math.sin(2 * math.pi * t / 20)

    with pytest.raises(KeyboardInterrupt) as caught:
        simulate(stick_slip("signed"), Prescribed(interrupted), 20.0, engine="compiled")
    kept = caught.value.trace  # type: ignore[attr-defined]
    whole = simulate(stick_slip("signed"), Prescribed("0.2*sin(2*pi*t/20)"), 20.0)
    assert len(kept.transitions) == 4
    assert 6.0 < kept.t[-1] <= 7.0
    np.testing.assert_array_equal(kept.states, whole.states[: len(kept)])


def test_nan_is_not_finite_in_both() -> None:
    def stops(t: float) -> float:
        return 0.1 if t < 1.0 else math.nan

    said = []
    for engine in ("machines", "compiled"):
        with pytest.raises(NotFiniteError) as caught:
            simulate(stick_slip("signed"), Prescribed(stops), 4.0, engine=engine)
        said.append(str(caught.value))
    assert said[0] == said[1]
