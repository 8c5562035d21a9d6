"""Claim: charts that do the same are called equivalent, and mutants never are."""

from __future__ import annotations

import pytest

from gms_fsm import diff
from tests.difference.pairs import equivalent_pair, mutant_pair

SEEDS = range(100)
BATCHES = [range(start, start + 25) for start in range(0, 100, 25)]


@pytest.fixture(autouse=True)
def with_z3() -> None:
    """Without z3 texts are compared only."""
    pytest.importorskip("z3", reason="needs z3 (extra: check)")


@pytest.mark.every(4)
@pytest.mark.slow
@pytest.mark.parametrize("seeds", BATCHES, ids=str)
def test_the_same_in_other_words_is_equivalent(seeds: range) -> None:
    verdicts = {}
    for seed in seeds:
        pair = equivalent_pair(seed)
        verdicts[seed] = diff(pair.a, pair.b).summary
    wrong = {seed: said for seed, said in verdicts.items() if not said.startswith("equivalent")}
    assert wrong == {}, f"seeds {[*wrong]}"


@pytest.mark.every(4)
@pytest.mark.slow
@pytest.mark.parametrize("seeds", BATCHES, ids=str)
def test_a_mutant_is_never_equivalent(seeds: range) -> None:
    wrong = {}
    for seed in seeds:
        pair = mutant_pair(seed)
        found = diff(pair.a, pair.b)
        if found.verdict != "different":
            wrong[seed, pair.how] = found.summary
    assert wrong == {}


def test_few_pairs_are_judged_at_once() -> None:
    pairs = [make(seed) for seed in (3, 7) for make in (equivalent_pair, mutant_pair)]
    assert [diff(each.a, each.b).equivalent for each in pairs] == [True, False, True, False]
