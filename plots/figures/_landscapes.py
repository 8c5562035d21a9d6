"""The figure of one element's guards: landscape, race to fire, what is held, counterexamples."""

from __future__ import annotations

from textwrap import wrap
from typing import Any

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.foundation.quantities import Scale
from gms_fsm.traces.trace import Trace
from gms_fsm.verification.findings import Report
from plots import panels
from plots.figures._layout import fitted, low, sheet
from plots.figures._parts import head
from plots.panels.guards.landscapes import (
    AFTER,
    BORDER,
    acceleration,
    path_colour,
    pinned,
    view_of,
    with_unit,
)
from plots.panels.guards.racing import rows_of
from plots.panels.parts.selection import checked_row, one_element
from plots.style import INK, LINE_GREY
from plots.style.matplotlib import Axes, Figure, Line2D, rc_context
from plots.style.presets import current, font, inches, pt, room, settings
from plots.views.plane import Plane
from plots.views.traces import check_trace
from plots.views.window import Window

# Inches: figure, panels, above them, a line of text.
WIDTH, PLOT, TOP, LINE = 10.0, 4.8, 0.95, 0.165
LEFT, RIGHT, BETWEEN = 0.72, 0.15, 0.43  # inches: beside the panels
RACE = 3.5  # inches: width of the race, if the panels are next to each other
OVER = 1.0  # inches: between the panels, if they are below each other
UNDER, BELOW = 0.85, 0.45  # inches: for the axes of the race and of the landscape
LANE, LOWEST = 0.5, 0.36  # inches: a row of the race, if there is room; below the landscape
LETTERS = 14.2  # of the caption, per inch


@refusing()
def landscape(
    trace: Trace,
    element: int,
    *,
    row: int = -1,
    t: float | None = None,
    window: Window | None = None,
    checks: Report | None = None,
    title: str = "",
) -> Figure:
    """Draw when an element would switch: its guards in the plane of v and z, and how far they are.

    Left, the guards of the edges that leave the active state as regions, each clause as a line,
    with the flow of the state and the path of the run. Right, the race to fire: the margin of each
    clause. A chart without variables is drawn over v and the first other quantity that its guards
    read.

    Parameters
    ----------
    trace : Trace
        The run; of a system with several contacts, ``trace.contact(name)``.
    element : int
        Which element, counted from 0.
    row : int
        Row of the run; negative rows count from the end. On a row made by a firing of this element
        the row before is shown, with the values that the guards saw.
    t : float, optional
        Instead of a row: the last row at or before this time, s.
    window : (float, float), optional
        Time interval in which the path is drawn, s; by default from the transition of this element
        before the row to the one after it.
    checks : Report, optional
        From `gms_fsm.prove`, of the chart of the run: its counterexamples are drawn as pins.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        The caption says what is held as at the row.

    Raises
    ------
    ParameterError
        If there is no such element, row or time, the report is that of another chart, or the chart
        has nothing to draw over v.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> from plots.figures import landscape
    >>> run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
    >>> figure = landscape(run, 0, t=1.5)
    >>> [ax.get_title(loc="left") for ax in figure.axes]
    ['guards that leave stick', 'race to fire']
    """
    check_trace(trace)
    element = one_element(trace, element)
    if t is not None and row != -1:
        raise ParameterError(f"row is {row} and t is {t}", advice="give one of them")
    row = checked_row(trace, row, t)
    plane = Plane.of(trace, row, element)
    said = _caption(trace, plane, view_of(trace, element, plane).speeds)
    if checks is not None:
        said += _pins_listed(plane, checks)
    if low():  # no room for more
        said = said[:1]
    rows = rows_of(plane.why)
    lines, x = _folded(said, RACE), 1 - (RACE + RIGHT) / room(WIDTH)
    under = _free(rows) > LINE * len(lines)  # the race, next to the landscape
    if not under:
        lines, x = _folded(said, room(WIDTH) - 0.3), 0.02
    with rc_context(settings()):
        figure, left, right = _axes(rows, 0 if under else len(lines))
        height = figure.get_figheight() / inches(1)
        bottom = left.get_position().y0 * height - BELOW if under else 0.06
        panels.landscape(left, trace, element, row=row, window=window)
        if checks is not None:
            panels.pins(left, trace, element, checks, row=row)
        panels.race(right, trace, element, row=row)
        shown = "guards that leave" if plane.edges else "flow of"
        panels.lettered(left, "a", f"{shown} {plane.state}")
        panels.lettered(right, "b", "race to fire")
        path = path_colour(plane, element, trace.n)
        looks = [
            ("border", INK, BORDER),
            ("path before", path, "-"),
            ("after", path, AFTER),
        ]
        handles = [Line2D([], [], color=c, linestyle=dash, label=n) for n, c, dash in looks]
        if plane.threshold is not None:
            handles.append(
                Line2D([], [], color=LINE_GREY, linewidth=pt(5), alpha=0.45, label="$±s(v)$")
            )
        close: Any = {"handlelength": 1.8, "columnspacing": 1.0}
        if low():  # no wider than the panel
            close = {"handlelength": 1.0, "columnspacing": 0.5, "handletextpad": 0.3}
            close |= {"borderaxespad": 0.1, "borderpad": 0.1}
        legend = left.legend(
            handles=handles, loc="lower right", bbox_to_anchor=(1, 1), ncols=4, **close
        )
        if room(WIDTH) < WIDTH:  # it may be wider than the panel
            legend.set_loc("lower left")
            legend.set_bbox_to_anchor((0, 1), left.transAxes)
        figure.suptitle(
            _title(trace, plane, title), x=0.02, y=1 - 0.12 / height, ha="left", va="top"
        )
        for number, line in enumerate(lines):
            place = (LINE * (len(lines) - number) + bottom) / height
            figure.text(x, place, line, fontsize=font(8), va="top", color=INK)
    return fitted(figure)


def _folded(lines: list[str], width: float) -> list[str]:
    """Return a caption in lines that are at most so many inches wide."""
    letters = int(LETTERS * width)
    return [part for line in lines for part in wrap(line, letters, subsequent_indent="   ")]


def _beside() -> bool:
    """Return whether the landscape and the race are next to each other."""
    return current().height is not None or room(WIDTH) - LEFT - BETWEEN - RACE - RIGHT > RACE


def _free(rows: float) -> float:
    """Return how many inches are free below a race of so many rows, beside the landscape."""
    return PLOT + BELOW - UNDER - LANE * rows if _beside() and current().height is None else 0.0


def _axes(rows: float, lines: int) -> tuple[Figure, Axes, Axes]:
    """Return an empty figure, and the axes of the landscape and of the race beside or below it."""
    wide, below = room(WIDTH), 0.82 + LINE * lines
    given = current().height
    if _beside():
        tall = PLOT if given is None else given / inches(1) - TOP - below
        race = min(RACE, 0.46 * wide)
        plot, lanes = wide - LEFT - BETWEEN - race - RIGHT, min(tall, LANE * rows)
        height = TOP + tall + below
        places = (
            (LEFT, below, plot, tall),
            (LEFT + plot + BETWEEN, below + tall - lanes, race, lanes),
        )
    else:
        broad, lanes = wide - LEFT - RIGHT, LOWEST * rows
        plot = 0.8 * broad
        height = TOP + plot + OVER + lanes + below
        places = ((LEFT, height - TOP - plot, broad, plot), (LEFT, below, broad, lanes))
    figure = sheet(wide, height, layout=None)
    left, right = (
        figure.add_axes((x / wide, y / height, w / wide, h / height)) for x, y, w, h in places
    )
    return figure, left, right


def _title(trace: Trace, plane: Plane, title: str) -> str:
    who = f"{plane.why.contact} E{plane.why.element + 1}".lstrip()
    place = f"$t$ = {trace.t[plane.row]:.6g} s, row {plane.row}"
    return f"{head(trace, title)}\n{who} in {plane.state} at {place}"


def _caption(trace: Trace, plane: Plane, speeds: Scale) -> list[str]:
    """Return what is held, what the arrows are, and which row is shown, as lines."""
    chart, lines = plane.chart, []
    if plane.why.left:
        edge = next(each.edge.name for each in plane.why if each.fired)
        lines.append(
            f"Row {plane.row + 1} was made by {edge}; shown is row {plane.row} before it, with the "
            "values that the guards saw."
        )
    held = ", ".join(
        f"{name} = {with_unit(chart, name, value)}" for name, value in plane.held.items()
    )
    again = [f"{name}({plane.names[0]})" if name == "s" else name for name in plane.again]
    said = [f"Held as at the row: {held}."] if held else []
    said += [f"Computed at every point: {', '.join(again)}."] if again else []
    lines += [" ".join(said)] if said else []
    dv = acceleration(trace, plane.row)
    second = plane.names[1]
    if (plane.state, second) not in chart.flows:
        lines.append(f"No arrows: {second} is no variable of the chart.")
    elif dv is None:
        lines.append("No arrows: the arc of this row has no second time.")
    else:
        rate = float(f"{dv * speeds.factor:.4g}")
        lines.append(
            f"Arrows: direction of the flow; d{second}/dt is that of {plane.state}, "
            f"d{plane.names[0]}/dt = {rate:.6g} {speeds.unit}² as at this row everywhere.".replace(
                "-", "−"
            )
        )
    return lines


def _pins_listed(plane: Plane, checks: Report) -> list[str]:
    """Return the findings with pins as numbered lines."""
    found = pinned(plane, checks)
    if not found:
        return [f"No finding of the checks has a point with {' and '.join(plane.names)}."]
    lines = [
        "Pins: counterexamples, with numbers of their own; on the frame if they lie outside it."
    ]
    for number, each in enumerate(found, start=1):
        where = ", ".join(each.where)
        lines.append(f"{number}  {each.check} {each.status}, {where}: {each.text} ({each.example})")
    return lines
