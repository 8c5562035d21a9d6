"""Each refusal has the class, place, value and message that are approved, and leaves no file."""

from __future__ import annotations

import pytest

from gms_fsm.errors import MissingExtraError
from tests.refusals import REFUSALS, approved, refused, told

INPUTS = {"a.toml", "own.csv", "in/a.toml", "in/own.csv", "own.toml", "pulled.toml", "pair.toml"}
INPUTS |= {"own.scxml", "file.scxml", "README-file-scxml.md", ".gms-fsm-files.json"}
INPUTS |= {f"test{number:02d}.csv" for number in range(13)}
TRACES = {"run.npz", ".npz", "run.txt", "run.csv", "run.transitions.csv", "out/own/trace.npz"}
SESSIONS = {"s.json", "odd.json"}
COUNTS = {"other.json", "system.json", "damaged.json", "swept.npz"}


@pytest.mark.parametrize("name", REFUSALS)
def test_it_is_refused_as_approved(name: str) -> None:
    error, files = refused(REFUSALS[name])
    if isinstance(error, MissingExtraError):
        pytest.skip(str(error))
    assert files <= INPUTS | TRACES | SESSIONS | COUNTS
    assert len(str(error)) < 2000
    assert "np." not in str(error)
    assert told(error) == approved()[name], "python -m tests.refusals approves what is new"


def test_no_other_message_is_approved() -> None:
    assert list(approved()) == list(REFUSALS)
