"""Edges by the time in a state (``after(T)``), from several states, and at once (``True``)."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Transition, simulate

LAMP = Chart(
    "lamp",
    parameters=("T",),
    states=(
        State("red", outputs={"F": "1"}),
        State("green", outputs={"F": "2"}),
        State("broken", outputs={"F": "0"}),
        State("passing", outputs={"F": "3"}),
    ),
    transitions=(
        Transition("fails", ("red", "green"), "broken", guard="v > 0.5"),
        Transition("go", "red", "passing", guard="after(T)"),
        Transition("through", "passing", "green", guard="True"),
        Transition("stop", "green", "red", guard="after(2 * T)"),
    ),
)


def lamp(T: float = 0.3) -> ChartModel:
    return ChartModel(LAMP, {"T": T})


@pytest.mark.parametrize("engine", ["ifelse", "machines", "compiled"])
def test_ages_are_met_exactly(engine: str) -> None:
    if engine == "compiled":
        pytest.importorskip("llvmlite")
    trace = simulate(lamp(), Prescribed("0"), 5.0, engine=engine)
    log = trace.transitions
    wanted = np.cumsum([0.3, 0.0, 0.6] * 6)[: len(log)]
    np.testing.assert_allclose(log.t, wanted, rtol=0, atol=1e-13)
    assert log.edge.tolist()[:6] == ["go", "through", "stop"] * 2


def test_an_edge_with_several_sources_leaves_each_of_them() -> None:
    """It is drawn, logged and named as one edge."""
    for speed, source in (("t - 0.4", "green"), ("10 * t - 0.5", "red")):
        trace = simulate(lamp(), Prescribed(speed), 2.0)
        last = trace.transitions[-1]
        assert (last.edge, last.source, last.target) == ("fails", source, "broken")
    assert [edge.source for edge in LAMP.transitions if edge.name == "fails"] == ["red", "green"]
    assert LAMP.transitions[0].sources == ("red", "green")


def test_a_guard_that_always_holds_fires_at_once() -> None:
    trace = simulate(lamp(), Prescribed("0"), 1.0)
    log = trace.transitions
    assert log.t[0] == log.t[1]
    assert "passing" not in trace.states[:, 0][np.diff(trace.t, append=np.inf) > 0]


def test_the_age_is_a_variable_of_its_own_that_every_entry_resets() -> None:
    trace = simulate(lamp(), Prescribed("0"), 0.95, t_eval=[0.25, 0.35, 0.85, 0.95])
    np.testing.assert_allclose(trace.variable("age")[:, 0], [0.25, 0.05, 0.55, 0.05], atol=1e-12)
    assert "age" not in {name for state in LAMP.states for name in state.flow}
