"""Random runs at defaults take every edge that the reference at rtol 1e-12 takes, in its order.

`tests.trials` explains what is judged, and how; tests/soak.py judges thousands.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.trials import FAMILIES, JUDGED, is_finding, judge, reference, run, said, trial

pytestmark = pytest.mark.slow

pytest.importorskip("llvmlite", reason="needs the extra fast: the machines take too long for this")

COUNT = 5  # make soak takes 500 of each family
# Family, seed, index: an element slips close to z = s, less than 1e-6 of s below it, until v is in
# the window. Steps at the edge of stability put some of these z above s.
CLOSE_TO_S = (("literature", 202, 41), ("literature", 206, 20), ("literature", 306, 84))


@pytest.mark.parametrize("family", JUDGED)
def test_no_switch_is_lost_or_made_up(family: str) -> None:
    found = [judge(trial(family, 14, index)) for index in range(COUNT)]
    assert [said(judged) for judged in found if is_finding(judged)] == []
    steady = sum(judged.verdict == "right" for judged in found)
    assert steady > 0.8 * COUNT, "the family is too ill-conditioned for a conclusion"
    assert sum(len(judged.exact.sequence) for judged in found) > 10 * COUNT


@pytest.mark.parametrize("key", CLOSE_TO_S)
def test_what_relaxes_does_not_wander_across_its_threshold(key: tuple[str, int, int]) -> None:
    one, *before = (trial(*each) for each in (key, *CLOSE_TO_S))
    for other in before:  # with their own relaxation times
        run(other)
    exact = reference(one)
    assert exact.nearest < 1e-6
    assert run(one).sequence == exact.sequence


def test_the_judge_detects_a_coarse_run() -> None:
    """At rtol 1e-2 runs are wrong, so the judge can fail one."""
    found = [judge(trial("pulled", 14, index), rtol=1e-2, atol=1e-3) for index in range(COUNT)]
    wrong = [judged for judged in found if judged.verdict == "wrong"]
    assert wrong
    assert all(is_finding(judged) and judged.trial.again in said(judged) for judged in wrong)


def test_a_switch_at_the_very_end_is_not_judged() -> None:
    """If a billionth of t_end decides, no solver is to blame."""
    whole = trial("pulled", 14, 0)
    last = replace(whole, t_end=float(reference(whole).t[-1]) * (1 + 1e-9))
    assert judge(last).verdict in ("ill", "close")


@pytest.mark.parametrize("family", FAMILIES)
def test_a_trial_can_be_repeated(family: str) -> None:
    """It depends on family, seed and index, and on each of them."""
    assert str(trial(family, 1, 7)) == str(trial(family, 1, 7))
    assert len({str(trial(family, seed, index)) for seed in (1, 2) for index in (7, 8)}) == 4
