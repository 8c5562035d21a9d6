"""Each chart of the zoo gives equal bits in all engines, and the same sequence at any length."""

from __future__ import annotations

import pytest

from tests.systems_cases import same_system_bits
from tests.zoo.zoo_cases import CASES

MICROMETRE = 2.0**-20  # m, about


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("unit", [1.0, MICROMETRE])
def test_engines_agree(name: str, unit: float) -> None:
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    one = CASES[name](unit).run("compiled")
    assert len(one) > 40
    for engine in ("ifelse", "machines"):
        same_system_bits(one, CASES[name](unit).run(engine))


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("unit", [MICROMETRE, 2.0**-30, 2.0**10])
def test_lengths_change_nothing_but_lengths(name: str, unit: float) -> None:
    here, there = (CASES[name](each).run("ifelse") for each in (1.0, unit))
    assert there.transitions.edge.tolist() == here.transitions.edge.tolist()
    assert there.t.tolist() == here.t.tolist()
    assert (there.F == here.F).all()
    assert (there.x == unit * here.x).all()
