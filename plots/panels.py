"""Single panels: each takes an Axes and a Trace, draws, and returns its artists.

They share three arguments. ``window = (t0, t1)`` [s] zooms: the run is sampled anew inside it.
``elements`` chooses elements, counted from 0 (labels count from 1). ``log`` asks for a logarithmic
axis where one makes sense. Times of switches and the forces on both sides of them come from the
transition log, which is complete even where the rows are not.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.errors import MissingExtraError, ParameterError, SignalError
from gms_fsm.errors import shown as written
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.trace import Trace, check_trace
from plots.style import (
    BLUE,
    ELEMENT_COLOURS,
    ELEMENT_DASHES,
    HATCHES,
    INK,
    LINE_GREY,
    STATE_EDGES,
    STATE_FILLS,
    TEXT_GREY,
    VERMILION,
)

try:
    from matplotlib import colormaps
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.backend_bases import RendererBase
    from matplotlib.collections import LineCollection
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.text import Text
    from matplotlib.ticker import MaxNLocator
except ImportError:
    raise MissingExtraError(
        'figures need matplotlib; install it with: pip install "gms-fsm[plots]"'
    ) from None

__all__ = [
    "cascade",
    "cascade_window",
    "deflections",
    "difference",
    "force",
    "has_threshold",
    "hysteresis",
    "margins",
    "portrait",
    "ratio",
    "residual",
    "ribbons",
    "shown",
    "slip_bar",
    "stribeck",
    "velocity",
]

Artists = list[Artist]
Window = tuple[float, float]

SCALES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))
SMOOTH = 2000  # points a curve
MOST_ROWS = 20_000  # a longer run is thinned
VECTOR_ROWS = 6_000  # longer curves are pixels inside an SVG or PDF, which keeps the file small
CASCADE = 0.02  # s: break-aways this near to each other make one cascade
RESOLVED = 1e-4  # s: at least this far apart they are drawn one by one


class Forces(Protocol):
    """Friction over time: a trace or a measurement."""

    @property
    def t(self) -> NDArray[np.float64]:
        """Times, s."""

    @property
    def F(self) -> NDArray[np.float64]:
        """Friction, N."""


# --------------------------------------------------------------------------- what is drawn
def has_threshold(trace: Trace) -> bool:
    """Tell whether s(v) is a threshold of the chart: it is an input, and there are edges.

    Parameters
    ----------
    trace : Trace
        The run.

    Returns
    -------
    bool
        Without it neither |z|/s = 1 nor a margin to it means anything.
    """
    return "s" in trace.model.chart.inputs and bool(trace.model.chart.transitions)


def shown(trace: Trace, window: Window | None = None) -> Trace:
    """Return the rows worth drawing.

    Rows that lie far apart get samples between them, so that curves are smooth. Of a very long run
    the lowest and highest values of every short stretch are kept, and all rows at which a state
    changes: what is left out could not be seen.

    Parameters
    ----------
    trace : Trace
        The run.
    window : (float, float), optional
        From when to when, s; the whole run when left out.

    Returns
    -------
    Trace
        With these rows, and the whole transition log.

    Raises
    ------
    ParameterError
        If the window is not a part of the run.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
    >>> part = shown(run, (1.0, 2.5))
    >>> float(part.t[0]), float(part.t[-1]), len(part) > 1000
    (1.0, 2.5, True)
    """
    begin, end = checked_window(trace, window)
    times = trace.t if trace.rows is trace.stops else np.union1d(trace.t, trace.stops.t)
    grid = np.linspace(begin, end, SMOOTH)
    sampled = False
    if times.size > 1:
        right = np.searchsorted(times, grid).clip(1, times.size - 1)
        # Only where rows are far apart, and at the ends of the window.
        far = times[right] - times[right - 1] > 1.5 * (grid[1] - grid[0])
        far[[0, -1]] = True
        wanted = np.setdiff1d(grid[far], times)
        if wanted.size:
            try:
                rows = trace.sample(wanted).stops  # all rows, both sides of every stop, the samples
                trace = replace(trace, rows=rows, stops=rows, stored={})
                sampled = True
            except SignalError:  # read from a file, driven by a Python function: the rows must do
                pass
    low = int(np.searchsorted(trace.t, begin))
    high = int(np.searchsorted(trace.t, end, side="right"))
    if not sampled:  # one more row on either side lets curves reach the ends of the window
        low, high = max(low - 1, 0), high + 1
    keep = np.arange(len(trace))[low:high]
    if keep.size < len(trace):
        trace = _picked(trace, keep, known=not sampled)
    return trace if len(trace) <= MOST_ROWS else _picked(trace, _telling_rows(trace), known=True)


def _picked(trace: Trace, keep: NDArray[np.intp], *, known: bool) -> Trace:
    """Return the trace with some of its rows; forces that are known are handed on."""
    rows = Rows(*(column[keep] for column in vars(trace.rows).values()))
    names = ("v", "F", "s", "F_elements", "dz") if known else ()
    stored = {name: getattr(trace, name)[keep] for name in names}
    return replace(trace, rows=rows, stops=rows, stored=stored)


def _telling_rows(trace: Trace) -> NDArray[np.intp]:
    size = -(-len(trace) // (MOST_ROWS // 5))
    count = -(-len(trace) // size)
    start = size * np.arange(count)
    keep = [start, np.array([len(trace) - 1])]
    pad = count * size - len(trace)
    ratio = (trace.z / trace.s).T if "s" in trace.model.chart.inputs else ()
    for column in (trace.x, trace.v, trace.F, *trace.z.T, *ratio):
        values = np.nan_to_num(np.pad(column, (0, pad), mode="edge")).reshape(count, size)
        keep += [start + values.argmin(axis=1), start + values.argmax(axis=1)]
    switched = np.flatnonzero((np.diff(trace.rows.mode, axis=0) != 0).any(axis=1))
    micro = np.flatnonzero(trace.microstep > 0)
    keep += [switched, switched + 1, micro, np.maximum(micro - 1, 0)]
    return np.unique(np.minimum(np.concatenate(keep), len(trace) - 1))


def checked_window(trace: Trace, window: Window | None) -> Window:
    """Return the window, or the whole run for None.

    Raises
    ------
    ParameterError
        If it is not two times, the earlier one first, that overlap the run; if there is no run.
    """
    check_trace(trace)
    first, last = float(trace.t[0]), float(trace.t[-1])
    if window is None:
        return first, last
    try:
        begin, end = (float(t) for t in window)
    except (TypeError, ValueError):
        begin, end = last, first
    if not (first <= begin < end <= last):
        raise ParameterError(
            f"window is {written(window)}; it must be two times (t0, t1) with t0 < t1 inside the "
            f"run, {first:g} to {last:g} s"
        )
    return begin, end


def checked_elements(trace: Trace, elements: Iterable[int] | None) -> list[int]:
    """Return the chosen elements, or all for None.

    Raises
    ------
    ParameterError
        If one is not there, is named twice, or none is named.
    """
    if elements is None:
        return list(range(trace.n))
    try:
        chosen = list(elements)
    except TypeError:
        chosen = []
    whole = all(isinstance(i, (int, np.integer)) and not isinstance(i, bool) for i in chosen)
    if (
        not chosen
        or not whole
        or len(set(chosen)) < len(chosen)
        or not (0 <= min(chosen) <= max(chosen) < trace.n)
    ):
        raise ParameterError(
            f"elements is {written(elements)}; it must be a list of different whole numbers from 0 "
            f"to {trace.n - 1} (labels count from 1)"
        )
    return [int(i) for i in chosen]


def scaled(values: NDArray[np.float64], unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which values read well.

    Parameters
    ----------
    values : ndarray
        In the unit.
    unit : str
        For example ``"m/s"``.

    Returns
    -------
    (float, str)
        Factor and prefixed unit.

    Examples
    --------
    >>> scaled(np.array([0.0, 2e-4]), "m/s")
    (1000.0, 'mm/s')
    """
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    for factor, prefix in SCALES:
        if largest * factor >= 0.1 or largest == 0.0:
            return factor, prefix + unit
    return SCALES[-1][0], SCALES[-1][1] + unit


def _first_variable(trace: Trace, values: NDArray[np.float64]) -> tuple[float, str]:
    """Return factor and title of the chart's first variable: z is a deflection, m.

    One's own by another name may be anything, a force say: no unit then.
    """
    name = trace.model.chart.variables[0]
    if name != "z":
        return 1.0, name
    factor, unit = scaled(values, "m")
    return factor, f"z [{unit}]"


def _look(i: int) -> dict[str, Any]:
    """Return colour and dash of element i."""
    return {
        "color": ELEMENT_COLOURS[i % len(ELEMENT_COLOURS)],
        "linestyle": ELEMENT_DASHES[i % len(ELEMENT_DASHES)],
    }


def _curve(ax: Axes, x: NDArray[np.float64], y: NDArray[np.float64], **look: Any) -> Artists:
    return list(ax.plot(x, y, rasterized=x.size > VECTOR_ROWS, **look))


def _time_axis(ax: Axes, begin: float, end: float) -> None:
    """Label the time axis; in a very narrow window ticks count from a moment inside it."""
    ax.set_xlabel("t [s]")
    width = end - begin
    if not width > 0:
        return
    ax.set_xlim(begin, end)
    if width > 1e-4 * max(abs(begin), abs(end)):
        ax.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
        return
    origin = round((begin + end) / 2, int(np.ceil(-np.log10(width))) + 1)
    factor, unit = scaled(np.array([width]), "s")
    low, high = factor * (begin - origin), factor * (end - origin)
    ticks = np.asarray(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    ticks = ticks[(ticks >= low) & (ticks <= high)]
    ax.set_xticks(origin + ticks / factor, [f"{tick:g}" for tick in ticks])
    ax.set_xlabel(f"t − {origin:.12g} s [{unit}]")


def _log_axis(ax: Axes, values: NDArray[np.float64], axis: str) -> None:
    """Make an axis logarithmic, over six decades at most: v passes through zero at reversals."""
    positive = values[np.isfinite(values) & (values > 0)]
    top = float(positive.max()) if positive.size else 1.0
    low = max(float(positive.min()) if positive.size else 0.1, 1e-6 * top)
    limits = (0.8 * low, 1.25 * top)
    ax.set(**{f"{axis}scale": "log", f"{axis}lim": limits})


# --------------------------------------------------------------------------- over time
def velocity(ax: Axes, trace: Trace, *, window: Window | None = None, log: bool = False) -> Artists:
    """Draw v(t).

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    window : (float, float), optional
        From when to when, s.
    log : bool
        Draw |v| on a logarithmic axis.

    Returns
    -------
    list of Artist
        The line.
    """
    part = shown(trace, window)
    factor, unit = scaled(part.v, "m/s")
    v = factor * (np.abs(part.v) if log else part.v)
    ax.set_ylabel(f"{'|v|' if log else 'v'} [{unit}]")
    lines = _curve(ax, part.t, v, color=INK)
    if log:
        _log_axis(ax, v, "y")
    _time_axis(ax, *checked_window(trace, window))
    return lines


def force(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Artists:
    """Draw the friction force F(t); at a transition both one-sided values are drawn.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        Elements whose own forces F_i are drawn too; none when left out.

    Returns
    -------
    list of Artist
        The line of F, then one an element.
    """
    chosen = [] if elements is None else checked_elements(trace, elements)
    part = shown(trace, window)
    lines = _curve(ax, part.t, part.F, color=INK, label="F")
    for i in chosen:
        lines += _curve(ax, part.t, part.F_elements[:, i], label=f"$F_{{{i + 1}}}$", **_look(i))
    ax.set_ylabel("F [N]")
    _time_axis(ax, *checked_window(trace, window))
    return lines


def deflections(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Artists:
    """Draw z_i(t) of every element, or whatever the chart's first variable is.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        All when left out.

    Returns
    -------
    list of Artist
        One line an element.
    """
    chosen = checked_elements(trace, elements)
    part = shown(trace, window)
    factor, title = _first_variable(trace, part.z[:, chosen])
    name = trace.model.chart.variables[0]
    lines: Artists = []
    for i in chosen:
        label = f"$z_{{{i + 1}}}$" if name == "z" else f"{name}{i + 1}"
        lines += _curve(ax, part.t, factor * part.z[:, i], label=label, **_look(i))
    ax.set_ylabel(title)
    _time_axis(ax, *checked_window(trace, window))
    return lines


def ratio(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Artists:
    """Draw how near each element is to its threshold: z_i / s_i(v), with lines at +1 and -1.

    A chart without edges has no threshold: its z / s(v) is drawn with its unit, without the lines.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        All when left out.

    Returns
    -------
    list of Artist
        One line an element, then the lines at +1 and -1.
    """
    chosen = checked_elements(trace, elements)
    part = shown(trace, window)
    values, threshold = part.z, has_threshold(trace)
    if "s" in trace.model.chart.inputs:
        values = part.z / part.s
        factor, unit = (1.0, "–") if threshold else scaled(values, "m/N")
        title = f"{trace.model.chart.variables[0]} / s(v) [{unit}]"
    else:
        factor, title = _first_variable(trace, values)
    lines: Artists = []
    for i in chosen:
        lines += _curve(ax, part.t, factor * values[:, i], label=f"E{i + 1}", **_look(i))
    if threshold:
        lines += [
            ax.axhline(level, color=LINE_GREY, linewidth=0.8, zorder=1) for level in (1.0, -1.0)
        ]
    ax.set_ylabel(title)
    _time_axis(ax, *checked_window(trace, window))
    return lines


class _SpanName(Text):
    """A state's name inside its span, drawn only where it fits.

    Whether it does is known when the picture is drawn, and may change when a window is resized.
    """

    def __init__(self, ax: Axes, begin: float, end: float, height: float, name: str) -> None:
        super().__init__(
            (begin + end) / 2,
            height,
            name,
            ha="center",
            va="center",
            fontsize=7.5,
            color=INK,
            bbox={
                "boxstyle": "round,pad=0.12",
                "facecolor": "white",
                "edgecolor": "none",
                "alpha": 0.85,
            },
        )
        self.span = (begin, end)
        self.set_in_layout(False)
        ax.add_artist(self)
        self.set_clip_on(True)

    def fits(self, renderer: RendererBase) -> bool:
        """Return whether the name is narrower than its span."""
        assert self.axes is not None
        pixels = self.axes.transData.transform([(t, 0.0) for t in self.span])[:, 0]
        return bool(self.get_window_extent(renderer).width + 4 < pixels[1] - pixels[0])

    def draw(self, renderer: RendererBase) -> None:
        """Draw the name if it fits."""
        if self.fits(renderer):
            super().draw(renderer)


def spans(trace: Trace, i: int, window: Window) -> Iterator[tuple[str, float, float]]:
    """Yield the states of element i as (name, begin, end) [s], read from the transition log.

    Parameters
    ----------
    trace : Trace
        The run.
    i : int
        Element, from 0.
    window : (float, float)
        s; spans are cut at its ends.

    Yields
    ------
    (str, float, float)
        States that lasted no time are left out.
    """
    log = trace.transitions[trace.transitions.element == i]
    first = log.source[0] if log.size else trace.model.chart.states[trace.rows.mode[0, i]].name
    ends = np.clip(np.concatenate([[window[0]], log.t, [window[1]]]), *window)
    for name, begin, end in zip([first, *log.target], ends[:-1], ends[1:], strict=True):
        if end > begin:
            yield str(name), float(begin), float(end)


def ribbons(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Artists:
    """Draw the active state of every element as a ribbon, like a logic analyser.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        All when left out.

    Returns
    -------
    list of Artist
        One collection per state and element; then the names, each of which shows where it fits;
        then a band for each stretch on which a sign is held, such as on v = 0.
    """
    chosen = checked_elements(trace, elements)
    begin, end = checked_window(trace, window)
    states = [state.name for state in trace.model.chart.states]
    drawn: Artists = []
    names: Artists = []
    for row, i in enumerate(chosen):
        found = list(spans(trace, i, (begin, end)))
        for number, state in enumerate(states):
            mine = [(a, b - a) for name, a, b in found if name == state]
            drawn.append(
                ax.broken_barh(
                    mine,
                    (row + 0.6, 0.8),
                    facecolor=STATE_FILLS[number % len(STATE_FILLS)],
                    edgecolor=STATE_EDGES[number % len(STATE_EDGES)],
                    hatch=HATCHES[number % len(HATCHES)],
                    linewidth=0.6,
                    label=state if row == 0 else None,
                    rasterized=len(mine) > VECTOR_ROWS // 20,
                )
            )
        # A name never fits into less than a hundredth of the axis.
        wide = [span for span in found if span[2] - span[1] > 0.01 * (end - begin)]
        names += [_SpanName(ax, a, b, row + 1.0, name) for name, a, b in wide]
    ax.set(
        ylim=(len(chosen) + 0.5, 0.5),
        yticks=range(1, len(chosen) + 1),
        yticklabels=[f"E{i + 1}" for i in chosen],
    )
    ax.tick_params(axis="y", length=0)
    _time_axis(ax, begin, end)
    return [*drawn, *names, *_held_bands(ax, trace, (begin, end))]


def _held_bands(ax: Axes, trace: Trace, window: Window) -> Artists:
    """Mark the stretches along a surface; microseconds wide, they show as a line."""
    drawn: dict[str, Artists] = {}
    for stretch in trace.sliding:
        begin, end = max(window[0], float(stretch.t_start)), min(window[1], float(stretch.t_end))
        if begin <= end:
            label = f"held on {stretch.surface} = 0"
            text = "" if label in drawn else label
            drawn.setdefault(label, []).append(
                ax.axvspan(
                    begin,
                    end,
                    facecolor="none",
                    edgecolor="black",
                    hatch="xxx",
                    linewidth=0.8,
                    zorder=3,
                    label=text,
                )
            )
    return [band for bands in drawn.values() for band in bands]


# --------------------------------------------------------------------------- cascades
def cascade_window(
    trace: Trace, around: float | None = None, *, within: float = CASCADE
) -> Window | None:
    """Return the zoom that shows a cascade of break-aways.

    Parameters
    ----------
    trace : Trace
        The run.
    around : float, optional
        The break-away nearest to this time, s. When left out: the first that has another one after
        it within `within`, at a time of its own rather than at the same instant; if there is none,
        the first break-away.
    within : float
        How near to each other break-aways make one cascade, s.

    Returns
    -------
    (float, float) or None
        s; None if no element ever leaves its default state and `around` is left out.

    Raises
    ------
    ParameterError
        If `around` is not in the run or `within` is not positive.
    """
    check_trace(trace)
    first, last = float(trace.t[0]), float(trace.t[-1])
    if not _is_number(within) or not within > 0:
        raise ParameterError(f"within is {written(within)}; it must be a time > 0 s")
    if around is not None and not (_is_number(around) and first <= around <= last):
        raise ParameterError(
            f"around is {written(around)}; it must be a time in the run, {first:g} to {last:g} s"
        )
    log = trace.transitions
    leaving = log.source == trace.model.chart.default_state.name
    times = log.t[leaving & (log.t >= first) & (log.t <= last)]
    if around is not None:
        start = float(times[np.abs(times - around).argmin()]) if times.size else float(around)
        group = times[np.abs(times - start) <= within]
    elif times.size:
        after = np.searchsorted(times, times + within, side="right")
        spread = times[after - 1] - times
        several = after - np.arange(times.size) > 1
        best = int((np.where(spread >= RESOLVED, 2, several)).argmax())
        group = times[best : after[best]]
    else:
        return None
    if not group.size:
        group = np.array([start])
    width = float(group[-1] - group[0])
    pad = 0.6 * width if width >= RESOLVED else within / 2
    return max(first, float(group[0]) - pad), min(last, float(group[-1]) + pad)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool)


def _in_window(trace: Trace, window: Window, chosen: Sequence[int]) -> Any:
    """Return the log's records in a window, of the chosen elements."""
    log = trace.transitions
    return log[(log.t >= window[0]) & (log.t <= window[1]) & np.isin(log.element, chosen)]


def marks(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    labels: bool = True,
) -> Artists:
    """Draw a vertical line at every transition, labelled with its element.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        All when left out.
    labels : bool
        Write ``E1`` and so on above the axes; labels that would meet are joined.

    Returns
    -------
    list of Artist
        One line a transition, then the labels.
    """
    begin, end = checked_window(trace, window)
    log = _in_window(trace, (begin, end), checked_elements(trace, elements))
    drawn: Artists = [
        ax.axvline(t, linewidth=0.9, zorder=1, **_look(int(i)))
        for t, i in zip(log.t.tolist(), log.element.tolist(), strict=True)
    ]
    if not labels or not end > begin:
        return drawn
    wide = 0.9 * ax.bbox.width / ax.figure.dpi * 72  # points; the layout may still move
    letter = 5.5 * (end - begin) / wide  # s
    groups: list[list[Any]] = []  # elements, first and last time
    for t, i in zip(log.t.tolist(), log.element.tolist(), strict=True):
        groups.append([[i], t, t])
        while len(groups) > 1 and _meet(groups[-2], groups[-1], letter):
            after = groups.pop()
            groups[-1] = [groups[-1][0] + after[0], groups[-1][1], after[2]]
    for members, t0, t1 in groups:
        drawn.append(
            ax.annotate(
                _joined(members),
                ((t0 + t1) / 2, 1.0),
                (0, 2),
                xycoords=ax.get_xaxis_transform(),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=8,
                color=INK,
            )
        )
    return drawn


def _joined(members: list[int]) -> str:
    if len(members) > 5:
        return f"{len(members)} switches"
    return " ".join(f"E{i + 1}" for i in members)


def _meet(a: list[Any], b: list[Any], letter: float) -> bool:
    gap = (b[1] + b[2]) / 2 - (a[1] + a[2]) / 2
    return bool(gap < letter * (len(_joined(a[0])) + len(_joined(b[0])) + 1) / 2)


def margins(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Artists:
    """Draw what each element has left until its threshold, 1 - |z| / s; zero is the threshold.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    window : (float, float), optional
        From when to when, s; a cascade (see `cascade_window`) when left out.
    elements : sequence of int, optional
        All when left out.

    Returns
    -------
    list of Artist
        One line an element, the line at zero, a set of dots for each element that switches (there),
        then the marks. For a chart without edges, or without the input s, a note only: it has no
        threshold.
    """
    chosen = checked_elements(trace, elements)
    if not has_threshold(trace):
        ax.set_yticks([])
        missing = "input s" if trace.model.chart.transitions else "edges"
        return [
            ax.text(
                0.5,
                0.5,
                f"no threshold:\nthis chart has no {missing}",
                ha="center",
                va="center",
                transform=ax.transAxes,
                color=TEXT_GREY,
            )
        ]
    limits = checked_window(trace, cascade_window(trace) if window is None else window)
    part = shown(trace, limits)
    values = 1 - np.abs(part.z / part.s)
    largest = float(np.nanmax(np.abs(values[:, chosen])))
    power = max(0, int(np.ceil(-np.log10(largest)))) if largest > 0 else 0
    power = 3 * -(-power // 3) if power > 1 else 0
    factor = 10.0**power
    log = _in_window(trace, limits, chosen)
    lines: Artists = []
    dots: Artists = []
    for i in chosen:
        lines += _curve(ax, part.t, factor * values[:, i], label=f"E{i + 1}", **_look(i))
        mine = log[log.element == i]
        if mine.size:
            dots += ax.plot(
                mine.t,
                factor * (1 - np.abs(mine.z / mine.s)),
                "o",
                color=_look(i)["color"],
                markersize=4,
                clip_on=False,
                zorder=4,
            )
    lines.append(ax.axhline(0.0, color=LINE_GREY, linewidth=0.8, zorder=1))
    ax.set_ylabel(f"10$^{power}$ (1 − |z|/s) [–]" if power else "1 − |z|/s [–]")
    _time_axis(ax, *limits)
    return [*lines, *dots, *marks(ax, trace, window=limits, elements=chosen)]


def cascade(
    ax: Axes,
    trace: Trace,
    *,
    around: float | None = None,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    within: float = CASCADE,
) -> Artists:
    """Draw the steps of F at a break-away, with both one-sided values of every step.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    around, within : float, optional
        Which cascade; see `cascade_window`. A run without break-aways is drawn whole.
    window : (float, float), optional
        From when to when, s, instead.
    elements : sequence of int, optional
        Whose steps are marked; all when left out.

    Returns
    -------
    list of Artist
        The line; the values before (open dots); the values after (full dots); then the marks.
    """
    chosen = checked_elements(trace, elements)
    if window is None:
        window = cascade_window(trace, around, within=within)
    limits = checked_window(trace, window)
    part = shown(trace, limits)
    log = _in_window(trace, limits, chosen)
    lines = _curve(ax, part.t, part.F, color=INK)
    dots = [
        *ax.plot(
            log.t,
            log.F_before,
            "o",
            markersize=4.5,
            color=INK,
            markerfacecolor="white",
            label="F before",
            zorder=3,
        ),
        *ax.plot(log.t, log.F_after, "o", markersize=4.5, color=INK, label="F after", zorder=4),
    ]
    ax.set_ylabel("F [N]")
    _time_axis(ax, *limits)
    return [*lines, *dots, *marks(ax, trace, window=limits, elements=chosen)]


# --------------------------------------------------------------------------- portraits
def _by_slipping(
    ax: Axes, x: NDArray[np.float64], trace: Trace, chosen: Sequence[int]
) -> LineCollection:
    """Draw F against x in pieces, coloured by how many elements have left their default state."""
    default = trace.model.chart.state_index(trace.model.chart.default_state.name)
    away = (trace.rows.mode[:, chosen] != default).sum(axis=1)
    points = np.column_stack([x, trace.F])
    # A piece holds its colour from row to row; the next one begins where it ends.
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(away)) + 1, [len(points)]])
    pieces = [points[a : b + 1] for a, b in pairwise(cuts)]
    count = len(chosen)
    # From light green to dark violet: the more elements slip, the darker, in grey too.
    shades = ListedColormap(colormaps["viridis_r"](np.linspace(0.18, 1.0, count + 1)))
    lines = LineCollection(
        pieces,
        cmap=shades,
        norm=BoundaryNorm(np.arange(-0.5, count + 1.0), count + 1),
        array=away[cuts[:-1]],
        linewidths=1.6,
        capstyle="round",
        rasterized=len(points) > VECTOR_ROWS,
    )
    if not trace.model.chart.transitions:  # one state: nothing to count
        lines.set_array(None)
        lines.set_color(BLUE)
    ax.add_collection(lines)
    ax.autoscale_view()
    return lines


def slip_bar(lines: LineCollection, trace: Trace, axes: Axes | Sequence[Axes]) -> None:
    """Add the colour bar of a portrait; a chart without edges needs none.

    Parameters
    ----------
    lines : LineCollection
        From `portrait` or `hysteresis`.
    trace : Trace
        The run.
    axes : Axes or sequence of Axes
        Beside which.
    """
    chart = trace.model.chart
    if not chart.transitions:
        return
    first = axes if isinstance(axes, Axes) else axes[0]
    norm = lines.norm
    assert isinstance(norm, BoundaryNorm)
    most = norm.N - 2
    ticks = range(0, most + 1, 1 + most // 10)
    bar = first.figure.colorbar(lines, ax=axes, ticks=ticks, aspect=30, fraction=0.05)
    default = chart.default_state.name
    others = [state.name for state in chart.states if state.name != default]
    place = f"in {others[0]}" if len(others) == 1 else f"not in {default}"
    bar.set_label(f"elements {place}")
    bar.ax.tick_params(length=0)
    bar.ax.minorticks_off()


def portrait(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    log: bool = False,
    bar: bool = True,
) -> Artists:
    """Draw F against v, darker where more elements have left their default state.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        Which elements are counted; all when left out.
    log : bool
        Draw over |v| on a logarithmic axis.
    bar : bool
        Add a colour bar.

    Returns
    -------
    list of Artist
        The collection of lines.
    """
    chosen = checked_elements(trace, elements)
    part = shown(trace, window)
    factor, unit = scaled(part.v, "m/s")
    v = factor * part.v
    if log:
        v = np.abs(v)
        v[v == 0] = np.nan
        _log_axis(ax, v, "x")
    lines = _by_slipping(ax, v, part, chosen)
    ax.set(xlabel=f"{'|v|' if log else 'v'} [{unit}]", ylabel="F [N]")
    if bar:
        slip_bar(lines, trace, ax)
    return [lines]


def hysteresis(
    ax: Axes,
    trace: Trace,
    phases: Sequence[tuple[str, float]] = (),
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    slipping: bool = False,
) -> Artists:
    """Draw F against x, in one colour, in phases, or by the number of elements slipping.

    Parameters
    ----------
    ax : Axes
        Where; x is shown from where the run starts.
    trace : Trace
        What.
    phases : sequence of (str, float), optional
        Names and end times [s] of parts drawn in colours of their own; one part when left out.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        Which elements are counted with `slipping`; all when left out.
    slipping : bool
        Colour as in `portrait`, instead of phases.

    Returns
    -------
    list of Artist
        One line a phase, or the collection of lines.
    """
    chosen = checked_elements(trace, elements)
    part = shown(trace, window)
    x = part.x - trace.x[0]
    factor, unit = scaled(x, "m")
    ax.set(xlabel=f"x [{unit}]", ylabel="F [N]")
    if slipping:
        return [_by_slipping(ax, factor * x, part, chosen)]
    looks = ((BLUE, "-"), (VERMILION, "-"), (LINE_GREY, "-"))
    begin = -np.inf
    lines: Artists = []
    for number, (name, end) in enumerate(phases or [("", np.inf)]):
        now = (part.t >= begin) & (part.t <= end)
        colour, dash = looks[number % len(looks)]
        lines += _curve(
            ax,
            factor * x[now],
            part.F[now],
            color=colour,
            linestyle=dash,
            label=name,
            zorder=3 - number % 3,
            linewidth=1.6 if number < 2 else 0.9,
        )
        begin = end
    return lines


def stribeck(
    ax: Axes,
    trace: Trace,
    measured: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    window: Window | None = None,
    log: bool = True,
) -> Artists:
    """Draw the Stribeck curve, the run's steady sliding, and measured points.

    Steady sliding are the rows at which no deflection changes by more than a hundredth of v; there
    the friction of elements whose shares add up to one is ``s(v) + sigma_2 |v|``.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        Its model's curve, its rows.
    measured : (array_like, array_like), optional
        Velocities [m/s] and friction [N], each of shape (m,).
    window : (float, float), optional
        From when to when the run counts, s.
    log : bool
        Logarithmic axis of |v|.

    Returns
    -------
    list of Artist
        s(v); s(v) + sigma_2 |v| if there is viscous friction; the steady rows; the measured points.
    """
    model, part = trace.model, shown(trace, window)
    if model.stribeck is None:
        raise ParameterError(
            f"{model.title}: its chart has no input s, and so no Stribeck curve to draw"
        )
    points = None if measured is None else checked_points(measured)
    speeds = np.abs(part.v)
    steady = (np.abs(part.dz) < 0.01 * speeds[:, None]).all(axis=1)
    top = max(
        [float(np.nanmax(speeds)), 4 * model.stribeck.v_s, *(() if points is None else points[0])]
    )
    every = np.concatenate([speeds[speeds > 0], [0.1 * model.stribeck.v_s]])
    low = max(1e-6 * top, float(np.nanmin(every)))
    v = np.geomspace(low, top, 400) if log else np.linspace(0.0, top, 2000)
    factor, unit = scaled(v, "m/s")
    curve = model.stribeck(v)
    drawn = _curve(ax, factor * v, curve, color=INK, linestyle="--", label="s(v)")
    if model.sigma_2 > 0:
        drawn += _curve(
            ax, factor * v, curve + model.sigma_2 * v, color=INK, label=r"s(v) + $\sigma_2$ |v|"
        )
    drawn += ax.plot(
        factor * speeds[steady],
        np.abs(part.F[steady]),
        "s",
        markersize=5,
        color=STATE_FILLS[0],
        markeredgewidth=0,
        label="run, sliding steadily",
        rasterized=True,
        zorder=1,
    )
    if points is not None:
        drawn += ax.plot(
            factor * points[0],
            points[1],
            "o",
            markersize=4.5,
            color=VERMILION,
            markerfacecolor="white",
            label="measured",
            zorder=4,
        )
    ax.set(xlabel=f"|v| [{unit}]", ylabel="|F| [N]")
    if log:
        ax.set(xscale="log", xlim=(factor * low, 1.15 * factor * top))
    return drawn


def checked_points(measured: tuple[ArrayLike, ArrayLike]) -> tuple[Any, Any]:
    """Return the sizes of measured velocities and forces.

    Raises
    ------
    ParameterError
        If they are not two flat lists of finite numbers, equally long.
    """
    try:
        v, F = (np.abs(np.asarray(values, dtype=np.float64)) for values in measured)
        good = v.ndim == 1 and v.size > 0 and v.shape == F.shape
        good = good and bool(np.isfinite(v).all() and np.isfinite(F).all())
    except (TypeError, ValueError):
        good = False
    if not good:
        raise ParameterError(
            f"measured is {written(measured)}; it must be two equally long flat lists of finite "
            "numbers: velocities [m/s] and friction [N]"
        )
    return v, F


# --------------------------------------------------------------------------- differences
def difference(
    ax: Axes,
    times: NDArray[np.float64],
    values: NDArray[np.float64],
    floor: float = 1e-12,
    *,
    log: bool = True,
) -> Artists:
    """Draw a difference of forces over time.

    Parameters
    ----------
    ax : Axes
        Where.
    times : ndarray, shape (m,), s
        When.
    values : ndarray, shape (m,), N
        What.
    floor : float
        N; on a logarithmic axis smaller values are drawn here.
    log : bool
        Draw its size on a logarithmic axis.

    Returns
    -------
    list of Artist
        The line.
    """
    if not _is_number(floor) or not 0 < floor < np.inf:
        raise ParameterError(f"floor is {written(floor)}; it must be a force > 0 N")
    if np.shape(times) != np.shape(values) or np.ndim(times) != 1 or not np.size(times):
        raise ParameterError(
            f"times has shape {np.shape(times)}, the difference {np.shape(values)}; they must be "
            "equally long flat lists, not empty"
        )
    if log:
        ax.set(yscale="log")
        values = np.maximum(np.abs(values), floor)
    ax.set_ylabel("|difference of F| [N]" if log else "difference of F [N]")
    _time_axis(ax, float(times[0]), float(times[-1]))
    return _curve(ax, times, values, color=INK, linewidth=0.8)


def residual(
    ax: Axes,
    trace: Trace,
    reference: Forces,
    floor: float = 1e-12,
    *,
    window: Window | None = None,
    log: bool = True,
) -> Artists:
    """Draw how far the friction of a run is from another run's, or from a measurement.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        The run.
    reference : Trace or Measured
        What it is compared with. A trace is compared at even times and at its own transitions, a
        measurement at its times.
    floor : float
        N; on a logarithmic axis smaller values are drawn here.
    window : (float, float), optional
        From when to when, s.
    log : bool
        Draw its size on a logarithmic axis.

    Returns
    -------
    list of Artist
        The line.

    Raises
    ------
    ParameterError
        If the two have no time in common.
    """
    begin, end = checked_window(trace, window)
    first, last = max(begin, float(reference.t[0])), min(end, float(reference.t[-1]))
    if not first < last:
        raise ParameterError(
            f"reference runs from {reference.t[0]:g} to {reference.t[-1]:g} s; it must overlap "
            f"{begin:g} to {end:g} s"
        )
    if isinstance(reference, Trace):
        grid = np.union1d(np.linspace(first, last, SMOOTH), reference.transitions.t)
        times = grid[(grid >= first) & (grid <= last)]
        other = reference.sample(times).F
    else:
        inside = (reference.t >= first) & (reference.t <= last)
        times, other = reference.t[inside], reference.F[inside]
    same = np.array_equal(times, trace.t)
    mine = trace.F if same else trace.sample(times).F
    return difference(ax, times, mine - other, floor, log=log)
