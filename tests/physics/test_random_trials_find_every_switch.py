"""Random runs at defaults take every edge that the reference at rtol 1e-12 takes, in its order.

`tests.soak.trials` explains what is judged, and how; `make soak` judges thousands. The reference is
checked by a witness that shares no code with it, and the witness by two cases with known outcomes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gms_fsm import PulledSlider
from tests.corpus import HELD, MICROMETRES, PUSHED
from tests.helpers import pulled_mass
from tests.soak.trials import (
    FAMILIES,
    Trial,
    is_finding,
    judge,
    reference,
    run,
    said,
    trial,
)
from tests.soak.witness import witness

pytestmark = pytest.mark.slow

pytest.importorskip("llvmlite", reason="needs the extra fast: the machines take too long for this")

COUNT = 3  # make soak takes 500 of each family
# Family, seed, index: an element slips close to z = s, less than 1e-6 of s below it, until v is in
# the window. Steps at the edge of stability put some of these z above s.
CLOSE_TO_S = (("literature", 202, 41), ("literature", 206, 20), ("literature", 306, 84))


@pytest.mark.every(2)
@pytest.mark.parametrize("family", FAMILIES)
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


@pytest.mark.matrix
def test_the_judge_finds_a_coarse_run_but_no_switch_at_the_very_end() -> None:
    """At rtol 1e-2 runs are wrong; if a billionth of t_end decides, no solver is to blame."""
    found = [judge(trial("pulled", 14, index), rtol=1e-2, atol=1e-3) for index in range(COUNT)]
    wrong = [judged for judged in found if judged.verdict == "wrong"]
    assert wrong
    assert all(is_finding(judged) and judged.trial.again in said(judged) for judged in wrong)
    whole = trial("pulled", 14, 0)
    last = replace(whole, t_end=float(reference(whole).t[-1]) * (1 + 1e-9))
    assert judge(last).verdict in ("ill", "close")


@pytest.mark.parametrize("family", FAMILIES)
def test_a_trial_can_be_repeated(family: str) -> None:
    """It depends on family, seed and index, and on each of them."""
    assert str(trial(family, 1, 7)) == str(trial(family, 1, 7))
    assert len({str(trial(family, seed, index)) for seed in (1, 2) for index in (7, 8)}) == 4


# --------------------------------------------------------------------------- the witness
CARRIAGE = Trial("a carriage", 0, 0, MICROMETRES, PulledSlider(40, 1600, 1.8e-3), 8.0)
STANDSTILL = Trial("held on v = 0", 0, 0, HELD, PUSHED, 0.4)


def agrees(one: Trial) -> None:
    """Assert the same edges at the same times, and the same end."""
    exact, seen = reference(one), witness(one.model, one.rig, one.t_end)
    assert not exact.failed
    assert exact.sequence == tuple((element, edge) for _, element, edge in seen.transitions)
    times = np.array([t for t, _, _ in seen.transitions])
    np.testing.assert_allclose(exact.t, times, rtol=0, atol=1e-8 * one.t_end)
    np.testing.assert_allclose(exact.end, [seen.x, seen.v, *seen.z], rtol=1e-5, atol=1e3 * one.atol)


@pytest.mark.matrix
def test_the_witness_has_a_carriage_that_never_breaks_away() -> None:
    seen = witness(CARRIAGE.model, CARRIAGE.rig, CARRIAGE.t_end)
    assert seen.transitions == []
    assert seen.v == pytest.approx(7.197e-7, rel=1e-3)
    assert seen.peak == pytest.approx(1.198e-6, rel=1e-3)
    agrees(CARRIAGE)


def test_the_witness_holds_a_mass_at_standstill() -> None:
    """For a tenth of a millisecond."""
    seen = witness(HELD, PUSHED, 0.4)
    assert len(seen.transitions) == 4
    ((begin, end),) = seen.sliding
    assert (begin, end) == pytest.approx((0.3322785, 0.3323773), abs=5e-8)
    assert (end, 2, "arrest") in seen.transitions
    agrees(STANDSTILL)


def test_the_witness_agrees_about_the_pulled_mass() -> None:
    agrees(Trial("pulled mass", 0, 0, *pulled_mass(), 20.0))


@pytest.mark.every(2)
@pytest.mark.parametrize(("family", "index"), [*zip(FAMILIES, (4, 4, 0, 17), strict=True)])
def test_the_witness_agrees_about_a_trial_of_each_family(family: str, index: int) -> None:
    """The first of each that has 6 to 20 switches."""
    one = trial(family, 14, index)
    assert 6 <= len(reference(one).sequence) <= 20
    agrees(one)
