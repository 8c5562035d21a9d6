"""The variational equations between recorded rows: a state and its tangents, with all signs frozen.

Between two nodes the state begins as it was recorded, and is integrated once more together with a
tangent; an error estimate of both divides the interval where it is too long. Each direction is by
itself, so that their number does not matter to the text.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from integrators.step_size import root_of
from integrators.steps import Coefficients, Vector, weighted_sum

__all__ = ["TangentWork", "VaryArguments", "vary", "work"]

SAFE, LEAST, MOST = 0.9, 0.2, 3.0  # of the step control
ORDER = 5
SHARE = 1e-3  # of the largest tangent that a component could have: what is small beside it
ROUNDING = 2.0**-52
SMALLEST = 1e-300
TICK = 4.0 * ROUNDING


class TangentWork(NamedTuple):
    """Scratch space for one step."""

    k: list[Vector]  # slopes of the stages, and at the end, shape (stages + 1, m)
    k_t: list[Vector]  # their tangents
    y: Vector
    y_t: Vector
    inner: Vector
    inner_t: Vector
    error: Vector
    error_t: Vector
    own: list[Vector]  # what the numbers change by: those of each element
    shared: Vector  # ... and those with one value


class VaryArguments(NamedTuple):
    """The arguments of `vary`, without the last two."""

    method: Coefficients
    flow: Callable[..., Any]  # flow(t, y, mode, held, p, dy, dt, y_t, p_t, dy_t)
    p: Any
    moves: Any  # what the numbers change by in each direction: shared, then own ones
    held: Any
    mode: Any
    t: Any  # the nodes, increasing
    known: Any  # whether the state at a node is given
    y: Any  # the state there
    table: Any  # the tangents at the nodes, m numbers for each direction
    sizes: Any  # the largest value of each component
    scales: Any  # how much the numbers of each direction change at most
    tolerance: Any  # the relative one, then the absolute ones
    work: TangentWork


def work(size: int, own: int, longest: int, shared: int, stages: int) -> TangentWork:
    """Return scratch space."""

    def vector() -> Vector:
        return [0.0] * size

    def slopes() -> list[Vector]:
        return [vector() for _ in range(stages + 1)]

    rows = [[0.0] * longest for _ in range(own)]
    a, b, c, d, e, f = (vector() for _ in range(6))
    return TangentWork(slopes(), slopes(), a, b, c, d, e, f, rows, [0.0] * shared)


def vary(
    method: Coefficients,
    flow: Callable[..., Any],
    p: Any,
    moves: list[Vector],
    held: Vector,
    mode: list[int],
    t: Vector,
    known: list[int],
    y: list[Vector],
    table: list[Vector],
    sizes: Vector,
    scales: Vector,
    tolerance: Vector,
    w: TangentWork,
    directions: int,
    count: int,
) -> int:
    """Fill the tangents at the nodes from those at the first one; return the number of steps."""
    size, steps = len(sizes), 0
    for c in range(directions):
        _set_numbers(moves[c], w)
        first = c * size
        h = t[count - 1] - t[0]
        for j in range(size):
            w.y_t[j] = table[0][first + j]
        for node in range(count - 1):
            if known[node]:
                for j in range(size):
                    w.y[j] = y[node][j]
            if node == 0:
                flow(t[0], w.y, mode, held, p, w.k[0], 0.0, w.y_t, (w.shared, w.own), w.k_t[0])
            now, end = t[node], t[node + 1]
            tick = TICK * max(abs(now), abs(end))
            undivided = True
            while now < end:
                step = min(h, end - now)
                if end - now - step <= tick:
                    step = end - now
                _step(method, flow, p, held, mode, now, step, end, w)
                worst = _error(step, method, sizes, scales[c], tolerance, w)
                steps += 1
                if worst > 1.0 and step > tick:
                    undivided = False
                    h = step * max(LEAST, SAFE / root_of(worst, ORDER))
                    continue
                now = end if end - now - step <= tick else now + step
                _accept(len(method.B), w)
                undivided = undivided and now == end
                h = max(h, step * min(MOST, SAFE / root_of(worst, ORDER)))
            if undivided:  # the steps of the run are short enough
                h = t[count - 1] - t[0]
            place = table[node + 1]
            for j in range(size):
                place[first + j] = w.y_t[j]
    return steps


def _set_numbers(move: Vector, w: TangentWork) -> None:
    """Set what the numbers change by in one direction."""
    at = len(w.shared)
    for k in range(at):
        w.shared[k] = move[k]
    for k in range(len(w.own)):
        row = w.own[k]
        for i in range(len(row)):
            row[i] = move[at + i]
        at += len(row)


def _step(
    method: Coefficients,
    flow: Callable[..., Any],
    p: Any,
    held: Vector,
    mode: list[int],
    t: float,
    h: float,
    end: float,
    w: TangentWork,
) -> None:
    """Take a step of the state and of its tangent."""
    A, B, C = method.A, method.B, method.C
    stages, size = len(B), len(w.y)
    for i in range(1, stages + 1):
        row = A[i] if i < stages else B
        for j in range(size):
            rise, rise_t = 0.0, 0.0
            for m in range(i):
                rise += row[m] * w.k[m][j]
                rise_t += row[m] * w.k_t[m][j]
            w.inner[j] = w.y[j] + h * rise
            w.inner_t[j] = w.y_t[j] + h * rise_t
        time = min(t + C[i] * h, end) if i < stages else min(t + h, end)
        flow(time, w.inner, mode, held, p, w.k[i], 0.0, w.inner_t, (w.shared, w.own), w.k_t[i])


def _error(
    h: float, method: Coefficients, sizes: Vector, scale: float, tolerance: Vector, w: TangentWork
) -> float:
    """Return the error of the step in units of the tolerances: that of the worst component."""
    stages, rtol, worst, most = len(method.B), tolerance[0], 0.0, 0.0
    weighted_sum(method.E, stages, w.k[stages], w.k, w.error)
    weighted_sum(method.E, stages, w.k_t[stages], w.k_t, w.error_t)
    for j in range(len(sizes)):
        most = max(most, abs(w.inner_t[j]))
    for j in range(len(sizes)):
        allowed = rtol * max(sizes[j], abs(w.inner[j])) + tolerance[1 + j] + SMALLEST
        worst = max(worst, abs(h * w.error[j]) / allowed)
        size = max(abs(w.y_t[j]), abs(w.inner_t[j])) + SHARE * sizes[j] / scale
        worst = max(worst, abs(h * w.error_t[j]) / (rtol * size + ROUNDING * most + SMALLEST))
    return worst


def _accept(stages: int, w: TangentWork) -> None:
    """Go to the end of the step."""
    first, last, first_t, last_t = w.k[0], w.k[stages], w.k_t[0], w.k_t[stages]
    for j in range(len(w.y)):
        w.y[j] = w.inner[j]
        w.y_t[j] = w.inner_t[j]
        first[j] = last[j]
        first_t[j] = last_t[j]
