"""Step-size control: the first step and the following ones.

References
----------
E. Hairer, S. P. Norsett, G. Wanner, *Solving Ordinary Differential Equations I*, II.4 (starting
step) and Hairer & Wanner II, IV.2 (PI control).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from integrators.elementary import power
from integrators.steps import ArcMotion, Now, Scratch, Vector

__all__ = [
    "Control",
    "error_norm",
    "memory_of",
    "next_factor",
    "retry_factor",
    "root_of",
    "starting_step",
]

SAFETY = 0.9
LEAST, MOST = 0.2, 10.0  # limits of the change from one step to the next
LEAST_ROOT = 0.3  # in the memory of the controller
SHORT, HALF = 0.6, 0.525  # a step with a smaller root; how it grows
INFINITY = float("inf")
NO_TOLERANCE = 1e100


class Control(NamedTuple):
    """Settings of the step-size control."""

    step: float  # fixed grid if > 0, else adaptive
    origin: float  # where the grid starts
    rtol: float
    atol: Vector  # shape (m,); 0 for a component without a scale of its own
    max_step: float
    time_scale: float  # of the system, for starting steps; 0 if it has none


def error_norm(
    error: Vector, h: float, y: Vector, y_new: Vector, rtol: float, atol: Vector
) -> float:
    """Return the largest component of h error in units of its tolerance; infinity if not finite.

    The maximum, not the mean: one bad component among many at rest must count.

    Parameters
    ----------
    error, y, y_new : list of float, shape (m,)
        Error estimate per unit step length, and the state at both ends of the step.
    h : float
        The step's length.
    rtol : float
        Relative tolerance.
    atol : list of float, shape (m,)
        Absolute tolerances; if 0, a component that is 0 at both ends must have no error.

    Returns
    -------
    float
        At most 1 for an acceptable step.

    Examples
    --------
    >>> error_norm([2e-6], 0.5, [0.0], [1.0], rtol=1e-6, atol=[0.0])
    1.0
    >>> [error_norm([each], 0.5, [0.0], [0.0], rtol=1e-6, atol=[0.0]) for each in (0.0, 1e-9)]
    [0.0, inf]
    """
    worst = 0.0
    for j in range(len(y)):
        size = max(abs(y[j]), abs(y_new[j]))
        allowed = atol[j] + rtol * size
        if allowed > 0.0:
            ratio = abs(h * error[j]) / allowed
        else:
            ratio = 0.0 if error[j] == 0.0 else INFINITY
        if not (ratio < INFINITY and size < INFINITY):
            return INFINITY
        if ratio > worst:
            worst = ratio
    return worst


def scaled_size(u: Vector, y: Vector, control: Control, floor: Vector) -> float:
    """Return the largest component of u in units of its tolerance at y, if it has a scale.

    A component without a scale may only just have left 0. Steps chosen from its size would then be
    so short that the error is all rounding, which no shorter step makes smaller.
    """
    largest = -1.0
    for j in range(len(y)):
        if control.atol[j] > 0.0:
            size = abs(u[j]) / (floor[j] + control.rtol * abs(y[j]))
            if not size < INFINITY:
                return INFINITY
            largest = max(largest, size)
    return largest


def root_of(error: float, order: int) -> float:
    """Return about error ** (0.7 / order) without a power, for which the next step would wait.

    Parameters
    ----------
    error : float
        Norm of an error; very small ones count as 1e-10.
    order : int
        The error shrinks like h ** order.

    Returns
    -------
    float
        The fourth root; of an order above 4 the eighth one, between 0.02 and 1 within 2 %.

    Examples
    --------
    >>> root_of(2.0**-8, 5), root_of(2.0**-8, 3)
    (0.5, 0.25)
    >>> round(root_of(0.5, 5) / 0.5**0.125, 2)
    1.01
    """
    if order > 4 and 0.02 < error <= 1.0:
        return (0.104 + error) / (0.181 + 0.941 * error)
    root = math.sqrt(math.sqrt(max(error, 1e-10)))
    return math.sqrt(root) if order > 4 else root


def next_factor(root: float, memory: float) -> float:
    """Return the growth factor after an accepted step: PI control, unless it was far too short.

    Parameters
    ----------
    root : float
        `root_of` this step's error.
    memory : float
        `memory_of` the previous step's.

    Returns
    -------
    float
        Between LEAST and MOST.

    Examples
    --------
    >>> next_factor(root_of(1e-12, 5), 1.0)
    10.0
    """
    factor = SAFETY * memory / root
    if root < SHORT:  # far too short: at once to about half of what the error allows
        factor = max(factor, HALF / (root * math.sqrt(root)))
    return min(MOST, max(LEAST, factor))


def memory_of(root: float) -> float:
    """Return what the controller remembers of a step: about error ** (0.35 / order).

    Parameters
    ----------
    root : float
        `root_of` its error; very small ones count as `LEAST_ROOT`.

    Returns
    -------
    float
        At most 1 for an accepted step.
    """
    return math.sqrt(max(root, LEAST_ROOT))


def retry_factor(error: float, order: int) -> float:
    """Return the reduction factor after a rejected step.

    Parameters
    ----------
    error : float
        Norm of its error, infinity if not finite.
    order : int
        The error shrinks like h ** order.

    Returns
    -------
    float
        Between LEAST and SAFETY.

    Examples
    --------
    >>> retry_factor(float("inf"), 5)
    0.2
    """
    if not error < INFINITY:
        return LEAST
    factor: float = SAFETY * power(error, -1.0 / order)
    return max(LEAST, factor)


def starting_step(
    motion: ArcMotion, order: int, control: Control, now: Now, knot: float, scratch: Scratch
) -> float:
    """Return the usual starting step, from the size of y, y' and y''.

    It contains no time constant: if all times are multiplied by a power of two, so is the step.

    Parameters
    ----------
    motion : ArcMotion
        The flow.
    order : int
        Exponent of the step's error.
    control : Control
        Tolerances, the longest step, and the system's time scale.
    now : Now
        Time, state and slope at the start, and the next stop.
    knot : float
        The next knot. What comes after it has no influence.
    scratch : Scratch
        Used for a trial state and slope.

    Returns
    -------
    float
        A step, > 0.
    """
    t = now.t
    room = knot - t
    # If the system has a scale, the remaining time does not matter: the kernel cuts the step.
    time_scale = control.time_scale
    if not time_scale > 0.0:
        time_scale = min(room, now.t_stop - t)
    y, f = now.y, now.f
    y_try, f_try = scratch.y_new, scratch.f_new
    longest = control.max_step
    h = min(time_scale, longest)
    d0 = scaled_size(y, y, control, now.floor)
    d1 = scaled_size(f, y, control, now.floor)
    scaleless = False
    for j in range(len(y)):
        scaleless = scaleless or (control.atol[j] == 0.0 and f[j] != 0.0)
    # What moves has no scale, so there is no reference size. A long step can be shortened; a short
    # one would measure rounding.
    if (d1 <= 0.0 and scaleless) or d0 < 0.0 or not d1 * h < NO_TOLERANCE:
        return 1e-3 * h
    if d1 > 0.0:  # until y has moved by a hundredth, or by a tolerance if it is almost zero
        h = min(h, 0.01 * max(d0, 100.0) / d1)
    else:  # nothing moves yet
        h = 1e-6 * h
    h = min(h, room)
    for j in range(len(y)):
        y_try[j] = y[j] + h * f[j]
    motion.flow(min(t + h, now.seen), y_try, now.mode, now.held, motion.p, f_try)
    for j in range(len(y)):
        f_try[j] = (f_try[j] - f[j]) / h
    d2 = scaled_size(f_try, y, control, now.floor)
    if not d2 < INFINITY:
        return LEAST * h  # the trial step went too far
    steepest = max(time_scale * d1, time_scale * time_scale * d2)
    better = 1e-3 * h if steepest <= 1e-15 else time_scale * power(0.01 / steepest, 1.0 / order)
    return min(100.0 * h, better, longest)
