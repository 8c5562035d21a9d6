"""The paper's plain form: guards are looked at once a step, then all flows take one Euler step.

It is what ``simulate(..., method="euler", events="step")`` computes, as a list of statements that
printers of languages write down in this order.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TypeAlias

from gms_fsm.exporters._element import Element
from gms_fsm.exporters._element_parts import Leaving, Let
from gms_fsm.language import Binary, Name, Node, Value

__all__ = ["ByState", "Declare", "Enter", "Guards", "Plain", "Set", "Statement", "plain_form"]


@dataclass(frozen=True)
class Set:
    """An assignment; `new` if it declares the name, which is then never changed."""

    name: str
    tree: Value
    note: str = ""
    new: bool = False


@dataclass(frozen=True)
class Declare:
    """Names that the branches after it assign."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class Enter:
    """The element's next state; a friction of one state has none of these."""

    state: int


@dataclass(frozen=True)
class Guards:
    """The edges that leave a state: what the first one does whose guard holds."""

    edges: tuple[tuple[Leaving, tuple[Statement, ...]], ...]


@dataclass(frozen=True)
class ByState:
    """One list of statements for each state."""

    branches: tuple[tuple[Statement, ...], ...]


Statement: TypeAlias = "Set | Declare | Enter | Guards | ByState"


@dataclass(frozen=True, eq=False)
class Plain:
    """A step of the plain form.

    Parameters
    ----------
    element : Element
        Of which friction.
    dt, force, part : str
        Names of the step, of the sum of the elements' forces, and of an element's force.
    shared : tuple of Set
        What all elements read.
    guards, flows : tuple of Statement
        For each element, in this order.
    updates : tuple of Set
        Each variable after the step.
    trees : tuple of Node
        All that is computed.
    """

    element: Element
    dt: str
    force: str
    part: str
    shared: tuple[Set, ...]
    guards: tuple[Statement, ...]
    flows: tuple[Statement, ...]
    updates: tuple[Set, ...]
    trees: tuple[Node, ...] = field(repr=False)


def plain_form(element: Element, dt: str = "dt") -> Plain:
    """Return the plain form of a friction.

    Parameters
    ----------
    element : Element
        The friction.
    dt : str
        What the step is called, unless the friction uses that name.

    Returns
    -------
    Plain
        For a printer.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> from gms_fsm.exporters._subject import Subject
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> form = plain_form(Element.of(Subject.of(model, "c99"), ()))
    >>> [each.name for each in form.shared], [each.name for each in form.updates]
    (['stribeck'], ['z'])
    """
    dt, part = element.free(dt), element.free("F_i")
    states = element.states
    guard_reads = [each.guard_names for each in states]
    flow_reads = [each.flow_names for each in states]
    every = frozenset[str]().union(*guard_reads, *flow_reads, element.total.names)
    steady = [each for each in element.needed(every, per_element=True) if not each.moves]
    guards: list[Statement] = [_let(each) for each in steady]
    first, inside = element.placed(guard_reads, moves=True)
    guards += map(_let, first)
    branches: list[tuple[Statement, ...]] = []
    for state, lets in zip(states, inside, strict=True):
        chain = Guards(tuple((edge, _taken(edge, len(states) > 1)) for edge in state.edges))
        branches.append((*map(_let, lets), chain) if state.edges else ())
    guards += [ByState(tuple(branches))] if any(branches) else []
    first, inside = element.placed(flow_reads, moves=True)
    same = len({state.force.tree for state in states}) == 1
    rates = tuple(each.rate for each in element.variables)
    flows: list[Statement] = [*map(_let, first), Declare(rates if same else (*rates, part))]
    rows = []
    for state, lets in zip(states, inside, strict=True):
        row = [_let(each) for each in lets]
        row += [Set(each.rate, state.rates[each.name].tree) for each in element.variables]
        row += [] if same else [Set(part, state.force.tree)]
        rows.append(tuple(row))
    flows += [ByState(tuple(rows))] if any(rows) else []
    flows += [Set(part, states[0].force.tree, new=True)] if same else []
    updates = tuple(
        Set(each.name, _after(each.name, dt, Name(each.rate))) for each in element.variables
    )
    shared = tuple(_let(each) for each in element.needed(every, per_element=False))
    return Plain(
        element=element,
        dt=dt,
        force="F",
        part=part,
        shared=shared,
        guards=tuple(guards),
        flows=tuple(flows),
        updates=updates,
        trees=tuple(_trees(element)),
    )


def _let(let: Let) -> Set:
    return Set(let.name, let.value.tree, let.about, new=True)


def _after(name: str, dt: str, rate: Value) -> Value:
    """Return a value after an Euler step."""
    return Binary("+", Name(name), Binary("*", Name(dt), rate))


def _taken(edge: Leaving, several: bool) -> tuple[Statement, ...]:
    steps = tuple(Set(name, tree) for name, tree in edge.steps)
    return (*steps, Enter(edge.target)) if several else steps


def _trees(element: Element) -> Iterable[Node]:
    """Return all that is computed."""
    yield element.total.tree
    yield from (each.value.tree for each in element.lets)
    for state in element.states:
        yield from (each.tree for each in (*state.rates.values(), state.force))
        for edge in state.edges:
            yield edge.guard
            yield from (tree for _, tree in edge.steps)
