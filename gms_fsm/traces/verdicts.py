"""What the monitors of a run have to say: data, kept in the trace and in its files.

Elements are counted from 0 in the fields, as in all arrays, and from 1 in the texts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

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
    """One element that took one edge again and again.

    Parameters
    ----------
    element : int
        Counted from 0.
    edge : str
        The edge it took most often.
    back : tuple of str
        The other edges it took meanwhile.
    count : int
        How often it took the edge.
    t_first, t_last : float
        First and last time, s.
    values : dict of str to float
        The chart's first variable, v and s at the first time.
    """

    element: int
    edge: str
    back: tuple[str, ...]
    count: int
    t_first: float
    t_last: float
    values: dict[str, float]


@dataclass(frozen=True)
class ChatteringVerdict:
    """Of `gms_fsm.traces.monitors.Chattering`.

    Parameters
    ----------
    ok : bool
        Whether nothing chattered and the run did not end in a livelock.
    text : str
        What happened, and what to try.
    episodes : tuple of Episode
        The longest of each element that chattered.
    livelock : bool
        Whether the run ended because states switched while time stood still.
    """

    ok: bool
    text: str
    episodes: tuple[Episode, ...]
    livelock: bool
    kind: Literal["chattering"] = "chattering"


@dataclass(frozen=True)
class InvariantVerdict:
    """Of `gms_fsm.traces.monitors.Invariant`.

    Parameters
    ----------
    ok : bool
        Whether it held at all rows.
    text : str
        Where it first failed, with which values.
    condition : str
        The invariant.
    rows, broken : int
        Rows looked at, and rows at which it failed (for at least one element).
    t : float or None
        Where it first failed, s: located between two rows, on the false side.
    element : int or None
        The element, counted from 0; None if it is not about single elements.
    state : str
        The element's state there.
    values : dict of str to float
        The names of the condition there.
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


@dataclass(frozen=True)
class PassivityVerdict:
    """Of `gms_fsm.traces.monitors.Passivity`; tuples have one entry per element, energies are in J.

    Parameters
    ----------
    ok : bool
        Whether no element had made energy out of nothing at any time since the start.
    text : str
        Which had, when and how much.
    applicable : bool
        Whether the chart's force is a spring's, with or without a damper; all else is empty if not.
    taken : tuple of float
        Energy taken from the motion over the run, the integral of F_i v.
    stored : tuple of float
        Change of the spring's energy k z**2 / 2 over the run; what is left of `taken` is heat.
    deficit, t_deficit : tuple of float
        The most by which what it had given and stored was more than what it had taken, and when
        [s]; 0 for a passive element.
    made, made_from, made_until : tuple of float
        The most energy it made between two times, and these times [s]. It can be more than 0 where
        the deficit is 0: a spring that winds up by itself, after enough heat.
    tolerance : tuple of float
        What the solver and the sums may be wrong by.
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
    """Whether a clause of a guard was true and was false, by element, in the edge's source state.

    Parameters
    ----------
    edge, text : str
        The edge, and the clause as the chart shows it.
    true, false : tuple of bool
        One entry per element.
    """

    edge: str
    text: str
    true: tuple[bool, ...]
    false: tuple[bool, ...]


@dataclass(frozen=True)
class CoverageVerdict:
    """Of `gms_fsm.traces.monitors.Coverage`.

    Parameters
    ----------
    ok : bool
        Whether the elements together were everywhere.
    text : str
        Counts, and what was never seen.
    states : dict of str to tuple of bool
        Whether each element was in the state.
    edges : dict of str to tuple of int
        How often each element took the edge.
    clauses : tuple of ClauseSeen
        One a clause of each guard.
    never : tuple of str
        What no element ever saw, in words.
    """

    ok: bool
    text: str
    states: dict[str, tuple[bool, ...]]
    edges: dict[str, tuple[int, ...]]
    clauses: tuple[ClauseSeen, ...]
    never: tuple[str, ...]
    kind: Literal["coverage"] = "coverage"


Verdict: TypeAlias = ChatteringVerdict | InvariantVerdict | PassivityVerdict | CoverageVerdict
