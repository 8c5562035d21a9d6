"""Claim: the environment runs under gymnasium's own wrappers, vectors and registry."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env

from gms_fsm.adapters.gymnasium import FrictionPositioning
from tests.helpers import pulled_mass

SIZES: dict[str, Any] = {"mass": 1.0, "force": 5.0, "travel": 1.0, "period": 0.02}


def test_a_registered_environment_passes_the_checker() -> None:
    gymnasium.register("FrictionPositioning-v0", FrictionPositioning, max_episode_steps=50)
    try:
        env = gymnasium.make("FrictionPositioning-v0", friction=pulled_mass()[0], **SIZES)
        check_env(env.unwrapped)
        env.reset(seed=0)
        ends = [env.step(np.zeros(1))[3] for _ in range(50)]
        assert ends == [False] * 49 + [True]
    finally:
        gymnasium.registry.pop("FrictionPositioning-v0")


def test_a_vector_of_environments_is_its_environments() -> None:
    def made() -> FrictionPositioning:
        return FrictionPositioning(pulled_mass()[0], **SIZES)

    vector, single = gymnasium.vector.SyncVectorEnv([made] * 3), made()
    seen, _ = vector.reset(seed=[0, 1, 2])
    alone, _ = single.reset(seed=1)
    assert seen[1].tolist() == alone.tolist()
    for action in np.random.default_rng(1).uniform(-1.0, 1.0, 100):
        seen, rewards, *_ = vector.step(np.full((3, 1), action))
        alone, reward, *_ = single.step(np.array([action]))
        assert seen[1].tolist() == alone.tolist()
        assert rewards[1] == reward


def test_a_simple_controller_reaches_the_target() -> None:
    env = FrictionPositioning(pulled_mass()[0], **SIZES)
    seen, _ = env.reset(seed=4)
    total = 0.0
    for _ in range(400):
        error, speed = seen
        total += 0.02 * error
        seen, *_, info = env.step(
            np.clip([(20.0 * error + 4.0 * total - 6.0 * speed) / 5.0], -1, 1)
        )
    assert abs(seen[0]) < 0.05  # it began at 0.7 m
    assert info["t"] == 8.0
