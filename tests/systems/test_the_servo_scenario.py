"""scenarios/servo.toml: the load is at 1.3299 mm after 24 switches, in equal bits everywhere.

An independent SciPy loop gave 1.32993 mm.
"""

from __future__ import annotations

import importlib.util

import pytest

from gms_fsm import Trace
from gms_fsm.app.scenario import load_scenario
from tests.helpers import ROOT, same_bits

pytestmark = pytest.mark.slow


def _run(engine: str) -> Trace:
    return load_scenario(ROOT / "scenarios" / "servo.toml").simulate(engine=engine)


def test_the_load_and_the_switches() -> None:
    trace = _run("ifelse")
    assert trace.t[-1] == 0.2
    assert 1e3 * trace.body("load").x[-1] == pytest.approx(1.32993, abs=5e-6)
    assert len(trace.transitions) == 24
    same_bits(trace, _run("machines"))


@pytest.mark.skipif(importlib.util.find_spec("llvmlite") is None, reason="needs the extra 'fast'")
def test_compiled_bits_are_equal() -> None:
    same_bits(_run("ifelse"), _run("compiled"))
