"""The texts of a figure as they are drawn: their boxes, which overlap, which leave the figure."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from plots.panels.guards.line_names import LineNames

PIXEL = 1.0


def drawn_texts(figure: Figure) -> list[tuple[Text, Bbox]]:
    """Return the visible, non-empty texts of a figure, and their boxes in pixels."""
    canvas: Any = FigureCanvasAgg(figure)
    renderer = canvas.get_renderer()
    figure.draw_without_rendering()
    hidden = set(_undrawn_labels(figure))
    found = [text for text in _texts(figure, renderer) if id(text) not in hidden]
    return [(text, Text.get_window_extent(text, renderer)) for text in found]


def problems(figure: Figure, smallest: float) -> list[str]:
    """Return texts that are too small, leave the figure, or overlap."""
    texts = drawn_texts(figure)
    whole = figure.bbox
    found = [f"{t.get_fontsize()} pt: {t.get_text()}" for t, _ in texts if _small(t, smallest)]
    for text, box in texts:
        inside = box.x0 > -PIXEL and box.x1 < whole.x1 + PIXEL
        if not (inside and box.y0 > -PIXEL and box.y1 < whole.y1 + PIXEL):
            found.append(f"leaves the figure: {text.get_text()}")
    for (a, first), (b, second) in combinations([(t, _inked(t, box)) for t, box in texts], 2):
        wide = min(first.x1, second.x1) - max(first.x0, second.x0)
        tall = min(first.y1, second.y1) - max(first.y0, second.y0)
        # Boxes have the height of a line; letters need less.
        if wide > PIXEL and tall > PIXEL + 0.12 * min(first.height, second.height):
            found.append(f"overlap: {a.get_text()} and {b.get_text()}")
    return found


def _inked(text: Text, box: Bbox) -> Bbox:
    """Return a box without the blanks that a level text begins with."""
    whole = text.get_text()
    blanks = 0 if text.get_rotation() else len(whole) - len(whole.lstrip())
    return Bbox.from_extents(box.x0 + blanks / len(whole) * box.width, box.y0, box.x1, box.y1)


def _small(text: Text, smallest: float) -> bool:
    return bool(text.get_fontsize() < smallest - 1e-6)


def _texts(artist: Any, renderer: Any) -> Iterator[Text]:
    if not artist.get_visible():
        return
    if isinstance(artist, LineNames):
        yield from artist.placed(renderer)
    elif not isinstance(artist, Text):
        for child in artist.get_children():
            yield from _texts(child, renderer)
    elif artist.get_text().strip() and getattr(artist, "fits", lambda _: True)(renderer):
        yield artist


def _undrawn_labels(figure: Figure) -> Iterator[int]:
    """Yield the labels of ticks outside the view, which matplotlib keeps."""
    axes: list[Axes] = [each for ax in figure.axes for each in (ax, *ax.child_axes)]
    for axis in (axis for ax in axes for axis in (ax.xaxis, ax.yaxis)):
        shown = axis._update_ticks() if axis.axes.axison else []
        for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
            if tick not in shown:
                yield from (id(tick.label1), id(tick.label2))
