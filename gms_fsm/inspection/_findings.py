"""What became of the statements about a chart: findings and their report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

from gms_fsm.charts.chart import Chart

__all__ = ["CHECKS", "Check", "Finding", "Report", "Status", "listed"]

Check: TypeAlias = Literal["determinism", "livelock", "reachability", "chattering", "stability"]
Status: TypeAlias = Literal["proved", "settled by order", "refuted", "undecided"]
CHECKS: tuple[Check, ...] = get_args(Check)


@dataclass(frozen=True)
class Finding:
    """One statement about a chart, and what became of it.

    Parameters
    ----------
    check : {"determinism", "livelock", "reachability", "chattering", "stability"}
        What was asked.
    status : {"proved", "settled by order", "refuted", "undecided"}
        The answer.
    where : tuple of str
        The states and edges it is about, in the order they are passed.
    text : str
        The answer in words.
    counterexample : mapping of str to float
        A point that refutes the statement, or at which the order settles it, name by name, exact
        in floats; rates of inputs are called ``ds/dt``. Empty if there is none, or if no point is
        needed (a state that no edge enters).
    case : str
        What of a state is meant, for stability: ``"z for v < 0"``.
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


@dataclass(frozen=True)
class Report:
    """What was proved of a chart, what was refuted, and what stayed undecided.

    Parameters
    ----------
    chart : Chart
        The chart.
    domain : tuple of str
        What was assumed, as conditions.
    findings : tuple of Finding
        Every statement, check by check; each check has at least one.
    """

    chart: Chart
    domain: tuple[str, ...]
    findings: tuple[Finding, ...]

    @property
    def refuted(self) -> tuple[Finding, ...]:
        """The findings that are refuted."""
        return tuple(f for f in self.findings if f.status == "refuted")

    @property
    def settled(self) -> tuple[Finding, ...]:
        """The findings that the order of the edges settles."""
        return tuple(f for f in self.findings if f.status == "settled by order")

    def of(self, check: Check) -> tuple[Finding, ...]:
        """Return the findings of one check.

        Parameters
        ----------
        check : {"determinism", "livelock", "reachability", "chattering", "stability"}
            Which.

        Returns
        -------
        tuple of Finding
            At least one.
        """
        return tuple(f for f in self.findings if f.check == check)

    def __str__(self) -> str:
        count = {s: sum(f.status == s for f in self.findings) for s in get_args(Status)}
        lines = [
            self.chart.name,
            f"assumed: {', '.join(self.domain) or 'nothing'}",
            "over the reals, not floats; over points, not trajectories",
            "inputs and their rates (ds/dt, dv/dt) are free, but alike in both states of a switch",
        ]
        for check in CHECKS:
            lines += ["", check]
            lines += [f"  {line}" for f in self.of(check) for line in str(f).splitlines()]
        lines += ["", ", ".join(f"{n} {status}" for status, n in count.items())]
        return "\n".join(lines)


def listed(values: Mapping[str, float]) -> str:
    """Return numbers by name as text."""
    return ", ".join(f"{name} = {value!r}".removesuffix(".0") for name, value in values.items())
