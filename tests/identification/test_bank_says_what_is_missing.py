"""What a bank cannot be made from is named, with the value and what to do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import GMSError, ParameterError, Record, RecordError, initial_bank

T = np.arange(0.0, 20.0, 0.05)
X = 1e-3 * np.sin(T)
F = np.sign(np.cos(T))
GOOD = Record.from_arrays(time=T, position=X, force=F)


def record(**given: Any) -> Record:
    return Record.from_arrays(**({"time": T, "position": X, "force": F, "name": "rig"} | given))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (record(force=None), ["rig", "no force", "force=(name, unit)"]),
        (record(position=np.full(T.size, 0.2)), ["rig", "motion does not change"]),
        (record(force=np.full(T.size, 3.0)), ["rig", "force does not change"]),
        (record(force=-F), ["rig", "does not oppose the motion", "-force"]),
        (record(time=T[:12], position=X[:12], force=F[:12]), ["training row(s)", "at least 20"]),
        (record(time=T[:100], position=T[:100], force=T[:100]), ["rig", "90%", "to and fro"]),
    ],
)
def test_a_record_that_does_not_tell(given: Record, words: list[str]) -> None:
    with pytest.raises(RecordError) as caught:
        initial_bank(given, 2)
    assert [word for word in words if word not in str(caught.value)] == []


@pytest.mark.parametrize("n", [0, -1, 2.5, True, None, "4"])
def test_a_number_of_elements_is_a_positive_integer(n: Any) -> None:
    with pytest.raises(ParameterError, match=r"n is .*; it must be an integer, at least 1"):
        initial_bank(GOOD, n)


def test_there_are_at_most_sixty_elements() -> None:
    with pytest.raises(ParameterError, match="n is 61; it must be at most 60"):
        initial_bank(GOOD, 61)


@pytest.mark.parametrize("train", [(5.0, 5.0), (9.0, 2.0), (0.0,), 3.0, "all", (np.nan, 1.0)])
def test_training_rows_are_an_interval(train: Any) -> None:
    with pytest.raises(ParameterError, match="train"):
        initial_bank(GOOD, 2, train=train)


def test_an_interval_outside_the_record_has_no_rows() -> None:
    for train in ((-9.0, -1.0), (100.0, 200.0)):
        with pytest.raises(RecordError, match=r"0 training row\(s\)"):
            initial_bank(GOOD, 2, train=train)


@pytest.mark.parametrize("records", [[], None, [GOOD, None], "rig.csv"])
def test_records_are_records(records: Any) -> None:
    with pytest.raises(ParameterError, match="records"):
        initial_bank(records, 2)


@pytest.mark.parametrize("wrong", [{"law": "fair"}, {"v_c": 0.0}, {"smoothing": -1.0}])
def test_other_arguments_are_checked(wrong: dict[str, Any]) -> None:
    with pytest.raises(GMSError, match=next(iter(wrong))):
        initial_bank(GOOD, 2, **wrong)
