"""One explicit Runge-Kutta step and its dense output.

Plain loops over indexable numbers: Python runs them on lists, a compiler on arrays, with the same
result to the last bit (sums are evaluated in order, nothing is reassociated).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from integrators.tableaux import Row, Tableau

__all__ = [
    "ArcMotion",
    "Coefficients",
    "Dense",
    "Now",
    "Scratch",
    "Vector",
    "coefficients",
    "interpolate",
    "stays",
    "take_step",
]

Vector = list[float]
Flow = Callable[..., Any]  # flow(t, y, mode, held, p, dy) -> None, fills dy
Follow = Callable[..., Any]  # follow(t, y, mode, held, p) -> None, sets what others determine
Margins = Callable[..., Any]  # margins(t, y, mode, p, watch, out) -> None, fills watched entries


class Coefficients(NamedTuple):
    """A tableau in the form that the kernel uses."""

    A: tuple[Row, ...]
    B: Row
    C: Row
    E: Row
    D: Row
    error_order: int  # the error of one step is proportional to h ** error_order


class Dense(NamedTuple):
    """A step's polynomial, in the nested form of Hairer, Norsett & Wanner II.6."""

    start: Vector
    rise: Vector
    bend: Vector
    twist: Vector
    bump: Vector


def stays(t: float, y: Vector, mode: list[int], held: Vector, p: Any) -> None:
    """Set no component: none is determined by others."""


@dataclass(slots=True, eq=False)
class Now:
    """The state of a run; changed in place."""

    t: float  # the time
    h: float  # the next step
    error_before: float  # the controller's memory
    t_stop: float  # the next stop
    anchor: float  # the time since which switches are counted
    switched: float  # the time of the last one
    pause: float  # the time at which the loop returns once the states are settled
    latest: float  # the latest time that the clock must resolve
    # The latest time at which the system shows what is before the next jump. Beyond it, at the
    # jump, it is asked there.
    seen: float
    y: Vector  # state, shape (m,)
    f: Vector  # slope, shape (m,)
    mode: list[int]  # of each machine, shape (n,); frozen within a step
    held: Vector  # signs; frozen within a step
    floor: Vector  # absolute tolerances, shape (m,); they grow for components without a scale


class Scratch(NamedTuple):
    """The attempted step."""

    k: list[Vector]  # slopes of the stages, shape (stages, m)
    y_new: Vector
    f_new: Vector
    error: Vector
    dense: Dense


def moves_alone(t: float, now: Now, scratch: Scratch, whole: bool, p: Any) -> None:
    """Go on: nothing moves with the state."""


class ArcMotion(NamedTuple):
    """The flow on an arc, what is watched, and what follows, with the parameters of all."""

    flow: Flow
    margins: Margins
    p: Any
    follow: Follow
    # moved(t, now, scratch, whole, p) once y is at t, with now.t before it; whether by a whole step
    moved: Callable[..., Any] = moves_alone


def time_of(now: Now) -> float:
    """Return the time at which the system shows the state: one clock tick before a jump."""
    return min(now.t, now.seen)


def coefficients(tableau: Tableau) -> Coefficients:
    """Return a tableau in the form that the kernel uses.

    Parameters
    ----------
    tableau : Tableau
        A method.

    Returns
    -------
    Coefficients
        Its arrays; missing E and D become empty.
    """
    return Coefficients(tableau.A, tableau.B, tableau.C, tableau.E, tableau.D, tableau.order)


def take_step(
    motion: ArcMotion, method: Coefficients, now: Now, t_new: float, scratch: Scratch
) -> None:
    """Step from the present state to t_new.

    Parameters
    ----------
    motion : ArcMotion
        ``flow(t, y, mode, held, p, dy)`` fills dy.
    method : Coefficients
        The tableau.
    now : Now
        Time, state and slope at the start.
    t_new : float
        End of the step.
    scratch : Scratch
        Filled with the slopes of the stages, the state at t_new and its slope.
    """
    flow, p = motion.flow, motion.p
    t, y = now.t, now.y
    mode, held = now.mode, now.held
    k, y_new = scratch.k, scratch.y_new
    h = t_new - t
    size = len(y)
    end = min(t_new, now.seen)
    A = method.A
    B = method.B
    C = method.C
    stages = len(B)
    first, f = k[0], now.f
    for j in range(size):
        first[j] = f[j]
    for i in range(1, stages + 1):
        row = A[i] if i < stages else B
        a = h * row[0]
        if i == 1:
            for j in range(size):
                y_new[j] = y[j] + a * first[j]
        else:
            # Two stages at a time: half the number of loads and stores. The newest slope comes
            # last, because it is known last.
            b = h * row[1]
            second = k[1]
            for j in range(size):
                y_new[j] = a * first[j] + b * second[j]
            for m in range(2, i - 1, 2):
                a, b = h * row[m], h * row[m + 1]
                k_m, k_n = k[m], k[m + 1]
                for j in range(size):
                    y_new[j] = y_new[j] + a * k_m[j] + b * k_n[j]
            if i % 2 == 1:
                a = h * row[i - 1]
                k_m = k[i - 1]
                for j in range(size):
                    y_new[j] = y[j] + (y_new[j] + a * k_m[j])
            else:
                for j in range(size):
                    y_new[j] = y[j] + y_new[j]
        if i < stages:
            # Rounding must not put a stage beyond the end: another line of a record begins there.
            flow(min(t + C[i] * h, end) if C[i] < 1.0 else end, y_new, mode, held, p, k[i])
    flow(end, y_new, mode, held, p, scratch.f_new)


def fit_dense(method: Coefficients, h: float, y: Vector, scratch: Scratch) -> None:
    """Compute the polynomial of the step of length h just taken from y."""
    k, y_new, f_new = scratch.k, scratch.y_new, scratch.f_new
    D = method.D
    stages = len(method.B)
    start, rises, bends, twists, bumps = scratch.dense
    first = k[0]
    for j in range(len(y)):
        rise = y_new[j] - y[j]
        bend = h * first[j] - rise
        start[j] = y[j]
        rises[j] = rise
        bends[j] = bend
        twists[j] = rise - h * f_new[j] - bend
    if len(D) > 0:
        weighted_sum(D, stages, f_new, k, bumps)
        for j in range(len(y)):
            bumps[j] = h * bumps[j]


def weighted_sum(weights: Row, stages: int, f_new: Vector, k: list[Vector], out: Vector) -> None:
    """Compute the weighted sum of all slopes of a step; the newest is known, and added, last."""
    a, first = weights[0], k[0]
    if stages % 2 == 1:
        for j in range(len(out)):
            out[j] = a * first[j]
    else:
        b, second = weights[stages - 1], k[stages - 1]
        for j in range(len(out)):
            out[j] = a * first[j] + b * second[j]
    for m in range(1, stages - 1, 2):
        a, b = weights[m], weights[m + 1]
        k_m, k_n = k[m], k[m + 1]
        for j in range(len(out)):
            out[j] = out[j] + a * k_m[j] + b * k_n[j]
    a = weights[stages]
    for j in range(len(out)):
        out[j] += a * f_new[j]


def interpolate(dense: Dense, theta: float, out: Vector) -> None:
    """Evaluate the polynomial at the fraction theta of the step.

    Parameters
    ----------
    dense : Dense
        Filled by `fit_dense`.
    theta : float
        From 0 (start) to 1 (end).
    out : list of float, shape (m,)
        Filled.
    """
    start, rise, bend, twist, bump = dense
    rest = 1.0 - theta
    for j in range(len(out)):
        inner = twist[j] + rest * bump[j]
        inner = bend[j] + theta * inner
        inner = rise[j] + rest * inner
        out[j] = start[j] + theta * inner
