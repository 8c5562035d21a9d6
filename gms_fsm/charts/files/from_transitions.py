"""Reads states, edges and their order from a machine of the package `transitions`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from transitions import Machine
from transitions.extensions.asyncio import AsyncMachine
from transitions.extensions.states import Error

from gms_fsm.charts.files.imported import all_of, joined
from gms_fsm.charts.files.routes import Assigned, ImportedEdge, ImportedState, Route, spelled
from gms_fsm.errors import ChartError
from gms_fsm.foundation.arguments import unknown

HERE = "transitions machine"
# What does not run when a transition is taken, or not only then: it may not assign.
LOOKING = ("prepare_event", "finalize_event", "on_exception", "on_final")


class Callbacks:
    """What the functions of a machine say, given as texts by their names."""

    def __init__(self, given: object) -> None:
        if not isinstance(given, Mapping):
            raise ChartError(
                "it gives for each function what it says, for example {'is_hot': 'T > 80', "
                "'count': {'n': 'n + 1'}}",
                place=f"{HERE}: callbacks",
                value=given,
            )
        self.given, self.known = given, dict[str, None]()

    def actions(self, functions: list[Any], kind: str, place: str) -> Assigned:
        """Return what callbacks assign, one after the other."""
        found = []
        for each in functions:
            name = self._name(each)
            text = self.given.get(name)
            if not isinstance(text, Mapping):
                raise ChartError(
                    f"its callback {kind} {name!r} has no text",
                    place=place,
                    advice=f"give what it assigns, callbacks={{{name!r}: {{'z': '0'}}}}; {{}} for "
                    "one that only looks on",
                )
            found.append(text)
        return joined(found, place)

    def nothing(self, functions: list[Any], kind: str, place: str) -> None:
        """Refuse callbacks that assign."""
        if self.actions(functions, kind, place):
            raise ChartError(
                f"its callback {kind} {self._name(functions[0])!r} has no counterpart in a "
                "chart: it runs without a transition, too",
                place=place,
                advice="assign it in states or transitions",
            )

    def guard(self, conditions: list[Any], place: str) -> tuple[str | None, str]:
        """Return conditions as one text, and the name of one whose text is not given."""
        found = []
        for each in conditions:
            name = self._name(each.func)
            text = self.given.get(name)
            if text is None:
                return None, name
            if not isinstance(text, str):
                raise ChartError(
                    f"callbacks[{name!r}] is {text!r}", place=place, advice="a condition is a text"
                )
            found.append(text if each.target else f"not ({text})")
        return (all_of(found) if found else None), ""

    def check_all_known(self) -> None:
        """Refuse texts for functions that the machine does not have."""
        for name in self.given:
            if name not in self.known:
                raise unknown("function", name, self.known, ChartError, place=f"{HERE}: callbacks")

    def _name(self, function: Any) -> str:
        name = function if isinstance(function, str) else getattr(function, "__name__", "")
        self.known[name or repr(function)] = None
        return name or repr(function)


def read(
    machine: object, callbacks: object
) -> tuple[list[ImportedState], Route, list[ImportedEdge]]:
    """Return the states, the initial one, and the edges in the order of their priority."""
    if not isinstance(machine, Machine):
        raise ChartError("it must be a transitions.Machine", place="machine", value=machine)
    if isinstance(machine, AsyncMachine):
        raise ChartError(
            f"an {type(machine).__name__} has no counterpart in a chart: its callbacks are awaited",
            place=HERE,
            advice="write it as a machine without Async",
        )
    reader = _MachineReader(machine, Callbacks({} if callbacks is None else callbacks))
    for name in LOOKING:
        reader.callbacks.nothing(getattr(machine, name), name, HERE)
    states = [*reader.states(machine, ())]
    edges = [*reader.edges(machine, (), states)]
    first = _only_name(machine.initial, HERE)
    if first is None or reader.route(first) not in [each.route for each in states]:
        raise ChartError(
            "it has no initial state", place=HERE, advice="give one, Machine(..., initial='stick')"
        )
    start = reader.route(first)
    entered = {start, *(edge.target for edge in edges), *(state.first for state in states)}
    reader.check_timers(edges)
    reader.callbacks.check_all_known()
    return [*_rested(states, entered)], start, edges


def _rested(states: list[ImportedState], entered: set[Route | None]) -> Iterator[ImportedState]:
    """Yield the states; one in which a machine can rest, beside its parts, has a part for that."""
    for state in states:
        resting = (*state.route, "")
        if state.first != resting:
            yield state
        elif state.route in entered:
            yield state
            yield ImportedState(resting, state.place)
        else:
            yield replace(state, first=())


def _only_name(initial: Any, place: str) -> str | None:
    """Return the name of the one state in which something starts."""
    several = initial if isinstance(initial, list) else [initial]
    if len(several) != 1:
        names = ", ".join(str(_only_name(each, place)) for each in several)
        raise ChartError(
            f"it starts in several states at once ({names}), and a chart has one active state",
            place=place,
            advice="write one state for each combination",
        )
    (one,) = several
    return None if one is None else str(getattr(one, "name", one))


class _MachineReader:
    """Reads a machine, with the states in its states."""

    def __init__(self, machine: Any, callbacks: Callbacks) -> None:
        self.machine, self.callbacks = machine, callbacks
        self.separator = getattr(machine.state_cls, "separator", None)
        self.timers: dict[tuple[Route, tuple[Any, ...]], float] = {}  # by what they call
        self.before, self.after = (
            callbacks.actions(getattr(machine, name), name, HERE)
            for name in ("before_state_change", "after_state_change")
        )

    def route(self, name: str) -> Route:
        """Return where a name leads."""
        return tuple(name.split(self.separator)) if self.separator else (name,)

    def states(self, owner: Any, around: Route) -> Iterator[ImportedState]:
        """Yield the states of a machine or of a state, each before its parts."""
        for key, state in owner.states.items():
            name = str(getattr(key, "name", key))
            route = (*around, name)
            place = f"{HERE}, state {spelled(route)!r}"
            entry = self.callbacks.actions(state.on_enter, "on_enter", place)
            exit_ = self.callbacks.actions(state.on_exit, "on_exit", place)
            if getattr(state, "timeout", 0):
                self.timers[route, tuple(state.on_timeout)] = state.timeout
            if hasattr(state, "volatile_cls"):
                raise ChartError("a volatile state has no counterpart in a chart", place=place)
            accepted = getattr(state, "is_accepted", False) or self.left(route)
            if isinstance(state, Error) and not accepted:
                raise ChartError("an error state has no counterpart in a chart", place=place)
            self.callbacks.nothing(getattr(state, "on_final", []), "on_final", place)
            inner = getattr(state, "states", {})
            first = None
            if inner:
                begins = _only_name(state.initial, place)
                # Without one, a machine can rest in the state itself.
                first = (*route, *self.route(begins)) if begins else (*route, "")
            yield ImportedState(route, place, entry, exit_, first)
            if inner:
                yield from self.states(state, route)

    def left(self, route: Route) -> bool:
        """Return whether an edge leaves a state."""
        return bool(self.machine.get_triggers((self.separator or "").join(route)))

    def check_timers(self, edges: list[ImportedEdge]) -> None:
        """Refuse timeouts that do more than to trigger an edge out of their state."""
        for (route, called), seconds in self.timers.items():
            waiting = [each for each in edges if (each.source, (each.trigger,)) == (route, called)]
            if not waiting or any(each.also or each.missing for each in waiting):
                raise ChartError(
                    f"its timeout of {seconds!r} s has no counterpart in a chart",
                    place=f"{HERE}, state {spelled(route)!r}",
                    advice="let it call a trigger that leaves the state without conditions, or "
                    "write an edge with the guard 'after(T)'",
                )

    def edges(
        self, owner: Any, around: Route, states: list[ImportedState]
    ) -> Iterator[ImportedEdge]:
        """Yield the edges of a machine, and those that its states have for their own parts."""
        names = [(self.separator or "").join(each.route) for each in states]
        for trigger, event in owner.events.items():
            made = trigger.startswith("to_") and trigger.removeprefix("to_") in names
            if self.machine.auto_transitions and made:
                continue  # by the machine itself: from anywhere to a state
            for rows in event.transitions.values():
                for row in rows:
                    yield self.edge(str(trigger), row, around)
        for key, state in owner.states.items():
            if getattr(state, "states", {}):
                name = str(getattr(key, "name", key))
                yield from self.edges(state, (*around, name), states)

    def edge(self, trigger: str, row: Any, around: Route) -> ImportedEdge:
        """Return a transition."""
        place = f"{HERE}, trigger {trigger!r}"
        source = (*around, *self.route(str(row.source)))
        target = None if row.dest is None else (*around, *self.route(str(row.dest)))
        self.callbacks.nothing(row.prepare, "prepare", place)
        before = self.callbacks.actions(row.before, "before", place)
        after = self.callbacks.actions(row.after, "after", place)
        also, missing = self.callbacks.guard(row.conditions, place)
        seconds = self.timers.get((source, (trigger,)))
        return ImportedEdge(
            trigger,
            source,
            target,
            place,
            None if seconds is None else f"after({seconds!r})",
            also=also,
            missing=missing,
            before=joined((self.before, before), place),
            after=joined((after, self.after), place),
        )
