"""Findings of one kind about one thing are one finding, with the first time and their number."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace

from gms_fsm.traces.verdicts import Doubt, Kind, Severity


@dataclass
class Gathering:
    """Findings as they are met along a run."""

    seen: dict[tuple[Kind, Hashable], Doubt] = field(default_factory=dict)

    def add(
        self,
        kind: Kind,
        about: Hashable,
        t: float,
        text: str,
        *,
        severity: Severity = "warning",
        contact: str = "",
        element: int | None = None,
    ) -> None:
        """Add a finding; of those about one thing the text of the first one stays."""
        first = self.seen.setdefault(
            (kind, about), Doubt(kind, severity, text, (), contact, element)
        )
        self.seen[kind, about] = replace(first, times=(*first.times, t))

    def doubts(self) -> Iterator[Doubt]:
        """Yield the findings; ``{when}`` in a text becomes the first time and their number."""
        for each in self.seen.values():
            count = len(each.times)
            often = f"{count} times, first " if count > 1 else ""
            when = f"{often}at t = {each.times[0]:.9g} s"
            yield replace(each, text=each.text.replace("{when}", when))
