"""The panel of one element's guards: regions in the plane of v and z, with flow and path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError, SignalError
from gms_fsm.foundation.quantities import Scale, in_words, scale_of
from gms_fsm.language import (
    MATLAB_LIKE,
    Comparison,
    Condition,
    Relation,
    Value,
    clauses,
    comparisons,
    latex_name,
    raised,
    spell,
    split,
)
from gms_fsm.traces.scope import guard_columns, unit_of
from gms_fsm.traces.trace import Trace
from gms_fsm.verification.findings import Finding, Report
from plots.panels.guards.line_names import LineNames, NamedLine
from plots.panels.parts.axes import Artists, axis_title, beside
from plots.panels.parts.selection import checked_row, checked_window, one_element, shown
from plots.style import (
    EDGE_COLOURS,
    EDGE_HATCHES,
    INK,
    LINE_GREY,
    PALE_GREY,
    PAPER,
    VERMILION,
    element_colour,
)
from plots.style.matplotlib import Axes, NullLocator, Quiver, RendererBase, to_rgb
from plots.style.presets import font, pt
from plots.views.plane import Plane, linear_threshold, turning_points
from plots.views.window import Window

__all__ = ["landscape", "pins"]

GRID = (801, 401)  # points of the plane at which guards are evaluated
ARROWS = (19, 13)  # of the flow field
BORDER: Any = (0, (6, 1.6))  # of a clause
AFTER: Any = (0, (1.2, 1.2))  # the path after the row

Floats = NDArray[np.float64]


class PlaneWindow(NamedTuple):
    """The part of a plane that is drawn."""

    linear: float  # below this speed the axis is linear, m/s
    speed: float  # largest speed
    low: float  # of the second quantity
    high: float
    factor: float  # from SI to the unit of the axis
    title: str  # of the axis of the second quantity
    speeds: Scale  # of the axis of v, as in the race to fire


# --------------------------------------------------------------------------- what is shown
def view_of(trace: Trace, element: int, plane: Plane) -> PlaneWindow:
    """Return the part of a plane that shows the run of an element and the turns of its guards."""
    chart, (velocity, second) = trace.model.chart, plane.names
    v = _column(trace, velocity, element)
    z = _column(trace, second, element)
    top = float(np.nanmax(np.abs(v), initial=0.0))
    linear = linear_threshold(plane, top)
    speed = max(1.5 * top, 100 * linear)
    z = np.append(z[np.isfinite(z)], plane.here[1])
    widest = max(float(np.abs(z).max()), 1e-300)
    turns = [turning_points(plane, plane.edges, 1, at) for at in (plane.here[0], speed, -speed)]
    near = np.concatenate(turns)
    near = near[np.abs(near) <= 4 * widest] if np.ptp(z) > 0 else near[:2]
    reach = np.concatenate([z, near])
    if plane.threshold is not None:
        s = plane.numbers(plane.threshold, np.array([0.0, speed]), 0.0)
        assert s is not None
        reach = np.concatenate([reach, s, -s])
    low, high = float(reach.min()), float(reach.max())
    pad = 0.14 * (high - low) or 0.5 * abs(high) or 1.0
    factor, title = axis_title(second, unit_of(chart, second), np.array([low - pad, high + pad]))
    unit = unit_of(chart, velocity)
    told = (each.scale for edge in plane.why for each in edge.clauses if each.unit == unit)
    speeds = next(told, scale_of(speed, unit))
    return PlaneWindow(linear, speed, low - pad, high + pad, factor, title, speeds)


def _column(trace: Trace, name: str, element: int) -> Floats:
    """Return a quantity of the plane at all rows."""
    chart = trace.model.chart
    if name in chart.variables:
        return trace.variable(name)[:, element]
    if name == chart.velocities[0]:
        return trace.v
    if name in chart.force_names:
        return trace.F if name == "F" else trace.value(name)
    if name in ("t", "x"):
        return trace.t if name == "t" else trace.x
    found = guard_columns(trace, [name])[name]
    every = np.broadcast_to(found, (trace.n, len(trace)))
    return np.asarray(every[element])


def with_unit(chart: Chart, name: str, value: float) -> str:
    """Return a value as text, with a prefixed unit where the unit is known."""
    return in_words(value, unit_of(chart, name), 4).replace("-", "−")


def path_window(trace: Trace, row: int, element: int) -> Window:
    """Return the time interval around a row in which the path of an element is drawn."""
    log, t = trace.transitions, float(trace.t[row])
    times = np.unique(log.t[log.element == element])
    before, after = times[times < t], times[times > t]
    begin = before[-1] if before.size else trace.t[0]
    end = after[0] if after.size else trace.t[-1]
    return max(float(begin), float(trace.t[0])), min(float(end), float(trace.t[-1]))


def acceleration(trace: Trace, row: int) -> float | None:
    """Return dv/dt within the arc of a row; None if the arc has no second time.

    Difference quotient of the run sampled closely around the row; of the neighbouring rows, if the
    run cannot be sampled.
    """
    t, modes = trace.t, trace.rows.mode
    near = [
        other
        for other in (row - 1, row + 1)
        if 0 <= other < len(trace) and t[other] != t[row] and (modes[other] == modes[row]).all()
    ]
    if not near:
        return None
    try:
        times = [float(t[row] + 1e-3 * (t[other] - t[row])) for other in near]
        v = trace.sample(times).v.tolist()
    except SignalError:  # from a file, driven by a Python function
        times, v = [float(t[other]) for other in near], [float(trace.v[other]) for other in near]
    if len(near) == 1:
        times, v = [float(t[row]), *times], [float(trace.v[row]), *v]
    if times[0] == times[1]:
        return None
    return float((v[1] - v[0]) / (times[1] - times[0]))


# --------------------------------------------------------------------------- the landscape
def landscape(
    ax: Axes, trace: Trace, element: int, *, row: int = -1, window: Window | None = None
) -> Artists:
    """Draw the guards that leave the active state of an element, in the plane of v and z.

    Each guard is a region, each clause a line; further the threshold s(v), the flow of the active
    state, the path around the row, and a dot at the row.

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
    window : (float, float), optional
        Time interval in which the path is drawn, s; by default from the transition of this element
        before the row to the one after it.

    Returns
    -------
    list of Artist
        Regions, clauses, curves of s(v), flow, path, the dot, and the names of the clauses.
    """
    plane = Plane.of(trace, checked_row(trace, row), one_element(trace, element))
    view = view_of(trace, element, plane)
    ax.set_xscale("symlog", linthresh=view.linear)
    ax.set(
        xlim=(-view.speed, view.speed),
        ylim=(view.factor * view.low, view.factor * view.high),
        xlabel=f"${latex_name(plane.names[0])}$ [{view.speeds.unit}], linear below "
        f"{_power(view.linear * view.speeds.factor)}",
        ylabel=view.title,
    )
    ax.grid(visible=False)
    _speed_ticks(ax, view)
    v, z = grid_of(ax, view, GRID)
    names = LineNames(ax)
    drawn: Artists = _regions(ax, plane, v, z, view.factor, names)
    drawn += _flow(ax, trace, plane, view, names)
    drawn += _clauses(ax, plane, v, z, view.factor, names)
    drawn += _threshold(ax, plane, v, view.factor)
    around = path_window(trace, plane.row, element) if window is None else window
    drawn += _path(ax, trace, plane, element, checked_window(trace, around), view, names)
    here = plane.here[0], view.factor * plane.here[1]
    (dot,) = ax.plot(*here, "o", color=VERMILION, markersize=pt(8), markeredgecolor=PAPER, zorder=8)
    names.avoid.append(here)
    return [*drawn, dot, names]


def grid_of(ax: Axes, view: PlaneWindow, size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return the points of a grid that is even in the picture: v in a row, z in a column, SI."""
    scale = ax.xaxis.get_transform()
    end = float(scale.transform(np.array([view.speed]))[0])
    # The middle is exactly 0.
    v = scale.inverted().transform(end * np.linspace(-1.0, 1.0, size[0]))
    return np.asarray(v)[np.newaxis, :], np.linspace(view.low, view.high, size[1])[:, np.newaxis]


def _power(value: float) -> str:
    return f"10{raised(str(round(np.log10(value))))}"


def _speed_ticks(ax: Axes, view: PlaneWindow) -> None:
    """Label 0 and every decade, or every second or third of many."""
    first, last = round(np.log10(view.linear)), int(np.floor(np.log10(view.speed)))
    step = -(-(last - first) // 3) or 1
    powers = range(last, first - 1, -step)
    ticks = [-(10.0**k) for k in powers] + [0.0] + [10.0**k for k in reversed(powers)]
    above = [_power(tick * view.speeds.factor) for tick in ticks[len(powers) + 1 :]]
    ax.set_xticks(ticks, [*(f"−{each}" for each in reversed(above)), "0", *above])
    ax.xaxis.set_minor_locator(NullLocator())


def _regions(
    ax: Axes, plane: Plane, v: Floats, z: Floats, factor: float, names: LineNames
) -> Artists:
    """Draw where each guard is true, with the number of its edge as in the race to fire."""
    drawn: Artists = []
    for number, edge in enumerate(plane.edges):
        inside = plane.truths(plane.chart.guards[edge.name], v, z)
        if not inside.any():
            continue
        colour = EDGE_COLOURS[number % len(EDGE_COLOURS)]
        look: Any = {"zorder": 1, "levels": [0.5, 1.5]}
        values = inside.astype(float)
        drawn.append(
            ax.contourf(v[0], factor * z[:, 0], values, colors=[colour], alpha=0.16, **look)
        )
        hatch = EDGE_HATCHES[number % len(EDGE_HATCHES)]
        lines = ax.contourf(v[0], factor * z[:, 0], values, colors="none", hatches=[hatch], **look)
        lines.set(facecolor="none", edgecolor=to_rgb(colour) + (0.5,), linewidth=0.0)
        lines.set_label(edge.name)
        drawn.append(lines)
        row, column = np.unravel_index(_depth(inside).argmax(), inside.shape)
        place = float(v[0, column]), factor * float(z[row, 0])
        box = {"boxstyle": "circle,pad=0.25", "facecolor": PAPER, "edgecolor": colour}
        look = {"ha": "center", "va": "center", "fontsize": font(8), "fontweight": "bold"}
        drawn.append(ax.text(*place, str(number + 1), color=INK, bbox=box, zorder=7, **look))
        names.avoid.append(place)
    return drawn


def _depth(inside: NDArray[np.bool_]) -> Floats:
    """Return how far each point is inside a region, in points of the grid."""
    return np.asarray(distance_transform_edt(np.pad(inside, 1)))[1:-1, 1:-1]


def _clauses(
    ax: Axes, plane: Plane, v: Floats, z: Floats, factor: float, names: LineNames
) -> Artists:
    """Draw where the two sides of each clause are equal."""
    texts: dict[tuple[Value, Value], list[str]] = {}
    colours: dict[tuple[Value, Value], str] = {}
    for number, edge in enumerate(plane.edges):
        colour = EDGE_COLOURS[number % len(EDGE_COLOURS)]
        for clause in clauses(plane.chart.guards[edge.name]):
            for relation in _relations(clause):
                if not plane.reads(relation) & {*plane.names}:
                    continue
                key = relation.left, relation.right
                colours[key] = INK if colours.get(key, colour) != colour else colour
                texts.setdefault(key, []).append(spell(clause, MATLAB_LIKE))
    drawn: Artists = []
    for (left, right), colour in colours.items():
        margin = plane.margin(Relation("<", left, right), v, z)
        if not (np.nanmin(margin) <= 0 <= np.nanmax(margin)):
            continue
        lines = ax.contour(
            v[0],
            factor * z[:, 0],
            margin,
            levels=[0.0],
            colors=[colour],
            linestyles=[BORDER],
            linewidths=pt(1.5),
            zorder=4,
        )
        drawn.append(lines)
        name = ",  ".join(dict.fromkeys(texts[left, right]))
        names.lines.append(NamedLine(name, colour, tuple(lines.allsegs[0])))
    return drawn


def _relations(clause: Condition) -> Sequence[Relation | Comparison]:
    """Return a clause with two sides, or the comparisons of a compound clause."""
    return (clause,) if isinstance(clause, Relation) else comparisons(split(clause))


def _threshold(ax: Axes, plane: Plane, v: Floats, factor: float) -> Artists:
    """Draw s(v) and -s(v), broad and pale, so that a clause on the same curve can be seen."""
    if plane.threshold is None:
        return []
    s = plane.numbers(plane.threshold, v[0], 0.0)
    assert s is not None
    drawn: Artists = []
    for sign, name in ((1.0, "s(v)"), (-1.0, "−s(v)")):
        drawn += ax.plot(
            v[0],
            sign * factor * s,
            color=LINE_GREY,
            linewidth=pt(5),
            alpha=0.45,
            zorder=3,
            label=name,
        )
    return drawn


def _path(
    ax: Axes,
    trace: Trace,
    plane: Plane,
    element: int,
    window: Window,
    view: PlaneWindow,
    names: LineNames,
) -> Artists:
    """Draw the path around the row: solid before it, dotted after it."""
    part = shown(trace, window)
    v, z = part.v, view.factor * _column(part, plane.names[1], element)
    now = float(trace.t[plane.row])
    drawn: Artists = []
    points = np.column_stack([v, z])
    # Jumps at an instant are no part of the path.
    jumps = np.flatnonzero(np.diff(part.t) == 0) + 1
    times, points = (np.insert(each, jumps, np.nan, axis=0) for each in (part.t, points))
    gaps = np.isnan(times)
    colour = path_colour(plane, element, trace.n)
    for keep, dash, name in ((times <= now, "-", "before"), (times >= now, AFTER, "after")):
        x, y = points[keep | gaps].T
        look: Any = {"color": colour, "linestyle": dash, "linewidth": pt(1.2), "zorder": 6}
        drawn += ax.plot(x, y, label=name, **look)
        names.curves.append(points[keep])
    return drawn


def path_colour(plane: Plane, element: int, elements: int) -> str:
    """Return the colour of a path: that of the element, or ink for a quantity of the contact."""
    own = plane.names[1] in plane.chart.variables
    return element_colour(element, elements) if own else INK


def _flow(ax: Axes, trace: Trace, plane: Plane, view: PlaneWindow, names: LineNames) -> Artists:
    """Draw the direction of the flow; lengths of arrows mean nothing."""
    tree = plane.chart.flows.get((plane.state, plane.names[1]))
    dv = acceleration(trace, plane.row)
    v, z = grid_of(ax, view, (ARROWS[0] + 2, ARROWS[1] + 2))
    v, z = v[:, 1:-1], z[1:-1]
    rate = None if tree is None else plane.numbers(tree, v, z)
    if dv is None or rate is None:
        return []
    scale = ax.xaxis.get_transform()
    end = float(scale.transform(np.array([view.speed]))[0])
    place = np.asarray(scale.transform(v[0]))
    step = 1e-6 * (np.abs(v[0]) + view.linear)
    steep = np.asarray(scale.transform(v[0] + step)) - place
    box = ax.get_window_extent()
    along = dv * steep / step / (2 * end) * box.width
    up = rate / (view.high - view.low) * box.height
    size = np.hypot(along, up)
    with np.errstate(invalid="ignore", divide="ignore"):
        length = 0.55 * box.width / ARROWS[0] / size
        ahead = place + along * length / box.width * 2 * end
        higher = up * length / box.height * (view.high - view.low)
    v_ahead = np.asarray(scale.inverted().transform(ahead.ravel())).reshape(ahead.shape)
    tails = np.stack([np.broadcast_to(each, rate.shape) for each in (v, view.factor * z)], axis=-1)
    arrows = np.stack([v_ahead - v, view.factor * higher], axis=-1)
    names.curves += [*np.stack([tails, tails + arrows], axis=-2).reshape(-1, 2, 2)]
    drawn = _FlowArrows(ax, names, tails, arrows)
    ax.add_collection(drawn, autolim=False)
    return [drawn]


class _FlowArrows(Quiver):
    """Arrows at their tails, without those that a name or a mark would cover."""

    def __init__(self, ax: Axes, names: LineNames, tails: Floats, arrows: Floats) -> None:
        look: Any = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "color": PALE_GREY}
        look |= {"width": 0.0022, "headwidth": 4.5, "zorder": 2}
        places = (tails[..., 0], tails[..., 1], arrows[..., 0], arrows[..., 1])
        super().__init__(ax, *places, **look)
        self.names, self.tails, self.arrows = names, tails, arrows

    def draw(self, renderer: RendererBase) -> None:
        """Draw the arrows that are free."""
        hidden = self.names.covered(renderer, self.tails, self.tails + self.arrows)
        self.set_UVC(*(np.ma.masked_array(self.arrows[..., k], hidden) for k in (0, 1)))
        super().draw(renderer)


# --------------------------------------------------------------------------- counterexamples
def pinned(plane: Plane, checks: Report) -> list[Finding]:
    """Return the findings of a chart's checks that have a point in the plane."""
    if not isinstance(checks, Report):
        raise ParameterError("it must be a Report, from prove(chart)", place="checks", value=checks)
    if checks.chart != plane.chart:
        raise ParameterError(
            f"checks is the report of the chart {checks.chart.name!r}",
            advice=f"prove the chart of the run, {plane.chart.name!r}",
        )
    return [each for each in checks.findings if {*plane.names} <= each.counterexample.keys()]


def pins(ax: Axes, trace: Trace, element: int, checks: Report, *, row: int = -1) -> Artists:
    """Draw the counterexamples of a chart's checks as numbered pins, on top of a landscape.

    Parameters
    ----------
    ax : Axes
        Axes with a `landscape` of the same row.
    trace : Trace
        The run.
    element : int
        Which element, counted from 0.
    checks : Report
        From `gms_fsm.prove`, of the chart of the run. Its numbers are those of the counterexample,
        not those of the run.
    row : int
        Row of the run.

    Returns
    -------
    list of Artist
        A dot and a number for each finding whose counterexample has both quantities; a point
        outside the picture is drawn on its frame.

    Raises
    ------
    ParameterError
        If the report is that of another chart.
    """
    plane = Plane.of(trace, checked_row(trace, row), one_element(trace, element))
    factor = view_of(trace, element, plane).factor
    drawn: Artists = []
    places: dict[tuple[float, float], list[str]] = {}
    for number, finding in enumerate(pinned(plane, checks), start=1):
        v, z = (float(finding.counterexample[name]) for name in plane.names)
        point = float(np.clip(v, *ax.get_xlim())), float(np.clip(factor * z, *ax.get_ylim()))
        places.setdefault(point, []).append(str(number))
    look: Any = {"ha": "left", "va": "baseline", "fontweight": "bold", "zorder": 11}
    look["bbox"] = {"boxstyle": "circle,pad=0.25", "facecolor": PAPER, "edgecolor": INK}
    for (v, z), numbers in places.items():
        drawn += ax.plot(v, z, "D", color=PAPER, markeredgecolor=INK, clip_on=False, zorder=10)
        drawn.append(beside(ax, ", ".join(numbers), (v, z), (7, 7), **look))
    return drawn
