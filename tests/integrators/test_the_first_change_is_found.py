"""The search finds the first change of a truth value within a step, with few evaluations."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from integrators.crossings import (
    MANY,
    NO_CHANGE,
    Path,
    first_change,
    is_quiet_step,
    longest_next,
    watched,
)
from integrators.runners.states import beginning
from integrators.steps import ArcMotion, Dense, Now, Scratch

Margin = Callable[[float], float]


def _first(*margins: Margin, strict: bool = False, resolution: float = 1e-12) -> tuple:
    """Return the point in [0, 1] where a truth value first changes, and the number of probes."""
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

    path = Path(ArcMotion(fill, fill, None, None), [], interpolate, None, 0.0, 1.0, 1.0)
    fill(1.0, [1.0], [], None, w.watch, w.end)
    place = first_change(path, w, resolution)
    looks.clear()
    fill(1.0, [1.0], [], None, w.watch, w.end)
    # Whatever the scratch space contained before the search.
    assert first_change(path, w, resolution) == place
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
    # The end, both sides of the point, and the middle of the quiet step before it.
    assert _first(lambda t: t - 0.3)[1] <= 4
    assert _first(lambda t: 0.3 - t)[1] <= 6  # exactly zero is still true: one more probe
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


def test_a_margin_that_is_never_quiet_is_evaluated_512_times_per_step() -> None:
    def rough(t: float, window: float) -> float:
        halvings = Fraction(t).denominator.bit_length() - 1
        return 1.0 if abs(t - window) < 1e-9 else -1.0 if halvings % 2 else -1e-3

    for k in range(1, 512, 30):
        place, _ = _first(lambda t, k=k: rough(t, k / 512))
        assert place == pytest.approx(k / 512, abs=1.1e-9)
    assert _first(lambda t: rough(t, 2.0)) == (NO_CHANGE, 512)  # the end, and 511 in between


@pytest.mark.slow
@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.floats(0.02, 0.9), st.floats(0.01, 0.5), st.floats(0.05, 1.0), st.floats(0.1, 10.0))
def test_of_any_window_and_line_the_earlier_counts(
    a: float, width: float, late: float, steepness: float
) -> None:
    """The step's end shows only the line; the search continues before it for the window."""

    def hump(t: float) -> float:
        return -(t - a) * (t - a - width)

    def line(t: float) -> float:
        return steepness * (t - late)

    for margins in ((hump, line), (line, hump)):
        assert _first(*margins)[0] == pytest.approx(min(a, late), abs=1.1e-12)
    assert _first(lambda t: -hump(t), strict=True)[0] == pytest.approx(a, abs=1.1e-12)


def test_of_two_windows_the_earlier_counts_though_the_later_is_seen_first() -> None:
    def two(t: float) -> float:
        return -(t - 0.18) * (t - 0.22) * (t - 0.48) * (t - 0.52)

    assert _first(two)[0] == pytest.approx(0.18, abs=1e-11)
    assert _first(lambda t: t - 0.9, two)[0] == pytest.approx(0.18, abs=1e-11)


def test_a_window_before_the_first_candidate_is_found() -> None:
    # False position lands after the window, at 0.59, and converges to 0.75 first.
    assert _first(lambda t: (t - 0.39) * (t - 0.43) * (t - 0.75))[0] == pytest.approx(
        0.39, abs=1e-11
    )


def test_a_margin_that_starts_or_touches_at_zero_changes_as_its_kind_says() -> None:
    assert _first(lambda t: t)[0] == NO_CHANGE  # already true at zero
    assert 0.0 < _first(lambda t: t, strict=True)[0] <= 1e-12
    assert _first(lambda t: 0.0)[0] == _first(lambda t: 0.0, strict=True)[0] == NO_CHANGE
    touching = -((0.5) ** 2)
    assert _first(lambda t: touching + t * (1 - t))[0] == pytest.approx(0.5, abs=1e-6)
    assert _first(lambda t: touching + t * (1 - t), strict=True)[0] == NO_CHANGE


QUIET: dict[str, Margin] = {
    "distant": lambda t: -10.0 + t * (1 - t),
    "distant, true": lambda t: 10.0 - t * (1 - t),
    "near, but monotone": lambda t: -1e-3 - t * t * 0.1 - t,
    # Its slopes differ by 0.08, which is too little to reach zero from -0.46.
    "bent": lambda t: -0.5 + 0.16 * t * (1.0 - t),
    "constant": lambda t: -1e-9,
    "hardly negative": lambda t: -1e-300,
    "hardly positive": lambda t: 1e-300,
    "zero": lambda t: 0.0,  # as that of v > 0 while v = 0: it does not bend, and has no window
}


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize("name", QUIET)
def test_a_quiet_margin_is_evaluated_at_the_end_and_in_the_middle_only(
    name: str, strict: bool
) -> None:
    assert _first(QUIET[name], strict=strict) == (NO_CHANGE, 2)


def _step(times: tuple[float, float], *margins: Callable[[float, float], float], watch: int = 4):
    """Return a step of y = t**3, as `is_quiet_step` takes it, and where margins were asked."""
    w, seen = watched([False] * len(margins), 1), []

    def fill(t: float, y: list[float], mode: list, p: None, watch: list, out: list) -> None:
        seen.append((t, y[0]))
        out[:] = [margin(t, y[0]) for margin in margins]

    start, end = times
    for r, margin in enumerate(margins):
        w.watch[r], w.start[r] = watch, margin(start, start**3)
        w.truth[r] = w.start[r] >= 0.0
        w.active.append(r)
    now = Now(**beginning(start, 9.0), y=[start**3], f=[3 * start**2], mode=[], held=[], floor=[])
    dense = Dense([], [], [], [], [])
    scratch = Scratch([], y_new=[end**3], f_new=[3 * end**2], error=[], dense=dense)
    return (ArcMotion(fill, fill, None, None), now, end, scratch, w), seen


def test_between_two_ends_y_is_the_cubic_of_both_slopes() -> None:
    """A line's midpoint between 1 and 3 is 14, not 8; the quarter point is 1.5**3."""
    step, seen = _step((1.0, 3.0), lambda t, y: y - 100.0)
    assert is_quiet_step(*step)
    longest_next(*step)
    assert seen == [(3.0, 27.0), (2.0, 8.0), (1.5, 3.375)]


def _longest(margin: Callable[[float, float], float], watch: int = 4) -> float:
    step, _ = _step((0.0, 2.0), margin, watch=watch)
    is_quiet_step(*step)
    return longest_next(*step)


def test_waiting_margins_limit_the_next_step_by_their_bend() -> None:
    """To h (size / 10 bend)^(1/2), but not to less than this step: a sine every 2 radians."""
    assert _longest(lambda t, y: -1.0 - t * (2.0 - t)) == pytest.approx(2.0)
    assert _longest(lambda t, y: -20.0 - t * (2.0 - t)) == pytest.approx(
        2.0 * (0.1 * 21 / 2) ** 0.5
    )
    assert _longest(lambda t, y: -1.0 - t * (2.0 - t), watch=3) == math.inf  # it does not wait
    for straight in (lambda t, y: -1.0, lambda t, y: -1.0 - t, lambda t, y: -1.0 - 1e-11 * t * t):
        assert _longest(straight) == math.inf  # but for rounding
    # A sine does not bend where it is steepest; between the quarter and the middle it does.
    steep = _longest(lambda t, y: -2.0 - math.sin(math.pi * (t - 1.0)))
    assert steep == 2.0
    assert _longest(lambda t, y: t - 1.0) == math.inf  # the step ends earlier


def test_the_search_is_wary_of_a_bend_four_times_as_high() -> None:
    """The two halves differ by 0.04 in their rise; a margin within 0.16 of zero is searched."""

    def dip(depth: float) -> Margin:
        return lambda t: -depth - 0.08 * t * (1.0 - t)

    assert _first(dip(0.1601))[1] == 2
    assert _first(dip(0.1599))[1] > 2


def _of_a_step(t: float, h: float, resolution: float) -> tuple[float, int]:
    """Return where t**3 = 0.3 is crossed in a step of length h, as a share, and the probes."""
    w, looks = watched([False], 1), []

    def fill(_: float, y: list[float], mode: list, p: None, watch: list, out: list) -> None:
        looks.append(y[0])
        out[0] = y[0] ** 3 - 0.3

    def interpolate(_: None, theta: float, out: list[float]) -> None:
        out[0] = theta

    w.watch[0] = 1
    w.active.append(0)
    w.start[0] = -0.3
    path = Path(ArcMotion(fill, fill, None, None), [], interpolate, None, t, t + h, t + h)
    fill(t + h, [1.0], [], None, w.watch, w.end)
    return first_change(path, w, resolution), len(looks)


@pytest.mark.parametrize(("t", "h"), [(0.0, 1.0), (64.0, 2.0**-10), (-3.0, 4096.0)])
def test_the_resolution_is_a_time_whatever_the_step(t: float, h: float) -> None:
    assert _of_a_step(t, h, 1e-6 * h) == _of_a_step(0.0, 1.0, 1e-6)
    assert _of_a_step(t, h, 1e-9 * h)[1] > _of_a_step(t, h, 1e-3 * h)[1]


def test_a_resolution_under_rounding_ends_too() -> None:
    place, _ = _of_a_step(0.0, 1.0, 1e-300)
    assert abs(place - 0.3 ** (1.0 / 3.0)) < 1e-15


def test_a_window_in_the_second_half_is_closed_by_its_slope() -> None:
    place, probes = _first(lambda t: (t - 0.6) * (0.8 - t), resolution=1e-12)
    assert 0.6 <= place < 0.6 + 1e-11
    assert probes <= 11


@pytest.mark.parametrize(
    ("margins", "first"),
    [
        ([lambda t: t - 0.8], 0.8),
        ([lambda t: t**3 - 0.512], 0.8),
        ([lambda t: t - 0.9, lambda t: t - 0.8], 0.8),
        # One that is as before at the end, but not where the other one changes, or only before it.
        ([lambda t: t - 0.8, lambda t: (t - 0.7) * (0.81 - t)], 0.7),
        ([lambda t: t - 0.8, lambda t: (t - 0.3) * (0.6 - t)], 0.3),
        ([lambda t: 0.8 - t, lambda t: (t - 0.7) * (t - 0.81)], 0.7),
    ],
)
def test_among_many_that_do_not_change_it_is_the_same(margins: list[Margin], first: float) -> None:
    """Then only those are looked at on the way that have changed, and slopes are trusted longer."""
    quiet = [lambda t: -1.0] * MANY
    place, probes = _first(*margins, *quiet)
    assert 0.0 <= place - first < 1e-11
    assert probes <= 2 * _first(*margins)[1]
