"""Runs have the bits of their last approval, on every machine; those that stop, up to there.

The first digest of each covers times, values, states and the log, the second the columns of its
rows: forces, thresholds, rates. A change of the engine that is meant changes them: ``python -m
tests.laws.test_the_bits_are_the_approved_ones`` approves them anew.
"""

from __future__ import annotations

import functools
import hashlib
from typing import Any

import numpy as np

from tests.corpus import CORPUS, FAILING, each, outcome, trace
from tests.helpers import ROOT

APPROVED = ROOT / "tests" / "bits.approved.txt"
# LAPACK fits the spline through its positions: their last bits differ between processors.
RUNS = [*(name for name in CORPUS if name != "scenario tribometer"), *FAILING]


def digests(name: str) -> str:
    """Return digests of the run of that name: what is stored, and what rows show."""
    run = trace(name) if name in CORPUS else outcome(name)[0]
    assert run is not None
    log = run.transitions
    kept = [run.rows.t, run.rows.y, run.rows.mode, log.t, log.element]
    stored = hashlib.sha256(b"".join(map(little, kept)) + " ".join(map(str, log.edge)).encode())
    shown = hashlib.sha256(
        b"".join(little(each) for each in run.columns().values() if each.dtype.kind == "f")
    )
    return f"{stored.hexdigest()[:16]} {shown.hexdigest()[:16]}"


def little(part: Any) -> bytes:
    """Return the bytes of an array as on a machine with little ends; a NaN is a NaN."""
    part = np.where(np.isnan(part), np.nan, part) if part.dtype.kind == "f" else part
    return bytes(part.astype(part.dtype.newbyteorder("<")).tobytes())


@functools.cache
def approved() -> dict[str, str]:
    """Return the approved digests by the names of the runs."""
    lines = APPROVED.read_text(encoding="utf-8").splitlines()
    return {name: bits for name, _, bits in (line.rpartition("  ") for line in lines)}


@each(RUNS)
def test_the_bits_are_the_approved_ones(name: str) -> None:
    assert digests(name) == approved()[name]


def test_no_other_run_is_approved() -> None:
    assert list(approved()) == RUNS


if __name__ == "__main__":
    rows = "".join(f"{name}  {digests(name)}\n" for name in RUNS)
    APPROVED.write_text(rows, encoding="utf-8")
