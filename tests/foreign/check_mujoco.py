"""Claim: in MuJoCo the pulled mass takes all its edges at 1 kHz, and a hinge stays at rest."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

import mujoco
import numpy as np
import pytest

from gms_fsm.adapters.mujoco import JointFriction
from tests.adapters.loops import PULLED_END, exact_pulled_mass, sequence
from tests.adapters.mujoco_cases import ARM, SLIDE, bearing, loaded
from tests.helpers import pulled_mass

# Newer than 3.2: discrete. A step holds the force but for RK4, hence its order.
INTEGRATORS = [
    (name, time)
    for name, time in (
        ("Euler", 2e-2),
        ("implicit", 2e-2),
        ("implicitfast", 2e-2),
        ("discrete", 5e-2),
        ("RK4", 2e-4),
    )
    if hasattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}")
]


@pytest.mark.parametrize(("integrator", "error"), INTEGRATORS)
def test_the_pulled_mass_takes_all_its_edges_at_1_khz(integrator: str, error: float) -> None:
    model, data = loaded(SLIDE.format(integrator=integrator))

    def pull(_: Any, data: Any) -> None:  # also in the stages of RK4
        data.qfrc_passive[0] += 2.0 * 0.1 * data.time

    mujoco.set_mjcb_passive(pull)
    try:
        with JointFriction(model, data, {"rail": pulled_mass()[0]}) as joints:
            mujoco.mj_step(model, data, round(PULLED_END / 1e-3))
    finally:
        mujoco.set_mjcb_passive(None)
    exact = exact_pulled_mass()
    assert len(joints.switches) == 72
    assert sequence(joints.switches) == sequence(exact.transitions)
    late = [each.t for each in joints.switches] - exact.transitions.t
    assert np.abs(late).max() < error


def creep(frictions: dict[str, Any]) -> float:
    """Return how far the elbow turns in a minute under 0.5 Nm, once it has come to rest [rad]."""
    model, data = loaded(ARM)
    model.dof_frictionloss[:2] = 1.5  # three times the load
    data.qfrc_applied[1] = 0.5
    with JointFriction(model, data, frictions) if frictions else nullcontext():
        mujoco.mj_step(model, data, 20_000)
        begin = data.qpos[1]
        mujoco.mj_step(model, data, 60_000)
        return float(data.qpos[1] - begin)


def test_a_loaded_hinge_stays_where_it_is_and_frictionloss_creeps() -> None:
    assert abs(creep({"shoulder": bearing(), "elbow": bearing()})) < 1e-6
    assert creep({}) > 0.1
