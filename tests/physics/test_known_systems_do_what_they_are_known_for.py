"""The known systems that ship, against formulas for their frequencies, thresholds and errors."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Belt, Body, ChartModel, Contact, PulledSlider, Spring, System, Trace, simulate
from gms_fsm.app.scenario import Loaded, load_scenario
from gms_fsm.charts import CHARTS
from gms_fsm.scenarios import shipped
from tests.helpers import FASTEST
from tests.scenario_files import CommandLine

DRY = ChartModel(CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
M, K, V = 1.0, 2.0, 0.1


def loaded(name: str, *changes: str) -> Loaded:
    return load_scenario(name, [f"run.engine={FASTEST!r}", *changes])


def times(trace: Trace, edge: str) -> Any:
    log = trace.transitions
    return log.t[log.edge == edge]


def coulomb_period(m: float, k: float, V: float, drop: float) -> float:
    """Stick until the spring has F_s, then a sine about F_c; `drop` is F_s - F_c."""
    w = math.sqrt(k / m)
    share = drop * w / (k * V)
    return 2.0 / w * (math.pi - math.atan(share) + share)


# --------------------------------------------------------------------------- the belt
def test_a_belt_is_a_wall_that_pulls_the_other_way() -> None:
    runs = (
        simulate(DRY, rig, 20.0, engine=FASTEST) for rig in (Belt(M, K, V), PulledSlider(M, K, -V))
    )
    one, other = runs
    assert one.transitions.t.size == 4
    for name in ("t", "x", "v", "F"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_seen_from_the_room_a_belt_is_a_driven_body() -> None:
    d = 0.05
    seen = simulate(DRY, Belt(M, K, V, d), 20.0, rtol=1e-9, engine=FASTEST)
    system = System(
        "in the room",
        bodies=(Body("mass", inertia=M), Body("belt", velocity=V, x="x_b", v="v_b")),
        springs=(Spring("spring", "mass", k=K, d=d),),
        contacts=(Contact("pad", DRY, v="v - v_b"),),
    )
    start = {"mass.v": V, "mass.x": -d * V / K}
    room = simulate(system, 20.0, rtol=1e-9, engine=FASTEST, initial=start)
    np.testing.assert_allclose(seen.transitions.t, room.transitions.t, rtol=0, atol=1e-6)
    t = np.linspace(0.0, 20.0, 101)
    there = seen.sample(t).x + V * t - d * V / K
    np.testing.assert_allclose(there, room.sample(t).body("mass").x, rtol=0, atol=1e-6)


def test_a_belt_is_read_from_files(tmp_path: Path) -> None:
    string = loaded("bowed_string", "run.t_end=0.01")
    assert string.rig == Belt(1.14e-3, 8713.0, 0.15, 6.3e-3)
    trace = string.simulate()
    assert Trace.load(trace.save(tmp_path / "string.npz")).rig == string.rig


# --------------------------------------------------------------------------- frequencies
@pytest.mark.slow
def test_a_bowed_string_slips_once_a_period_and_sounds_its_note() -> None:
    string = loaded("bowed_string")
    slips = times(string.simulate(), "break_away_backward")
    pitch = 1.0 / np.diff(slips[-11:])
    np.testing.assert_allclose(pitch, 440.0, rtol=0.01)
    assert (pitch < 440.0).all()
    # With the same forces as a step, the closed form; the string's damping is left out of it.
    curve = string.model.stribeck
    step = ChartModel(CHARTS["stiction"], {"F_c": curve.F_c, "F_s": curve.F_s, "b": 0.0})
    trace = simulate(step, Belt(1.14e-3, 8713.0, 0.15), 0.05, engine=FASTEST)
    due = coulomb_period(1.14e-3, 8713.0, 0.15, curve.F_s - curve.F_c)
    np.testing.assert_allclose(np.diff(times(trace, "release_backward")), due, rtol=1e-5)


@pytest.mark.slow
def test_a_string_that_is_pressed_harder_sounds_flatter() -> None:
    softly, hard = (
        np.diff(times(loaded("bowed_string", *how).simulate(), "break_away_backward"))[-8:].mean()
        for how in ((), ("model.stribeck.F_s=0.36", "model.stribeck.F_c=0.12"))
    )
    assert hard > 1.005 * softly


@pytest.mark.slow
def test_a_chair_groans_with_the_frequency_of_its_legs() -> None:
    E, outside, inside, length = 200e9, 22e-3, 19e-3, 0.45
    stiffness = 3 * E * math.pi / 64 * (outside**4 - inside**4) / length**3
    chair = loaded("chair_squeak")
    assert chair.rig.numbers["stiffness"] == pytest.approx(stiffness, rel=0.01)
    mass, k, speed = (chair.rig.numbers[name] for name in ("mass", "stiffness", "speed"))
    due = coulomb_period(mass, k, speed, 6.0 - 4.2)
    assert 80.0 < 1.0 / due < 100.0
    np.testing.assert_allclose(np.diff(times(chair.simulate(), "release_forward")), due, rtol=1e-5)


def test_a_brake_begins_to_squeal_with_the_frequency_of_its_coupled_modes() -> None:
    """While the pad slides the stiffness is not symmetric: two modes have one frequency."""
    mu = 0.65
    stiffness = np.array([[9.3e7, -15588457.268119893 + mu * 4.4e7], [-15588457.268119893, 7.5e7]])
    modes = np.sqrt(np.linalg.eigvals(stiffness).astype(complex))
    due = modes.real[0] / (2 * math.pi)
    assert modes.imag.max() > 100.0
    trace = loaded("brake_squeal").simulate()
    first = trace.transitions.t[0]
    t = np.linspace(0.0, first, 4001)
    y = trace.sample(t).body("normal").v
    crossed = t[1:][np.diff(np.sign(y)) != 0]
    assert crossed.size > 4
    assert 0.5 / np.diff(crossed[-4:]).mean() == pytest.approx(due, rel=0.02)


# --------------------------------------------------------------------------- thresholds
@pytest.mark.matrix
def test_a_fault_fails_again_and_again_below_the_critical_stiffness() -> None:
    """Ruina's critical stiffness is N (b - a) / D_c = 1.2e7 N/m."""
    rock = load_scenario("earthquake")
    speed = rock.rig.numbers["speed"]
    trace = rock.simulate()
    quakes = trace.t[1:-1][(trace.v[1:-1] > 1e3 * speed) & (np.diff(np.sign(np.diff(trace.v))) < 0)]
    recurrence = np.diff(quakes)
    assert quakes.size == 4
    np.testing.assert_allclose(recurrence[1:], 62.0, rtol=0.05)
    # What the spring is stretched by between two of them is what the slider jumps back.
    settled = trace.t > quakes[0]
    fall = np.ptp(trace.F[settled])
    assert fall == pytest.approx(6e6 * speed * recurrence[-1], rel=0.06)


@pytest.mark.parametrize(("stiffness", "grows"), [(1.08e7, True), (1.32e7, False)])
def test_at_the_critical_stiffness_creep_becomes_unstable(stiffness: float, grows: bool) -> None:
    start = f"initial.x={-30e3 * 0.6 / stiffness}"
    changes = (f"rig.stiffness={stiffness}", start, "initial.v=9e-6", "run.t_end=60.0")
    trace = load_scenario("earthquake", changes).simulate()
    off = abs(np.log(trace.v / 1e-5))
    early, late = off[(trace.t > 5) & (trace.t < 20)].max(), off[trace.t > 45].max()
    assert (late > early) == grows


def test_a_door_holds_up_to_the_angle_at_which_its_weight_exceeds_the_friction() -> None:
    weight = 25.0 * 9.81 * 0.4 * math.sin(8.727e-3)
    critical = math.asin(0.673 / weight)
    for angle, held in ((0.999 * critical, True), (1.001 * critical, False)):
        change = (f"initial.door.x={angle}", "numbers.T=0.0")
        trace = loaded("door_hinge", *change).simulate()
        assert (trace.transitions.t.size == 0) == held
        assert (trace.x[-1] == angle) == held
    trace = loaded("door_hinge").simulate()
    stopped = times(trace, "arrest_forward")
    assert stopped.size == 1
    assert 1.0 < stopped[0] < 4.0
    assert trace.sample([8.0]).v[0] > 0  # and swings open by itself, long after the second push


# --------------------------------------------------------------------------- live pages
@pytest.mark.matrix
@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_known_system_is_a_live_page_unless_scipy_runs_it(
    gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("uplot", "pygraphviz"):
        pytest.importorskip(module, reason="a live page needs the extras replay and render")
    two = {name: path for name, path in shipped().items() if name in ("earthquake", "door_hinge")}
    monkeypatch.setattr("gms_fsm.app.verbs.traces.shipped", lambda: two)
    done = gms_fsm("play", "--all", "-o", "pages")
    assert (done.code, done.out) == (0, "pages/door_hinge.html\n")
    assert "no page of earthquake: " in done.err
    assert "leave method and output out" in done.err
    assert [each.name for each in Path("pages").iterdir()] == ["door_hinge.html"]


# --------------------------------------------------------------------------- an error
@pytest.mark.slow
def test_the_error_of_a_robot_joint_is_its_friction_over_the_gain() -> None:
    trace = loaded("robot_joint").simulate()
    w = 10.0
    due = (0.07 + 2e-4 * w) / 2.0
    for t, sign, wanted in ((0.9, 1.0, 8.0), (2.0, -1.0, 0.0)):
        error = wanted - trace.sample([t]).body("motor").x[0]
        assert error == pytest.approx(sign * due, rel=0.01)
    arm = trace.sample([2.0]).body("arm").x[0]
    assert 100.0 * arm == pytest.approx(due, rel=0.02)
