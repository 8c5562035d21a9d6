"""Draw the paper's Fig. 1: a slider on n Maxwell elements, each a spring and a damper in parallel.

When a row of a run is drawn, the deflections give the positions of the contacts: z_i is the
distance that the slider has moved relative to the rest position of the contact.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.quantities import per_second, scale_of, trimmed
from gms_fsm.traces.trace import Trace
from plots.panels.parts.selection import checked_row, dotted, scaled
from plots.style import (
    INK,
    LINE_GREY,
    PALE_GREY,
    PANEL,
    RC,
    element_colour,
    state_look,
)
from plots.style.mathtext import folded
from plots.style.matplotlib import Artist, Axes, Figure, Rectangle, rc_context
from plots.systems.mechanical_symbols import (
    arrow_between,
    damper_points,
    hatched,
    spring_points,
)
from plots.views.traces import check_trace

ROW = 1.35  # height of one element
WALL = 6.0  # position of the slider's face, to which springs and dampers are attached
REST = 3.45  # length of a spring at z = 0
SWING = 1.0  # displacement of a contact by the largest deflection of a run
CONTACT = 0.5  # width of a contact
GROUND = 0.36  # its extent below the middle of its row
MOST = 12  # elements
SHOWN = 0.6  # of SWING: the deflection of all elements where there is no run
BODY, ARROW, NUMBERS = 0.9, 0.8, 0.55  # widths: of the slider, of its arrows, of longer numbers
LETTERS = 16.0  # of the caption, per inch
INCHES, TALLEST = 0.82, 10.2  # of one unit of height; of all of them, on a page of A4

STIFFNESS = {"k": r"$k_{{{}}}$", "sigma_0": r"$\sigma_0$"}
# The damping of an element is the sigma_1 of its bristle; sigma_2 is viscous friction.
DAMPING = {"sigma": r"$\sigma_{{1,{}}}$", "sigma_1": r"$\sigma_1$"}


def elements_at(
    ax: Axes, trace: Trace | None = None, row: int = -1, elements: int = 4
) -> list[Artist]:
    """Draw a slider on Maxwell elements, deflected as in one row of a run.

    A contact in the default state (stick) is plain pale blue and held by a peg; in another state
    (slip) it is hatched, with an arrow in the direction in which the slider moves. Without a run
    all contacts stick, deflected alike.
    """
    if trace is not None:
        check_trace(trace)
        if not trace.model.chart.variables:
            raise ParameterError(
                "a schematic shows deflections, and this chart has no variables",
                place=trace.model.title,
                advice="draw the chart with plots.statechart, or the system with "
                "plots.block_diagram",
            )
    n = elements if trace is None else trace.n
    if not isinstance(n, (int, np.integer)) or isinstance(n, bool) or not 1 <= n <= MOST:
        raise ParameterError(f"a schematic shows 1 to {MOST} elements", place="elements", value=n)
    if trace is not None:
        row = checked_row(trace, row)
    drawn: list[Artist] = []
    shift = np.full(n, SHOWN * SWING if trace is None else 0.0)
    if trace is not None:
        largest = np.nanmax(np.abs(trace.z))
        if largest > 0:
            shift = SWING * np.nan_to_num(trace.z[row]) / largest
    for i in range(n):
        drawn += _element(ax, ROW * (n - i - 0.5), i, n, WALL - REST - float(shift[i]), trace, row)
    drawn += _slider(ax, n, trace, row)
    ends = _sides(trace)
    ax.set(xlim=ends, ylim=(-0.15, ROW * n + 0.15), aspect="equal")
    ax.set_axis_off()
    return drawn


def _sides(trace: Trace | None) -> tuple[float, float]:
    """Return where the drawing ends: left of the ground, right of the slider's arrows."""
    left, right = WALL - REST - SWING - CONTACT - 0.1, WALL + BODY + ARROW + 0.35
    return left, right + (0.0 if trace is None else NUMBERS)


def _caption(trace: Trace | None) -> str:
    """Return what the signs of the drawing mean."""
    said = r"$z_i$: from the contact to its place without deflection (dotted)."
    if trace is None or trace.model.chart.transitions:
        said += " Peg: the contact is held by the ground."
    if trace is not None and trace.model.chart.transitions:
        said += " Arrow at a contact: it slides that way."
    if trace is None or "sigma" in trace.model.values:
        said += r" $\sigma_{1,i}$: damping of element $i$; $\sigma_2$ is viscous friction."
    return f"{said} $F$: friction on the slider, to the left if $F>0$."


def elements_figure(trace: Trace | None, row: int, elements: int, title: str) -> Figure:
    """Draw the elements as a figure; see `plots.systems.mechanism.schematic_figure`."""
    with rc_context(RC):
        figure = Figure(layout="constrained")
        ax = figure.subplots()
        elements_at(ax, trace, row, elements)
        n = elements if trace is None else trace.n
        rows = ROW * n + 0.3
        scale = min(INCHES, TALLEST / rows)  # no taller than a page, with type of the same size
        left, right = _sides(trace)
        wide = (right - left) * scale
        below = folded(_caption(trace), int(LETTERS * wide))
        look: dict[str, Any] = {"x": 0.01, "ha": "left", "fontsize": 8}
        figure.supxlabel(below, **look)
        figure.set_size_inches(wide, 0.5 + 0.15 * (below.count("\n") + 1) + scale * rows)
        parts = [title] if title else []
        if trace is not None:
            parts += [trace.model.title, f"$t$ = {trace.t[row]:.6g} s"]
        if parts:
            figure.suptitle(", ".join(parts), x=0.01, ha="left")
    return figure


def _element(
    ax: Axes, y: float, i: int, n: int, contact: float, trace: Trace | None, row: int
) -> list[Artist]:
    """Draw element i at height y, its contact at x = contact."""
    colour = element_colour(i, n)
    top, bottom = y + 0.22, y - 0.14
    left, right = contact + CONTACT / 2 + 0.2, WALL - 0.2
    look: dict[str, Any] = {"color": colour, "linewidth": 1.3, "solid_capstyle": "round"}
    look["linestyle"] = "-"
    drawn: list[Artist] = []
    # Frames that connect spring and damper, at the contact and at the slider.
    for x, end in ((left, contact + CONTACT / 2), (right, WALL)):
        drawn += ax.plot([x, x], [bottom, top], **look)
        drawn += ax.plot([x, end], [y, y], **look)
    spring, damper = spring_points(left, right, top), damper_points(left, right, bottom)
    drawn += ax.plot(*spring.T, gid=f"spring {i + 1}", **look)
    drawn += ax.plot(*damper.T, gid=f"damper {i + 1}", **look)
    names = _numbers(trace, i)
    # Numbers stand next to the slider: z has the place below the contact.
    place, side = ((left + right) / 2, "center") if trace is None else (right + 0.1, "right")
    text: dict[str, Any] = {"ha": side, "fontsize": 8, "color": INK}
    drawn.append(ax.text(place, top + 0.16, names[0], va="bottom", **text))
    drawn.append(ax.text(place, y - GROUND - 0.2, names[1], va="center", **text))
    drawn += _contact(ax, y, i, contact, trace, row)
    drawn += _deflection(ax, y, i, contact, trace, row)
    return drawn


def _numbers(trace: Trace | None, i: int) -> tuple[str, str]:
    """Return the texts next to spring and damper: symbols, and numbers if there is a run."""
    if trace is None:
        return STIFFNESS["k"].format(i + 1), DAMPING["sigma"].format(i + 1)
    values = trace.model.values
    texts: list[str] = []
    for symbols in (STIFFNESS, DAMPING):
        name = next((name for name in symbols if name in values), None)
        if name is None:
            texts.append("")
            continue
        every = np.broadcast_to(values[name], trace.n)
        scale = scale_of(every.tolist(), trace.model.chart.unit(name) or "")
        text = dotted(trimmed(scale.text(float(every[i]))))
        texts.append(f"{symbols[name].format(i + 1)} = {text}")
    return texts[0], texts[1]


def _contact(
    ax: Axes, y: float, i: int, contact: float, trace: Trace | None, row: int
) -> list[Artist]:
    """Draw the contact on its piece of ground, and its state."""
    ground = y - GROUND
    low, high = WALL - REST - SWING - CONTACT, WALL - REST + SWING + CONTACT
    drawn = [hatched(ax, low, ground - 0.1, high - low, 0.1, PALE_GREY, "/////")]
    drawn += ax.plot([low, high], [ground, ground], "-", color=LINE_GREY, linewidth=0.9, zorder=1)
    chart = None if trace is None else trace.model.chart
    name = "stick" if trace is None else str(trace.states[row, i])
    held = chart is None or name == chart.default_state.name
    alone = chart is not None and not chart.transitions  # one state: neither stick nor slip
    mode = 0 if chart is None else chart.state_index(name)
    look = {"facecolor": PALE_GREY, "edgecolor": LINE_GREY} if alone else state_look(mode)
    look |= {"linewidth": 1.4, "zorder": 3, "gid": f"contact {i + 1}"}
    box = Rectangle((contact - CONTACT / 2, ground), CONTACT, GROUND + 0.22, **look)
    drawn.append(ax.add_patch(box))
    label = f"E{i + 1}" if trace is None else f"E{i + 1} {name}"
    at = contact + CONTACT / 2, y + 0.3
    drawn.append(ax.text(*at, label, ha="right", va="bottom", fontsize=8.5, color=INK))
    if held and not alone:  # a peg into the ground
        ends = [ground + 0.1, ground - 0.16]
        drawn += ax.plot([contact, contact], ends, "-", color=INK, linewidth=2.0, zorder=4)
    elif trace is not None and not held:
        way = 1.0 if trace.v[row] >= 0 else -1.0
        start, height = contact + way * (CONTACT / 2 + 0.03), ground + 0.1  # beside the box
        tip = start + 0.85 * way * CONTACT
        drawn.append(arrow_between(ax, (start, height), (tip, height), size=9, lw=1.2))
    return drawn


def _deflection(
    ax: Axes, y: float, i: int, contact: float, trace: Trace | None, row: int
) -> list[Artist]:
    """Draw the distance from the contact's rest position, and its symbol."""
    rest, height = WALL - REST, y - GROUND - 0.22
    ends = [y - GROUND, height - 0.08]
    drawn: list[Artist] = []
    drawn += ax.plot([rest, rest], ends, color=LINE_GREY, linewidth=0.8, linestyle=":", zorder=1)
    label = f"$z_{{{i + 1}}}$"
    if trace is not None:
        factor, unit = scaled(trace.z[row], trace.model.chart.length)
        shown = factor * trace.z[row]
        label += f" = {_signed(shown[i], _decimals(shown))} {unit}"
    if abs(contact - rest) > 0.15:
        drawn.append(arrow_between(ax, (contact, height), (rest, height), size=7, lw=1.2))
    # Where there is more room: behind the place without deflection.
    side = 1.0 if contact < rest else -1.0
    look: dict[str, Any] = {"va": "center", "fontsize": 8, "color": INK}
    look["ha"] = "left" if side > 0 else "right"
    return [*drawn, ax.text(rest + 0.12 * side, height, label, **look)]


def _decimals(values: FloatArray) -> int:
    """Return how many decimals give the largest of some numbers three digits."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    return max(0, 2 - math.floor(math.log10(largest))) if largest > 0.0 else 0


def _signed(value: float, decimals: int) -> str:
    """Write a number with a minus sign instead of a hyphen."""
    return f"{value:.{min(decimals, 9)}f}".replace("-", "\N{MINUS SIGN}")


def _slider(ax: Axes, n: int, trace: Trace | None, row: int) -> list[Artist]:
    """Draw the slider with its velocity and the friction on it."""
    look: dict[str, Any] = {"facecolor": PANEL, "edgecolor": INK, "linewidth": 1.3}
    body = Rectangle((WALL, 0.05), BODY, ROW * n - 0.1, gid="slider", **look)
    drawn: list[Artist] = [ax.add_patch(body)]
    look = {"ha": "center", "va": "center", "fontsize": 9}
    drawn.append(ax.text(WALL + BODY / 2, ROW * n / 2, "slider", rotation=90, **look))
    v, F = (0.0, 0.0) if trace is None else (float(trace.v[row]), float(trace.F[row]))
    speed, push = "$v$", "$F$"
    if trace is not None:
        factor, unit = scaled(np.array([v]), per_second(trace.model.chart.length))
        speed += f" = {_signed(factor * v, _decimals(np.array([factor * v])))} {unit}"
        push += f" = {_signed(F, _decimals(np.array([F])))} {trace.model.chart.force}"
    edge = WALL + BODY
    # v to the right is positive; positive friction pulls the slider to the left.
    for height, text, forward in (
        (0.5 * ROW * n + 0.3, speed, v >= 0),
        (0.5 * ROW * n - 0.3, push, trace is not None and F < 0),
    ):
        ends = ((edge + 0.1, height), (edge + ARROW, height))
        drawn.append(arrow_between(ax, *(ends if forward else ends[::-1]), size=11, lw=1.2))
        drawn.append(ax.text(edge + 0.1, height + 0.1, text, ha="left", va="bottom", fontsize=9))
    return drawn
