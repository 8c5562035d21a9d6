"""Runs have the bits of their last approval, on every machine; those that stop, up to there.

The digests cover times, values, states and the log. A change of the engine that is meant changes
them: ``python -m tests.laws.test_the_bits_are_the_approved_ones`` approves them anew.
"""

from __future__ import annotations

import functools
import hashlib

from tests.corpus import CORPUS, FAILING, each, outcome, trace
from tests.helpers import ROOT

APPROVED = ROOT / "tests" / "bits.approved.txt"
# LAPACK fits the spline through its positions: their last bits differ between processors.
RUNS = [*(name for name in CORPUS if name != "scenario tribometer"), *FAILING]


def digest(name: str) -> str:
    """Return a digest of the run of that name."""
    run = trace(name) if name in CORPUS else outcome(name)[0]
    assert run is not None
    found = hashlib.sha256()
    for part in (run.rows.t, run.rows.y, run.rows.mode, run.transitions.t, run.transitions.element):
        found.update(part.astype(part.dtype.newbyteorder("<")).tobytes())
    found.update(" ".join(map(str, run.transitions.edge)).encode())
    return found.hexdigest()[:16]


@functools.cache
def approved() -> dict[str, str]:
    """Return the approved digests by the names of the runs."""
    lines = APPROVED.read_text(encoding="utf-8").splitlines()
    return {name: bits for name, _, bits in (line.rpartition("  ") for line in lines)}


@each(RUNS)
def test_the_bits_are_the_approved_ones(name: str) -> None:
    assert digest(name) == approved()[name]


def test_no_other_run_is_approved() -> None:
    assert list(approved()) == RUNS


if __name__ == "__main__":
    rows = "".join(f"{name}  {digest(name)}\n" for name in RUNS)
    APPROVED.write_text(rows, encoding="utf-8")
