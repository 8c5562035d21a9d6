"""`FrictionEquations` in somebody's own event loop: every switch of `simulate`, clear refusals."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.integrate

from gms_fsm import (
    Chart,
    ChartModel,
    Contact,
    FrictionEquations,
    ParameterError,
    State,
    Transition,
    simulate,
)
from gms_fsm.errors import ChartError
from tests.helpers import FASTEST, pulled_mass, stick_slip


def _own_loop(friction: FrictionEquations, t_end: float, method: Any) -> list[Any]:
    """A pulled mass; after each step bisect on what `truth` was after the last settle."""
    t, y, switches = 0.0, np.array([0.0, 0.0, *friction.initial]), list[Any]()

    def rates(t: float, y: Any) -> Any:
        a = 2.0 * (0.1 * t - y[0]) - friction.force(t, y[2:], y[1])
        return [y[1], a, *friction.derivatives(t, y[2:], y[1])]

    while t < t_end:
        y[2:] = friction.settle(t, y[2:], y[1])
        switches += friction.switches
        before = friction.truth(t, y[2:], y[1])
        solver = method(rates, t, y, t_end, rtol=1e-6, atol=1e-9)
        while solver.status == "running":
            solver.step()
            path, low, high = solver.dense_output(), solver.t_old, solver.t
            y_high = path(high)
            if friction.truth(high, y_high[2:], y_high[1]) == before:
                continue
            while low < (middle := 0.5 * (low + high)) < high:
                y_middle = path(middle)
                if friction.truth(middle, y_middle[2:], y_middle[1]) == before:
                    low = middle
                else:
                    high = middle
            t, y = high, path(high)
            break
        else:
            t, y = solver.t, solver.y
    return switches


@pytest.mark.every(3)
@pytest.mark.slow
@pytest.mark.parametrize(("method", "error"), [("RK45", 1e-4), ("Radau", 1e-5), ("LSODA", 5e-4)])
def test_72_of_72(method: str, error: float) -> None:
    model, rig = pulled_mass()
    log = simulate(model, rig, 60.0, engine=FASTEST, rtol=1e-9).transitions
    found = _own_loop(FrictionEquations(model), 60.0, getattr(scipy.integrate, method))
    assert len(found) == 72
    assert [(s.element, s.edge) for s in found] == [(int(r.element), str(r.edge)) for r in log]
    assert np.max(np.abs(np.array([s.t for s in found]) - log.t)) < error


def test_margins_change_sign_with_truth() -> None:
    model, _ = pulled_mass()
    friction = FrictionEquations(model)
    y = friction.settle(0.0, friction.initial, 0.01)
    margins, truth = friction.margins(0.0, y, 0.01), friction.truth(0.0, y, 0.01)
    beyond = y + 1.0
    changed = np.array(friction.truth(0.0, beyond, 0.01)) != np.array(truth)
    assert changed.any()
    crossed = np.sign(friction.margins(0.0, beyond, 0.01)) != np.sign(margins)
    assert np.array_equal(changed, crossed)


def test_signs_and_states_stay_until_the_next_settle() -> None:
    model, _ = pulled_mass()
    friction = FrictionEquations(model, initial={"z": [0.05] * 4})
    y = friction.settle(0.0, friction.initial, 0.01)
    assert friction.states == ("slip",) * 4
    slopes = [friction.derivatives(0.0, y, v)[1] for v in (1e-5, -1e-5)]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-6)  # sgn(v) is frozen
    assert friction.switches[0].edge == "break_away_forward"


def test_wrong_numbers_change_nothing() -> None:
    model, _ = pulled_mass()
    friction = FrictionEquations(model)
    y = friction.settle(0.0, friction.initial, 0.1)
    before = friction.truth(0.0, y, 0.1)
    for wrong in (
        (math.nan, y, 0.1),
        (0.0, y, math.inf),
        (0.0, y[1:], 0.1),
        (0.0, y * math.nan, 0),
    ):
        with pytest.raises(ParameterError):
            friction.settle(*wrong)
    with pytest.raises(ParameterError, match=r"y has the shape \(4,\); it must be \(5,\)"):
        friction.derivatives(0.0, y[1:], 0.1)
    assert friction.truth(0.0, y, 0.1) == before
    assert friction.states == ("stick",) * 4


def test_edges_without_end_are_an_error() -> None:
    chart = Chart(
        "flutters",
        states=(State("a"), State("b")),
        transitions=(
            Transition("go", "a", "b", guard="v > 1"),
            Transition("back", "b", "a", guard="v > 1"),
        ),
        outputs={"F": "v"},
    )
    friction = FrictionEquations(ChartModel(chart, {}))
    y = friction.settle(0.0, friction.initial, 0.0)
    with pytest.raises(ChartError, match="edges are enabled without end"):
        friction.settle(0.0, y, 2.0)
    assert friction.states == ("a",)


FREE = {"F": "v"}
READS_N = Chart("pressed", inputs=("v", "N"), states=(State("on"),), outputs={"F": "N*v"})


def test_a_contact_with_formulas_of_time() -> None:
    friction = FrictionEquations(Contact("pad", READS_N, inputs={"N": "10 + t"}))
    y = friction.settle(0.0, friction.initial, 0.5)
    assert friction.force(2.0, y, 0.5) == 6.0


def test_an_action_that_gives_nan_is_an_error() -> None:
    chart = Chart(
        "log", inputs=("v",), variables=("z",), parameters=("k",),
        states=(State("a", flow={"z": "v"}), State("b", flow={"z": "v"})),
        transitions=(Transition("over", "a", "b", guard="z > 0.3", actions={"z": "log(-z)"}),),
        outputs={"F": "k * z"},
    )  # fmt: skip
    friction = FrictionEquations(ChartModel(chart, {"k": 1.0}))
    y = friction.settle(0.0, friction.initial, 0.1)
    y[-1] = 0.5
    with pytest.raises(ChartError, match=r"an edge assigns NaN or infinity.*the actions of over"):
        friction.settle(0.0, y, 0.1)
    assert friction.states == ("a",)


COPIES = [copy.copy, copy.deepcopy, lambda given: pickle.loads(pickle.dumps(given))]


@pytest.mark.parametrize("again", COPIES)
def test_copies_go_on_from_the_same_state_their_own_ways(again: Callable[[Any], Any]) -> None:
    friction = FrictionEquations(stick_slip("signed"), initial={"x": 1.0})
    y = friction.settle(0.0, friction.initial, 0.1)
    y[1:] = 2.0  # m, beyond the thresholds
    friction.settle(0.0, y, 0.1)

    def known(one: FrictionEquations) -> tuple[Any, ...]:
        values = one.force(0.1, y, 0.1), one.derivatives(0.1, y, 0.1).tolist()
        return one.states, one.switches, one.initial[0], one.truth(0.1, y, 0.1), *values

    other, before = again(friction), known(friction)
    assert known(other) == before
    other.settle(0.1, y, -0.5)
    assert known(friction) == before != known(other)
