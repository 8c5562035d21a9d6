"""Frictions whose velocities another program knows, as one program.

Each friction acts on a body of its own. The places of these bodies' velocities in the program's
state vector are filled from outside, so the rates that the program has for them are never used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gms_fsm.coupling.steppable import alone, other_inputs
from gms_fsm.errors import ParameterError, shown
from gms_fsm.language import names_in
from gms_fsm.lowering.program import Program
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
from gms_fsm.run.stepped.beginning import begin
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Body, Contact, System


@dataclass(frozen=True, eq=False)
class Driven:
    """Frictions that wait for their velocities.

    Parameters
    ----------
    start : Problem
        Their program, initial state and modes.
    velocities : tuple of int
        For each friction the place of its velocity in the program's state vector.
    own : tuple of int
        The other places: the frictions' own state.
    forces : tuple of int
        For each friction the place of its force among the observed values.
    made_of : tuple
        The arguments of `of`.
    """

    start: Problem
    velocities: tuple[int, ...]
    own: tuple[int, ...]
    forces: tuple[int, ...]
    made_of: tuple[Any, ...]

    @classmethod
    def of(
        cls,
        frictions: Sequence[Model | Contact],
        t: float,
        initial: Mapping[str, Any] | None,
        *,
        several: bool,
    ) -> Driven:
        """Lower some frictions."""
        contacts = [_contact(each, k, several) for k, each in enumerate(frictions, start=1)]
        bodies = [_body(each, several) for each in contacts]
        for body in bodies:
            for key in (body.v, f"{body.name}.v"):
                if isinstance(initial, Mapping) and key in initial:
                    raise ParameterError(
                        f"initial has {key!r} = {shown(initial[key])}, but the caller's equations "
                        "give the velocity",
                        advice="leave it out",
                    )
        system = System("friction", bodies=tuple(bodies), contacts=tuple(contacts))
        settings = Settings(output="end")
        t, end = begin(t)
        start = Problem.of(system, None, end, settings, t_start=t, initial=initial)
        layout = start.program.layout
        velocities = tuple(layout.y.index(body.v) for body in bodies)
        return cls(
            start,
            velocities,
            tuple(k for k in range(layout.y.size) if k not in velocities),
            tuple(layout.observed.index(bank.of("F")) for bank in layout.banks),
            (tuple(frictions), t, initial, several),
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make it again: generated functions cannot be pickled."""
        return _again, self.made_of

    @property
    def program(self) -> Program:
        """The program of all frictions."""
        return self.start.program

    @property
    def initial(self) -> list[float]:
        """Their own state at the start."""
        return [self.start.y[k] for k in self.own]

    def full(self, own: Sequence[float], v: Sequence[float]) -> list[float]:
        """Return the program's state vector."""
        y = [0.0] * (len(self.own) + len(self.velocities))
        for k, value in zip(self.own, own, strict=True):
            y[k] = value
        for k, value in zip(self.velocities, v, strict=True):
            y[k] = value
        return y

    def tolerances(self, rtol: float) -> list[float]:
        """Return the default absolute tolerances of the own state, then of the velocities.

        They are 0 where there is no scale.
        """
        options = self.start.options
        return [options.atol[k] * (rtol / options.rtol) for k in (*self.own, *self.velocities)]

    def states(self, mode: Sequence[int]) -> list[tuple[str, ...]]:
        """Return for each friction the names of its elements' states."""
        banks, contacts = self.program.layout.banks, self.start.system.contacts
        return [
            tuple(contact.chart.states[i].name for i in mode[bank.elements])
            for bank, contact in zip(banks, contacts, strict=True)
        ]

    def place(self, machine: int) -> tuple[str, int]:
        """Return the contact of a machine, and its element there, counted from 0."""
        bank = self.program.layout.bank(machine)
        return bank.name, machine - bank.first

    def edge(self, edge: int) -> str:
        """Return the name of an edge."""
        return self.program.layout.edges[edge][0]


def _again(*made_of: Any) -> Driven:
    *arguments, several = made_of
    return Driven.of(*arguments, several=several)


def _contact(given: Model | Contact, number: int, several: bool) -> Contact:
    """Return a friction as a contact that moves with a body of its own, or refuse."""
    contact = alone(given)
    name = contact.name
    if several and not isinstance(given, Contact):
        name = f"{name}{number}"
    _refuse(contact)
    v = _name("v", name, several)
    return contact.replaced(name=name, v=(v,))


def _body(contact: Contact, several: bool) -> Body:
    x, v = (_name(letter, contact.name, several) for letter in "xv")
    return Body(f"{contact.name}_body", inertia=1.0, x=x, v=v, rotary=contact.chart.rotary)


def _name(letter: str, contact: str, several: bool) -> str:
    return f"{letter}_{contact}" if several else letter


def _refuse(contact: Contact) -> None:
    """Refuse what reads more than its own velocity and the time."""
    chart = contact.chart
    here = f"chart {chart.name!r}"
    trees = [*chart.guards.values(), *(u for s in chart.assignments.values() for u in s.values())]
    own = {*chart.inputs, *chart.variables, *chart.parameter_names, *chart.let}
    if any("a" in names_in(tree) for tree in trees) and "a" not in own:
        raise ParameterError(
            "it reads a, the acceleration, which a velocity at one time does not tell",
            place=here,
            advice="use FrictionState, or a System and simulate",
        )
    if others := other_inputs(contact):
        raise ParameterError(
            f"its texts name {', '.join(map(repr, others))}, which nobody gives here",
            place=here,
            advice="give the contact formulas in t (inputs=...), or use FrictionState, which takes "
            "inputs",
        )
