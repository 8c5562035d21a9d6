"""Random systems agree with an exact reference; `tests.soak.exact_systems` draws many more."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.soak import exact_systems
from tests.soak.exact_systems import trial, verdict

SEED, SHAPES, COUNT = 7, 40, 20


@pytest.mark.slow
def test_what_is_well_conditioned_is_right() -> None:
    trials = [trial(SEED, index, SHAPES) for index in range(COUNT)]
    found = [verdict(one, engine="ifelse") for one in trials]
    wrong = [
        f"{index}: {each.kind}: {each.what}"
        for index, each in enumerate(found)
        if each.kind not in ("right", "ill-conditioned", "no answer")
    ]
    assert not wrong, "\n".join(wrong)
    assert sum(each.kind == "right" for each in found) > 0.9 * COUNT
    assert sum(each.transitions for each in found) > 5 * COUNT


@pytest.mark.slow
def test_a_slip_at_its_limit_ends_where_large_velocities_differ_by_nothing() -> None:
    found = verdict(trial(77, 379, exact_systems.SHAPES), engine="ifelse")
    assert found.kind == "right", found


@pytest.mark.slow
def test_another_motion_is_found() -> None:
    one = trial(SEED, 0, SHAPES)
    assert verdict(one, engine="ifelse").kind == "right"
    heavier = replace(one.plain, masses=[1.0001 * m for m in one.plain.masses])
    other, _ = exact_systems.as_system(heavier)
    found = verdict(replace(one, system=other), engine="ifelse")
    assert found.kind in ("wrong times", "wrong end", "wrong sequence"), found
