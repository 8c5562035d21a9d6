"""One friction as text formats need it: inputs, constants, variables, states, under short names.

Everything is taken from the system that the engines run (`gms_fsm.systems`, `gms_fsm.lowering`);
only the names are shorter here. A name of the chart stays as it is. What a model adds, and what a
format needs besides, gives way to it.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

from gms_fsm.charts.nesting import spelled
from gms_fsm.charts.parameters import SIGMA_2, STRIBECK, WEIGHTS, Parameter, adapted
from gms_fsm.charts.reader import called
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._names import identifier
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.parts import (
    Constant,
    Expression,
    Leaving,
    Let,
    StateParts,
    Variable,
)
from gms_fsm.foundation.text import visible
from gms_fsm.language import (
    EVENT,
    Call,
    Comparison,
    Name,
    Node,
    Value,
    names_in,
    renamed,
    spell,
)
from gms_fsm.language.normal import renamed_in
from gms_fsm.lowering.printing.plan import Computed, ProgramPlan, RoughCall, both_sides, plan_of
from gms_fsm.systems.reading.assembly import CURVE_LOAD, Assembly, Bank, ContactEdge, of

__all__ = ["NamedFriction"]

SUM = "F"  # what the sum over elements is called in `NamedFriction.total`
MODEL = {  # what a model adds to its chart: name here, and its description
    "curve S": ("stribeck", Parameter("s", "N", meaning="Stribeck curve")),
    CURVE_LOAD: ("load", Parameter("N", "N", meaning="what multiplies the curve")),
    "threshold weight": ("weight", WEIGHTS),
    "model sigma_2": ("sigma_2", SIGMA_2),
    **{f"curve {each.name}": (each.name, each) for each in STRIBECK},
}


@dataclass(frozen=True, eq=False)
class NamedFriction:
    """A friction of n elements.

    Parameters
    ----------
    title : str
        For people.
    n : int
        Number of elements.
    inputs : tuple of (str, str)
        Names and descriptions; the velocity comes first. The time is among them if it is read.
    constants : tuple of Constant
        All numbers that are read.
    variables : tuple of Variable
        Of an element.
    length, force : str
        Units of the position and of the force.
    position : str
        The integral of the velocity, where it is read; else empty.
    position_start : float
        m: its initial value.
    lets : tuple of Let
        Each after those it needs.
    states : tuple of StateParts
        Of an element.
    edges : tuple of str
        Names of all edges, by number.
    start : tuple of int
        The index of each element's initial state.
    total : Expression
        The force of the contact over the inputs, and the sum of its elements' forces, ``F``.
    corners : tuple of Value
        Where a quantity that all elements share has a corner or a jump.
    held : tuple of (Value, bool)
        All values whose signs decide corners and jumps; whether each element has its own.
    reference : str
        Where the equations are published.
    taken : frozenset of str
        The names used and the words of the language, in lower case.
    """

    title: str
    n: int
    inputs: tuple[tuple[str, str], ...]
    constants: tuple[Constant, ...]
    variables: tuple[Variable, ...]
    length: str
    force: str
    position: str
    position_start: float
    lets: tuple[Let, ...]
    states: tuple[StateParts, ...]
    edges: tuple[str, ...]
    start: tuple[int, ...]
    total: Expression
    corners: tuple[Value, ...]
    held: tuple[tuple[Value, bool], ...]
    reference: str
    taken: frozenset[str] = field(repr=False)

    @classmethod
    def of(
        cls, subject: Subject, words: Iterable[str], *, time: bool = True, cases: bool = True
    ) -> NamedFriction:
        """Describe a friction.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
        >>> made = NamedFriction.of(Subject.of(model, "c99"), ())
        >>> [each.name for each in made.lets], [each.name for each in made.states]
        (['stribeck', 's'], ['stick', 'slip'])
        """
        contact = subject.contact  # refuses a system, a chart without numbers, locks
        read = subject.start.system.assembly
        (bank,) = read.banks
        _refuse_feedback(bank, f"chart {contact.chart.name!r}")
        every = frozenset(words)
        return PlanReader(
            subject, read, bank, _names(read, bank, every, cases), time, every
        ).element()

    # ------------------------------------------------------------------ what is read
    def needed(self, names: Iterable[str], *, per_element: bool) -> tuple[Let, ...]:
        """Return the quantities that names are computed from, shared or per element, in order."""
        return tuple(each for each in _needed(self.lets, names) if each.per_element == per_element)

    def placed(
        self, reads: Sequence[frozenset[str]], *, moves: bool = False
    ) -> tuple[list[Let], list[list[Let]]]:
        """Return which quantities of an element are computed before a choice, and in its branches.

        What only one branch reads is computed there.
        """
        wanted = [
            [e for e in self.needed(names, per_element=True) if e.moves or not moves]
            for names in reads
        ]
        every = [each for row in wanted for each in row]
        several = {each.name for each in every if sum(each in row for row in wanted) > 1}
        if len(wanted) == 1:
            several = {each.name for each in every}
        before = [each for each in self.lets if each.name in several]
        return before, [[each for each in row if each.name not in several] for row in wanted]

    @property
    def names(self) -> list[str]:
        """Names of its numbers, of what is computed, and of its variables."""
        found = [each.name for each in self.constants]
        found += [each.name for each in self.lets]
        return found + [each.name for each in self.variables]

    @property
    def trees(self) -> Iterator[Node]:
        """All that is computed."""
        yield self.total.tree
        yield from (each.value.tree for each in self.lets)
        for state in self.states:
            yield from (each.tree for each in (*state.rates.values(), state.force))
            for edge in state.edges:
                yield edge.guard
                yield from (tree for _, tree in edge.steps)

    def check_name(self, name: str, *, cases: bool = True) -> None:
        """Refuse a name of what is defined, if the friction has a quantity of that name."""
        found = [each for each, _ in self.inputs] + [self.position, *self.names]
        if name in found or (not cases and name.lower() in [each.lower() for each in found]):
            raise ParameterError(
                "a quantity of the friction has this name",
                place=f"name {name!r}",
                advice='give another one, for example name="friction" (--name friction)',
            )

    def free(self, name: str) -> str:
        """Return a name for what a format needs besides; it gives way to those in use."""
        return next(each for each in _numbered(name) if each.lower() not in self.taken)

    def reserved(self, *names: str) -> NamedFriction:
        """Return the same friction with further names in use, to which those of `free` give way."""
        return replace(self, taken=self.taken | {name.lower() for name in names})


def _needed(lets: Iterable[Let], names: Iterable[str]) -> tuple[Let, ...]:
    """Return the quantities that names are computed from, in order."""
    known = {each.name: each for each in lets}
    found, waiting = set[str](), [*names]
    while waiting:
        name = waiting.pop()
        if name in known and name not in found:
            found.add(name)
            waiting += known[name].value.names
    return tuple(each for name, each in known.items() if name in found)


def _numbered(name: str) -> Iterator[str]:
    yield name
    number = 2
    while True:
        yield f"{name}{number}"
        number += 1


# --------------------------------------------------------------------------- refusals and names
def _refuse_feedback(bank: Bank, place: str) -> None:
    """Refuse what is more than guards over variables and v: events, times, forces."""
    for name in bank.chart.events:
        raise ParameterError(
            f"it has the event {name.removeprefix(EVENT)!r}, which a text of one friction does not",
            place=place,
            advice="hand over a system with it, as c99, js, fmu2 or fmu3",
        )
    for time in called(bank.chart.durations).values():
        raise ParameterError(
            f"it reads {spell(time)}, which a text of one friction does not follow",
            place=place,
            advice="give the condition a state of its own, and after(...)",
        )
    late = {*bank.forces, *bank.rates}
    for edge in bank.edges:
        trees = [edge.guard, *(tree for _, tree in edge.steps)]
        for name in sorted(late & frozenset[str]().union(*map(names_in, trees))):
            raise ParameterError(
                f"it reads {name.rsplit('.', 1)[-1].split()[-1]!r} of the contact, which a text of "
                "one friction knows only after its guards",
                place=f"{place}, edge {edge.name!r}",
                advice="write it over variables and v, or hand over the engine (format 'c99')",
            )


def _names(read: Assembly, bank: Bank, words: Iterable[str], cases: bool) -> Mapping[str, str]:
    """Return the short name of every name in the trees; those of the chart stay."""
    c, chart, place = bank.name, bank.chart, f"chart {bank.chart.name!r}"
    kinds: dict[str, tuple[str, str]] = {}  # name in the trees: kind, short name

    def take(kind: str, name: str, inside: str) -> None:
        kinds[inside] = kind, name

    for name in read.system.signals:
        take("input", name, name)
    for name in chart.parameter_names:
        take("parameter", name, of(c, name))
    for full in bank.variables:
        name = full.rsplit(".", 1)[1]
        # Structured text has no names with two underscores in a row.
        name = name if cases or name not in chart.hidden else name.replace("__", "_")
        take("variable", name, full)
        take("rate", f"d{name}", bank.rate(full))
    for name in chart.let:
        take("let", name, of(c, name))
    for name in chart.inputs:
        if of(c, name) in read.defined:
            take("input", name, of(c, name))
    given = {*words} if cases else {word.upper() for word in words}
    owner: dict[str, str] = {}
    for kind, name in kinds.values():
        same = name if cases else name.upper()
        here = f"{place}, {kind} {name!r}"
        identifier(same, given, here)
        if same in owner:
            raise ParameterError(
                f"the format's language has one name for it and for {owner[same]}",
                place=here,
                advice="rename one of them",
            )
        owner[same] = f"{kind} {name!r}"
    states: dict[str, str] = {}
    for state in chart.states:
        here = f"{place}, state {state.name!r}"
        called = spelled(state.name)
        same = identifier(called if cases else called.upper(), (), here)
        if same in states:
            raise ParameterError(
                f"the format's language has one name for it and for state {states[same]!r}",
                place=here,
                advice="rename one of them",
            )
        states[same] = state.name
    for edge in chart.transitions:
        identifier(edge.name, (), f"{place}, edge {edge.name!r}")
    names = {inside: name for inside, (_, name) in kinds.items()}
    taken = {name.lower() for name in names.values()} | {"t", "x", "s", SUM.lower()}
    taken |= {word.lower() for word in given}
    for inside, (name, _) in MODEL.items():
        wanted = itertools.chain((name,), _numbered(f"model_{name}"))
        new = next(each for each in wanted if each.lower() not in taken)
        taken.add(new.lower())
        names[of(c, inside)] = new
    return {"t": "t", bank.position: "x", bank.threshold: "s"} | names


class PlanReader:
    """Translates the plan of a contact into short names."""

    def __init__(
        self,
        subject: Subject,
        read: Assembly,
        bank: Bank,
        names: Mapping[str, str],
        time: bool,
        words: frozenset[str],
    ) -> None:
        self.words = words
        self.subject, self.read, self.bank, self.time = subject, read, bank, time
        self.plan: ProgramPlan = plan_of(read)
        self.names = {**names}
        self.force = of(bank.name, "F")
        self.names[self.force] = SUM
        taken = {each.lower() for each in self.names.values()}
        for call in self.rough_calls():  # sgn_v, abs_z: they have names in the plan
            if call.name not in self.names:
                new = next(e for e in _numbered(call.name) if e.lower() not in taken)
                taken.add(new.lower())
                self.names[call.name] = new
        self.new = {inside: Name(short) for inside, short in self.names.items()}

    def rough_calls(self) -> Iterator[RoughCall]:
        """Return all calls with a corner or a jump."""
        (bank,) = self.plan.banks
        found = [*self.plan.definitions.values(), *bank.totals.values()]
        found += [each for state in bank.states for each in state.rates.values()]
        found += [each for state in bank.states for each in state.forces.values()]
        return (call for each in found for call in each.calls)

    # ------------------------------------------------------------------ translation
    def tree(self, value: Value) -> Value:
        return renamed(value, self.new)

    def expression(self, tree: Value, computed: Computed) -> Expression:
        calls = tuple(
            RoughCall(
                self.names[call.name], cast(Call, self.tree(call.call)), self.tree(call.turning)
            )
            for call in computed.calls
        )
        return Expression(self.tree(tree), self.tree(computed.tree), calls)

    def about(self, short: str) -> str:
        declared = self.bank.chart.declared.get(short)
        return "" if declared is None else self.described(declared)

    def described(self, parameter: Parameter) -> str:
        known = adapted(parameter, self.bank.chart)
        return visible(": ".join(part for part in (known.unit, known.meaning) if part))

    @functools.cached_property
    def moved(self) -> frozenset[str]:
        """What is computed from variables."""
        variables = {*self.bank.variables}
        every = (each.name for each in self.read.definitions)
        return frozenset(name for name in every if self.read.closure([name]) & variables)

    def fresh(self, value: Value) -> Value:
        """Return a value of an action: what is computed from variables is computed again."""
        inside = {
            name: self.fresh(tree)
            for name in names_in(value) & self.moved
            if (tree := self.read.defined[name].tree) is not None
        }
        return renamed(value, inside) if inside else value

    def edge(self, number: int, edge: ContactEdge) -> Leaving:
        return Leaving(
            edge.name,
            number,
            self.bank.states.index(edge.target),
            renamed_in(edge.guard, self.new),
            tuple((self.names[name], self.tree(self.fresh(tree))) for name, tree in edge.steps),
        )

    # ------------------------------------------------------------------ parts
    def states(self) -> tuple[StateParts, ...]:
        (plan,), bank = self.plan.banks, self.bank
        edges = [self.edge(number, edge) for number, edge in enumerate(bank.edges)]
        found = []
        for each in plan.states:
            force = bank.outputs[each.state, self.force]
            assert force is not None  # no state is locked
            common = plan.common.get(self.force)
            computed = each.forces[self.force] if common is None else Computed(common)
            found.append(
                StateParts(
                    spelled(each.state),
                    {
                        self.names[name]: self.expression(bank.flows[each.state, name], rate)
                        for name, rate in each.rates.items()
                    },
                    self.expression(force, computed),
                    tuple(
                        edge
                        for edge, old in zip(edges, bank.edges, strict=True)
                        if old.source == each.state
                    ),
                    tuple(map(self.tree, self.plan.rough[0][each.state])),
                )
            )
        return tuple(found)

    def lets(self) -> Iterator[Let]:
        for each in self.read.definitions:
            if each.tree is not None:
                short = self.names[each.name]
                inside = each.name.removeprefix(f"{self.bank.name}.")
                about = self.described(MODEL[inside][1]) if inside in MODEL else self.about(short)
                value = self.expression(each.tree, self.plan.definitions[each.name])
                yield Let(short, value, each.bank is not None, each.name in self.moved, about)

    def constants(self) -> Iterator[Constant]:
        every: dict[str, float | tuple[float, ...]] = {**self.read.shared}
        for name, (_, values) in self.read.own.items():
            every[name] = tuple(map(float, values)) if self.bank.n > 1 else float(values[0])
        for name, value in every.items():
            if name in self.names:
                inside = name.removeprefix(f"{self.bank.name}.")
                about = (
                    self.described(MODEL[inside][1])
                    if inside in MODEL
                    else self.about(self.names[name])
                )
                yield Constant(self.names[name], value, about)

    def element(self) -> NamedFriction:
        start, bank, layout = self.subject.start, self.bank, self.subject.start.program.layout
        states, lets = self.states(), tuple(self.lets())
        totals = self.plan.banks[0].totals
        total = Expression(Name(SUM), Name(SUM))
        if self.force in totals:
            total = self.expression(bank.totals[self.force], totals[self.force])
        used = [name for state in states for name in (*state.flow_names, *state.guard_names)]
        used += total.names
        read = _needed(lets, used)
        used += [name for each in read for name in each.value.names]
        inputs = [(name, self.about(name)) for name in self.read.system.signals]
        if self.time and "t" in used:
            inputs.append(("t", "s: time"))
        held, corners = self.plan.held, [self.tree(r.left) for r in self.outer()]
        return NamedFriction(
            title=self.subject.title,
            n=bank.n,
            inputs=tuple(inputs),
            constants=tuple(each for each in self.constants() if each.name in used),
            variables=tuple(self.variable(name) for name in bank.variables),
            length=bank.chart.length,
            force=bank.chart.force,
            position="x" if "x" in used else "",
            position_start=float(start.y[layout.y.index(bank.position)]),
            lets=read,
            states=states,
            edges=tuple(edge.name for edge in bank.edges),
            start=tuple(start.mode),
            total=total,
            corners=tuple(dict.fromkeys(corners)),
            held=tuple(
                (self.tree(u), own)
                for group, own in ((held.shared, False), (held.own, True))
                for u in group
            ),
            reference=bank.chart.reference,
            taken=frozenset(
                {each.lower() for each in self.names.values()}
                | {state.name.lower() for state in states}
                | {word.lower() for word in self.words}
            ),
        )

    def outer(self) -> Iterator[Comparison]:
        """Return the comparisons with zero that are watched in every state."""
        shared = {*self.plan.held.shared}
        for each in self.plan.always:
            if each.left in shared and each in both_sides(each.left):
                yield each

    def variable(self, name: str) -> Variable:
        start, layout = self.subject.start, self.subject.start.program.layout
        short = self.names[name]
        values = tuple(float(start.y[layout.y.index(name, i)]) for i in range(self.bank.n))
        about = "s: time in the present state" if short == "age" else self.about(short)
        return Variable(short, self.names[self.bank.rate(name)], values, about)
