"""Breakpoints, at which `proceed` of a session stops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from gms_fsm.errors import SessionError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.run.problem import Problem
from gms_fsm.session._conditions import holds_at, read, seen_by
from gms_fsm.session.elements import chart_of, contact_named, machine_of, source_of
from gms_fsm.session.explain import holds
from gms_fsm.session.tree.branch import Branch

Kind = Literal["tested", "valid", "fires", "enter", "leave", "changes"]
KINDS: tuple[Kind, ...] = ("tested", "valid", "fires", "enter", "leave", "changes")


@dataclass
class Breakpoint:
    """A breakpoint, at which `Session.proceed` stops.

    Parameters
    ----------
    kind : {"tested", "valid", "fires", "enter", "leave", "changes"}
        Guard of an edge evaluated, guard becoming true, edge taken; state entered or left; a row
        at which an expression is not what it was at the row before.
    name : str
        Name of the edge or state; the expression, which is a number, a condition or ``state(2)``.
    element : int or None
        Element index, from 0; None for all elements.
    condition : str
        Additional condition that must hold; empty for none.
    hits : int
        Stop at this hit and at every later one.
    seen : int
        Number of hits so far.
    contact : str
        The contact, in a system; empty for all that have the edge or state.
    """

    kind: Kind
    name: str
    element: int | None = None
    condition: str = ""
    hits: int = 1
    seen: int = 0
    contact: str = ""


def new_breakpoint(
    start: Problem, kind: str, name: str, element: int | str | None, condition: str, hits: int
) -> Breakpoint:
    """Return a breakpoint; raise an error if one of its parts is invalid."""
    if kind not in KINDS:
        raise unknown("kind of breakpoint", kind, KINDS, SessionError)
    if kind == "changes":
        if element is not None:
            raise SessionError("an expression names its elements", advice="leave the element out")
        if not isinstance(name, str):
            raise SessionError("it must be a text", place="name", value=name)
        seen_by(start, name)
        return _counting(start, Breakpoint("changes", name, None, condition, hits))
    banks = start.program.layout.banks
    contact, index = "", None
    if isinstance(element, str) and element in [bank.name for bank in banks]:
        contact = contact_named(element, start).name
    elif element is not None:
        machine = machine_of(element, start)
        bank = start.program.layout.bank(machine)
        contact, index = start.what.whose(bank.name), machine - bank.first
    charts = [chart_of(start, bank) for bank in banks if contact in ("", bank.name)]
    edges = [edge.name for chart in charts for edge in chart.transitions]
    states = [path for chart in charts for path in chart.nesting.levels]
    known, what = (states, "state") if kind in ("enter", "leave") else (edges, "edge")
    if name not in known:
        error = unknown(what, name, known, SessionError)
        if name in edges + states:
            other, verb = ("an edge", "fires") if name in edges else ("a state", "enter")
            error = error.replaced(advice=f"{name} is {other}: break {verb} {name}")
        raise error
    return _counting(start, Breakpoint(kind, name, index, condition, hits, contact=contact))


def _counting(start: Problem, point: Breakpoint) -> Breakpoint:
    """Return a breakpoint; raise an error if its hits or its condition is invalid."""
    if point.hits < 1:
        raise SessionError(f"hits is {point.hits}", advice="it must be at least 1")
    if point.condition:
        read(start, point.condition)
    return point


def hitting(point: Breakpoint, branch: Branch) -> Callable[[int], bool]:
    """Return a function that says whether a breakpoint hits at a row."""
    start = branch.start
    condition = read(start, point.condition) if point.condition else None
    seen = seen_by(start, point.name) if point.kind == "changes" else None
    machines = _machines(point, start)

    def hits(row: int) -> bool:
        if seen is not None:
            if row == 0 or seen(branch, branch.raw(row - 1)) == seen(branch, branch.raw(row)):
                return False
        elif not any(_happens(point, branch, row, machine) for machine in machines):
            return False
        return condition is None or holds_at(condition, branch, branch.raw(row))

    return hits


def _machines(point: Breakpoint, start: Problem) -> list[int]:
    """Return the elements that a breakpoint watches, counted over all contacts."""
    found: list[int] = []
    for bank in start.program.layout.banks:
        if point.contact in ("", bank.name):
            elements = range(bank.n) if point.element is None else (point.element,)
            found += [bank.first + i for i in elements]
    return found


def _happens(point: Breakpoint, branch: Branch, row: int, machine: int) -> bool:
    """Return whether the event of a breakpoint happens to an element at a row."""
    start = branch.start
    bank = start.program.layout.bank(machine)
    chart, i = chart_of(start, bank), machine - bank.first
    if point.kind in ("fires", "enter", "leave"):
        fired = branch.fired(row)
        if fired is None or fired.element != i or fired.contact not in ("", bank.name):
            return False
        edge = next(each for _, each in chart.leaving(fired.source) if each.name == fired.edge)
        done = {"fires": "action", "enter": "entry", "leave": "exit"}[point.kind], point.name
        return done in edge.performs or done == ("action", edge.name)
    if point.name not in chart.guards:  # of another contact
        return False
    sources = source_of(point.name, chart)
    before, now = branch.raw(row - 1), branch.raw(row)
    if branch.state(now, machine) not in sources:
        return False
    if point.kind == "tested":
        if not branch.asked(row, machine):
            return False
        # The loop evaluates guards where an arc ends, and again after every firing. Whether this
        # was done at a row is known once the next row has been computed.
        if row + 1 >= len(branch):
            branch.pull()
        return row in branch.stops or now.microstep > 0
    guard = chart.guards[point.name]
    held = branch.state(before, machine) == branch.state(now, machine) and holds(
        guard, branch.scope(before, bank.name).guards(i)
    )
    return not held and holds(guard, branch.scope(now, bank.name).guards(i))
