"""A film shows what happens: the fired edge, the micro-step, bristles that move with the run.

It slows near transitions and shows every micro-step; fired edges fade over three frames.

All texts have room and a size of at least 7 points, also for 12 elements; every chart has a film.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="films need the extra 'plots'")

from matplotlib.transforms import Bbox

from gms_fsm import Body, Contact, LivelockError, Prescribed, PulledSlider, System, Trace, simulate
from gms_fsm.charts.registry import Entry, entry
from gms_fsm.systems.models import demonstration
from plots.film._movie import Movie
from plots.film._pace import FADE, SLOW, Frame, Pace, paced
from plots.output.graphviz import available
from plots.style import CHART_THEMES
from tests.helpers import bank, matrix
from tests.plots.charts_to_draw import every
from tests.plots.films import cascade, count, with_movie
from tests.plots.printed import drawn_texts

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not available(), reason="no Graphviz")]
LABEL = re.compile(r"E\d+ (stick|slip)")  # of a bristle


WINDOW = {"t_start": 3.3, "t_end": 5.0, "frames": 60}  # four micro-steps


@pytest.mark.matrix
def test_the_fired_edge_is_lit_and_fades(tmp_path: Path) -> None:
    """Beside the cursor, nothing but the edge, its contact and the number is orange."""
    orange = CHART_THEMES["dark"].fired

    def use(movie: Movie) -> tuple[list[int], tuple[Frame, ...]]:
        return [count(picture, orange) for picture in movie.pictures()], movie.film.pace.frames

    more = WINDOW | {"theme": "dark", "elements": [0, 1, 2], "frames": 30}
    seen, frames = with_movie(cascade(), tmp_path, use, **more)
    plain = [n for n, frame in zip(seen, frames, strict=True) if not frame.fired]
    for n, frame in zip(seen, frames, strict=True):
        if frame.entry >= 0 and cascade().transitions.element[frame.entry] < 3:
            assert n > max(plain) + 100
    last = max(k for k, frame in enumerate(frames) if frame.entry >= 0)
    assert seen[last + 4] in range(min(plain), max(plain) + 1)


def test_texts_and_chart_say_what_happens_and_what_sticks_stays_on_the_ground(
    tmp_path: Path,
) -> None:
    """A contact moves by -scale * dz, the ground by -scale * dx; both are equal while it sticks."""
    said, counts = [], []

    def use(movie: Movie) -> None:
        film, trace, places = movie.film, movie.film.trace, list[np.ndarray]()
        for frame in film.pace.frames:
            film.show(frame)
            said.append([text.get_text() for text in film.figure.texts])
            film.chart.paint(frame)
            texts = {node.text or "" for node in film.chart.root.iter("text")}
            counts.append(tuple(sorted(text for text in texts if " of " in text)))
            film.bristles.show(frame)
            at = np.array([contact.get_x() for contact in film.bristles.contacts])
            ends = np.array([spring.get_xdata()[0] for spring in film.bristles.springs])
            assert np.allclose(ends - at, ends[0] - at[0])
            assert (ends < film.bristles.wall).all()
            places.append(at)
        for (before, after), moved in zip(
            pairwise(film.pace.frames), np.diff(places, axis=0), strict=True
        ):
            rows = [before.row, after.row]
            ground = -film.bristles.scale * (trace.x[rows] @ [-1, 1])
            sticks = (trace.states[rows] == "stick").all(axis=0)
            assert moved[sticks] == pytest.approx(ground, abs=1e-6)

    with_movie(replace(cascade(), heading="Four at once"), tmp_path, use, **WINDOW)
    assert {tuple(about) for *about, _, _ in said} == {
        ("Four at once", f"GMS, 4 elements, published law; {cascade().rig.title}")
    }
    assert [note for *_, note in said if note][::7][:4] == [
        f"micro-step {k} of 4: E{k} break_away_forward, stick → slip" for k in range(1, 5)
    ]
    marks = {clock.partition(" N")[2].strip() for *_, clock, _ in said}
    assert marks == {"", "slowed ×4", "held"}
    assert list(dict.fromkeys(counts)) == [
        ("0 of 4", "4 of 4"),
        ("1 of 4", "3 of 4"),
        ("2 of 4",),
    ]
    assert counts[0] == counts[-1]


@cache
def pulled(n: int) -> Trace:
    return simulate(bank(n), PulledSlider(mass=1.0, stiffness=2.0, speed=0.1), 20.0)


def boxes(movie: Movie) -> list[tuple[str, Bbox]]:
    """Return the texts outside the chart, and the chart as a whole."""
    chart = {id(part.artist) for part in movie.film.parts}
    texts = drawn_texts(movie.film.figure)
    assert all(text.get_fontsize() >= 7 for text, _ in texts)
    inside = [box for text, box in texts if id(text) in chart]
    found = [(text.get_text(), box) for text, box in texts if id(text) not in chart]
    return [*found, ("the chart", Bbox.union(inside))]


@pytest.mark.matrix
def test_texts_have_room_for_one_and_for_many_elements(tmp_path: Path) -> None:
    def use(movie: Movie) -> None:
        held = movie.held()
        for number in (0, held[0], held[-1], movie.frames - 1):
            picture = movie.picture(number)
            found = boxes(movie)
            labels = [text for text, _ in found if LABEL.fullmatch(text)]
            assert len(labels) == movie.film.trace.n
            for text, box in found:
                assert min(box.x0, box.y0) >= 0, text
                assert box.x1 <= picture.size[0], text
                assert box.y1 <= picture.size[1], text
            for (a, first), (b, second) in combinations(found, 2):
                assert not first.overlaps(second), (a, b)

    for n in (1, 24):
        with_movie(pulled(n), tmp_path, use, frames=120)


def mounted(found: Entry, law: str) -> tuple[Any, ...]:
    """Return a chart on a rig, or in a system if it has several velocities."""
    chart = found.chart(law)
    if len(chart.velocities) > 1:
        names = [f"v{i}" for i, _ in enumerate(chart.velocities)]
        bodies = [
            Body(f"b{v}", inertia=1.0, force=f"2 * sin(t + {i})", x=f"x{v}", v=v)
            for i, v in enumerate(names)
        ]
        contact = Contact("pad", chart, dict(found.demonstration.values), v=names)
        return (System("plane", bodies=bodies, contacts=[contact]),)
    held = chart.locks or chart.sets_velocity  # needs a free body
    rig = PulledSlider(1.0, 2.0, 0.1) if held else Prescribed("0.2*sin(t)")
    return demonstration(found, law), rig


# Every tenth, the chart with two velocities among them.
TENTH = {*every()[::10], ("planar-coulomb", "")}


@pytest.mark.every(6)
@pytest.mark.parametrize(("name", "law"), matrix(every(), TENTH))
def test_every_chart_has_a_film(name: str, law: str, tmp_path: Path) -> None:
    try:
        run = simulate(*mounted(entry(name), law), 2.0)
    except LivelockError as error:
        assert entry(name).wrong
        run = error.trace
    trace = run.contact(run.contacts[0])

    def use(movie: Movie) -> int:
        assert boxes(movie)
        return len(list(movie.pictures()))

    assert with_movie(trace, tmp_path, use, frames=2) == 2


# --------------------------------------------------------------------------- pace
FPS = 20.0


def film(frames: int = 200) -> Pace:
    return paced(cascade(), (3.0, 14.0), frames, FPS)


def still(pace: Pace) -> list[Frame]:
    return [frame for frame in pace.frames if frame.entry >= 0]


def test_every_micro_step_of_a_cascade_is_shown_equally_long_and_fades() -> None:
    pace = film()
    log, trace = pace.trace.transitions, pace.trace
    entries = [frame.entry for frame in still(pace)]
    inside = np.flatnonzero((log.t > 3.0) & (log.t < 14.0))
    assert inside.size == 8
    assert sorted(entries) == entries
    assert {entries.count(entry) for entry in inside} == {round(0.4 * FPS)}
    assert [pace.cascade(entry) for entry in inside[:4]] == [(k, 4) for k in range(1, 5)]
    for frame in still(pace):
        assert trace.microstep[frame.row] == pace.steps[frame.entry]
        assert trace.t[frame.row] == log.t[frame.entry] == frame.t
        assert trace.states[frame.row, log.element[frame.entry]] == log.target[frame.entry]
        assert frame.slowed == np.inf
    for fired in inside:
        seen = [dict(frame.fired).get(fired, 0.0) for frame in pace.frames]
        first = next(k for k, share in enumerate(seen) if share)
        assert pace.frames[first].entry == fired
        assert seen[first : first + 8] == [1.0] * 8
        assert seen[first + 8 : first + 8 + FADE] == [0.75, 0.5, 0.25]
        assert not any(seen[first + 8 + FADE :])


def test_frames_are_as_many_as_wanted_and_show_many_transitions_for_less_time() -> None:
    for wanted, each in ((200, 8), (100, 6), (24, 1), (11, 1), (9, 0), (2, 0)):
        pace = film(wanted)
        assert len(still(pace)) == 8 * each
        assert len(pace.frames) == wanted
        times = [frame.t for frame in pace.frames]
        assert (times[0], times[-1]) == (3.0, 14.0)
        assert (np.diff(times) >= 0).all()
    frames = film(9).frames  # time runs uniformly, and edges fade without still frames too
    lit = [tuple(share for _, share in frame.fired) for frame in frames]
    assert lit[:4] == [(), (1.0,) * 4, (0.75,) * 4, (0.5,) * 4]
    assert np.allclose(np.diff([frame.t for frame in frames]), 11.0 / 8)
    assert {frame.slowed for frame in frames} == {1.0}
    quiet = paced(cascade(), (5.0, 9.0), 60, FPS)
    assert not any(frame.fired or frame.entry >= 0 for frame in quiet.frames)


def test_time_runs_slower_near_transitions() -> None:
    steps: dict[float, set[float]] = {1.0: set(), SLOW: set()}
    times = cascade().transitions.t
    for a, b in pairwise(frame for frame in film().frames if frame.entry < 0):
        if a.slowed == b.slowed and not any(a.t <= t <= b.t for t in times):
            steps[a.slowed].add(round(b.t - a.t, 9))
            near = min(abs(t - a.t) for t in times) <= 6 * (b.t - a.t) + 1e-9
            assert near or a.slowed == 1.0
    (far,), (close,) = steps[1.0], steps[SLOW]
    assert far == pytest.approx(SLOW * close)
