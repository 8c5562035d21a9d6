"""The layout of the state vector y, of a run's observed quantities, of the modes and of the log.

No other module computes such a position, neither as a number nor as text: it looks it up by name.
Names are those of the trees (`gms_fsm.systems.reading.assembly`): what belongs to a contact is
called ``contact.name``.

y            position and, unless it is driven, velocity of each body; further states; sampled
             values; then for each contact each variable of its chart, one per element
observed     velocity and force of each contact; then for each contact ``s``, ``F_elements`` and the
             rate of each variable, one per element
modes        the active state of each element, contact by contact, then for each surface whether the
             motion slides on it
log          the fields of `LogRecord`
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import some_of, unknown
from gms_fsm.language import EVENT, names_in
from gms_fsm.lowering.log_columns import LOG_TEXTS
from gms_fsm.lowering.places import ElementPlaces, Places
from gms_fsm.systems.reading.assembly import Assembly, Bank, of


@dataclass(frozen=True)
class BankPlaces:
    """Where the quantities of one contact are.

    Parameters
    ----------
    name : str
        The contact's.
    n : int
        Number of elements.
    first : int
        Machine number of its first element.
    variables : tuple of str
        The chart's, without the contact's name.
    velocity : str
        What the chart calls its velocity, the first one.
    first_edge : int
        Number of its first edge, which are counted over all contacts.
    position : str
        Name of its relative position: in the state vector, or among what is observed.
    """

    name: str
    n: int
    first: int
    variables: tuple[str, ...]
    velocity: str
    first_edge: int
    position: str

    def of(self, name: str) -> str:
        """Return what a name of the contact is called in the layout."""
        return of(self.name, name)

    def plain(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the values of the contact by their names without the contact's."""
        start = self.of("")
        return {
            name.removeprefix(start): value
            for name, value in values.items()
            if name.startswith(start)
        }

    @property
    def elements(self) -> slice:
        """The places of its elements' states among the modes."""
        return slice(self.first, self.first + self.n)


@dataclass(frozen=True)
class SystemLayout:
    """The layout of a system.

    Parameters
    ----------
    y : Places
        State vector.
    observed : Places
        Observed quantities.
    shown : Places
        What guards, and the machines' elements, can read besides variables and parameters.
    banks : tuple of BankPlaces
        The contacts.
    surfaces : int
        Number of surfaces on which the motion can slide.
    keys : mapping of str to str
        For what a user may call a component of the state vector its name there: ``load.x`` for the
        position of the body load, and where there is one contact ``z`` for its variable z.
    edges : tuple of tuple of str
        Name, source and target of each edge, over all contacts.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> from gms_fsm.systems.reading.assembly import assembled
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> layout = SystemLayout.of(assembled(system_of(model, Prescribed("0.1*t"))), surfaces=0)
    >>> layout.y.index("friction.z", 3), layout.observed.block("friction.s"), layout.modes
    (4, slice(2, 6, None), 4)
    """

    y: Places[str]
    observed: Places[str]
    shown: Places[str]
    banks: tuple[BankPlaces, ...]
    surfaces: int
    keys: Mapping[str, str]
    edges: tuple[tuple[str, str, str], ...]

    @classmethod
    def of(cls, read: Assembly, surfaces: int) -> SystemLayout:
        """Return the layout of a system."""
        system, banks, first, edges = read.system, [], 0, 0
        for bank in read.banks:
            variables = bank.chart.variables
            velocity = (*bank.chart.velocities, "")[0]
            position = bank.position
            banks.append(BankPlaces(bank.name, bank.n, first, variables, velocity, edges, position))
            first += bank.n
            edges += len(bank.edges)
        moved = (
            name
            for body in system.bodies
            for name in ((body.x,) if body.driven else (body.x, body.v))
        )
        updated = (name for each in system.sampled for name in each.updates)
        sizes = sizes_of(read.banks)
        blocks = tuple(
            ElementPlaces((*bank.variables, *held_of(bank)), bank.n, size)
            for bank, size in zip(read.banks, sizes, strict=True)
        )
        seen = tuple(
            ElementPlaces(
                (
                    of(bank.name, "s"),
                    *(f"{force}_elements" for force in bank.forces),
                    *(bank.rate(name) for name in bank.variables),
                ),
                bank.n,
                size,
            )
            for bank, size in zip(read.banks, sizes, strict=True)
        )
        held = [bank.held(force) for bank in read.banks if bank.periodic for force in bank.forces]
        y = Places((*moved, *system.flow, *updated, *system.events, *held), blocks)
        keys = {name.removeprefix(EVENT): name for name in system.events}
        keys |= {name: name for name, _ in y}
        for body in system.bodies:
            keys |= {f"{body.name}.x": body.x, f"{body.name}.v": body.v}
        if len(banks) == 1:
            keys |= {name: of(banks[0].name, name) for name in banks[0].variables}
        return cls(
            y,
            Places(tuple(name for bank in read.banks for name in observed_of(bank)), seen),
            shown_of(read),
            tuple(banks),
            surfaces,
            {key: name for key, name in keys.items() if name in y.shared or name in y.own},
            tuple((e.name, e.source, e.target) for bank in read.banks for e in bank.edges),
        )

    def label(self, name: str) -> str:
        """Return what a component of the state vector is called for the user."""
        return name.split(".", 1)[-1] if len(self.banks) == 1 else name

    def labelled(self, values: Sequence[float]) -> dict[str, Any]:
        """Return one value for each component, by what they are called; of elements as lists."""
        return dict(zip(self._labels, self.y.named(values).values(), strict=True))

    @cached_property
    def _labels(self) -> tuple[str, ...]:
        """What the components of the state vector are called."""
        return tuple(map(self.label, (*self.y.shared, *self.y.own)))

    @cached_property
    def events(self) -> tuple[str, ...]:
        """The events, as components of the state vector."""
        return tuple(name for name in self.y.shared if name.startswith(EVENT))

    @cached_property
    def n(self) -> int:
        """Number of elements of all contacts."""
        return sum(bank.n for bank in self.banks)

    @cached_property
    def log_texts(self) -> tuple[NDArray[np.str_], ...]:
        """The columns `LOG_TEXTS` of the log, for each edge."""
        columns = zip(*self.edges, strict=True) if self.edges else ((),) * len(LOG_TEXTS)
        return tuple(np.array(column, dtype=np.str_) for column in columns)

    @cached_property
    def edge_owners(self) -> NDArray[np.int64]:
        """The number of the contact of each edge."""
        firsts = [bank.first_edge for bank in self.banks]
        return np.searchsorted(firsts, np.arange(len(self.edges)), "right") - 1

    @cached_property
    def edge_codes(self) -> Mapping[tuple[str, ...], int]:
        """The number of each edge, by its contact and its texts in the log."""
        owners = (self.banks[k].name for k in self.edge_owners.tolist())
        named = zip(owners, self.edges, strict=True)
        return {(owner, *texts): k for k, (owner, texts) in enumerate(named)}

    @cached_property
    def firsts(self) -> NDArray[np.int64]:
        """The first machine of each contact, over all contacts."""
        return np.array([bank.first for bank in self.banks])

    def owners(self, machines: NDArray[Any]) -> NDArray[np.int64]:
        """Return the number of the contact of each of some machines."""
        return np.searchsorted(self.firsts, machines, "right") - 1

    def bank(self, machine: int) -> BankPlaces:
        """Return the contact of a machine, which are counted over all contacts."""
        return next(bank for bank in self.banks if machine < bank.first + bank.n)

    def contact(self, name: str = "") -> BankPlaces:
        """Return a contact by name; without a name the only one."""
        if not name and len(self.banks) == 1:
            return self.banks[0]
        for bank in self.banks:
            if bank.name == name:
                return bank
        known = [bank.name for bank in self.banks]
        if not name:
            raise ParameterError(
                f"the system has the contacts {some_of(known)}",
                advice=f"say which one: .contact({known[0]!r})",
            )
        raise unknown("contact", name, known)

    @cached_property
    def recorded(self) -> tuple[list[int], list[list[int]]]:
        """Where the numbers of `LogRecord` are for each machine.

        The place in y of its first variable (-1 if its chart has none), and the places of v, s and
        F among the observed quantities.
        """
        own: list[int] = []
        seen: list[list[int]] = []
        for bank in self.banks:
            for i in range(bank.n):
                s = self.observed.index(bank.of("s"), i)  # NaN where there is no curve
                shared = self.observed.shared
                v, F = (
                    shared.index(name) if name in shared else s
                    for name in (bank.of(bank.velocity), bank.of("F"))
                )
                first = bank.variables[:1]
                own += [self.y.index(bank.of(name), i) for name in first] or [-1]
                seen.append([v, s, F])
        return own, seen

    def place(self, name: str, element: int = 0) -> int:
        """Return the place of a value in the state, or after it among what is observed."""
        if name in (*self.y.shared, *self.y.own):
            return self.y.index(name, element)
        return self.y.size + self.observed.index(name, element)

    # ------------------------------------------------------------------ modes
    @cached_property
    def modes(self) -> int:
        """Number of modes per row."""
        return self.n + self.surfaces

    @cached_property
    def elements(self) -> slice:
        """The places of the elements' states among the modes."""
        return slice(0, self.n)

    @cached_property
    def slides(self) -> slice:
        """The places of the surfaces' flags among the modes."""
        return slice(self.n, None)

    def not_sliding(self, states: Sequence[int]) -> tuple[int, ...]:
        """Return the modes of elements in these states, sliding on no surface."""
        return (*states, *[0] * self.surfaces)


def held_of(bank: Bank) -> tuple[str, ...]:
    """Return what is held of each element of a contact with a period: rates, then forces."""
    if not bank.periodic:
        return ()
    rates = [bank.held(bank.rate(name)) for name in bank.variables]
    return (*rates, *(bank.held(f"{force}_elements") for force in bank.forces))


def sizes_of(banks: Sequence[Bank]) -> tuple[str, ...]:
    """Return the number of elements of each contact in generated text: n if there is one only."""
    return ("n",) if len(banks) == 1 else tuple(str(bank.n) for bank in banks)


def observed_of(bank: Bank) -> tuple[str, ...]:
    """Return the names of a contact that are observed with one value."""
    names = [*(of(bank.name, name) for name in bank.chart.velocities), *bank.forces]
    if bank.position == of(bank.name, "x"):
        names.append(bank.position)
    if bank.chart.locks:
        names += [f"{force} shared" for force in bank.forces]
    return tuple(names)


def shown_of(read: Assembly) -> Places[str]:
    """Lay out what guards, and the machines' elements, can read."""
    shared: list[str] = []
    blocks: list[ElementPlaces[str]] = []
    for bank, size in zip(read.banks, sizes_of(read.banks), strict=True):
        guards = frozenset[str]().union(*(names_in(edge.guard) for edge in bank.edges))
        late = [name for name in (*bank.forces, *bank.rates) if name in guards]
        names = [*["x"][: len(bank.velocities)], *bank.chart.velocities, *bank.chart.inputs]
        lets = [of(bank.name, name) for name in bank.chart.let]
        shared += [of(bank.name, name) for name in dict.fromkeys(names) if name not in ("t", "s")]
        shared += [*late, *(name for name in lets if name not in read.owner)]
        own = [name for name in lets if name in read.owner]
        threshold = of(bank.name, "s")
        blocks.append(ElementPlaces(tuple(dict.fromkeys([threshold, *own])), bank.n, size))
    return Places(tuple(shared), tuple(blocks))
