"""Sensitivities are what differences of much more accurate runs tend to, through every switch.

A difference of two runs has an error of its own: it is taken from how far two steps are apart.
"""

from __future__ import annotations

import numpy as np
import pytest

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


@pytest.mark.parametrize("name", ["pulled mass", "system servo", "sliding"])
def test_engines_agree(name: str):
    pytest.importorskip("llvmlite")
    run, names = corpus.run(name), names_of(corpus.run(name), 2)
    one, other = (
        run(engine=engine, sensitivities=names).derived.followed
        for engine in ("compiled", "ifelse")
    )
    assert one.rows.shape == other.rows.shape
    scale = np.abs(other.rows).max(axis=(0, 1)) + 1e-300
    assert np.abs((one.rows - other.rows) / scale).max() < 1e-7
    np.testing.assert_allclose(one.times, other.times, rtol=1e-6, atol=1e-9 * scale.max())
