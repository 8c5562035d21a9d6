"""Verdicts of the monitors of a run, as data kept in the trace and in its files.

Elements are numbered from 0 in the fields, as in all arrays, and from 1 in the texts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from gms_fsm.foundation.display import displayed, short_repr

__all__ = [
    "ChatteringVerdict",
    "ClauseSeen",
    "CoverageVerdict",
    "Episode",
    "InvariantVerdict",
    "PassivityVerdict",
    "Verdict",
]


@dataclass(frozen=True)
class Episode:
    """Repeated firing of one edge by one element.

    Parameters
    ----------
    element : int
        Element index, from 0.
    edge : str
        The edge that fired most often.
    back : tuple of str
        The other edges that fired meanwhile.
    count : int
        Number of times the edge fired.
    t_first, t_last : float
        First and last time, s.
    values : dict of str to float
        First variable of the chart (if it has one), v and s at the first time.
    """

    element: int
    edge: str
    back: tuple[str, ...]
    count: int
    t_first: float
    t_last: float
    values: dict[str, float]


@displayed("html")
@short_repr
@dataclass(frozen=True)
class ChatteringVerdict:
    """Verdict of `gms_fsm.traces.monitors.Chattering`.

    Parameters
    ----------
    ok : bool
        Whether nothing chattered and the run did not end in a livelock.
    text : str
        What happened and what to try.
    episodes : tuple of Episode
        The longest episode of each element that chattered.
    livelock : bool
        Whether the run ended because states switched without progress in time.
    """

    ok: bool
    text: str
    episodes: tuple[Episode, ...]
    livelock: bool
    kind: Literal["chattering"] = "chattering"


@displayed("html")
@short_repr
@dataclass(frozen=True)
class InvariantVerdict:
    """Verdict of `gms_fsm.traces.monitors.Invariant`.

    Parameters
    ----------
    ok : bool
        Whether the invariant held at all rows.
    text : str
        Where it first failed, and with which values.
    condition : str
        The invariant.
    rows, broken : int
        Number of rows checked, and of rows at which it failed (for at least one element).
    t : float or None
        Time of the first failure, s, located between two rows, on the false side.
    element : int or None
        Element index, from 0; None if the invariant does not refer to single elements.
    state : str
        State of the element at t.
    values : dict of str to float
        Values of the names in the condition at t.
    t_last : float or None
        Time of the last row at which it failed, s.
    """

    ok: bool
    text: str
    condition: str
    rows: int
    broken: int
    t: float | None
    element: int | None
    state: str
    values: dict[str, float]
    t_last: float | None
    kind: Literal["invariant"] = "invariant"


@displayed("html")
@short_repr
@dataclass(frozen=True)
class PassivityVerdict:
    """Verdict of `gms_fsm.traces.monitors.Passivity`.

    Tuples have one entry per element; energies are in J.

    Parameters
    ----------
    ok : bool
        Whether no element had created energy at any time since the start.
    text : str
        Which elements created energy, when and how much.
    applicable : bool
        Whether the force of the chart is that of a spring, with or without a damper. If not, the
        other fields are empty.
    taken : tuple of float
        Energy taken from the motion during the run: the integral of F_i v.
    stored : tuple of float
        Change of the spring energy k z**2 / 2 during the run; the rest of `taken` is heat.
    deficit, t_deficit : tuple of float
        Largest excess of the energy given back and stored over the energy taken, and its time
        [s]; 0 for a passive element.
    made, made_from, made_until : tuple of float
        Largest energy created between two times, and these times [s]. It can be positive where the
        deficit is 0: a spring that winds up by itself after enough heat was produced.
    tolerance : tuple of float
        Uncertainty of the solver and of the sums.
    """

    ok: bool
    text: str
    applicable: bool
    taken: tuple[float, ...] = ()
    stored: tuple[float, ...] = ()
    deficit: tuple[float, ...] = ()
    t_deficit: tuple[float, ...] = ()
    made: tuple[float, ...] = ()
    made_from: tuple[float, ...] = ()
    made_until: tuple[float, ...] = ()
    tolerance: tuple[float, ...] = ()
    kind: Literal["passivity"] = "passivity"


@dataclass(frozen=True)
class ClauseSeen:
    """Whether a guard clause was seen true and seen false in the source state of its edge.

    Parameters
    ----------
    edge, text : str
        Name of the edge, with its source (``"lift from slip"``) if it leaves several states, and
        the clause as shown in the chart.
    true, false : tuple of bool
        One entry per element.
    """

    edge: str
    text: str
    true: tuple[bool, ...]
    false: tuple[bool, ...]


@displayed("html")
@short_repr
@dataclass(frozen=True)
class CoverageVerdict:
    """Verdict of `gms_fsm.traces.monitors.Coverage`.

    Parameters
    ----------
    ok : bool
        Whether the elements together covered everything.
    text : str
        Counts, and everything never seen.
    states : dict of str to tuple of bool
        Whether each element was ever in the state.
    edges : dict of str to tuple of int
        Number of times each element took the edge; one that leaves several states is counted once
        for each of them, as ``"lift from slip"``.
    clauses : tuple of ClauseSeen
        One entry per clause of each guard.
    never : tuple of str
        Descriptions of what no element ever saw.
    """

    ok: bool
    text: str
    states: dict[str, tuple[bool, ...]]
    edges: dict[str, tuple[int, ...]]
    clauses: tuple[ClauseSeen, ...]
    never: tuple[str, ...]
    kind: Literal["coverage"] = "coverage"


Verdict: TypeAlias = ChatteringVerdict | InvariantVerdict | PassivityVerdict | CoverageVerdict
