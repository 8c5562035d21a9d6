"""Texts of figures have room: no label is clipped, covers another, or is taller than its row."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

import plots
from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, Stribeck, Trace, simulate
from plots import figures
from plots.style import ROLES, ramp
from tests.helpers import matrix

COUNTS = [1, 4, 12, 20]
END = 9.0


@cache
def bank(n: int) -> Trace:
    shares = np.linspace(2.0, 1.0, n)
    parameters = GMSParameters.from_shares(
        shares / shares.sum(),
        np.geomspace(60.0, 6.0, n),
        C=2.0,
        stribeck=Stribeck(1.0, 1.5, 0.05),
        v_c=1e-6,
        sigma=np.full(n, 0.01),
        sigma_2=0.4,
    )
    return simulate(GMS(parameters, law="signed"), Prescribed("0.2*sin(2*pi*t/4)"), END)


@cache
def lugre() -> Trace:
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=0.4, stribeck=Stribeck(1.0, 1.5, 0.05))
    return simulate(model, Prescribed("0.2*sin(2*pi*t/4)"), END)


def fig3(trace: Trace) -> Figure:
    phases = (("rising", 2.0), ("falling", 4.0), ("oscillating", np.inf))
    force = np.sin(trace.t)
    return figures.figure_3(trace, trace, lugre(), force, title="Fig. 3", phases=phases)


def unfold(trace: Trace) -> Figure:
    first = float(trace.transitions.t[0])
    return plots.unfold(trace, first - 1e-9, first + 0.05)


DRAWN: dict[str, Callable[[Trace], Figure]] = {
    "overview": lambda trace: figures.overview(trace, title="A bank"),
    "ribbons": figures.ribbons_figure,
    "cascade": figures.cascade_figure,
    "laws": lambda trace: figures.compare_laws({"one law": trace, "another law": trace}),
    "fig3": fig3,
    "fig4": lambda trace: figures.figure_4(trace, trace, lugre()),
    "residual": lambda trace: figures.residuals(
        {"one": (trace.t, trace.F), "another": (trace.t, trace.v)}, "Residuals"
    ),
    "landscape": lambda trace: plots.landscape(trace, trace.n - 1, t=2.5, title="A bank"),
    "unfold": unfold,
    "phase": plots.phase,
}


@cache
def drawn(name: str, n: int) -> Figure:
    figure = DRAWN[name](bank(n))
    FigureCanvasAgg(figure).draw()
    return figure


def texts(figure: Figure) -> list[tuple[Text, Bbox]]:
    """Return the texts that can be seen, with their extents in pixels."""
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    unused = _unused_ticks(figure)
    found = []
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        fits: Any = getattr(text, "fits", None)
        if not text.get_visible() or not text.get_text().strip() or (fits and not fits(renderer)):
            continue
        if id(text) not in unused:
            found.append((text, text.get_window_extent(renderer)))
    return found


def _unused_ticks(figure: Figure) -> set[int]:
    """Return the labels of ticks that are not drawn: outside the limits, or left over."""
    every: set[int] = set()
    drawn: set[int] = set()
    for ax in figure.findobj(Axes):
        for axis in (ax.xaxis, ax.yaxis):  # type: ignore[attr-defined]
            for tick in [*axis.majorTicks, *axis.minorTicks]:
                every |= {id(tick.label1), id(tick.label2)}
            if ax.get_visible() and axis.get_visible():
                for tick in axis._update_ticks():
                    drawn |= {id(tick.label1), id(tick.label2)}
    return every - drawn


@pytest.mark.slow
@pytest.mark.parametrize("n", matrix(COUNTS, [max(COUNTS)]))
@pytest.mark.parametrize("name", DRAWN)
def test_no_text_is_clipped(name: str, n: int) -> None:
    figure = drawn(name, n)
    for text, box in texts(figure):
        room = figure.bbox
        assert room.x0 - 1 <= box.x0, text.get_text()
        assert room.y0 - 1 <= box.y0, text.get_text()
        assert box.x1 <= room.x1 + 1, text.get_text()
        assert box.y1 <= room.y1 + 1, text.get_text()


@pytest.mark.slow
@pytest.mark.parametrize("n", COUNTS)
@pytest.mark.parametrize("name", DRAWN)
def test_no_text_covers_another(name: str, n: int) -> None:
    clashes = []
    for (one, a), (other, b) in combinations(texts(drawn(name, n)), 2):
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        if wide > 1.5 and high > 1.5 and one.get_text() != other.get_text():
            clashes.append((one.get_text(), other.get_text(), round(wide, 1), round(high, 1)))
    assert not clashes


@pytest.mark.slow
@pytest.mark.parametrize("n", COUNTS)
@pytest.mark.parametrize("name", ["overview", "ribbons", "cascade", "laws", "unfold"])
def test_no_label_of_an_element_is_taller_than_its_row(name: str, n: int) -> None:
    figure = drawn(name, n)
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    seen = 0
    for ax in figure.findobj(Axes):
        labels = ax.get_yticklabels()  # type: ignore[attr-defined]
        if not [each for each in labels if each.get_text() == "E1"]:
            continue
        seen += 1
        assert len(labels) == n
        pixels = ax.transData.transform([(0, 1), (0, 2)])[:, 1]  # type: ignore[attr-defined]
        row = abs(float(pixels[1] - pixels[0]))
        for text in labels:
            assert text.get_window_extent(renderer).height <= row
    assert seen


@pytest.mark.parametrize("n", [4, 12])
def test_many_elements_are_rows_and_counted(n: int) -> None:
    rows = [ax for ax in drawn("ribbons", n).axes if "E1" in _labels(ax)]
    strips = [ax for ax in rows if any(isinstance(each, QuadMesh) for each in ax.collections)]
    assert len(strips) == (2 if n > 6 else 0)
    titles = [ax.get_title(loc="right") for ax in drawn("overview", n).axes]
    assert any(f"of {n} in slip" in title for title in titles) == (n > 6)


def _labels(ax: Axes) -> list[str]:
    return [each.get_text() for each in ax.get_yticklabels()]


# --------------------------------------------------------------------------- colours that are drawn
NEUTRAL = {"ink", "soft", "line", "pale", "paper", "compared", "fails", "grid", "chosen"}
ALLOWED = {
    "overview": {"states", "hatches", "slipping"},
    "ribbons": {"states", "hatches", "slipping", "elements", "heat"},
    "cascade": {"states", "hatches", "elements", "heat"},
    "laws": {"states", "hatches", "elements", "heat"},
    "fig3": set(),
    "fig4": {"elements"},
    "landscape": {"edges", "now"},
    "phase": {"slipping", "now"},
    "residual": set(),
    "unfold": {"states", "hatches"},
}


@pytest.mark.parametrize("n", [4, 12])
@pytest.mark.parametrize("name", ALLOWED)
def test_every_colour_is_a_role_that_the_figure_may_use(name: str, n: int) -> None:
    wanted = {"#000000"}  # axes, whose colour is that of text
    for role in NEUTRAL | ALLOWED[name]:
        wanted |= set(ROLES[role].light)
        for count in (n, n + 1, 256):
            wanted |= set(ramp(role, count))
    found = _colours(drawn(name, n))
    assert found - wanted == set()
    assert found - {"#000000", "#FFFFFF"}


def _colours(figure: Figure) -> set[str]:
    """Return the opaque colours of lines, fills and texts."""
    found: set[str] = set()
    for artist in figure.findobj():
        if not artist.get_visible():
            continue
        for getter in ("get_color", "get_facecolor", "get_edgecolor"):
            if not hasattr(artist, getter) or isinstance(artist, QuadMesh):
                continue
            values = getattr(artist, getter)()
            rows = [values] if isinstance(values, str) else np.atleast_2d(np.asarray(values))
            for value in rows:
                rgba = value if isinstance(value, str) else tuple(value)
                if (isinstance(rgba, str) and rgba == "none") or (len(rgba) == 4 and not rgba[3]):
                    continue
                found.add(to_hex(rgba).upper())
    return found
