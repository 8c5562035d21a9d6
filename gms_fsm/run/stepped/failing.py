"""Why a sample cannot be completed, as an error."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gms_fsm.run.problem import Problem
from gms_fsm.run.stepped.memory import JointMemory
from gms_fsm.traces.failures import (
    LivelockError,
    LockError,
    NotFiniteError,
    NotUniqueError,
    SimulationError,
    StepLimitError,
    StepSizeError,
)
from gms_fsm.traces.rows import Rows
from integrators import advance, hybrid, loop

FAILURES: Mapping[int, tuple[type[SimulationError], str]] = {
    loop.MACHINE_LIVELOCK: (LivelockError, "it keeps switching without progress"),
    loop.RELATION_LIVELOCK: (LivelockError, "a comparison keeps changing without progress"),
    advance.TOO_SMALL: (StepSizeError, "the step size fell below the resolution of the clock"),
    loop.TOO_MANY_STEPS: (StepLimitError, "one sample needs more than max_steps steps"),
    advance.NOT_FINITE: (NotFiniteError, "the flow is NaN or infinite"),
    loop.ENTANGLED: (NotUniqueError, "it is between states on surfaces that cross: not unique"),
}
REFUSED = LockError, "its velocity has jumped, and no edge may be taken there"  # of systems


def failure(
    start: Problem, memory: JointMemory, code: int, element: str, what: str, now: float
) -> SimulationError:
    """Return the error for a sample that cannot be completed."""
    b = memory.buffers
    t, modes = b.now.t, hybrid.modes_of(b)
    where = np.array([t]), np.zeros(1, dtype=np.int64), np.array([b.now.y]), np.array([modes])
    row = Rows(*where)
    kind, reason = FAILURES.get(code, REFUSED)
    error = kind(
        reason,
        start.trace(row, row, start.firings([])),
        t=t,
        place=element if code in (loop.MACHINE_LIVELOCK, loop.REFUSED) else "",
        advice=f"the {what} is as it was before the call, at t = {now!r} s",
    )
    error.kept = ""  # a sample has no rows
    return error
