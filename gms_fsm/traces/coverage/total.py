"""Coverage: what runs have tried of the charts in them, as counts that can be added."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gms_fsm.errors import ParameterError, shown
from gms_fsm.foundation.arguments import (
    checked_kind,
    checked_path,
    listed,
    pointing,
    refusing,
    unknown,
)
from gms_fsm.foundation.display import displayed
from gms_fsm.traces.coverage.counts import ChartCoverage, Score
from gms_fsm.traces.coverage.reasons import lines


@pointing({})
@refusing()
@displayed("html")
@dataclass(frozen=True)
class Coverage:
    """What runs have tried of a chart, or of each chart of a system; `gms_fsm.coverage` counts it.

    Parameters
    ----------
    parts : mapping of str to ChartCoverage
        By contact and supervisor; of a model on a rig one, called ``""``.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, coverage, simulate
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> there, back = (simulate(model, Prescribed(v), 3.0) for v in ("0.2", "-0.2"))
    >>> both = coverage(there) + coverage(back)
    >>> both.scores["edges"].seen, both == coverage([there, back])
    (2, True)
    >>> print(both)
    2 runs of GMS element, signed law
    states     2 of 2   100 %
    edges      2 of 3    66 %
    clauses  10 of 12    83 %
    MC/DC      2 of 6    33 %
    never taken:
      arrest from slip: `|v| <= v_c` was never true (closest: -200 mm/s)
      arrest from slip: `|z| < s` was never true (closest: equal)
    never seen to decide:
      break_away_forward from stick: `v > v_c` was never false while `z >= s` was
        true
      break_away_backward from stick: `v < -v_c` was never false while `z <= -s` was
        true
    """

    parts: Mapping[str, ChartCoverage]

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: that of a sweep is counted when it is read."""
        return {"parts": self.parts}

    def __add__(self, other: Coverage) -> Coverage:
        checked_kind("other", other, Coverage, "a Coverage")
        if self.parts.keys() != other.parts.keys():
            raise ParameterError(
                f"it counts {_names(other.parts)}",
                advice=f"the others count {_names(self.parts)}; count each kind by itself",
            )
        return Coverage({name: part + other.parts[name] for name, part in self.parts.items()})

    def __repr__(self) -> str:
        said = (f"{name} {score.seen} of {score.of}" for name, score in self.scores.items())
        return f"<Coverage: {self.runs} run{'s' * (self.runs != 1)}; {', '.join(said)}>"

    def __str__(self) -> str:
        return self.text

    @classmethod
    def merged(cls, several: Iterable[Coverage]) -> Coverage:
        """Return the sum of several, at least one.

        Parameters
        ----------
        several : iterable of Coverage
            Of the same charts.

        Returns
        -------
        Coverage
            As if all had been counted together.

        Raises
        ------
        ParameterError
            If there is none, or charts differ.
        """
        found: list[Coverage] = listed("several", several, "an iterable of Coverage")
        for each in found:
            checked_kind("several", each, Coverage, "an iterable of Coverage")
        if not found:
            raise ParameterError("there is nothing to merge", advice="give at least one Coverage")
        return functools.reduce(lambda a, b: a + b, found)

    def contact(self, name: str = "") -> ChartCoverage:
        """Return the counts of one contact or supervisor.

        Parameters
        ----------
        name : str
            Its name; not needed if there is only one.

        Returns
        -------
        ChartCoverage
            Its counts.

        Raises
        ------
        ParameterError
            If there is none of this name, or several and no name is given.
        """
        if not name and len(self.parts) == 1:
            return next(iter(self.parts.values()))
        names = [each for each in self.parts if each]
        if not names:
            raise ParameterError(
                f"there is no contact {shown(name)}",
                advice="a model on a rig has one contact, so leave its name out",
            )
        if not name:
            raise ParameterError(
                f"there are the contacts {', '.join(names)}", advice=f"give one: {names[0]!r}"
            )
        if name not in names:
            raise unknown("contact", name, names)
        return self.parts[name]

    @property
    def runs(self) -> int:
        """Number of runs."""
        return next(iter(self.parts.values())).runs

    @property
    def scores(self) -> dict[str, Score]:
        """The scores of all charts together, by name; see `ChartCoverage.scores`."""
        found: dict[str, Score] = {}
        for part in self.parts.values():
            for name, score in part.scores.items():
                seen, of = found.get(name, Score(0, 0))
                found[name] = Score(seen + score.seen, of + score.of)
        return found

    @property
    def lowest(self) -> tuple[str, float]:
        """The lowest of the scores: its name, and percent."""
        name = min(self.scores, key=lambda each: self.scores[each].percent)
        return name, self.scores[name].percent

    @property
    def text(self) -> str:
        """The scores, what was never taken, and why not."""
        return "\n".join(lines(self.parts, self.scores))

    def save(self, path: str | Path) -> Path:
        """Write the counts and the charts to a JSON file.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        from gms_fsm.traces.coverage.files import write_parts  # needs pydantic

        return write_parts(checked_path("path", path), self.parts)

    @classmethod
    def load(cls, path: str | Path) -> Coverage:
        """Read a file written by `save`.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Coverage
            With the same counts.

        Raises
        ------
        TraceFileError
            If the file is missing, damaged, or not a coverage file.
        """
        from gms_fsm.traces.coverage.files import read_parts

        return cls(read_parts(checked_path("path", path)))


def _names(parts: Mapping[str, ChartCoverage]) -> str:
    """Say whose counts these are."""
    names = [name for name in parts if name]
    return ", ".join(names) or "a model on a rig"
