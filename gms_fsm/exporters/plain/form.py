"""The paper's plain form: guards are looked at once a step, then all flows take one Euler step.

It is what ``simulate(..., method="euler", events="step")`` computes, as a list of statements that
printers of languages write down in this order.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

from gms_fsm.exporters.plain.element import NamedFriction
from gms_fsm.exporters.plain.parts import Leaving, Let
from gms_fsm.language import Binary, Name, Number, Value


@dataclass(frozen=True)
class SetTo:
    """An assignment; `new` if it declares the name, which is then never changed."""

    name: str
    tree: Value
    note: str = ""
    new: bool = False


@dataclass(frozen=True)
class Declare:
    """Names that statements after it assign."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class Recall:
    """A variable of an element is read from where it is kept between steps."""

    name: str


@dataclass(frozen=True)
class Keep:
    """A variable is written to where it is kept."""

    name: str
    tree: Value


@dataclass(frozen=True)
class Enter:
    """The element's next state; a friction of one state has none of these."""

    state: int


@dataclass(frozen=True)
class Verbatim:
    """A statement in the words of a language."""

    text: str


@dataclass(frozen=True)
class Guards:
    """The edges that leave a state: what the first one does whose guard holds."""

    edges: tuple[tuple[Leaving, tuple[Statement, ...]], ...]


@dataclass(frozen=True)
class ByState:
    """One list of statements for each state."""

    branches: tuple[tuple[Statement, ...], ...]


@dataclass(frozen=True)
class TwoWays:
    """One of two lists of statements, by a test in the words of a language."""

    test: str
    body: tuple[Statement, ...]
    other: tuple[Statement, ...]


@dataclass(frozen=True)
class ForEach:
    """Statements for each element."""

    body: tuple[Statement, ...]


Statement: TypeAlias = (
    "SetTo | Declare | Recall | Keep | Enter | Verbatim | Guards | ByState | TwoWays | ForEach"
)


@dataclass(frozen=True, eq=False)
class PlainForm:
    """A step of the plain form.

    Parameters
    ----------
    element : NamedFriction
        Of which friction.
    dt, force, part : str
        Names of the step, of the sum of the elements' forces, and of an element's force.
    step : tuple of Statement
        The whole step.
    """

    element: NamedFriction
    dt: str
    force: str
    part: str
    step: tuple[Statement, ...]


def plain_form(element: NamedFriction, dt: str = "dt") -> PlainForm:
    """Return the plain form of a friction.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> from gms_fsm.exporters._subject import Subject
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> form = plain_form(NamedFriction.of(Subject.of(model, "c99"), ()))
    >>> declared(form.step)
    ['F', 'stribeck', 's', 'dz', 'F_i']
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
    moved = any(edge.steps for state in states for edge in state.edges)
    known = [] if moved else first  # that has its value still
    branches: list[tuple[Statement, ...]] = []
    for state, lets in zip(states, inside, strict=True):
        chain = Guards(tuple((edge, _taken(edge, len(states) > 1)) for edge in state.edges))
        branches.append((*map(_let, lets), chain) if state.edges else ())
    guards += [ByState(tuple(branches))] if any(branches) else []
    first, inside = element.placed(flow_reads, moves=True)
    first = [each for each in first if each not in known]
    inside = [[each for each in row if each not in known] for row in inside]
    same = len({state.force.tree for state in states}) == 1
    rates = tuple(each.rate for each in element.variables)
    flows: list[Statement] = [*map(_let, first), Declare(rates if same else (*rates, part))]
    rows = []
    for state, lets in zip(states, inside, strict=True):
        row = [_let(each) for each in lets]
        row += [SetTo(each.rate, state.rates[each.name].tree) for each in element.variables]
        row += [] if same else [SetTo(part, state.force.tree)]
        rows.append(tuple(row))
    flows += [ByState(tuple(rows))] if any(rows) else []
    flows += [SetTo(part, states[0].force.tree, new=True)] if same else []
    force = Name("F")
    body = (
        *(Recall(each.name) for each in element.variables),
        *guards,
        *flows,
        SetTo("F", Binary("+", force, Name(part))),
        *(Keep(e.name, _after(e.name, dt, Name(e.rate))) for e in element.variables),
    )
    shared = map(_let, element.needed(every, per_element=False))
    step: list[Statement] = [Declare(("F",)), SetTo("F", Number(0.0)), *shared, ForEach(body)]
    if element.total.tree != force:
        step.append(SetTo("F", element.total.tree))
    if element.position:
        (velocity, _), x = element.inputs[0], element.position
        step.append(SetTo(x, _after(x, dt, Name(velocity))))
    return PlainForm(element=element, dt=dt, force="F", part=part, step=tuple(step))


def declared(statements: Iterable[Statement]) -> list[str]:
    """Return the names that statements compute anew in every step, in order."""
    found = dict[str, None]()
    for each in statements:
        match each:
            case SetTo(name, _, _, True):
                found[name] = None
            case Declare(names):
                found |= dict.fromkeys(names)
            case ByState(branches):
                found |= dict.fromkeys(name for branch in branches for name in declared(branch))
            case ForEach(body):
                found |= dict.fromkeys(declared(body))
    return [*found]


def _let(let: Let) -> SetTo:
    return SetTo(let.name, let.value.tree, let.about, new=True)


def _after(name: str, dt: str, rate: Value) -> Value:
    """Return a value after an Euler step."""
    return Binary("+", Name(name), Binary("*", Name(dt), rate))


def _taken(edge: Leaving, several: bool) -> tuple[Statement, ...]:
    steps = tuple(SetTo(name, tree) for name, tree in edge.steps)
    return (*steps, Enter(edge.target)) if several else steps
