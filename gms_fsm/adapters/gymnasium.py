"""Tasks for reinforcement learning: a mass with friction, or any system."""

# ruff: noqa: E402  require() must come before the import that it checks

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import checked_array, checked_scalar
from gms_fsm.coupling.stepping import ElementSwitch, FrictionState
from gms_fsm.coupling.system_state import SystemState
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_integer, unknown
from gms_fsm.foundation.extras import require
from gms_fsm.language import evaluate, names_in, parse_condition, parse_value, truths
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact, System

require("gymnasium", "gymnasium")

import gymnasium

__all__ = ["FrictionPositioning", "SystemTask"]

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


class SystemTask(gymnasium.Env[_Floats, _Floats]):
    """Control a whole system; the actions are its inputs, held during a step.

    An episode begins at the initial values, and is truncated after `duration`.

    Parameters
    ----------
    system : System
        With ``inputs=(...)``, as for `gms_fsm.SystemState`.
    actions : mapping of str to float
        For each input that the agent gives its largest size; an action is divided by it, from -1
        to 1, and clipped there.
    observed : mapping of str to float
        Names that `gms_fsm.SystemState.value` knows, each with the largest size in the observation
        space; values are clipped there.
    reward : str
        Of a step, over all such names at its end, for example ``"-abs(goal - x) - 0.01 * u**2"``.
    period : float
        s: of one step.
    duration : float
        s: of an episode.
    drawn : mapping of str to (float, float), optional
        For each other input the interval from which `reset` draws it, evenly; it is held during
        the episode.
    ends : str, optional
        A condition that terminates an episode, such as ``"abs(x) > 1"``.
    initial : mapping, optional
        As for `gms_fsm.simulate`.

    Raises
    ------
    MissingExtraError
        If gymnasium is not installed; on import of this module.
    ParameterError, ExpressionError
        If an argument violates its rule.

    Examples
    --------
    >>> from gms_fsm import Body, Contact, System
    >>> from gms_fsm.charts import CHARTS
    >>> pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
    >>> sled = System("sled", bodies=(Body("sled", inertia=1.0, force="u"),), contacts=(pad,),
    ...               inputs=("u", "goal"))
    >>> env = SystemTask(sled, actions={"u": 5.0}, observed={"goal": 1.0, "x": 2.0, "v": 9.0},
    ...                  reward="-abs(goal - x)", drawn={"goal": (-0.8, 0.8)}, ends="abs(x) > 1",
    ...                  period=0.01, duration=10.0)
    >>> observation, info = env.reset(seed=1, options={"goal": 0.5})
    >>> observation, reward, terminated, truncated, info = env.step(np.array([1.0]))
    >>> observation.round(4).tolist(), round(reward, 4), info["states"]["pad"]
    ([0.5, 0.0002, 0.04], -0.4998, ('forward',))
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  as gymnasium declares it

    def __init__(
        self,
        system: System,
        *,
        actions: Mapping[str, float],
        observed: Mapping[str, float],
        reward: str,
        period: float,
        duration: float,
        drawn: Mapping[str, tuple[float, float]] | None = None,
        ends: str | None = None,
        initial: Mapping[str, Any] | None = None,
    ) -> None:
        self.period = checked_scalar("period", period, "> 0")
        self.duration = checked_scalar("duration", duration, "> 0")
        self.system = SystemState(system, initial=initial)
        self._begin = self.system.snapshot()
        self._sizes = _sizes("actions", actions)
        self._observed = _sizes("observed", observed)
        self._drawn = {
            name: tuple(checked_array(f"drawn[{name!r}]", each, 2, "finite").tolist())
            for name, each in ({} if drawn is None else drawn).items()
        }
        given = sorted([*self._sizes, *self._drawn])
        if given != sorted(system.inputs):
            raise ParameterError(
                f"actions and drawn give {', '.join(given) or 'nothing'}",
                place=f"system {system.name!r}",
                advice=f"give each of its inputs once: {', '.join(system.inputs) or 'it has none'}",
            )
        for name in self._observed:
            self.system.value(name)  # or refuse it
        known = [name for name in self.system.names if name.isidentifier() or "." in name]
        self._reward = parse_value(reward, known)
        self._ends = None if ends is None else parse_condition(ends, known)
        bound = np.array([*self._observed.values()])
        self.observation_space = gymnasium.spaces.Box(-bound, bound, dtype=np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (len(self._sizes),), dtype=np.float64)
        self._held: dict[str, float] = {}
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Floats, dict[str, Any]]:
        """Begin an episode.

        Parameters
        ----------
        seed : int, optional
            For what is drawn.
        options : dict, optional
            Values of inputs that are not to be drawn, such as ``{"goal": 0.5}``.

        Returns
        -------
        tuple
            Observation and info, as `step` returns them.
        """
        super().reset(seed=seed)
        chosen = {} if options is None else options
        for name in chosen:
            if name not in self._drawn:
                raise unknown("input", name, self._drawn, place="options")
        self._held = {
            name: checked_scalar(name, chosen[name], "finite")
            if name in chosen
            else float(self.np_random.uniform(*bounds))
            for name, bounds in self._drawn.items()
        }
        self.system.restore(self._begin)
        self._steps = 0
        self.system.advance(0.0, **self._held, **dict.fromkeys(self._sizes, 0.0))
        return self._seen(), self._info()

    def step(self, action: _Floats) -> tuple[_Floats, float, bool, bool, dict[str, Any]]:
        """Hold the inputs for one period.

        Parameters
        ----------
        action : ndarray, shape (n,)
            Each input, divided by its largest size.

        Returns
        -------
        tuple
            Observation, reward, terminated, truncated, info. Info has ``t`` [s], the ``states`` of
            all contacts, and the ``switches`` of this step.
        """
        given = checked_array("action", action, None, "finite")
        if given.size != len(self._sizes):
            raise ParameterError(
                f"it has {given.size} entries", place="action", advice=f"give {len(self._sizes)}"
            )
        levels = zip(self._sizes.items(), np.clip(given, -1.0, 1.0).tolist(), strict=True)
        self.system.advance(
            self.period, **self._held, **{name: size * u for (name, size), u in levels}
        )
        self._steps += 1
        reward = float(evaluate(self._reward, self._values(self._reward)))
        over = self._ends is not None and bool(truths(self._ends, self._values(self._ends), ()))
        truncated = self._steps >= round(self.duration / self.period)
        return self._seen(), reward, over, truncated, self._info()

    def _values(self, tree: Any) -> dict[str, float]:
        return {name: self.system.value(name) for name in names_in(tree)}

    def _seen(self) -> _Floats:
        bound = np.array([*self._observed.values()])
        values = np.array([self.system.value(name) for name in self._observed])
        found: _Floats = np.clip(values, -bound, bound)
        return found

    def _info(self) -> dict[str, Any]:
        system = self.system
        return {"t": system.t, "states": system.states, "switches": system.switches}


def _sizes(name: str, given: Any) -> dict[str, float]:
    """Return sizes by name, or refuse them."""
    if not isinstance(given, Mapping) or not given:
        raise ParameterError(
            "it must be a mapping of names to their largest sizes", place=name, value=given
        )
    return {each: checked_scalar(f"{name}[{each!r}]", size, "> 0") for each, size in given.items()}
