"""A film of a run: chart, bristles, force and states, with time slowed where states change.

`plots.film` has its parts: which moment each frame shows, the chart, the bristles, the picture and
the files.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import ParameterError, shown
from gms_fsm.foundation.arguments import refusing
from gms_fsm.traces.trace import Trace
from plots.charts.statechart import ChartSheet, chosen
from plots.film._chart import FilmChart
from plots.film._movie import Movie
from plots.film._pace import paced
from plots.film._picture import FilmPicture
from plots.output import formats
from plots.output.svg_artists import EXACT
from plots.panels.parts.selection import shown as shown_rows
from plots.style import RC, Theme
from plots.style.matplotlib import rc_context
from plots.views.traces import check_trace

FASTEST = 50  # frames per second: GIF delays are in 10 ms, and readers reject a delay of 10 ms
USUAL = 200  # frames


@refusing()
def animate(
    trace: Trace,
    path: str | Path,
    *,
    elements: int | Sequence[int] | None = None,
    frames: int | None = None,
    seconds: float | None = None,
    t_start: float | None = None,
    t_end: float | None = None,
    fps: float = 20.0,
    notation: str = "stateflow",
    theme: str = "light",
    progress: Callable[[int, int], object] | None = None,
) -> Path:
    """Write a film of a run: chart, bristles, force and states.

    Time runs uniformly between transitions and four times slower near them; at every micro-step it
    stands still for 0.4 s, or less if there are many. A fired edge is orange while time stands
    still, and fades over three frames. If there are more micro-steps than three in four frames,
    time runs uniformly.

    The chart is that of one element if only one is chosen; otherwise one chart for all, which says
    how many elements are in each state. Force, states and bristles are those of the whole contact;
    bristles are contacts on the ground, with a spring each to the slider. Where the chart has no
    deflection, they are rods.

    Parameters
    ----------
    trace : Trace
        The run.
    path : str or Path
        Its file ending selects the format, for example ``.gif``. An existing file is replaced.
    elements : int or sequence of int, optional
        How many elements, or which ones, counted from 0; by default all.
    frames : int, optional
        Number of frames, at least 2; by default 200.
    seconds : float, optional
        Length of the film instead of frames, s.
    t_start, t_end : float, optional
        Part of the run to show, s; by default all of it.
    fps : float
        Frames per second, at most 50.
    notation : {"stateflow", "math"}
        Notation of guards.
    theme : {"light", "dark"}
        Colours.
    progress : callable, optional
        Called after each frame with the number of frames done and in all.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ParameterError
        If an argument is not as above, or part of the time is outside the run.
    MissingExtraError
        If matplotlib or Pillow is not installed, or PyAV for a video.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> from plots import animate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> animate(trace, "run.gif", frames=1)
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: frames is 1; it must be an integer of at least 2
    """
    check_trace(trace)
    formats.chosen(path, "animation")
    if not 0 < checked_scalar("fps", fps, "finite") <= FASTEST:
        raise ParameterError(f"it must be above 0 and at most {FASTEST}", place="fps", value=fps)
    if progress is not None and not callable(progress):
        raise ParameterError("it must be a function", place="progress", value=progress)
    count = _frames(frames, seconds, fps)
    ChartSheet(trace.model.chart, notation, "TB", theme)  # refuses wrong options before any work
    chosen(trace.n if elements is None else elements, trace.n)
    first, last = float(trace.t.min()), float(trace.t.max())
    begin = first if t_start is None else checked_scalar("t_start", t_start, "finite")
    end = last if t_end is None else checked_scalar("t_end", t_end, "finite")
    if not first <= begin < end <= last:
        raise ParameterError(
            f"t_start is {shown(begin)} s and t_end is {shown(end)} s",
            advice=f"they must lie within the run, {first:g} to {last:g} s, in this order",
        )
    window = (begin, end)
    pace = paced(trace, window, count, fps)
    chart = FilmChart(pace, elements, notation, theme)
    with rc_context(RC | EXACT):
        film = FilmPicture(pace, chart, shown_rows(trace, window), window, cast(Theme, theme))
        return formats.save(Movie(film, fps, progress), path, "animation")


def _frames(frames: int | None, seconds: float | None, fps: float) -> int:
    """Return the number of frames."""
    if seconds is not None:
        if frames is not None:
            raise ParameterError(
                f"frames is {shown(frames)} and seconds is {shown(seconds)}",
                advice="give only one of them",
            )
        if not isinstance(seconds, float | int) or not 2 <= seconds * fps < float("inf"):
            raise ParameterError(
                f"it must be a time of at least two frames, {2 / fps:g} s",
                place="seconds",
                value=seconds,
            )
        return round(seconds * fps)
    frames = USUAL if frames is None else frames
    if isinstance(frames, bool) or not isinstance(frames, int) or frames < 2:
        raise ParameterError("it must be an integer of at least 2", place="frames", value=frames)
    return frames
