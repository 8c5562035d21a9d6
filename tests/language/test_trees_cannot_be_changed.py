"""A tree and its spellings are frozen: no reader can change what another one uses."""

from __future__ import annotations

import dataclasses

import pytest

from gms_fsm.language import MATLAB_LIKE, Requirement, parse_condition, split
from gms_fsm.language.tree import walk


def test_a_tree_and_its_spelling_cannot_be_changed() -> None:
    condition = parse_condition(
        "not -a > b * 2 and (state(1) == slip or max(a, b) > c)", "abc", ["slip"], 1
    )
    parts = list(walk(condition))
    assert len({type(part) for part in parts}) == 10
    comparison = split(parse_condition("a > b", "abc"))
    assert isinstance(comparison, Requirement)
    for part in (*parts, MATLAB_LIKE, comparison, comparison.comparison):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, dataclasses.fields(part)[0].name, None)
