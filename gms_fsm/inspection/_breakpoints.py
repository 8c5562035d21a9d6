"""Breakpoints: where a session's `proceed` stops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import SessionError
from gms_fsm.inspection._asked import source_of
from gms_fsm.inspection._branch import Branch
from gms_fsm.inspection._conditions import holds_at, read
from gms_fsm.inspection.explain import holds
from gms_fsm.systems.models import Model

__all__ = ["KINDS", "Breakpoint", "hits", "new_breakpoint"]

Kind = Literal["tested", "valid", "fires", "enter", "leave"]
KINDS: tuple[Kind, ...] = ("tested", "valid", "fires", "enter", "leave")


@dataclass
class Breakpoint:
    """Where `Session.proceed` stops.

    Parameters
    ----------
    kind : {"tested", "valid", "fires", "enter", "leave"}
        Guard of an edge asked, guard becoming true, edge taken; state entered or left.
    name : str
        The edge's or the state's name.
    element : int or None
        Counted from 0; None for all.
    condition : str
        Must hold too; empty for none.
    hits : int
        Stop at this hit, and at every one after it.
    seen : int
        Hits so far.
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
    """Return a breakpoint; raise a `SessionError` if kind, name or hits do not exist."""
    if kind not in KINDS:
        raise SessionError(
            f"breakpoint kind {kind!r}", advice=f"it must be one of {', '.join(KINDS)}"
        )
    edges, states = [e.name for e in chart.transitions], [s.name for s in chart.states]
    known, what = (states, "state") if kind in ("enter", "leave") else (edges, "edge")
    if name not in known:
        raise SessionError(f"no {what} {name!r}", advice=f"there are {', '.join(known) or 'none'}")
    if hits < 1:
        raise SessionError(f"hits is {hits}", advice="it must be at least 1")
    return Breakpoint(kind, name, element, condition, hits)


def hits(point: Breakpoint, model: Model, branch: Branch, row: int) -> bool:
    """Tell whether a breakpoint hits at a row.

    Parameters
    ----------
    point : Breakpoint
        What is waited for.
    model : Model
        What runs.
    branch : Branch
        What is walked.
    row : int
        Not the first.

    Returns
    -------
    bool
        Whether it happens, and the condition holds.
    """
    elements = range(model.n) if point.element is None else (point.element,)
    if not any(_happens(point, model.chart, branch, row, i) for i in elements):
        return False
    return not point.condition or holds_at(read(model, point.condition), branch, branch.raw(row))


def _happens(point: Breakpoint, chart: Chart, branch: Branch, row: int, element: int) -> bool:
    """Tell whether what a breakpoint waits for happens to an element at a row."""
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
        # The driver asks where an arc ends, and again after every firing. That a row was
        # such a place is known when the next one is computed.
        if row + 1 >= len(branch):
            branch.pull()
        return row in branch.stops or now.microstep > 0
    guard = chart.guards[point.name]
    held = branch.state(before, element) == source and holds(
        guard, branch.scope(before).guards(element)
    )
    return not held and holds(guard, branch.scope(now).guards(element))
