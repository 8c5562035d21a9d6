"""An animation of a run: the live chart next to the friction force.

Graphviz lays out the chart once, `plots.live_chart` paints it, and matplotlib draws the painted SVG
(`plots._svg_artists`): no program is called per frame. The chart is redrawn only when it changes; a
cursor moves over the force in every frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import numpy as np

from gms_fsm.errors import ParameterError, shown
from gms_fsm.traces.trace import Trace, check_trace
from plots import formats
from plots._matplotlib import (
    Figure,
    FigureCanvasAgg,
    Image,
    rc_context,
    to_rgb,
)
from plots._svg_artists import drawn
from plots.live_chart import LiveChart
from plots.statechart import Sheet
from plots.style import CHART_THEMES, RC, ChartTheme

__all__ = ["animate"]

SMOOTH = 2000  # points of the force curve
POINTS = 72.0  # per inch
CURVE_WIDTH, CURVE_HEIGHT = 4.4, 3.4  # inches, of the force and its labels
DPI = 100
FASTEST = 50  # frames per second: GIF delays are in 10 ms, and readers reject a delay of 10 ms
STEPS = 8  # shades of a colour along an edge; more could hardly be distinguished


def animate(
    trace: Trace,
    path: str | Path,
    *,
    elements: int | Sequence[int] | None = None,
    frames: int = 200,
    t_start: float | None = None,
    t_end: float | None = None,
    fps: float = 20.0,
    notation: str = "stateflow",
    theme: str = "light",
    progress: Callable[[int, int], object] | None = None,
) -> Path:
    """Write a GIF of the live chart next to F(t) with a moving cursor.

    Parameters
    ----------
    trace : Trace
        The run.
    path : str or Path
        Its ending must be that of an animation format in `plots.formats.FORMATS`, such as ``.gif``.
        The folder must exist; an existing file is replaced atomically.
    elements : int or sequence of int, optional
        How many elements, or which ones, counted from 0; by default all.
    frames : int
        Number of frames, at evenly spaced times; at least 2. Consecutive frames without a visible
        difference become one frame that is shown longer.
    t_start, t_end : float, optional
        s, the part of the run that is shown; by default the whole run.
    fps : float
        Frames per second, at most 50.
    notation : {"stateflow", "math"}
        See `plots.statechart.statechart`.
    theme : {"light", "dark"}
        Colours.
    progress : callable, optional
        Called as ``progress(done, frames)``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ParameterError
        If an option is not allowed.
    OutputError
        If the folder cannot be written.
    MissingExtraError
        If there is no Graphviz, neither program nor package.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> animate(trace, "run.gif", frames=1)
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: frames is 1; it must be an integer of at least 2
    """
    check_trace(trace)
    formats.chosen(path, "animation")
    if isinstance(frames, bool) or not isinstance(frames, int) or frames < 2:
        raise ParameterError("it must be an integer of at least 2", place="frames", value=frames)
    if not 0 < fps <= FASTEST:
        raise ParameterError(f"it must be above 0 and at most {FASTEST}", place="fps", value=fps)
    Sheet(trace.model.chart, notation, "TB", theme)  # refuses wrong options before any work
    first, last = float(trace.t.min()), float(trace.t.max())
    begin = first if t_start is None else t_start
    end = last if t_end is None else t_end
    if not first <= begin < end <= last:
        raise ParameterError(
            f"t_start is {shown(begin)} s and t_end is {shown(end)} s",
            advice=f"they must lie within the run, {first:g} to {last:g} s, in this order",
        )
    rows = trace.sample(np.linspace(begin, end, frames))
    chart = LiveChart(rows, elements, notation=notation, theme=theme)
    with rc_context(RC):
        film = _Film(chart, trace.sample(np.linspace(begin, end, SMOOTH)), CHART_THEMES[theme])
        return formats.save(Movie(film, frames, fps, progress), path, "animation")


@dataclass(frozen=True, eq=False)
class Movie:
    """An animation that is ready to be written.

    Parameters
    ----------
    film : _Film
        The moving picture.
    frames : int
        Number of frames.
    fps : float
        Frames per second.
    progress : callable, optional
        Called as ``progress(done, frames)``.
    """

    film: _Film
    frames: int
    fps: float
    progress: Callable[[int, int], object] | None = None

    def pictures(self) -> Iterator[Image.Image]:
        """Draw frame by frame."""
        for row in range(self.frames):
            yield self.film.picture(row)
            if self.progress is not None:
                self.progress(row + 1, self.frames)


def gif(movie: Movie) -> bytes:
    """Return an animation as a GIF, which repeats forever.

    Parameters
    ----------
    movie : Movie
        What.

    Returns
    -------
    bytes
        The file.
    """
    palette, none = movie.film.palette(), Image.Dither.NONE
    each = (picture.quantize(palette=palette, dither=none) for picture in movie.pictures())
    file = BytesIO()
    next(each).save(
        file,
        format="GIF",
        save_all=True,
        append_images=each,
        duration=1000.0 / movie.fps,
        loop=0,
        optimize=False,
    )
    return file.getvalue()


class _Film:
    """The moving picture.

    Parameters
    ----------
    chart : LiveChart
        Chart of the rows to show.
    curve : Trace
        The same part of the run with enough points for a smooth curve.
    colours : ChartTheme
        Colours.
    """

    def __init__(self, chart: LiveChart, curve: Trace, colours: ChartTheme) -> None:
        self.chart, self.colours = chart, colours
        left, top, width, height = (float(n) for n in chart.root.get("viewBox", "").split())
        tall = max(height / POINTS, CURVE_HEIGHT)
        wide = width / POINTS + CURVE_WIDTH
        self.figure = Figure(figsize=(wide, tall), dpi=DPI, facecolor=colours.paper)
        # Half of its methods are untyped.
        self.canvas = cast(Any, FigureCanvasAgg(self.figure))
        box = (0, (1 - height / POINTS / tall) / 2, width / POINTS / wide, height / POINTS / tall)
        ax = self.figure.add_axes(box)
        ax.set(xlim=(left, left + width), ylim=(top + height, top))
        ax.set_axis_off()
        chart.paint(0)
        self.parts = list(drawn(ax, chart.root, animated=True))
        self._draw_force(curve, width / POINTS / wide, wide, tall)
        self.canvas.draw()
        self.ground = self.canvas.copy_from_bbox(self.figure.bbox)
        self.look: object = None
        self.layer: Any = None

    def _draw_force(self, curve: Trace, start: float, wide: float, tall: float) -> None:
        colours = self.colours
        high = max(CURVE_HEIGHT / tall, 0.62)
        ax = self.figure.add_axes(
            (start + 0.75 / wide, (1 - high) / 2 + 0.55 / tall, 3.4 / wide, high - 1.0 / tall),
            facecolor=colours.paper,
        )
        ax.plot(curve.t, curve.F, color=colours.ink, linewidth=1.2)
        ax.margins(x=0)
        ax.set_xlabel("t [s]", color=colours.ink)
        ax.set_ylabel("F [N]", color=colours.ink)
        ax.tick_params(colors=colours.ink)
        for spine in ax.spines.values():
            spine.set_color(colours.ink)
        self.line = ax.axvline(curve.t[0], color=colours.fired, linewidth=1.2, animated=True)
        (self.point,) = ax.plot([], [], "o", color=colours.fired, markersize=6, animated=True)
        self.clock = ax.set_title("", color=colours.ink, animated=True)

    def picture(self, row: int) -> Image.Image:
        """Return the picture of a row of the chart's run."""
        chart, trace = self.chart, self.chart.trace
        look = chart.look(row)
        if look != self.look:
            chart.paint(row)
            self.canvas.restore_region(self.ground)
            for part in self.parts:
                part.update()
                part.draw(self.figure)
            self.look, self.layer = look, self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self.layer)
        t, force = float(trace.t[row]), float(trace.F[row])
        self.line.set_xdata([t, t])
        self.point.set_data([t], [force])
        self.clock.set_text(f"t = {t:.3f} s    F = {force:+.3f} N")
        for artist in (self.line, self.point, self.clock):
            self.figure.draw_artist(artist)
        return Image.fromarray(np.asarray(self.canvas.buffer_rgba())[..., :3].copy())

    def palette(self) -> Image.Image:
        """Return one palette for all frames: every colour, and its shades towards the background.

        Separate palettes would make the file larger, and colours would flicker.
        """
        grounds = [np.array(to_rgb(c)) for c in (self.colours.paper, self.colours.active_fill)]
        colours = set(vars(self.colours).values()) - {self.colours.paper, self.colours.active_fill}
        shades = list(grounds)
        for colour in (np.array(to_rgb(c)) for c in sorted(colours)):
            for ground in grounds:
                shades += [ground + k / STEPS * (colour - ground) for k in range(1, STEPS + 1)]
        image = Image.new("P", (1, 1))
        table = np.unique(np.round(255 * np.array(shades)).astype(np.uint8), axis=0)
        image.putpalette(table.tobytes())  # at most 2 + 8 * 2 * 8 of the 256 that a GIF can have
        return image
