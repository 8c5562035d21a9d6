"""A film slows near transitions and shows every micro-step; fired edges fade over three frames."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="films need the extra 'plots'")

from gms_fsm import Trace, simulate
from plots.film._pace import FADE, SLOW, Frame, Pace, paced
from tests.helpers import one_element, open_loop, pulled_mass, stick_slip

FPS = 20.0


@cache
def bank() -> Trace:
    """Four elements that break away in one instant, at 3.8 s, and are caught in one, at 10 s."""
    return simulate(stick_slip("published"), open_loop(), 45.0)


def film(frames: int = 200, window: tuple[float, float] = (3.0, 14.0)) -> Pace:
    return paced(bank(), window, frames, FPS)


def still(pace: Pace) -> list[Frame]:
    return [frame for frame in pace.frames if frame.entry >= 0]


def test_the_frames_are_as_many_as_wanted_and_in_order() -> None:
    for count in (2, 3, 9, 10, 11, 12, 50, 200):
        frames = film(count).frames
        assert len(frames) == count
        assert (frames[0].t, frames[-1].t) == (3.0, 14.0)
        assert (np.diff([frame.t for frame in frames]) >= 0).all()


def test_every_micro_step_of_a_cascade_is_shown_equally_long() -> None:
    pace = film()
    log = pace.trace.transitions
    entries = [frame.entry for frame in still(pace)]
    inside = np.flatnonzero((log.t > 3.0) & (log.t < 14.0))
    assert inside.size == 8
    assert sorted(entries) == entries
    assert {entries.count(entry) for entry in inside} == {round(0.4 * FPS)}
    assert [pace.cascade(entry) for entry in inside[:4]] == [(k, 4) for k in range(1, 5)]
    for frame in still(pace):
        assert pace.trace.microstep[frame.row] == pace.steps[frame.entry]
        assert pace.trace.t[frame.row] == log.t[frame.entry] == frame.t
        assert str(pace.trace.states[frame.row, log.element[frame.entry]]) == str(
            log.target[frame.entry]
        )
        assert frame.slowed == np.inf


@pytest.mark.parametrize(("frames", "each"), [(200, 8), (100, 6), (24, 1), (11, 1)])
def test_many_transitions_are_shown_for_less_time(frames: int, each: int) -> None:
    assert len(still(film(frames))) == 8 * each


def test_with_too_few_frames_time_runs_uniformly() -> None:
    frames = film(9).frames
    assert not still(film(9))
    assert np.allclose(np.diff([frame.t for frame in frames]), 11.0 / 8)
    assert {frame.slowed for frame in frames} == {1.0}


def test_time_runs_slower_near_transitions() -> None:
    pace = film()
    runs = [frame for frame in pace.frames if frame.entry < 0]
    steps: dict[float, set[float]] = {1.0: set(), SLOW: set()}
    for a, b in pairwise(runs):
        if a.slowed == b.slowed and not any(a.t <= t <= b.t for t in pace.trace.transitions.t):
            steps[a.slowed].add(round(b.t - a.t, 9))
    (far,), (near,) = steps[1.0], steps[SLOW]
    assert far == pytest.approx(SLOW * near)
    instants = np.unique([frame.t for frame in still(pace)])
    for frame in runs:
        close = np.abs(instants - frame.t).min()
        assert (frame.slowed == SLOW) == (close <= 6 * near + 1e-9), frame


def test_a_fired_edge_is_bright_while_time_stands_still_and_then_fades() -> None:
    pace = film()
    for entry in {frame.entry for frame in still(pace)}:
        seen = [dict(frame.fired).get(entry, 0.0) for frame in pace.frames]
        first = next(k for k, share in enumerate(seen) if share)
        assert pace.frames[first].entry == entry
        assert seen[first : first + 8] == [1.0] * 8
        assert seen[first + 8 : first + 8 + FADE] == [0.75, 0.5, 0.25]
        assert not any(seen[first + 8 + FADE :])


def test_edges_fade_without_still_frames_too() -> None:
    frames = film(9).frames
    lit = [tuple(share for _, share in frame.fired) for frame in frames]
    assert lit[:4] == [(), (1.0,) * 4, (0.75,) * 4, (0.5,) * 4]


def test_transitions_outside_the_film_are_not_in_it() -> None:
    pace = paced(bank(), (5.0, 9.0), 60, FPS)
    assert not still(pace)
    assert not any(frame.fired for frame in pace.frames)


def test_all_shown_values_are_those_of_the_run() -> None:
    trace = simulate(*pulled_mass(), 20.0)
    pace = paced(trace, (7.0, 12.0), 100, FPS)
    for frame in pace.frames:
        assert pace.trace.t[frame.row] == frame.t
        if frame.entry < 0:
            assert pace.trace.F[frame.row] == pytest.approx(trace.sample(frame.t).F[0], abs=1e-12)


def test_a_run_without_transitions_has_a_film() -> None:
    trace = simulate(one_element("signed"), open_loop(), 1.0)
    assert not trace.transitions.size
    assert len(paced(trace, (0.0, 1.0), 5, FPS).frames) == 5
