"""State ribbons equal the transition log, span by span, with names where they fit."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace, simulate

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.text import Text

from plots import panels
from tests.helpers import open_loop, pulled_mass, stick_slip


@pytest.fixture(scope="module", params=["sine", "pulled mass", "wanted rows"])
def run(request: pytest.FixtureRequest) -> Trace:
    if request.param == "sine":
        return simulate(stick_slip("published"), open_loop(), 60.0)
    model, rig = pulled_mass()
    wanted = None if request.param == "pulled mass" else np.linspace(0.0, 60.0, 7)
    return simulate(model, rig, 60.0, t_eval=wanted)


def by_hand(run: Trace, i: int, t0: float, t1: float) -> list[tuple[str, float, float]]:
    """Return the states of element i over time, read from the log in the simplest way."""
    spans, name, since = [], "stick", 0.0
    for record in run.transitions:
        if record.element == i:
            spans.append((name, since, float(record.t)))
            name, since = str(record.target), float(record.t)
    spans.append((name, since, float(run.t[-1])))
    cut = [(name, max(a, t0), min(b, t1)) for name, a, b in spans]
    return [span for span in cut if span[2] > span[1]]


def spans_of(artists: list[object]) -> list[list[tuple[float, float]]]:
    collections = [a for a in artists if isinstance(a, PolyCollection)]
    return [
        [(p.vertices[:, 0].min(), p.vertices[:, 0].max()) for p in c.get_paths()]
        for c in collections
    ]


@pytest.mark.slow
@pytest.mark.parametrize("window", [None, (14.0, 31.0)])
@pytest.mark.parametrize("elements", [None, [2, 0]])
def test_spans(run: Trace, window: tuple[float, float] | None, elements: list[int] | None) -> None:
    ax = Figure().subplots()
    drawn = spans_of(panels.ribbons(ax, run, window=window, elements=elements))
    limits = window or (0.0, 60.0)
    chosen = range(4) if elements is None else elements
    expected = [
        [(a, b) for name, a, b in by_hand(run, i, *limits) if name == state]
        for i in chosen
        for state in ("stick", "slip")
    ]
    assert [len(spans) for spans in drawn] == [len(spans) for spans in expected]
    for mine, wanted in zip(drawn, expected, strict=True):
        np.testing.assert_allclose(mine, wanted, rtol=0, atol=1e-12)
    assert [label.get_text() for label in ax.get_yticklabels()] == [f"E{i + 1}" for i in chosen]
    assert ax.get_xlabel() == "t [s]"


def test_slip_is_hatched_and_stick_is_not(run: Trace) -> None:
    stick, slip = panels.ribbons(Figure().subplots(), run)[:2]
    assert (stick.get_hatch() or "") == ""
    assert slip.get_hatch()


def test_names_are_drawn_only_where_they_fit(run: Trace) -> None:
    def shown_names(axes: Axes) -> list[str]:
        canvas.draw()
        renderer = canvas.get_renderer()
        names = [a for a in axes.texts if a.get_text() in ("stick", "slip")]
        for name in names:
            if name.fits(renderer):  # type: ignore[attr-defined]
                a, b = axes.transData.transform([(t, 0) for t in name.span])[:, 0]  # type: ignore[attr-defined]
                box = Text.get_window_extent(name, renderer)
                assert a <= box.x0
                assert box.x1 <= b
        return [a.get_text() for a in names if a.fits(renderer)]  # type: ignore[attr-defined]

    wide, narrow = Figure(figsize=(16, 3)), Figure(figsize=(1.2, 3))
    counts = []
    for figure in (wide, narrow):
        canvas = FigureCanvasAgg(figure)
        ax = figure.subplots()
        panels.ribbons(ax, run)
        counts.append(len(shown_names(ax)))
    assert counts[0] > 16
    assert counts[1] < counts[0]


@pytest.mark.slow
def test_a_run_without_transitions_is_one_span_per_element() -> None:
    run = simulate(stick_slip("signed"), open_loop(), 0.5)
    drawn = spans_of(panels.ribbons(Figure().subplots(), run))
    assert drawn == [[(0.0, 0.5)], []] * 4
