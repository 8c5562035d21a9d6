"""Rate-and-state, Bouc-Wen and seven parameters: equal bits in each engine, and at any length.

The puck of planar-coulomb is in tests/systems, with the same claims.
"""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from gms_fsm import ChartModel, Prescribed, PulledSlider, Trace, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from tests.helpers import same_bits

MICRO = 2.0**-20  # about 1e-6
POWERS = {"N/m": -1, "Ns/m": -1, "m": 1, "m/s": 1}  # of a length, in the units of parameters
NAMES = ("rate-state-ageing", "rate-state-slip", "bouc-wen", "seven-parameter")
SOFT = {"k_t": 2e3, "v_s": 0.02}  # or the mass would ring at 50 Hz


def run(name: str, length: float = 1.0, engine: str = "ifelse") -> Trace:
    """Run a chart with its demonstration's numbers, all lengths multiplied."""
    values = dict(entry(name).demonstration.values)
    values |= SOFT if name == "seven-parameter" else {}
    scaled = {
        each.name: values[each.name] * length ** POWERS.get(each.unit, 0)
        for each in CHARTS[name].parameters
    }
    model = ChartModel(CHARTS[name], scaled)
    if name == "seven-parameter":
        rig = PulledSlider(1.0 / length, 2.0 / length, 0.1 * length)
        return simulate(model, rig, 11.0, engine=engine)
    drive = Prescribed(f"{2e-3 * length!r} * (cos(3 * t) + 0.9 * cos(9.3 * t))")
    return simulate(model, drive, 4.0, engine=engine)


@pytest.mark.parametrize("name", NAMES)
def test_the_machines_give_the_bits_of_the_if_else_text(name: str) -> None:
    same_bits(run(name), run(name, engine="machines"))


@pytest.mark.skipif(importlib.util.find_spec("llvmlite") is None, reason="needs the extra 'fast'")
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_machine_code_gives_the_same_bits(name: str) -> None:
    same_bits(run(name), run(name, engine="compiled"))


@pytest.mark.parametrize("name", NAMES)
def test_at_micrometres_only_lengths_change(name: str) -> None:
    here, there = run(name), run(name, MICRO)
    np.testing.assert_array_equal(there.t, here.t)
    np.testing.assert_array_equal(there.F, here.F)
    np.testing.assert_array_equal(there.x, MICRO * here.x)
    assert there.transitions.edge.tolist() == here.transitions.edge.tolist()
    assert abs(here.F).max() > 0.5
