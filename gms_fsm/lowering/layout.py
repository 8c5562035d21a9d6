"""The layout of the state vector y, of a run's observed quantities, of the modes and of the log.

No other module computes such a position, neither as a number nor as text: it looks it up by name.

y            ``x, [v,]`` then each variable of the chart, one per element
observed     ``v, F`` then ``s``, ``F_elements`` and the rate of each variable, one per element
modes        the active state of each element, then for each surface whether the motion slides on it
log          the fields of `LogRecord`
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, NamedTuple, TypeVar

from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig

__all__ = ["LOG_NUMBERS", "LOG_TEXTS", "Layout", "LogRecord", "Places"]

Name = TypeVar("Name", bound=Hashable)


@dataclass(frozen=True)
class Places(Generic[Name]):
    """The layout of an array: shared names first, then each own name with one place per element.

    In generated text, the number of elements is called ``n`` and the element ``i``.

    Parameters
    ----------
    shared : tuple
        Names with one place each.
    own : tuple
        Names with one place per element each.
    n : int
        Number of elements.

    Examples
    --------
    >>> y = Places(("x", "v"), ("z", "w"), n=3)
    >>> y.size, y.index("v"), y.index("w", 2), y.block("z")
    (8, 1, 7, slice(2, 5, None))
    >>> y.text("v"), y.text("z"), y.text("w"), y.size_text()
    ('1', '2 + i', '2 + n + i', '2 + 2 * n')
    >>> y.named([0.0, 0.1, 1, 2, 3, 4, 5, 6])
    {'x': 0.0, 'v': 0.1, 'z': [1, 2, 3], 'w': [4, 5, 6]}
    """

    shared: tuple[Name, ...]
    own: tuple[Name, ...]
    n: int

    @cached_property
    def size(self) -> int:
        """The number of places."""
        return len(self.shared) + len(self.own) * self.n

    def __iter__(self) -> Iterator[tuple[Name, int | None]]:
        """Yield the name and element (None if shared) of each place, in order."""
        yield from ((name, None) for name in self.shared)
        yield from ((name, i) for name in self.own for i in range(self.n))

    def index(self, name: Name, element: int = 0) -> int:
        """Return the place of a shared name, or of an own name for one element.

        Parameters
        ----------
        name : str or other key
            An entry of `shared` or `own`.
        element : int
            Counted from 0; ignored for a shared name.

        Returns
        -------
        int
            The place.
        """
        start = self._starts[name]
        return start if start < len(self.shared) else start + element

    @cached_property
    def _starts(self) -> Mapping[Name, int]:
        """The first place of each name."""
        starts = {name: place for place, name in enumerate(self.shared)}
        for row, name in enumerate(self.own):
            starts[name] = len(self.shared) + row * self.n
        return starts

    def block(self, name: Name) -> slice:
        """Return the places of an own name, one per element.

        Parameters
        ----------
        name : str or other key
            An entry of `own`.

        Returns
        -------
        slice
            Of length n.
        """
        start = self.index(name)
        return slice(start, start + self.n)

    def where(self, name: Name) -> int | slice:
        """Return an index that selects everything stored under a name.

        Parameters
        ----------
        name : str or other key
            An entry of `shared` or `own`.

        Returns
        -------
        int or slice
            Like `index` for a shared name, like `block` for an own one.
        """
        return self._all[name]

    @cached_property
    def _all(self) -> Mapping[Name, int | slice]:
        """The index for each name."""
        shared = {name: self._starts[name] for name in self.shared}
        return shared | {name: self.block(name) for name in self.own}

    def all_of(self, name: Name) -> range:
        """Return the places of a name: one if it is shared, else one per element.

        Parameters
        ----------
        name : str or other key
            An entry of `shared` or `own`.

        Returns
        -------
        range
            In order.
        """
        start = self.index(name)
        return range(start, start + (1 if name in self.shared else self.n))

    def named(self, values: Any) -> dict[Name, Any]:
        """Return the values of an array by name.

        Parameters
        ----------
        values : sequence, or ndarray with the places as its first axis
            One entry per place.

        Returns
        -------
        dict
            For a shared name its entry; for an own name its part of `values`, one per element.
        """
        return {name: values[where] for name, where in self._all.items()}

    def joined(self, values: Mapping[Name, Any]) -> list[Any]:
        """Return values in the order of the places; the inverse of `named`.

        Parameters
        ----------
        values : mapping
            For a shared name its entry; for an own name a sequence with one entry per element.

        Returns
        -------
        list
            One entry per place.
        """
        return [values[name] if i is None else values[name][i] for name, i in self]

    # ------------------------------------------------------------------ as text
    def text(self, name: Name) -> str:
        """Return a place as Python text in terms of ``n`` and ``i``.

        Parameters
        ----------
        name : str or other key
            An entry of `shared` or `own`.

        Returns
        -------
        str
            For example ``"1"`` or ``"2 + n + i"``.
        """
        if name in self.shared:
            return str(self.shared.index(name))
        row = self.own.index(name)
        blocks = {0: "", 1: " + n"}.get(row, f" + {row} * n")
        return f"{len(self.shared)}{blocks} + i"

    def text_names(self, name: Name) -> frozenset[str]:
        """Return which of ``n`` and ``i`` the text of a place uses.

        Parameters
        ----------
        name : str or other key
            An entry of `shared` or `own`.

        Returns
        -------
        frozenset of str
            Empty for a shared name.
        """
        if name in self.shared:
            return frozenset()
        return frozenset({"i"} if name == self.own[0] else {"n", "i"})

    def size_text(self, more: int = 0) -> str:
        """Return the number of places plus `more`, as Python text in terms of ``n``."""
        return f"{len(self.shared) + more} + {len(self.own)} * n"

    def membership_text(self, name: Name, place: str) -> tuple[str, str]:
        """Return texts that test whether a place belongs to a name, names being tested in order.

        Parameters
        ----------
        name : str or other key
            An entry of `shared` or `own`; all names before it have already been tested.
        place : str
            Text of the place.

        Returns
        -------
        (str, str)
            A test for whether the place belongs to this name, and its element (empty if shared).
        """
        if name in self.shared:
            return f"{place} == {self.shared.index(name)}", ""
        behind = f"{place} - {len(self.shared)}" if self.shared else place
        row = self.own.index(name)
        return f"{behind} < {row + 1} * n", f"{behind} - {row} * n"


@dataclass(frozen=True)
class Layout:
    """The places of a model on a rig.

    Parameters
    ----------
    y : Places
        Layout of the state vector: ``x``, ``v`` unless prescribed, and the chart's variables.
    observed : Places
        Layout of the observed quantities: ``v, F``; ``s``, ``F_elements``, and ``d`` before each
        variable.
    surfaces : int
        Number of surfaces on which the motion can slide.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> layout = Layout.of(model, Prescribed("0.1*t"), surfaces=0)
    >>> layout.y.index("z", 3), layout.observed.block("s"), layout.modes
    (4, slice(2, 6, None), 4)
    """

    y: Places[str]
    observed: Places[str]
    surfaces: int

    @classmethod
    def of(cls, model: Model, rig: Rig, surfaces: int) -> Layout:
        """Return the layout for a model on a rig.

        Parameters
        ----------
        model, rig
            The model and the rig.
        surfaces : int
            Number of surfaces on which the motion can slide.

        Returns
        -------
        Layout
            The layout of this run.
        """
        variables = model.chart.variables
        rates = tuple(f"d{name}" for name in variables)
        return cls(
            cls.state(model, rig),
            Places(("v", "F"), ("s", "F_elements", *rates), model.n),
            surfaces,
        )

    @staticmethod
    def state(model: Model, rig: Rig) -> Places[str]:
        """Return the layout of the state vector alone, which needs no generated program.

        Parameters
        ----------
        model, rig
            The model and the rig.

        Returns
        -------
        Places
            See `Layout.y`.
        """
        moved = ("x",) if rig.acceleration is None else ("x", "v")
        return Places(moved, model.chart.variables, model.n)

    @property
    def n(self) -> int:
        """Number of elements."""
        return self.y.n

    @property
    def variable(self) -> str:
        """The chart's first variable, the deflection, shown by the log and `Trace.z`."""
        return self.y.own[0]

    @property
    def rate(self) -> str:
        """Name of its rate among the observed quantities."""
        return f"d{self.variable}"

    # ------------------------------------------------------------------ modes
    @cached_property
    def modes(self) -> int:
        """The number of modes of a row."""
        return self.n + self.surfaces

    @cached_property
    def elements(self) -> slice:
        """Places of the elements' states among the modes."""
        return slice(0, self.n)

    @cached_property
    def slides(self) -> slice:
        """Places of the surfaces' flags among the modes."""
        return slice(self.n, None)

    def not_sliding(self, states: Sequence[int]) -> tuple[int, ...]:
        """Return the modes of elements in the given states, with no surface sliding.

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


class LogRecord(NamedTuple):
    """One firing, as recorded in the transition log.

    ``z``, ``v`` and ``s`` are the element's first variable, the velocity and the threshold before
    it.
    """

    t: float
    element: int  # from 0
    edge: str
    source: str
    target: str
    z: float
    v: float
    s: float
    F_before: float
    F_after: float


LOG_TEXTS = ("edge", "source", "target")
# In the order in which machine code stores them for a firing.
LOG_NUMBERS = ("z", "v", "s", "F_before", "F_after")
