"""The panel of active states: ribbons, as in a logic analyser."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Unpack

import numpy as np

from gms_fsm.traces.trace import Trace
from plots.panels.parts.axes import MANY, VECTOR_ROWS, Artists, lanes, time_axis
from plots.panels.parts.selection import PartOptions, selected
from plots.style import INK, state_look
from plots.style.matplotlib import Axes
from plots.style.presets import pt, to_scale
from plots.views.window import Window

__all__ = ["ribbons"]

LANE = 0.8  # height of a ribbon, in rows


def spans(trace: Trace, i: int, window: Window) -> Iterator[tuple[str, float, float]]:
    """Yield the states of element i as (name, begin, end) [s], read from the transition log."""
    log = trace.transitions[trace.transitions.element == i]
    first = log.source[0] if log.size else trace.model.chart.states[trace.modes[0, i]].name
    ends = np.clip(np.concatenate([[window[0]], log.t, [window[1]]]), *window)
    for name, begin, end in zip([first, *log.target], ends[:-1], ends[1:], strict=True):
        if end > begin:
            yield str(name), float(begin), float(end)


def ribbons(ax: Axes, trace: Trace, **part: Unpack[PartOptions]) -> Artists:
    """Draw the active state of every element as a ribbon, as in a logic analyser.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run of a contact or of a supervisor.
    **part
        ``window`` and ``elements``.

    Returns
    -------
    list of Artist
        One collection per state and element, for a legend of the states that occur; then a band for
        each interval in which a sign is held, for example on v = 0, or in which an element is
        between two states.
    """
    this = selected(trace, **part, moving=False)
    chosen, (begin, end) = this.elements, this.window
    states = [state.name for state in trace.model.chart.states]
    # Between many narrow rows there is no room for thicker outlines.
    sized = to_scale if len(chosen) <= MANY else dict
    looks: list[dict[str, Any]] = [sized(state_look(number)) for number in range(len(states))]
    drawn: Artists = []
    found = [list(spans(trace, i, (begin, end))) for i in chosen]
    occurring = {name for each in found for name, _, _ in each}
    for row, each in enumerate(found):
        for number, state in enumerate(states):
            mine = [(a, b - a) for name, a, b in each if name == state]
            look = looks[number] | {"label": state if row == 0 and state in occurring else None}
            look["rasterized"] = len(mine) > VECTOR_ROWS // 20
            drawn.append(ax.broken_barh(mine, (row + 1.0 - LANE / 2, LANE), **look))
    lanes(ax, chosen)
    time_axis(ax, begin, end)
    return [*drawn, *_held_bands(ax, trace, chosen, (begin, end))]


def _held_bands(ax: Axes, trace: Trace, chosen: Sequence[int], window: Window) -> Artists:
    """Mark the intervals on a surface, of an element between two states in its row only.

    If only microseconds long, they appear as a line.
    """
    drawn: dict[str, Artists] = {}
    names, machines = trace.program.surface_names, trace.program.surfaces.machine
    first, last = ax.get_ylim()
    look: Any = {"facecolor": "none", "edgecolor": INK, "hatch": "xxx", "zorder": 3}
    look["linewidth"] = pt(0.8)
    for stretch in trace.sliding:
        begin, end = max(window[0], float(stretch.t_start)), min(window[1], float(stretch.t_end))
        machine, low, high = machines[names.index(stretch.surface)], 0.0, 1.0
        if machine >= 0:
            element = machine - trace.places.first
            if element not in chosen:
                continue
            row = [*chosen].index(element) + 1.0
            ends = [(row + side * LANE / 2 - first) / (last - first) for side in (-1.0, 1.0)]
            low, high = min(ends), max(ends)
        if begin <= end:
            label = f"held on {stretch.surface} = 0"
            band = ax.axvspan(begin, end, low, high, label="" if label in drawn else label, **look)
            drawn.setdefault(label, []).append(band)
    return [band for bands in drawn.values() for band in bands]
