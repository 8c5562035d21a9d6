"""Claim: the positioning task keeps gymnasium's rules, and its friction is a stepping friction."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

from gms_fsm import Slider, simulate
from gms_fsm.errors import ParameterError
from tests.adapters.loops import loaded_pad, sled
from tests.helpers import pulled_mass

gymnasium = pytest.importorskip("gymnasium", reason="the environment is extra gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402

from gms_fsm.adapters.gymnasium import FrictionPositioning, SystemTask  # noqa: E402

SIZES: dict[str, Any] = {"mass": 1.0, "force": 5.0, "travel": 1.0}


def made(**changed: Any) -> FrictionPositioning:
    return FrictionPositioning(pulled_mass()[0], **SIZES | changed)


@pytest.mark.matrix
def test_the_checker_of_gymnasium_accepts_it() -> None:
    with warnings.catch_warnings():
        # Rendering is checked for environments made by name only.
        warnings.filterwarnings("ignore", message=".*alternative render modes")
        check_env(made())


def test_it_moves_as_simulate_says() -> None:
    env, force = made(substeps=40), 2.0
    env.reset(options={"target": 0.9})
    exact = simulate(
        pulled_mass()[0], Slider(1.0, force), 1.0, rtol=1e-10, t_eval=np.linspace(0.0, 1.0, 101)
    )
    switches: list[Any] = []
    for x, v in zip(exact.x[1:], exact.v[1:], strict=True):
        observation, *_, info = env.step(np.array([force / 5.0]))
        switches += info["switches"]
        assert info["x"] == pytest.approx(x, abs=1e-5)
        assert observation == pytest.approx([0.9 - x, v], abs=1e-5)
    assert [each.edge for each in switches] == list(exact.transitions.edge)
    assert [each.t for each in switches] == pytest.approx(list(exact.transitions.t), abs=1e-5)
    assert len(switches) == 4


@pytest.mark.slow
def test_a_seed_gives_the_same_episode() -> None:
    def episode(env: FrictionPositioning, seed: int) -> list[Any]:
        rows = [env.reset(seed=seed)[0].tolist()]
        for action in np.random.default_rng(5).uniform(-1.0, 1.0, 200):
            observation, reward, *_ = env.step(np.array([action]))
            rows.append([*observation, reward])
        return rows

    env = made()
    assert episode(env, 3) == episode(env, 3) == episode(made(), 3)
    assert episode(env, 3)[0] != episode(env, 4)[0]


def test_an_episode_ends_outside_or_in_time_with_the_reward_that_is_documented() -> None:
    env = made(duration=0.05)
    env.reset(options={"target": 0.25})
    observation, reward, *_ = env.step(np.array([-3.0]))  # clipped to -1
    assert reward == -abs(observation[0]) / 1.0 - 0.01
    ends = [env.step(np.zeros(1))[2:4] for _ in range(4)]
    assert ends == [(False, False)] * 3 + [(False, True)]
    env = made(travel=0.1)
    env.reset()
    ended = False
    while not ended:
        observation, _, ended, truncated, info = env.step(np.ones(1))
        assert not truncated
        assert env.observation_space.contains(observation)
    assert info["x"] > 0.1


def test_wrong_sizes_are_named() -> None:
    for name, wrong in {"mass": 0.0, "force": -1.0, "travel": np.nan, "period": 0.0,
                        "substeps": 0, "duration": 0.0}.items():  # fmt: skip
        with pytest.raises(ParameterError, match=f"{name} is {wrong}"):
            made(**{name: wrong})


def test_wrong_actions_and_targets_change_nothing() -> None:
    env, other = made(), made()
    assert env.reset(seed=1)[0][1] == other.reset(seed=1)[0][1] == 0.0
    for action in (np.array([np.nan]), np.zeros(2)):
        with pytest.raises(ParameterError, match="action"):
            env.step(action)
    with pytest.raises(ParameterError, match=r"target is 2\.0; it is outside the travel"):
        env.reset(options={"target": 2.0})
    assert env.step(np.ones(1))[0].tolist() == other.step(np.ones(1))[0].tolist()


def test_a_friction_with_further_inputs_is_refused() -> None:
    with pytest.raises(ParameterError, match="it needs the inputs load; write them as numbers"):
        FrictionPositioning(loaded_pad(), **SIZES)


# --------------------------------------------------------------------------- a whole system
def task(**changed: Any) -> SystemTask:
    given: dict[str, Any] = {
        "actions": {"u": 5.0},
        "observed": {"goal": 1.0, "x": 2.0, "v": 9.0},
        "reward": "-abs(goal - x) - 0.01 * u**2",
        "drawn": {"goal": (-0.8, 0.8)},
        "ends": "abs(x) > 1",
        "period": 0.05,
        "duration": 2.0,
    }
    return SystemTask(sled(("u", "goal")), **given | changed)


def test_the_checker_accepts_a_system() -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*alternative render modes")
        check_env(task())


def test_a_system_moves_as_simulate_says() -> None:
    env, levels = task(), [0.2, 0.4, -0.1, -0.5, 0.3]
    env.reset(options={"goal": 0.5})
    seen = [env.step(np.array([each])) for each in levels]
    t = np.repeat(np.cumsum([0.0, *[0.05] * 5]), 2)[1:-1]
    record = t, 5.0 * np.repeat(levels, 2)
    trace = simulate(sled(("u", "goal")), t[-1], inputs={"u": record, "goal": 0.5})
    observation, reward, *_, info = seen[-1]
    x, v = trace.body("sled").x[-1], trace.body("sled").v[-1]
    assert observation.tolist() == [0.5, x, v]
    assert reward == -abs(0.5 - x) - 0.01 * 1.5**2
    assert [each.edge for *_, each in seen for each in each["switches"]] == list(
        trace.transitions.edge
    )
    assert info["t"] == t[-1]


def test_an_episode_ends() -> None:
    env = task(initial={"sled.v": 8.0, "states": ["forward"]})
    env.reset(seed=1)
    over = [env.step(np.array([1.0]))[2:4] for _ in range(40)]
    assert over[2] == (True, False)
    assert over[-1] == (True, True)


@pytest.mark.parametrize(
    "wrong",
    [{"actions": {}}, {"actions": {"w": 1.0}}, {"drawn": {}}, {"observed": {"y": 1.0}},
     {"period": 0.0}, {"observed": {"x": -1.0}}],
)  # fmt: skip
def test_a_wrong_task_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ParameterError):
        task(**wrong)


@pytest.mark.parametrize(
    "call", [lambda env: env.step([1, 2]), lambda env: env.reset(options={"x": 1})]
)
def test_wrong_calls_are_refused(call: Any) -> None:
    env = task()
    env.reset(seed=1)
    with pytest.raises(ParameterError):
        call(env)
