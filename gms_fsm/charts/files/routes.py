"""States and edges as another program has them, nested as a chart nests them or flattened."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from gms_fsm.charts.parts import State
from gms_fsm.errors import ChartError
from gms_fsm.foundation.arguments import unknown

Route = tuple[str, ...]  # names of states, the outermost first
Assigned = Mapping[str, str]


@dataclass(frozen=True)
class ImportedState:
    """A state as another program has it; `first` is what is entered inside of one with parts.

    With a history it is entered only if nothing inside has been left before.
    """

    route: Route
    place: str
    entry: Assigned = field(default_factory=dict)
    exit: Assigned = field(default_factory=dict)
    first: Route | None = None
    history: bool = False


@dataclass(frozen=True)
class ImportedEdge:
    """An edge as another program has it.

    Parameters
    ----------
    trigger : str
        The event at which it is taken; it may be shared with other edges.
    source, target : tuple of str
        The states it leaves and enters; without a target nothing is left.
    place : str
        Where it is written, for messages.
    guard : str or None
        Its condition, if it has one.
    also : str or None
        A condition that holds beside whatever is given as guard.
    missing : str
        A condition whose text is not known.
    actions, before, after : mapping of str to str
        What it assigns; before anything is left, and after everything is entered.
    stays : int or None
        How many of the outer states it does not leave; None for those that what is active shares
        with the target.
    """

    trigger: str
    source: Route
    target: Route | None
    place: str
    guard: str | None = None
    also: str | None = None
    missing: str = ""
    actions: Assigned = field(default_factory=dict)
    before: Assigned = field(default_factory=dict)
    after: Assigned = field(default_factory=dict)
    stays: int | None = None

    @property
    def kind(self) -> tuple[object, ...]:
        """What edges that are given one guard have in common."""
        return self.target, self.guard, self.also, self.missing


@dataclass(frozen=True)
class FlatEdge:
    """An edge between states without parts.

    Parameters
    ----------
    number : int
        Of the imported edge.
    sources : tuple of str
        The states it leaves.
    target : str
        The state it enters.
    around : tuple of mapping
        What is assigned when outer states are left, and when others are entered.
    name : str
        Of the edge.
    """

    number: int
    sources: tuple[str, ...]
    target: str
    around: tuple[tuple[Assigned, ...], tuple[Assigned, ...]]
    name: str = ""


def spelled(route: Route) -> str:
    """Return the name of a state in the chart."""
    return "__".join(name for name in route if name)


def outwards(route: Route) -> list[Route]:
    """Return a state and those around it, the innermost first."""
    return [route[:k] for k in range(len(route), 0, -1)]


def routes(states: list[ImportedState]) -> list[Route]:
    """Return the routes of states."""
    return [each.route for each in states]


def nests(states: list[ImportedState], edges: list[ImportedEdge]) -> bool:
    """Return whether states are nested as a chart nests them; else they are flattened."""
    nested = [each for each in states if each.first is not None]
    return bool(nested) and all(
        [
            *(each.first is not None and each.first[:-1] == each.route for each in nested),
            *map(_is_plain, edges),
        ]
    )


def _check_no_history(states: list[ImportedState]) -> None:
    """Refuse histories where states are flattened, because an edge is none of a chart."""
    for each in states:
        if each.history:
            raise ChartError(
                "its history cannot be kept, because some edge is internal, or assigns before or "
                "after the states change",
                place=each.place,
                advice="write that edge as an external one, with its actions between exit and "
                "entry",
            )


def _is_plain(edge: ImportedEdge) -> bool:
    """Return whether an edge leaves and enters states as an edge of a chart does."""
    if edge.target is None or edge.before or edge.after:
        return False
    shorter = min(len(edge.source), len(edge.target))
    related = edge.source[:shorter] == edge.target[:shorter]
    return not related if edge.stays is None else edge.stays == outside(edge.source, edge.target)


def written(edges: list[ImportedEdge]) -> list[FlatEdge]:
    """Return the edges as a chart of nested states has them."""
    return [
        FlatEdge(number, (spelled(edge.source),), spelled(edge.target or ()), ((), ()))
        for number, edge in enumerate(edges)
    ]


def tree(
    states: list[ImportedState],
    first: Route,
    around: Route,
    texts: Mapping[str, Mapping[str, Assigned]],
    locked: Collection[str],
) -> tuple[State, ...]:
    """Return the states in a state, or of the whole chart; that the default one is first."""
    own = [each for each in states if each.route[:-1] == around]
    if not around:
        own.sort(key=lambda each: each.route[:1] != first[:1])
    return tuple(
        State(
            each.route[-1],
            flow=texts["flows"].get(spelled(each.route), {}),
            entry=each.entry,
            exit=each.exit,
            outputs=texts["state_outputs"].get(spelled(each.route), {}),
            locked=spelled(each.route) in locked,
            states=tree(states, first, each.route, texts, locked),
            initial=each.first[-1] if each.first else "",
            history=each.history,
        )
        for each in own
    )


def flat_states(
    leaves: list[ImportedState],
    texts: Mapping[str, Mapping[str, Assigned]],
    locked: Collection[str],
) -> tuple[State, ...]:
    """Return the states without parts, with what those around them have."""
    return tuple(
        State(
            spelled(each.route),
            flow=inherited(texts["flows"], each.route),
            entry=each.entry,
            exit=each.exit,
            outputs=inherited(texts["state_outputs"], each.route),
            locked=any(spelled(outer) in locked for outer in outwards(each.route)),
        )
        for each in leaves
    )


def outside(source: Route, target: Route) -> int:
    """Return how many states around both there are."""
    pairs = zip(source[:-1], target[:-1], strict=False)
    return len([*itertools.takewhile(lambda pair: pair[0] == pair[1], pairs)])


def inherited(texts: Mapping[str, Assigned], route: Route) -> dict[str, str]:
    """Return the texts of a state over those of the states around it."""
    found: dict[str, str] = {}
    for outer in reversed(outwards(route)):
        found |= texts.get(spelled(outer), {})
    return found


def flattened(
    states: list[ImportedState], first: Route, edges: list[ImportedEdge]
) -> tuple[list[ImportedState], list[FlatEdge], list[ImportedState]]:
    """Return the states without parts, the default one first, and all edges between them.

    Edges of inner states go before those of outer ones. The third list has the states around the
    default one, which are entered when the chart starts.
    """
    _check_no_history(states)
    by_route = {each.route: each for each in states}

    def inside(route: Route) -> Route:
        state = by_route[route]
        if state.first is None:
            return route
        if state.first not in by_route or state.first[: len(route)] != route:
            raise ChartError(
                f"its initial state {spelled(state.first)!r} is not inside of it",
                place=state.place,
            )
        return inside(state.first)

    for edge in edges:
        for end, route in (("source", edge.source), ("target", edge.target)):
            if route is not None and route not in by_route:
                raise unknown(
                    end, spelled(route), map(spelled, by_route), ChartError, place=edge.place
                )

    default = inside(first)
    leaves = [each for each in states if each.first is None]
    leaves.sort(key=lambda each: each.route != default)
    rows: list[FlatEdge] = []
    for number, edge in sorted(enumerate(edges), key=lambda each: -len(each[1].source)):
        for leaf in leaves:
            if leaf.route[: len(edge.source)] != edge.source:
                continue
            source = leaf.route
            target = source if edge.target is None else inside(edge.target)
            kept = len(source) - 1
            if edge.target is not None:
                kept = outside(source, edge.target) if edge.stays is None else edge.stays
            left = [by_route[each].exit for each in outwards(source[:-1]) if len(each) > kept]
            entered = [by_route[each].entry for each in outwards(target[:-1]) if len(each) > kept]
            around = tuple(filter(None, left)), tuple(filter(None, reversed(entered)))
            rows.append(FlatEdge(number, (spelled(source),), spelled(target), around))
    return leaves, rows, [by_route[each] for each in reversed(outwards(default[:-1]))]
