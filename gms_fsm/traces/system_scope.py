"""What a name means in a condition over the run of a system: in ``until``, a watch, a monitor.

The names of the system mean what they mean in its texts. What belongs to a contact has its name in
front: ``gear.F``, ``gear.z1``, ``gear.state(1)``. In a system with one contact these names may also
be written without it, unless the system itself uses them. A model on a rig has the names of
`gms_fsm.traces.scope`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.errors import SignalError
from gms_fsm.language import Name, Owner, evaluate, names_in, values_of
from gms_fsm.lowering.layout import BankPlaces, SystemLayout
from gms_fsm.lowering.observing import observe
from gms_fsm.lowering.program import Program
from gms_fsm.systems.signals import Corners, Function, piecewise_linear
from gms_fsm.systems.system import Contact, System
from gms_fsm.traces.scope import Scope, watch_names
from gms_fsm.traces.trace import Trace


def system_names(system: System) -> list[str]:
    """Return the names allowed in conditions and watches over the run of a system.

    Examples
    --------
    >>> from gms_fsm import Body, Contact, System
    >>> from gms_fsm.charts import CHARTS
    >>> pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
    >>> system_names(System("sled", bodies=(Body("sled", inertia=2.0),), contacts=(pad,)))
    ['t', 'x', 'v', 'pad.x', 'pad.v', 'pad.F', 'pad.F1', 'F', 'F1']
    """
    names = [*system.names]
    for contact in system.contacts:
        names += [f"{contact.name}.{name}" for name in _names_of(contact)]
    if len(system.contacts) == 1:
        names += _names_of(system.contacts[0])
    return list(dict.fromkeys(names))


def _names_of(contact: Contact) -> list[str]:
    """Return the names that belong to a contact, without its own."""
    chart = contact.chart
    own = [name for name in watch_names(contact) if name not in ("t", "x", "v", "F")]
    return ["x", *chart.velocities, *chart.force_names, *own]


def owners_of(system: System) -> dict[str, Owner]:
    """Return whose states conditions may name: those of each contact's elements."""
    found, first = {}, 0
    for contact in system.contacts:
        states = tuple(state.name for state in contact.chart.states)
        found[contact.name] = Owner(first, contact.n, states)
        first += contact.n
    return found


def given_values(system: System, t: float) -> dict[str, float]:
    """Return the values at a time of what is given: signals, and velocities of driven bodies."""
    wanted = {*system.signals, *(body.v for body in system.bodies if body.driven)}
    values: dict[str, float] = {"t": t, **system.numbers}
    found: dict[str, float] = {}
    for each in system.assembly.definitions:
        if each.name not in wanted:
            continue
        try:
            if isinstance(each.signal, Corners):
                value = piecewise_linear(t, each.signal.times.tolist(), each.signal.values.tolist())
            elif isinstance(each.signal, Function):
                value = float(each.signal.call(t))
            else:
                assert each.tree is not None
                value = float(evaluate(each.tree, values))
        except (ArithmeticError, ValueError, TypeError, SignalError):
            value = math.nan
        values[each.name] = found[each.name] = value
    return found


@dataclass(frozen=True, eq=False)
class SystemScope:
    """The values of a system's run by name, at one row or at all rows.

    Parameters
    ----------
    system : System
        What runs.
    layout : SystemLayout
        Places of the values.
    t : float or ndarray, shape (rows,)
        Time, s.
    y : sequence of float, or ndarray, shape (places, rows)
        The state vector.
    given : mapping of str to float or ndarray, shape (rows,)
        Signals, and velocities of driven bodies.
    contacts : mapping of str to Scope
        What belongs to each contact.

    Examples
    --------
    >>> from gms_fsm import Body, Contact, System, simulate
    >>> from gms_fsm.charts import CHARTS
    >>> pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
    >>> sled = System("sled", bodies=(Body("sled", inertia=2.0, force="t"),), contacts=(pad,))
    >>> values = SystemScope.over(simulate(sled, 1.0)).watches()
    >>> float(values["pad.F"][-1]), str(values["state(1)"][-1]), float(values["v"][-1])
    (1.0, 'stuck', 0.0)
    """

    system: System
    layout: SystemLayout
    t: Any
    y: Any
    given: Mapping[str, Any]
    contacts: Mapping[str, Scope]

    @classmethod
    def of(
        cls, system: System, program: Program, t: float, y: list[float], mode: Sequence[int]
    ) -> SystemScope:
        """Return the scope of the present state of a run."""
        observed = program.layout.observed.named(observe(program, t, y, mode))
        contacts = {
            each.name: Scope.of(each, program, t, y, mode, each.name, observed)
            for each in system.contacts
        }
        return cls(system, program.layout, t, y, given_values(system, t), contacts)

    @classmethod
    def over(cls, trace: Trace) -> SystemScope:
        """Return the scope of all rows of a finished run."""
        system, rows = trace.what.system, trace.rows
        at_rows = [given_values(system, t) for t in rows.t.tolist()]
        given = {name: np.array([at[name] for at in at_rows]) for name in (at_rows or [{}])[0]}
        contacts = {name: Scope.over(trace.contact(name)) for name in trace.contacts}
        return cls(system, trace.program.layout, rows.t, rows.y.T, given, contacts)

    def value(self, name: str) -> Any:
        """Return the value of a name of the system, such as the position of a body."""
        if name == "t":
            return self.t
        if name in self.system.numbers:
            return self.system.numbers[name]
        if name in self.given:
            return self.given[name]
        if name in self.system.let:
            tree = self.system.assembly.expanded(Name(name))
            found = values_of(tree, {each: self.value(each) for each in ("t", *names_in(tree))})
            return found if found.ndim else float(found)
        return self.y[self.layout.y.index(name)]

    def watches(self) -> dict[str, Any]:
        """Return the values of all names allowed in conditions, and the states."""
        values: dict[str, Any] = {}
        for bank in self.layout.banks:
            own = self._of_contact(bank)
            values |= {f"{bank.name}.{name}": value for name, value in own.items()}
            if len(self.contacts) == 1:
                values |= own
            states = self.contacts[bank.name].states
            values |= {f"state({bank.first + i + 1})": state for i, state in enumerate(states)}
            if len(self.contacts) == 1 and bank.n == 1:
                values["state(0)"] = states[0]
        return values | {name: self.value(name) for name in self.system.names}

    def _of_contact(self, bank: BankPlaces) -> dict[str, Any]:
        scope = self.contacts[bank.name]
        chart, watched = scope.model.chart, scope.watches()
        watched |= {name: scope.seen[name] for name in (*chart.velocities, *chart.force_names)}
        return {name: watched[name] for name in _names_of(self.system.contact(bank.name))}
