"""What a name means in a condition over the run of a system: in ``until``, a watch, a monitor.

The names of the system mean what they mean in its texts. What belongs to a contact has its name in
front: ``gear.F``, ``gear.z1``, ``gear.state(1)``. In a system with one contact or supervisor in all
these names may also be written without it, unless the system itself uses them. A model on a rig has
the names of `gms_fsm.traces.scope`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.errors import UnitError, shown
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.foundation.quantities import UNITS, convert_numbers, factor, per_second
from gms_fsm.foundation.quantities import in_si as number_in_si
from gms_fsm.language import Name, Owner, names_in, values_of
from gms_fsm.lowering.layout import BankPlaces, SystemLayout
from gms_fsm.lowering.observing import observe
from gms_fsm.lowering.program import Program
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.system import Contact, System
from gms_fsm.traces.scope import Scope, unit_of, watch_names
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import given_values

# What the units of SI measure; a force is a force, also where it is a normal force.
MEASURED = {
    unit: quantity
    for quantity, units in reversed(UNITS.items())
    for unit, factor in units.items()
    if factor == 1.0
}


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
    for contact in system.machines:
        names += [f"{contact.name}.{name}" for name in _names_of(contact)]
    if len(system.machines) == 1:
        names += _names_of(system.machines[0])
    return list(dict.fromkeys(names))


def _names_of(contact: Contact) -> list[str]:
    """Return the names that belong to a contact, without its own."""
    chart = contact.chart
    own = [name for name in watch_names(contact) if name not in ("t", "x", "v", "F")]
    return [*["x"][: len(chart.velocities)], *chart.velocities, *chart.force_names, *own]


def owners_of(system: System) -> dict[str, Owner]:
    """Return whose states conditions may name: those of each contact's elements."""
    found, first = {}, 0
    for contact in system.machines:
        states = tuple(state.name for state in contact.chart.states)
        found[contact.name] = Owner(first, contact.n, states)
        first += contact.n
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
            for each in system.machines
        }
        return cls(system, program.layout, t, y, given_values(system, t), contacts)

    @classmethod
    def over(cls, trace: Trace) -> SystemScope:
        """Return the scope of all rows of a finished run."""
        system, rows = trace.what.system, trace.rows
        at_rows = [given_values(system, t) for t in rows.t.tolist()]
        given = {name: np.array([at[name] for at in at_rows]) for name in (at_rows or [{}])[0]}
        every = (bank.name for bank in trace.program.layout.banks)
        contacts = {name: Scope.over(trace.contact(name)) for name in every}
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
        if name not in self.layout.y.shared:  # an output of a supervisor
            owner, _, output = name.partition(".")
            return self.contacts[owner].seen[output]
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


# --------------------------------------------------------------------------- units
def names_of(what: Mounted) -> list[str]:
    """Return the names allowed in conditions and watches."""
    return system_names(what.system) if what.named else watch_names(what.model)


def units_of(what: Mounted, names: Iterable[str] = ()) -> dict[str, str]:
    """Return the units of names, as far as they are known.

    Without names, of those in conditions and watches.
    """
    every = [*names] or names_of(what)
    found: dict[str, str] = {}
    for contact in what.system.machines:
        chart = contact.chart
        for name in every:
            owner, _, last = name.rpartition(".")
            if what.named and (owner != contact.name or name in what.system.names):
                continue
            bare = re.sub(r"\d+$", "", last)
            if unit := unit_of(chart, last) or unit_of(chart, bare):
                found[name] = unit
    if what.named:
        known = dict(what.system.units)
        for body in what.system.bodies:
            known |= dict.fromkeys((body.x, f"{body.name}.x"), body.unit)
            known |= dict.fromkeys((body.v, f"{body.name}.v"), per_second(body.unit))
        found |= {name: known[name] for name in every if name in known}
    return found | {"t": "s"}


def in_si(what: Mounted, text: str, name: str = "", names: Iterable[str] = ()) -> str:
    """Return a text with numbers in SI for those with units, such as ``"v > 300 mm/s"``.

    With a name, the text is an expression for that name.
    """
    checked_kind("text", text, str, "a text")
    known = {each: MEASURED[u] for each, u in units_of(what, names).items() if u in MEASURED}
    return (
        convert_numbers(f"{name}=={text}", known).partition("==")[2]
        if name
        else convert_numbers(text, known)
    )


def asked_unit(what: Mounted, text: str) -> tuple[str, str, float]:
    """Return an expression without the unit that is asked for, such as ``F in mN``; unit, factor.

    The unit is empty if none is asked for.
    """
    found = re.fullmatch(r"(.+?)\s+in\s+(\S+)", text.strip())
    if found is None:
        return text, "", 1.0
    asked, unit = found.groups()
    known = MEASURED.get(units_of(what).get(asked, ""))
    size = factor(known, unit) if known else float(number_in_si(f"1 {unit}") or "nan")
    if math.isnan(size):
        raise UnitError(f"{shown(unit)} is not a unit", advice="for example mN, mm or mm/s")
    return asked, unit, size
