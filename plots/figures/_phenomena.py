"""Figures of the phenomena bench: small multiples of one experiment, and the matrix of verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gms_fsm.phenomena.results import MARKS, VERDICTS, PhenomenaTable, Phenomenon, PhenomenonResult
from plots.figures._layout import fitted, sheet
from plots.panels.parts.axes import beside
from plots.style import (
    INK,
    LINE_GREY,
    PALE_GREY,
    TEXT_GREY,
    colour,
    compared_look,
)
from plots.style.mathtext import folded
from plots.style.matplotlib import Axes, Figure, Rectangle, rc_context
from plots.style.presets import font, inches, pt, room, settings, to_scale

COLUMNS, PANEL, NARROWEST = 3, (2.7, 2.15), 1.9  # in
LETTERS = 12.5  # per inch, of the text under the panels
WORDS = 14  # letters of a heading, in a line
CELL, NAME = 0.98, 0.087  # in: width of a cell, of a letter of a model's name
TOO_LARGE = 4.0  # times the median range: such a panel has its own axis
# Verdicts differ by shape; the grounds only help to find them.
TINTS = {"shows": "chosen", "shows wrongly": "pale"}


def phenomenon_figure(table: PhenomenaTable, name: str) -> Figure | None:
    """Draw what the models do in one experiment, a panel each.

    Parameters
    ----------
    table : PhenomenaTable
        From `gms_fsm.measure_phenomena`.
    name : str
        Name of the phenomenon.

    Returns
    -------
    Figure or None
        None if no model has a curve.
    """
    phenomenon = next(each for each in table.phenomena if each.name == name)
    shown = [(model, table.cell(model, name)) for model in table.models]
    shown = [(model, found) for model, found in shown if found.curves]
    if not shown:
        return None
    wide = room(COLUMNS * PANEL[0] + 0.3)
    columns = min(max(2, int((wide - 0.3) / NARROWEST)), COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    with rc_context(settings()):
        size = (max(columns * PANEL[0], 5.4) + 0.3, rows * PANEL[1] + 0.95)
        figure = sheet(*size, grows=True)
        grid = figure.subplots(rows, columns, squeeze=False)
        limits = [_common(shown, axis, phenomenon) for axis in ("x", "y")]
        left: set[str] = set()
        for place, (model, found) in enumerate(shown):
            ax = grid.flat[place]
            own = _panel(ax, model, found, phenomenon, limits)
            # Numbers are written once for neighbours with the same axes.
            ax.tick_params(
                labelbottom="x" in own or place + columns >= len(shown) or phenomenon.log,
                labelleft="y" in own | left or place % columns == 0,
            )
            left = own
        for ax in grid.flat[len(shown) :]:
            ax.set_axis_off()
        letters = int(LETTERS * room(size[0]))
        below = "\n".join(folded(each, letters) for each in _told(shown, phenomenon))
        look: Any = {"family": "DejaVu Sans", "fontsize": font(9.5)}
        figure.supxlabel(f"{phenomenon.axes[0]}\n\n{below}", **look)
        figure.supylabel(phenomenon.axes[1], fontsize=font(9.5))
        figure.suptitle(phenomenon.title, x=0.01, ha="left", fontsize=font(12))
        handles, labels = grid.flat[0].get_legend_handles_labels()
        if labels:
            figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    return fitted(figure)


def _told(shown: Sequence[tuple[str, PhenomenonResult]], phenomenon: Phenomenon) -> tuple[str, str]:
    """Return what mark and number of a panel mean, a line each."""
    seen = {found.verdict for _, found in shown}
    marks = ", ".join(f"{mark} {verdict}" for verdict, mark in MARKS.items() if verdict in seen)
    number = shown[0][1].numbers[0].name
    rule = f" (shows it if {phenomenon.shows_if})" if phenomenon.shows_if else ""
    return f"Below each name: {marks};", f"{number}{rule}."


def _panel(
    ax: Axes,
    model: str,
    found: PhenomenonResult,
    phenomenon: Phenomenon,
    limits: Sequence[tuple[float, float] | None],
) -> set[str]:
    """Draw the curves of a model; return which axes have a scale of their own."""
    for number, curve in enumerate(found.curves):
        marker = "o" if curve.x.size < 20 else ""
        ax.plot(
            curve.x,
            curve.y,
            marker=marker,
            markersize=pt(3),
            label=curve.label,
            zorder=3 - 0.1 * number,  # a thin line is seen on a broad one
            **to_scale(compared_look(number)),
        )
    if phenomenon.log:
        ax.set_xscale("log")
    own: set[str] = set()
    for axis, limit in zip(("x", "y"), limits, strict=True):
        if limit is None:
            continue
        low, high = _range([found], axis)
        # What slides away leaves the panel; its scale would hide all else that it does.
        if found.instead or (limit[0] <= low and high <= limit[1]):
            ax.set(**{f"{axis}lim": limit})
        else:
            own.add(axis)
    if not phenomenon.log:
        ax.locator_params(axis="x", nbins=4)
    ax.locator_params(axis="y", nbins=4)
    ax.tick_params(labelsize=font(7.5), length=2.5)
    ax.grid(color=colour("pale"), linewidth=pt(0.5))  # most panels have no numbers of their own
    if found.verdict == "shows wrongly":
        ax.set_facecolor(colour("chosen"))
    ax.set_title(model, fontsize=font(9), fontweight="bold", pad=inches(15))
    brief = f"{MARKS[found.verdict]} {phenomenon.brief(found)}" + (", own scale" if own else "")
    look = {"xycoords": "axes fraction", "ha": "left", "va": "baseline", "family": "DejaVu Sans"}
    beside(ax, brief, (0.0, 1.0), (0, inches(4)), **look)
    return own


def _range(found: Sequence[PhenomenonResult], axis: str) -> tuple[float, float]:
    values = np.concatenate([getattr(curve, axis) for one in found for curve in one.curves])
    values = values[np.isfinite(values)]
    return float(values.min()), float(values.max())


def _common(
    shown: Sequence[tuple[str, PhenomenonResult]], axis: str, phenomenon: Phenomenon
) -> tuple[float, float] | None:
    """Return the limits of all panels that are of about the same size; None on a log axis."""
    if phenomenon.log and axis == "x":
        return None
    ranges = [_range([found], axis) for _, found in shown]
    sizes = np.array([max(abs(low), abs(high)) for low, high in ranges])
    usual = float(np.median(sizes[sizes > 0.0])) if (sizes > 0.0).any() else 1.0
    kept = [each for each, size in zip(ranges, sizes, strict=True) if size <= TOO_LARGE * usual]
    low, high = min(each[0] for each in kept), max(each[1] for each in kept)
    margin = 0.06 * (high - low) or 1.0
    return low - margin, high + margin


def phenomena_matrix(
    table: PhenomenaTable, *, title: str = "", notes: Sequence[str] = (), below: float = 0.0
) -> Figure:
    """Draw models against phenomena, with a symbol and a number in each cell.

    Parameters
    ----------
    table : PhenomenaTable
        From `gms_fsm.measure_phenomena`.
    title : str
        Above the matrix.
    notes : sequence of str
        Short texts under the columns, the first under the models' names; by default, what the
        numbers of models are that show it.
    below : float
        Height of the empty space under the matrix for panels of your own, in.

    Returns
    -------
    Figure
        Models that take part in no experiment are left out. In one column of a journal the cells
        are too narrow for numbers and notes.
    """
    models = [model for model in table.models if model not in table.left_out()]
    left = 0.15 + NAME * max([8, *map(len, models)])
    size = room(left + CELL * len(table.phenomena) + 0.2)
    wide, high = (size - left - 0.2) / len(table.phenomena), 0.46  # in, of a cell
    brief = wide < 0.95 * CELL
    under_heads = [*notes] or ["shows it if", *(each.shows_if for each in table.phenomena)]
    under_heads = [] if brief else [folded(note, WORDS) for note in under_heads]
    heads = [each.short if brief else folded(each.short, WORDS) for each in table.phenomena]
    above = 0.25 + 0.14 * max(head.count("\n") + 1 for head in heads)
    if brief:
        high, above = 0.3, 0.25 + 0.064 * max(map(len, heads))
    above += 0.3 if title else 0.0
    found_any = {table.cell(model, one.name).verdict for model in models for one in table.phenomena}
    key = [each for each in VERDICTS if each in found_any]
    lines = _lines(key, size)
    noted = 0.13 * max([0, *(note.count("\n") + 1 for note in under_heads)])
    under = 0.35 + 0.2 * len(lines) + noted
    tall = above + under + high * max(1, len(models))
    with rc_context(settings()):
        figure = sheet(size, tall + below, layout=None, grows=True)
        total = figure.get_figheight() / inches(1)
        ax = figure.add_axes((0.0, 1 - tall / total, 1.0, tall / total))
        ax.set(xlim=(0.0, size), ylim=(0.0, tall))
        ax.set_axis_off()
        if title:
            ax.text(0.1, tall - 0.08, title, ha="left", va="top", fontsize=font(12))
        top = tall - above
        for column, head in enumerate(heads):
            at = (left + (column + 0.5) * wide, top + 0.1)
            turned = 90 if brief else 0
            ax.text(*at, head, ha="center", va="bottom", fontsize=font(8), rotation=turned)
        for row, model in enumerate(models):
            y = top - (row + 0.5) * high
            ax.text(left - 0.1, y, model, ha="right", va="center", fontsize=font(9))
            for column, phenomenon in enumerate(table.phenomena):
                found = table.cell(model, phenomenon.name)
                corner = (left + column * wide, y - 0.5 * high)
                tint: Any = colour(TINTS.get(found.verdict, "paper"))
                ax.add_patch(
                    Rectangle(corner, wide, high, facecolor=tint, edgecolor=PALE_GREY, lw=pt(0.6))
                )
                _symbol(ax, corner[0] + (0.5 * wide if brief else 0.16), y, found.verdict)
                if not brief:
                    look: Any = {"va": "center", "fontsize": font(9.5), "linespacing": 1.05}
                    text = phenomenon.brief(found)
                    if found.instead:
                        text, look["fontsize"] = text.replace(" ", "\n", 1), font(8.5)
                    ax.text(corner[0] + 0.28, y, text, **look)
        for column, note in enumerate(under_heads):
            x, side = (
                (left - 0.1, "right") if column == 0 else (left + (column - 0.5) * wide, "center")
            )
            ax.text(x, under - 0.07, note, ha=side, va="top", fontsize=font(7.5), color=TEXT_GREY)
        for place, line in enumerate(reversed(lines)):
            for x, verdict in line:
                y = 0.15 + 0.2 * place
                _symbol(ax, x, y, verdict)
                ax.text(x + 0.16, y, verdict, va="center", fontsize=font(8.5))
    return fitted(figure)


def _lines(key: Sequence[str], wide: float) -> list[list[tuple[float, str]]]:
    """Place the key of the symbols, in as many lines as it needs."""
    lines: list[list[tuple[float, str]]] = [[]]
    x = 0.3
    for verdict in key:
        long = 0.45 + 0.075 * len(verdict)
        if lines[-1] and x + long > wide:
            lines.append([])
            x = 0.3
        lines[-1].append((x, verdict))
        x += long
    return lines


def _symbol(ax: Axes, x: float, y: float, verdict: str) -> None:
    if verdict == "shows":
        ax.plot([x], [y], "o", color=INK, markersize=pt(8))
    elif verdict == "does not show":
        ax.plot(
            [x], [y], "o", color=TEXT_GREY, markersize=pt(7.5), markerfacecolor="none", mew=pt(1.4)
        )
    elif verdict == "shows wrongly":
        ax.plot([x], [y], "X", color=INK, markersize=pt(8.5))
    elif verdict == "does not apply":
        ax.plot([x - 0.06, x + 0.06], [y, y], color=LINE_GREY, linewidth=pt(1.4))
    else:
        ax.text(x, y, "?", ha="center", va="center", color=INK, fontsize=font(10))
