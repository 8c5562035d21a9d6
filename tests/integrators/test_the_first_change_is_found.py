"""The search finds the first change of a truth value within a step, with few evaluations."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import pytest

from integrators.crossings import NO_CHANGE, Path, first_change, is_quiet_step, watched
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

    path = Path(ArcMotion(fill, fill, None, None), [], interpolate, None, 0.0, 1.0, 1.0, [1.0])
    place = first_change(path, w, resolution)
    looks.clear()
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


@pytest.mark.slow
def test_a_margin_that_is_never_quiet_is_evaluated_512_times_per_step() -> None:
    def rough(t: float, window: float) -> float:
        halvings = Fraction(t).denominator.bit_length() - 1
        return 1.0 if abs(t - window) < 1e-9 else -1.0 if halvings % 2 else -1e-3

    for k in range(1, 512, 2):
        place, _ = _first(lambda t, k=k: rough(t, k / 512))
        assert place == pytest.approx(k / 512, abs=1.1e-9)
    assert _first(lambda t: rough(t, 2.0)) == (NO_CHANGE, 512)  # the end, and 511 in between


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


def test_a_distant_curved_margin_is_quiet_after_one_evaluation() -> None:
    assert _first(lambda t: -10.0 + t * (1 - t)) == (NO_CHANGE, 2)
    assert _first(lambda t: 10.0 - t * (1 - t)) == (NO_CHANGE, 2)
    assert _first(lambda t: -1e-3 - t * t * 0.1 - t) == (NO_CHANGE, 2)  # near, but monotone
    assert _first(lambda t: -1e-9) == (NO_CHANGE, 2)


def test_the_cubic_between_two_ends_is_that_of_both_slopes() -> None:
    # y = t**3 between 1 and 3: the cubic's midpoint is 8, a line's is 14, and t = 2 is passed on.
    w = watched([False], 1)
    w.watch[0] = 1
    w.active.append(0)
    seen = []

    def fill(t: float, y: list[float], mode: list, p: None, watch: list, out: list) -> None:
        seen.append((t, y[0]))
        out[0] = y[0] - 100.0

    w.start[0] = 1.0 - 100.0
    now = Now(**beginning(1.0, 9.0), y=[1.0], f=[3.0], mode=[], held=[], floor=[])
    scratch = Scratch([], y_new=[27.0], f_new=[27.0], error=[], dense=Dense([], [], [], [], []))
    assert is_quiet_step(ArcMotion(fill, fill, None, None), now, 3.0, scratch, w)
    assert seen == [(3.0, 27.0), (2.0, 8.0)]


def test_a_margin_far_from_zero_is_evaluated_at_the_end_and_in_the_middle_only() -> None:
    """Its slopes differ by 0.08, which is too little to reach zero from -0.46."""
    assert _first(lambda t: -0.5 + 0.16 * t * (1.0 - t)) == (NO_CHANGE, 2)


@pytest.mark.parametrize("height", [-1.0, -1e-300, 1e-300, 1.0])
def test_a_constant_margin_is_evaluated_at_the_end_and_in_the_middle_only(height: float) -> None:
    assert _first(lambda t: height) == (NO_CHANGE, 2)


@pytest.mark.parametrize("strict", [True, False])
def test_a_margin_that_rests_at_zero_is_not_searched(strict: bool) -> None:
    """As that of v > 0 while v = 0: it does not bend, and so has no window."""
    assert _first(lambda t: 0.0, strict=strict) == (NO_CHANGE, 2)


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
    path = Path(ArcMotion(fill, fill, None, None), [], interpolate, None, t, t + h, t + h, [1.0])
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
    assert probes <= 10
