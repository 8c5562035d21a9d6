"""Reads states, edges and their order from a machine of the package `transitions`."""

from __future__ import annotations

from typing import Any

from transitions import Machine
from transitions.extensions.asyncio import AsyncMachine
from transitions.extensions.nesting import HierarchicalMachine

from gms_fsm.charts.files.imported import ImportedEdge
from gms_fsm.errors import ChartError

HERE = "transitions machine"
KINDS = {HierarchicalMachine: "its states can nest", AsyncMachine: "its callbacks are awaited"}
MACHINE_CALLBACKS = (
    "before_state_change",
    "after_state_change",
    "prepare_event",
    "finalize_event",
    "on_exception",
    "on_final",
)


def read(machine: object) -> tuple[list[str], list[ImportedEdge]]:
    """Return the states, the default state first, and the edges in the order of their priority."""
    if not isinstance(machine, Machine):
        raise ChartError("it must be a transitions.Machine", place="machine", value=machine)
    _check_machine(machine)
    names = [_state(state) for state in machine.states.values()]
    initial = machine.initial
    first = str(getattr(initial, "name", initial))
    if first not in names:
        raise ChartError(
            "it has no initial state", place=HERE, advice="give one, Machine(..., initial='stick')"
        )
    names.sort(key=lambda name: name != first)
    edges = [
        _edge(trigger, event)
        for trigger, event in machine.events.items()
        if not (machine.auto_transitions and _is_automatic(trigger, names))
    ]
    return names, edges


def _is_automatic(trigger: str, states: list[str]) -> bool:
    """Return whether a machine made a trigger by itself: it leads from anywhere to a state."""
    return trigger.startswith("to_") and trigger.removeprefix("to_") in states


def _check_machine(machine: Any) -> None:
    for kind, why in KINDS.items():
        if isinstance(machine, kind):
            raise ChartError(
                f"a {type(machine).__name__} has no counterpart in a chart: {why}",
                place=HERE,
                advice="write one state for each combination, in a plain Machine",
            )
    if machine.has_queue:
        raise ChartError(
            "queued=True has no counterpart in a chart: there every trigger returns True",
            place=HERE,
            advice="leave it out",
        )
    for name in MACHINE_CALLBACKS:
        _no_callbacks(getattr(machine, name), name, HERE, "a chart calls nothing; leave it out")


def _state(state: Any) -> str:
    name, place = str(state.name), f"{HERE}, state {state.name!r}"
    for kind, keyword in (("on_enter", "entry"), ("on_exit", "exit")):
        _no_callbacks(
            getattr(state, kind),
            kind,
            place,
            f"give what it assigns as text, {keyword}={{{name!r}: {{'z': '0'}}}}, and remove it",
        )
    if getattr(state, "timeout", 0):
        raise ChartError(
            f"its timeout of {state.timeout!r} s has no counterpart in a chart",
            place=place,
            advice="write an edge with the guard 'after(T)'",
        )
    if hasattr(state, "volatile_cls"):
        raise ChartError("a volatile state has no counterpart in a chart", place=place)
    if state.final:
        raise ChartError(
            "a final state has no counterpart in a chart: friction does not end",
            place=place,
            advice="leave final=True out",
        )
    return name


def _edge(trigger: str, event: Any) -> ImportedEdge:
    place = f"{HERE}, trigger {trigger!r}"
    rows = [row for each in event.transitions.values() for row in each]
    for row in rows:
        if row.dest is None:
            raise ChartError(
                f"its internal transition in {row.source!r} has no counterpart in a chart",
                place=place,
                advice="write a transition from the state to itself",
            )
        for kind in ("prepare", "before", "after"):
            _no_callbacks(
                getattr(row, kind),
                kind,
                place,
                f"give what it assigns as text, actions={{{trigger!r}: {{'z': '0'}}}}, and "
                "remove it",
            )
        if not all(condition.target for condition in row.conditions):
            raise ChartError(
                "unless has no counterpart in a chart",
                place=place,
                advice=f"write it into the guard, guards={{{trigger!r}: 'not (...)'}}",
            )
    sources = tuple(str(row.source) for row in rows)
    targets = {str(row.dest) for row in rows}
    if len(targets) != 1 or len(set(sources)) != len(sources):
        edges = ", ".join(f"{row.source} -> {row.dest}" for row in rows)
        raise ChartError(
            f"it stands for several edges ({edges})",
            place=place,
            advice="give each edge a trigger of its own, which is its name in the chart",
        )
    return ImportedEdge(trigger, sources, targets.pop(), place)


def _no_callbacks(given: list[Any], kind: str, place: str, advice: str) -> None:
    if given:
        called = getattr(given[0], "__name__", str(given[0]))
        raise ChartError(
            f"its callback {kind} {called!r} has no counterpart in a chart",
            place=place,
            advice=advice,
        )
