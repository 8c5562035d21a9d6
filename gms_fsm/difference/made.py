"""Two models on rigs, or two systems: their charts, their numbers, and the rest by its texts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.difference.changes import ChartPair
from gms_fsm.difference.charts import chart_diff
from gms_fsm.difference.result import Diff, PartChange
from gms_fsm.difference.runs import Translation
from gms_fsm.difference.wording import both, fields_apart, said
from gms_fsm.errors import cut
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import NUMBERS, known_in, value_in
from gms_fsm.systems.parts import Contact

PARTS = {"bodies": "body", "springs": "spring", "sampled": "sampler"}  # that have names
ORDERED = ("bodies", "contacts", "supervisors", "springs", "sampled")
ORDER = "order of"
TEXTS = {"signals": "signal", "flow": "flow of", "let": "let"}  # by name
MOST_NAMED = 4  # numbers in a sentence
RANK = ("equal", "equivalent", "undecided", "different")


@dataclass(frozen=True)
class MadeDiff:
    """What two that can run differ in.

    Parameters
    ----------
    diff : Diff
        Of both.
    charts : str
        ``"same chart"``, ``"equivalent charts"`` or ``"other charts"``.
    numbers : bool
        Whether their numbers are the same.
    names : Translation
        What the contacts of the first, and what is in them, are called in the second.
    """

    diff: Diff
    charts: str
    numbers: bool
    names: Translation

    @property
    def about(self) -> str:
        """What is the same, in words."""
        return f"{self.charts}, {'same' if self.numbers else 'other'} numbers"


def made_diff(a: Mounted, b: Mounted, names: tuple[str, str]) -> MadeDiff:
    """Return what two models on rigs, or two systems, differ in."""
    changes: list[PartChange] = []
    pairs: dict[str, ChartPair] = {}
    found: list[Diff] = []
    called = _contacts(a, b)
    for kind, owns, others in (("removed", a, called), ("added", b, {*called.values()})):
        missing = (each.name for each in owns.system.machines if each.name not in others)
        changes += [PartChange(kind, "contact", name) for name in missing]  # type: ignore[arg-type]
    changes += [
        PartChange("renamed", "contact", *(n, n, its)) for n, its in called.items() if n != its
    ]
    for name, its in called.items():
        one, other = a.system.contact(name), b.system.contact(its)
        diff, pairs[name] = chart_diff(one.chart, other.chart, names)
        lead = f"{name}: " if a.several else ""
        found.append(diff)
        changes += [_within(lead, each) for each in diff.changes]
        changes += _of_contact(one, other, a.whose(name) or "the model")
    numbers = [*_numbers(a, b, called, pairs)]
    rest = [*_rest(a, b), *_order(a, b)]
    if a.named and a.system.name != b.system.name and not (changes or numbers or rest):
        own = a.system.name
        changes.append(PartChange("renamed", "system", own, own, b.system.name))
    worst = max(found, key=lambda each: RANK.index(each.verdict), default=None)
    verdict, reason = _verdict(worst, changes, numbers, rest, len(called) == len(a.system.machines))
    called_there = Translation(
        called,
        {name: pair.edges for name, pair in pairs.items()},
        {name: pair.found.names for name, pair in pairs.items()},
        {name: pair.found.states for name, pair in pairs.items()},
    )
    words = {"equal": "same", "equivalent": "equivalent"}
    kind_of = words.get(worst.verdict if worst else "", "other")
    charts = f"{kind_of} chart{'s' * (kind_of != 'same' or len(found) > 1)}"
    point = worst.point if worst is not None and verdict == worst.verdict else {}
    states = found[0].states if len(found) == 1 else {}
    whole = Diff(names, (*changes, *numbers, *rest), verdict, reason, point, states)
    return MadeDiff(whole, charts, not numbers, called_there)


def _verdict(
    worst: Diff | None,
    changes: Sequence[PartChange],
    numbers: Sequence[PartChange],
    rest: Sequence[PartChange],
    paired: bool,
) -> tuple[Any, str]:
    """Return the verdict about everything, and its reason."""
    if (
        worst is None
        or not paired
        or any(each.part == "contact" and each.what != "renamed" for each in changes)
    ):
        return "different", "they have other contacts"
    if worst.verdict == "different":
        return "different", worst.reason
    mounting = [each for each in changes if each.part in MOUNTING]
    if numbers or mounting:
        every = [each.name for each in numbers]
        every += [f"{each.part} {each.name}" for each in mounting]
        more = f" and {len(every) - MOST_NAMED} more" if len(every) > MOST_NAMED else ""
        which = ", ".join(every[:MOST_NAMED]) + more
        chart = "same chart" if worst.verdict == "equal" else f"{worst.verdict} charts"
        return "different", f"{chart}, other numbers: {which}"
    if rest:
        named = cut(", ".join(f"{each.part} {each.name}" for each in rest))
        if all(each.part == ORDER for each in rest):
            return "undecided", f"the order may make a difference: {named}"
        return "undecided", f"compared by their texts only: {named}"
    if worst.verdict == "equal" and changes:
        return "equivalent", "only names differ"
    return worst.verdict, worst.reason


def _within(lead: str, change: PartChange) -> PartChange:
    name = f"{lead}{change.name}"
    return PartChange(change.what, change.part, name, change.before, change.after)


def _contacts(a: Mounted, b: Mounted) -> dict[str, str]:
    """Return the contacts and supervisors that stand for each other."""
    mine = [each.name for each in a.system.machines]
    its = [each.name for each in b.system.machines]
    if len(mine) == len(its) == 1:
        return {mine[0]: its[0]}
    return {name: name for name in mine if name in its}


MOUNTING = ("number of elements of", "period of", "velocities of", "inputs of")


def _of_contact(one: Contact, other: Contact, name: str) -> Iterator[PartChange]:
    """Yield how two contacts are mounted differently."""
    for part, key in zip(MOUNTING, ("n", "period", "v", "inputs"), strict=True):
        before, after = getattr(one, key), getattr(other, key)
        if before != after:
            yield PartChange("changed", part, name, *both(before, after))


def _numbers(
    a: Mounted, b: Mounted, called: Mapping[str, str], pairs: Mapping[str, ChartPair]
) -> Iterator[PartChange]:
    """Yield the numbers that differ, by the names of the first."""
    known = known_in(a), known_in(b)
    its_names = set()
    for name in known[0]:
        owner, _, own = name.rpartition(".")
        contact = owner or (a.system.machines[0].name if name not in a.rig.numbers else "")
        if contact in called:
            own = pairs[contact].found.parameters.get(own, own)
        which = called.get(contact, NUMBERS) if contact else ""
        its = own if not which or not b.named else f"{which}.{own}"
        its_names.add(its)
        if its not in known[1]:
            yield PartChange("removed", "number", name, cut(said(value_in(a, name))))
            continue
        one, other = np.asarray(value_in(a, name)), np.asarray(value_in(b, its))
        if one.shape != other.shape and 0 in (one.ndim, other.ndim):
            one, other = np.broadcast_arrays(one, other)
        if not np.array_equal(one, other):
            yield PartChange("changed", "number", name, *both(one, other))
    for name in known[1]:
        if name not in its_names:
            yield PartChange("added", "number", name, "", cut(said(value_in(b, name))))


def _rest(a: Mounted, b: Mounted) -> Iterator[PartChange]:
    """Yield bodies, springs, samplers, signals and texts that differ."""
    for kind, part in PARTS.items():
        mine, its = ({each.name: each for each in getattr(what.system, kind)} for what in (a, b))
        yield from _by_name(part, mine, its)
    for kind, part in TEXTS.items():
        yield from _by_name(part, getattr(a.system, kind), getattr(b.system, kind))


def _by_name(kind: str, mine: Mapping[str, Any], its: Mapping[str, Any]) -> Iterator[PartChange]:
    for name, one in mine.items():
        if name not in its:
            yield PartChange("removed", kind, name)
        elif one != its[name]:
            fields = kind in PARTS.values()
            texts = fields_apart(one, its[name]) if fields else both(one, its[name])
            yield PartChange("changed", kind, name, *texts)
    for name in its:
        if name not in mine:
            yield PartChange("added", kind, name)


def _order(a: Mounted, b: Mounted) -> Iterator[PartChange]:
    """Yield the kinds of parts that are listed in another order."""
    for kind in ORDERED:
        mine, its = ([each.name for each in getattr(what.system, kind)] for what in (a, b))
        before = [name for name in mine if name in its]
        after = [name for name in its if name in mine]
        if before != after:
            yield PartChange("changed", ORDER, kind, *both(before, after))
