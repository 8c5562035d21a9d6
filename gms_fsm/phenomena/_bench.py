"""The bench: one slider, what pushes and pulls it, and the numbers of the canonical signals.

All experiments use one system, with other numbers and signals, so that it is compiled once per
model. The slider is pushed by a force, or pulled by a drive through a spring and a damper. Where a
velocity is to be prescribed, spring and damper are stiff: a contact that locks can then be moved
like any other, and all models are moved in the same way.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import Radau

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.foundation.arguments import refusing, unknown
from gms_fsm.run.simulate import simulate
from gms_fsm.systems.system import Body, Contact, System
from gms_fsm.traces.failures import StepLimitError
from gms_fsm.traces.trace import Trace

MOST_STEPS = 1_000_000
# A run that needs more is stiff, or chatters; it is then made with an implicit method, whose steps
# are slower and fewer.
IMPLICIT_STEPS, IMPLICIT_RTOL = 20_000, 1e-6
POINTS = 24  # steps per period of a vibration, at least
Ramps = Sequence[tuple[float, float]]
FLAT: Ramps = ((0.0, 0.0), (1.0, 0.0))


@refusing()
@dataclass(frozen=True, kw_only=True)
class Bench:
    """Numbers of the canonical signals, and of the models whose values they are.

    Parameters
    ----------
    F_c, F_s : float
        Coulomb friction and stiction, N.
    v_s : float
        Stribeck velocity, m/s.
    sigma_0 : float
        Stiffness in pre-sliding, N/m.
    sigma_1, sigma_2 : float
        Damping in pre-sliding and viscous friction, Ns/m.
    mass : float
        Of the slider, kg.
    stiffness : float
        Of the spring that pulls the slider in slow experiments, N/m.
    speed : float
        Of that spring's far end in the stick-slip experiment, m/s.
    rtol : float
        Relative tolerance of the runs.

    Examples
    --------
    >>> round(Bench().bristle, 9)
    1.5e-05
    """

    F_c: float = 1.0
    F_s: float = 1.5
    v_s: float = 1e-3
    sigma_0: float = 1e5
    sigma_1: float = math.sqrt(1e5)
    sigma_2: float = 0.4
    mass: float = 1.0
    stiffness: float = 2.0
    speed: float = 0.1
    rtol: float = 1e-8

    def __post_init__(self) -> None:
        for each in dataclasses.fields(self):
            value = checked_scalar(f"bench: {each.name}", getattr(self, each.name), "> 0")
            object.__setattr__(self, each.name, value)

    @classmethod
    def of(cls, values: Mapping[str, float]) -> Bench:
        """Return the bench with some numbers replaced.

        Parameters
        ----------
        values : mapping of str to float
            By name.

        Returns
        -------
        Bench
            Checked.

        Raises
        ------
        ParameterError
            If there is no such number, or it is not positive.
        """
        known = [each.name for each in dataclasses.fields(cls)]
        for name in values:
            if name not in known:
                raise unknown("number", name, known, place="bench")
        return cls(**values)

    @property
    def bristle(self) -> float:
        """Pre-sliding displacement F_s / sigma_0, m."""
        return self.F_s / self.sigma_0

    @property
    def stiff(self) -> tuple[float, float]:
        """Spring [N/m] and damper [Ns/m] of the stiff drive: 10 sigma_0, critically damped."""
        spring = 10.0 * self.sigma_0
        return spring, 2.0 * math.sqrt(spring * self.mass)


@dataclass(frozen=True, kw_only=True)
class BenchMotion:
    """What pushes and pulls the slider.

    ``force + (vibration + growth * t) * sin(omega * (t - start))`` pushes it; a drive that moves
    with ``velocity * (1 + swing * cos(omega * t))`` pulls it through a spring and a damper.

    Parameters
    ----------
    force : sequence of (float, float)
        Corners of the force: time [s] and N.
    vibration, growth : float
        Amplitude, N, and its growth, N/s.
    start : float
        The vibration begins at this time, s.
    velocity : sequence of (float, float)
        Corners of the drive's velocity: time [s] and m/s.
    swing : float
        Amplitude of a cosine in it, as a share.
    omega : float
        Angular frequency, rad/s.
    spring, damper : float
        Between drive and slider, N/m and Ns/m.
    """

    force: Ramps = FLAT
    vibration: float = 0.0
    growth: float = 0.0
    start: float = 0.0
    velocity: Ramps = FLAT
    swing: float = 0.0
    omega: float = 0.0
    spring: float = 0.0
    damper: float = 0.0


def fastest_engine() -> str:
    """Return the fastest engine that is installed."""
    return "compiled" if importlib.util.find_spec("llvmlite") else "ifelse"


def run(
    contact: Contact,
    bench: Bench,
    motion: BenchMotion,
    t_end: float,
    t_eval: FloatArray | None = None,
) -> Trace:
    """Run a contact on the bench, from rest."""
    numbers = {
        "m": bench.mass,
        "A": motion.vibration,
        "A_1": motion.growth,
        "t_1": motion.start,
        "v_1": motion.swing,
        "w": motion.omega,
        "K": motion.spring,
        "D": motion.damper,
    }
    signals: dict[str, Any] = {"F_a": list(motion.force), "v_0": list(motion.velocity)}
    push = "F_a + (A + A_1 * t) * sin(w * max(t - t_1, 0))"
    system = System(
        "bench",
        bodies=(
            Body("drive", velocity="v_0 * (1 + v_1 * cos(w * t))", x="x_d", v="v_d"),
            Body("slider", inertia="m", force=f"{push} + K * (x_d - x) + D * (v_d - v)"),
        ),
        contacts=(contact,),
        signals=signals,
        numbers=numbers,
    )
    options: dict[str, Any] = {} if t_eval is None else {"t_eval": np.asarray(t_eval)}
    if motion.omega > 0.0:  # a locked slider has no motion from which steps could be chosen
        options["max_step"] = 2 * math.pi / motion.omega / POINTS
    # The slider's own scales: a chart such as modelica has none for a v that has just left 0.
    scales = {"x": bench.rtol * bench.bristle, "v": bench.rtol * bench.v_s}
    options |= {"rtol": bench.rtol, "atol": scales}
    try:
        return simulate(system, t_end, engine=fastest_engine(), max_steps=MOST_STEPS, **options)
    except StepLimitError:
        pass
    options["rtol"] = max(bench.rtol, IMPLICIT_RTOL)
    options["atol"] = IMPLICIT_RTOL * bench.bristle  # the smallest of its scales
    return simulate(
        system, t_end, engine="ifelse", method=Radau, max_steps=IMPLICIT_STEPS, **options
    )


@dataclass(frozen=True, eq=False)
class ForcePath:
    """A force that goes from 0 through some values and stays at each for a while.

    Parameters
    ----------
    corners : list of (float, float)
        Time [s] and N.
    branches : tuple of ndarray
        Times along each ramp, evenly spaced, s.
    ends : ndarray
        The end of each hold, s.
    """

    corners: list[tuple[float, float]]
    branches: tuple[FloatArray, ...]
    ends: FloatArray

    @property
    def times(self) -> FloatArray:
        """All times of branches and ends, s."""
        return np.unique(np.concatenate([*self.branches, self.ends]))

    def force(self, times: FloatArray) -> FloatArray:
        """Return the force at some times, N."""
        known, values = np.array(self.corners).T
        return np.asarray(np.interp(times, known, values))


def path(rate: float, stops: Sequence[float], hold: float, *, smooth: bool = False) -> ForcePath:
    """Return a force that goes through some values."""
    t = last = 0.0
    corners, ends, branches = [(0.0, 0.0)], [], []
    share = np.linspace(0.0, 1.0, 65 if smooth else 2)
    shape = 0.5 - 0.5 * np.cos(np.pi * share) if smooth else share
    for value in stops:
        length = abs(value - last) / rate
        branches.append(np.linspace(t, t + length, 200))
        times, values = t + length * share, last + (value - last) * shape
        corners += list(zip(times[1:].tolist(), values[1:].tolist(), strict=True))
        t += length + hold
        corners.append((t, value))
        ends.append(t)
        last = value
    return ForcePath(corners, tuple(branches), np.array(ends))
