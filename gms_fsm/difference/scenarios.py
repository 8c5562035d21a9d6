"""How two scenarios are run: initial values, times and settings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gms_fsm.difference.result import Diff, PartChange
from gms_fsm.difference.wording import both
from gms_fsm.errors import cut
from gms_fsm.systems.system import System
from gms_fsm.verification.sameness.same import Verdict

Run = Mapping[str, Any]


def with_settings(found: Diff, one: Run, other: Run, system: System) -> Diff:
    """Return a comparison of two systems with what differs in how they are run."""
    if not one and not other:
        return found
    if not one or not other:
        whose = "first" if one else "second"
        changes = [PartChange("removed" if one else "added", "run of the", whose)]
        verdict: Verdict = "equivalent"
        reason = f"same system, only the {whose} says how it is run"
    else:
        changes = [*_initial(one, other, system), *_settings(one, other)]
        verdict = "different"
        named = ", ".join(f"{each.part} {each.name}" for each in changes)
        reason = f"same system, other run: {cut(named)}"
    if not changes:
        return found
    found = replace(found, changes=(*found.changes, *changes))
    return replace(found, verdict=verdict, reason=reason) if found.equivalent else found


def _initial(one: Run, other: Run, system: System) -> Iterator[PartChange]:
    """Yield the initial values that differ; of bodies and further states 0 is the default."""
    zero = dict.fromkeys(system.flow, 0.0)
    for body in system.bodies:
        zero |= dict.fromkeys((body.x, body.v, f"{body.name}.x", f"{body.name}.v"), 0.0)
    starts = [each.get("initial") or {} for each in (one, other)]
    for name in {**starts[0], **starts[1]}:
        before, after = (each.get(name, zero.get(name, "default")) for each in starts)
        if not _same(before, after):
            yield PartChange("changed", "initial", name, *both(before, after))


def _settings(one: Run, other: Run) -> Iterator[PartChange]:
    """Yield the settings that differ."""
    for name in {**one, **other}:
        before, after = one.get(name), other.get(name)
        if name == "initial" or _same(before, after):
            continue
        if name == "t_eval":
            before, after = (None if each is None else np.asarray(each) for each in (before, after))
            sizes = ["none" if each is None else f"{each.size} times" for each in (before, after)]
            texts = (sizes[0], sizes[1]) if sizes[0] != sizes[1] else both(before, after)
            yield PartChange("changed", "rows at", "t_eval", *texts)
        else:
            yield PartChange("changed", "setting", name, *both(before, after))


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return one is not None and other is not None and np.array_equal(one, other)
    return bool(one == other)
