"""Calls that turn at one point are each computed, and a parameter may have any name, such as a."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, PulledSlider, State, simulate
from tests.corpus import ENGINES
from tests.helpers import same_bits

FLOWS = {
    "max(v, 2) + 10 * max(v - 2, 0)": lambda v: np.maximum(v, 2) + 10 * np.maximum(v - 2, 0),
    "min(v, 2) - 3 * min(v - 2, 0)": lambda v: np.minimum(v, 2) - 3 * np.minimum(v - 2, 0),
    "max(v, 2) + max(2, v) + max(v - 2, 0) + min(v, 2)": (
        lambda v: 2 * np.maximum(v, 2) + np.maximum(v - 2, 0) + np.minimum(v, 2)
    ),
    "max(2 * max(v, 2), 4) + max(v - 2, 0)": (
        lambda v: 2 * np.maximum(v, 2) + np.maximum(v - 2, 0)
    ),
}


@pytest.mark.every(3)
@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_calls_that_turn_together_are_each_computed(engine: str) -> None:
    for text, exact in FLOWS.items():
        states = (State("only", flow={"z": text}),)
        chart = Chart("integral", ("v",), ("z",), (), states, (), {"F": "z"})
        trace = simulate(ChartModel(chart, {}), Prescribed("t"), 4.0, engine=engine)
        t = np.linspace(0.0, 4.0, 400_001)
        cells = 0.5 * (exact(t)[1:] + exact(t)[:-1]) * np.diff(t)
        assert trace.z[-1, 0] == pytest.approx(cells.sum(), rel=1e-7), text


@pytest.mark.parametrize("engine", ["ifelse", "machines"])
def test_a_parameter_called_a_is_not_the_acceleration(engine: str) -> None:
    found = []
    for name in ("a", "k"):
        states = (State("on", flow={"z": "v"}),)
        chart = Chart("spring", (), ("z",), (name,), states, (), {"F": f"{name} * z"})
        model, rig = ChartModel(chart, {name: 3.0}), PulledSlider(1.0, 2.0, 0.1)
        found.append(simulate(model, rig, 2.0, engine=engine))
    same_bits(*found)
    assert found[0].F[-1] == 3.0 * found[0].z[-1, 0] > 0.0
