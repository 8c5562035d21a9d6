"""choose() says what is wrong with its arguments, and notes candidates that cannot be fitted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from gms_fsm import GMSError, ParameterError, Record, RecordError, choose, initial_bank
from gms_fsm.identification.bank import stop_operators
from gms_fsm.identification.candidates import Candidate, Start

pytest.importorskip("llvmlite", reason="fits take long without machine code")

T = np.linspace(0.0, 12.0, 601)
X = 1e-3 * np.sin(2.0 * np.pi * T / 2.0)
F = stop_operators(X, [2e-4]) @ [5e3]
RECORD = Record.from_arrays(time=T, position=X, force=F, name="rig")
ONE = {"one": (initial_bank(RECORD, 1), ["k", "weights"])}


@pytest.mark.parametrize(
    ("records", "given", "words"),
    [
        (RECORD, {"fold": "record"}, ["only one record", "fold='cycles'"]),
        (RECORD, {"fold": "rows"}, ["'record' or 'cycles'", "'rows'"]),
        (RECORD, {"cycles": 8.0}, ["12 s", "less than two cycles of 8 s"]),
        (RECORD, {"cycles": -1.0}, ["cycles", "-1"]),
        (RECORD, {"candidates": []}, ["candidates", "there is none"]),
        (RECORD, {"candidates": 3}, ["candidates", "3"]),
        (RECORD, {"candidates": [("a", ONE["one"][0])]}, ["(name, model, free)"]),
        (RECORD, {"candidates": [("a", *ONE["one"])] * 2}, ["two are called 'a'"]),
        (RECORD, {"candidates": {"one": 1}}, ["(model, free)", "1"]),
        (RECORD, {"candidates": {"one": (5, ["k"])}}, ["model of candidate 'one' is 5"]),
        (RECORD, {"train": (50.0, 60.0)}, ["rig", "no selected row is in train"]),
        (RECORD, {"train": (3.0, 1.0)}, ["train", "after its start"]),
        (RECORD, {"seed": 0.5}, ["seed"]),
        ([], {}, ["records"]),
        ("rig", {}, ["Record"]),
        (Record.from_arrays(time=T, position=X, name="rig"), {}, ["rig", "no force"]),
        (
            Record.from_arrays(time=T, position=T, force=F, name="rig"),
            {},
            ["rig", "does not repeat", "cycles=period"],
        ),
    ],
)
def test_a_mistake_is_one_message(records: Any, given: dict[str, Any], words: list[str]) -> None:
    with pytest.raises((ParameterError, RecordError)) as caught:
        choose(records, **({"candidates": ONE} | given))
    assert [word for word in words if word not in str(caught.value)] == []


def test_a_candidate_that_fails_is_noted_and_the_others_are_compared() -> None:
    def failing(_: Sequence[Record], __: float | None) -> Start:
        raise GMSError("it has no spring")

    found = choose(RECORD, candidates=[Candidate("bad", "", failing), ("one", *ONE["one"])])
    assert found.choice is not None
    bad, one = found.choice.rows
    assert (bad.name, bad.note) == ("bad", "it has no spring")
    assert np.isnan(bad.rmse)
    assert (one.name, one.note, found.choice.chosen) == ("one", "", "one")


def test_interrupted_it_chooses_among_those_compared() -> None:
    def interrupted(_: Sequence[Record], __: float | None) -> Start:
        raise KeyboardInterrupt

    last = Candidate("never", "", interrupted)
    found = choose(RECORD, candidates=[("one", *ONE["one"]), last])
    assert found.choice is not None
    assert found.choice.chosen == "one"
    assert "interrupted: 1 of 2 candidates" in found.stopped
    with pytest.raises(KeyboardInterrupt):
        choose(RECORD, candidates=[last])
