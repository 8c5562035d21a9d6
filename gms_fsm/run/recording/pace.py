"""Whether a stiff run can reach its end: a look ahead with an implicit method.

The pace so far says little: a controlled mass may take a hundred thousand steps to its place and
then rest. An implicit method goes to the end in few steps, and shows which rates lie ahead.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

import integrators
from gms_fsm.errors import SignalError
from gms_fsm.lowering.observing import armed, rate
from gms_fsm.lowering.program import equations
from gms_fsm.run.machines import IfElse
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.moment import Place, Recording
from gms_fsm.traces.failures import StepLimitError
from integrators import Arc, HybridError, hybrid

PATIENCE = 5_000  # steps before the first check
LATER = 4  # times as many steps: the next one
POWERS = 12  # iterations of the power method
STABLE = 1.5  # step times fastest rate: from here on stability may limit a step
STABLE_AT_MOST = 4.0  # no explicit method here is stable beyond it
CERTAIN = 2.0  # times the steps that are left
MOST_AHEAD = 400  # steps of a look ahead, which takes about a second
COARSE = 1e-3  # relative tolerance of a look ahead


def check_pace(recording: Recording, buffers: hybrid.Buffers) -> None:
    """Stop a run for which stability, not accuracy, asks for more steps than are left."""
    start, now, plan = recording.start, buffers.now, buffers.plan
    t = now.t
    place = t, list(now.y), hybrid.modes_of(buffers)
    options, step = start.options, now.h
    left = options.max_steps - buffers.out.steps
    if options.step or not isinstance(options.method, integrators.Tableau):
        return
    if start.last - t <= step * left or len(plan.jumps) - buffers.memory.jump > MOST_AHEAD:
        return
    floor = np.array(now.floor)
    fastest = _fastest(start, place, floor)
    if step * fastest < STABLE:
        return
    ahead = _steps_ahead(start, place, floor)
    if ahead <= CERTAIN * left:
        return
    raise StepLimitError(
        f"stiff: the flow has a rate of {fastest:.3g} /s, which limits the steps of "
        f"this method to {step:.3g} s: to reach t_end = {start.t_end!r} s it would take at least "
        f"{ahead:.3g} of them, but max_steps is {start.chosen.max_steps}",
        recording.trace(),
        t=t,
        advice=f'use an implicit method ({start.implicit}; [run] method = "Radau"), '
        "or check C and the thresholds",
    )


def _fastest(start: Problem, place: Place, floor: Any) -> float:
    """Return the fastest rate of the flow [1/s], by a power iteration; 0 if there is none."""
    program, (t, y, mode) = start.program, place
    held = armed(program, t, y, mode)
    slope = rate(program, t, y, mode, held)
    size = np.maximum(np.abs(y), floor / start.options.rtol)
    direction, fastest = np.ones(len(y)), 0.0
    for _ in range(POWERS):
        moved = (np.array(y) + 1e-6 * size * direction).tolist()
        change = (rate(program, t, moved, mode, held) - slope) / (1e-6 * size)
        fastest = float(np.abs(change).max())
        if not 0.0 < fastest < math.inf:
            return 0.0
        direction = change / fastest
    return fastest


def _steps_ahead(start: Problem, place: Place, floor: Any) -> float:
    """Return how many steps stability asks for until the end, at least; 0 if that is not known."""
    from scipy.integrate import Radau

    program, (t, y, mode) = start.program, place
    rtol = max(COARSE, start.options.rtol)
    options = replace(
        start.options,
        method=Radau,
        rtol=rtol,
        atol=np.maximum(floor, COARSE * rtol * np.abs(y)).tolist(),
        max_steps=MOST_AHEAD,
        times=None,
    )
    made, modes = equations(program), list(mode[program.layout.elements])
    total, before = 0.0, t
    try:
        for event in hybrid.run(made, IfElse(program), t, y, modes, start.last, options):
            if isinstance(event, Arc):
                for time, state in zip(event.t, event.y, strict=True):
                    if time > before:
                        steps = (time - before) / STABLE_AT_MOST
                        total += steps * _fastest(start, (time, state, event.mode), floor)
                    before = time
    except (HybridError, SignalError, ArithmeticError, ValueError):  # it may overflow in SciPy
        return 0.0
    return total
