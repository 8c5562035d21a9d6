"""A system with all its texts read, and every quantity under a name of its own.

In the trees made here a name of the system stands for itself; what belongs to a contact is called
``contact.name``, so that charts may use the same names. A quantity computed from others (a signal,
the velocity of a driven body, a relative velocity, an input, a named expression of a chart) is a
`Definition`; definitions stand in an order in which they can be computed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.errors import ExpressionError, ParameterError, Part, shown
from gms_fsm.language import (
    Binary,
    Condition,
    Name,
    Number,
    Value,
    names_in,
    parse_value,
    renamed,
)
from gms_fsm.language.normal import chosen, renamed_in
from gms_fsm.systems.given import coefficients, is_positive, rank_of
from gms_fsm.systems.parts import COUNTS, LEAST_LOAD, LOAD, Body, Contact
from gms_fsm.systems.reading.definitions import ContactEdge, Definition
from gms_fsm.systems.reading.order import check_loops, in_order, read_by
from gms_fsm.systems.reading.values import numbers_of, of
from gms_fsm.systems.signals import REST, Formula
from gms_fsm.systems.springs import added, spring_forces

if TYPE_CHECKING:
    from gms_fsm.systems.system import System

__all__ = [
    "CURVE_LOAD",
    "Assembly",
    "Bank",
    "ContactEdge",
    "Definition",
    "SystemReader",
    "assembled",
    "of",
]

ZERO, ONE = Number(0.0), Number(1.0)
CURVE_LOAD = "curve load"


@dataclass(frozen=True, eq=False)
class Bank:
    """A contact whose chart is read over the names of the system.

    Parameters
    ----------
    index : int
        Among the contacts.
    contact : Contact
        What it is.
    variables : tuple of str
        The chart's, one value per element each.
    velocities, forces, rates : tuple of str
        For each velocity of the chart its name, that of the force, that of the acceleration.
    position : str
        Name of the relative position.
    threshold : str
        Name of the elements' thresholds; empty where the model has no curve.
    jacobian : tuple of mapping of str to Value
        For each velocity its coefficients, by body.
    flows : mapping of (str, str) to Value
        By state and variable.
    outputs : mapping of (str, str) to Value or None
        By state and force, of an element; None in a locked state.
    totals : mapping of str to Value
        By force: that of the contact over the sum, where it is not the sum itself.
    edges : tuple of ContactEdge
        In the chart's order.
    start : tuple of (str, Value)
        The assignments at the start of a run.
    lasting : mapping of str to Value
        Of each variable that is how long a condition has held: its value, or 0 if it does not hold.
    means : mapping of str to Value
        For each name of the chart what it stands for.
    """

    index: int
    contact: Contact
    variables: tuple[str, ...]
    velocities: tuple[str, ...]
    forces: tuple[str, ...]
    rates: tuple[str, ...]
    position: str
    threshold: str
    jacobian: tuple[Mapping[str, Value], ...]
    flows: Mapping[tuple[str, str], Value]
    outputs: Mapping[tuple[str, str], Value | None]
    totals: Mapping[str, Value]
    edges: tuple[ContactEdge, ...]
    start: tuple[tuple[str, Value], ...]
    lasting: Mapping[str, Value]
    means: Mapping[str, Value]

    @property
    def name(self) -> str:
        """The contact's."""
        return self.contact.name

    @property
    def n(self) -> int:
        """Number of elements."""
        return self.contact.n

    @property
    def chart(self) -> Chart:
        """The contact's."""
        return self.contact.chart

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the chart's states."""
        return tuple(state.name for state in self.chart.states)

    @property
    def locked(self) -> tuple[str, ...]:
        """Names of the states that lock it."""
        return tuple(state.name for state in self.chart.states if state.locked)

    def is_impulse(self, edge: ContactEdge) -> bool:
        """Return whether an edge changes velocities by an impulse."""
        sets = any(name in self.velocities for name, _ in edge.steps)
        return sets or (edge.locks and not edge.arrests and edge.source not in self.locked)

    @property
    def weight(self) -> str:
        """Name of the weights, of which every bank has one per element."""
        return of(self.name, "threshold weight")

    @property
    def periodic(self) -> bool:
        """Whether its machines are asked at ticks only, and what they give out is held."""
        return self.contact.period is not None

    def held(self, name: str) -> str:
        """Return what the held value of a rate or of a force is called."""
        return f"{name} held"

    def rate(self, variable: str) -> str:
        """Return what the rate of a variable is called."""
        contact, name = variable.rsplit(".", 1)
        return of(contact, f"d{name}")


@dataclass(frozen=True, eq=False)
class Assembly:
    """A system, read.

    Parameters
    ----------
    system : System
        What was read.
    definitions : tuple of Definition
        Each after those it needs.
    banks : tuple of Bank
        The contacts.
    forces, inertias : mapping of str to Value
        By free body.
    flow : mapping of str to Value
        Rates of the further states.
    updates : mapping of str to mapping of str to Value
        By sampler, those of its values.
    shared : mapping of str to float
        Numbers with one value, by name.
    own : mapping of str to (int, ndarray)
        Numbers with one value per element, by name: the bank, and the values.
    """

    system: System
    definitions: tuple[Definition, ...]
    banks: tuple[Bank, ...]
    forces: Mapping[str, Value]
    inertias: Mapping[str, Value]
    flow: Mapping[str, Value]
    updates: Mapping[str, Mapping[str, Value]]
    shared: Mapping[str, float]
    own: Mapping[str, tuple[int, np.ndarray]]

    @cached_property
    def late(self) -> frozenset[str]:
        """What machines give out, and the shared quantities computed from it."""
        given = {name for bank in self.banks for name in (*bank.forces, *bank.rates)}
        given |= {f"{body.name} a" for body in self.system.bodies}
        shared = (each.name for each in self.definitions if each.bank is None)
        return frozenset(given) | {name for name in shared if self.closure([name]) & given}

    @cached_property
    def inputs(self) -> tuple[frozenset[str], ...]:
        """By machine what its outputs are computed from, but for its own."""
        return tuple(read_by(self, bank) for bank in self.banks)

    @cached_property
    def locking(self) -> bool:
        """Whether a contact is always locked."""
        return any(all(state.locked for state in bank.chart.states) for bank in self.banks)

    @cached_property
    def free(self) -> tuple[Body, ...]:
        """The bodies that are not driven."""
        return tuple(body for body in self.system.bodies if not body.driven)

    @cached_property
    def defined(self) -> Mapping[str, Definition]:
        """Definitions by name."""
        return {each.name: each for each in self.definitions}

    @cached_property
    def owner(self) -> Mapping[str, int]:
        """For each name with one value per element its bank."""
        found = {name: bank for name, (bank, _) in self.own.items()}
        for bank in self.banks:
            found |= dict.fromkeys(bank.variables, bank.index)
            found |= {bank.rate(name): bank.index for name in bank.variables}
        return found | {each.name: each.bank for each in self.definitions if each.bank is not None}

    def bit(self, bank: Bank) -> int:
        """Return the bit of a contact with a period among all that ticks; 0 for any other."""
        if bank.contact.period is None:
            return 0
        periodic = [each.index for each in self.banks if each.contact.period is not None]
        return 1 << (len(self.system.sampled) + periodic.index(bank.index))

    @property
    def events_bit(self) -> int:
        """The bit, among all that ticks, with which events are forgotten; 0 if there are none."""
        return self._behind(0) if self.system.events else 0

    @property
    def lasting_bit(self) -> int:
        """The bit with which the times of conditions that do not hold are set to 0, or 0."""
        return self._behind(1) if any(each.lasting for each in self.banks) else 0

    def _behind(self, number: int) -> int:
        return 1 << (len(self.system.sampled) + sum(each.periodic for each in self.banks) + number)

    def bank_of(self, tree: Value | Condition) -> int | None:
        """Return the bank whose elements have one value of a tree each; None if there is one."""
        return next((self.owner[name] for name in names_in(tree) if name in self.owner), None)

    def closure(self, names: Iterable[str]) -> frozenset[str]:
        """Return names, and those that their definitions are computed from."""
        found, waiting = set[str](), [*names]
        while waiting:
            name = waiting.pop()
            if name not in found:
                found.add(name)
                definition = self.defined.get(name)
                if definition is not None and definition.tree is not None:
                    waiting += names_in(definition.tree)
        return frozenset(found)

    def expanded(self, tree: Value) -> Value:
        """Return a tree over states, numbers, t and signals that are not formulas."""
        inside = {
            name: self.expanded(definition.tree)
            for name in names_in(tree)
            if (definition := self.defined.get(name)) is not None and definition.tree is not None
        }
        return renamed(tree, inside) if inside else tree


def assembled(system: System) -> Assembly:
    """Read all texts of a system; a system is read once, when it is constructed."""
    return SystemReader(system).read()


class SystemReader:
    """Reads the texts of a system into trees, and says what each text may name."""

    def __init__(self, system: System) -> None:
        self.system, self.here = system, Part(f"system {system.name!r}")
        self.definitions: list[Definition] = []
        self.aliases: dict[str, Value] = {}  # of the relative velocities that are those of a body

    def value(self, text: str | float, names: Iterable[str], owner: Part) -> Value:
        """Return the tree of a text that may read some names."""
        try:
            tree = parse_value(text if isinstance(text, str) else repr(float(text)), names)
            return renamed(tree, self.aliases) if self.aliases else tree
        except ExpressionError as error:
            raise error.at(owner) from None

    def read(self) -> Assembly:
        """Return the system with all its texts read."""
        system, numbers = self.system, self.system.numbers
        for name, signal in system.signals.items():
            if isinstance(signal, str):
                owner = self.here.of(f"signal {name!r}", "signals", name)
                tree = self.value(signal, ["t", *numbers], owner)
                self.definitions.append(Definition(name, tree))
            else:
                formula = signal.tree if isinstance(signal, Formula) else None
                self.definitions.append(Definition(name, formula, signal=signal))
        self.definitions += [Definition(name, None, signal=REST) for name in system.open]
        given = ["t", *system.given, *numbers]
        self.see_machines()
        forces, inertias = {}, {}
        for i, body in enumerate(system.bodies):
            owner = self.here.of(f"body {body.name!r}", "bodies", i)
            if body.velocity is None:
                assert body.inertia is not None
                forces[body.name] = self.value(body.force, self.names, owner.of("force", "force"))
                tree = self.value(body.inertia, self.names, owner.of("inertia", "inertia"))
                inertias[body.name] = tree
            elif not (body.velocity == body.v and body.v in system.given):
                tree = self.value(body.velocity, given, owner.of("velocity", "velocity"))
                self.definitions.append(Definition(body.v, tree))
        lets = dict.fromkeys(system.let)
        for name, text in system.let.items():
            known = [each for each in system.names if each not in lets]
            tree = self.value(text, known, self.here.of(f"let {name!r}", "let", name))
            self.definitions.append(Definition(name, tree))
            del lets[name]
        for name, sign, term in spring_forces(system):
            if name in forces:
                forces[name] = added(forces[name], sign, term)
        flow = {
            name: self.value(text, self.names, self.here.of(f"flow of {name!r}", "flow", name))
            for name, text in system.flow.items()
        }
        updates = {}
        for i, each in enumerate(system.sampled):
            own = {"period": Number(each.period)}
            owner = self.here.of(f"sampled {each.name!r}", "sampled", i)
            known = [*self.names, "period"]
            updates[each.name] = {
                name: renamed(self.value(text, known, owner.of(repr(name), "updates", name)), own)
                for name, text in each.updates.items()
            }
        banks = tuple(self.bank(i, contact) for i, contact in enumerate(system.machines))
        self.check_inertias(inertias)
        self.check_locks(banks)
        trees = [each.tree for each in self.definitions if each.tree is not None]
        trees += [*forces.values(), *flow.values()]
        trees += [tree for each in updates.values() for tree in each.values()]
        used = frozenset[str]().union(*map(names_in, trees))
        used |= {name for bank in banks for tree in bank.means.values() for name in names_in(tree)}
        read = Assembly(
            system,
            in_order(each for each in self.definitions if each.counts is None or each.name in used),
            banks,
            forces,
            inertias,
            flow,
            updates,
            *numbers_of(system),
        )
        check_loops(read)
        return read

    def see_machines(self) -> None:
        """Define how many elements are in a state, and what the velocities of contacts are."""
        moved = {body.v for body in self.system.bodies}
        for index, machine in enumerate(self.system.machines):
            nesting = machine.chart.nesting
            for path in nesting.levels:
                inside = tuple(nesting.leaves_of(path))
                for word in COUNTS:
                    name = f"{word}({machine.name}.{path})"
                    self.definitions.append(Definition(name, None, counts=(index, inside)))
            for text, name in zip(machine.v, machine.chart.velocities, strict=True):
                if text in moved:
                    self.aliases[of(machine.name, name)] = Name(text)

    @property
    def names(self) -> tuple[str, ...]:
        """All names that a text of the system can use."""
        return self.system.readable

    def bank(self, index: int, contact: Contact) -> Bank:
        """Return a contact with the texts of its chart read."""
        chart, model, c = contact.chart, contact.model, contact.name
        i = index - len(self.system.contacts)
        kind = "contact" if i < 0 else "supervisor"
        owner = self.here.of(f"{kind} {c!r}", f"{kind}s", index if i < 0 else i)
        names: dict[str, Value] = {"t": Name("t"), **{u: Name(of(c, u)) for u in contact.values}}
        self.check_inputs(contact, owner)
        own_names: dict[str, str] = {}  # of what an action can set
        # Velocities and the position, those of a body where they are just that.
        jacobian, moved = [], {body.v: body for body in self.system.bodies}
        velocities, at = [], ""
        for text, name in zip(contact.v, chart.velocities, strict=True):
            tree = self.value(text, [*moved, *self.system.numbers], owner.of("v", "v"))
            jacobian.append(coefficients(tree, moved, text, owner))
            known = self.defined(of(c, name), tree)
            names[name], own_names[name] = known, known.id
            velocities.append(known.id)
            if len(velocities) == 1:
                where = renamed(tree, {v: Name(body.x) for v, body in moved.items()})
                if "x" in contact.inputs:
                    where = self.text_of_input(contact, "x", owner)
                position = self.defined(of(c, "x"), where)
                names["x"], at = position, position.id
        for name in chart.inputs:
            if name not in names and not (name == "s" and model is not None):
                names[name] = self.input(contact, name, owner)
        curved = model is not None and model.stribeck is not None
        threshold = self.curve(contact, index, names, owner) if curved else ""
        for name in chart.variables:
            names[name], names[f"d{name}"] = Name(of(c, name)), Name(of(c, f"d{name}"))
            own_names[name] = of(c, name)
        self.lets(contact, index, names)
        # A chart may have a parameter called a, for example; guards then cannot read this rate.
        rates = [of(c, f"rate {name}" if name in names else name) for name in chart.rate_names]
        for name in (*chart.force_names, *chart.rate_names):
            names.setdefault(name, Name(of(c, name)))

        for event in chart.events:
            own_names[event] = event
            names[event] = Name(event)

        def steps(edge: Transition | None = None) -> tuple[tuple[str, Value], ...]:
            return tuple(
                (own_names[name], renamed(tree, names)) for name, tree in chart.assigned(edge)
            )

        locked = {state.name for state in chart.states if state.locked}
        totals = {
            of(c, name): renamed(tree, names | {name: Name(of(c, name))})
            for name, tree in chart.totals.items()
        }
        if model is not None:
            force = of(c, "F")
            viscous = Binary("*", Name(of(c, "model sigma_2")), Name(velocities[0]))
            totals[force] = Binary("+", totals.get(force, Name(force)), viscous)  # (4)
        return Bank(
            index=index,
            contact=contact,
            variables=tuple(of(c, name) for name in chart.variables),
            velocities=tuple(velocities),
            forces=tuple(of(c, name) for name in chart.force_names),
            rates=tuple(rates),
            position=at,
            threshold=threshold,
            jacobian=tuple(jacobian),
            flows={
                (state, of(c, name)): renamed(tree, names)
                for (state, name), tree in chart.flows.items()
            },
            outputs={
                (state, of(c, name)): None if tree is None else renamed(tree, names)
                for (state, name), tree in chart.forces.items()
            },
            totals=totals,
            edges=tuple(
                ContactEdge(
                    *(edge.name, edge.source, edge.target),
                    renamed_in(chart.guards[edge.name], names),
                    steps(edge),
                    edge.target in locked,
                    number in chart.arrests,
                )
                for number, edge in enumerate(chart.transitions)
            ),
            start=steps(),
            lasting=_lasting(chart, c, names),
            means=names,
        )

    def check_inputs(self, contact: Contact, owner: Part) -> None:
        """Refuse inputs that the chart does not read."""
        for name in contact.inputs:
            if name not in contact.chart.inputs and (name != LOAD or contact.load is None):
                raise ParameterError(
                    f"inputs has {shown(name)}, which its chart does not read",
                    place=owner.words,
                    advice=f"the chart's inputs are {', '.join(contact.chart.inputs) or 'none'}",
                    key=(*owner.key, "inputs", name),
                )

    def check_inertias(self, inertias: Mapping[str, Value]) -> None:
        """Refuse an inertia that is not positive."""
        for i, body in enumerate(self.system.bodies):
            if not body.driven and not is_positive(inertias[body.name], self.system.numbers):
                owner = self.here.of(f"body {body.name!r}", "bodies", i)
                raise ParameterError(
                    f"the inertia {body.inertia!r} is not positive, or not finite",
                    place=owner.words,
                    advice="every free body needs one",
                    key=(*owner.key, "inertia"),
                )

    def check_locks(self, banks: Iterable[Bank]) -> None:
        """Refuse locks that nothing can keep, and those that always hold and repeat each other."""
        free = [body.name for body in self.system.bodies if not body.driven]
        always: list[Bank] = []
        for bank in banks:
            chart = bank.chart
            if chart.locks or chart.sets_velocity:
                for row, text in zip(bank.jacobian, bank.contact.v, strict=True):
                    if not row.keys() & {*free}:
                        raise ParameterError(
                            f"chart {chart.name!r} locks the contact or sets its velocity, but "
                            f"only driven bodies move it (v = {text!r})",
                            place=f"{self.here.words}, contact {bank.name!r}",
                            key=("contacts", bank.index, "v"),
                            advice="mount it where a free body can follow, for example on a "
                            "Slider or a PulledSlider",
                        )
            if all(state.locked for state in chart.states):
                always.append(bank)
                if rank_of(always, free, self.system.numbers) < sum(
                    len(b.jacobian) for b in always
                ):
                    names = ", ".join(repr(each.name) for each in always)
                    raise ParameterError(
                        f"the contacts {names} are always locked, and the lock of "
                        f"{bank.name!r} follows from the others or from driven bodies",
                        place=self.here.words,
                        key=("contacts", bank.index),
                        advice="leave one of them out, or give its chart a state that is not "
                        "locked",
                    )

    def defined(self, name: str, tree: Value) -> Name:
        """Return the name of a value: its own, or that of what it is just equal to."""
        if isinstance(tree, Name):
            return tree
        self.definitions.append(Definition(name, tree))
        return Name(name)

    def input(self, contact: Contact, name: str, owner: Part) -> Value:
        """Bind an input of a chart."""
        if name not in contact.inputs and name not in self.names:
            raise ParameterError(
                f"its chart reads the input {name!r}, which is not bound",
                place=owner.words,
                advice=f"give inputs={{{name!r}: ...}} over {', '.join(self.system.names)}",
                key=owner.key,
            )
        tree = self.text_of_input(contact, name, owner)
        return tree if isinstance(tree, Number) else self.defined(of(contact.name, name), tree)

    def text_of_input(self, contact: Contact, name: str, owner: Part) -> Value:
        """Read what an input is."""
        text = contact.inputs.get(name, name)
        return self.value(text, self.names, owner.of(f"input {name!r}", "inputs", name))

    def curve(self, contact: Contact, index: int, names: dict[str, Value], owner: Part) -> str:
        """Define the Stribeck curve of a model and the thresholds; return their name."""
        c = contact.name
        given = contact.stribeck
        assert given is not None
        numbers: dict[str, Value] = {name: Name(of(c, f"curve {name}")) for name in given.numbers}
        curve = of(c, "curve S")
        self.definitions.append(Definition(curve, renamed(given.tree, numbers | {"v": names["v"]})))
        strength: Value = Name(curve)
        if contact.load is not None:
            least = parse_value(f"max({LOAD}, {LEAST_LOAD!r})", [LOAD])
            load = renamed(least, {LOAD: self.text_of_input(contact, LOAD, owner)})
            self.definitions.append(Definition(of(c, CURVE_LOAD), load))
            strength = Binary("*", strength, Name(of(c, CURVE_LOAD)))
        threshold = of(c, "s")
        weighted = Binary("*", Name(of(c, "threshold weight")), strength)
        self.definitions.append(Definition(threshold, weighted, index))
        names["s"] = Name(threshold)
        return threshold

    def lets(self, contact: Contact, index: int, names: dict[str, Value]) -> None:
        """Define the named expressions of a chart."""
        chart, c = contact.chart, contact.name
        each = numbers_of(self.system)[1]
        own = {name for name in names if names_in(names[name]) & {*each}}
        own |= {*chart.variables, "s"} & {*names}
        for name, tree in chart.lets.items():
            per_element = bool(names_in(tree) & own)
            if per_element:
                own.add(name)
            self.definitions.append(
                Definition(of(c, name), renamed(tree, names), index if per_element else None)
            )
            names[name] = Name(of(c, name))


def _lasting(chart: Chart, contact: str, names: Mapping[str, Value]) -> dict[str, Value]:
    """Return what the times are for which conditions have held: as before, or 0."""
    return {
        of(contact, name): chosen(renamed_in(condition, names), Name(of(contact, name)), ZERO)
        for name, condition in chart.durations.items()
    }
