"""Edges by the time in a state (``after(T)``), from several states, and at once (``True``)."""

from __future__ import annotations

import numpy as np

from gms_fsm import Chart, ChartModel, Prescribed, State, Transition, simulate
from tests.corpus import LAMP, run, trace


def test_ages_are_met_exactly_and_a_guard_that_always_holds_fires_at_once() -> None:
    one = trace("ages")
    log = one.transitions
    wanted = np.cumsum([0.3, 0.0, 0.6] * 6)[: len(log)]
    np.testing.assert_allclose(log.t, wanted, rtol=0, atol=1e-13)
    assert log.edge.tolist()[:6] == ["go", "through", "stop"] * 2
    assert "passing" not in one.states[:, 0][np.diff(one.t, append=np.inf) > 0]


def test_an_edge_with_several_sources_leaves_each_of_them() -> None:
    """It is drawn, logged and named as one edge."""
    for speed, source in (("t - 0.35", "green"), ("10 * t - 0.5", "red")):
        one = simulate(ChartModel(LAMP, {"T": 0.3}), Prescribed(speed), 2.0)
        last = one.transitions[-1]
        assert (last.edge, last.source, last.target) == ("fails", source, "broken")
    assert [edge.source for edge in LAMP.transitions if edge.name == "fails"] == ["red", "green"]
    assert LAMP.transitions[0].sources == ("red", "green")


def test_the_age_is_a_variable_of_its_own_that_every_entry_resets() -> None:
    one = run("ages")(t_eval=[0.25, 0.35, 0.85, 0.95])
    np.testing.assert_allclose(one.variable("age")[:, 0], [0.25, 0.05, 0.55, 0.05], atol=1e-12)
    assert "age" not in {name for state in LAMP.states for name in state.flow}


def test_an_edge_from_a_state_to_itself_counts_every_time_span() -> None:
    chart = Chart(
        "clock",
        variables=("n",),
        states=(State("on", {"n": "0"}),),
        transitions=(Transition("tick", "on", "on", "every(0.7)", actions={"n": "n + 1"}),),
        outputs={"F": "n"},
    )
    one = simulate(ChartModel(chart, {}), Prescribed("0"), 10.0)
    np.testing.assert_allclose(one.transitions.t, 0.7 * np.arange(1, 15), rtol=1e-13)
    assert one.F[-1] == 14.0


def test_a_parameter_called_every_is_one() -> None:
    (edge,) = Chart(
        "own",
        variables=("n",),
        parameters=("every",),
        states=(State("on", {"n": "1"}),),
        transitions=(Transition("tick", "on", "on", "n > every", actions={"n": "0"}),),
        outputs={"F": "n"},
    ).transitions
    assert edge.guard == "n > every"
