"""However a motion is given (expression, ramps, record, function), the run is the same.

Jumps are right-continuous, a record has no value outside its range, and anything else is refused
with its value.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, SimulationError, Trace, simulate
from gms_fsm.systems.signals import Corners, Formula, as_signal, first_after, piecewise_linear
from gms_fsm.traces.failures import NotFiniteError, SignalEndError
from tests.helpers import stick_slip

CORNERS = [(0.0, 0.0), (1.0, 0.2), (8.0, 0.2), (10.0, -0.2), (17.0, -0.2), (19.0, 0.1)]
TIMES, VALUES = (np.array(column) for column in zip(*CORNERS, strict=True))
TEXT = "min(0.2*t, 0.2) - max(0, min(0.2*(t - 8), 0.4)) + max(0, min(0.15*(t - 17), 0.3))"
SAME_MOTION: dict[str, Any] = {
    "expression": TEXT,
    "ramps": CORNERS,
    "ramps as tuples": tuple(CORNERS),
    "ramps as an array": np.array(CORNERS),
    "record of arrays": (TIMES, VALUES),
    "record of lists": (TIMES.tolist(), VALUES.tolist()),
    "fine record": (np.linspace(0, 19, 1901), np.interp(np.linspace(0, 19, 1901), TIMES, VALUES)),
    "function": lambda t: float(np.interp(t, TIMES, VALUES)),
    "function of a numpy number": lambda t: np.interp(t, TIMES, VALUES),
    "signal": Formula(TEXT),
}
GRID = np.linspace(0.0, 19.0, 78)


def _run(signal: Any, **options: Any) -> Trace:
    return simulate(
        stick_slip("signed"),
        Prescribed(signal),
        19.0,
        t_eval=GRID,
        rtol=1e-8,
        atol=1e-11,
        **options,
    )


@pytest.fixture(scope="module")
def reference() -> Trace:
    return _run(CORNERS)


@pytest.mark.parametrize("given", SAME_MOTION)
def test_the_same_motion_gives_the_same_run(given: str, reference: Trace) -> None:
    trace = _run(SAME_MOTION[given])
    assert len(reference.transitions) > 8
    assert trace.transitions.edge.tolist() == reference.transitions.edge.tolist()
    assert trace.transitions.element.tolist() == reference.transitions.element.tolist()
    # The corners of a function are unknown; only error control detects them.
    close = 1e-5 if given.startswith("function") else 1e-7
    np.testing.assert_allclose(trace.transitions.t, reference.transitions.t, atol=10 * close)
    np.testing.assert_allclose(trace.v, np.interp(GRID, TIMES, VALUES), atol=1e-15)
    np.testing.assert_allclose(trace.x, reference.x, atol=close)
    np.testing.assert_allclose(trace.z, reference.z, atol=10 * close)
    np.testing.assert_array_equal(trace.states, reference.states)


@pytest.mark.parametrize(
    "number", [0.1, 1, 0, np.float64(0.1), np.float32(0.5), np.int64(1)], ids=lambda u: repr(u)
)
def test_a_number_is_a_constant(number: Any) -> None:
    trace = simulate(stick_slip("signed"), Prescribed(number), 2.0, t_eval=[0.0, 1.0, 2.0])
    assert trace.v.tolist() == [float(number)] * 3
    assert trace.x.tolist() == pytest.approx([0.0, float(number), 2 * float(number)], abs=1e-12)


def test_ramps_are_held_before_the_first_and_after_the_last_corner() -> None:
    trace = simulate(
        stick_slip("signed"), Prescribed([(1.0, 0.1), (2.0, 0.3)]), 4.0, t_eval=[0, 1, 1.5, 2, 4]
    )
    assert trace.v.tolist() == pytest.approx([0.1, 0.1, 0.2, 0.3, 0.3], abs=1e-15)
    assert trace.x[-1] == pytest.approx(0.1 + 0.2 + 0.6, abs=1e-12)


def test_two_corners_at_one_time_are_a_jump_with_the_value_after_it() -> None:
    jump = [(0.0, 0.1), (1.0, 0.1), (1.0, -0.3), (2.0, -0.3)]
    trace = simulate(stick_slip("signed"), Prescribed(jump), 2.0, t_eval=[0.5, 1.0, 1.5])
    assert trace.v.tolist() == [0.1, -0.3, -0.3]
    assert trace.x.tolist() == pytest.approx([0.05, 0.1, -0.05], abs=1e-12)
    assert trace.z[:, 0].tolist() == pytest.approx([0.05, 0.1, -0.05], abs=1e-12)
    assert as_signal(jump).jumps.tolist() == [1.0]  # type: ignore[union-attr]
    twice = [(0.0, 0.1), (1.0, 0.3), (1.0, 0.3), (2.0, 0.1)]
    assert as_signal(twice).jumps.tolist() == []  # type: ignore[union-attr]


def test_a_jump_can_release_an_element_at_once() -> None:
    jump = [(0.0, 0.5), (1.0, 0.5), (1.0, 0.0), (3.0, 0.0), (3.0, 0.5)]
    trace = simulate(stick_slip("signed"), Prescribed(jump), 5.0)
    # z = 0.5 > 0.4 = s at t = 0.8: slip; at rest s is 1.5 and |z| < s: all arrest at the jump; and
    # at the next jump s falls below z again: all break away there.
    np.testing.assert_allclose(trace.transitions.t, [0.8] * 4 + [1.0] * 4 + [3.0] * 4, atol=1e-9)
    assert trace.transitions.edge.tolist() == (
        ["break_away_forward"] * 4 + ["arrest"] * 4 + ["break_away_forward"] * 4
    )


def test_piecewise_linear_is_numpys_interpolation_between_jumps() -> None:
    for t in np.linspace(-1.0, 20.0, 211):
        assert piecewise_linear(t, TIMES.tolist(), VALUES.tolist()) == pytest.approx(
            float(np.interp(t, TIMES, VALUES)), abs=1e-15
        )
    assert piecewise_linear(1.0, [0.0, 1.0, 1.0, 1.0], [0.0, 1.0, 7.0, 9.0]) == 9.0


SPACED = {
    "evenly": (0.1 * np.arange(40)).tolist(),
    "far from 0": (1e9 + 1e-3 * np.arange(30)).tolist(),
    "growing": (1.3 ** np.arange(30)).tolist(),
    "with jumps": [0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 5.0, 5.0],
    "all of one time": [2.0] * 3,
    "one": [2.0],
    "of all sizes": [-1.7e308, -1.0, -5e-324, 0.0, 5e-324, 1e300, 1.7e308],
}


@pytest.mark.parametrize("times", SPACED.values(), ids=SPACED)
def test_the_first_corner_after_a_time_is_that_of_a_bisection(times: list[float]) -> None:
    near = [math.nextafter(t, way) for t in times for way in (-math.inf, math.inf)]
    between = (2.0 * np.linspace(times[0] / 2, times[-1] / 2, 99)).tolist()
    for t in [*times, *near, *between, math.inf, -math.inf]:
        assert first_after(t, times) == bisect_right(times, t)


@dataclass
class Ramp:
    """A callable that compares by only part of its data, and cannot be hashed."""

    unit: str
    slope: float = field(compare=False)

    def __call__(self, t: float) -> float:
        return self.slope * t


def test_a_callable_object_is_not_replaced_by_an_equal_one() -> None:
    for slope in (0.1, 0.2):
        trace = simulate(stick_slip("signed"), Prescribed(Ramp("m/s", slope)), 1.0)
        assert trace.v[-1] == slope


def test_a_signal_keeps_its_own_copy() -> None:
    times, values = np.array([0.0, 1.0]), np.array([0.0, 5.0])
    signal = as_signal((times, values))
    assert isinstance(signal, Corners)
    times[0] = values[0] = 9.0
    assert (signal.times[0], signal.values[0]) == (0.0, 0.0)
    with pytest.raises(ValueError, match="read-only"):
        signal.times[0] = 1.0


@pytest.mark.parametrize(
    ("given", "held"),
    [
        ([(0, 1), (0, 5)], True),
        ([[0, 1], [0, 5]], True),
        (np.array([[0, 1], [0, 5]]), True),
        (([0, 1], [0, 5]), False),
        ((np.array([0, 1]), (0, 5)), False),
    ],
    ids=repr,
)
def test_pairs_are_ramps_and_a_pair_of_columns_is_a_record(given: Any, held: bool) -> None:
    signal = as_signal(given)
    assert isinstance(signal, Corners)
    expected = ([0, 0], [1, 5]) if held else ([0, 1], [0, 5])
    assert (signal.times.tolist(), signal.values.tolist()) == expected
    assert signal.held == held


# --------------------------------------------------------------------------- signals that end
def _fails(error: type[SimulationError], signal: Any, t_end: float, **options: Any) -> Any:
    with pytest.raises(error) as caught:
        simulate(stick_slip("signed"), Prescribed(signal), t_end, **options)
    return caught.value


@pytest.mark.parametrize(
    ("rows", "method"),
    [(None, {}), ([0.0, 1.5, 2.5, 3.0, 3.5, 5.0], {"method": "rk4", "step": 0.0101})],
    ids=["steps", "t_eval"],
)
def test_a_record_that_ends_early_keeps_the_run_so_far(rows: Any, method: Any) -> None:
    """One that ends exactly with the run is long enough."""
    record = ([0.0, 1.0, 2.0, 3.0], [0.0, 0.2, 0.2, 0.1])
    error = _fails(SignalEndError, record, 5.0, t_eval=rows, **method)
    for word in ("a sampled signal at t = 3.0 s", "t_end = 5.0 s", "t_end <= 3.0"):
        assert word in str(error)
    whole = simulate(
        stick_slip("signed"),
        Prescribed(record),
        3.0,
        t_eval=None if rows is None else rows[:4],
        **method,
    )
    assert error.trace.t[-1] == 3.0
    np.testing.assert_array_equal(error.trace.t, whole.t)
    np.testing.assert_array_equal(error.trace.z, whole.z)


def _raise(_: float) -> float:
    raise RuntimeError("sensor unplugged")


FAILS: dict[str, tuple[Callable[[float], Any], str]] = {
    "raises": (_raise, "sensor unplugged"),
    "nan": (lambda t: float("nan"), "not finite"),
    "inf": (lambda t: float("inf"), "not finite"),
    "string": (lambda t: "fast", "fast"),
    "none": (lambda t: None, "'v'"),
    "complex": (lambda t: 1j, "'v'"),
    "array": (lambda t: np.zeros(3), "'v'"),
}
STEPS: dict[str, dict[str, Any]] = {
    "dp45": {},
    "rk4": {"method": "rk4", "step": 0.01},
    "step": {"events": "step", "step": 0.01},
}


@pytest.mark.parametrize("method", STEPS)
@pytest.mark.parametrize("how", FAILS)
def test_a_function_that_fails_keeps_the_run_so_far(how: str, method: str) -> None:
    """The message names the time at which the trace ends; at once there is no row, or one."""
    then, word = FAILS[how]
    error = _fails(SimulationError, lambda t: 0.3 if t <= 2.0 else then(t), 5.0, **STEPS[method])
    trace = error.trace
    assert 0.0 < trace.t[-1] <= 2.0 + 1e-9
    np.testing.assert_allclose(trace.x, 0.3 * trace.t, atol=1e-9)
    assert word in str(error)
    assert "t = " in str(error)
    if method != "dp45":
        assert trace.t[-1] > 1.97, "fixed steps reach the last whole step before the break"
        assert len(trace.transitions) == 4
    if word == "not finite":
        assert isinstance(error, NotFiniteError)
        assert str(error).startswith(f"t = {float(trace.t[-1])!r} s: ")
    at_once = _fails(SimulationError, then, 5.0).trace
    assert at_once.z.shape == (len(at_once), 4) in [(0, 4), (1, 4)]


@pytest.mark.parametrize(
    ("text", "t_break"),
    [("0.1*sqrt(2 - t)", 2.0), ("0.01/(2 - t)", 2.0), ("exp(400*t)", 1.775), ("1/0 + t", 0.0)],
)
def test_an_expression_that_becomes_undefined_keeps_the_run_so_far(
    text: str, t_break: float
) -> None:
    error = _fails(SimulationError, text, 5.0)
    assert isinstance(error, NotFiniteError) or "1/0" not in text
    assert len(error.trace) >= 1 or t_break == 0.0
    if len(error.trace):
        assert error.trace.t[-1] <= t_break + 1e-6
        assert np.isfinite(error.trace.rows.y).all()
