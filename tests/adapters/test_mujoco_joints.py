"""Claim: friction in MuJoCo's joints is that of the same velocities, and leaves nothing behind."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import Contact, FrictionState
from gms_fsm.charts.registry import entry
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import demonstration
from tests.adapters.loops import loaded_pad
from tests.helpers import pulled_mass

mujoco = pytest.importorskip("mujoco", reason="joint friction is extra mujoco")
from gms_fsm.adapters.mujoco import JointFriction  # noqa: E402
from tests.adapters.mujoco_cases import ARM, SLIDE, bearing, loaded  # noqa: E402

INTEGRATORS = ["Euler", "implicitfast", "RK4"]
MODEL, _ = pulled_mass()
STEPS = 4000


def pulled(integrator: str = "Euler") -> tuple[Any, Any]:
    """Return a slide that is pulled by a growing force, and slips at 0.7 s."""
    model, data = loaded(SLIDE.format(integrator=integrator))
    data.qfrc_applied[0] = 1.6
    return model, data


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_it_is_a_stepping_friction_on_the_velocities_of_the_steps(integrator: str) -> None:
    """Looking, and asking MuJoCo for the forces, change nothing."""
    friction, found = MODEL, []
    for looks in (False, True):
        model, data = pulled(integrator)
        t, v = [data.time], [data.qvel[0]]
        with JointFriction(model, data, {"rail": friction}) as joints:
            for _ in range(STEPS):
                mujoco.mj_step(model, data)
                t.append(data.time)
                v.append(data.qvel[0])
                if looks:
                    assert joints.states
                    mujoco.mj_forward(model, data)
        found.append((data.qpos[0], joints.switches))
    assert found[0] == found[1]
    alone, log = FrictionState(friction), []
    for step in range(STEPS):
        alone.advance_to(v[step], v[step + 1], t[step + 1])
        log += [tuple(switch) for switch in alone.switches]
    assert [(each.t, each.element, each.edge) for each in joints.switches] == log
    assert {each.joint for each in joints.switches} == {"rail"}
    assert len(log) >= 4
    assert joints.states == {"rail": alone.states}


def test_the_force_is_what_mujoco_is_given() -> None:
    model, data = pulled()
    with JointFriction(model, data, {"rail": MODEL}) as joints:
        mujoco.mj_step(model, data, 100)
        mujoco.mj_forward(model, data)
        spring = -2.0 * data.qpos[0]
        assert data.qfrc_passive[0] == pytest.approx(spring - joints.forces["rail"])
        assert joints.forces["rail"] > 0.1


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("integrator", INTEGRATORS[1:])
def test_a_reset_and_a_snapshot_with_the_state_of_mujoco_begin_again(integrator: str) -> None:
    model, data = pulled(integrator)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    runs = []
    with JointFriction(model, data, {"rail": MODEL}) as joints:
        mujoco.mj_step(model, data, 800)
        state, before = np.empty(mujoco.mj_stateSize(model, kind)), joints.snapshot()
        mujoco.mj_getState(model, data, state, kind)
        for _ in range(2):
            mujoco.mj_step(model, data, STEPS)
            runs.append((data.qpos[0], joints.switches))
            mujoco.mj_setState(model, data, state, kind)
            joints.restore(before)
        mujoco.mj_resetData(model, data)
        data.qfrc_applied[0] = 1.6
        mujoco.mj_step(model, data, 800)
        mujoco.mj_step(model, data, STEPS)
        runs.append((data.qpos[0], joints.switches))
    assert runs[0] == runs[1] == runs[2]


def test_a_velocity_set_before_the_first_step_is_not_a_ramp() -> None:
    model, data = loaded(SLIDE.format(integrator="Euler"))
    with JointFriction(model, data, {"rail": MODEL}) as joints:
        data.qvel[0] = 0.5
        mujoco.mj_forward(model, data)
        assert joints.forces["rail"] == FrictionState(MODEL).peek(0.5, 0.5, 0.0)


def test_frictionloss_and_callback_return() -> None:
    model, data = loaded(ARM)
    calls: list[float] = []

    def own(_: Any, data: Any) -> None:
        calls.append(data.time)

    before = model.dof_frictionloss.tolist()
    mujoco.set_mjcb_passive(own)
    try:
        joints = JointFriction(model, data, {"elbow": bearing(), "shoulder": bearing()})
        assert model.dof_frictionloss.tolist() == before
        with joints:
            assert model.dof_frictionloss.tolist() == [0.0] * 5
            mujoco.mj_step(model, data)
        assert calls == [0.0]
        assert model.dof_frictionloss.tolist() == before
        with pytest.raises(ZeroDivisionError), joints:
            _ = 1 / 0
        assert mujoco.get_mjcb_passive() is own
        assert model.dof_frictionloss.tolist() == before
    finally:
        mujoco.set_mjcb_passive(None)


def test_other_data_have_no_friction() -> None:
    model, data = pulled()
    other = mujoco.MjData(model)
    other.qfrc_applied[0] = 1.6
    with JointFriction(model, data, {"rail": MODEL}) as joints:
        mujoco.mj_step(model, other, 100)
        assert joints.switches == ()
    assert other.qvel[0] > 0.15  # 1.6 N on 1 kg for 0.1 s


@pytest.mark.slow
def test_joints_are_told_apart() -> None:
    model, data = loaded(ARM)
    data.qfrc_applied[:2] = 0.9, 0.2
    with JointFriction(model, data, {"elbow": bearing(), "shoulder": bearing()}) as joints:
        mujoco.mj_step(model, data, 20_000)  # until they are at rest
    assert {each.joint for each in joints.switches} == {"shoulder"}
    assert joints.forces == pytest.approx({"shoulder": 0.9, "elbow": 0.2}, abs=1e-2)


@pytest.mark.parametrize(
    ("frictions", "words"),
    [
        ({"wrist": bearing()}, "no joint 'wrist'; there are shoulder, elbow, ball"),
        ({"ball": bearing()}, "'ball'; this joint has more than one degree of freedom"),
        ({0: bearing()}, "no joint 0"),
        ({}, "frictions: it is empty"),
        ([bearing()], "it must be a mapping"),
        ({"elbow": 1.5}, "joint 'elbow': "),
        ({"elbow": demonstration(entry("stiction"))}, r"joint 'elbow': .*lock"),
        ({"elbow": loaded_pad()}, "joint 'elbow': it needs the inputs load"),
    ],
)
def test_wrong_joints_are_named(frictions: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        JointFriction(*loaded(ARM), frictions)


def test_wrong_models_data_and_snapshots_are_named() -> None:
    model, data = loaded(ARM)
    joints = JointFriction(model, data, {"elbow": bearing()})
    both = JointFriction(model, data, {"elbow": bearing(), "shoulder": bearing()})
    for call, words in (
        (lambda: JointFriction(data, data, {"elbow": bearing()}), r"it must be a mujoco\.MjModel"),
        (lambda: JointFriction(model, model, {"elbow": bearing()}), r"it must be a mujoco\.MjData"),
        (lambda: JointFriction(model, loaded(ARM)[1], {"elbow": bearing()}), "of another model"),
        (lambda: joints.restore(both.snapshot()), "snapshot: it is of another model"),
        (lambda: joints.restore(FrictionState(bearing()).snapshot()), "it is of another model"),
        (lambda: joints.restore([]), r"snapshot is \[\]; it must be what snapshot"),
    ):
        with pytest.raises(ParameterError, match=words):
            call()


def test_a_block_cannot_run_twice_at_once() -> None:
    model, data = loaded(ARM)
    joints = JointFriction(model, data, {"elbow": bearing()})
    with joints, pytest.raises(ParameterError, match="its block is running"), joints:
        pass
    assert mujoco.get_mjcb_passive() is None
    assert model.dof_frictionloss[1] == 0.7


def test_inputs_are_those_of_the_data_as_straight_lines() -> None:
    """A load that grows with time holds a slide that would slip without it."""
    friction = Contact("pad", MODEL, inputs={"N": "load"})
    model, data = pulled()
    joints = JointFriction(
        model, data, {"rail": friction}, inputs={"rail": lambda data: {"load": 1.0 + data.time}}
    )
    t, v = [0.0], [0.0]
    with joints:
        for _ in range(200):
            mujoco.mj_step(model, data)
            t.append(data.time)
            v.append(data.qvel[0])
        force, states = joints.forces["rail"], joints.states
    alone = FrictionState(friction)
    for step in range(200):
        line = (1.0 + t[step], 1.0 + t[step + 1])
        alone.advance_to(v[step], v[step + 1], t[step + 1], load=line)
    assert states == {"rail": alone.states}
    assert force == pytest.approx(alone.peek(v[-1], v[-1], 0.0, load=(1.2, 1.2)), rel=1e-2)


def test_inputs_of_no_joint_and_no_values_are_refused() -> None:
    friction = Contact("pad", MODEL, inputs={"N": "load"})
    model, data = pulled()
    with pytest.raises(ParameterError, match="there is no joint 'rial'"):
        JointFriction(model, data, {"rail": friction}, inputs={"rial": lambda _: {}})
    with pytest.raises(ParameterError, match=r"inputs=.joint: function of the data"):
        JointFriction(model, data, {"rail": friction})
