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
    CROSSED,
    FULL,
    NEXT_KNOT,
    NEXT_TIME,
    NOT_FINITE,
    REACHED,
    REDO,
    ROW,
    TOO_SMALL,
    put_row,
)
from integrators.crossings import NO_CHANGE, copy_margins, first_change

if TYPE_CHECKING:
    from integrators.hybrid import Options, Workspace
    from integrators.steps import Vector

__all__ = ["SciPyStepper"]


class SciPyStepper:
    """Carries a state along an arc by a SciPy solver.

    Parameters
    ----------
    solver : type
        A class derived from `scipy.integrate.OdeSolver`.
    options : Options
        Tolerances; with ``step`` the solver is led from grid point to grid point (it keeps its
        error control, so it may take several steps to each).
    origin : float
        Where that grid starts.
    """

    def __init__(self, solver: type[Any], options: Options, origin: float) -> None:
        if not (isinstance(solver, type) and issubclass(solver, OdeSolver)):
            raise TypeError(f"method {solver!r} is not a scipy.integrate.OdeSolver class")
        self.solver_class: Any = solver
        self.options = options
        self.origin = origin
        self.solver: Any = None

    def begin(self, t: float, y: Vector, t_stop: float, ws: Workspace) -> None:  # noqa: ARG002
        """Forget the old solver: after a stop its step and history mean nothing."""
        self.solver = None

    def _limit(self, t: float, t_stop: float, ws: Workspace) -> float:
        cursor, knots = ws.out.cursor, ws.knots
        while cursor[NEXT_KNOT] < len(knots) and knots[cursor[NEXT_KNOT]] <= t:
            cursor[NEXT_KNOT] += 1
        limit = min(t_stop, knots[cursor[NEXT_KNOT]]) if cursor[NEXT_KNOT] < len(knots) else t_stop
        if self.options.step:
            index = int((t - self.origin) / self.options.step) + 1
            while self.origin + index * self.options.step - t <= ws.resolution:
                index += 1
            limit = min(limit, self.origin + index * self.options.step)
        return limit

    def _solver_to(self, limit: float, t: float, y: Vector, ws: Workspace) -> Any:
        if self.solver is not None and self.solver.t_bound == limit:
            return self.solver
        p = ws.system.p

        def slope(time: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
            dy = [0.0] * len(state)
            ws.flow(float(time), state.tolist(), ws.mode, ws.held, p, dy)
            result = np.array(dy)
            if not np.isfinite(result).all():
                raise FloatingPointError(f"the flow is not finite at t = {float(time)!r}")
            return result

        return self.solver_class(
            slope,
            t,
            np.array(y),
            limit,
            rtol=self.options.rtol,
            atol=self.options.atol,
            max_step=self.options.max_step if math.isfinite(self.options.max_step) else np.inf,
        )

    def advance(
        self, t: float, y: Vector, t_stop: float, ws: Workspace, most_steps: int
    ) -> tuple[int, float]:
        """Step until t_stop, a crossing, a full buffer or most_steps steps."""
        out = ws.out
        cursor = out.cursor
        redone, ahead = False, math.inf
        while True:
            if t >= t_stop:
                return REACHED, t
            if most_steps <= 0 or (out.every_step and cursor[ROW] >= len(out.rows_t)):
                return FULL, t
            try:
                limit = min(self._limit(t, t_stop, ws), ahead)
                solver = self._solver_to(limit, t, y, ws)
                solver.step()
            except (ArithmeticError, np.linalg.LinAlgError):
                return NOT_FINITE, t
            if solver.status == "failed":
                return TOO_SMALL, t
            self.solver = solver
            t_old, t_new, dense = t, float(solver.t), solver.dense_output()
            y_new = solver.y.tolist()

            def interpolate(
                dense: Any, theta: float, place: Vector, t0: float = t_old, t1: float = t_new
            ) -> None:
                place[:] = dense(t0 + theta * (t1 - t0)).tolist()

            theta = NO_CHANGE
            if ws.w.active:
                theta = first_change(
                    interpolate, dense, ws.system.margins, t, t_new, y_new, ws.mode, ws.system.p,
                    ws.w, ws.resolution,
                )  # fmt: skip
            if theta < REDO and not redone and theta * (t_new - t) > 1e3 * ws.resolution:
                # As in the kernel: the solver's stages lay behind the crossing.
                self.solver, redone = None, True
                ahead = t + theta * (t_new - t)
                continue
            redone, ahead = False, math.inf
            if theta < 1.0:
                t_new = t + theta * (t_new - t)
            else:
                copy_margins(ws.w, ws.w.end, ws.w.start)
            while cursor[NEXT_TIME] < len(out.times) and out.times[cursor[NEXT_TIME]] < t_new:
                put_row(out, out.times[cursor[NEXT_TIME]],
                        dense(out.times[cursor[NEXT_TIME]]).tolist())  # fmt: skip
                cursor[NEXT_TIME] += 1
            if theta < 1.0:
                interpolate(dense, theta, y)
            else:
                y[:] = y_new
            t = t_new
            out.reached[0] = t
            most_steps -= 1
            if out.every_step:
                put_row(out, t, y)
            if theta != NO_CHANGE:
                return CROSSED, t
