"""The values at a row or point of a branch, and why the edges of an element fire there or not."""

from __future__ import annotations

from collections.abc import Mapping

from gms_fsm.errors import SessionError
from gms_fsm.foundation.quantities import Scale
from gms_fsm.session.elements import chart_of, element_name, source_of
from gms_fsm.session.explain import Why, explain_state
from gms_fsm.session.results import BodyHere, ContactHere, Here
from gms_fsm.session.tree.branch import Branch
from gms_fsm.traces.scope import Scope


def here_at(branch: Branch, row: int) -> Here:
    """Return the values at a row, or at the located point after it, if the cursor is there."""
    place, start = branch.place(row), branch.start
    located = place is branch.between
    scope, system = branch.system_scope(place), start.system
    banks = start.program.layout.banks
    further = (*system.flow, *(name for each in system.sampled for name in each.updates))
    return Here(
        row,
        place.t,
        place.microstep,
        {
            bank.name: _contact(scope.contacts[bank.name], branch.scales(bank.name))
            for bank in banks
        },
        {body.name: BodyHere(scope.value(body.x), scope.value(body.v)) for body in system.bodies},
        {name: scope.value(name) for name in further},
        located,
        None if located else branch.fired(row),
        start.what.named,
    )


def _contact(scope: Scope, scales: Mapping[str, Scale]) -> ContactHere:
    chart = scope.model.chart
    more = chart.force_names  # the outputs of a supervisor
    if chart.velocities:
        more = (*chart.velocities[1:], *chart.force_names[1:])
    return ContactHere(
        scope.x,
        scope.v,
        scope.F,
        tuple(scope.z),
        tuple(scope.s),
        tuple(scope.each("F_elements")),
        tuple(scope.states),
        {name: scope.seen[name] for name in more},
        any(scope.seen.get(f"{force} shared", 0.0) for force in chart.force_names),
        scales,
    )


def why_at(branch: Branch, machine: int, edge: str) -> Why:
    """Explain the edges of an element at the cursor, or one of them."""
    start, row, place = branch.start, branch.cursor, branch.here
    bank = start.program.layout.bank(machine)
    chart, i = chart_of(start, bank), machine - bank.first
    state, left, taken = branch.state(place, machine), "", ""
    sources = source_of(edge, chart) if edge else ()
    fired = None if branch.between is not None else branch.fired(row)
    before = place
    contact = start.what.whose(bank.name)
    mine = fired is not None and (fired.contact, fired.element) == (contact, i)
    if fired and mine and (not edge or fired.source in sources):
        left, taken, before = fired.source, fired.edge, branch.raw(row - 1)
    source_state = left or state
    if edge and source_state not in sources:
        raise SessionError(
            f"{edge} leaves {' and '.join(sources)}",
            advice=f"{element_name(start, machine)} is in {state}",
        )
    tick = None if taken else branch.next_tick(machine)
    values = branch.scope(before, bank.name).guards(i)
    found = explain_state(chart, source_state, values, taken, tick)
    edges = tuple(each for each in found if edge in ("", each.edge.name))
    return Why(i, place.t, state, left, edges, branch.sigma(place), contact, tick)
