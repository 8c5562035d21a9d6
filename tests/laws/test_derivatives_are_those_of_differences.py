"""Sensitivities are what differences of much more accurate runs tend to, through every switch.

A difference of two runs has an error of its own: it is taken from how far two steps are apart.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gms_fsm.gradients import following
from tests import corpus
from tests.differences import compared, names_of
from tests.helpers import FASTEST

pytestmark = pytest.mark.slow

FEW = 2  # numbers of each run; soak tests take more, of all kinds of runs
KINDS = (
    "pulled mass", "karnopp", "elasto-plastic", "maxwell-slip", "seven-parameter", "runs down",
    "coulomb", "system servo", "system ball", "system pushed against a stop", "system impact",
    "supervisor hot brake",
)  # fmt: skip


@pytest.mark.every(3)
@pytest.mark.parametrize("name", KINDS)
def test_the_final_state_and_the_times_of_all_switches(name: str):
    run = corpus.run(name)
    _, found = compared(run, names_of(run, FEW))
    known = [each for each in found if each.known]
    limit = 1e-7 if name in corpus.GMS_RUNS else 1e-6
    assert min((each.noise for each in known), default=1.0) < limit
    assert [each for each in known if each.error > limit + 3.0 * each.noise] == []


@pytest.mark.parametrize("name", ["pulled mass", "several rates"])
def test_rows_keep_their_bits(name: str):
    run, names = corpus.run(name), names_of(corpus.run(name), 1)
    with_them = run(engine=FASTEST, sensitivities=names)
    without = corpus.trace(name)
    assert np.array_equal(with_them.rows.y, without.rows.y)
    assert np.array_equal(with_them.t, without.t)


@pytest.mark.parametrize(("name", "part"), [("system servo", 0.1), ("sliding", 1.0)])
def test_they_have_equal_bits_in_all_engines(
    name: str, part: float, monkeypatch: pytest.MonkeyPatch
):
    pytest.importorskip("llvmlite")
    run = replace(corpus.run(name), t_end=part * corpus.run(name).t_end)
    names = names_of(run, 5)  # more than stand in lanes
    compiled = run(engine="compiled", sensitivities=names).derived.followed
    monkeypatch.setattr(following, "has_machine_code", lambda: False)
    text = run(engine="ifelse", sensitivities=names).derived.followed
    for part in ("t", "rows", "times", "end"):
        one, other = getattr(compiled, part), getattr(text, part)
        np.testing.assert_array_equal(one, other, strict=True)
