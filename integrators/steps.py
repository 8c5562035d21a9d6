"""One explicit Runge-Kutta step and the dense output inside it.

Plain loops over indexable numbers: Python runs them on lists, a compiler on arrays, with the same
result to the last bit (sums run in order, nothing is reassociated).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from integrators.tableaux import Row, Tableau

__all__ = ["Coefficients", "Dense", "Vector", "coefficients", "interpolate", "take_step"]

Vector = list[float]
Flow = Callable[..., Any]  # flow(t, y, mode, held, p, dy) -> None, fills dy


class Coefficients(NamedTuple):
    """A tableau as the kernel takes it."""

    A: tuple[Row, ...]
    B: Row
    C: Row
    E: Row
    D: Row
    error_order: int  # the error of one step shrinks like h ** error_order


class Dense(NamedTuple):
    """A step's polynomial, in the nested form of Hairer, Norsett & Wanner II.6."""

    start: Vector
    rise: Vector
    bend: Vector
    twist: Vector
    bump: Vector


def coefficients(tableau: Tableau) -> Coefficients:
    """Return a tableau as the kernel takes it.

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
    flow: Flow,
    method: Coefficients,
    t: float,
    y: Vector,
    f: Vector,
    t_new: float,
    mode: list[int],
    held: Vector,
    p: Any,
    k: list[Vector],
    y_new: Vector,
    f_new: Vector,
) -> None:
    """Step from (t, y) with slope f to t_new; fill the stages k, y_new and its slope f_new.

    Parameters
    ----------
    flow : callable
        ``flow(t, y, mode, held, p, dy)`` fills dy.
    method : Coefficients
        The tableau.
    t, t_new : float
        Start and end.
    y, f : list of float, shape (m,)
        State and slope at t.
    mode, held, p
        Handed on to flow, frozen within the step.
    k : list of list of float, shape (stages, m)
        Filled with the stages' slopes.
    y_new, f_new : list of float, shape (m,)
        Filled.
    """
    h = t_new - t
    size = len(y)
    A = method.A
    B = method.B
    C = method.C
    stages = len(B)
    first = k[0]
    for j in range(size):
        first[j] = f[j]
    for i in range(1, stages + 1):
        row = A[i] if i < stages else B
        a = row[0]
        if i == 1:
            for j in range(size):
                y_new[j] = y[j] + h * (a * first[j])
        else:
            # Two stages at a time: half the loads and stores.
            b = row[1]
            second = k[1]
            for j in range(size):
                y_new[j] = a * first[j] + b * second[j]
            for m in range(2, i - 1, 2):
                a, b = row[m], row[m + 1]
                k_m, k_n = k[m], k[m + 1]
                for j in range(size):
                    y_new[j] = y_new[j] + a * k_m[j] + b * k_n[j]
            if i % 2 == 1:
                a = row[i - 1]
                k_m = k[i - 1]
                for j in range(size):
                    y_new[j] = y[j] + h * (y_new[j] + a * k_m[j])
            else:
                for j in range(size):
                    y_new[j] = y[j] + h * y_new[j]
        if i < stages:
            flow(t + C[i] * h, y_new, mode, held, p, k[i])
    flow(t_new, y_new, mode, held, p, f_new)


def fit_dense(
    method: Coefficients,
    h: float,
    y: Vector,
    k: list[Vector],
    y_new: Vector,
    f_new: Vector,
    dense: Dense,
) -> None:
    """Fill the polynomial of the step just taken."""
    D = method.D
    stages = len(method.B)
    start, rises, bends, twists, bumps = dense
    first = k[0]
    for j in range(len(y)):
        rise = y_new[j] - y[j]
        bend = h * first[j] - rise
        start[j] = y[j]
        rises[j] = rise
        bends[j] = bend
        twists[j] = rise - h * f_new[j] - bend
    if len(D) > 0:
        weigh(D, stages, f_new, k, bumps)
        for j in range(len(y)):
            bumps[j] = h * bumps[j]


def weigh(weights: Row, stages: int, f_new: Vector, k: list[Vector], out: Vector) -> None:
    """Fill the sum of all slopes of a step, weighted."""
    last, a = weights[stages], weights[0]
    first = k[0]
    for j in range(len(out)):
        out[j] = last * f_new[j] + a * first[j]
    for m in range(1, stages - 1, 2):
        a, b = weights[m], weights[m + 1]
        k_m, k_n = k[m], k[m + 1]
        for j in range(len(out)):
            out[j] = out[j] + a * k_m[j] + b * k_n[j]
    if stages % 2 == 0:
        a = weights[stages - 1]
        k_m = k[stages - 1]
        for j in range(len(out)):
            out[j] += a * k_m[j]


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
