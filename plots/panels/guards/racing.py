"""The panel of the race to fire: how far each clause of each edge is from being true."""

from __future__ import annotations

import math
from typing import Any

from gms_fsm.foundation.quantities import trimmed
from gms_fsm.session.explain import Clause, Explanation, Why, explain_alone
from gms_fsm.traces.trace import Trace
from plots.charts.labels import FALSE, TRUE
from plots.panels.parts.axes import Artists, note
from plots.panels.parts.selection import checked_row, one_element
from plots.style import EDGE_COLOURS, EDGE_HATCHES, INK, LINE_GREY, PAPER, TEXT_GREY
from plots.style.matplotlib import Axes, Rectangle
from plots.style.presets import font, pt

__all__ = ["race"]

LONGEST = 44  # letters of a lane's name and verdict, before they become smaller
GAP = 0.35  # rows between lanes
SHORTEST = 0.015  # length of a bar that would otherwise be invisible


def relative_margin(clause: Clause) -> float:
    """Return the margin of a clause over its larger side, from -1 to 1; NaN if it has no sides.

    Examples
    --------
    >>> relative_margin(Clause("z >= s", False, 0.5, 2.0, -1.5))
    -0.75
    """
    return min(max(clause.relative, -1.0), 1.0)  # NaN stays


def held_back_by(each: Explanation) -> Clause | None:
    """Return the clause that holds an edge back: the false one with the smallest relative margin.

    Compound clauses, which have no margin, are named only if all others are true. None if the guard
    is true.
    """
    false = [clause for clause in each.clauses if not clause.holds]
    if each.holds or not false:
        return None

    def farness(clause: Clause) -> float:
        found = relative_margin(clause)
        return 2.0 if math.isnan(found) else found

    return min(false, key=farness)


def rows_of(why: Why) -> float:
    """Return the height of a race: one row per edge and per clause, and the gaps."""
    return sum(1.0 + len(each.clauses) + GAP for each in why) or 2.0


def race(ax: Axes, trace: Trace, element: int, *, row: int = -1) -> Artists:
    """Draw how far each clause of the edges that leave the active state is from being true.

    One lane per edge, one bar per clause: to the right and filled if the clause is true, to the
    left and open if it is false. The length is the margin over the larger side, at most 1. The
    clause that holds an edge back is bold: the false one with the smallest relative margin.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    element : int
        Which element, counted from 0.
    row : int
        Row of the run; negative rows count from the end. On a row made by a firing of this element
        the row before is shown.

    Returns
    -------
    list of Artist
        For each lane its swatch, its name and its verdict, then for each clause text, numbers and,
        if it has two sides, a bar.
    """
    why = explain_alone(trace, checked_row(trace, row), one_element(trace, element))
    ax.spines[:].set_visible(False)
    if not why.edges:
        ax.set_xticks([])
        return [note(ax, f"no edge leaves {why.state}")]
    drawn: Artists = []
    y = 0.0
    for number, each in enumerate(why):
        drawn += _lane(ax, each, number, y)
        # The zero of the bars, not through the name of the edge.
        ends = [y + 0.5, y + len(each.clauses) + 0.4]
        ax.plot([0, 0], ends, color=LINE_GREY, linewidth=pt(0.8), zorder=1)
        y += 1.0 + len(each.clauses) + GAP
    ax.set(xlim=(-1.04, 1.04), ylim=(y - 0.75, -0.6), yticks=[])
    ax.set_xticks([-1, -0.5, 0, 0.5, 1], ["−1", "−0.5", "0", "0.5", "1"])
    ax.set_xlabel(
        "open: false   ←   margin / larger side [–]   →   filled: true\n"
        "bold: the clause that holds an edge back"
    )
    return drawn


def _lane(ax: Axes, each: Explanation, number: int, y: float) -> Artists:
    """Draw one edge and its clauses."""
    colour = EDGE_COLOURS[number % len(EDGE_COLOURS)]
    hatch = EDGE_HATCHES[number % len(EDGE_HATCHES)]
    drawn: Artists = []
    for fill, alpha, pattern in ((colour, 0.16, ""), ("none", 0.6, hatch)):
        box = Rectangle(
            (-1.03, y - 0.28), 0.16, 0.56, facecolor=fill, edgecolor=colour, alpha=alpha
        )
        box.set(hatch=pattern, linewidth=0.0)
        drawn.append(ax.add_patch(box))
    name = f"{each.priority}  {each.edge.name} → {each.edge.target}"
    verdict = _verdict(each)
    size = 9.0 if len(name) + len(verdict) < LONGEST else 9.0 * LONGEST / (len(name) + len(verdict))
    look: Any = {"va": "center", "fontsize": font(size)}
    drawn.append(ax.text(-0.82, y, name, color=INK, **look))
    drawn.append(ax.text(1.03, y, verdict, ha="right", color=colour, **look))
    back = held_back_by(each)
    for place, clause in enumerate(each.clauses, start=1):
        drawn += _clause(ax, clause, colour, y + place, bold=clause is back)
    return drawn


def _verdict(each: Explanation) -> str:
    """Return what becomes of an edge; empty if its guard is false."""
    if each.fired:
        return "fired"
    if not each.holds:
        return ""
    return "fires" if each.taken == each.edge.name else f"preceded by {each.taken}"


def _clause(ax: Axes, clause: Clause, colour: str, y: float, *, bold: bool) -> Artists:
    """Draw one clause: its text and numbers above its bar."""
    weight = "bold" if bold else "normal"
    mark = TRUE if clause.holds else FALSE
    look: Any = {"fontsize": font(8), "va": "center", "fontweight": weight}
    drawn: Artists = [
        ax.text(-1.03, y - 0.22, f"{mark}  {clause.text}", color=INK, **look),
        ax.text(
            1.03, y - 0.22, _amount(clause), ha="right", color=INK if bold else TEXT_GREY, **look
        ),
    ]
    margin = relative_margin(clause)
    if math.isnan(margin):
        return drawn
    # A bar of length 0 is still visible.
    length = margin if abs(margin) > SHORTEST else (SHORTEST if clause.holds else -SHORTEST)
    bar = Rectangle(
        (0.0, y + 0.0),
        length,
        0.3,
        facecolor=colour if clause.holds else PAPER,
        edgecolor=colour,
        linewidth=pt(1.8 if bold else 1.0),
        zorder=2,
    )
    drawn.append(ax.add_patch(bar))
    return drawn


def _amount(clause: Clause) -> str:
    """Return the margin as text."""
    if not clause.computable:
        return "cannot be computed"
    if math.isnan(clause.margin):
        return ""
    if relative_margin(clause) == 0.0:
        return "0 (rounding)"
    sign = "+" if clause.margin > 0.0 else ""
    return sign + trimmed(clause.scale.text(clause.margin, 3)).replace("-", "−")
