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


def moved(friction: FrictionState, start: int, stop: int) -> tuple[list[float], list[object]]:
    forces, log = [], []
    for j in range(start, stop):
        forces.append(friction.advance(V[j - 1], V[j], DT))
        log += friction.switches
    return forces, log


@pytest.mark.parametrize("engine", ENGINES)
def test_a_snapshot(engine: str) -> None:
    friction = FrictionState(stick_slip("signed"), engine=engine)
    moved(friction, 1, 60)
    before, states, t = friction.snapshot(), friction.states, friction.t
    first = moved(friction, 60, 400)
    assert first[1]  # it has switched
    friction.restore(before)
    assert (friction.states, friction.t, friction.switches) == (states, t, ())
    assert moved(friction, 60, 400) == first


@pytest.mark.parametrize("engine", ENGINES)
def test_a_snapshot_serves_another_friction_of_the_same_model(engine: str) -> None:
    one, other = (FrictionState(stick_slip("signed"), engine=engine) for _ in range(2))
    moved(one, 1, 60)
    other.restore(one.snapshot())
    assert moved(one, 60, 200) == moved(other, 60, 200)


@pytest.mark.parametrize("engine", ENGINES)
def test_looking_ahead(engine: str) -> None:
    friction = FrictionState(stick_slip("signed"), engine=engine)
    moved(friction, 1, 60)
    before = friction.to_array(), friction.t, friction.states, friction.switches
    seen = friction.peek(V[59], V[60], DT)
    assert friction.peek(V[59], 5.0, 30.0) != seen  # far, with many switches
    after = friction.to_array(), friction.t, friction.states, friction.switches
    np.testing.assert_array_equal(before[0], after[0])
    assert before[1:] == after[1:]
    assert friction.advance(V[59], V[60], DT) == seen


def test_an_array_serves_the_other_engine() -> None:
    one, other = (FrictionState(stick_slip("signed"), engine=e) for e in (ENGINES[0], ENGINES[-1]))
    assert one.to_array().tolist() == other.to_array().tolist()
    moved(one, 1, 60)
    array = one.to_array()
    assert np.isfinite(array).all()
    other.from_array(array)
    assert other.t == one.t
    assert moved(one, 60, 200) == moved(other, 60, 200)


def test_an_array_serves_a_friction_that_began_later() -> None:
    one, other = FrictionState(stick_slip("signed")), FrictionState(stick_slip("signed"), t=50.0)
    moved(one, 1, 60)
    other.from_array(one.to_array())
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


def test_a_bank() -> None:
    frictions = FrictionBank([stick_slip("signed"), stick_slip("published")])
    v = np.stack([V, 2 * V], axis=1)
    for j in range(1, 60):
        frictions.advance(v[j - 1], v[j], DT)
    before, array = frictions.snapshot(), frictions.to_array()
    seen = frictions.peek(v[59], v[60], DT)
    first = [frictions.advance(v[j - 1], v[j], DT).tolist() for j in range(60, 200)]
    assert first[0] == seen.tolist()
    for back in (lambda: frictions.restore(before), lambda: frictions.from_array(array)):
        back()
        assert [frictions.advance(v[j - 1], v[j], DT).tolist() for j in range(60, 200)] == first


@pytest.mark.parametrize("again", [copy.deepcopy, lambda given: pickle.loads(pickle.dumps(given))])
def test_copies_go_their_own_ways(again: Callable[[Any], Any]) -> None:
    friction = FrictionState(stick_slip("signed"), t=1.0)
    moved(friction, 1, 60)
    other = again(friction)
    first = moved(friction, 60, 200)
    assert other.t < friction.t
    assert moved(other, 60, 200) == first
    bank = FrictionBank([stick_slip("signed")] * 2, initial=[{}, {"x": 1.0}])
    bank.advance([0.0, 0.1], [0.3, 0.2], 2.0)
    other = again(bank)
    for each in (bank, other):
        assert each.advance([0.3, 0.2], [0.0, 0.0], 0.5).tolist() == pytest.approx(
            bank.peek([0.0, 0.0], [0.0, 0.0], 0.0).tolist(), abs=0
        )


@pytest.mark.parametrize("engine", ENGINES)
def test_going_back_forgets_the_last_sample(engine: str) -> None:
    friction = FrictionState(stick_slip("signed"), engine=engine)
    friction.advance(0.0, 0.5, 5.0)
    assert friction.switches
    for back in (
        lambda: friction.restore(friction.snapshot()),
        lambda: friction.from_array(friction.to_array()),
    ):
        friction.advance(0.5, -0.5, 5.0)
        assert friction.switches
        back()
        assert friction.switches == ()
        with pytest.raises(ParameterError, match="no last sample"):
            _ = friction.mean_force


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
