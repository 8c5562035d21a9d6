"""choose() says what is wrong with its arguments, and notes candidates that cannot be fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from gms_fsm import GMSError, Record, choose, initial_bank
from gms_fsm.identification.bank import stop_operators
from gms_fsm.identification.candidates import Candidate, FitStart

pytest.importorskip("llvmlite", reason="fits take long without machine code")

T = np.linspace(0.0, 12.0, 601)
X = 1e-3 * np.sin(2.0 * np.pi * T / 2.0)
F = stop_operators(X, [2e-4]) @ [5e3]
RECORD = Record.from_arrays(time=T, position=X, force=F, name="rig")
ONE = {"one": (initial_bank(RECORD, 1), ["k", "weights"])}


def test_a_candidate_that_fails_is_noted_and_the_others_are_compared() -> None:
    def failing(_: Sequence[Record], __: float | None) -> FitStart:
        raise GMSError("it has no spring")

    found = choose(RECORD, candidates=[Candidate("bad", "", failing), ("one", *ONE["one"])])
    assert found.choice is not None
    bad, one = found.choice.rows
    assert (bad.name, bad.note) == ("bad", "it has no spring")
    assert np.isnan(bad.rmse)
    assert (one.name, one.note, found.choice.chosen) == ("one", "", "one")


def test_interrupted_it_chooses_among_those_compared() -> None:
    def interrupted(_: Sequence[Record], __: float | None) -> FitStart:
        raise KeyboardInterrupt

    last = Candidate("never", "", interrupted)
    found = choose(RECORD, candidates=[("one", *ONE["one"]), last])
    assert found.choice is not None
    assert found.choice.chosen == "one"
    assert "interrupted: 1 of 2 candidates" in found.stopped
    with pytest.raises(KeyboardInterrupt):
        choose(RECORD, candidates=[last])
