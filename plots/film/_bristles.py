"""The bristles in a film: contacts on the ground, and springs between them and the slider.

As on the replay page, the slider stands still; contacts and ground move to the left when it moves
to the right. Both move by the same length per metre, so that a contact that sticks stays where it
is on the ground. Charts without a deflection have a rod in place of the spring.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.quantities import per_second, scale_of
from gms_fsm.traces.trace import Trace
from plots.film._pace import Frame
from plots.panels.parts.selection import has_threshold
from plots.style import CHART_THEMES, HATCHES, PAGE_THEMES, Theme, ramp
from plots.style.matplotlib import Artist, Axes, Line2D, LineCollection, Rectangle, patches

HEAD, FOOT = 0.12, 0.08  # inches above and below the rows
LEAST = 1.15  # inches, so that the numbers next to the slider have room
TALLEST, LOWEST, ROOM = 0.46, 0.2, 3.6  # inches of a row; of all rows, if there are many
SIZE = 8.0  # points of the texts
WIDE = 0.068  # inches of a character
LONGEST = 16  # characters of a state's name
SLIDER, ARROW, NUMBERS = 0.24, 0.42, 1.2  # inches: slider, longest arrow, all to its right
CONTACT, TALL = 0.2, 0.55  # inches wide; share of the row's height
SWING = 0.27  # share of the room that the largest deflection takes
PERIOD, TICKS = 0.6, 6  # inches after which the ground looks the same, and its ticks
TURNS = 7  # of a spring


def row_height(elements: int) -> float:
    """Return the height of an element in inches.

    >>> [round(row_height(n), 2) for n in (1, 4, 12, 40)]
    [0.46, 0.46, 0.3, 0.2]
    """
    return min(TALLEST, max(LOWEST, ROOM / elements))


def panel_height(elements: int) -> float:
    """Return the height of all in inches."""
    return max(LEAST, HEAD + FOOT + elements * row_height(elements))


class Bristles:
    """The moving picture of contacts and springs.

    Parameters
    ----------
    ax : Axes
        Where; its axis lines are hidden.
    trace : Trace
        The rows of the frames.
    curve : Trace
        The run with all its extremes.
    elements : sequence of int
        Which elements, counted from 0.
    theme : {"light", "dark"}
        Colours.
    size : (float, float)
        Width and height of the axes in inches.

    Attributes
    ----------
    moving : list of Artist
        What `show` changes, in the order of drawing.
    """

    def __init__(
        self,
        ax: Axes,
        trace: Trace,
        curve: Trace,
        elements: Sequence[int],
        theme: Theme,
        size: tuple[float, float],
    ) -> None:
        self.ax, self.trace, self.elements = ax, trace, list(elements)
        self.theme: Theme = theme
        self.colours, self.page = CHART_THEMES[theme], PAGE_THEMES[theme]
        ax.set(xlim=(0, size[0]), ylim=(size[1], 0))
        ax.set_axis_off()
        self.names = [state.name[:LONGEST] for state in trace.model.chart.states]
        label = f"E{trace.n} {max(self.names, key=len)}"
        self.left = 0.1 + WIDE * len(label)
        self.wall = size[0] - NUMBERS - SLIDER
        self.height = row_height(len(self.elements))
        self.z = _deflection(curve)
        self.most = {"v": _largest(curve.v), "F": _largest(curve.F)}
        longest = 0.0 if self.z is None else _largest(curve.variable(self.z)[:, self.elements])
        space = self.wall - self.left
        self.rest = self.left + CONTACT + SWING * space
        # Inches per metre; without springs the whole run is 20 periods of the ground.
        travel = float(np.ptp(curve.x)) or 1.0
        self.scale = SWING * space / longest if longest else 20 * PERIOD / travel
        # In some charts s is a force and not the threshold of z.
        limit = np.nanmin(curve.s) if self.z is not None and has_threshold(trace) else np.inf
        self.limited = bool(self.scale * limit < space)
        chart = trace.model.chart
        speed = scale_of(self.most["v"], per_second(chart.length))
        self.scales = speed, scale_of(self.most["F"], chart.force)
        self.moving: list[Artist] = []
        self._draw()

    def _draw(self) -> None:
        ax, colours, rows = self.ax, self.colours, range(len(self.elements))
        still: dict[str, Any] = {"color": colours.line, "linewidth": 0.8}
        text: dict[str, Any] = {"color": colours.ink, "fontsize": SIZE, "va": "center"}
        for floor in map(self._floor, rows):
            ax.plot([self.left, self.wall], [floor, floor], **still)
            if self.z is not None:
                ax.plot(2 * [self.rest], [floor - TALL * self.height, floor], ls=":", **still)
        self.ground = LineCollection([], colors=colours.line, linewidths=0.7)
        self.limits = Line2D([], [], ls="", marker="v", markersize=4, color=colours.soft)
        self.springs = [
            Line2D([], [], color=colour, linewidth=1.4, solid_joinstyle="round")
            for colour in ramp("elements", len(rows), self.theme)
        ]
        size = CONTACT, TALL * self.height
        self.contacts = [Rectangle((0, 0), *size) for _ in rows]
        self.lit = [Rectangle((0, 0), *size, linewidth=2.4, fill=False) for _ in rows]
        self.labels = [
            ax.text(0.02, self._floor(k) - TALL / 2 * self.height, "", **text) for k in rows
        ]
        lines: list[Any] = [self.ground, self.limits, *self.springs]
        for line in lines:
            ax.add_artist(line)
        for patch in (*self.contacts, *self.lit):
            ax.add_patch(patch)
        numbers = self._draw_slider(text)
        self.moving = [*lines, *self.contacts, *self.lit, *self.labels, *numbers]
        for artist in self.moving:
            artist.set_animated(True)

    def _draw_slider(self, text: dict[str, Any]) -> list[Artist]:
        """Draw the slider; return the arrows and numbers of v and F next to it."""
        ax, colours = self.ax, self.colours
        tall = self.height * len(self.elements)
        look: dict[str, Any] = {"facecolor": self.page.panel, "edgecolor": colours.ink}
        ax.add_patch(Rectangle((self.wall, HEAD), SLIDER, tall, linewidth=1.1, **look))
        middle = HEAD + tall / 2
        if tall > 0.6:
            ax.text(self.wall + SLIDER / 2, middle, "slider", rotation=90, ha="center", **text)
        start = self.wall + SLIDER + 0.1
        if self.limited:
            end = max(HEAD + tall, LEAST - FOOT)
            small = text | {"color": colours.soft, "va": "bottom"}
            ax.text(start, end, "▾ |z| = s", **small)
        middle = max(middle, HEAD + 0.3)
        self.arrows = []
        for y in (middle - 0.17, middle + 0.17):
            arrow = patches.Polygon([(0, 0)] * 3, closed=True, color=colours.ink)
            ax.add_patch(arrow)
            self.arrows.append((arrow, ax.text(start, y, "", **(text | {"va": "bottom"})), y))
        return [each for arrow, said, _ in self.arrows for each in (arrow, said)]

    def _floor(self, k: int) -> float:
        return HEAD + self.height * (k + 0.8)

    # ------------------------------------------------------------------ the frame
    def show(self, frame: Frame) -> None:
        """Move everything to where it is in a frame."""
        trace, row = self.trace, frame.row
        lit = {int(trace.transitions.element[k]): b for k, b in frame.fired}
        z = np.zeros(trace.n) if self.z is None else np.nan_to_num(trace.variable(self.z)[row])
        modes = trace.modes[row]
        limits = []
        for k, i in enumerate(self.elements):
            at, floor = self.rest - self.scale * float(z[i]), self._floor(k)
            self._paint_contact(k, int(modes[i]), at, lit.get(i, 0.0))
            self.springs[k].set_data(
                *self._spring(at + CONTACT / 2, floor - TALL / 2 * self.height)
            )
            self.labels[k].set_text(f"E{i + 1} {self.names[int(modes[i])]}")
            if self.limited:
                places = self.rest + self.scale * trace.s[row, i] * np.array([-1.0, 1.0])
                inside = places[(places > self.left) & (places < self.wall)]
                limits += [(x, floor - 0.72 * self.height) for x in inside]
        self.limits.set_data(np.array(limits).reshape(-1, 2).T)
        self.ground.set_segments(self._ground_at(float(trace.x[row])))
        v, force = float(trace.v[row]), float(trace.F[row])
        # Positive friction pulls the slider back.
        self._point(0, "v", v, v / self.most["v"] if self.most["v"] else 0.0)
        self._point(1, "F", force, -force / self.most["F"] if self.most["F"] else 0.0)

    def _paint_contact(self, k: int, mode: int, at: float, lit: float) -> None:
        contact, now = self.contacts[k], self.lit[k]
        for patch in (contact, now):
            patch.set_xy((at - CONTACT / 2, self._floor(k) - TALL * self.height))
        contact.set(
            facecolor=self.page.fills[mode % len(self.page.fills)],
            edgecolor=self.page.hatches[mode % len(self.page.hatches)],
            hatch=2 * HATCHES[mode % len(HATCHES)],
        )
        now.set(edgecolor=self.colours.fired, alpha=lit, visible=lit > 0)

    def _spring(self, start: float, y: float) -> tuple[FloatArray, FloatArray]:
        """Return the line from a contact to the slider."""
        if self.z is None:
            return np.array([start, self.wall]), np.array([y, y])
        ends = min(0.08, 0.2 * (self.wall - start))
        turns = np.linspace(start + ends, self.wall - ends, 2 * TURNS + 2)
        wave = np.array([0.0, *([1.0, -1.0] * TURNS), 0.0])
        x = np.concatenate([[start], turns, [self.wall]])
        return x, y + 0.17 * self.height * np.concatenate([[0.0], wave, [0.0]])

    def _ground_at(self, x: float) -> list[Any]:
        shift = -self.scale * x % PERIOD if np.isfinite(x) else 0.0
        step = PERIOD / TICKS
        ticks = range(int(self.wall / step) + 9)
        places = [(shift - PERIOD + tick * step, tick % TICKS) for tick in ticks]
        inside = [(at, tick) for at, tick in places if self.left + 0.06 <= at <= self.wall]
        marks: list[Any] = []
        for k in range(len(self.elements)):
            floor = self._floor(k)
            for at, tick in inside:
                share = 0.24 if tick == 0 else 0.11  # one in six tells how far it has moved
                deep = share * self.height
                marks.append([(at, floor), (at - 0.05, floor + deep)])
        return marks

    def told(self, which: int, value: float) -> str:
        """Return v or F as text, in one unit for the whole film."""
        text = self.scales[which].text(value, 3).replace("-", "−")
        return f"{'+' if value > 0 else ''}{text}"

    def _point(self, which: int, name: str, value: float, share: float) -> None:
        """Draw the arrow and number of a quantity; a share of 1 points to the right."""
        arrow, said, y = self.arrows[which]
        said.set_text(f"{name} = {self.told(which, value)}")
        start, head = self.wall + SLIDER + 0.1, 0.045
        length = ARROW * min(abs(share), 1.0) if np.isfinite(share) else 0.0
        tip, tail = (start + length, start) if share > 0 else (start, start + length)
        back = tip + (-2 if share > 0 else 2) * min(head, length / 2)
        thin = 0.25 * head
        y += 0.05
        half = [(tail, thin), (back, thin), (back, head), (tip, 0.0)]
        outline = [(x, y - up) for x, up in half] + [(x, y + up) for x, up in half[2::-1]]
        arrow.set_xy(outline)
        arrow.set_visible(length > 0.04)


def _deflection(trace: Trace) -> str | None:
    """Return the variable that is a deflection: the first in metres or radians, or z."""
    chart = trace.model.chart
    known = [name for name in chart.variables if chart.unit(name) == chart.length]
    return next(iter([*known, *(name for name in chart.variables if name == "z")]), None)


def _largest(values: FloatArray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0
