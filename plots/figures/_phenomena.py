"""Figures of the phenomena bench: small multiples of one experiment, and the matrix of verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gms_fsm.phenomena.results import MARKS, VERDICTS, Measured, PhenomenaTable, Phenomenon
from plots._matplotlib import Axes, Figure, Rectangle, rc_context
from plots.figures._layout import fitted, sheet
from plots.presets import font, pt, settings
from plots.style import (
    INK,
    LINE_GREY,
    PALE_GREY,
    RC,
    TEXT_GREY,
    colour,
    compared_look,
)

__all__ = ["phenomena_matrix", "phenomenon_figure"]

COLUMNS, PANEL = 4, (2.7, 2.15)  # in
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
    columns = min(COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    with rc_context(settings()):
        size = (max(columns * PANEL[0], 5.4) + 0.3, rows * PANEL[1] + 0.95)
        sheet = sheet(*size)
        grid = sheet.subplots(rows, columns, squeeze=False)
        limits = [_common(shown, axis, phenomenon) for axis in ("x", "y")]
        for ax, (model, found) in zip(grid.flat, shown, strict=False):
            _panel(ax, model, found, phenomenon, limits)
        for ax in grid.flat[len(shown) :]:
            ax.set_axis_off()
        sheet.supxlabel(phenomenon.axes[0], fontsize=font(9.5))
        sheet.supylabel(phenomenon.axes[1], fontsize=font(9.5))
        sheet.suptitle(phenomenon.title, x=0.01, ha="left", fontsize=font(12))
        handles, labels = grid.flat[0].get_legend_handles_labels()
        if labels:
            sheet.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    return fitted(sheet)


def _panel(
    ax: Axes,
    model: str,
    found: Measured,
    phenomenon: Phenomenon,
    limits: Sequence[tuple[float, float] | None],
) -> None:
    for number, curve in enumerate(found.curves):
        marker = "o" if curve.x.size < 20 else ""
        ax.plot(
            curve.x,
            curve.y,
            marker=marker,
            markersize=3,
            label=curve.label,
            **compared_look(number),
        )
    if phenomenon.log:
        ax.set_xscale("log")
    own = False
    for axis, limit in zip(("x", "y"), limits, strict=True):
        low, high = _range([found], axis)
        if limit is None or low < limit[0] or high > limit[1]:
            own = own or limit is not None
        else:
            ax.set(**{f"{axis}lim": limit})
    if not phenomenon.log:
        ax.locator_params(axis="x", nbins=4)
    ax.locator_params(axis="y", nbins=4)
    ax.tick_params(labelsize=font(7.5), length=2.5)
    ax.set_title(model, fontsize=font(9), fontweight="bold", pad=15)
    brief = f"{MARKS[found.verdict]} {found.numbers[0]}" + (", own scale" if own else "")
    ax.annotate(
        brief,
        (0.0, 1.0),
        (0, 4),
        xycoords="axes fraction",
        textcoords="offset points",
        fontsize=8,
        color=INK,
        family="DejaVu Sans",
    )


def _range(found: Sequence[Measured], axis: str) -> tuple[float, float]:
    values = np.concatenate([getattr(curve, axis) for one in found for curve in one.curves])
    values = values[np.isfinite(values)]
    return float(values.min()), float(values.max())


def _common(
    shown: Sequence[tuple[str, Measured]], axis: str, phenomenon: Phenomenon
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
        Short texts under the columns, such as thresholds; the first is under the models' names.
    below : float
        Height of the empty space under the matrix for panels of your own, in.

    Returns
    -------
    Figure
        Models that take part in no experiment are left out.
    """
    models = [model for model in table.models if model not in table.left_out()]
    wide, high = 1.28, 0.46  # in, of a cell
    left = 0.11 * max([8, *map(len, models)])
    heads = [_folded(each.short) for each in table.phenomena]
    above = 0.25 + 0.14 * max(head.count("\n") + 1 for head in heads)
    above += 0.3 if title else 0.0
    size = (left + wide * len(heads) + 0.2, above + 0.7 + high * max(1, len(models)))
    with rc_context(settings()):
        total = size[1] + below
        sheet = sheet(size[0], total, layout=None)
        ax = sheet.add_axes((0.0, below / total, 1.0, size[1] / total))
        ax.set(xlim=(0.0, size[0]), ylim=(0.0, size[1]))
        ax.set_axis_off()
        if title:
            ax.text(0.1, size[1] - 0.08, title, ha="left", va="top", fontsize=font(12))
        top = size[1] - above
        for column, head in enumerate(heads):
            x = left + (column + 0.5) * wide
            ax.text(x, top + 0.1, head, ha="center", va="bottom", fontsize=font(8))
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
                _symbol(ax, corner[0] + 0.2, y, found.verdict)
                if found.numbers:
                    ax.text(
                        corner[0] + 0.36, y, str(found.numbers[0]), va="center", fontsize=font(8.5)
                    )
        for column, note in enumerate(notes):
            x, side = (
                (left - 0.1, "right") if column == 0 else (left + (column - 0.5) * wide, "center")
            )
            ax.text(x, 0.56, note, ha=side, va="center", fontsize=font(7.5), color=TEXT_GREY)
        x = left + 0.2
        found_any = {
            table.cell(model, one.name).verdict for model in models for one in table.phenomena
        }
        for verdict in (each for each in VERDICTS if each in found_any):
            _symbol(ax, x, 0.3, verdict)
            ax.text(x + 0.16, 0.3, verdict, va="center", fontsize=font(8.5))
            x += 0.45 + 0.075 * len(verdict)
    return fitted(sheet)


def _symbol(ax: Axes, x: float, y: float, verdict: str) -> None:
    if verdict == "shows":
        ax.plot([x], [y], "o", color=INK, markersize=8)
    elif verdict == "does not show":
        ax.plot([x], [y], "o", color=TEXT_GREY, markersize=7.5, markerfacecolor="none", mew=1.4)
    elif verdict == "shows wrongly":
        ax.plot([x], [y], "X", color=INK, markersize=8.5)
    elif verdict == "does not apply":
        ax.plot([x - 0.06, x + 0.06], [y, y], color=LINE_GREY, linewidth=pt(1.4))
    else:
        ax.text(x, y, "?", ha="center", va="center", color=INK, fontsize=10)


def _folded(text: str) -> str:
    """Break a heading into lines of at most 16 characters."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= 16:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)
