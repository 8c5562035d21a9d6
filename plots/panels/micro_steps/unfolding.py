"""Panels of micro-steps: every instant with transitions takes one column per micro-step.

So a cascade of milliseconds, or of no time at all, can be read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import steps_of
from plots.panels.parts.axes import Artists, beside
from plots.panels.parts.selection import checked_elements, checked_window, is_number, scaled
from plots.style import INK, LINE_GREY, PAPER, TEXT_GREY, VERMILION, state_look
from plots.style.matplotlib import Axes, Rectangle
from plots.style.presets import font, inches, pt, to_scale
from plots.views.traces import check_trace
from plots.views.window import Window

__all__ = ["Unfolded", "unfolded", "unfolded_force", "unfolded_states"]

MOST_COLUMNS = 24  # more cannot be read side by side
GAP = 0.55  # width of the gap between instants, in columns
TURNS = 10  # of a zigzag, per inch
OVER = 0.4  # inches: by how much a name may be wider than its column
FEW = 8  # elements; of more, only new states are named
LETTER = 0.075  # inches: width of a letter of 8 points
LINE = 0.15  # inches: height of a line of 8 points
BOLD = 1.1  # width of a bold letter of 8.5 points, of that of 8 points


@dataclass(frozen=True)
class MicroStep:
    """One micro-step.

    Parameters
    ----------
    instant : int
        Which of the instants.
    step : int
        The micro-step, as in the trace; 0 before the first firing.
    left : float
        Where the column begins; it is 1 wide.
    F : float
        N.
    modes : tuple of int
        Index of the active state of every element shown.
    element : int
        The element that fired; -1 where none of those shown did.
    edge : str
        The edge it took, else empty.
    """

    instant: int
    step: int
    left: float
    F: float
    modes: tuple[int, ...]
    element: int = -1
    edge: str = ""


@dataclass(frozen=True, eq=False)
class Unfolded:
    """The micro-steps of a run in a time interval; see `unfolded`.

    Parameters
    ----------
    trace : Trace
        The run.
    elements : tuple of int
        Elements shown, counted from 0.
    times : ndarray, shape (instants,), s
        Instants with transitions of these elements.
    columns : tuple of MicroStep
        In order: for each instant the state before, then after each firing.
    log : recarray
        The transitions, in order.
    """

    trace: Trace
    elements: tuple[int, ...]
    times: NDArray[np.float64]
    columns: tuple[MicroStep, ...]
    log: Any

    @property
    def width(self) -> float:
        """Width of all columns and gaps."""
        return self.columns[-1].left + 1.0

    def of(self, instant: int) -> tuple[MicroStep, ...]:
        """Return the columns of an instant."""
        return tuple(each for each in self.columns if each.instant == instant)

    @property
    def gaps(self) -> list[float]:
        """The middles of the gaps between instants."""
        return [self.of(k)[0].left - GAP / 2 for k in range(1, self.times.size)]


def unfolded(
    trace: Trace, t0: float, t1: float, *, elements: Sequence[int] | None = None
) -> Unfolded:
    """Return the micro-steps of a run in a time interval.

    Parameters
    ----------
    trace : Trace
        The run; of a system with several contacts, ``trace.contact(name)``.
    t0, t1 : float
        The interval, s; both ends belong to it.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.

    Returns
    -------
    Unfolded
        F and states before and after each firing, as in the transition log. Firings of others
        between two of these are one column without an edge.

    Raises
    ------
    ParameterError
        If nothing fires in the interval, or there are more than 24 columns; the message says which
        interval to choose.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
    >>> part = unfolded(run, 1.0, 3.0)
    >>> [(each.step, round(each.F, 9), each.edge) for each in part.columns][:2]
    [(0, 1.5, ''), (1, 1.44, 'break_away_forward')]
    """
    check_trace(trace)
    chosen = checked_elements(trace, elements)
    first, last = float(trace.t[0]), float(trace.t[-1])
    one = is_number(t0) and t0 == t1 and first <= t0 <= last
    begin, end = (float(t0), float(t1)) if one else checked_window(trace, (t0, t1))
    log = trace.transitions
    mine = np.isin(log.element, chosen) & (log.t >= begin) & (log.t <= end)
    if not mine.any():
        raise ParameterError(_nothing(begin, end), advice=_nearest(log, begin, end))
    steps, where = steps_of(trace), np.flatnonzero(mine)
    modes = {i: _mode_before(trace, i, int(where[0])) for i in chosen}
    times = np.unique(log.t[mine])
    columns: list[MicroStep] = []
    left = 0.0
    for instant, t in enumerate(times.tolist()):
        previous = 0
        for k in where[log.t[where] == t].tolist():
            record, step = log[k], int(steps[k])
            if previous == 0 or step > previous + 1:  # before the instant; after others
                columns.append(
                    MicroStep(
                        instant, step - 1, left, float(record.F_before), tuple(modes.values())
                    )
                )
                left += 1.0
            i = int(record.element)
            modes[i] = trace.model.chart.state_index(str(record.target))
            F, edge = float(record.F_after), str(record.edge)
            columns.append(MicroStep(instant, step, left, F, tuple(modes.values()), i, edge))
            previous, left = step, left + 1.0
        left += GAP
    found = Unfolded(trace, tuple(chosen), times, tuple(columns), log[mine])
    if len(columns) > MOST_COLUMNS:
        raise _too_many(found, (begin, end))
    return found


def _mode_before(trace: Trace, i: int, position: int) -> int:
    """Return the state of an element before an entry of the log."""
    log, chart = trace.transitions, trace.model.chart
    own = np.flatnonzero(log.element == i)
    if not own.size:
        return int(trace.modes[0, i])
    before = own[own < position]
    name = log.target[before[-1]] if before.size else log.source[own[0]]
    return chart.state_index(str(name))


def _nothing(begin: float, end: float) -> str:
    return f"there is no transition from {begin:.9g} to {end:.9g} s"


def _nearest(log: Any, begin: float, end: float) -> str:
    """Return which window to choose instead of one without transitions."""
    if not log.size:
        return "the run has no transitions; draw it with plots.overview"
    away = np.maximum(begin - log.t, log.t - end)
    return f"the nearest one is at t = {float(log.t[away.argmin()]):.12g} s"


def _too_many(found: Unfolded, window: Window) -> ParameterError:
    """Return the error for too many columns, with a window that is short enough."""
    count, t = len(found.columns), found.times
    within = f"from {window[0]:.9g} to {window[1]:.9g} s"
    reason = f"there are {count} columns {within}; at most {MOST_COLUMNS} can be read"
    sizes = np.cumsum([len(found.of(k)) for k in range(t.size)])
    fits = int((sizes <= MOST_COLUMNS).sum())
    if fits == 0:
        return ParameterError(
            reason, advice=f"choose fewer elements: {sizes[0]} columns are at t = {t[0]:.9g} s"
        )
    end = (t[fits - 1] + t[fits]) / 2
    return ParameterError(reason, advice=f"choose the window ({window[0]:.9g}, {end:.12g})")


# --------------------------------------------------------------------------- panels
def unfolded_force(ax: Axes, part: Unfolded) -> Artists:
    """Draw F at every micro-step as stairs, with the values written.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    part : Unfolded
        From `unfolded`.

    Returns
    -------
    list of Artist
        One line per instant, in the unit of the axis; then the change between instants, the
        values, and the marks of the gaps.
    """
    F = np.array([each.F for each in part.columns])
    factor, unit = scaled(F, part.trace.model.chart.force)
    drawn: Artists = []
    for instant in range(part.times.size):
        own = part.of(instant)
        x = np.repeat([own[0].left, *(each.left + 1.0 for each in own)], 2)[1:-1]
        y = np.repeat([factor * each.F for each in own], 2)
        drawn += ax.plot(x, y, color=INK, linewidth=pt(1.8), solid_joinstyle="miter", zorder=3)
    for instant in range(1, part.times.size):
        before, after = part.of(instant - 1)[-1], part.of(instant)[0]
        drawn += ax.plot(
            [before.left + 1.0, after.left],
            [factor * before.F, factor * after.F],
            color=LINE_GREY,
            linestyle=":",
        )
    texts = _written(factor * F)
    wide = column_width(ax.get_window_extent().width / ax.figure.dpi, part)
    upright = wide < LETTER * max(map(len, texts)) + 0.06
    for each, text in zip(part.columns, texts, strict=True):
        at = each.left + 0.5, factor * each.F
        drawn.append(beside(ax, text, at, (0, pt(4)), rotation=90 if upright else 0))
    ax.set(ylabel=f"$F$ [{unit}]", xlim=(-0.1, part.width + 0.1))
    ax.set_xticks([])
    low, high = float(np.nanmin(factor * F)), float(np.nanmax(factor * F))
    tall = (high - low) or abs(high) or 1.0
    ax.set_ylim(low - 0.12 * tall, high + (0.55 if upright else 0.25) * tall)
    ax.spines.bottom.set_visible(False)
    return [*drawn, *_breaks(ax, part)]


def _written(values: NDArray[np.float64]) -> list[str]:
    """Return numbers with as many digits, 3 to 6, as it takes to tell successive ones apart."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    whole = int(np.floor(np.log10(largest))) if largest > 0 else 0
    differ = np.abs(np.diff(values)) > 1e-6 * largest
    texts: list[str] = []
    for digits in range(3, 7):
        texts = [f"{value:.{max(0, digits - 1 - whole)}f}" for value in values]
        same = [a == b for a, b in zip(texts[1:], texts[:-1], strict=True)]
        if not (differ & same).any():
            break
    return [text.replace("-", "−") for text in texts]


def unfolded_states(ax: Axes, part: Unfolded) -> Artists:
    """Draw the states of all elements at every micro-step, and which element fired by which edge.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    part : Unfolded
        From `unfolded`.

    Returns
    -------
    list of Artist
        The cells, column by column; then the frames of those that fired, the names of states and
        edges, the times, and the marks of the gaps.
    """
    chart, count = part.trace.model.chart, len(part.elements)
    wide = column_width(ax.get_window_extent().width / ax.figure.dpi, part)
    tall = ax.get_window_extent().height / inches(ax.figure.dpi) / count
    cells: Artists = []
    drawn: Artists = []
    firsts = [part.of(instant)[0] for instant in range(part.times.size)]
    for each in part.columns:
        for row, mode in enumerate(each.modes):
            name = chart.states[mode].name
            cells.append(ax.add_patch(_cell(each.left, row, mode)))
            told = count <= FEW or each in firsts or part.elements[row] == each.element
            if told and LETTER * len(name) + 0.05 < wide and tall > 0.16:
                plain = {"facecolor": PAPER, "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
                place = (each.left + 0.5, row + 1.0)
                drawn.append(
                    ax.text(*place, name, ha="center", va="center", fontsize=font(7.5), bbox=plain)
                )
    for each in part.columns:
        if each.element >= 0:
            row = part.elements.index(each.element)
            frame = Rectangle((each.left + 0.03, row + 0.55), 0.94, 0.9, **fired_look())
            frame.set(zorder=5)
            drawn.append(ax.add_patch(frame))
    drawn += _edge_names(ax, part, wide)
    ax.set(
        xlim=(-0.1, part.width + 0.1),
        ylim=(count + 0.55, 0.45),
        yticks=range(1, count + 1),
        yticklabels=[f"E{i + 1}" for i in part.elements],
    )
    ax.set_xticks([each.left + 0.5 for each in part.columns], [str(c.step) for c in part.columns])
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    texts, upright, high = time_texts(part, wide)
    lower = 72 * high - 13 if upright else 0  # points: the times need more than a line
    # The first time is often too long to stand between the others.
    first = f"t = {part.times[0]:.9g} s"
    long = BOLD * LETTER * (len(first) + len((*texts, "")[0]) / 2 + 2)
    below = bool(texts) and (upright or long > wide * float(part.gaps[0]))
    ax.set_xlabel(
        "micro-step (0: before the first firing); time",
        labelpad=inches(33 + lower if below else 20),
    )
    low = -31 - lower if below else -18
    return [*cells, *drawn, *_times(ax, part, (first, low), texts, upright), *_breaks(ax, part)]


def _cell(left: float, row: int, mode: int) -> Rectangle:
    return Rectangle((left, row + 0.58), 1.0, 0.84, **to_scale(state_look(mode)))


def column_width(wide: float, part: Unfolded) -> float:
    """Return the width of a column in axes of a width, in inches of the screen."""
    return wide / inches(part.width + 0.2)


def fired_look() -> dict[str, Any]:
    """Return the look of the frame around the element that has just fired."""
    return {"fill": False, "edgecolor": VERMILION, "linewidth": pt(2.4)}


def edge_texts(part: Unfolded, wide: float) -> tuple[dict[str, str], bool, float]:
    """Return how the edges are written above columns of a width."""
    edges = {each.edge for each in part.columns if each.edge}
    broken = {edge: edge.replace("_", "_\n").rstrip("\n") for edge in edges}
    # Beside a column without a name there is more room.
    named = [each.left for each in part.columns if each.edge]
    apart = wide * float(np.diff(named).min(initial=1.0 + OVER / wide))
    if LETTER * max(map(len, edges)) + 0.06 < apart:
        return {edge: edge for edge in edges}, False, LINE
    if LETTER * max(len(line) for each in broken.values() for line in each.split("\n")) < wide:
        return broken, False, LINE * max(each.count("\n") + 1 for each in broken.values())
    return {edge: edge for edge in edges}, True, LETTER * max(map(len, edges))


def _edge_names(ax: Axes, part: Unfolded, wide: float) -> Artists:
    """Write the edges above their columns."""
    texts, upright, _ = edge_texts(part, wide)
    firsts = [part.of(instant)[0] for instant in range(part.times.size)]
    look: dict[str, Any] = {"xycoords": ax.get_xaxis_transform(), "annotation_clip": False}
    look |= {"rotation": 90 if upright else 0, "linespacing": 1.15}
    names = [
        (each, texts.get(each.edge, "others"), INK if each.edge else TEXT_GREY)
        for each in part.columns
        if each.edge or each not in firsts
    ]
    return [
        beside(ax, name, (each.left + 0.5, 1.0), (0, pt(3)), color=ink, **look)
        for each, name, ink in names
    ]


def time_texts(part: Unfolded, wide: float) -> tuple[list[str], bool, float]:
    """Return how the times between instants are written below columns of a width."""
    texts = []
    for step in np.diff(part.times).tolist():
        factor, unit = scaled(np.array([step]), "s") if step >= 1e-10 else (1.0, "s")
        texts.append(f"+{factor * step:.4g} {unit}")
    longest = BOLD * LETTER * max(map(len, texts), default=0)
    upright = len(texts) > 1 and longest + 0.06 > wide * float(np.diff(part.gaps).min())
    return texts, upright, longest if upright else LINE


def _times(
    ax: Axes, part: Unfolded, first: tuple[str, float], texts: Sequence[str], upright: bool
) -> Artists:
    """Write the time of the first instant, and the time between instants."""
    look: dict[str, Any] = {"xycoords": ax.get_xaxis_transform(), "annotation_clip": False}
    look |= {"va": "top", "fontsize": font(8.5), "fontweight": "bold"}
    drawn = [beside(ax, first[0], (0.0, 0.0), (0, inches(first[1])), ha="left", **look)]
    look["rotation"] = 90 if upright else 0
    between = zip(part.gaps, texts, strict=True)
    return drawn + [beside(ax, text, (x, 0.0), (0, inches(-18)), **look) for x, text in between]


def _breaks(ax: Axes, part: Unfolded) -> Artists:
    """Mark each gap by a zigzag, since time is not continuous there."""
    tall = ax.get_window_extent().height / ax.figure.dpi
    heights = np.linspace(0.0, 1.0, max(4, round(TURNS * tall)))
    turns = 0.07 * np.where(np.arange(heights.size) % 2, 1.0, -1.0)
    drawn: Artists = []
    for middle in part.gaps:
        drawn += ax.plot(
            middle + turns,
            heights,
            transform=ax.get_xaxis_transform(),
            color=LINE_GREY,
            linewidth=pt(0.8),
            zorder=1,
        )
    return drawn
