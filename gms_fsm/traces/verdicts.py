"""Verdicts on a run: of its monitors, kept in the trace and its files, and how far to trust it.

Elements are numbered from 0 in the fields, as in all arrays, and from 1 in the texts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from gms_fsm.foundation.display import displayed, short_repr

__all__ = [
    "KINDS",
    "ChatteringVerdict",
    "ClauseSeen",
    "CoverageVerdict",
    "Doubt",
    "Episode",
    "InvariantVerdict",
    "Kind",
    "PassivityVerdict",
    "Severity",
    "Trust",
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
    """Verdict of `gms_fsm.traces.monitors.CoverageMonitor`.

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


# --------------------------------------------------------------------------- trust
Kind: TypeAlias = Literal[
    "not finite",
    "domain",
    "not unique",
    "grazing",
    "close call",
    "order",
    "tie",
    "window",
    "growth",
    "sampling",
    "repeat",
    "sliding",
    "impulse",
    "sensitivity",
    "units",
    "unused",
    "not judged",
]
KINDS: tuple[Kind, ...] = get_args(Kind)
Severity: TypeAlias = Literal["warning", "note"]


@dataclass(frozen=True)
class Doubt:
    """One finding about a run.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    severity : {"warning", "note"}
        A warning says that the result may be another one than the model's; a note says what was
        decided, or what was probably not meant.
    text : str
        The finding in words, with the first time and how often.
    times : tuple of float
        When it is seen, s; empty if it belongs to the whole run.
    contact : str
        The contact, of a system; else empty.
    element : int or None
        Element index, from 0; None if it belongs to no single element.
    """

    kind: Kind
    severity: Severity
    text: str
    times: tuple[float, ...] = ()
    contact: str = ""
    element: int | None = None

    @property
    def t(self) -> float | None:
        """When it is first seen, s."""
        return self.times[0] if self.times else None

    def __str__(self) -> str:
        return f"{self.severity}, {self.kind}: {self.text}"


@displayed("html")
@short_repr
@dataclass(frozen=True)
class Trust:
    """What a run says about its own result: a sequence of `Doubt`, warnings first.

    Parameters
    ----------
    findings : tuple of Doubt
        The findings.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> (found,) = simulate(model, Prescribed("0.2"), 3.0).trust()
    >>> found.kind, found.severity, found.t
    ('tie', 'note', 2.0)
    """

    findings: tuple[Doubt, ...]

    def __iter__(self) -> Iterator[Doubt]:
        return iter(self.findings)

    def __len__(self) -> int:
        return len(self.findings)

    def __str__(self) -> str:
        return self.text

    @property
    def warnings(self) -> tuple[Doubt, ...]:
        """Findings with the severity ``"warning"``."""
        return tuple(each for each in self.findings if each.severity == "warning")

    @property
    def text(self) -> str:
        """The findings, one per line; or that there are none."""
        return "\n".join(map(str, self.findings)) or "no findings"

    def of(self, kind: Kind) -> tuple[Doubt, ...]:
        """Return the findings of one kind.

        Parameters
        ----------
        kind : str
            One of `KINDS`.

        Returns
        -------
        tuple of Doubt
            In order of time.
        """
        return tuple(each for each in self.findings if each.kind == kind)
