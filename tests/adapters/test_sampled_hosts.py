"""Claim: friction in python-control and in PathSim is that of `simulate`, sampled.

In python-control its memory is in the state x alone; in PathSim it can be reset and saved.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, Contact, FrictionState, Prescribed, State, simulate
from gms_fsm.adapters.control import friction_system
from gms_fsm.adapters.pathsim import friction_block, system_block
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ParameterError
from tests.adapters.loops import (
    LOAD,
    T_END,
    loaded_pad,
    sequence,
    servo_in_control,
    servo_in_pathsim,
    sled,
)
from tests.helpers import needs, pulled_mass

needs("control", "pathsim", reason="they are extras of their names")

MODEL, _ = pulled_mass()
DT = 1.0 / 128.0  # s: steps add up without rounding
T = DT * np.arange(1281)


def speed(t: Any) -> Any:
    return 0.1 * np.sin(t)


V = speed(T)


def response(system: Any, t: Any = T, u: Any = V, x0: Any = 0.0) -> Any:
    from control import input_output_response

    return input_output_response(system, t, u, x0)


def driven(block: Any, *sources: Any, **options: Any) -> Any:
    """Return a simulation in PathSim that gives a block its inputs."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import Source

    blocks = [Source(lambda t, each=each: float(each(t))) for each in sources]
    wires = [Connection(source, block[port]) for port, source in enumerate(blocks)]
    return Simulation([*blocks, block], wires, dt=DT, log=False, **options)


def in_control(friction: Any, *inputs: Callable[[Any], Any]) -> Any:
    return response(friction_system(friction, DT), T, np.array([each(T) for each in inputs]))


def in_pathsim(friction: Any, *inputs: Callable[[Any], Any]) -> Any:
    from pathsim import Connection
    from pathsim.blocks import Scope

    block, scope = friction_block(friction, DT), Scope()
    simulation = driven(block, *inputs)
    simulation.add_block(scope)
    simulation.add_connection(Connection(block["F"], scope))
    simulation.run(10.0)
    return block, scope.read()


def forces(host: str, friction: Any, *inputs: Callable[[Any], Any]) -> Any:
    """Return the force at all samples."""
    if host == "control":
        return in_control(friction, *inputs).outputs.ravel()
    _, (times, (F,)) = in_pathsim(friction, *inputs)
    assert times.tolist() == T.tolist()
    return F


MAKERS: dict[str, Any] = {"control": friction_system, "pathsim": friction_block}
hosts = pytest.mark.parametrize("host", MAKERS)


@pytest.mark.slow
@hosts
def test_on_the_same_samples_it_is_simulate_to_the_bit(host: str) -> None:
    expected = simulate(MODEL, Prescribed((T, V)), 10.0, t_eval=T)
    assert len(expected.transitions) >= 8
    assert forces(host, MODEL, speed)[1:].tolist() == expected.F[1:].tolist()
    if host == "pathsim":
        block, _ = in_pathsim(MODEL, speed)
        assert sequence(block.switches) == sequence(expected.transitions)
        assert [each.t for each in block.switches] == expected.transitions.t.tolist()


@hosts
def test_what_a_contact_names_are_further_inputs(host: str) -> None:
    F = forces(host, loaded_pad(), speed, lambda t: 2.0 + t)
    assert pytest.approx(3.0 * V * (2.0 + T)) == F
    assert friction_system(loaded_pad(), DT).input_labels == ["v", "load"]
    assert friction_block(loaded_pad(), DT).input_port_labels == {"v": 0, "load": 1}


@hosts
def test_wrong_sample_times_and_locks_are_refused(host: str) -> None:
    for wrong in (0.0, -1e-3, float("nan"), "1 ms"):
        with pytest.raises(ParameterError, match=r"dt|period"):
            MAKERS[host](MODEL, wrong)
    pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.1})
    with pytest.raises(ParameterError, match="locks the contact"):
        MAKERS[host](pad, DT)


@hosts
def test_a_velocity_that_is_not_finite_is_named(host: str) -> None:
    with pytest.raises(ParameterError, match="v1"):
        forces(host, MODEL, lambda t: np.where(t < 1.0, 0.0, np.inf))


# --------------------------------------------------------------------------- python-control
@pytest.mark.slow
def test_the_servo_in_control_stops_where_it_should() -> None:
    dt = 1e-4
    t = dt * np.arange(round(T_END / dt) + 1)
    found = response(servo_in_control(dt), t, np.zeros((0, t.size)))
    assert found.outputs[2, -1] == pytest.approx(LOAD, rel=2.5e-3)


def test_the_functions_are_pure_and_a_response_can_be_continued() -> None:
    """Any x gives the same answer, in any order, from any system made in the same way."""
    one, two = friction_system(MODEL, DT), friction_system(MODEL, DT, name="other")
    whole = response(one)
    for k in (1280, 3, 700, 0, 701, 3):
        x, u = whole.states[:, k], V[k : k + 1]
        shuffled = one.output(T[k], x, u), one.dynamics(T[k], x, u)
        other = two.dynamics(T[k], x, u), two.output(T[k], x, u)
        assert shuffled[0].tolist() == other[1].tolist()
        assert shuffled[1].tolist() == other[0].tolist()
        assert k == 1280 or shuffled[1].tolist() == whole.states[:, k + 1].tolist()
    rest = response(one, T[500:], V[500:], whole.states[:, 500])
    assert rest.outputs.tolist() == whole.outputs[500:].tolist()


def test_a_response_begins_at_any_time_and_speed() -> None:
    """Texts over t see the right time, and each response starts afresh."""
    state = State("only", flow={"z": "v"}, outputs={"F": "k * z * N"})
    chart = Chart("loaded", inputs=("v", "N"), variables=("z",), parameters=("k",), states=(state,))
    pad = Contact("pad", chart, {"k": 1.0}, inputs={"N": "t"})
    system = friction_system(pad, 0.01)
    for begin in (5.0, 0.0, 5.0):
        t = begin + 0.01 * np.arange(100)
        friction = FrictionState(pad, t=begin)
        F = [friction.peek(0.1, 0.1, 0.0), *(friction.advance(0.1, 0.1, 0.01) for _ in t[1:])]
        assert response(system, t, np.full(100, 0.1)).outputs == pytest.approx(F, rel=1e-12)


@pytest.mark.slow
def test_two_joints_are_two_systems() -> None:
    from control import interconnect

    both = interconnect(
        [friction_system(MODEL, DT, name=name) for name in ("hip", "knee")],
        inplist=["hip.v", "knee.v"],
        outlist=["hip.F", "knee.F"],
        inputs=["v_hip", "v_knee"],
        outputs=["F_hip", "F_knee"],
        dt=DT,
    )
    found = response(both, T, np.stack([V, 2 * V])).outputs
    assert found[0].tolist() == forces("control", MODEL, speed).tolist()
    assert found[1].tolist() != found[0].tolist()


@pytest.mark.slow
def test_a_state_that_was_not_returned_is_refused_and_does_no_harm() -> None:
    system = friction_system(MODEL, DT)
    whole = response(system).outputs.tolist()
    with pytest.raises(ParameterError, match="no state of this friction"):
        response(system, x0=np.full(system.nstates, 0.5))
    assert response(system).outputs.tolist() == whole


# --------------------------------------------------------------------------- PathSim
@pytest.mark.slow
def test_the_servo_in_pathsim_is_reset_continued_and_stops_where_it_should() -> None:
    simulation, friction, x_l = servo_in_pathsim(1e-3)
    simulation.run(0.05)
    first, switches = x_l.state[0], friction.switches
    assert switches
    simulation.run(0.05, reset=True)
    assert (x_l.state[0], friction.switches) == (first, switches)
    assert friction.switches is not switches
    simulation.run(0.15)
    assert x_l.state[0] == pytest.approx(LOAD, rel=5e-3)
    assert len(friction.switches) == 30


@pytest.mark.slow
def test_blocks_with_their_own_periods_do_not_disturb_each_other() -> None:
    from pathsim import Connection, Simulation
    from pathsim.blocks import Source

    fine, coarse, alone = (friction_block(MODEL, period) for period in (DT, 4 * DT, 4 * DT))
    source = Source(speed)
    wires = [Connection(source, fine, coarse)]
    Simulation([source, fine, coarse], wires, dt=DT, log=False).run(10.0)
    driven(alone, speed).run(10.0)
    assert coarse.switches == alone.switches
    assert sequence(fine.switches) == sequence(coarse.switches)
    assert fine.switches != coarse.switches


def test_between_samples_and_late_samples_are_right() -> None:
    """The force is that of the present velocity; a step need not divide the period."""
    blocks = [friction_block(MODEL, period) for period in (64 * DT, 1.5 * DT)]
    for block in blocks:
        driven(block, lambda t: 0.01 * t).run(48 * DT)
        exact = simulate(MODEL, Prescribed("0.01*t"), 48 * DT).F[-1]
        assert block.outputs["F"] == pytest.approx(exact, rel=1e-6)
    assert blocks[0].friction.t == 0.0


@pytest.mark.slow
def test_a_checkpoint_holds_the_friction(tmp_path: Path) -> None:
    there, here = friction_block(MODEL, DT), friction_block(MODEL, DT)
    before, after = driven(there, speed), driven(here, speed)
    before.run(5.0)
    before.save_checkpoint(str(tmp_path / "run"))
    after.load_checkpoint(str(tmp_path / "run"))
    before.run(5.0)
    after.run(5.0)
    assert here.outputs["F"] == there.outputs["F"]
    assert here.friction.t == there.friction.t == 10.0
    assert here.switches == [each for each in there.switches if each.t > 5.0]


def test_a_sample_time_that_python_control_does_not_know_is_refused() -> None:
    with pytest.raises(ParameterError, match="dt is True; the friction needs a sample time"):
        friction_system(MODEL, True)


def test_a_block_that_is_first_asked_later_begins_then() -> None:
    block = friction_block(MODEL, DT)
    block.update(2.0)
    (samples,) = block.events
    samples.func_act(2.0)
    assert block.friction.t == 2.0


# --------------------------------------------------------------------------- a whole system
def test_a_system_in_a_block_moves_as_simulate_says() -> None:
    from pathsim import Connection, Simulation
    from pathsim.blocks import Source

    block, source = system_block(sled(), 0.01, ["x", "pad.F"]), Source(lambda t: 3.0 * t)
    Simulation([source, block], [Connection(source, block)], dt=0.01, log=False).run(1.0)
    trace = simulate(sled(), block.system.t, inputs={"u": "3 * t"})
    assert block.system.value("x") == pytest.approx(trace.body("sled").x[-1], rel=1e-6)
    assert block.outputs["pad.F"] == pytest.approx(trace.contact("pad").F[-1], rel=1e-2)
    assert [each.edge for each in block.switches] == list(trace.transitions.edge)
    first = block.system.value("x")
    block.reset()
    assert (block.system.t, block.system.value("x"), block.switches) == (0.0, 0.0, [])
    assert first > 0.0


def test_what_a_block_of_a_system_cannot_do_is_refused() -> None:
    with pytest.raises(ParameterError, match="name"):
        system_block(sled(), 0.01, ["y"])
    with pytest.raises(ParameterError, match="not part of"):
        system_block(sled(), 0.01, ["x"]).to_checkpoint("block")
    with pytest.raises(AttributeError, match="SystemState"):
        _ = system_block(sled(), 0.01, ["x"]).friction
