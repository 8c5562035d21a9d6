"""Results of a comparison: changes of parts, a verdict, and the first run that differs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from gms_fsm.difference.wording import point_text
from gms_fsm.foundation.display import displayed, short_repr
from gms_fsm.foundation.quantities import in_words, wrapped
from gms_fsm.verification.sameness.same import Verdict

WIDTH = 80  # characters of a line
MOST_NAMED = 4  # quantities in a sentence
ChangeKind: TypeAlias = Literal["added", "removed", "renamed", "changed"]
SIGNS: Mapping[ChangeKind, str] = {"added": "+", "removed": "-", "renamed": "=", "changed": "~"}


@dataclass(frozen=True)
class PartChange:
    """One part that differs.

    Parameters
    ----------
    what : {"added", "removed", "renamed", "changed"}
        How it differs, from the first to the second.
    part : str
        What it is: ``"state"``, ``"edge"``, ``"guard of edge"``, ``"rule of parameter"`` ...
    name : str
        What it is called in the first, or in the second if it is added.
    before, after : str
        Its text, or its name, in both; empty where it is missing.
    """

    what: ChangeKind
    part: str
    name: str
    before: str = ""
    after: str = ""

    def __str__(self) -> str:
        lead = f"{SIGNS[self.what]} {self.part} {self.name}"
        if self.what == "renamed":
            return f"{lead} is called {self.after}"
        if self.what in ("added", "removed"):
            text = self.after or self.before
            return f"{lead}: {text}" if text else lead
        line = f"{lead}: {self.before or 'none'} -> {self.after or 'none'}"
        if len(line) <= WIDTH - 2:
            return line
        return f"{lead}:\n    - {self.before or 'none'}\n    + {self.after or 'none'}"


@short_repr
@dataclass(frozen=True)
class RunsDiff:
    """Where two runs first differ.

    Parameters
    ----------
    about : str
        What of them is the same: ``"same chart, other numbers"``.
    number : int or None
        The first transition that differs, counted from 1; None if none does.
    t : float or None
        Its time, s: the earlier of both runs.
    fired : tuple of str
        What fires there in each run; ``"nothing"`` where a run has no such transition.
    transitions : tuple of int
        How many transitions were compared of each run.
    t_end : float
        s: until then both runs were compared.
    within : float
        s: differences of times that the tolerances explain.
    largest : mapping of str to float
        Largest differences of all quantities compared, up to the first transition that differs.
    apart : bool
        Whether a transition or a quantity differs by more than the tolerances explain.
    motion : str
        The velocity with which both were moved, m/s, if the runs were made for the comparison.
    beyond : tuple of str
        The quantities that differ by more than the tolerances explain.
    compared : int
        How many quantities were compared, the states of each contact as one.
    units : mapping of str to str
        Of the quantities, as far as they are known.
    """

    about: str
    number: int | None
    t: float | None
    fired: tuple[str, str]
    transitions: tuple[int, int]
    t_end: float
    within: float
    largest: Mapping[str, float]
    apart: bool
    motion: str = ""
    beyond: tuple[str, ...] = ()
    compared: int = 0
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def headline(self) -> str:
        """What is the same, and where they first differ."""
        if self.number is not None:
            return f"{self.about}: first difference at transition {self.number}"
        count = self.transitions[0]
        values = f", but {self._beyond} differ" if self.apart else ""
        same = f"the same {count} transition{'s' * (count > 1)}" if count else "no transition"
        return f"{self.about}: {same}{values}"

    @property
    def _beyond(self) -> str:
        more = len(self.beyond) - MOST_NAMED
        *some, last = [*self.beyond[:MOST_NAMED], *[f"{more} more"] * (more > 0)]
        return f"{', '.join(some)} and {last}" if some else f"the values of {last}"

    def __str__(self) -> str:
        lines = [f"with v = {self.motion}"] if self.motion else []
        lines.append(self.headline)
        if self.number is not None:
            lines += [f"  first:  {self.fired[0]}", f"  second: {self.fired[1]}"]
        until = self.t_end if self.t is None else self.t
        values = ", ".join(
            f"{name} {in_words(each, self.units.get(name, ''), 3)}"
            for name, each in self.largest.items()
            if name in self.beyond or (each > 0.0 and name in self.units)
        )
        none = f"none in {self.compared} quantities" if self.compared else "nothing compared"
        lines.append(f"  largest difference until t = {until:.9g} s: {values or none}")
        if self.within:
            lines.append(f"  times within {self.within:.2g} s count as the same")
        return "\n".join(lines)


@displayed("html")
@short_repr
@dataclass(frozen=True)
class Diff:
    """What two charts, models, systems or runs differ in; printed, `text`.

    Parameters
    ----------
    names : tuple of str
        What the two are called.
    changes : tuple of PartChange
        The parts that differ in their texts, names or numbers.
    verdict : {"equal", "equivalent", "different", "undecided"}
        Whether they do the same: *equal* if nothing differs, *equivalent* if what differs makes no
        difference.
    reason : str
        The verdict in words.
    point : mapping of str to float
        Values at which they differ, by the names of the second; empty if there are none.
    states : mapping of str to str
        Which states stand for each other.
    runs : RunsDiff or None
        Of two runs, or of the first run found that differs.
    """

    names: tuple[str, str]
    changes: tuple[PartChange, ...]
    verdict: Verdict
    reason: str
    point: Mapping[str, float] = field(default_factory=dict)
    states: Mapping[str, str] = field(default_factory=dict)
    runs: RunsDiff | None = None

    @property
    def equal(self) -> bool:
        """Whether nothing differs."""
        return self.verdict == "equal"

    @property
    def equivalent(self) -> bool:
        """Whether they do the same; False also if that is undecided."""
        return self.verdict in ("equal", "equivalent")

    @property
    def summary(self) -> str:
        """The verdict and its reason in one sentence."""
        return f"{self.verdict}: {self.reason}" if self.reason else self.verdict

    @property
    def text(self) -> str:
        """All of it, in lines of at most 80 characters."""
        return "\n".join(part for line in self._lines() for part in wrapped(line, WIDTH))

    def _lines(self) -> Iterator[str]:
        yield f"{self.names[0]} -> {self.names[1]}"
        for change in self.changes:
            yield from f"  {change}".splitlines()
        yield self.summary
        if self.point:
            yield f"  for example at {point_text(self.point)}"
        if self.runs is not None:
            lines = str(self.runs).splitlines()
            yield from (line for line in lines if line != self.reason)

    def __str__(self) -> str:
        return self.text
