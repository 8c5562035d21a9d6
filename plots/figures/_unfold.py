"""The figure of micro-steps: a cascade unfolded into columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gms_fsm.foundation.arguments import refusing
from gms_fsm.traces.trace import Trace
from plots import panels
from plots.figures._layout import fitted, low, sheet
from plots.figures._parts import head
from plots.panels.micro_steps.unfolding import (
    FEW,
    LETTER,
    LINE,
    column_width,
    edge_texts,
    fired_look,
    time_texts,
)
from plots.panels.parts.selection import scaled
from plots.style import state_look
from plots.style.matplotlib import Figure, Rectangle, rc_context
from plots.style.presets import inches, room, settings, to_scale

COLUMN, NARROWEST, WIDEST, SIDES = 1.15, 6.4, 11.6, 1.0  # inches: a column, the figure, margins
FORCE, ROW, FLATTEST = 2.3, 0.34, 0.22  # inches: the upper panel, a row of the lower one
TOP, BELOW = 0.82, 1.0  # inches: above and below the panels
FIRED = "has fired"
HEAD = 0.55  # inches: the title alone


@refusing()
def unfold(
    trace: Trace,
    t0: float,
    t1: float,
    *,
    elements: Sequence[int] | None = None,
    title: str = "",
) -> Figure:
    """Draw the micro-steps in a time interval in equal columns, however short they are.

    Every instant with transitions takes one column before the first firing and one after each.
    Above, F as stairs with the values before and after each firing; below, the state of every
    element, with a frame around the one that fired and the name of the edge.

    Parameters
    ----------
    trace : Trace
        The run; of a system with several contacts, ``trace.contact(name)``.
    t0, t1 : float
        The interval, s; both ends belong to it.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        Between instants, time is cut out; its length is written below. On a slide there is no room
        for F.

    Raises
    ------
    ParameterError
        If nothing fires in the interval, or there are more than 24 columns; the message says which
        interval to choose.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> from plots.figures import unfold
    >>> run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
    >>> force, states = unfold(run, 1.9, 2.1).axes  # four break-aways at t = 2 s
    >>> [label.get_text() for label in states.get_xticklabels()]
    ['0', '1', '2', '3', '4']
    """
    part = panels.unfolded(trace, t0, t1, elements=elements)
    count = len(part.elements)
    wide = room(min(max(NARROWEST, SIDES + COLUMN * part.width), WIDEST))
    column = column_width(inches(wide - SIDES), part)
    _, _, head_room = edge_texts(part, column)
    _, upright, times_room = time_texts(part, column)
    tall = count * (ROW if count <= FEW and not low() else FLATTEST)
    above = (HEAD if low() else TOP + FORCE) + 0.45 + head_room
    names = [state.name for state in trace.model.chart.states]
    shown = sorted({mode for each in part.columns for mode in each.modes})
    entry = 0.75 + LETTER * max(map(len, [FIRED, *(names[mode] for mode in shown)]))  # inches
    columns = int(np.clip((wide - 0.2) / entry, 1, 6))
    rows = -(-(len(shown) + 1) // columns)
    below = BELOW + (times_room - LINE if upright else 0.0) + 1.3 * LINE * (rows - 1)
    height = above + tall + below
    with rc_context(settings()):
        figure = sheet(wide, height, layout=None, grows=True)
        height = figure.get_figheight() / inches(1)
        tall = height - above - below
        left, broad = (SIDES - 0.15) / wide, 1 - SIDES / wide
        letters = iter("ab")
        if not low():
            force = figure.add_axes((left, 1 - (TOP + FORCE) / height, broad, FORCE / height))
            panels.unfolded_force(force, part)
            panels.lettered(force, next(letters), "$F$ before and after each firing")
        states = figure.add_axes((left, below / height, broad, tall / height))
        panels.unfolded_states(states, part)
        up = inches(72 * (head_room + 0.12))  # points
        panels.lettered(states, next(letters), "who fires, and by which edge", pad=up)
        handles = [_swatch(mode, names[mode]) for mode in shown]
        handles.append(Rectangle((0, 0), 1, 1, label=FIRED, **fired_look()))
        figure.legend(handles=handles, loc="lower left", ncols=columns)
        title = f"{head(trace, title)}\n{_said(part)}"
        figure.suptitle(title, x=0.2 / wide, y=1 - 0.12 / height, ha="left", va="top")
    return fitted(figure)


def _swatch(mode: int, name: str) -> Rectangle:
    return Rectangle((0, 0), 1, 1, label=name, **to_scale(state_look(mode)))


def _said(part: panels.Unfolded) -> str:
    """Return how many transitions there are, and in what time."""
    count, took = part.log.size, float(part.times[-1] - part.times[0])
    number = "one transition" if count == 1 else f"{count} transitions"
    if took == 0.0:
        return f"{number} at t = {part.times[0]:.9g} s"
    factor, unit = scaled(np.array([took]), "s")
    return f"{number} in {factor * took:.4g} {unit}"
