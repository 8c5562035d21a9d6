"""The picture of a film: chart and bristles on the left, force and states on the right.

What does not move is drawn once. The chart is drawn again only where it changes; cursor, bristles
and texts are drawn in every frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import Any, cast

import numpy as np

from gms_fsm.errors import cut
from gms_fsm.traces.trace import Trace
from plots.film._bristles import Bristles, panel_height
from plots.film._chart import FilmChart
from plots.film._pace import Frame, Pace
from plots.output.svg_artists import drawn
from plots.panels.active_states import spans
from plots.panels.parts.axes import force_title
from plots.style import CHART_THEMES, HATCHES, PAGE_THEMES, Theme
from plots.style.matplotlib import Artist, Axes, Figure, FigureCanvasAgg, Image
from plots.views.window import Window

POINTS = 72.0  # per inch
DPI = 100
RIGHT, LEAST_LEFT = 4.9, 4.9  # inches, of the columns
WIDEST, TALLEST = 9.0, 6.0  # inches of a chart; a larger one is drawn smaller
SMALLEST = 0.8  # but not smaller than this: its texts have at least 7 points
LINE, LABELS, MARGIN = 0.23, 0.5, 0.12  # inches: a text above the force; below an axis; around
FORCE = 1.7  # inches of the force axis, at least
LANE, LOWEST_LANE, LANES = 0.3, 0.16, 2.4  # inches of a ribbon; of all ribbons, if there are many
MOST = 24  # elements with ribbon and bristle
SIZE = 8.5  # points
LETTERS = 66  # of a line above the force
CURSOR = 1.44  # points: two pixels


class FilmPicture:
    """The moving picture.

    Parameters
    ----------
    pace : Pace
        The frames.
    chart : FilmChart
        The chart.
    curve : Trace
        The same part of the run with enough rows for a smooth curve.
    window : (float, float)
        s, what is shown.
    theme : {"light", "dark"}
        Colours.

    Attributes
    ----------
    figure : Figure
        Holds the last frame drawn.
    """

    def __init__(
        self, pace: Pace, chart: FilmChart, curve: Trace, window: Window, theme: Theme
    ) -> None:
        self.pace, self.chart, self.trace = pace, chart, pace.trace
        self.colours, self.page = CHART_THEMES[theme], PAGE_THEMES[theme]
        elements = range(min(self.trace.n, MOST))
        x, y, width, height = (float(n) for n in chart.root.get("viewBox", "").split())
        scale = max(SMALLEST, min(1.0, WIDEST * POINTS / width, TALLEST * POINTS / height))
        drawing = scale * width / POINTS, scale * height / POINTS
        self.left = max(drawing[0], LEAST_LEFT)
        bristles = panel_height(len(elements))
        lanes = len(elements) * min(LANE, max(LOWEST_LANE, LANES / len(elements)))
        what = f"{self.trace.model.title}; {self.trace.rig.title}"
        about = [cut(each, LETTERS) for each in (self.trace.heading, what) if each]
        self.said = 0.09 + LINE * (len(about) + 2)
        self.tall = max(
            drawing[1] + bristles + 2 * MARGIN, self.said + FORCE + 0.12 + lanes + LABELS + MARGIN
        )
        self.wide = self.left + RIGHT
        size = (_even(self.wide), _even(self.tall))
        self.wide, self.tall = size
        self.figure = Figure(figsize=size, dpi=DPI, facecolor=self.colours.paper)
        # Half of its methods are untyped.
        self.canvas = cast(Any, FigureCanvasAgg(self.figure))
        spare = (self.tall - drawing[1] - bristles) / 3
        ax = self._axes((self.left - drawing[0]) / 2, spare, *drawing)
        ax.set(xlim=(x, x + width), ylim=(y + height, y))
        ax.set_axis_off()
        chart.paint(pace.frames[0])
        self.parts = list(drawn(ax, chart.root, scale=scale, animated=True))
        own = (self.left - 2 * MARGIN, bristles)
        ax = self._axes(MARGIN, self.tall - spare / 2 - bristles, *own)
        self.bristles = Bristles(ax, self.trace, curve, elements, theme, own)
        self.moving: list[Artist] = []
        force = self.tall - self.said - 0.12 - lanes - LABELS - MARGIN
        self._draw_force(curve, window, force)
        self._draw_lanes(curve, window, elements, lanes)
        self._draw_texts(about)
        self.canvas.draw()
        self.ground = self.canvas.copy_from_bbox(self.figure.bbox)
        self.look: object = None
        self.layer: Any = None

    def _axes(self, left: float, top: float, width: float, height: float) -> Axes:
        """Add axes; all lengths in inches, from the left and the top edge."""
        bottom = self.tall - top - height
        across, up = np.array([left, width]) / self.wide, np.array([bottom, height]) / self.tall
        box = (across[0], up[0], across[1], up[1])
        return self.figure.add_axes(box, facecolor=self.colours.paper)

    def _draw_force(self, curve: Trace, window: Window, height: float) -> None:
        ax = self._axes(self.left + 0.75, self.said, RIGHT - 0.95, height)
        ax.plot(curve.t, curve.F, color=self.colours.ink, linewidth=1.2)
        ax.set_xlim(*window)
        ax.set_ylabel(force_title(curve), fontsize=SIZE)
        ax.tick_params(labelbottom=False)
        self._paint_axes(ax)
        self.cursors = [ax.axvline(window[0])]
        (self.point,) = ax.plot([], [], "o", color=self.colours.fired, markersize=6)
        self.moving.append(self.point)

    def _draw_lanes(
        self, curve: Trace, window: Window, elements: Sequence[int], height: float
    ) -> None:
        """Draw the states of every element over time."""
        top = self.tall - MARGIN - LABELS - height
        ax = self._axes(self.left + 0.75, top, RIGHT - 0.95, height)
        states = [state.name for state in self.trace.model.chart.states]
        for lane, i in enumerate(elements):
            found = list(spans(curve, i, window))
            for number, state in enumerate(states):
                ax.broken_barh(
                    [(a, b - a) for name, a, b in found if name == state],
                    (lane + 0.6, 0.8),
                    facecolor=self.page.fills[number % len(self.page.fills)],
                    edgecolor=self.page.hatches[number % len(self.page.hatches)],
                    hatch=HATCHES[number % len(HATCHES)],
                    linewidth=0.5,
                )
        ax.set(
            xlim=window,
            ylim=(len(elements) + 0.5, 0.5),
            yticks=range(1, len(elements) + 1),
            yticklabels=[f"E{i + 1}" for i in elements],
        )
        ax.set_xlabel("$t$ [s]", fontsize=SIZE)
        self._paint_axes(ax)
        ax.tick_params(axis="y", length=0)
        self.cursors.append(ax.axvline(window[0]))
        for cursor in self.cursors:
            cursor.set(color=self.colours.fired, linewidth=CURSOR, clip_on=False, animated=True)
        self.moving = [*self.cursors, *self.moving]

    def _paint_axes(self, ax: Axes) -> None:
        colours = self.colours
        ax.tick_params(colors=colours.ink, labelsize=SIZE - 0.5)
        for label in (ax.xaxis.label, ax.yaxis.label):
            label.set_color(colours.ink)
        for spine in ax.spines.values():
            spine.set_color(colours.ink)
        ax.yaxis.set_label_coords(-0.62 / (RIGHT - 0.95), 0.5)

    def _draw_texts(self, about: Sequence[str]) -> None:
        """Write what runs, and leave room for the clock and what happens."""

        def write(
            line: int, text: str, colour: str, size: float = SIZE, weight: str = "normal"
        ) -> Any:
            at = ((self.left + 0.35) / self.wide, 1 - (0.2 + LINE * line) / self.tall)
            look: dict[str, Any] = {"color": colour, "fontsize": size, "fontweight": weight}
            return self.figure.text(*at, text, va="center", parse_math=False, **look)

        for line, text in enumerate(about):
            write(line, text, self.colours.soft)
        self.clock = write(len(about), "", self.colours.ink, SIZE + 1.5, "bold")
        self.happens = write(len(about) + 1, "", self.colours.ink)
        self.moving += [self.clock, self.happens]
        for artist in self.moving:
            artist.set_animated(True)

    # ------------------------------------------------------------------ the frame
    def picture(self, number: int) -> Image.Image:
        """Return a frame."""
        frame = self.pace.frames[number]
        look = self.chart.look(frame)
        if look != self.look:
            self.chart.paint(frame)
            self.canvas.restore_region(self.ground)
            for part in self.parts:
                part.update()
                part.draw(self.figure)
            self.look, self.layer = look, self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self.layer)
        self.show(frame)
        for artist in (*self.moving, *self.bristles.moving):
            self.figure.draw_artist(artist)
        return Image.fromarray(np.asarray(self.canvas.buffer_rgba())[..., :3].copy())

    def show(self, frame: Frame) -> None:
        """Move cursors, texts and bristles to where they are in a frame."""
        t, force = frame.t, float(self.trace.F[frame.row])
        for cursor in self.cursors:
            cursor.set_xdata([t, t])
        self.point.set_data([t], [force])
        slow = {1.0: "", np.inf: "    held"}.get(frame.slowed, f"    slowed ×{frame.slowed:g}")
        self.clock.set_text(f"t = {t:.3f} s    F = {self.bristles.told(1, force)}{slow}")
        self.happens.set_text(self._event(frame))
        self.bristles.show(frame)

    def _event(self, frame: Frame) -> str:
        """Write what happens while time stands still."""
        if frame.entry < 0:
            return ""
        place, number = self.pace.cascade(frame.entry)
        record = self.trace.transitions[frame.entry]
        step = f"micro-step {place} of {number}: " if number > 1 else ""
        return f"{step}E{record.element + 1} {record.edge}, {record.source} → {record.target}"


def _even(inches: float) -> float:
    """Return a length with an even number of pixels, as videos need."""
    return 2 * ceil(inches * DPI / 2) / DPI
