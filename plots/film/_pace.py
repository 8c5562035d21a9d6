"""The frames of a film: which moment each shows, and which edges light up.

Between transitions, time runs uniformly. Near a transition it runs slower, and at every micro-step
it stands still for some frames. A fired edge is bright while time stands still, and fades over the
three frames after that. If there are too few frames for this, time runs uniformly throughout.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import steps_of
from plots.views.window import Window

HOLD = 0.4  # s of the film that a micro-step is shown, if there are frames enough
HELD = 0.5  # at most this share of the frames stands still, or SQUEEZED if each needs one frame
SQUEEZED = 0.75
NEAR = 0.3  # s of the film before and after a transition in which time runs slower
SLOWED = 0.4  # at most this share of the other frames is near a transition
SLOW = 4.0  # times slower there
FADE = 3  # frames in which an edge fades


@dataclass(frozen=True)
class Frame:
    """One frame.

    Parameters
    ----------
    t : float
        s, of the run.
    row : int
        Row of `Pace.trace`.
    slowed : float
        How much slower time runs than far from transitions; infinite if it stands still.
    entry : int
        The entry of the log that is shown while time stands still; otherwise -1.
    fired : tuple of (int, float)
        Entries of the log whose edges are lit, and how brightly: 1 at first, then less.
    """

    t: float
    row: int
    slowed: float = 1.0
    entry: int = -1
    fired: tuple[tuple[int, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Pace:
    """All frames, and the rows that they show.

    Parameters
    ----------
    trace : Trace
        The rows of the frames, and all micro-steps between the first and the last.
    frames : tuple of Frame
        In the order of the film.
    steps : ndarray of int
        The micro-step of each entry of the log.
    """

    trace: Trace
    frames: tuple[Frame, ...]
    steps: NDArray[np.int64]

    def cascade(self, entry: int) -> tuple[int, int]:
        """Return the place of an entry among those of its instant, from 1, and their number."""
        same = np.flatnonzero(self.trace.transitions.t == self.trace.transitions.t[entry])
        return int(np.searchsorted(same, entry)) + 1, same.size


def paced(trace: Trace, window: Window, frames: int, fps: float) -> Pace:
    """Choose what each frame shows."""
    begin, end = window
    log, steps = trace.transitions, steps_of(trace)
    entries = np.flatnonzero((log.t >= begin) & (log.t <= end))
    hold = _held(entries.size, frames, fps)
    running = frames - hold * entries.size
    times, slowed = _running(window, np.unique(log.t[entries]), running, fps if hold else 0.0)
    # While time stands still comes before the running frame of the same time.
    still = [(float(log.t[e]), 0, int(e)) for e in entries for _ in range(hold)]
    run = [(float(t), 1, k) for k, t in enumerate(times)]
    rows = _rows(trace, np.union1d(times, log.t[entries]))
    made = []
    for t, runs, k in sorted(still + run):
        row = int(np.searchsorted(rows.t, t, side="right")) - 1
        if runs:
            made.append(Frame(t, row, float(slowed[k])))
            continue
        step = np.flatnonzero((rows.t == t) & (rows.microstep == steps[k]))
        made.append(Frame(t, int(step[-1]) if step.size else row, np.inf, k))
    return Pace(rows, tuple(_lit(made, log.t, entries, max(hold, 1))), steps)


def _held(micro_steps: int, frames: int, fps: float) -> int:
    """Return the number of frames for which each micro-step is shown."""
    if not micro_steps or micro_steps > min(SQUEEZED * frames, frames - 2):
        return 0
    return max(1, min(round(HOLD * fps), int(HELD * frames / micro_steps)))


def _running(
    window: Window, instants: FloatArray, frames: int, fps: float
) -> tuple[FloatArray, FloatArray]:
    """Return the times of the frames in which time runs, and how much slower it runs there."""
    begin, end = window
    near = min(NEAR * fps, SLOWED * frames / (2 * instants.size)) if instants.size else 0.0
    if near < 1.0:
        return np.linspace(begin, end, frames), np.ones(frames)
    # So many seconds on either side take `near` frames.
    far_step = (end - begin) / (frames - 2 * instants.size * (near - near / SLOW))
    reach = near * far_step / SLOW
    knots = np.unique(np.clip([begin, end, *(instants - reach), *(instants + reach)], begin, end))
    middle = (knots[1:] + knots[:-1]) / 2
    weight = np.where(_close(middle, instants, reach), SLOW, 1.0)
    passed = np.concatenate([[0.0], np.cumsum(weight * np.diff(knots))])
    times = np.interp(np.linspace(0.0, passed[-1], frames), passed, knots)
    return times, np.where(_close(times, instants, reach), SLOW, 1.0)


def _close(times: FloatArray, instants: FloatArray, reach: float) -> NDArray[np.bool_]:
    right = np.searchsorted(instants, times).clip(0, instants.size - 1)
    left = (right - 1).clip(0)
    gap = np.minimum(np.abs(instants[right] - times), np.abs(times - instants[left]))
    near: NDArray[np.bool_] = gap <= reach
    return near


def _rows(trace: Trace, times: FloatArray) -> Trace:
    """Return the rows at these times, with all their micro-steps."""
    table = trace.sample(times).stops
    rows = table.at(np.isin(table.t, times))  # only these are observed
    return replace(trace, rows=rows, stops=rows, stored={})


def _lit(
    frames: list[Frame], log_t: FloatArray, entries: NDArray[np.intp], bright: int
) -> Iterator[Frame]:
    """Add the lit edges to the frames; an edge is bright for so many frames before it fades."""
    begun: dict[int, int] = {}
    waiting = list(map(int, entries))
    for number, frame in enumerate(frames):
        while waiting and (
            waiting[0] <= frame.entry if frame.entry >= 0 else log_t[waiting[0]] <= frame.t
        ):
            begun[waiting.pop(0)] = number
        lit = []
        for entry, first in list(begun.items()):
            brightness = min(1.0, 1.0 - (number - first - bright + 1) / (FADE + 1))
            if brightness > 0.0:
                lit.append((entry, brightness))
            else:
                del begun[entry]
        yield replace(frame, fired=tuple(lit))
