"""The systems in scenarios/ give equal bits in all engines."""

from __future__ import annotations

import importlib.util

import pytest

from gms_fsm.app.scenario import load_scenario
from tests.helpers import ROOT
from tests.systems_cases import same_system_bits

pytestmark = pytest.mark.slow

NAMES = (
    "ball_screw_table",
    "belt_driven_mass",
    "brake_squeal",
    "drill_string",
    "friction_damper",
    "two_blocks_on_a_belt",
)
ENGINES = ["machines"] + ["compiled"] * bool(importlib.util.find_spec("llvmlite"))


@pytest.mark.parametrize("name", NAMES)
def test_the_bits_are_equal(name: str) -> None:
    loaded = load_scenario(ROOT / "scenarios" / f"{name}.toml")
    one = loaded.simulate(engine="ifelse")
    assert len(one.transitions) > 20
    for engine in ENGINES:
        same_system_bits(one, loaded.simulate(engine=engine))
