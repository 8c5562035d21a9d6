"""Breakpoints, at which `proceed` of a session stops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import SessionError
from gms_fsm.inspection._arguments import source_of
from gms_fsm.inspection._branch import Branch
from gms_fsm.inspection._conditions import holds_at, read
from gms_fsm.inspection.explain import holds
from gms_fsm.systems.models import Model

__all__ = ["KINDS", "Breakpoint", "hits", "new_breakpoint"]

Kind = Literal["tested", "valid", "fires", "enter", "leave"]
KINDS: tuple[Kind, ...] = ("tested", "valid", "fires", "enter", "leave")


@dataclass
class Breakpoint:
    """A breakpoint, at which `Session.proceed` stops.

    Parameters
    ----------
    kind : {"tested", "valid", "fires", "enter", "leave"}
        Guard of an edge evaluated, guard becoming true, edge taken; state entered or left.
    name : str
        Name of the edge or state.
    element : int or None
        Element index, from 0; None for all elements.
    condition : str
        Additional condition that must hold; empty for none.
    hits : int
        Stop at this hit and at every later one.
    seen : int
        Number of hits so far.
    """

    kind: Kind
    name: str
    element: int | None = None
    condition: str = ""
    hits: int = 1
    seen: int = 0


def new_breakpoint(
    chart: Chart, kind: str, name: str, element: int | None, condition: str, hits: int
) -> Breakpoint:
    """Return a breakpoint; raise `SessionError` if kind, name or hits is invalid."""
    if kind not in KINDS:
        raise SessionError(
            f"unknown breakpoint kind {kind!r}", advice=f"it must be one of {', '.join(KINDS)}"
        )
    edges, states = [e.name for e in chart.transitions], [s.name for s in chart.states]
    known, what = (states, "state") if kind in ("enter", "leave") else (edges, "edge")
    if name not in known:
        raise SessionError(f"no {what} {name!r}", advice=f"there are {', '.join(known) or 'none'}")
    if hits < 1:
        raise SessionError(f"hits is {hits}", advice="it must be at least 1")
    return Breakpoint(kind, name, element, condition, hits)


def hits(point: Breakpoint, model: Model, branch: Branch, row: int) -> bool:
    """Return whether a breakpoint hits at a row.

    Parameters
    ----------
    point : Breakpoint
        The breakpoint.
    model : Model
        The simulated model.
    branch : Branch
        The current branch.
    row : int
        Row number, at least 1.

    Returns
    -------
    bool
        Whether the event happens and the condition holds.
    """
    elements = range(model.n) if point.element is None else (point.element,)
    if not any(_happens(point, model.chart, branch, row, i) for i in elements):
        return False
    return not point.condition or holds_at(read(model, point.condition), branch, branch.raw(row))


def _happens(point: Breakpoint, chart: Chart, branch: Branch, row: int, element: int) -> bool:
    """Return whether the event of a breakpoint happens to an element at a row."""
    if point.kind in ("fires", "enter", "leave"):
        fired = branch.fired(row)
        if fired is None or fired.element != element:
            return False
        names = {"fires": fired.edge, "enter": fired.target, "leave": fired.source}
        return names[point.kind] == point.name
    source = source_of(point.name, chart)
    before, now = branch.raw(row - 1), branch.raw(row)
    if branch.state(now, element) != source:
        return False
    if point.kind == "tested":
        # The loop evaluates guards where an arc ends, and again after every firing. Whether this
        # was done at a row is known once the next row has been computed.
        if row + 1 >= len(branch):
            branch.pull()
        return row in branch.stops or now.microstep > 0
    guard = chart.guards[point.name]
    held = branch.state(before, element) == source and holds(
        guard, branch.scope(before).guards(element)
    )
    return not held and holds(guard, branch.scope(now).guards(element))
