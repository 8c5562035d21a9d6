"""The same outer loop over any `scipy.integrate.OdeSolver`: RK45, DOP853, Radau, BDF, LSODA.

For stiff systems. The solver chooses its steps; crossings
are located on its own dense output.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import OdeSolver

from integrators.advance import (
    AT_ONCE,
    CROSSED,
    FULL,
    NEXT_KNOT,
    NEXT_TIME,
    NOT_FINITE,
    REACHED,
    REDO,
    ROW,
    STEPS,
    TOO_SMALL,
    put_row,
    tick_at,
)
from integrators.crossings import NO_CHANGE, copy_margins, first_change
from integrators.loop import NEW_ARC, STATUS, T_STOP, T, active_relations
from integrators.sliding import Held, flow_on, margins_on

if TYPE_CHECKING:
    from integrators.hybrid import Buffers, Options
    from integrators.steps import Vector

__all__ = ["SciPyStepper"]


class SciPyStepper:
    """Takes the steps of a run by a SciPy solver.

    Parameters
    ----------
    on, buffers, options
        The system on its surfaces, and the run. With a fixed ``step`` the solver is led from grid
        point to grid point (it keeps its error control, so it may take several steps to each).
    """

    def __init__(self, on: Held, buffers: Buffers, options: Options) -> None:
        if not (isinstance(options.method, type) and issubclass(options.method, OdeSolver)):
            raise TypeError(f"method {options.method!r} is not a scipy.integrate.OdeSolver class")
        self.on, self.buffers, self.options = on, buffers, options
        self.solver: Any = None

    def advance(self, most_steps: int) -> None:
        """Step until the next stop, a crossing, a full buffer or most_steps steps."""
        memory = self.buffers.memory
        if memory.counts[NEW_ARC]:  # after a stop the old solver's step and history mean nothing
            self.solver = None
            memory.counts[NEW_ARC] = 0
        memory.counts[STATUS], memory.now[T] = self._advance(memory.now[T], most_steps)

    def _limit(self, t: float) -> float:
        b = self.buffers
        cursor, knots, limit = b.out.cursor, b.plan.knots, b.memory.now[T_STOP]
        while cursor[NEXT_KNOT] < len(knots) and knots[cursor[NEXT_KNOT]] <= t:
            cursor[NEXT_KNOT] += 1
        if cursor[NEXT_KNOT] < len(knots):
            limit = min(limit, knots[cursor[NEXT_KNOT]])
        if self.options.step:
            index = int((t - b.control.origin) / self.options.step) + 1
            while (grid := b.control.origin + index * self.options.step) - t <= tick_at(grid):
                index += 1
            limit = min(limit, b.control.origin + index * self.options.step)
        return limit

    def _solver_to(self, limit: float, t: float) -> Any:
        if self.solver is not None and self.solver.t_bound == limit:
            return self.solver
        b = self.buffers

        def slope(time: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
            dy = [0.0] * len(state)
            flow_on(float(time), state.tolist(), b.mode, b.held, self.on, dy)
            result = np.array(dy)
            if not np.isfinite(result).all():
                raise FloatingPointError(f"the flow is not finite at t = {float(time)!r}")
            return result

        solver: Any = self.options.method
        return solver(
            slope,
            t,
            np.array(b.y),
            limit,
            rtol=self.options.rtol,
            atol=np.array(b.work.floor),
            max_step=self.options.max_step if math.isfinite(self.options.max_step) else np.inf,
        )

    def _advance(self, t: float, most_steps: int) -> tuple[int, float]:
        b = self.buffers
        out, y, w = b.out, b.y, active_relations(b.relations, b.memory)
        cursor, t_stop = out.cursor, b.memory.now[T_STOP]
        redone, ahead = False, math.inf
        while True:
            if t >= t_stop:
                return REACHED, t
            if most_steps <= 0 or (out.every_step and cursor[ROW] >= len(out.rows_t)):
                return FULL, t
            cursor[STEPS] += 1
            try:
                solver = self._solver_to(min(self._limit(t), ahead), t)
                solver.step()
            except (ArithmeticError, np.linalg.LinAlgError):
                return NOT_FINITE, t
            if solver.status == "failed":
                return TOO_SMALL, t
            self.solver = solver
            t_old, t_new, dense = t, float(solver.t), solver.dense_output()
            y_new = solver.y.tolist()
            tick = tick_at(max(abs(t), abs(t_new)))

            def interpolate(
                dense: Any, theta: float, place: Vector, t0: float = t_old, t1: float = t_new
            ) -> None:
                place[:] = dense(t0 + theta * (t1 - t0)).tolist()

            theta = NO_CHANGE
            if w.active:
                theta = first_change(
                    interpolate, dense, margins_on, t, t_new, y_new, b.mode, self.on, w, tick
                )
            if theta < REDO and not redone and theta * (t_new - t) > AT_ONCE * tick:
                # As in the kernel: the solver's stages lay behind the crossing.
                self.solver, redone = None, True
                ahead = t + theta * (t_new - t)
                continue
            redone, ahead = False, math.inf
            if theta < 1.0:
                t_new = t + theta * (t_new - t)
            else:
                copy_margins(w, w.end, w.start)
            while cursor[NEXT_TIME] < len(out.times) and out.times[cursor[NEXT_TIME]] < t_new:
                put_row(
                    out, out.times[cursor[NEXT_TIME]], dense(out.times[cursor[NEXT_TIME]]).tolist()
                )
                cursor[NEXT_TIME] += 1
            if theta < 1.0:
                interpolate(dense, theta, y)
            else:
                y[:] = y_new
            t = t_new
            most_steps -= 1
            if out.every_step:
                put_row(out, t, y)
            if theta != NO_CHANGE:
                return CROSSED, t
