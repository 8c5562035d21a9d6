"""The values at a row or point of a branch, and why the edges of an element fire there or not."""

from __future__ import annotations

from gms_fsm.errors import SessionError
from gms_fsm.inspection._arguments import source_of
from gms_fsm.inspection._branch import Branch
from gms_fsm.inspection._results import Here
from gms_fsm.inspection.explain import Why, explain_state

__all__ = ["here_at", "why_at"]


def here_at(branch: Branch, row: int) -> Here:
    """Return the values at a row, or at the located point after it, if the cursor is there."""
    place = branch.place(row)
    located = place is branch.between
    scope = branch.scope(place)
    return Here(
        row,
        place.t,
        place.microstep,
        scope.x,
        scope.v,
        scope.F,
        tuple(scope.z),
        tuple(scope.s),
        tuple(scope.each("F_elements")),
        tuple(scope.states),
        located,
        None if located else branch.fired(row),
    )


def why_at(branch: Branch, element: int, edge: str) -> Why:
    """Explain the edges of an element at the cursor, or one of them.

    Parameters
    ----------
    branch : Branch
        The current branch.
    element : int
        Element index, from 0.
    edge : str
        Name of the edge; empty for all.

    Returns
    -------
    Why
        On a row where the element fired, edges of the state it left, with the values before.

    Raises
    ------
    SessionError
        If there is no such edge, or it leaves a different state.
    """
    chart, row, place = branch.run.start.model.chart, branch.cursor, branch.here
    state, left, taken = branch.state(place, element), "", ""
    source = source_of(edge, chart) if edge else ""
    fired = None if branch.between is not None else branch.fired(row)
    before = place
    if fired and fired.element == element and source in ("", fired.source):
        left, taken, before = fired.source, fired.edge, branch.raw(row - 1)
    source_state = left or state
    if source not in ("", source_state):
        raise SessionError(f"{edge} leaves {source}", advice=f"element {element + 1} is in {state}")
    found = explain_state(chart, source_state, branch.scope(before).guards(element), taken)
    edges = tuple(each for each in found if edge in ("", each.edge.name))
    return Why(element, place.t, state, left, edges)
