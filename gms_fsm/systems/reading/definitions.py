"""The smallest parts of a system that has been read: quantities, and edges of charts."""

from __future__ import annotations

from dataclasses import dataclass

from gms_fsm.language import Condition, Value
from gms_fsm.systems.signals import Signal


@dataclass(frozen=True)
class Definition:
    """A quantity computed from others.

    Parameters
    ----------
    name : str
        In the trees.
    tree : Value or None
        What it is; None for a signal that is a table or a Python function.
    bank : int or None
        The contact whose elements have one value each; None if there is one value.
    signal : Signal or None
        The signal, where it is one.
    counts : (int, tuple of str) or None
        The number of elements of a machine, by its number in the system, that are in one of these
        states.
    """

    name: str
    tree: Value | None
    bank: int | None = None
    signal: Signal | None = None
    counts: tuple[int, tuple[str, ...]] | None = None


@dataclass(frozen=True)
class ContactEdge:
    """An edge of a chart.

    Parameters
    ----------
    name, source, target : str
        As in the chart.
    guard : Condition
        When it is taken.
    steps : tuple of (str, Value)
        Assignments to variables and velocities, in the order of computation.
    locks, arrests : bool
        Whether it leads into a locked state, and whether it does so only where the velocity
        passes 0: from a state that is not locked, without an impulse.
    """

    name: str
    source: str
    target: str
    guard: Condition
    steps: tuple[tuple[str, Value], ...]
    locks: bool
    arrests: bool
