"""SciPy's solvers with friction that steps from sample to sample, on straight lines of velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.adapters._scipy_parts import Caller, ContactSwitch, Solution, SteppedFriction
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.coupling.bank import FrictionBank
from gms_fsm.coupling.stepping import FrictionState
from gms_fsm.errors import ParameterError
from gms_fsm.traces.failures import SimulationError

MOST_SAMPLES = 10_000_000  # their times are kept
ROUNDING = 1e-9  # of a sample: a last one shorter than this is none


@dataclass(frozen=True)
class Solver:
    """How to integrate within a sample.

    Parameters
    ----------
    kind : type
        A `scipy.integrate.OdeSolver` class.
    rtol : float
        Relative tolerance.
    atol : list of float, shape (n,)
        Absolute tolerances.
    max_step : float
        s.
    max_steps : int
        Maximum number of steps of the whole run.
    """

    kind: type[Any]
    rtol: float
    atol: list[float]
    max_step: float
    max_steps: int


def samples(start: float, end: float, length: float) -> list[float]:
    """Return the ends of the samples; the last one may be shorter.

    Examples
    --------
    >>> samples(1.0, 2.0, 0.4)
    [1.4, 1.8, 2.0]
    """
    count = math.ceil((end - start) / length - ROUNDING)
    if count > MOST_SAMPLES:
        raise ParameterError(
            f"there would be {count:.4g} samples",
            place="sample",
            value=length,
            advice=f"at most {MOST_SAMPLES:,} fit into a run",
        )
    return [*(start + k * length for k in range(1, count)), end]


def sampled(
    caller: Caller, stepped: SteppedFriction, y: FloatArray, ends: list[float], how: Solver
) -> Solution:
    """Integrate from sample to sample."""
    stepper = stepped.stepper
    v = _velocity(caller, y)
    t, rows, forces = [stepper.t], [y], [stepper.peek(v, v, 0.0)]
    switches: list[ContactSwitch] = []
    message, steps = "", how.max_steps
    for end in ends:
        try:
            message, y, steps = _one(caller, stepper, y, end, how, steps)
            if message:
                break
            force = stepper.advance_to(v, v := _velocity(caller, y), end)
        except SimulationError as error:
            message = f"it stopped at t = {stepper.t!r} s: {error.reason}"
            break
        switches += _switches(stepped)
        t.append(end)
        rows.append(y)
        forces.append(force)
    return Solution(
        t=np.array(t),
        y=np.array(rows).T,
        F=np.array(forces).T,
        switches=tuple(switches),
        friction=SteppedFriction(stepper, stepper.snapshot(), stepped.given),
        nfev=caller.nfev,
        success=not message,
        message=message or "the end was reached",
    )


def _velocity(caller: Caller, y: FloatArray) -> Any:
    v = caller.velocities(y)
    return np.array(v) if caller.several else v[0]


def _one(
    caller: Caller,
    stepper: FrictionState | FrictionBank,
    y: FloatArray,
    end: float,
    how: Solver,
    steps: int,
) -> tuple[str, FloatArray, int]:
    """Integrate over one sample; return what went wrong, y at the end, and the steps left."""
    start, v0 = stepper.t, _velocity(caller, y)

    def slope(time: float, state: FloatArray) -> list[float]:
        force = stepper.peek(v0, _velocity(caller, state), max(time - start, 0.0))
        return caller.rates(time, state, np.atleast_1d(force).tolist())

    solver = how.kind(
        slope,
        start,
        y,
        end,
        rtol=how.rtol,
        atol=how.atol,
        max_step=how.max_step,
        first_step=min(end - start, how.max_step),  # no trial: a sample is short
    )
    while solver.status == "running":
        if steps == 0:
            return f"it stopped at t = {start!r} s: max_steps = {how.max_steps}", y, 0
        solver.step()
        steps -= 1
    if solver.status == "failed":
        return f"it stopped at t = {start!r} s: the step size became too small", y, steps
    return "", solver.y, steps


def _switches(stepped: SteppedFriction) -> list[ContactSwitch]:
    """Return the edges taken in the last sample, in order."""
    stepper = stepped.stepper
    each = stepper.switches if isinstance(stepper, FrictionBank) else (stepper.switches,)
    found = [
        ContactSwitch(one.t, name, one.element, one.edge)
        for name, taken in zip(stepped.names, each, strict=True)
        for one in taken
    ]
    return sorted(found, key=lambda one: one.t)
