"""Each refusal of the table names its place and value, leaves no file, says what is approved."""

from __future__ import annotations

import pytest

from gms_fsm.errors import MissingExtraError, shown
from tests.refusals import REFUSALS, approved, place_of, refused, told

INPUTS = {"a.toml", "own.csv", "in/a.toml", "in/own.csv", "own.toml", "pulled.toml", "pair.toml"}
INPUTS |= {f"test{number:02d}.csv" for number in range(13)}
TRACES = {"run.npz", ".npz", "run.txt", "run.csv", "run.transitions.csv", "out/own/trace.npz"}
SESSIONS = {"s.json", "odd.json"}
COUNTS = {"other.json", "system.json", "damaged.json", "swept.npz"}


@pytest.mark.parametrize("name", REFUSALS)
def test_it_is_refused_at_its_place(name: str) -> None:
    row = REFUSALS[name]
    error, files = refused(row.call)
    if isinstance(error, MissingExtraError):
        pytest.skip(str(error))
    assert type(error) is row.error
    assert place_of(error).endswith(row.place)
    assert shown(error.value) == shown(row.value)
    assert files <= INPUTS | TRACES | SESSIONS | COUNTS
    assert len(str(error)) < 2000
    assert "np." not in str(error)
    assert told(error) == approved()[name], "python -m tests.refusals approves what is new"


def test_no_other_message_is_approved() -> None:
    assert list(approved()) == list(REFUSALS)
