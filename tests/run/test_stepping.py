"""A stepping friction goes forward, looks ahead and goes back; a bank is many of them.

That its steps give the bits of `simulate` is in test_stepping_equals_simulate.py; wrong input,
which leaves it as it was, is in tests/refusals.py.
"""

from __future__ import annotations

import copy
import itertools
import pickle
import threading
from collections.abc import Callable
from fractions import Fraction
from math import nan, sin
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    FrictionBank,
    FrictionState,
    GMSParameters,
    ParameterError,
    Prescribed,
    State,
    Stribeck,
    System,
    simulate,
)
from gms_fsm.lowering import compiling
from gms_fsm.traces.failures import SimulationError
from tests.helpers import FASTEST, pulled_mass, stick_slip
from tests.run.stepping_cases import bank, friction

ENGINES = sorted({"ifelse", FASTEST})
DT = 0.05
V = 0.3 * np.sin(np.arange(400) * DT)
GIVEN = stick_slip("signed")
made = pytest.mark.parametrize("kind", ["state", "bank"])
engines = pytest.mark.parametrize("engine", ENGINES)


def make(kind: str, engine: str | None = None, t: float = 0.0) -> Any:
    if kind == "state":
        return FrictionState(GIVEN, t=t, initial={"x": 1.0}, engine=engine)
    models = [GIVEN, stick_slip("published")]
    return FrictionBank(models, t=t, initial=[{}, {"x": 1.0}], engine=engine)


def speeds(friction: Any, v: float) -> Any:
    return v if isinstance(friction, FrictionState) else np.array([v, 2.0 * v])


def moved(friction: Any, start: int, stop: int) -> tuple[list[Any], list[Any]]:
    """Return the forces along the record, and the switches."""
    forces, log = [], []
    for j in range(start, stop):
        ends = speeds(friction, V[j - 1]), speeds(friction, V[j])
        forces.append(np.asarray(friction.advance(*ends, DT)).tolist())
        log.append(friction.switches)
    return forces, log


def known(friction: Any) -> tuple[Any, ...]:
    return friction.to_array().tolist(), friction.t, friction.states, friction.switches


# --------------------------------------------------------------------------- forward and back
@pytest.mark.every(2)
@pytest.mark.slow
@made
@engines
def test_a_snapshot_serves_its_friction_and_another_one(kind: str, engine: str) -> None:
    one, other = make(kind, engine), make(kind, engine)
    moved(one, 1, 60)
    before, states, t = one.snapshot(), one.states, one.t
    first = moved(one, 60, 400)
    assert any(map(any, first[1]))  # it has switched
    for each in (one, other):
        each.restore(before)
        assert (each.states, each.t) == (states, t)
        assert not any(map(any, [each.switches]))
        with pytest.raises(ParameterError, match="no last sample"):
            _ = each.mean_force
        assert moved(each, 60, 400) == first


@made
@engines
def test_looking_ahead_changes_nothing(kind: str, engine: str) -> None:
    friction = make(kind, engine)
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
def test_an_array_serves_the_other_engine_also_when_it_began_later(kind: str, t: float) -> None:
    one, other = make(kind, ENGINES[0]), make(kind, ENGINES[-1], t)
    if t == 0.0:
        assert one.to_array().tolist() == other.to_array().tolist()
    moved(one, 1, 60)
    other.from_array(one.to_array())
    assert not any(map(any, [other.switches]))
    assert other.t == one.t
    assert moved(one, 60, 200) == moved(other, 60, 200)


@made
@pytest.mark.parametrize("again", [copy.deepcopy, lambda given: pickle.loads(pickle.dumps(given))])
def test_copies_go_their_own_ways(kind: str, again: Callable[[Any], Any]) -> None:
    friction = make(kind, t=1.0)
    moved(friction, 1, 60)
    other = again(friction)
    first = moved(friction, 60, 200)
    assert other.t < friction.t
    assert moved(other, 60, 200) == first


@pytest.mark.every(2)
@pytest.mark.parametrize("seed", range(6))
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


@pytest.mark.parametrize("kind", [int, np.float32, np.float64, np.array, Fraction])
def test_other_kinds_of_numbers(kind: Callable[[Any], Any]) -> None:
    one, other = FrictionState(GIVEN), FrictionState(GIVEN)
    assert one.advance(kind(1), kind(0), kind(2)) == other.advance(1.0, 0.0, 2.0)


@pytest.mark.matrix
@pytest.mark.slow
@engines
def test_joints_of_many_kinds_give_the_bits_of_joints_alone(engine: str) -> None:
    rng = np.random.default_rng(5)
    drawn = [friction(rng) for _ in range(8)]
    drawn = [(model, u) for model, u in drawn if "slip law" not in model.title]
    models, speed = [model for model, _ in drawn], np.array([u for _, u in drawn])
    models += models[:3]  # the same ones again share their machine code
    speed = np.concatenate([speed, 2 * speed[:3]])
    several = FrictionBank(models, t=2.0, engine=engine)
    joints = [FrictionState(model, t=2.0, engine=engine) for model in models]
    v = speed * np.cumsum(rng.normal(size=(80, len(models))), axis=0)
    switches = 0
    for j in range(1, len(v)):
        dt = 1e-3 * (1 + j % 3)
        forces = several.advance(v[j - 1], v[j], dt)
        alone = [one.advance(*pair, dt) for one, *pair in zip(joints, v[j - 1], v[j], strict=True)]
        assert forces.tolist() == alone
        assert several.switches == tuple(one.switches for one in joints)
        switches += sum(map(len, several.switches))
    assert switches > 20
    assert several.states == tuple(one.states for one in joints)
    assert several.mean_force.tolist() == [one.mean_force for one in joints]
    assert several.dF_dv.tolist() == [one.dF_dv for one in joints]
    assert several.to_array().tolist() == [u for one in joints for u in one.to_array().tolist()]
    for ours, theirs in zip(several.variables, joints, strict=True):
        pairs = {name: u.tolist() for name, u in theirs.variables.items()}
        assert {name: u.tolist() for name, u in ours.items()} == pairs


# --------------------------------------------------------------------------- failures
ROOT = ChartModel(
    Chart(
        "root", inputs=("v",), variables=("z",), parameters=("k",),
        states=(State("only", flow={"z": "v * sqrt(sgn(0.5 - z))"}, outputs={"F": "k * z"}),),
    ),
    {"k": 1.0},
)  # fmt: skip


@engines
def test_a_sample_that_fails_leaves_it_as_it_was(engine: str) -> None:
    """The flow is NaN beyond a point; it can go another way."""
    friction = FrictionState(ROOT, engine=engine)
    friction.advance(0.1, 0.1, 1.0)
    before, found = friction.to_array(), (friction.mean_force, friction.dF_dv)
    with pytest.raises(
        SimulationError, match=r"as it was before the call, at t = 1\.0 s"
    ) as caught:
        friction.advance(0.1, 0.1, 100.0)
    assert ".trace" not in str(caught.value)
    with pytest.raises(SimulationError):
        friction.peek(0.1, 0.1, 100.0)
    np.testing.assert_array_equal(friction.to_array(), before)
    assert (friction.mean_force, friction.dF_dv) == found
    assert friction.advance(0.1, -0.1, 1.0) > 0.0
    several = FrictionBank([GIVEN, ROOT, ROOT], engine=engine)
    before = several.to_array()
    with pytest.raises(SimulationError, match=r"joint 2.* at t = 0\.0 s"):
        several.advance([0.1, 0.01, 1.0], [0.1, 0.01, 9.0], 5.0)
    np.testing.assert_array_equal(several.to_array(), before)
    several.advance([0.1, 0.01, 0.01], [0.1, 0.01, 0.01], 1.0)
    with pytest.raises(SimulationError, match=r"as it was before the call, at t = 1\.0 s"):
        several.advance([0.1, 0.01, 1.0], [0.1, 0.01, 9.0], 5.0)


def many(n: int = 100) -> GMS:
    """Return a model of more elements than the log of a sample has places."""
    shares, k = np.full(n, 1 / n), np.linspace(40, 10, n)
    curve = Stribeck(1.0, 1.5, 0.05)
    return GMS(GMSParameters.from_shares(shares, k, C=1.0, stribeck=curve, v_c=1e-6), law="signed")


@pytest.mark.slow
def test_what_the_last_sample_found_survives_a_failure() -> None:
    def found(each: Any) -> Any:
        return each.switches, np.asarray(each.mean_force).tolist(), np.asarray(each.dF_dv).tolist()

    several = FrictionBank([many(), many(), GIVEN])
    several.advance([0.0] * 3, [0.5] * 3, 10.0)
    before = found(several)
    assert [len(each) for each in several.switches] == [100, 100, 4]
    with pytest.raises(SimulationError, match="joint 1"):
        several.advance([0.5, 1e308, 0.5], [0.5, -1e308, 0.5], 0.1)
    assert found(several) == before
    several.advance([0.5] * 3, [-0.5] * 3, 1.0)
    assert found(several) != before


@pytest.mark.slow
@engines
def test_banks_that_share_a_snapshot_keep_their_own_switches(engine: str) -> None:
    one, other = (FrictionBank([many()] * 2, engine=engine) for _ in "ab")
    one.advance([0.0, 0.0], [0.5, 0.5], 10.0)
    other.restore(one.snapshot())
    other.advance([0.5, 0.5], [0.5, 0.5], 0.1)
    assert [len(each) for each in one.switches] == [100, 100]
    assert other.switches == ((), ())


@pytest.mark.skipif(FASTEST != "compiled", reason="needs llvmlite")
def test_many_programs_are_forgotten_and_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "MOST_ENGINES", 1)
    forces = [
        FrictionState(each, engine=FASTEST).peek(0.0, 0.1, 0.01) for each in (GIVEN, ROOT, GIVEN)
    ]
    assert forces[0] == forces[2] != forces[1]


def test_it_says_of_what_and_where_it_is() -> None:
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    one, two = FrictionState(model, t=0.5), FrictionBank([model, model], t=0.25)
    assert repr(one) == f"<FrictionState of {model!r} at t = 0.5 s>"
    assert repr(two) == "<FrictionBank of 2 joints at t = 0.25 s>"


def test_a_stage_may_be_closer_than_the_clock_resolves() -> None:
    friction = FrictionState(GIVEN, t=1e8)
    assert friction.peek(0.1, 0.1, 1e-9) == friction.peek(0.1, 0.1, 0.0)


# --------------------------------------------------------------------------- entries
@engines
def test_the_entry_of_the_default_state_sees_the_first_velocity(engine: str) -> None:
    """Also when the sample is repeated for its mean; other initial values are another friction."""
    chart = Chart(
        "entered", inputs=("v",), variables=("z",), parameters=("k",),
        states=(State("only", entry={"z": "z + v"}, flow={"z": "v"}, outputs={"F": "k * z"}),),
    )  # fmt: skip
    model = ChartModel(chart, {"k": 3.0})
    friction, other = (
        FrictionState(model, engine=engine, initial=initial) for initial in (None, {"z": [0.05]})
    )
    with pytest.raises(ParameterError, match="array: it is of a friction that begins with other"):
        friction.from_array(other.to_array())
    with pytest.raises(ParameterError, match="snapshot: it is of another model"):
        friction.restore(other.snapshot())
    assert friction.peek(0.1, 0.5, 0.0) == friction.peek(0.5, 0.5, 0.0) == 1.5
    assert FrictionBank([model], engine=engine).peek([0.1], [0.5], 0.0).tolist() == [1.5]
    friction.advance(0.5, 0.1, 0.02)
    mean = 3.0 * (0.5 + 0.02 * (0.5 / 3 + 0.1 / 6))
    assert friction.mean_force == pytest.approx(mean, rel=1e-12)
    assert friction.dF_dv == pytest.approx(3.0 * 0.02 / 2, rel=1e-6)


# --------------------------------------------------------------------------- mean and slope
K, SIGMA, SIGMA_2 = 1e4, 3.0, 0.5


def element(F_s: float = 1.0, sigma: float = SIGMA) -> GMS:
    return GMS(
        GMSParameters.from_shares(
            [1.0], [K], C=100.0, sigma=[sigma], sigma_2=SIGMA_2, v_c=1e-9,
            stribeck=Stribeck(1.0, F_s, 1e-3),
        ),
        law="signed",
    )  # fmt: skip


@engines
def test_mean_force_and_slope_while_it_sticks(engine: str) -> None:
    """z is a parabola, so the mean force is exact."""
    v0, v1, dt = 0.01, -0.02, 1e-3
    friction = FrictionState(element(), engine=engine)
    friction.advance(v0, v1, dt)
    mean = K * dt * (v0 / 3 + v1 / 6) + (SIGMA + SIGMA_2) * (v0 + v1) / 2
    assert friction.mean_force == pytest.approx(mean, rel=1e-12)
    assert friction.dF_dv == pytest.approx(K * dt / 2 + SIGMA + SIGMA_2, rel=1e-8)
    assert friction.mean_force == pytest.approx(mean, rel=1e-12)  # asking changes nothing


@engines
def test_mean_force_and_slope_across_a_switch(engine: str) -> None:
    """Without bristle damping: F = k z up to the threshold, then F_c, which it never leaves."""
    v, dt = 0.01, 0.05
    friction = FrictionState(element(sigma=0.0), engine=engine)
    friction.advance(v, v, dt)
    assert [switch.edge for switch in friction.switches] == ["break_away_forward"]
    t_1 = 1.0 / (K * v)  # where k v t is F_c
    mean = ((K * v * t_1**2) / 2 + (dt - t_1)) / dt + SIGMA_2 * v
    assert friction.mean_force == pytest.approx(mean, rel=1e-9)
    assert friction.dF_dv == pytest.approx(SIGMA_2, rel=1e-6)


def test_means_of_short_samples_are_those_of_a_long_one() -> None:
    """The impulse is the same, whatever the samples: with Stribeck curve, and switches."""
    model = element(F_s=1.6)
    long, short = FrictionState(model, rtol=1e-10), FrictionState(model, rtol=1e-10)
    long.advance(0.0, 0.01, 0.1)
    means = []
    for v0, v1 in itertools.pairwise(np.linspace(0.0, 0.01, 101)):
        short.advance(v0, v1, 1e-3)
        means.append(short.mean_force)
    assert np.mean(means) == pytest.approx(long.mean_force, rel=1e-7)


def test_the_slope_is_that_of_the_force() -> None:
    friction, (v0, v1, dt), small = FrictionState(element(F_s=1.6)), (1e-3, 8e-3, 0.05), 1e-5
    before = friction.snapshot()
    friction.advance(v0, v1, dt)
    slope = friction.dF_dv
    assert friction.switches
    friction.restore(before)
    difference = friction.peek(v0, v1 + small, dt) - friction.peek(v0, v1 - small, dt)
    assert slope == pytest.approx(difference / (2 * small), rel=1e-3)
    friction.advance(0.0, 0.1, 0.0)
    assert friction.mean_force == friction.peek(0.1, 0.1, 0.0)


@pytest.mark.slow
def test_straight_lines_converge_with_order_two() -> None:
    """Forces and switch times of a smooth motion, sampled on straight lines, converge as dt²."""
    model, ends = pulled_mass()[0], np.arange(1.0, 21.0)
    how = {"t_eval": ends, "engine": FASTEST, "rtol": 1e-12, "atol": 1e-15}
    exact = simulate(model, Prescribed("0.1*sin(0.63*t)"), 20.0, **how)  # type: ignore[arg-type]
    log = [(int(each.element), str(each.edge)) for each in exact.transitions]
    assert len(log) == 32
    per_second, wrong, late = [8, 16, 32, 64, 128, 256], [], []
    for n in per_second:
        friction = FrictionState(model, rtol=1e-10, engine=FASTEST)
        forces, switches, v0 = [], [], 0.0
        for step in range(1, n * 20 + 1):
            v1 = 0.1 * sin(0.63 * step / n)
            forces.append(friction.advance_to(v0, v1, step / n))
            switches += friction.switches
            v0 = v1
        assert [(each.element, each.edge) for each in switches] == log
        wrong.append(np.abs(forces[n - 1 :: n] - exact.F).max())
        late.append(np.abs([each.t for each in switches] - exact.transitions.t).max())
    for errors in (wrong, late):
        order = -np.polyfit(np.log(per_second), np.log(errors), 1)[0]
        assert order == pytest.approx(2.0, abs=0.15)


# --------------------------------------------------------------------------- contacts with inputs
LOADED = Chart(
    "Dahl under a normal force", inputs=("v", "N", "x"), variables=("z",), parameters=("k", "mu"),
    states=(State("only", flow={"z": "v - abs(v) * k * z / (mu * N)"},
                  outputs={"F": "k * z + 0.1 * x"}),),
)  # fmt: skip
T = np.arange(200) * 2.0**-7
U = 0.3 * np.sin(3 * T)
N = 10 + 4 * np.sin(T)


def contact(load: str) -> Contact:
    inputs = {"N": load, "x": "x_load"}
    return Contact("pad", LOADED, {"k": 100.0, "mu": 0.3}, v="v_load", inputs=inputs)


@pytest.mark.parametrize(
    "text",
    [
        "if(load > 1 and not mod(t, 2) >= 1, load, 0)",
        "load if load > 1 and not mod(t, 2) >= 1 else 0",
    ],
)
def test_functions_and_words_in_an_input_are_no_inputs(text: str) -> None:
    chart = Chart("own", inputs=("N",), states=(State("on"),), outputs={"F": "N"})
    stepping = FrictionState(Contact("pad", chart, {}, inputs={"N": text}))
    forces = [stepping.advance(0.0, 0.0, 0.5, load=(3.0, 3.0)) for _ in range(4)]
    assert forces == [3.0, 0.0, 0.0, 3.0]  # at 0.5, 1, 1.5 and 2 s


@engines
def test_inputs_are_straight_lines_too(engine: str) -> None:
    body, loaded = Body("load", velocity="v_load", x="x_load", v="v_load"), contact("N_0 * share")
    signals = {"v_load": (T, U), "N_0": (T, N), "share": (T, 0.5 + 0 * T)}
    system = System("loaded", bodies=(body,), contacts=(loaded,), signals=signals)
    trace = simulate(system, T[-1], t_eval=T, initial={"x_load": 2.0}, engine=FASTEST)
    one = FrictionState(loaded, initial={"x": 2.0}, engine=engine)
    assert one.inputs == ("N_0", "share")
    forces = [
        one.advance(U[j - 1], U[j], 2.0**-7, N_0=(N[j - 1], N[j]), share=(0.5, 0.5))
        for j in range(1, len(T))
    ]
    np.testing.assert_array_equal(forces, trace.F[1:])


def test_banks_give_each_joint_its_inputs() -> None:
    several = FrictionBank([contact("N_0"), GIVEN, contact("2 * N_0")])
    one, other = FrictionState(contact("N_0")), FrictionState(contact("2 * N_0"))
    plain = FrictionState(Contact("bearing", GIVEN, v="w_m - 3 * w_l"))  # a model in a contact
    assert several.inputs == one.inputs == ("N_0",)
    assert FrictionState(contact("10 + 1e1 * sin(2 * pi * t)")).inputs == ()
    for j in range(1, len(T)):
        pair = np.full(3, U[j - 1]), np.full(3, U[j])
        forces = several.advance(*pair, 0.01, N_0=(N[j - 1], [N[j], 1.0, 0.5 * N[j]]))
        assert forces.tolist() == [
            one.advance(U[j - 1], U[j], 0.01, N_0=(N[j - 1], N[j])),
            plain.advance(U[j - 1], U[j], 0.01),
            other.advance(U[j - 1], U[j], 0.01, N_0=(N[j - 1], 0.5 * N[j])),
        ]


# --------------------------------------------------------------------------- threads
@made
@engines
def test_samples_of_six_threads(kind: str, engine: str) -> None:
    """Each sample is taken or refused: time and state are those of the samples taken."""
    one, alone = make(kind, engine), make(kind, engine)
    v, taken, others = speeds(one, 0.1), [0] * 6, list[BaseException]()
    ready = threading.Barrier(6)

    def work(i: int) -> None:
        ready.wait()
        for _ in range(150):
            try:
                one.advance(v, v, 1e-3)
                taken[i] += 1
            except ParameterError as error:
                if "another thread" not in error.reason:
                    others.append(error)
            except BaseException as error:
                others.append(error)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(6)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert not others
    for _ in range(sum(taken)):
        alone.advance(v, v, 1e-3)
    assert known(one)[:3] == known(alone)[:3]


@pytest.mark.parametrize("engine", sorted({"ifelse", FASTEST}))
def test_a_duration_that_is_no_number_is_refused_after_a_call_with_a_time(engine: str) -> None:
    friction = FrictionState(stick_slip("signed"), engine=engine)
    friction.advance_to(0.1, 0.1, 0.02)
    for call in (friction.advance, friction.peek):
        with pytest.raises(ParameterError, match="dt is nan"):
            call(0.1, 0.1, nan)
        assert friction.t == 0.02


@made
def test_every_call_from_another_thread_is_refused_meanwhile(kind: str) -> None:
    friction = make(kind, ENGINES[-1])
    v = speeds(friction, 0.1)
    friction.advance(v, v, 0.5)
    before, array = friction.snapshot(), friction.to_array()
    calls = {
        "advance": lambda: friction.advance(v, v, DT),
        "advance_to": lambda: friction.advance_to(v, v, 1.0),
        "peek": lambda: friction.peek(v, v, DT),
        "mean_force": lambda: friction.mean_force,
        "dF_dv": lambda: friction.dF_dv,
        "snapshot": friction.snapshot,
        "restore": lambda: friction.restore(before),
        "to_array": friction.to_array,
        "from_array": lambda: friction.from_array(array),
    }
    said = dict[str, str]()

    def call_all() -> None:
        for name, call in calls.items():
            try:
                call()
            except ParameterError as error:
                said[name] = str(error)

    with friction._joints.alone:  # as during a call
        other = threading.Thread(target=call_all)
        other.start()
        other.join()
    assert said.keys() == calls.keys()
    assert all("a friction of its own, or hold a lock" in text for text in said.values())
    np.testing.assert_array_equal(friction.to_array(), array)
    friction.advance(v, v, DT)
