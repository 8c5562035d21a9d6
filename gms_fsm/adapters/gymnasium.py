"""A task for reinforcement learning: put a mass with friction where it should be."""

# ruff: noqa: E402  require() must come before the import that it checks

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import checked_array, checked_scalar
from gms_fsm.coupling.stepping import ElementSwitch, FrictionState
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_integer
from gms_fsm.foundation.extras import require
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

require("gymnasium", "gymnasium")

import gymnasium

__all__ = ["FrictionPositioning"]

_Floats = NDArray[np.float64]
EFFORT = 0.01  # weight of the action in the reward; chosen by us
FARTHEST = 0.8  # of the travel: the farthest target; chosen by us


class FrictionPositioning(gymnasium.Env[_Floats, _Floats]):
    """Put a mass with friction on a target; the action is the force.

    Observed are the position error (target less position, m) and the velocity (m/s). The action is
    the force divided by the largest one, from -1 to 1, held during a step. The mass is advanced by
    sub-steps of the classical Runge-Kutta method, whose stages look ahead into the friction.

    The task is chosen by us. An episode begins at rest in the middle, with a target that is uniform
    in 80 % of the travel. The reward of a step is ``-abs(error) / travel - 0.01 * action**2``. An
    episode terminates when the mass leaves its travel, and is truncated after ``duration``.

    Parameters
    ----------
    friction : Model or Contact
        Any friction that `gms_fsm.FrictionState` takes, without further inputs.
    mass : float
        kg.
    force : float
        N: the largest force.
    travel : float
        m: how far the mass may go to each side.
    period : float
        s: of one step.
    substeps : int
        Per step. A stiff friction needs many: period / substeps should be below
        sqrt(mass / stiffness), the stiffness being that of all sticking elements.
    duration : float
        s: of an episode.

    Raises
    ------
    MissingExtraError
        If gymnasium is not installed; on import of this module.
    ParameterError
        If an argument violates its rule.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> friction = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> env = FrictionPositioning(friction, mass=1.0, force=5.0, travel=1.0)
    >>> observation, info = env.reset(seed=1, options={"target": 0.5})
    >>> observation, reward, terminated, truncated, info = env.step(np.array([0.2]))
    >>> observation.round(4), info["states"]
    (array([0.5   , 0.0099]), ('stick', 'stick', 'stick', 'stick'))
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  as gymnasium declares it

    def __init__(
        self,
        friction: Model | Contact,
        *,
        mass: float,
        force: float,
        travel: float,
        period: float = 0.01,
        substeps: int = 10,
        duration: float = 10.0,
    ) -> None:
        self.mass = checked_scalar("mass", mass, "> 0")
        self.force = checked_scalar("force", force, "> 0")
        self.travel = checked_scalar("travel", travel, "> 0")
        self.period = checked_scalar("period", period, "> 0")
        self.substeps = checked_integer("substeps", substeps, 1)
        self.duration = checked_scalar("duration", duration, "> 0")
        self._friction = FrictionState(friction)
        if self._friction.inputs:
            raise ParameterError(
                f"it needs the inputs {', '.join(self._friction.inputs)}",
                place="friction",
                advice="write them as numbers",
            )
        self._begin = self._friction.snapshot()
        # All work of the force over the whole travel cannot make it faster.
        fastest = math.sqrt(4.0 * self.force * self.travel / self.mass)
        bound = np.array([2.0 * self.travel, fastest])
        self.observation_space = gymnasium.spaces.Box(-bound, bound, dtype=np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), dtype=np.float64)
        self._rest(0.0)

    def _rest(self, target: float) -> None:
        self._friction.restore(self._begin)
        self._target, self._x, self._v, self._steps = target, 0.0, 0.0, 0
        self._F = self._friction.peek(0.0, 0.0, 0.0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Floats, dict[str, Any]]:
        """Begin an episode.

        Parameters
        ----------
        seed : int, optional
            For the target.
        options : dict, optional
            ``{"target": 0.5}`` [m] sets the target.

        Returns
        -------
        tuple
            Observation and info, as `step` returns them.
        """
        super().reset(seed=seed)
        target = (options or {}).get("target")
        if target is None:
            target = self.np_random.uniform(-FARTHEST, FARTHEST) * self.travel
        elif abs(target := checked_scalar("target", target, "finite")) > self.travel:
            raise ParameterError(
                "it is outside the travel",
                place="target",
                value=target,
                advice=f"at most {self.travel:g} m to each side",
            )
        self._rest(target)
        return self._observed(), self._info(())

    def step(self, action: _Floats) -> tuple[_Floats, float, bool, bool, dict[str, Any]]:
        """Hold a force for one period.

        Parameters
        ----------
        action : ndarray, shape (1,)
            The force, divided by the largest one; clipped to -1 and 1.

        Returns
        -------
        tuple
            Observation, reward, terminated, truncated, info. Info has ``t`` [s], ``x`` [m],
            ``target`` [m], ``F`` [N], the friction force, ``states`` of the elements, and the
            ``switches`` of this step.
        """
        given = checked_array("action", action, None, "finite")
        if given.size != 1:
            raise ParameterError(f"it has {given.size} entries", place="action", advice="give 1")
        level = min(max(float(given[0]), -1.0), 1.0)
        switches: list[ElementSwitch] = []
        for _ in range(self.substeps):
            self._substep(level * self.force, self.period / self.substeps)
            switches += self._friction.switches
        self._steps += 1
        reward = -abs(self._target - self._x) / self.travel - EFFORT * level**2
        terminated = abs(self._x) > self.travel
        truncated = self._steps >= round(self.duration / self.period)
        return self._observed(), reward, terminated, truncated, self._info(tuple(switches))

    def _substep(self, force: float, h: float) -> None:
        """Advance the mass by a step of the classical Runge-Kutta method."""
        friction, m, v = self._friction, self.mass, self._v
        a1 = (force - self._F) / m
        a2 = (force - friction.peek(v, v + 0.5 * h * a1, 0.5 * h)) / m
        a3 = (force - friction.peek(v, v + 0.5 * h * a2, 0.5 * h)) / m
        a4 = (force - friction.peek(v, v + h * a3, h)) / m
        self._x += h * v + h * h * (a1 + a2 + a3) / 6.0
        self._v = v + h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        self._F = friction.advance(v, self._v, h)

    def _observed(self) -> _Floats:
        bound = self.observation_space
        seen = np.array([self._target - self._x, self._v])
        return np.clip(seen, bound.low, bound.high)  # type: ignore[attr-defined]

    def _info(self, switches: tuple[ElementSwitch, ...]) -> dict[str, Any]:
        return {
            "t": self._steps * self.period,
            "x": self._x,
            "target": self._target,
            "F": self._F,
            "states": self._friction.states,
            "switches": switches,
        }
