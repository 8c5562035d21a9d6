"""A system that steps sample by sample has the bits of `simulate` with the same inputs as records.

`python -m tests.soak.stepped_systems` tries others, in both engines.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Contact, Sampled, System, SystemState, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.systems.signals import SignalLike
from tests.exporters.frictions import servo
from tests.helpers import FASTEST, stick_slip
from tests.soak.random_systems import SHAPES
from tests.soak.stepped_systems import _drawn, differences, recorded, samples
from tests.soak.trying import shaped

DRY = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}


@pytest.mark.slow
@pytest.mark.parametrize("index", range(200, 206))
def test_random_systems(index: int) -> None:
    (system, how), dice = shaped(_drawn, 1, index, SHAPES)
    steps = samples(dice, [*system.inputs], 0.0)
    assert differences(system, how, steps, "ifelse", dice)[0] == ""


def sled(force: str = "u", **more: Any) -> System:
    """A mass on a dry contact."""
    return System(
        "sled",
        bodies=(Body("sled", inertia=2.0, force=force),),
        contacts=(Contact("pad", CHARTS["stiction"], DRY),),
        inputs=("u",),
        **more,
    )


def stepped(system: System, times: np.ndarray, u: np.ndarray, **how: Any) -> SystemState:
    """Return a system after straight lines between corners."""
    state = SystemState(system, t=float(times[0]), **how)
    for k in range(1, len(times)):
        state.advance_to(float(times[k]), u=(float(u[k - 1]), float(u[k])))
    return state


@pytest.mark.slow
@pytest.mark.parametrize("engine", sorted({"ifelse", FASTEST}))
def test_the_servo_on_a_random_voltage(engine: str) -> None:
    plant = replace(servo(), sampled=(), inputs=("u",))
    times = np.arange(301) * 1e-3
    u = np.random.default_rng(2).normal(size=301) * 3.0
    trace = simulate(plant, times[-1], inputs={"u": (times, u)}, engine="ifelse")
    state = stepped(plant, times, u, engine=engine)
    assert len(trace.transitions) > 100
    assert [state.value(name) for name in ("x_m", "v_m", "x_l", "v_l")] == trace.rows.y[
        -1, :4
    ].tolist()


# Each at t = 3, where nothing ticks.
SYSTEMS: dict[str, System] = {
    "the time in texts": sled("u + sin(3 * t)"),
    "a belt whose velocity is the input": System(
        "belt",
        bodies=(
            Body("mass", inertia=1.0, force="-4 * x", x="x", v="v"),
            Body("belt", velocity="u", x="x_b", v="v_b"),
        ),
        contacts=(Contact("pad", CHARTS["stiction"], DRY, v="v - v_b"),),
        inputs=("u",),
    ),
    "a step of the time": sled("u + floor(2 * t)"),
    "a sampler that meets the samples": sled(
        "w", sampled=(Sampled("hold", period=0.5, updates={"w": "u + delay(w, 2) / 4"}),)
    ),
    "a contact with a period": System(
        "ticking",
        bodies=(Body("mass", inertia=1.0, force="4 * u - x"),),
        contacts=(Contact("pad", stick_slip("signed"), period=0.25),),
        inputs=("u",),
    ),
}


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("jumps", [False, True])
def test_kinds_of_systems(name: str, jumps: bool) -> None:
    system, rng = SYSTEMS[name], np.random.default_rng(4)
    times = np.concatenate([[0.0], 0.25 * np.arange(1, 13), [3.1]])
    ends = 4.0 * rng.normal(size=times.size)
    starts = np.where(
        jumps & (rng.random(times.size) < 0.7), 4.0 * rng.normal(size=times.size), ends
    )
    starts[0] = ends[0] = 0.0
    both = np.repeat(times, 2)[1:-1], np.stack([starts[:-1], ends[1:]], 1).ravel()
    once = np.append(True, np.diff(both[1]) != 0.0) | np.append(True, np.diff(both[0]) > 0.0)
    record = both[0][once], both[1][once]
    state, log = SystemState(system, engine="ifelse"), []
    for k in range(1, times.size):
        state.advance_to(float(times[k]), u=(float(starts[k - 1]), float(ends[k])))
        log += state.switches
    trace = simulate(system, 3.1, inputs={"u": record}, engine="ifelse")
    assert len(log) == len(trace.transitions) > 0
    assert [each.edge for each in log] == [*map(str, trace.transitions.edge)]
    np.testing.assert_allclose([each.t for each in log], trace.transitions.t, rtol=1e-15)
    places = trace.program.layout.y.shared
    assert [state.value(each) for each in places] == trace.rows.y[-1, : len(places)].tolist()


@pytest.mark.parametrize("signal", ["1.3 * t", lambda t: math.sin(t), 2.0, [(0, 0), (1, 2)]])
def test_inputs_are_signals(signal: SignalLike) -> None:
    system = sled()
    inner = System("sled", bodies=system.bodies, contacts=system.contacts, signals={"u": signal})
    one, other = simulate(system, 2.0, inputs={"u": signal}), simulate(inner, 2.0)
    assert one.body("sled").x.tolist() == other.body("sled").x.tolist()


@pytest.mark.matrix
def test_a_tolerance_without_a_scale_knows_nothing_of_inputs_to_come() -> None:
    system = replace(
        sled(), contacts=(Contact("pad", CHARTS["dahl"], {"sigma_0": 9.0, "F_c": 1.0}),)
    )
    record = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1e-6, 1e6])
    state = stepped(system, *record, engine="ifelse")
    trace = simulate(system, 2.0, inputs={"u": record}, engine="ifelse")
    assert state.value("x") == trace.body("sled").x[-1]


def test_where_a_formula_rests_is_known_with_the_end() -> None:
    pulse = "exp(-((t - 1.013) / 0.004)**2)"
    system, times = sled("u + 9 * f", signals={"f": pulse}), np.array([0.0, 2.0])
    state = stepped(system, times, times, engine="ifelse", t_end=2.0)
    trace = simulate(system, 2.0, inputs={"u": (times, times)}, engine="ifelse")
    assert state.value("x") == trace.body("sled").x[-1]


@pytest.mark.parametrize("seed", [0, 1, 2, 14, 15, 42])
def test_a_lock_on_a_belt_whose_velocity_jumps_between_samples(seed: int) -> None:
    """From the first jump on; nor does it feel that nothing is known beyond the end of a sample."""
    numbers, steps, t = np.random.default_rng(seed), [(0.1, (0.0, 0.3))], 0.1
    for _ in range(25):
        t = round(t + float(numbers.uniform(0.05, 0.6)), 3)
        start, end = numbers.uniform(-1.0, 1.0, 2).tolist()
        steps.append((t, (start, end if numbers.random() < 0.5 else start)))
    system = System(
        "belt",
        bodies=(
            Body("belt", velocity="w", x="x_b", v="v_b"),
            Body("mass", inertia=1.0, force="-5 * x", x="x", v="v"),
        ),
        contacts=(
            Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.1}, v="v - v_b"),
        ),
        inputs=("w",),
    )
    state, found = SystemState(system, engine="ifelse"), []
    for end, line in steps:
        state.advance_to(end, w=line)
        found += [each.edge for each in state.switches if each.t < t]
    record = recorded([(end, {"w": line}) for end, line in steps], "w", 0.0)
    trace = simulate(system, t, inputs={"w": record}, engine="ifelse")
    assert found == [str(each.edge) for each in trace.transitions if each.t < t]
