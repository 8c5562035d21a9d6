"""A small change of expression, chart, machines, crossings or advance is noticed.

Each test pins down what a mutant of `tests/mutation.py` got away with. At the end stands what
no test can notice, and why.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import pytest

from gms_fsm.chart import Chart, State, Transition
from integrators import advance as kernel
from integrators.crossings import NO_CHANGE, first_change, nothing_near, watched
from integrators.hybrid import Buffers, Options, System, buffers
from integrators.tableaux import DP45, RK4


# --------------------------------------------------------------------------- chart
def _chart() -> Chart:
    return Chart(
        "sticky",
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("stick", flow={"z": "v"}, entry={"z": "0"}), State("slip", flow={"z": "0"})),
        transitions=(Transition("leave", "stick", "slip", "z > 1"),),
        outputs={"F": "k * z"},
    )


def test_no_part_of_a_chart_can_be_exchanged_afterwards() -> None:
    chart = _chart()
    parts = ((chart, "name"), (chart.states[0], "flow"), (chart.transitions[0], "guard"))
    for part, attribute in parts:
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, attribute, "another")


def test_a_chart_shows_and_compares_what_was_written_not_what_was_parsed() -> None:
    chart = _chart()
    assert "guards=" not in repr(chart)
    assert "flows=" not in repr(chart)
    assert "assignments=" not in repr(chart)
    assert "forces=" not in repr(chart)
    assert chart == _chart()


# --------------------------------------------------------------------------- crossings
Margin = Callable[[float], float]


def _first(*margins: Margin, strict: bool = False, resolution: float = 1e-12) -> tuple:
    """Return the place in [0, 1] where a truth first changes, and how often was looked."""
    w = watched([strict] * len(margins), 1)
    looks = []

    def fill(t: float, y: list[float], mode: list, p: None, watch: list, out: list) -> None:
        looks.append(t)
        for r, margin in enumerate(margins):
            out[r] = margin(t)

    for r, margin in enumerate(margins):
        w.watch[r] = 1
        w.active.append(r)
        g = margin(0.0)
        w.truth[r], w.start[r] = g > 0.0 or (g == 0.0 and not strict), g

    def interpolate(_: None, theta: float, out: list[float]) -> None:
        out[0] = theta

    place = first_change(interpolate, None, fill, 0.0, 1.0, [1.0], [], None, w, resolution)
    return place, len(looks)


@pytest.mark.parametrize("resolution", [1e-3, 1e-6, 1e-12])
@pytest.mark.parametrize(
    "margin",
    [
        lambda t: t - 0.3,
        lambda t: 0.3 - t,
        lambda t: t**3 - 0.027,
        lambda t: (t - 0.3) * (2.0 - t),
        lambda t: -1.0 if t < 0.3 else 1e-9,
        lambda t: 1e-9 if t < 0.3 else -1.0,
    ],
)
def test_the_place_is_right_of_the_change_by_at_most_the_resolution(
    margin: Margin, resolution: float
) -> None:
    place, _ = _first(margin, resolution=resolution)
    assert (margin(place) >= 0.0) != (margin(0.0) >= 0.0)
    assert (margin(place - 1.001 * resolution) >= 0.0) == (margin(0.0) >= 0.0)


def test_a_straight_margin_is_found_by_its_slope_not_by_halving() -> None:
    # End, both sides of the place, and the middle of the quiet step before it.
    assert _first(lambda t: t - 0.3)[1] <= 4
    assert _first(lambda t: 0.3 - t)[1] <= 6  # exactly zero is still true: once more
    assert _first(lambda t: t - 0.3, lambda t: 0.8 - t)[1] <= 4


def test_a_jump_is_found_by_halving_when_the_slope_misleads() -> None:
    # Forty halvings close a bracket to 1e-12; every other guess may be the slope's.
    assert _first(lambda t: -1.0 if t < 0.3 else 1e-9)[1] <= 90


@pytest.mark.parametrize("middle", [0.1003, 0.3007, 0.4997, 0.62, 0.9001])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_window_of_a_256th_of_a_step_is_found_wherever_it_lies(
    middle: float, sign: float
) -> None:
    half = 0.51 / 256
    place, _ = _first(lambda t: sign * ((t - middle) ** 2 - half**2))
    assert place == pytest.approx(middle - half, abs=1e-11)


def test_of_two_windows_the_earlier_counts_though_the_later_is_seen_first() -> None:
    def two(t: float) -> float:
        return -(t - 0.18) * (t - 0.22) * (t - 0.48) * (t - 0.52)

    assert _first(two)[0] == pytest.approx(0.18, abs=1e-11)
    assert _first(lambda t: t - 0.9, two)[0] == pytest.approx(0.18, abs=1e-11)


def test_a_margin_that_starts_or_touches_at_zero_changes_as_its_kind_says() -> None:
    assert _first(lambda t: t)[0] == NO_CHANGE  # true at zero already
    assert 0.0 < _first(lambda t: t, strict=True)[0] <= 1e-12
    assert _first(lambda t: 0.0)[0] == _first(lambda t: 0.0, strict=True)[0] == NO_CHANGE
    touching = -((0.5) ** 2)
    assert _first(lambda t: touching + t * (1 - t))[0] == pytest.approx(0.5, abs=1e-6)
    assert _first(lambda t: touching + t * (1 - t), strict=True)[0] == NO_CHANGE


def test_a_far_margin_with_a_bend_is_quiet_after_one_look_inside() -> None:
    assert _first(lambda t: -10.0 + t * (1 - t)) == (NO_CHANGE, 2)
    assert _first(lambda t: 10.0 - t * (1 - t)) == (NO_CHANGE, 2)
    assert _first(lambda t: -1e-3 - t * t * 0.1 - t) == (NO_CHANGE, 2)  # near, but monotone
    assert _first(lambda t: -1e-9) == (NO_CHANGE, 2)


def test_the_cubic_between_two_ends_is_that_of_both_slopes() -> None:
    # y = t**3 between 1 and 3: the middle of the cubic is 8, of a line 14, and t = 2 is handed on.
    w = watched([False], 1)
    w.watch[0] = 1
    w.active.append(0)
    seen = []

    def fill(t: float, y: list[float], mode: list, p: None, watch: list, out: list) -> None:
        seen.append((t, y[0]))
        out[0] = y[0] - 100.0

    w.start[0] = 1.0 - 100.0
    assert nothing_near(fill, 1.0, 3.0, [1.0], [3.0], [27.0], [27.0], [], None, w)
    assert seen == [(3.0, 27.0), (2.0, 8.0)]


# --------------------------------------------------------------------------- advance
class _Run:
    """One machine-less run of y' = slope(t, y), y(0) = 1, called by hand."""

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
    ) -> None:
        self.asked: list[float] = []

        def flow(t: float, y: list, mode: list, held: list, p: None, dy: list) -> None:
            self.asked.append(t)
            dy[0] = slope(t, y[0])

        def margins(t: float, y: list, mode: list, p: None, watch: list, out: list) -> None:
            if margin is not None:
                out[0] = margin(t, y[0])

        system = System(flow, flow, lambda *_: None, margins, None, 0, [False], ["g"], list(knots))
        method = RK4 if step else DP45
        options = Options(method, step, tolerance, tolerance, max_step, True, times)
        self.b: Buffers = buffers(system, 0.0, [1.0], [], 100.0, options, capacity)
        self.system, self.y, self.t = system, [1.0], t
        self.f = [slope(t, 1.0)]
        if margin is not None:
            w = self.b.relations
            w.watch[0] = 1
            w.active.append(0)
            w.start[0] = margin(t, 1.0)
            w.truth[0] = w.start[0] >= 0.0

    def to(
        self, t_stop: float, *, h: float = 0.1, before: float = 1.0, steps: int = 1000
    ) -> tuple[int, float, float, float]:
        b, s = self.b, self.system
        found = kernel.advance(
            s.flow, s.margins, b.method, b.control, self.t, self.y, self.f, h, before, t_stop,
            s.knots, [], [], None, b.relations, b.out, b.work, steps,
        )  # fmt: skip
        self.t = found[1]
        return found

    @property
    def rows(self) -> list[float]:
        return self.b.out.rows_t[: self.b.out.cursor[0]]


def test_fixed_steps_end_on_the_grid_wherever_they_begin() -> None:
    run = _Run(step=0.25)
    assert run.to(1.1)[:2] == (kernel.REACHED, 1.1)
    assert run.rows == [0.25, 0.5, 0.75, 1.0, 1.1]
    late = _Run(step=0.25, t=0.6)
    late.to(1.25)
    assert late.rows == [0.75, 1.0, 1.25]


def test_no_sliver_is_stepped_at_either_end() -> None:
    tick = _Run().b.control.resolution
    run = _Run(step=0.25, t=0.5 - 0.5 * tick)
    run.to(1.0 + 0.5 * tick)
    assert run.rows == [0.75, 1.0 + 0.5 * tick]
    adaptive = _Run()
    adaptive.to(0.1 + 0.5 * tick)
    assert adaptive.rows == [0.1 + 0.5 * tick]


@pytest.mark.parametrize("step", [None, 0.25])
def test_steps_end_on_knots_and_go_on_as_before(step: float | None) -> None:
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
    assert _Run().to(0.2, h=0.5)[2] == 2.0  # but it may grow by what was learned: 10 * 0.2
    assert _Run().to(0.5, h=0.5)[2] == 5.0


def test_the_step_after_a_rejected_one_does_not_grow_at_once() -> None:
    run = _Run(lambda t, y: math.cos(40.0 * t))
    _, t, h, _ = run.to(10.0, h=5.0, steps=1)
    assert 0.0 < h <= t < 1.0
    assert abs(run.y[0] - 1.0 - math.sin(40.0 * t) / 40.0) < 1e-5


def test_the_remembered_error_is_that_of_the_last_step_but_never_vanishes() -> None:
    assert _Run().to(1.0, steps=1)[3] == 1e-4
    run = _Run(lambda t, y: math.cos(40.0 * t))
    assert 1e-4 < run.to(10.0, h=0.04, steps=1)[3] <= 1.0


def test_it_comes_back_when_the_steps_or_the_rows_are_used_up() -> None:
    run = _Run(step=0.25)
    assert run.to(100.0, steps=3)[:2] == (kernel.FULL, 0.75)
    assert run.to(100.0, steps=1)[:2] == (kernel.FULL, 1.0)
    full = _Run(step=0.25, capacity=2)
    assert full.to(100.0)[:2] == (kernel.FULL, 0.5)
    assert full.rows == [0.25, 0.5]
    wanted = _Run(step=0.25, times=[0.3], capacity=1)  # a row a time, however many steps
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


def test_rows_behind_a_crossing_wait_for_what_is_switched_there() -> None:
    run = _Run(lambda t, y: 1.0, lambda t, y: y - 1.6, step=1.0, times=[0.5, 0.7])
    assert run.to(1.0)[0] == kernel.CROSSED
    assert run.rows == [0.5]


def test_an_adaptive_step_with_an_early_crossing_is_done_again_up_to_it() -> None:
    run = _Run(lambda t, y: math.cos(t), lambda t, y: t - 0.2)
    _, t, _, _ = run.to(2.0, h=0.5)
    assert t == pytest.approx(0.2, abs=1e-12)
    assert max(run.asked) >= 0.5
    assert max(run.asked[-6:]) <= 0.2 + 1e-12  # no stage of the step kept lies behind it
    late = _Run(lambda t, y: math.cos(t), lambda t, y: t - 0.097)
    late.to(2.0, h=0.1)
    assert max(late.asked[-6:]) == 0.1  # near the step's end it is kept


def test_between_stops_a_quiet_step_hands_its_margins_to_the_next() -> None:
    # -1e-3 at 0, far at 0.25, true from 1.1: the bracket begins with what the step before saw.
    run = _Run(lambda t, y: 1.0, lambda t, y: t - 1.1, step=0.25)
    assert run.to(2.0)[1] == pytest.approx(1.1, abs=1e-12)
    assert run.b.relations.start[0] == pytest.approx(-0.1)


def test_an_infinite_slope_and_a_step_of_nothing_are_told_apart() -> None:
    def wall(t: float, y: float) -> float:
        return math.inf if t > 0.5 else 1.0

    assert _Run(wall, step=0.3).to(1.0)[:2] == (kernel.NOT_FINITE, 0.3)
    status, t, _, _ = _Run(wall).to(1.0)
    assert status == kernel.NOT_FINITE
    assert t == pytest.approx(0.5, abs=1e-9)
    blind = _Run(lambda t, y: 1e200 * math.sin(1e30 * t), tolerance=1e-12)
    assert blind.to(1.0)[0] == kernel.TOO_SMALL
