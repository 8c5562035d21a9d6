"""The same outer loop over any `scipy.integrate.OdeSolver`: RK45, DOP853, Radau, BDF, LSODA.

For stiff systems. The solver chooses its steps; crossings are located on its dense output.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DenseOutput, OdeSolver

from integrators.advance import (
    AT_ONCE,
    CROSSED,
    FULL,
    NOT_FINITE,
    REACHED,
    REDO,
    TOO_SMALL,
    limit_after,
    next_on_grid,
    put_row,
    tick_at,
)
from integrators.crossings import NO_CHANGE, Path, copy_margins, first_change, listed
from integrators.sliding import Held, flow_on, follow_on, margins_on
from integrators.steps import ArcMotion, moves_alone

if TYPE_CHECKING:
    from integrators.hybrid import Buffers, LoopOptions
    from integrators.steps import Vector

__all__ = ["SciPyStepper"]


class SciPyStepper:
    """Takes the steps of a run with a SciPy solver.

    Parameters
    ----------
    on, buffers, options
        The system on its surfaces, and the run. With a fixed ``step`` the solver goes from grid
        point to grid point (it keeps its error control, so it may take several steps to each).
    moved : callable, optional
        What moves with the state; see `ArcMotion`.
    """

    def __init__(
        self,
        on: Held,
        buffers: Buffers,
        options: LoopOptions,
        moved: Callable[..., Any] = moves_alone,
    ) -> None:
        if not (isinstance(options.method, type) and issubclass(options.method, OdeSolver)):
            raise TypeError(f"method {options.method!r} is not a scipy.integrate.OdeSolver class")
        self.on, self.buffers, self.options, self.moved = on, buffers, options, moved
        self.solver: Any = None

    def advance(self, most_steps: int) -> None:
        """Step until the next stop, a crossing, a full buffer or most_steps steps."""
        memory = self.buffers.memory
        if memory.new_arc:  # after a stop the old solver's step and history are invalid
            self.solver = None
            memory.new_arc = False
        memory.status = self._advance(most_steps)

    def _limit(self) -> float:
        plan, now = self.buffers.plan, self.buffers.now
        limit = limit_after(plan, now, self.buffers.out)
        return min(limit, next_on_grid(plan.control, now.t)) if self.options.step else limit

    def _solver_to(self, limit: float) -> Any:
        if self.solver is not None and self.solver.t_bound == limit:
            return self.solver
        now = self.buffers.now

        def slope(time: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
            dy = [0.0] * len(state)
            flow_on(float(time), state.tolist(), now.mode, now.held, self.on, dy)
            result = np.array(dy)
            if not np.isfinite(result).all():
                raise FloatingPointError(f"the flow is not finite at t = {float(time)!r}")
            return result

        solver: Any = self.options.method
        return solver(
            slope,
            now.t,
            np.array(now.y),
            limit,
            rtol=self.options.rtol,
            atol=np.array(now.floor),
            max_step=self.options.max_step if math.isfinite(self.options.max_step) else np.inf,
        )

    def _advance(self, most_steps: int) -> int:
        b, now, out = self.buffers, self.buffers.now, self.buffers.out
        y, w = now.y, listed(b.relations, b.memory.active)
        motion = ArcMotion(flow_on, margins_on, self.on, follow_on, self.moved)
        redone, ahead = False, math.inf
        while True:
            t = now.t
            if t >= now.t_stop:
                return REACHED
            if most_steps <= 0 or (out.every_step and out.row >= len(out.rows_t)):
                return FULL
            out.steps += 1
            try:
                solver = self._solver_to(min(self._limit(), ahead))
                # BDF computes with a row that it has not filled yet, and overwrites the result.
                with np.errstate(invalid="ignore"):
                    solver.step()
            except (ArithmeticError, np.linalg.LinAlgError):
                return NOT_FINITE
            if solver.status == "failed":
                return TOO_SMALL
            self.solver = solver
            t_new, dense, y_new = float(solver.t), solver.dense_output(), solver.y.tolist()
            tick = tick_at(max(abs(t), abs(t_new)))
            theta = NO_CHANGE
            if w.active:
                path = Path(motion, now.mode, _interpolate, dense, t, t_new, t_new)
                margins_on(t_new, y_new, now.mode, self.on, w.watch, w.end)
                theta = first_change(path, w, tick)
            if theta < REDO and not redone and theta * (t_new - t) > AT_ONCE * tick:
                # As in the kernel: the solver's stages lay beyond the crossing.
                self.solver, redone = None, True
                ahead = t + theta * (t_new - t)
                continue
            redone, ahead = False, math.inf
            if theta < 1.0:
                t_new = t + theta * (t_new - t)
            else:
                copy_margins(w, w.end, w.start)
            while out.next_time < len(out.times) and out.times[out.next_time] < t_new:
                time = out.times[out.next_time]
                row = dense(time).tolist()
                motion.follow(time, row, now.mode, now.held, motion.p)
                put_row(out, time, row)
                out.next_time += 1
            if theta < 1.0:
                _interpolate(dense, theta, y)
            else:
                y[:] = y_new
            motion.follow(t_new, y, now.mode, now.held, motion.p)
            motion.moved(t_new, now, b.scratch, False, motion.p)
            now.t = t_new
            most_steps -= 1
            if out.every_step:
                put_row(out, t_new, y)
            if theta != NO_CHANGE:
                return CROSSED


def _interpolate(dense: DenseOutput, theta: float, place: Vector) -> None:
    place[:] = dense(dense.t_old + theta * (dense.t - dense.t_old)).tolist()
