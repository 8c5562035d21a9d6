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
from gms_fsm.traces.trace import Trace
from plots._matplotlib import Artist, Axes, Line2D, LineCollection, Rectangle, patches
from plots.film._chart import blend
from plots.film._pace import Frame
from plots.panels._shown import has_threshold, scaled
from plots.style import CHART_THEMES, HATCHES, PAGE_THEMES

__all__ = ["Bristles", "row_height"]

HEAD, FOOT = 0.12, 0.08  # inches above and below the rows
TALLEST, LOWEST, ROOM = 0.46, 0.2, 3.6  # inches of a row; of all rows, if there are many
SIZE = 8.0  # points of the texts
WIDE = 0.068  # inches of a character
LONGEST = 16  # characters of a state's name
SLIDER, ARROW, NUMBERS = 0.24, 0.42, 1.2  # inches: slider, longest arrow, all to its right
CONTACT = 0.2  # inches, of a contact
SWING = 0.27  # share of the room that the largest deflection takes
PERIOD, TICKS = 0.6, 6  # inches after which the ground looks the same, and its ticks
TURNS = 7  # of a spring


def row_height(elements: int) -> float:
    """Return the height of an element in inches.

    >>> [round(row_height(n), 2) for n in (1, 4, 12, 40)]
    [0.46, 0.46, 0.3, 0.2]
    """
    return min(TALLEST, max(LOWEST, ROOM / elements))


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
        theme: str,
        size: tuple[float, float],
    ) -> None:
        self.ax, self.trace, self.elements = ax, trace, list(elements)
        self.colours, self.page = CHART_THEMES[theme], PAGE_THEMES[theme]
        ax.set(xlim=(0, size[0]), ylim=(size[1], 0))
        ax.set_axis_off()
        names = [state.name[:LONGEST] for state in trace.model.chart.states]
        self.names = [name[:1].upper() + name[1:] for name in names]
        self.left = 0.1 + WIDE * (len(f"E{trace.n} ") + max(map(len, names)))
        self.wall = size[0] - NUMBERS - SLIDER
        self.height = row_height(len(self.elements))
        self.z = _deflection(curve)
        self.limited = self.z is not None and has_threshold(trace)
        self.most = {"v": _largest(curve.v), "F": _largest(curve.F)}
        longest = 0.0 if self.z is None else _largest(curve.variable(self.z)[:, self.elements])
        space = self.wall - self.left
        self.rest = self.left + CONTACT + SWING * space
        # Inches per metre; without springs the whole run is 20 periods of the ground.
        travel = float(np.ptp(curve.x)) or 1.0
        self.scale = SWING * space / longest if longest else 20 * PERIOD / travel
        self.units = scaled(curve.v, "m/s"), scaled(curve.F, "N")
        self.moving: list[Artist] = []
        self._draw()

    def _draw(self) -> None:
        ax, colours = self.ax, self.colours
        still: dict[str, Any] = {"color": colours.line, "linewidth": 0.8}
        for k in range(len(self.elements)):
            floor = self._floor(k)
            ax.plot([self.left, self.wall], [floor, floor], **still)
            if self.z is not None:
                ax.plot(2 * [self.rest], [floor - 0.55 * self.height, floor], ls=":", **still)
        self.ground = LineCollection([], colors=colours.line, linewidths=0.7)
        self.limits = Line2D([], [], ls="", marker="v", markersize=4, color=colours.soft)
        self.springs = [
            Line2D([], [], color=self._element_colour(i), linewidth=1.4, solid_joinstyle="round")
            for i in self.elements
        ]
        self.contacts = [Rectangle((0, 0), CONTACT, 0.62 * self.height) for _ in self.elements]
        self.labels = [
            ax.text(
                0.02,
                self._floor(k) - 0.22 * self.height,
                "",
                fontsize=SIZE,
                va="center",
                color=colours.ink,
            )
            for k in range(len(self.elements))
        ]
        lines: list[Any] = [self.ground, self.limits, *self.springs]
        for line in lines:
            ax.add_artist(line)
        for contact in self.contacts:
            ax.add_patch(contact)
        top, bottom = HEAD, HEAD + self.height * len(self.elements)
        look: dict[str, Any] = {"facecolor": self.page.panel, "edgecolor": colours.ink}
        ax.add_patch(Rectangle((self.wall, top), SLIDER, bottom - top, linewidth=1.1, **look))
        if bottom - top > 0.6:
            ax.text(
                self.wall + SLIDER / 2, (top + bottom) / 2, "slider", rotation=90, fontsize=SIZE,
                ha="center", va="center", color=colours.ink,
            )  # fmt: skip
        if self.limited:
            ax.text(
                self.wall + SLIDER + 0.1, bottom, "▾ |z| = s", fontsize=SIZE - 0.5, va="bottom",
                color=colours.soft,
            )  # fmt: skip
        self.arrows = []
        middle = (top + bottom) / 2
        for y in (middle - 0.16, middle + 0.16):
            arrow = patches.Polygon([(0, 0)] * 3, closed=True, color=colours.ink)
            ax.add_patch(arrow)
            said = ax.text(
                self.wall + SLIDER + 0.1, y, "", fontsize=SIZE, va="bottom", color=colours.ink
            )
            self.arrows.append((arrow, said, y))
        moved = [each for arrow, said, _ in self.arrows for each in (arrow, said)]
        self.moving = [*lines, *self.contacts, *self.labels, *moved]
        for artist in self.moving:
            artist.set_animated(True)

    def _floor(self, k: int) -> float:
        return HEAD + self.height * (k + 0.8)

    def _element_colour(self, element: int) -> str:
        return self.page.elements[element % len(self.page.elements)]

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
            self.springs[k].set_data(*self._spring(at + CONTACT / 2, floor - 0.34 * self.height))
            self.labels[k].set_text(f"E{i + 1} {self.names[int(modes[i])]}")
            if self.limited:
                places = self.rest + self.scale * trace.s[row, i] * np.array([-1.0, 1.0])
                limits += [(x, floor - 0.7 * self.height) for x in places]
        self.limits.set_data(np.array(limits).reshape(-1, 2).T)
        self.ground.set_segments(self._ground_at(float(trace.x[row])))
        v, force = float(trace.v[row]), float(trace.F[row])
        # Positive friction pulls the slider back.
        self._point(0, "v", v, v / self.most["v"] if self.most["v"] else 0.0)
        self._point(1, "F", force, -force / self.most["F"] if self.most["F"] else 0.0)

    def _paint_contact(self, k: int, mode: int, at: float, lit: float) -> None:
        contact = self.contacts[k]
        contact.set_xy((at - CONTACT / 2, self._floor(k) - 0.62 * self.height))
        edge = self.page.edges[mode % len(self.page.edges)]
        contact.set(
            facecolor=self.page.fills[mode % len(self.page.fills)],
            edgecolor=blend(edge, self.colours.fired, lit),
            hatch=2 * HATCHES[mode % len(HATCHES)],
            linewidth=1.0 + 1.4 * lit,
        )

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
        places = [(shift - PERIOD + n * step, n % TICKS) for n in range(int(self.wall / step) + 9)]
        inside = [(at, n) for at, n in places if self.left + 0.06 <= at <= self.wall]
        marks: list[Any] = []
        for k in range(len(self.elements)):
            floor = self._floor(k)
            for at, n in inside:
                deep = 0.11 if n == 0 else 0.05  # one in six tells how far it has moved
                marks.append([(at, floor), (at - 0.05, floor + deep)])
        return marks

    def _point(self, which: int, name: str, value: float, share: float) -> None:
        """Draw the arrow and number of a quantity; a share of 1 points to the right."""
        arrow, said, y = self.arrows[which]
        factor, unit = self.units[which]
        said.set_text(f"{name} = {factor * value:+.3g} {unit}")
        start, head = self.wall + SLIDER + 0.1, 0.045
        length = ARROW * min(abs(share), 1.0) if np.isfinite(share) else 0.0
        tip, tail = (start + length, start) if share > 0 else (start, start + length)
        back = tip + (-2 if share > 0 else 2) * min(head, length / 2)
        thin = 0.25 * head
        y += 0.05
        outline = [
            (tail, y - thin), (back, y - thin), (back, y - head), (tip, y),
            (back, y + head), (back, y + thin), (tail, y + thin),
        ]  # fmt: skip
        arrow.set_xy(outline)
        arrow.set_visible(length > 0.04)


def _deflection(trace: Trace) -> str | None:
    """Return the variable that is a deflection: the first in metres, or z."""
    chart = trace.model.chart
    known = [name for name in chart.variables if chart.unit(name) == "m"]
    return next(iter([*known, *(name for name in chart.variables if name == "z")]), None)


def _largest(values: FloatArray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0
