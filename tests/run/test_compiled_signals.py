"""A Python function of t can drive a compiled run, if numba can compile it.

The trace then equals that of the machines engine to 1e-12. A function that cannot be compiled is
refused by the signal's name before anything runs; one that raises ends the run with an explanation,
and the part before it is kept.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Slider, Trace, simulate, sweep
from gms_fsm.errors import SignalError
from gms_fsm.lowering import _compiled as compiled
from gms_fsm.lowering._store import Store
from gms_fsm.systems.rigs import Rig
from gms_fsm.traces.failures import NotFiniteError, SimulationError
from tests.helpers import event_sequence, non_drifting, same_bits, stick_slip

pytestmark = pytest.mark.slow

numba = pytest.importorskip("numba", reason="needs the extra fast")

Signal = Callable[[float], float]
TABLE = np.array([0.1, 0.2, -0.2, 0.3])


# --------------------------------------------------------------------------- compilable
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


@numba.njit
def _helper(t):
    return math.cos(t)


@numba.njit
def _jitted(t):
    return 0.2 * _helper(2 * math.pi * t / 13)


@numba.njit("float64(float64)", error_model="python", fastmath=False)
def _jitted_eagerly(t):
    return 0.3 * math.tanh(t - 2.0)


def _calls_compiled(t: float) -> float:
    return 0.5 * _helper(t)


def _close(a: Trace, b: Trace) -> None:
    """Assert the same events in the same order, and numbers to 1e-12."""
    assert event_sequence(a) == event_sequence(b)
    np.testing.assert_array_equal(a.microstep, b.microstep)
    np.testing.assert_array_equal(a.states, b.states)
    for name in ("t", "x", "v", "z", "s", "F", "F_elements"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    "function",
    [
        _of_numpy,
        _with_branches,
        _whole_numbers,
        _jitted,
        _jitted_eagerly,
        _calls_compiled,
    ],
    ids=lambda function: getattr(function, "__name__", ""),
)
def test_compilable_functions_give_the_same_trace(function: Signal) -> None:
    model, rig = stick_slip("signed"), Prescribed(function)
    traces = [simulate(model, rig, 9.0, engine=engine) for engine in ("machines", "compiled")]
    _close(*traces)
    assert len(traces[0].transitions) > 0
    ends = [
        simulate(model, rig, 9.0, engine=engine, output="end")
        for engine in ("machines", "compiled")
    ]
    _close(*ends)


def test_a_function_that_pushes_a_slider() -> None:
    model, _ = non_drifting("signed", slipping=True)
    rig = Slider(1.0, lambda t: 0.6 * math.sin(0.7 * t))
    traces = [simulate(model, rig, 10.0, engine=engine) for engine in ("machines", "compiled")]
    _close(*traces)
    assert len(traces[0].transitions) > 0


def test_functions_with_the_same_text_are_not_confused() -> None:
    """Closures share their code and their name; their enclosed values are read each time."""
    model = stick_slip("signed")
    levels = 0.3, 0.5
    found = [
        simulate(model, Prescribed(_louder(level)), 4.0, engine="compiled") for level in levels
    ]
    for level, trace in zip(levels, found, strict=True):
        _close(trace, simulate(model, Prescribed(_louder(level)), 4.0))
    assert len(found[0]) != len(found[1]) or (found[0].F != found[1].F).any()


def test_functions_that_may_change_are_not_cached_on_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "store", lambda: Store.at(tmp_path))
    model = stick_slip("signed")
    simulate(model, Prescribed(lambda t: 0.1 * t), 1.0, engine="compiled")
    assert not [path.name for path in tmp_path.iterdir() if path.match("flow*")]
    simulate(model, Prescribed("0.1237 * t"), 1.0, engine="compiled")
    assert [path.name for path in tmp_path.iterdir() if path.match("flow*")]


# --------------------------------------------------------------------------- not compilable
class _Callable:
    def __call__(self, t: float) -> float:
        return 0.1

    def method(self, t: float) -> float:
        return 0.1


def _needs_more(t: float, level: float = 0.1) -> float:
    return level


def _of_python(t: float) -> float:
    return float(eval("0.1"))


def _nothing(t: float) -> None:
    return None


def _text(t: float) -> str:
    return "0.1"


def _pair(t: float) -> tuple[float, float]:
    return t, t


def _of_the_world(t: float) -> float:
    return HERE[0]


HERE = [0.1]
REFUSED = {
    "a callable object": _Callable(),
    "a method": _Callable().method,
    "a partial": functools.partial(_needs_more, level=0.2),
    "two arguments": _needs_more,
    "eval": _of_python,
    "a ufunc": np.sin,
    "a builtin": math.sin,
    "None": _nothing,
    "a text": _text,
    "a pair": _pair,
    "a list that may change": _of_the_world,
}


@pytest.mark.parametrize("kind", REFUSED)
def test_functions_that_numba_cannot_compile_are_refused_by_name(kind: str) -> None:
    rigs: dict[str, Rig] = {"v": Prescribed(REFUSED[kind]), "F_a": Slider(1.0, REFUSED[kind])}
    for name, rig in rigs.items():
        with pytest.raises(SignalError) as caught:
            simulate(stick_slip("signed"), rig, 1.0, engine="compiled")
        for word in (f"signal {name!r}", "numba cannot compile", "engine='machines'", "expression"):
            assert word in str(caught.value)
        assert str(caught.value).isprintable()
        assert "Failed in nopython" not in str(caught.value), "which explains nothing"
        assert not isinstance(caught.value, SimulationError)


def test_a_sweep_refuses_it_in_every_row() -> None:
    result = sweep(stick_slip("signed"), Prescribed(_Callable()), 1.0, {"sigma_2": [0.1, 0.2, 0.3]})
    assert result.outcome.tolist() == ["SignalError"] * 3
    assert all("signal 'v'" in text for text in result.message)


# --------------------------------------------------------------------------- raising
def _too_late(t: float) -> float:
    if t > 7.0:
        raise ValueError("too late")
    return 0.2 * math.sin(2 * math.pi * t / 20)


def _out_of_bounds(t: float) -> float:
    return TABLE[int(t)]


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (_too_late, ("ValueError", "too late")),
        (_out_of_bounds, ("IndexError", "out of bounds")),
    ],
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


def test_the_next_run_is_not_disturbed() -> None:
    model, rig = stick_slip("signed"), Prescribed(_too_late)
    with pytest.raises(SimulationError):
        simulate(model, rig, 20.0, engine="compiled")
    same_bits(simulate(model, rig, 6.5, engine="compiled"), simulate(model, rig, 6.5))


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


@pytest.mark.parametrize(
    "function", [lambda t: 0.1 * math.sqrt(2.0 - t), lambda t: math.exp(400 * (t - 2.0))]
)
def test_a_function_that_leaves_its_domain(function: Signal) -> None:
    """There Python raises and machine code yields NaN or infinity; both runs end before it."""
    model, rig = stick_slip("signed"), Prescribed(function)
    with pytest.raises(SimulationError) as ours:
        simulate(model, rig, 10.0)
    with pytest.raises(NotFiniteError) as compiled_one:
        simulate(model, rig, 10.0, engine="compiled")
    early, late = ours.value.trace, compiled_one.value.trace
    assert early.t[-1] <= late.t[-1] < 4.0
    shared = min(len(early), len(late)) // 2
    np.testing.assert_allclose(early.z[:shared], late.z[:shared], rtol=1e-12, atol=1e-12)


def test_nan_is_not_finite_in_both() -> None:
    def stops(t: float) -> float:
        return 0.1 if t < 1.0 else math.nan

    said = []
    for engine in ("machines", "compiled"):
        with pytest.raises(NotFiniteError) as caught:
            simulate(stick_slip("signed"), Prescribed(stops), 4.0, engine=engine)
        said.append(str(caught.value))
    assert said[0] == said[1]
