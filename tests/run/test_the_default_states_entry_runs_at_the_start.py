"""A run starts with the entry of the default state, as a Stateflow chart does.

What the initial values give stays, and an element that starts in another state does not enter.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    Prescribed,
    State,
    Transition,
    simulate,
    sweep,
)

MODEL = ChartModel(
    Chart(
        "set at the start",
        inputs=("v", "t"),
        variables=("z", "w"),
        parameters=("k",),
        states=(
            State("first", flow={"z": "v"}, entry={"z": "k * v + t", "w": "2 * z"}),
            State("other", flow={"z": "v"}),
        ),
        transitions=(Transition("back", "other", "first", guard="z > 100"),),
        outputs={"F": "k * z"},
    ),
    {"k": [1.0, 3.0]},
    n=2,
)
RIG = Prescribed("0.5 + 0 * t")


@pytest.mark.parametrize("engine", ["ifelse", "machines", "compiled"])
def test_every_element_enters_with_its_own_numbers(engine: str) -> None:
    if engine == "compiled":
        pytest.importorskip("llvmlite")
    trace = simulate(MODEL, RIG, 3.0, t_start=2.0, engine=engine)
    assert trace.z[0].tolist() == [2.5, 3.5]
    assert trace.variable("w")[0].tolist() == [5.0, 7.0]


def test_what_is_given_stays_and_is_what_later_steps_see() -> None:
    trace = simulate(MODEL, RIG, 1.0, initial={"z": [0.25, 0.5]})
    assert trace.z[0].tolist() == [0.25, 0.5]
    assert trace.variable("w")[0].tolist() == [0.5, 1.0]


def test_another_state_is_not_entered() -> None:
    trace = simulate(MODEL, RIG, 1.0, initial={"states": ["other", "first"]})
    assert trace.z[0].tolist() == [0.0, 1.5]


@pytest.mark.slow
def test_a_compiled_sweep_enters_with_the_numbers_of_each_run() -> None:
    pytest.importorskip("llvmlite")
    k = np.linspace(1.0, 2.0, 130)  # two runs per task, which share their buffers
    found = sweep(MODEL, RIG, 0.1, {"k": k}, engine="compiled", progress=False)
    np.testing.assert_allclose(found.z[:, 0] - found.z[0, 0], 0.5 * (k - 1.0), rtol=1e-9)
