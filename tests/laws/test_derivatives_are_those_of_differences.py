"""Sensitivities are what differences of much more accurate runs tend to, through every switch.

A difference of two runs has an error of its own: it is taken from how far two extrapolations are
apart.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gms_fsm.run import simulate as runs
from tests import corpus
from tests.differences import compared, names_of
from tests.helpers import FASTEST

pytestmark = pytest.mark.slow

FEW = 2  # numbers of each run; soak tests take more, of all kinds of runs
CURVED = "seven-parameter"
KINDS = (
    "pulled mass", "karnopp", "elasto-plastic", "maxwell-slip", CURVED, "runs down",
    "coulomb", "system servo", "system ball", "system pushed against a stop", "system impact",
    "supervisor hot brake",
)  # fmt: skip


@pytest.mark.every(3)
@pytest.mark.parametrize("name", KINDS)
def test_the_final_state_and_the_times_of_all_switches(name: str):
    run, limit = corpus.run(name), 1e-8 if name in corpus.GMS_RUNS else 1e-6
    _, found = compared(run, names_of(run, FEW), 1e-12 if name == CURVED else 1e-10)
    assert [each for each in found if not each.noise < limit] == []
    assert [each for each in found if not each.error < limit] == []


def test_they_are_as_near_as_the_run_itself():
    # Its f is read from a curve of a second derivative of 1e5, at a velocity that has the error of
    # the run: only with the run do both become exact. No switch depends on it so much.
    run, errors = corpus.run(CURVED), []
    for rtol in (1e-10, 1e-11, 1e-12):
        _, found = compared(run, names_of(run, FEW), rtol)
        assert max(each.late for each in found) < 1e-7
        errors.append(max(each.error for each in found))
    assert 1e-6 < errors[0] < 3e-5
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.3 * errors[1]


@pytest.mark.parametrize("name", ["pulled mass", "several rates", "system ball"])
@pytest.mark.parametrize("kept", ["all", "some", "end"])
def test_rows_and_the_log_keep_their_bits(name: str, kept: str):
    run = corpus.run(name)
    start = run.how.get("t_start", 0.0)
    some = {"t_eval": np.linspace(start, run.t_end, 20)} if kept == "some" else {}
    how = some or {"output": kept}
    with_them = run(engine=FASTEST, sensitivities=names_of(run, 1), **how)
    without = run(engine=FASTEST, **how)
    for part in ("rows", "stops"):
        one, other = getattr(with_them, part), getattr(without, part)
        for column in ("t", "microstep", "y", "mode"):
            np.testing.assert_array_equal(getattr(one, column), getattr(other, column))
    log, other_log = with_them.firings.records, without.firings.records
    for column in log.dtype.names:
        np.testing.assert_array_equal(log[column], other_log[column])
    assert np.array_equal(with_them.derived.followed.t, without.t)
    assert len(with_them.derived.followed.times) == len(without.firings)


@pytest.mark.parametrize(
    ("name", "part", "most"),
    [("system servo", 0.1, 5), ("sliding", 1.0, 5), ("pulled mass", 0.1, 0)],
)
def test_they_have_equal_bits_in_all_engines(
    name: str, part: float, most: int, monkeypatch: pytest.MonkeyPatch
):
    pytest.importorskip("llvmlite")
    run = replace(corpus.run(name), t_end=part * corpus.run(name).t_end)
    names = names_of(run, most)  # more than stand in lanes, or one
    compiled = run(engine="compiled", sensitivities=names).derived.followed
    monkeypatch.setattr(runs, "has_machine_code", lambda: False)
    text = run(engine="ifelse", sensitivities=names).derived.followed
    for part in ("t", "rows", "times", "end"):
        one, other = getattr(compiled, part), getattr(text, part)
        np.testing.assert_array_equal(one, other, strict=True)
