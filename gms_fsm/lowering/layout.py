"""The layout of the state vector y, of a run's observed quantities, of the modes and of the log.

No other module computes such a position, neither as a number nor as text: it looks it up by name.
Names are those of the trees (`gms_fsm.systems._assembly`): what belongs to a contact is called
``contact.name``.

y            position and, unless it is driven, velocity of each body; further states; sampled
             values; then for each contact each variable of its chart, one per element
observed     velocity and force of each contact; then for each contact ``s``, ``F_elements`` and the
             rate of each variable, one per element
modes        the active state of each element, contact by contact, then for each surface whether the
             motion slides on it
log          the fields of `LogRecord`
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError, shown
from gms_fsm.language import names_in
from gms_fsm.lowering.log_columns import LOG_TEXTS
from gms_fsm.systems._assembly import Assembly, Bank, of

__all__ = [
    "BankPlaces",
    "Block",
    "Layout",
    "Places",
]

Name = TypeVar("Name", bound=Hashable)


@dataclass(frozen=True)
class Block(Generic[Name]):
    """Names with one place per element each.

    Parameters
    ----------
    names : tuple
        One after the other.
    n : int
        Number of elements.
    size : str
        What their number is called in generated text.
    """

    names: tuple[Name, ...]
    n: int
    size: str = "n"


@dataclass(frozen=True)
class Places(Generic[Name]):
    """The layout of an array: shared names first, then blocks of names with a place per element.

    In generated text the element is called ``i``.

    Parameters
    ----------
    shared : tuple
        Names with one place each.
    blocks : tuple of Block
        Names with one place per element each.

    Examples
    --------
    >>> y = Places(("x", "v"), (Block(("z", "w"), 3),))
    >>> y.size, y.index("v"), y.index("w", 2), y.block("z")
    (8, 1, 7, slice(2, 5, None))
    >>> y.text("v"), y.text("z"), y.text("w"), y.size_text()
    ('1', '2 + i', '2 + n + i', '2 + 2 * n')
    >>> y.named([0.0, 0.1, 1, 2, 3, 4, 5, 6])
    {'x': 0.0, 'v': 0.1, 'z': [1, 2, 3], 'w': [4, 5, 6]}
    """

    shared: tuple[Name, ...]
    blocks: tuple[Block[Name], ...]

    @cached_property
    def own(self) -> tuple[Name, ...]:
        """The names with one place per element."""
        return tuple(name for block in self.blocks for name in block.names)

    @cached_property
    def size(self) -> int:
        """The number of places."""
        return len(self.shared) + sum(len(block.names) * block.n for block in self.blocks)

    def __iter__(self) -> Iterator[tuple[Name, int | None]]:
        """Yield for each place, in order, its name and its element (None if shared)."""
        yield from ((name, None) for name in self.shared)
        for block in self.blocks:
            yield from ((name, i) for name in block.names for i in range(block.n))

    def index(self, name: Name, element: int = 0) -> int:
        """Return the place of a shared name, or of an own name of one element.

        Parameters
        ----------
        name : str or other key
            One of `shared` or `own`.
        element : int
            Counted from 0; ignored for a shared name.

        Returns
        -------
        int
            The place.
        """
        start, _ = self._spans[name]
        return start if start < len(self.shared) else start + element

    @cached_property
    def _spans(self) -> Mapping[Name, tuple[int, int]]:
        """First place and number of places of each name."""
        spans = {name: (place, 1) for place, name in enumerate(self.shared)}
        start = len(self.shared)
        for block in self.blocks:
            for name in block.names:
                spans[name] = start, block.n
                start += block.n
        return spans

    def block(self, name: Name) -> slice:
        """Return the places of an own name, one per element.

        Parameters
        ----------
        name : str or other key
            One of `own`.

        Returns
        -------
        slice
            One place per element.
        """
        start, count = self._spans[name]
        return slice(start, start + count)

    def where(self, name: Name) -> int | slice:
        """Return the subscript for an array that selects everything under a name.

        Parameters
        ----------
        name : str or other key
            One of `shared` or `own`.

        Returns
        -------
        int or slice
            As `index` for a shared name, as `block` for an own one.
        """
        return self._all[name]

    @cached_property
    def _all(self) -> Mapping[Name, int | slice]:
        """The subscript of each name."""
        shared: dict[Name, int | slice] = {name: self._spans[name][0] for name in self.shared}
        return shared | {name: self.block(name) for name in self.own}

    def all_of(self, name: Name) -> range:
        """Return the places of a name: one if it is shared, else one per element.

        Parameters
        ----------
        name : str or other key
            One of `shared` or `own`.

        Returns
        -------
        range
            In order.
        """
        start, count = self._spans[name]
        return range(start, start + count)

    def named(self, values: Any) -> dict[Name, Any]:
        """Return the values by name.

        Parameters
        ----------
        values : sequence, or ndarray with the places as its first axis
            One entry per place.

        Returns
        -------
        dict
            For a shared name its entry, for an own name its part of `values`, one per element.
        """
        return {name: values[where] for name, where in self._all.items()}

    def joined(self, values: Mapping[Name, Any]) -> list[Any]:
        """Return entries in the order of the places; the inverse of `named`.

        Parameters
        ----------
        values : mapping
            For a shared name its entry, for an own name a sequence with one entry per element.

        Returns
        -------
        list
            One entry per place.
        """
        return [values[name] if i is None else values[name][i] for name, i in self]

    # ------------------------------------------------------------------ as text
    def text(self, name: Name) -> str:
        """Return a place as Python text over ``i`` and the sizes.

        Parameters
        ----------
        name : str or other key
            One of `shared` or `own`.

        Returns
        -------
        str
            Such as ``"1"`` or ``"2 + n + i"``.
        """
        if name in self.shared:
            return str(self.shared.index(name))
        return f"{self.start_text(name)} + i"

    def start_text(self, name: Name, after: int = 0) -> str:
        """Return the first place of a name as Python text over the sizes.

        Parameters
        ----------
        name : str or other key
            One of `shared` or `own`.
        after : int
            Of the names after it in its block instead, this many on.

        Returns
        -------
        str
            Such as ``"2 + n"``.
        """
        if name in self.shared:
            return str(self.shared.index(name) + after)
        terms = [str(len(self.shared))]
        for block in self.blocks:
            rows = block.names.index(name) + after if name in block.names else len(block.names)
            if rows:
                terms.append(block.size if rows == 1 else f"{rows} * {block.size}")
            if name in block.names:
                break
        return " + ".join(terms)

    def sizes(self, name: Name) -> frozenset[str]:
        """Return which sizes the text of a place reads.

        Parameters
        ----------
        name : str or other key
            One of `shared` or `own`.

        Returns
        -------
        frozenset of str
            Empty for a shared name.
        """
        found = set[str]()
        if name in self.shared:
            return frozenset()
        for block in self.blocks:
            if name in block.names:
                return frozenset(found | ({block.size} if block.names.index(name) else set()))
            if block.names:
                found.add(block.size)
        raise KeyError(name)

    def size_text(self, more: int = 0) -> str:
        """Return how many places there are, and some more, as Python text over the sizes."""
        terms = [str(len(self.shared) + more)]
        terms += [f"{len(block.names)} * {block.size}" for block in self.blocks]
        return " + ".join(terms)


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
class Layout:
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
    >>> from gms_fsm.systems._assembly import assembled
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> layout = Layout.of(assembled(system_of(model, Prescribed("0.1*t"))), surfaces=0)
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
    def of(cls, read: Assembly, surfaces: int) -> Layout:
        """Return the layout of a system.

        Parameters
        ----------
        read : Assembly
            The system, read.
        surfaces : int
            Number of surfaces on which the motion can slide.

        Returns
        -------
        Layout
            For its runs.
        """
        system, banks, first, edges = read.system, [], 0, 0
        for bank in read.banks:
            variables = bank.chart.variables
            velocity = bank.chart.velocities[0]
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
            Block((*bank.variables, *held_of(bank)), bank.n, size)
            for bank, size in zip(read.banks, sizes, strict=True)
        )
        seen = tuple(
            Block(
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
        y = Places((*moved, *system.flow, *updated, *held), blocks)
        keys = {name: name for name, _ in y}
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
    def firsts(self) -> NDArray[np.int64]:
        """The first machine of each contact, over all contacts."""
        return np.array([bank.first for bank in self.banks])

    def bank(self, machine: int) -> BankPlaces:
        """Return the contact of a machine, which are counted over all contacts."""
        return next(bank for bank in self.banks if machine < bank.first + bank.n)

    def contact(self, name: str = "") -> BankPlaces:
        """Return a contact by name; without a name the only one.

        Parameters
        ----------
        name : str
            The contact's.

        Returns
        -------
        BankPlaces
            Its places.

        Raises
        ------
        ParameterError
            If there is no such contact, or several and no name.
        """
        if not name and len(self.banks) == 1:
            return self.banks[0]
        for bank in self.banks:
            if bank.name == name:
                return bank
        known = ", ".join(repr(bank.name) for bank in self.banks)
        if not name:
            raise ParameterError(
                f"the system has the contacts {known}",
                advice=f"say which one: .contact({self.banks[0].name!r})",
            )
        raise ParameterError(f"there is no contact {shown(name)}", advice=f"there are {known}")

    @cached_property
    def recorded(self) -> tuple[list[int], list[list[int]]]:
        """Where the numbers of `LogRecord` are for each machine.

        The place in y of its first variable (-1 if its chart has none), and the places of v, s and
        F among the observed quantities.
        """
        own: list[int] = []
        seen: list[list[int]] = []
        for bank in self.banks:
            v, F = (self.observed.shared.index(bank.of(name)) for name in (bank.velocity, "F"))
            for i in range(bank.n):
                first = bank.variables[:1]
                own += [self.y.index(bank.of(name), i) for name in first] or [-1]
                seen.append([v, self.observed.index(bank.of("s"), i), F])
        return own, seen

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
        """Return the modes of elements in these states, sliding on no surface.

        Parameters
        ----------
        states : sequence of int, shape (n,)
            Active state of each element.

        Returns
        -------
        tuple of int, shape (modes,)
            The modes of a row.
        """
        return (*states, *[0] * self.surfaces)


def held_of(bank: Bank) -> tuple[str, ...]:
    """Return what is held of each element of a contact with a period: rates, then forces."""
    if not bank.periodic:
        return ()
    rates = [bank.held(bank.rate(name)) for name in bank.variables]
    return (*rates, *(bank.held(f"{force}_elements") for force in bank.forces))


def sizes_of(banks: Sequence[Bank]) -> tuple[str, ...]:
    """Return what the number of elements of each contact is called in generated text."""
    return ("n",) if len(banks) == 1 else tuple(f"n_{bank.name}" for bank in banks)


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
    blocks: list[Block[str]] = []
    for bank, size in zip(read.banks, sizes_of(read.banks), strict=True):
        guards = frozenset[str]().union(*(names_in(edge.guard) for edge in bank.edges))
        late = [name for name in (*bank.forces, *bank.rates) if name in guards]
        names = ["x", *bank.chart.velocities, *bank.chart.inputs]
        lets = [of(bank.name, name) for name in bank.chart.let]
        shared += [of(bank.name, name) for name in dict.fromkeys(names) if name not in ("t", "s")]
        shared += [*late, *(name for name in lets if name not in read.owner)]
        own = [name for name in lets if name in read.owner]
        threshold = of(bank.name, "s")
        blocks.append(Block(tuple(dict.fromkeys([threshold, *own])), bank.n, size))
    return Places(tuple(shared), tuple(blocks))
