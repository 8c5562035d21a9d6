"""The machines, the if-else text and machine code give equal bits for systems that lock."""

from __future__ import annotations

import pytest

from tests.systems_cases import CASES, same_system_bits


@pytest.mark.parametrize("name", CASES)
def test_engines_agree(name: str) -> None:
    pytest.importorskip("numba", reason="needs numba (extra: fast)")
    one = CASES[name]().run("compiled")
    assert len(one.transitions)
    for engine in ("ifelse", "machines"):
        same_system_bits(one, CASES[name]().run(engine))
