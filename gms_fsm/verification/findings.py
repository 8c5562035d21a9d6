"""Results of the checks of a chart: findings and their report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.display import displayed, short_repr

Check: TypeAlias = Literal[
    "determinism", "livelock", "reachability", "chattering", "stability", "release", "zeno"
]
Status: TypeAlias = Literal["proved", "settled by order", "refuted", "undecided"]
CHECKS: tuple[Check, ...] = get_args(Check)


@displayed("html")
@short_repr
@dataclass(frozen=True)
class Finding:
    """The result of one statement about a chart.

    Parameters
    ----------
    check : str
        The check, one of `CHECKS`.
    status : {"proved", "settled by order", "refuted", "undecided"}
        The result.
    where : tuple of str
        The states and edges concerned, in order of traversal.
    text : str
        The result in words.
    counterexample : mapping of str to float
        A point that refutes the statement, or at which the order decides, by name, exact in
        floats; rates of inputs are called ``ds/dt``. Empty if there is none, or if no point is
        needed (a state that no edge enters).
    case : str
        The case of a state concerned, for stability: ``"z for v < 0"``.
    """

    check: Check
    status: Status
    where: tuple[str, ...]
    text: str
    counterexample: Mapping[str, float] = field(default_factory=dict)
    case: str = ""

    def __str__(self) -> str:
        place = ", ".join(self.where) or "the chart"
        lines = [f"{self.status:<9}  {place}{', ' if self.case else ''}{self.case}: {self.text}"]
        if self.counterexample:
            lines.append(f"{'':<9}  for example at {self.example}")
        return "\n".join(lines)

    @property
    def example(self) -> str:
        """The counterexample as text."""
        return listed(self.counterexample)


@displayed("html")
@short_repr
@dataclass(frozen=True)
class Report:
    """The statements about a chart that were proved, refuted or left undecided.

    Parameters
    ----------
    chart : Chart
        The chart.
    domain : tuple of str
        The conditions assumed.
    findings : tuple of Finding
        All findings, check by check.
    about : tuple of str
        What they are about, line by line.
    """

    chart: Chart
    domain: tuple[str, ...]
    findings: tuple[Finding, ...]
    about: tuple[str, ...] = ()

    @property
    def refuted(self) -> tuple[Finding, ...]:
        """Findings with the status ``"refuted"``."""
        return tuple(f for f in self.findings if f.status == "refuted")

    @property
    def settled(self) -> tuple[Finding, ...]:
        """Findings settled by the order of the edges."""
        return tuple(f for f in self.findings if f.status == "settled by order")

    def of(self, check: Check) -> tuple[Finding, ...]:
        """Return the findings of one check.

        Parameters
        ----------
        check : str
            The check, one of `CHECKS`.

        Returns
        -------
        tuple of Finding
            At least one finding; of release none, if the chart neither locks, nor reads F or a, and
            of zeno none, if no edge from a state to itself sets a velocity.
        """
        return tuple(f for f in self.findings if f.check == check)

    def __str__(self) -> str:
        count = {s: sum(f.status == s for f in self.findings) for s in get_args(Status)}
        lines = [
            self.chart.name,
            f"assumed: {', '.join(self.domain) or 'nothing'}",
            *self.about,
        ]
        for check in (check for check in CHECKS if self.of(check)):
            lines += ["", check]
            lines += [f"  {line}" for f in self.of(check) for line in str(f).splitlines()]
        lines += ["", ", ".join(f"{n} {status}" for status, n in count.items())]
        return "\n".join(lines)


def listed(values: Mapping[str, float]) -> str:
    """Return named numbers as text."""
    return ", ".join(f"{name} = {value!r}".removesuffix(".0") for name, value in values.items())
