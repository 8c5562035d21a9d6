"""Steps end where they must (grid, knots, requested rows, crossings) and no step is wasted."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from types import SimpleNamespace

import pytest
from scipy.integrate import RK45

from gms_fsm import Chart, ChartModel, NotFiniteError, Prescribed, State, simulate
from integrators import advance as kernel
from integrators.hybrid import Buffers, Equations, LoopOptions, buffers
from integrators.runners.scipy_arcs import SciPyStepper
from integrators.sliding import Surfaces
from integrators.step_size import LEAST_ROOT, memory_of, next_factor, root_of
from integrators.steps import ArcMotion
from integrators.tableaux import DP45, RK4


def nothing_follows(t: float, y: list, mode: list, held: list, p: None) -> None:
    """Set no component: none is determined by others."""


class _Run:
    """A run of y' = slope(t, y), y(0) = 1, without machines, called directly."""

    def __init__(
        self,
        slope: Callable[[float, float], float] = lambda t, y: 0.0,
        margin: Callable[[float, float], float] | None = None,
        *,
        t: float = 0.0,
        step: float | None = None,
        max_step: float = math.inf,
        tolerance: float = 1e-6,
        times: list[float] | None = None,
        knots: tuple[float, ...] = (),
        capacity: int | None = None,
        origin: float = 0.0,
    ) -> None:
        self.asked: list[float] = []

        def flow(t: float, y: list, mode: list, held: list, p: None, dy: list) -> None:
            self.asked.append(t)
            dy[0] = slope(t, y[0])

        def margins(t: float, y: list, mode: list, p: None, watch: list, out: list) -> None:
            assert margin is not None, "nothing is watched, but margins are requested"
            out[0] = margin(t, y[0])

        equations = Equations(
            flow=flow,
            flow_live=flow,
            arm=lambda *_: None,
            margins=margins,
            normal=lambda *_: None,
            p=None,
            held=0,
            strict=[False],
            relations=["g"],
            surfaces=Surfaces(*[[]] * 8),
            knots=list(knots),
        )
        method = RK4 if step else DP45
        options = LoopOptions(
            method, step, tolerance, [tolerance], max_step, 0.0, 10**6, True, times
        )
        self.b: Buffers = buffers(equations, origin, [1.0], [], 100.0, options, capacity)
        self.motion, self.y = ArcMotion(flow, margins, None, nothing_follows), self.b.now.y
        self.b.now.t, self.b.now.f[0] = t, slope(t, 1.0)
        if margin is not None:
            w = self.b.relations
            w.watch[0] = 1
            w.active.append(0)
            w.start[0] = margin(t, 1.0)
            w.truth[0] = w.start[0] >= 0.0

    def to(
        self, t_stop: float, *, h: float = 0.1, before: float = 1.0, steps: int = 1000
    ) -> tuple[int, float, float, float]:
        b, now = self.b, self.b.now
        now.t_stop, now.h, now.error_before = t_stop, h, before
        status = kernel.advance(self.motion, b.plan, b.now, b.relations, b.out, b.scratch, steps)
        return status, now.t, now.h, now.error_before

    @property
    def rows(self) -> list[float]:
        return self.b.out.rows_t[: self.b.out.row]


def test_fixed_steps_end_on_the_grid_wherever_they_begin() -> None:
    run = _Run(step=0.25)
    assert run.to(1.1)[:2] == (kernel.REACHED, 1.1)
    assert run.rows == [0.25, 0.5, 0.75, 1.0, 1.1]
    late = _Run(step=0.25, t=0.6)
    late.to(1.25)
    assert late.rows == [0.75, 1.0, 1.25]
    shifted = _Run(step=0.25, t=2.1, origin=2.1)
    shifted.to(3.0)
    assert shifted.rows == [2.35, 2.6, 2.85, 3.0]


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_no_sliver_is_stepped_at_either_end(share: float) -> None:
    sliver = share * kernel.tick_at(0.125)
    run = _Run(step=0.25, t=0.5 - sliver)
    run.to(1.0 + sliver)
    assert run.rows == [0.75, 1.0 + sliver]
    adaptive = _Run()
    adaptive.to(0.125 + sliver, h=0.125)
    assert adaptive.rows == [0.125 + sliver]


@pytest.mark.parametrize("step", [None, 0.25])
def test_steps_end_on_knots_and_continue_as_before(step: float | None) -> None:
    run = _Run(step=step, knots=(0.0, 0.3, 0.31, 5.0), max_step=0.25)
    run.to(1.0, h=0.25)
    assert {0.3, 0.31, 1.0} <= set(run.rows)
    assert 4 <= len(run.rows) <= 6


def test_no_step_is_longer_than_the_longest_allowed() -> None:
    run = _Run(max_step=0.3)
    run.to(3.0)
    assert max(b - a for a, b in zip([0.0, *run.rows], run.rows, strict=False)) <= 0.3 + 1e-12
    assert 10 <= len(run.rows) <= 12


def test_a_step_cut_short_by_a_stop_does_not_shorten_the_one_after_it() -> None:
    assert _Run().to(1e-9, h=0.5)[2] == 0.5  # ten times the sliver would be 1e-8
    assert _Run().to(0.2, h=0.5)[2] == 2.0  # but it may grow from the tried length: 10 * 0.2
    assert _Run().to(0.5, h=0.5)[2] == 5.0


def test_the_step_after_a_rejected_one_does_not_grow_at_once() -> None:
    run = _Run(lambda t, y: math.inf if t > 0.3 else 1.0)
    assert run.to(100.0, h=1.0, steps=1)[1:3] == (0.2, 0.2)  # a fifth; no error from there on
    assert run.to(100.0, h=0.05, steps=1)[2] == pytest.approx(0.5)  # but the next one may grow


@pytest.mark.parametrize("start", [0.0, 7.0])  # later on, a step's end is rounded
def test_a_narrowly_accepted_step_is_followed_by_a_shorter_one(start: float) -> None:
    narrow = 0
    for i in range(60):
        h = 0.04 + 0.001 * i
        run = _Run(lambda t, y: math.cos(40.0 * (t - start)), t=start)
        _, t, h_next, memory = run.to(start + 10.0, h=h, steps=1)
        assert memory <= 1.0
        root = memory * memory  # of the error
        if t == start + h and root > 0.97:
            narrow += 1
            assert h_next == pytest.approx(h * next_factor(root, 1.0), rel=1e-12)
            assert h_next < h
    assert narrow >= 1


def test_the_controller_remembers_the_last_error_but_never_that_there_was_none() -> None:
    none = _Run().to(1.0, steps=1)[3]
    assert none == memory_of(root_of(0.0, 5)) == math.sqrt(LEAST_ROOT)
    run = _Run(lambda t, y: math.cos(40.0 * t))
    assert none < run.to(10.0, h=0.04, steps=1)[3] <= 1.0


@pytest.mark.parametrize("order", [3, 5])
def test_the_controller_computes_nearly_the_usual_powers_of_the_error(order: int) -> None:
    for error in (0.15, 0.5, 1.0):
        for before in (0.01, 1.0):
            usual = 0.9 * error ** (-0.7 / order) * before ** (0.35 / order)
            factor = next_factor(root_of(error, order), memory_of(root_of(before, order)))
            assert factor == pytest.approx(usual, rel=0.2)


@pytest.mark.parametrize("order", [3, 5])
def test_after_a_far_too_short_step_the_next_is_about_half_as_long_as_allowed(
    order: int,
) -> None:
    for error in (0.01, 1e-3, 1e-4, 1e-6, 1e-12):
        allowed = error ** (-1.0 / order)
        for before in (1e-10, 1.0):
            factor = next_factor(root_of(error, order), memory_of(root_of(before, order)))
            assert min(10.0, 0.4 * allowed) <= factor <= min(10.0, 0.9 * allowed)


def test_it_returns_when_the_steps_or_the_rows_are_used_up() -> None:
    run = _Run(step=0.25)
    assert run.to(100.0, steps=3)[:2] == (kernel.FULL, 0.75)
    assert run.to(100.0, steps=1)[:2] == (kernel.FULL, 1.0)
    full = _Run(step=0.25, capacity=2)
    assert full.to(100.0)[:2] == (kernel.FULL, 0.5)
    assert full.rows == [0.25, 0.5]
    wanted = _Run(step=0.25, times=[0.3], capacity=1)  # one row per time, however many steps
    assert wanted.to(1.0)[:2] == (kernel.REACHED, 1.0)


def test_rows_at_wanted_times_are_right_continuous_and_each_written_once() -> None:
    run = _Run(lambda t, y: 2.0 * t, times=[0.0, 0.1, 0.3, 0.5, 1.0], step=0.5)
    run.to(0.5)
    assert run.rows == [0.0, 0.1, 0.3]
    run.to(1.0)
    assert run.rows == [0.0, 0.1, 0.3, 0.5]
    for t, (y,) in zip(run.rows, run.b.out.rows_y, strict=False):
        assert y == pytest.approx(1.0 + t * t, abs=1e-14)


def test_a_crossing_ends_the_arc_there_with_state_and_row() -> None:
    for step in (0.25, None):
        run = _Run(lambda t, y: 2.0 * t, lambda t, y: y - 1.36, step=step)
        status, t, _, _ = run.to(2.0)
        assert (status, t) == (kernel.CROSSED, pytest.approx(0.6, abs=1e-12))
        assert run.y[0] == pytest.approx(1.36, abs=1e-12)
        assert run.y[0] >= 1.36
        assert run.rows[-1] == t


def test_rows_after_a_crossing_wait_for_the_switch() -> None:
    run = _Run(lambda t, y: 1.0, lambda t, y: y - 1.6, step=1.0, times=[0.5, 0.7])
    assert run.to(1.0)[0] == kernel.CROSSED
    assert run.rows == [0.5]


def test_an_adaptive_step_with_an_early_crossing_is_repeated_up_to_it() -> None:
    run = _Run(lambda t, y: math.cos(t), lambda t, y: t - 0.2)
    _, t, _, _ = run.to(2.0, h=0.5)
    assert t == pytest.approx(0.2, abs=1e-12)
    assert max(run.asked) >= 0.5
    assert max(run.asked[-6:]) <= 0.2 + 1e-12  # no stage of the accepted step lies beyond it
    later = _Run(lambda t, y: 1.0, lambda t, y: t - 0.9)  # after a quiet step in the same call
    assert later.to(2.0, h=0.1)[1] == pytest.approx(0.9, abs=1e-12)
    assert later.rows[0] == 0.1
    assert max(later.asked[-6:]) <= 0.9 + 1e-12
    late = _Run(lambda t, y: math.cos(t), lambda t, y: t - 0.097)
    late.to(2.0, h=0.1)
    assert max(late.asked[-6:]) == 0.1  # near the step's end the step is kept


def test_between_stops_a_quiet_step_passes_its_margins_to_the_next() -> None:
    run = _Run(lambda t, y: 1.0, lambda t, y: t - 1.1, step=0.25)
    assert run.to(2.0)[1] == pytest.approx(1.1, abs=1e-12)
    assert run.b.relations.start[0] == pytest.approx(-0.1)


def test_an_infinite_slope_and_a_zero_step_are_distinguished() -> None:
    known = (kernel.REACHED, kernel.CROSSED, kernel.FULL, kernel.TOO_SMALL, kernel.NOT_FINITE)
    assert len(set(known)) == 5

    def wall(t: float, y: float) -> float:
        return math.inf if t > 0.5 else 1.0

    assert _Run(wall, step=0.3).to(1.0)[:2] == (kernel.NOT_FINITE, 0.3)
    gap = {"slope": lambda t, y: math.nan if t > 0.5 else 1.0}
    assert _Run(**gap, step=0.3).to(1.0)[:2] == (kernel.NOT_FINITE, 0.3)
    for run in (_Run(wall), _Run(**gap)):
        status, t, _, _ = run.to(1.0)
        assert status == kernel.NOT_FINITE
        assert t == pytest.approx(0.5, abs=1e-9)
    # Only the slope at the step's end is infinite: no stage has that y.
    cliff = _Run(lambda t, y: math.inf if 0.778 < y < 0.779 else -y, step=0.25)
    assert cliff.to(1.0)[:2] == (kernel.NOT_FINITE, 0.0)
    assert _Run(t=1.0).to(2.0, h=1e-30)[:2] == (kernel.TOO_SMALL, 1.0)
    blind = _Run(lambda t, y: 1e200 * math.sin(1e30 * t), tolerance=1e-12, t=0.5)
    assert blind.to(1.0)[0] == kernel.TOO_SMALL


def _without_a_scale(slope: Callable[[float, float], float], rtol: float) -> _Run:
    run = _Run(slope, tolerance=0.0)
    control = run.b.plan.control._replace(rtol=rtol)
    run.b = run.b._replace(plan=run.b.plan._replace(control=control))
    return run


def test_the_tolerance_of_a_component_without_a_scale_follows_its_largest_value() -> None:
    run = _without_a_scale(lambda t, y: 3.0 * math.cos(t), 1e-6)
    kernel.raise_floor(run.b.plan.control, run.b.now)
    assert run.b.now.floor == [1e-6]
    assert run.to(2.0, h=0.01)[0] == kernel.REACHED
    largest = max(abs(y[0]) for y in run.b.out.rows_y[: len(run.rows)])
    assert largest > 3.9
    assert run.b.now.floor == [1e-6 * largest]
    run.y[0] = 0.0
    kernel.raise_floor(run.b.plan.control, run.b.now)
    assert run.b.now.floor == [1e-6 * largest], "it never falls again"


def test_a_component_that_is_zero_still_has_a_tolerance() -> None:
    run = _without_a_scale(lambda t, y: 0.0, 1e-6)
    run.y[0] = 0.0
    kernel.raise_floor(run.b.plan.control, run.b.now)
    assert run.b.now.floor == [1e-280]


def test_a_tolerance_that_is_given_stays() -> None:
    run = _Run(lambda t, y: 1.0, tolerance=1e-3)
    kernel.raise_floor(run.b.plan.control, run.b.now)
    run.to(3.0)
    assert run.b.now.floor == [1e-3]


def test_a_tick_is_four_units_in_the_last_place() -> None:
    assert kernel.tick_at(-1.0) == kernel.tick_at(1.0) == 4 * sys.float_info.epsilon
    assert kernel.tick_at(0.0) == 0.0


@pytest.mark.parametrize("ticks", [0.5, 3.0])
def test_a_step_does_not_end_a_tick_before_a_stop(ticks: float) -> None:
    start, stop = 2.0**20, 2.0**20 + 1.0
    run = _Run(t=start)
    run.to(stop, h=1.0 - ticks * kernel.tick_at(stop))
    assert run.b.out.steps == (1 if ticks < 1.0 else 2)


def test_every_attempted_step_is_counted_once() -> None:
    run = _Run(lambda t, y: math.cos(50.0 * t), tolerance=1e-9)
    run.to(1.0, h=0.5)
    tried, kept = run.b.out.steps, len(run.rows)
    flows = len(run.asked) // 6
    assert tried > kept
    assert flows in (tried, tried + 1)


# --------------------------------------------------------------------------- solvers of SciPy
def test_a_solver_of_scipy_is_a_class_of_it() -> None:
    with pytest.raises(TypeError, match=r"is not a scipy\.integrate\.OdeSolver class"):
        SciPyStepper(None, None, SimpleNamespace(method=RK4))  # type: ignore[arg-type]


def test_a_solver_of_scipy_ends_where_the_flow_is_not_finite() -> None:
    flow = {"z": "exp(1e9*v - 1e8)"}
    chart = Chart("a", ("v",), ("z",), (), (State("only", flow),), (), {"F": "z"})
    with pytest.raises(NotFiniteError) as caught:
        simulate(ChartModel(chart, {}), Prescribed("t"), 2.0, method=RK45, atol=1e-9)
    assert caught.value.trace.t[-1] <= 0.1
