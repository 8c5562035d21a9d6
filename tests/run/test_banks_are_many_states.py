"""A bank of joints gives the bits of its joints one by one, whatever their models and scales."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import FrictionBank, FrictionState
from tests.helpers import FASTEST
from tests.run.stepping_cases import friction


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["ifelse"] if FASTEST == "ifelse" else ["compiled", "ifelse"])
def test_joints_of_many_kinds(engine: str) -> None:
    rng = np.random.default_rng(5)
    made = [friction(rng) for _ in range(8)]
    made = [(model, u) for model, u in made if "slip law" not in model.title]
    models, speed = [model for model, _ in made], np.array([u for _, u in made])
    models += models[:3]  # the same ones again share their machine code
    speed = np.concatenate([speed, 2 * speed[:3]])
    bank = FrictionBank(models, t=2.0, engine=engine)
    joints = [FrictionState(model, t=2.0, engine=engine) for model in models]
    v = speed * np.cumsum(rng.normal(size=(80, len(models))), axis=0)
    switches = 0
    for j in range(1, len(v)):
        dt = 1e-3 * (1 + j % 3)
        forces = bank.advance(v[j - 1], v[j], dt)
        alone = [one.advance(*pair, dt) for one, *pair in zip(joints, v[j - 1], v[j], strict=True)]
        assert forces.tolist() == alone
        assert bank.switches == tuple(one.switches for one in joints)
        switches += sum(map(len, bank.switches))
    assert switches > 20
    assert bank.t == joints[0].t
    assert bank.states == tuple(one.states for one in joints)
    assert bank.mean_force.tolist() == [one.mean_force for one in joints]
    assert bank.dF_dv.tolist() == [one.dF_dv for one in joints]
    assert bank.to_array().tolist() == [u for one in joints for u in one.to_array().tolist()]
    for ours, theirs in zip(bank.variables, joints, strict=True):
        assert {k: u.tolist() for k, u in ours.items()} == {
            k: u.tolist() for k, u in theirs.variables.items()
        }
