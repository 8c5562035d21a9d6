"""A relation that is true for a while inside one step is found, the earliest one first.

Tested on hand-made steps (the state is the fraction theta itself, the margins are functions of it)
and in whole runs. The naive way, a sign change between the ends of the step, misses the window.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm import Prescribed, simulate
from integrators.crossings import NO_CHANGE, Path, first_change, watched
from integrators.steps import ArcMotion
from tests.helpers import event_sequence, one_element

RESOLUTION = 1e-15


def located(*functions, t=0.0, h=1.0, strict=None):
    """Return the fraction at which one of the margins (functions of theta) first changes."""
    r = len(functions)

    def interpolate(dense, theta, out):
        out[0] = theta

    def margins(time, y, mode, p, watch, out):
        for j, function in enumerate(functions):
            out[j] = function(y[0])

    low = [function(0.0) for function in functions]
    strict = strict or [False] * r
    truth = [g > 0 or (g == 0 and not s) for g, s in zip(low, strict, strict=True)]
    w = watched(strict, 1)
    for j in range(r):
        w.watch[j], w.truth[j], w.start[j] = 1, truth[j], low[j]
        w.active.append(j)
    path = Path(ArcMotion(None, margins, None, None), [], interpolate, None, t, t + h, t + h, [1.0])
    return first_change(path, w, RESOLUTION * h)


def naive(*functions):
    """Return whether any margin has a different sign at the step's end."""
    return any((f(0.0) >= 0) != (f(1.0) >= 0) for f in functions)


def hump(a, b):
    """Return a parabola that is positive only between a and b."""
    return lambda x: -(x - a) * (x - b)


@pytest.mark.parametrize(
    ("a", "b"), [(0.4, 0.6), (0.1, 0.2), (0.62, 0.7), (0.85, 0.95), (0.3, 0.8)]
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_window_inside_the_step(a, b, sign):
    """True only between a and b (or false only there): found at a."""

    def margin(x):
        return sign * hump(a, b)(x)

    assert not naive(margin)
    assert located(margin, strict=[sign < 0]) == pytest.approx(a, abs=1e-13)


def test_a_peak_below_zero_is_not_a_crossing():
    """The parabola comes near but stays false."""
    assert located(lambda x: -((x - 0.5) ** 2) - 1e-9) == NO_CHANGE
    assert located(lambda x: -1 - x) == NO_CHANGE


def test_the_right_end_is_returned():
    """At the returned point the relation has changed; one tick before it has not."""
    for c in (0.1, 1 / 3, 0.7123, 0.999):
        theta = located(lambda x, c=c: x - c)
        assert theta >= c
        assert theta - c < 3e-15


def test_a_margin_that_starts_at_zero_does_not_fire_again():
    """Half-open on the left: truth at the start counts, not the sign."""
    assert located(lambda x: x) == NO_CHANGE  # zero is true, and stays true
    assert located(lambda x: x, strict=[True]) < 1e-14  # zero is false, the first tick is true
    assert located(lambda x: -x) < 1e-14
    assert located(lambda x: -x, strict=[True]) == NO_CHANGE


@pytest.mark.parametrize(
    ("a", "b"), [(0.4, 0.6), (0.1, 0.2), (0.62, 0.7), (0.45, 0.5), (0.8, 0.85)]
)
@pytest.mark.parametrize("late", [0.3, 0.52, 0.75, 0.9, 0.97, 1.0])
def test_a_window_before_a_later_change(a, b, late):
    """The first relation is true and false again, the second stays true from `late` on.

    The step's end shows only the second one; the search must continue before it for the first.
    """
    expected = min(a, late)
    assert located(hump(a, b), lambda x: x - late) == pytest.approx(expected, abs=1e-13)
    assert located(lambda x: x - late, hump(a, b)) == pytest.approx(expected, abs=1e-13)


def test_a_window_between_two_steep_relations():
    """The later relation is strongly curved, so that false position lands near it at once."""
    assert located(hump(0.35, 0.5), lambda x: x**9 - 0.6) == pytest.approx(0.35, abs=1e-13)
    assert located(hump(0.35, 0.5), lambda x: 1e6 * (x - 0.99)) == pytest.approx(0.35, abs=1e-13)


@pytest.mark.slow
@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.floats(0.02, 0.9), st.floats(0.01, 0.5), st.floats(0.05, 1.0), st.floats(0.1, 10.0))
def test_random_windows_and_lines(a, width, late, steepness):
    """Any parabola and any line: the earlier of the two, exactly."""
    b = a + width
    expected = min(a, late)
    theta = located(hump(a, b), lambda x: steepness * (x - late))
    assert theta == pytest.approx(expected, abs=1e-12)


# F_c, F_s, v_s, corners of v, z(0). While |v| < 6.1 v_s there is no landmark, and a sticking
# element takes long steps. z passes -s before the reversal; at the reversal s exceeds |z| again.
WINDOWS = [
    (0.29, 0.38, 0.052, [(0, -0.24), (2.7, 0.14)], -0.14),
    (0.18, 0.38, 0.062, [(0, -0.19), (2.8, 0.19)], -0.1),
    (0.45, 0.99, 0.035, [(0, -0.15), (1.8, 0.13)], -0.42),
    (0.48, 0.77, 0.059, [(0, -0.32), (1.6, 0.22)], -0.38),
    (0.25, 0.33, 0.075, [(0, 0.5), (1.5, -0.25), (3, -0.25), (5, 0.3), (6.5, 0.1)], 0.0),
]


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"rtol": 1e-10, "atol": 1e-13}, {"method": "bs23"}])
@pytest.mark.parametrize("window", WINDOWS)
def test_a_break_away_inside_a_long_step_is_found(window, options):
    """Steps of up to a second in stick: the break-away and its arrest are the fine run's."""
    F_c, F_s, v_s, ramps, z0 = window
    model, rig = one_element("signed", F_c=F_c, F_s=F_s, v_s=v_s, C=0.1), Prescribed(ramps)
    T, start = ramps[-1][0], {"z": [z0]}
    fine = simulate(model, rig, T, initial=start, max_step=1e-3)
    assert event_sequence(fine) == [(0, "break_away_backward"), (0, "arrest")]
    trace = simulate(model, rig, T, initial=start, **options)
    assert event_sequence(trace) == event_sequence(fine)
    np.testing.assert_allclose(trace.transitions.t, fine.transitions.t, rtol=0, atol=1e-5)
