"""An exported C99 program computes forces, states and switch times of the engine, bit for bit."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.exporters.c_cases import CASES, case
from tests.exporters.c_programs import COMPILERS, same_bits

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not COMPILERS, reason="there is no C compiler"),
]


FIRST = ("GMS 4", "servo", "between states")  # a bank, a sampled controller, sliding


@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=[pytest.mark.matrix] * (each not in FIRST)) for each in CASES]
)
def test_on_a_random_record(name: str, tmp_path: Path) -> None:
    given, t, inputs = case(name, 1)
    switches = same_bits(given, tmp_path, t, COMPILERS[:1], **inputs)
    assert switches > 10 or name == "LuGre"
