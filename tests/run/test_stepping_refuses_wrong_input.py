"""A stepping friction answers wrong input with one clear error, and stays as it was."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    Contact,
    FrictionBank,
    FrictionState,
    GMSParameters,
    LuGre,
    State,
    Stribeck,
)
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ParameterError
from gms_fsm.traces.failures import SimulationError
from tests.helpers import stick_slip

GIVEN = stick_slip("signed")
OTHER = LuGre(sigma_0=100.0, sigma_1=1.0, sigma_2=0.0, stribeck=Stribeck(1.0, 1.5, 0.01))


LOADED = Chart("loaded", inputs=("v", "N"), states=(State("only", outputs={"F": "N * v"}),))
STICTION = {"F_c": 1.0, "F_s": 2.0, "b": 0.0}
PLANAR = {"F_c": 1.0, "F_s": 2.0, "v_c": 1e-3}
ROOT = Chart(
    "root", inputs=("v",), variables=("z",), parameters=("k",),
    states=(State("only", flow={"z": "v * sqrt(sgn(0.5 - z))"}, outputs={"F": "k * z"}),),
)  # fmt: skip


def started(kind: str = "state") -> Any:
    """Return a friction after some samples: of one joint, or a bank of two."""
    friction: Any = FrictionState(GIVEN) if kind == "state" else FrictionBank([GIVEN, OTHER])
    v = 0.1 if kind == "state" else [0.1, 0.2]
    for _ in range(7):
        friction.advance(v, v, 0.3)
    return friction


STATE: dict[str, tuple[Callable[[FrictionState], Any], str]] = {
    "NaN": (lambda f: f.advance(math.nan, 0.1, 0.1), "v0 is nan; it must be finite"),
    "infinity": (lambda f: f.peek(0.1, math.inf, 0.1), "v1 is inf; it must be finite"),
    "a text": (lambda f: f.advance("fast", 0.1, 0.1), "v0 is 'fast'; it must be a number"),
    "nothing": (lambda f: f.advance(None, 0.1, 0.1), "v0 is None; it must be a number"),
    "an array": (lambda f: f.advance(0.1, [0.1, 0.2], 0.1), "it must be a number"),
    "back in time": (lambda f: f.advance(0.1, 0.1, -1e-3), "dt is -0.001; it must be >= 0"),
    "NaN seconds": (lambda f: f.peek(0.1, 0.1, math.nan), "dt is nan; it must be finite"),
    "a long time": (lambda f: f.advance(0.1, 0.1, 1e10), "it is too large; at most 1e+09 s"),
    "an earlier time": (
        lambda f: f.advance_to(0.1, 0.1, 1.0),
        "t is 1.0; it is before the present time 2.1 s; restore a snapshot to go back",
    ),
    "another input": (
        lambda f: f.advance(0.1, 0.1, 0.1, N=(1.0, 1.0)),
        "the further inputs given are N; this friction has no inputs but its velocity",
    ),
    "a snapshot of another model": (
        lambda f: f.restore(FrictionState(OTHER).snapshot()),
        "snapshot: it is of another model, or of one with other numbers",
    ),
    "a snapshot of a bank": (
        lambda f: f.restore(FrictionBank([GIVEN]).snapshot()),
        "snapshot: it is of another model",
    ),
    "no snapshot": (lambda f: f.restore([1.0]), "snapshot is [1.0]; it must be what snapshot()"),
    "a short array": (lambda f: f.from_array(f.to_array()[:-1]), "array: it has "),
    "the array of another model": (
        lambda f: f.from_array(FrictionState(OTHER).to_array()),
        "array: it has ",
    ),
    "an array of NaN": (lambda f: f.from_array(np.full(f.to_array().size, np.nan)), "finite"),
    "a perturbed array": (
        lambda f: f.from_array(f.to_array() + 0.5),
        "give what to_array returned, unchanged",
    ),
}


@pytest.mark.parametrize("kind", [int, np.float32, np.float64, np.array, Fraction])
def test_other_kinds_of_numbers(kind: Callable[[Any], Any]) -> None:
    assert started().advance(kind(1), kind(0), kind(2)) == started().advance(1.0, 0.0, 2.0)


BANKS: dict[str, tuple[Callable[[FrictionBank], Any], str]] = {
    "a number": (lambda b: b.advance(0.1, [0.1, 0.1], 0.1), "v0"),
    "three": (lambda b: b.advance([0.1] * 2, [0.1] * 3, 0.1), "v1: it has 3 entries; give 2, one"),
    "NaN": (lambda b: b.advance([0.1, math.nan], [0.1] * 2, 0.1), "v0[1]"),
    "back in time": (lambda b: b.peek([0.1] * 2, [0.1] * 2, -1.0), "dt is -1.0; it must be >= 0"),
    "another bank": (lambda b: b.restore(FrictionBank([GIVEN] * 3).snapshot()), "another model"),
    "a short array": (lambda b: b.from_array(b.to_array()[:-2]), "array: it has "),
    "half an array": (
        lambda b: b.from_array([*b.to_array()[:-5], *[0.5] * 5]),
        "give what to_array returned, unchanged",
    ),
}


WRONG = {("state", name): row for name, row in STATE.items()}
WRONG |= {("bank", name): row for name, row in BANKS.items()}


@pytest.mark.parametrize(("kind", "name"), WRONG)
def test_a_wrong_call_changes_nothing(kind: str, name: str) -> None:
    friction = started(kind)
    before = friction.to_array(), friction.t, friction.states, friction.switches
    call, text = WRONG[kind, name]
    with pytest.raises(ParameterError) as caught:
        call(friction)
    assert text in str(caught.value)
    np.testing.assert_array_equal(friction.to_array(), before[0])
    assert (friction.t, friction.states, friction.switches) == before[1:]
    v = (0.1, -0.1) if kind == "state" else ([0.1, 0.2], [-0.1, 0.2])
    after = friction.advance(*v, 1.0), started(kind).advance(*v, 1.0)
    np.testing.assert_array_equal(*after)


MADE: dict[str, tuple[Callable[[], Any], str]] = {
    "no model": (
        lambda: FrictionState(3),
        "model_or_contact is 3; it must be a model or a contact",
    ),
    "a class": (lambda: FrictionState(GMS), "must be a model or a contact, for example GMS("),
    "a late start": (lambda: FrictionState(GIVEN, t=1e9), "t is 1000000000.0; the clock would be"),
    "an input with the name of an argument": (
        lambda: FrictionState(Contact("pad", LOADED, inputs={"N": "2 * dt"})),
        "contact 'pad': its texts name 'dt', which is an argument of advance; give it another name",
    ),
    "an engine": (lambda: FrictionState(GIVEN, engine="machines"), "engine is 'machines'; it must"),
    "a tolerance": (lambda: FrictionState(GIVEN, rtol=-1.0), "rtol is -1.0; it must be > 0"),
    "an initial velocity": (
        lambda: FrictionState(GIVEN, initial={"v": 1.0}),
        "initial has 'v' = 1.0, but the rig prescribes the velocity; leave it out",
    ),
    "a lock": (
        lambda: FrictionState(Contact("pad", CHARTS["stiction"], STICTION)),
        "it locks the contact, and the force of a lock depends on the masses that it holds",
    ),
    "two velocities": (
        lambda: FrictionState(Contact("puck", CHARTS["planar-coulomb"], PLANAR, v=("v", "w"))),
        "only charts with one velocity can be stepped",
    ),
    "a period": (
        lambda: FrictionState(Contact("pad", GIVEN, period=0.1)),
        "it has a period of 0.1 s; leave it out, and call the contact at the ticks of your loop",
    ),
    "an empty bank": (lambda: FrictionBank([]), "models: it has no entries; give one per joint"),
    "a wrong joint": (lambda: FrictionBank([GIVEN, 3]), "models[1]"),
    "initial values": (
        lambda: FrictionBank([GIVEN], initial=[{}, {}]),
        "initial: it has 2 entries",
    ),
}


@pytest.mark.parametrize("name", MADE)
def test_what_cannot_step(name: str) -> None:
    make, text = MADE[name]
    with pytest.raises(ParameterError) as caught:
        make()
    assert text in str(caught.value)


@pytest.mark.parametrize("engine", ["ifelse", None])
def test_a_run_that_fails_in_a_sample(engine: str | None) -> None:
    """The flow is NaN beyond a point: the friction is as before, and can go another way."""
    friction = FrictionState(ChartModel(ROOT, {"k": 1.0}), engine=engine)
    friction.advance(0.1, 0.1, 1.0)
    before = friction.to_array()
    with pytest.raises(SimulationError) as caught:
        friction.advance(0.1, 0.1, 100.0)
    assert "as it was before the call, at t = 1.0 s" in str(caught.value)
    assert ".trace" not in str(caught.value)
    np.testing.assert_array_equal(friction.to_array(), before)
    assert friction.advance(0.1, -0.1, 1.0) > 0.0


def test_a_joint_of_a_bank_that_fails() -> None:
    root = ChartModel(ROOT, {"k": 1.0})
    bank = FrictionBank([GIVEN, root, root])
    before = bank.to_array()
    with pytest.raises(SimulationError, match="joint 2"):
        bank.advance([0.1, 0.01, 1.0], [0.1, 0.01, 9.0], 5.0)
    np.testing.assert_array_equal(bank.to_array(), before)
    assert bank.t == 0.0
    bank.advance([0.1, 0.01, 0.01], [0.1, 0.01, 0.01], 1.0)
    with pytest.raises(SimulationError, match=r"as it was before the call, at t = 1\.0 s"):
        bank.advance([0.1, 0.01, 1.0], [0.1, 0.01, 9.0], 5.0)


@pytest.mark.parametrize("engine", [pytest.param("ifelse", marks=pytest.mark.slow), None])
def test_what_the_last_sample_found_survives_a_failure(engine: str | None) -> None:
    k = np.linspace(40.0, 10.0, 100)  # more elements than the log of a sample has places
    stribeck = Stribeck(1.0, 1.5, 0.05)
    shares = np.full(100, 0.01)
    parameters = GMSParameters.from_shares(shares, k, C=1.0, stribeck=stribeck, v_c=1e-6)
    model = GMS(parameters, law="signed")

    def found(each: Any) -> Any:
        return each.switches, np.asarray(each.mean_force).tolist(), np.asarray(each.dF_dv).tolist()

    one = FrictionState(model, engine=engine)
    one.advance(0.0, 0.5, 10.0)
    before = found(one)
    assert len(one.switches) == 100
    with pytest.raises(SimulationError):
        one.advance(1e308, -1e308, 0.1)
    assert found(one) == before

    bank = FrictionBank([model, model, GIVEN], engine=engine)
    bank.advance([0.0] * 3, [0.5] * 3, 10.0)
    before = found(bank)
    with pytest.raises(SimulationError, match="joint 1"):
        bank.advance([0.5, 1e308, 0.5], [0.5, -1e308, 0.5], 0.1)
    assert found(bank) == before
    bank.advance([0.5] * 3, [-0.5] * 3, 1.0)
    assert found(bank) != before


def test_a_sample_that_the_clock_does_not_resolve() -> None:
    friction = FrictionState(GIVEN, t=1e8)
    with pytest.raises(ParameterError, match="below the resolution of the clock at t = 100000000"):
        friction.advance(0.1, 0.1, 1e-9)
    with pytest.raises(ParameterError, match="below the resolution of the clock"):
        FrictionBank([GIVEN], t=1e8).advance([0.1], [0.1], 1e-9)
    assert friction.peek(0.1, 0.1, 1e-9) == friction.peek(0.1, 0.1, 0.0)  # stages may be close


ENTERED = Chart(
    "entered", inputs=("v",), variables=("z",), parameters=("k",),
    states=(State("only", entry={"z": "z + v"}, flow={"z": "v"}, outputs={"F": "k * z"}),),
)  # fmt: skip


def test_a_state_from_other_initial_values_before_its_entry() -> None:
    model = ChartModel(ENTERED, {"k": 3.0})
    friction, other = FrictionState(model), FrictionState(model, initial={"z": [0.05]})
    with pytest.raises(ParameterError, match="array: it is of a friction that begins with other"):
        friction.from_array(other.to_array())
    with pytest.raises(ParameterError, match="snapshot: it is of another model"):
        friction.restore(other.snapshot())
    assert friction.advance(0.5, 0.5, 0.01) == pytest.approx(3 * (0.5 + 0.005), rel=1e-12)
    other = FrictionState(model)
    assert other.peek(0.1, 0.5, 0.0) == other.peek(0.5, 0.5, 0.0) == 1.5
    for engine in ("ifelse", None):
        assert FrictionBank([model], engine=engine).peek([0.1], [0.5], 0.0).tolist() == [1.5]
