"""Figures in the sizes of the preset in use: their sheet, and texts that have to fit it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any, cast

import numpy as np

from plots.panels.parts.titles import lettered
from plots.style.matplotlib import (
    Artist,
    AutoLocator,
    Axes,
    Axis,
    Bbox,
    Figure,
    FigureCanvasAgg,
    Legend,
    MaxNLocator,
    RendererBase,
    Text,
    rc_context,
)
from plots.style.presets import SCREEN, current, inches, pt, room, settings

NARROW = 6.0  # inches of the screen: a narrower figure has one column of panels
TRIES = 7  # of a layout: folded titles move the panels


def narrow() -> bool:
    """Return whether panels must be below each other."""
    return room(11.0) < NARROW


def low() -> bool:
    """Return whether the height is given, and small: a slide."""
    return current().height is not None


def sheet(
    wide: float, tall: float, *, layout: str | None = "constrained", grows: bool = False
) -> Figure:
    """Return an empty figure."""
    used = current()
    high = inches(tall)
    if used.height is not None:
        high = max(used.height, high) if grows else used.height
    size = (used.width or inches(wide), high)
    return Figure(figsize=size, layout=cast(Any, layout), dpi=used.dpi)


def fitted(figure: Figure) -> Figure:
    """Fold titles that are too wide, and thin out the numbers of axes, until nothing overlaps."""
    with rc_context(settings()):
        aligned(figure)
        if current() is not SCREEN:
            _fit(figure)
        elif any(_rows(ax) > 1 for ax in figure.axes):
            figure.draw_without_rendering()
            for ax in figure.axes:
                _above_legend(ax, _renderer(figure))
    return figure


def aligned(figure: Figure) -> None:
    """Write the names of the y axes of panels that are below each other in one line."""
    grids: dict[Any, list[Axes]] = {}
    for ax in figure.axes:
        place = ax.get_subplotspec()
        if place is not None:
            grids.setdefault(place.get_gridspec(), []).append(ax)
    for first, *others in grids.values():
        first.figure.align_ylabels([first, *others])


def _rows(ax: Axes) -> int:
    """Return how many rows the legend of a panel has."""
    legend: Any = ax.get_legend()
    return 0 if legend is None else -(-len(legend.get_texts()) // legend._ncols)


def _fit(figure: Figure) -> None:
    renderer = _renderer(figure)
    figure.draw_without_rendering()
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            _pinned(axis)
    for _ in range(TRIES):
        figure.draw_without_rendering()
        changed = _head_folded(figure, renderer)
        changed |= _titles_folded(figure, renderer)
        for ax in figure.axes:
            changed |= _thinned(ax.xaxis, renderer) | _thinned(ax.yaxis, renderer)
            changed |= _above_legend(ax, renderer)
            changed |= _label_folded(ax, renderer)
        if not changed:
            break


def _renderer(figure: Figure) -> RendererBase:
    canvas: Any = FigureCanvasAgg(figure)  # half of its methods are untyped
    found: RendererBase = canvas.get_renderer()
    return found


def _head_folded(figure: Figure, renderer: RendererBase) -> bool:
    """Fold the title of the figure."""
    head = figure._suptitle  # type: ignore[attr-defined]
    if head is None:
        return False
    wide = figure.bbox.width - head.get_window_extent(renderer).x0 - inches(0.05) * figure.dpi
    return _folded(head, wide, renderer)


def _titles_folded(figure: Figure, renderer: RendererBase) -> bool:
    """Fold the titles of panels that would reach into the next panel, or out of the figure."""
    changed = False
    box = cache(lambda ax: ax.get_tightbbox(renderer))  # takes long, and few are needed
    for ax in figure.axes:
        title = ax._left_title  # type: ignore[attr-defined]
        title = title if title.get_text() else ax.title
        if not title.get_text():
            continue
        mine = ax.get_window_extent(renderer)
        rights = [figure.bbox.width]
        for other in figure.axes:
            theirs = other.get_window_extent(renderer)
            if theirs.x0 >= mine.x1 and theirs.y0 < mine.y1 + 1 and mine.y0 < theirs.y1 + 1:
                whole = box(other)
                rights.append(theirs.x0 if whole is None else min(theirs.x0, whole.x0))
        begin, space = title.get_window_extent(renderer).x0, inches(0.05) * figure.dpi
        wide = max(min(rights) - begin - space, 0.6 * mine.width)
        beside = ax._right_title  # type: ignore[attr-defined]
        if beside.get_text():
            wide = min(wide, beside.get_window_extent(renderer).x0 - begin - space)
        changed |= _folded(title, wide, renderer)
    return changed


def _folded(text: Text, wide: float, renderer: RendererBase) -> bool:
    """Break the lines of a text between words so that none is wider than so many pixels."""
    if text.get_window_extent(renderer).width <= wide:
        return False
    words, lines = text.get_text().replace("\n", " \n ").split(" "), [""]
    for word in words:
        if word == "\n":
            lines.append("")
            continue
        longer = f"{lines[-1]} {word}".strip()
        text.set_text(longer)
        if lines[-1] and text.get_window_extent(renderer).width > wide:
            lines.append(word)
        else:
            lines[-1] = longer
    text.set_text("\n".join(line for line in lines if line))
    return True


def _pinned(axis: Axis) -> None:
    """Keep the numbers of an axis: matplotlib chooses them anew whenever it draws.

    By then the preset may no longer be in use.
    """
    locator: Any = axis.get_major_locator()
    if isinstance(locator, AutoLocator) and getattr(locator, "_nbins", 0) == "auto":
        room_for = int(np.clip(axis.get_tick_space(), 1, 9))
        axis.set_major_locator(MaxNLocator(room_for, steps=[1, 2, 2.5, 5, 10]))


def _thinned(axis: Axis, renderer: RendererBase) -> bool:
    """Show fewer numbers on an axis if they meet."""
    locator = axis.get_major_locator()
    ticks = [each for each in axis._update_ticks() if each.label1.get_visible()]  # type: ignore[attr-defined]
    ticks = [each for each in ticks if each.label1.get_text()]
    boxes = [each.label1.get_window_extent(renderer) for each in ticks]
    space = pt(3.0) / 72 * axis.figure.dpi * (axis.axis_name == "x")  # type: ignore[attr-defined]
    if not any(_meet(a, b, space) for a, b in pairwise(boxes)):
        return False
    if len(boxes) < 3:
        return False
    if not isinstance(locator, MaxNLocator):
        places = np.array([each.get_loc() for each in ticks])
        texts = [each.label1.get_text() for each in ticks]
        begin = int(np.argmin(np.abs(places))) % 2  # zero stays
        axis.set_ticks(places[begin::2], texts[begin::2])
        return True
    fewer = max(1, min(len(boxes) - 2, round(0.7 * len(boxes))))
    axis.set_major_locator(MaxNLocator(fewer, steps=[1, 2, 2.5, 5, 10], min_n_ticks=2))
    return True


def _label_folded(ax: Axes, renderer: RendererBase) -> bool:
    """Fold the label of the x axis if it would leave the figure."""
    box, whole = ax.xaxis.label.get_window_extent(renderer), ax.figure.bbox
    if whole.x0 <= box.x0 and box.x1 <= whole.x1:
        return False
    return _folded(ax.xaxis.label, ax.get_window_extent(renderer).width, renderer)


def _meet(a: Bbox, b: Bbox, space: float = 0.0) -> bool:
    return bool(
        min(a.x1, b.x1) + space > max(a.x0, b.x0) and min(a.y1, b.y1) > max(a.y0, b.y0) + 0.5
    )


def _above_legend(ax: Axes, renderer: RendererBase) -> bool:
    """Move the title of a panel above its legend if both are next to each other and meet."""
    legend, title = ax.get_legend(), ax._left_title  # type: ignore[attr-defined]
    if legend is None or not title.get_text():
        return False
    box, own = legend.get_window_extent(renderer), title.get_window_extent(renderer)
    if box.y0 < ax.get_window_extent(renderer).y1 - 1 or not _meet(box, own):
        return False
    pad = (box.y1 - ax.get_window_extent(renderer).y1) / ax.figure.dpi * 72 + pt(2.0)
    if ax.title.get_text():
        lettered(ax, ax.title.get_text(), title.get_text(), pad=pad)
    else:
        ax.set_title(title.get_text(), pad=pad)
    # A letter that reaches below the line meets the legend there, too.
    return bool(abs(title.get_window_extent(renderer).y0 - own.y0) > 0.5)


def legend_below(
    figure: Figure, handles: Sequence[Artist], labels: Sequence[str], *, most: int = 10
) -> Legend:
    """Add a legend below the panels, with as many columns as there is room for."""
    wide = figure.bbox.width - inches(0.1) * figure.dpi

    def legend(columns: int) -> Legend:
        return figure.legend(
            list(handles),
            list(labels),
            loc="outside lower left",
            ncols=columns,
            handlelength=2.6,
            columnspacing=1.2,
        )

    return _with_columns(legend, min(most, len(labels)), wide, _renderer(figure))


def legend_above(ax: Axes) -> None:
    """Put the legend of a panel next to its title, where there are no curves.

    It has as many columns as there is room for.
    """
    figure: Any = ax.figure
    renderer = _renderer(figure.figure if figure.figure is not figure else figure)

    def legend(columns: int) -> Legend:
        return ax.legend(
            loc="lower right",
            bbox_to_anchor=(1, 1),
            ncols=columns,
            borderaxespad=0.1,
            columnspacing=1.2,
            handlelength=2.2,
            handletextpad=0.5,
        )

    _with_columns(legend, 6, ax.get_window_extent(renderer).width, renderer)


def _with_columns(
    legend: Callable[[int], Legend], most: int, wide: float, renderer: RendererBase
) -> Legend:
    """Return a legend with as many columns as fit into so many pixels."""
    for columns in range(most, 1, -1):
        made = legend(columns)
        if made.get_window_extent(renderer).width <= wide:
            return made
        made.remove()
    return legend(1)
