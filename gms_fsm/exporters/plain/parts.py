"""What a friction is made of, as text formats need it; see `gms_fsm.exporters.plain.element`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gms_fsm.language import Comparison, Condition, Value, comparisons, names_in, split
from gms_fsm.lowering.printing.plan import RoughCall


@dataclass(frozen=True)
class Constant:
    """A number, or one for each of several elements.

    Parameters
    ----------
    name : str
        In the text.
    value : float or tuple of float
        The number or the numbers.
    about : str
        Unit and meaning, for a comment.
    """

    name: str
    value: float | tuple[float, ...]
    about: str = ""

    @property
    def several(self) -> bool:
        """Whether each element has its own."""
        return isinstance(self.value, tuple)


@dataclass(frozen=True)
class Expression:
    """A value, in two forms.

    Parameters
    ----------
    tree : Value
        With corners and jumps where they are.
    smooth : Value
        With names in place of calls that have a corner or a jump.
    calls : tuple of RoughCall
        What these names are, in order.
    """

    tree: Value
    smooth: Value
    calls: tuple[RoughCall, ...] = ()

    @property
    def names(self) -> frozenset[str]:
        """What it reads."""
        return names_in(self.tree)


@dataclass(frozen=True)
class Let:
    """A quantity computed from others.

    Parameters
    ----------
    name : str
        In the text.
    value : Expression
        What it is.
    per_element : bool
        Whether each element has its own.
    moves : bool
        Whether it is computed from variables, which actions change.
    about : str
        For a comment.
    """

    name: str
    value: Expression
    per_element: bool
    moves: bool
    about: str = ""


@dataclass(frozen=True)
class Variable:
    """A continuous state of an element.

    Parameters
    ----------
    name, rate : str
        Of the variable, and of its derivative.
    start : tuple of float
        Initial values.
    about : str
        For a comment.
    """

    name: str
    rate: str
    start: tuple[float, ...]
    about: str = ""


@dataclass(frozen=True)
class Leaving:
    """An edge that leaves a state.

    Parameters
    ----------
    name : str
        Of the edge.
    number : int
        Among all edges, from 0.
    target : int
        Index of the state it enters.
    guard : Condition
        When it is taken.
    steps : tuple of (str, Value)
        Assignments to variables, in this order; each sees the results before it.
    """

    name: str
    number: int
    target: int
    guard: Condition
    steps: tuple[tuple[str, Value], ...]

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """The comparisons that its guard is made of."""
        return comparisons(split(self.guard))


@dataclass(frozen=True, eq=False)
class StateParts:
    """A state of an element.

    Parameters
    ----------
    name : str
        As in the chart.
    rates : mapping of str to Expression
        By variable.
    force : Expression
        Of the element; it may read the rates.
    edges : tuple of Leaving
        Highest priority first.
    corners : tuple of Value
        Where a rate or the force has a corner or a jump: where one of these is 0.
    """

    name: str
    rates: Mapping[str, Expression]
    force: Expression
    edges: tuple[Leaving, ...]
    corners: tuple[Value, ...]

    @property
    def flow_names(self) -> frozenset[str]:
        """What its rates and its force read."""
        return frozenset[str]().union(*(each.names for each in (*self.rates.values(), self.force)))

    @property
    def guard_names(self) -> frozenset[str]:
        """What its guards and the assignments of its edges read."""
        found = [names_in(edge.guard) for edge in self.edges]
        found += [names_in(tree) for edge in self.edges for _, tree in edge.steps]
        return frozenset[str]().union(*found)
