"""A stepping friction returns to snapshots and arrays; looking ahead changes nothing."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gms_fsm import GMS, FrictionBank, FrictionState, GMSParameters, Stribeck
from gms_fsm.errors import ParameterError
from tests.helpers import FASTEST, stick_slip
from tests.run.stepping_cases import bank

ENGINES = ["ifelse"] if FASTEST == "ifelse" else ["ifelse", "compiled"]
DT = 0.05
V = 0.3 * np.sin(np.arange(400) * DT)
Friction = FrictionState | FrictionBank


def state(engine: str | None = None, t: float = 0.0) -> FrictionState:
    return FrictionState(stick_slip("signed"), t=t, initial={"x": 1.0}, engine=engine)


def two(engine: str | None = None, t: float = 0.0) -> FrictionBank:
    models = [stick_slip("signed"), stick_slip("published")]
    return FrictionBank(models, t=t, initial=[{}, {"x": 1.0}], engine=engine)


def speeds(friction: Friction, v: float) -> Any:
    return v if isinstance(friction, FrictionState) else np.array([v, 2.0 * v])


def moved(friction: Friction, start: int, stop: int) -> tuple[list[Any], list[Any]]:
    """Return the forces along the record, and the switches."""
    forces, log = [], []
    for j in range(start, stop):
        ends = speeds(friction, V[j - 1]), speeds(friction, V[j])
        forces.append(np.asarray(friction.advance(*ends, DT)).tolist())
        log.append(friction.switches)
    return forces, log


def known(friction: Friction) -> tuple[Any, ...]:
    return friction.to_array().tolist(), friction.t, friction.states, friction.switches


made = pytest.mark.parametrize("make", [state, two])
engines = pytest.mark.parametrize("engine", ENGINES)


@made
@engines
def test_a_snapshot_serves_its_friction_and_another_one(make: Any, engine: str) -> None:
    one, other = make(engine), make(engine)
    moved(one, 1, 60)
    before, states, t = one.snapshot(), one.states, one.t
    first = moved(one, 60, 400)
    assert any(map(any, first[1]))  # it has switched
    for each in (one, other):
        each.restore(before)
        assert (each.states, each.t) == (states, t)
        assert not any(map(any, [each.switches]))
        assert moved(each, 60, 400) == first


@made
@engines
def test_looking_ahead(make: Any, engine: str) -> None:
    friction = make(engine)
    moved(friction, 1, 60)
    before = known(friction)
    ends = speeds(friction, V[59]), speeds(friction, V[60])
    seen = np.asarray(friction.peek(*ends, DT)).tolist()
    far = friction.peek(ends[0], speeds(friction, 5.0), 30.0)  # with many switches
    assert np.asarray(far).tolist() != seen
    assert known(friction) == before
    assert moved(friction, 60, 61)[0] == [seen]


@made
@pytest.mark.parametrize("t", [0.0, 50.0])
def test_an_array_serves_the_other_engine_also_when_it_began_later(make: Any, t: float) -> None:
    one, other = make(ENGINES[0]), make(ENGINES[-1], t)
    if t == 0.0:
        assert one.to_array().tolist() == other.to_array().tolist()
    moved(one, 1, 60)
    array = one.to_array()
    assert np.isfinite(array).all()
    other.from_array(array)
    assert other.t == one.t
    assert moved(one, 60, 200) == moved(other, 60, 200)


@pytest.mark.parametrize("seed", range(10))
def test_an_array_with_one_number_changed_is_refused_or_runs(seed: int) -> None:
    """Whatever a host does to the numbers, machine code never uses them as wrong addresses."""
    rng = np.random.default_rng(seed)
    model, speed = bank(rng)
    friction = FrictionState(model)
    for _ in range(20):
        friction.advance(speed, -speed, 1e-3)
    whole = friction.to_array()
    refused = 0
    for place in range(whole.size):
        changed = whole.copy()
        changed[place] = rng.choice([-1.0, 0.5, 3.0, 1e9, 2.0**40])
        try:
            friction.from_array(changed)
        except ParameterError:
            refused += 1
            np.testing.assert_array_equal(friction.to_array(), whole)
        else:
            friction.from_array(whole)
    assert refused > 20


@made
@pytest.mark.parametrize("again", [copy.deepcopy, lambda given: pickle.loads(pickle.dumps(given))])
def test_copies_go_their_own_ways(make: Any, again: Callable[[Any], Any]) -> None:
    friction = make(t=1.0)
    moved(friction, 1, 60)
    other = again(friction)
    first = moved(friction, 60, 200)
    assert other.t < friction.t
    assert moved(other, 60, 200) == first


@made
@engines
def test_going_back_forgets_the_last_sample(make: Any, engine: str) -> None:
    friction = make(engine)
    for back in (
        lambda: friction.restore(friction.snapshot()),
        lambda: friction.from_array(friction.to_array()),
    ):
        friction.advance(speeds(friction, 0.5), speeds(friction, -0.5), 5.0)
        assert any(map(any, [friction.switches]))
        back()
        assert not any(map(any, [friction.switches]))
        with pytest.raises(ParameterError, match="no last sample"):
            _ = friction.mean_force


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_banks_that_share_a_snapshot_keep_their_own_switches(engine: str) -> None:
    n = 100  # more elements than the log of a sample has places
    parameters = GMSParameters.from_shares(
        np.full(n, 1 / n), np.linspace(40, 10, n), C=1.0, stribeck=Stribeck(1.0, 1.5, 0.05),
        v_c=1e-6,
    )  # fmt: skip
    one, other = (FrictionBank([GMS(parameters, law="signed")] * 2, engine=engine) for _ in "ab")
    one.advance([0.0, 0.0], [0.5, 0.5], 10.0)
    assert [len(each) for each in one.switches] == [n, n]
    other.restore(one.snapshot())
    other.advance([0.5, 0.5], [0.5, 0.5], 0.1)
    assert [len(each) for each in one.switches] == [n, n]
    assert other.switches == ((), ())
