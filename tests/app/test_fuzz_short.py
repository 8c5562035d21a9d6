"""Any bytes as a text, scenario file or trace file raise only documented errors.

A few hundred inputs each; `make soak` tries them for minutes, with limits on time and memory. The
inputs that once broke something are rows of `tests/refusals.py`.
"""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.soak import fuzz


@pytest.mark.slow
@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.binary(max_size=200))
def test_expressions(data: bytes) -> None:
    fuzz.one_expression(data)


@pytest.mark.slow
@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.binary(max_size=200))
def test_scenario_files(data: bytes) -> None:
    fuzz.one_scenario(data)


@pytest.mark.slow
@settings(max_examples=250, deadline=None, derandomize=True)
@given(st.binary(max_size=200))
def test_trace_files(data: bytes) -> None:
    fuzz.one_trace_file(data)


@pytest.mark.slow
@pytest.mark.parametrize("name", fuzz.BODIES)
def test_the_bodies_reach_both_sides(name: str) -> None:
    """Long random inputs, as `make soak` makes them: some are accepted, most are rejected."""
    answers = [fuzz.BODIES[name](random.Random(f"{i}").randbytes(128)) for i in range(60)]
    assert 1 <= sum(answers) <= 50
