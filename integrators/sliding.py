"""Motion along a surface where the flow jumps and pushes back from both sides (Filippov).

A surface is u(t, y) = 0, and the flow depends on the sign of u. Where the flow on either side leads
onto the surface, the solution continues along it, with the sign replaced by a number sigma from -1
to 1 such that du/dt = 0. It leaves where sigma reaches 1 or -1. Flows that are not linear in the
sign are combined as Filippov does: the mean of both sides plus sigma times half their difference,
which is the same where they are linear.

Sliding on several surfaces at once takes as many sigmas, from a linear system of that size.

A surface may also be where a machine changes between two of its modes and back. Such a machine
would switch without end; on the surface its two modes take the part of the two signs. It keeps the
mode entered last, and the two edges between them are not asked for until the motion has left. Two
such machines, or one and a sign, that bear on each other have no unique motion.

Alternatives considered: letting the sign chatter costs one switch per clock tick; smoothing it by a
steep ramp changes the solution and makes the system stiff.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from integrators.steps import Flow, Follow, Margins, Vector

__all__ = [
    "LIVE",
    "MOST_SLIDING",
    "Functions",
    "Held",
    "Sliding",
    "Surfaces",
    "arm_on",
    "flow_on",
    "follow_on",
    "go_back",
    "go_to",
    "look",
    "look_held",
    "margins_on",
    "other_mode",
    "sliding_scratch",
    "slope_on",
    "solve",
    "to_neither",
]

MOST_SLIDING = 32  # surfaces at once
LIVE = 2.0  # in place of a held sign: evaluate the sign live
BEYOND = 2.0  # sigma is clipped here: above 1 only the fact matters


class Functions(NamedTuple):
    """The functions of a system, and their parameters."""

    flow: Flow
    arm: Callable[..., Any]  # arm(t, y, mode, p, held, watch): signs to hold, relations to watch
    margins: Margins
    normal: Callable[..., Any]  # normal(surface, t, y, mode, p, out): gradient over y, rate in t
    follow: Follow
    p: Any


class Surfaces(NamedTuple):
    """The surfaces on which the motion can slide."""

    sign: list[int]  # the index of each one's sign among the held signs, shape (S,)
    above: list[int]  # its relation u > 0, shape (S,)
    at_least: list[int]  # its relation u >= 0, shape (S,)
    # Of each one between two modes; the relations are those of the two edges, and u is the margin
    # of the first.
    machine: list[int]  # its machine; -1 where a sign changes, shape (S,)
    # The others are empty if there are none of a machine: machine code is then translated without
    # what follows from them, since lengths are known while translating.
    upper: list[int]  # the mode where u > 0
    lower: list[int]  # the mode where u < 0
    rise: list[int]  # the edge from the lower mode to the upper one
    fall: list[int]  # the edge back


@dataclass(slots=True, eq=False)
class Sliding:
    """The surfaces on which the motion slides, with scratch space."""

    count: int  # of the surfaces slid on
    surfaces: Surfaces
    which: list[int]  # begins with the surfaces slid on, shape (MOST_SLIDING,)
    sigma: Vector  # replaces their signs, shape (MOST_SLIDING,)
    flags: list[int]  # whether the motion slides on each, shape (S,)
    arrived: list[int]  # whether each has just been reached (-1: left), shape (S,)
    live: Vector  # signs, all set to LIVE
    watch: list[int]  # unused flags, shape (r,)
    # Scratch space, of each surface slid on:
    normals: list[Vector]  # its gradient over y, and its rate in t
    halves: list[Vector]  # half the difference of the flows on both sides
    matrix: list[Vector]  # its row of the linear system
    rates: Vector  # du/dt with all their signs 0
    gains: Vector  # the response of du/dt to its own sign
    # ... and of all:
    upper: Vector  # the flow on either side of one
    lower: Vector
    seen_upper: Vector  # observed values on either side
    seen_lower: Vector
    slope: Vector
    before: Vector  # u before something jumped, shape (S,)
    edges: list[int]  # enabled edges of the other modes, shape (n,)


class Held(NamedTuple):
    """A system on the surfaces it slides on: the parameters of `flow_on` and `margins_on`."""

    functions: Functions
    held: Vector
    sliding: Sliding


def sliding_scratch(
    surfaces: Surfaces,
    size: int,
    signs: int,
    relations: int,
    seen: int,
    flags: Sequence[int] = (),
    machines: int = 0,
) -> Sliding:
    """Return scratch space for sliding; small if there are no surfaces.

    Parameters
    ----------
    surfaces : Surfaces
        The surfaces of the system.
    size : int
        Length of the state vector.
    signs, relations : int
        Number of held signs, and of comparisons that can be watched.
    seen : int
        Number of observed values.
    flags : sequence of int, optional
        Whether the motion slides on each surface; on none if omitted.
    machines : int, optional
        Number of machines, if they are asked for edges.

    Returns
    -------
    Sliding
        Made of lists.
    """
    number = len(surfaces.sign)
    most = min(number, MOST_SLIDING)
    on = [k for k, flag in enumerate(flags) if flag]
    width = max(size + 1, most + 1, seen) if most else 0

    def row() -> Vector:
        return [0.0] * width

    def rows() -> list[Vector]:
        return [row() for _ in range(max(most, 1))]

    return Sliding(
        count=len(on),
        surfaces=surfaces,
        which=on + [0] * (most - len(on)),
        sigma=[0.0] * most,
        flags=list(flags) or [0] * number,
        arrived=[0] * number,
        live=[LIVE] * signs,
        watch=[0] * relations,
        normals=rows(),
        halves=rows(),
        matrix=rows(),
        rates=row(),
        gains=row(),
        upper=row(),
        lower=row(),
        seen_upper=row(),
        seen_lower=row(),
        slope=row(),
        before=[0.0] * number,
        edges=[-1] * machines,
    )


# --------------------------------------------------------------------------- along the surfaces
def slope_on(on: Held, t: float, y: Vector, mode: list[int], dy: Vector) -> None:
    """Fill dy along the surfaces slid on, and the sigmas that keep the motion on them.

    Parameters
    ----------
    on : Held
        The system; the held signs of these surfaces are replaced by their sigmas.
    t, y, mode
        Passed on to the flow.
    dy : list of float, shape (m,)
        Filled.
    """
    flow, normal, p = on.functions.flow, on.functions.normal, on.functions.p
    held, sliding, surfaces = on.held, on.sliding, on.sliding.surfaces
    which, sigma, count, size = sliding.which, sliding.sigma, sliding.count, len(y)
    upper, lower, normals, halves = sliding.upper, sliding.lower, sliding.normals, sliding.halves
    to_neither(sliding, held)
    # A mean that is exact for any sum of functions of one sign (or the modes of one machine) each.
    if count == 1:
        for j in range(size):
            dy[j] = 0.0
    else:
        flow(t, y, mode, held, p, dy)
        for j in range(size):
            dy[j] = (1.0 - count) * dy[j]
    for c in range(count):
        kept = go_to(surfaces, which[c], 1.0, held, mode)
        flow(t, y, mode, held, p, upper)
        go_to(surfaces, which[c], -1.0, held, mode)
        flow(t, y, mode, held, p, lower)
        go_back(surfaces, which[c], kept, held, mode)
        half = halves[c]
        for j in range(size):
            dy[j] += 0.5 * (upper[j] + lower[j])
            half[j] = 0.5 * (upper[j] - lower[j])
    for r in range(count):
        g, row = normals[r], sliding.matrix[r]
        normal(which[r], t, y, mode, p, g)
        rate = g[size]
        for j in range(size):
            rate += g[j] * dy[j]
        row[count] = -rate
        for c in range(count):
            half = halves[c]
            gain = 0.0
            for j in range(size):
                gain += g[j] * half[j]
            row[c] = gain
        sliding.rates[r], sliding.gains[r] = rate, row[r]
    solve(sliding.matrix, count, sigma, BEYOND)
    for c in range(count):
        if surfaces.machine[which[c]] < 0:
            held[surfaces.sign[which[c]]] = sigma[c]
        half = halves[c]
        for j in range(size):
            dy[j] += sigma[c] * half[j]
    # Nothing normal to the surface, not even by rounding: v itself does not move. Nor where sigma
    # is clipped, past the end of the slide: a step may end there, and guards are read before it.
    for r in range(count):
        g = normals[r]
        rate, square = g[size], 0.0
        for j in range(size):
            rate += g[j] * dy[j]
            square += g[j] * g[j]
        if square > 0.0:
            for j in range(size):
                dy[j] -= g[j] * (rate / square)


def to_neither(sliding: Sliding, signs: Vector) -> None:
    """Set the signs of the surfaces slid on to 0; machines keep their modes."""
    which, surfaces = sliding.which, sliding.surfaces
    for c in range(sliding.count):
        if surfaces.machine[which[c]] < 0:
            signs[surfaces.sign[which[c]]] = 0.0


def go_to(surfaces: Surfaces, k: int, side: float, signs: Vector, mode: list[int]) -> int:
    """Go to one side of a surface by its sign, or its machine's mode; return the mode before."""
    i = surfaces.machine[k]
    kept = 0
    if len(surfaces.rise) == 0 or i < 0:
        signs[surfaces.sign[k]] = side
    else:
        kept = mode[i]
        mode[i] = surfaces.upper[k] if side > 0.0 else surfaces.lower[k]
    return kept


def go_back(surfaces: Surfaces, k: int, kept: int, signs: Vector, mode: list[int]) -> None:
    """Go back to a sign of 0, or to the mode before."""
    i = surfaces.machine[k]
    if len(surfaces.rise) == 0 or i < 0:
        signs[surfaces.sign[k]] = 0.0
    else:
        mode[i] = kept


def solve(matrix: list[Vector], count: int, out: Vector, most: float) -> None:
    """Solve a small linear system, right side in the last column; values end at a largest one."""
    for c in range(count):
        best = c
        for r in range(c + 1, count):
            if abs(matrix[r][c]) > abs(matrix[best][c]):
                best = r
        if best != c:
            for j in range(count + 1):
                swapped = matrix[c][j]
                matrix[c][j] = matrix[best][j]
                matrix[best][j] = swapped
        pivot = matrix[c][c]
        if pivot != 0.0:
            for r in range(c + 1, count):
                factor = matrix[r][c] / pivot
                for j in range(c, count + 1):
                    matrix[r][j] -= factor * matrix[c][j]
    for back in range(count):
        r = count - 1 - back
        row = matrix[r]
        rest = row[count]
        for c in range(r + 1, count):
            rest -= row[c] * out[c]
        if row[r] != 0.0:
            out[r] = min(max(rest / row[r], -most), most)
        else:  # the sign has no effect on it
            out[r] = 0.0 if rest == 0.0 else most


def flow_on(t: float, y: Vector, mode: list[int], held: Vector, on: Held, dy: Vector) -> None:
    """Fill dy, along the surfaces if the motion slides on some; usable as a flow.

    Parameters
    ----------
    t, y, mode, held, dy
        As for a flow.
    on : Held
        The system, as the parameters.
    """
    if len(on.sliding.which) == 0 or on.sliding.count == 0:
        on.functions.flow(t, y, mode, held, on.functions.p, dy)
    else:
        slope_on(on, t, y, mode, dy)


def margins_on(
    t: float, y: Vector, mode: list[int], on: Held, watch: list[int], out: Vector
) -> None:
    """Fill the watched margins and, after them, 1 - sigma and 1 + sigma of each sliding surface.

    Parameters
    ----------
    t, y, mode, watch, out
        As for margins.
    on : Held
        The system, as the parameters.
    """
    on.functions.margins(t, y, mode, on.functions.p, watch, out)
    sliding, sigma = on.sliding, on.sliding.sigma
    if len(sigma) > 0 and sliding.count > 0:
        slope_on(on, t, y, mode, sliding.slope)
        first = len(watch) - 2 * len(sigma)
        for c in range(sliding.count):
            out[first + 2 * c] = 1.0 - sigma[c]
            out[first + 2 * c + 1] = 1.0 + sigma[c]


def follow_on(t: float, y: Vector, mode: list[int], held: Vector, on: Held) -> None:
    """Set the components of y that others determine.

    Parameters
    ----------
    t, y, mode, held
        As for `Functions.follow`.
    on : Held
        The system, as the parameters.
    """
    on.functions.follow(t, y, mode, held, on.functions.p)


def arm_on(on: Held, t: float, y: Vector, mode: list[int], watch: list[int]) -> None:
    """Hold signs, and flag relations to watch: on a machine's surface those of both its modes.

    Parameters
    ----------
    on, t, y, mode
        As for a slope.
    watch : list of int
        Flags are added.
    """
    arm, p, surfaces = on.functions.arm, on.functions.p, on.sliding.surfaces
    arm(t, y, mode, p, on.held, watch)
    if len(surfaces.rise) > 0:
        for c in range(on.sliding.count):
            k = on.sliding.which[c]
            i = surfaces.machine[k]
            if i >= 0:
                kept = mode[i]
                mode[i] = other_mode(surfaces, k, kept)
                arm(t, y, mode, p, on.held, watch)
                mode[i] = kept


def other_mode(surfaces: Surfaces, k: int, mode: int) -> int:
    """Return the mode on the other side of a machine's surface."""
    return surfaces.upper[k] if mode == surfaces.lower[k] else surfaces.lower[k]


# --------------------------------------------------------------------------- observing
def look(
    observe: Callable[..., Any], on: Held, t: float, y: Vector, mode: list[int], out: Vector
) -> None:
    """Observe a state: with live signs, but with sigmas on sliding surfaces.

    Parameters
    ----------
    observe : callable
        ``observe(t, y, mode, signs, p, out)``; a sign equal to `LIVE` is evaluated live.
    on : Held
        The system, and what it slides on; the held signs other than those are filled.
    t, y, mode
        Passed on to `observe`.
    out : list of float
        Filled.
    """
    p, sliding = on.functions.p, on.sliding
    live, surfaces, which = sliding.live, sliding.surfaces, sliding.which
    if len(which) == 0 or sliding.count == 0:
        observe(t, y, mode, live, p, out)
    else:
        arm_on(on, t, y, mode, sliding.watch)
        slope_on(on, t, y, mode, sliding.slope)
        to_neither(sliding, live)
        _combine(observe, on, t, y, mode, live, False, out)
        for c in range(sliding.count):
            if surfaces.machine[which[c]] < 0:
                live[surfaces.sign[which[c]]] = LIVE


def look_held(
    observe: Callable[..., Any], on: Held, t: float, y: Vector, mode: list[int], out: Vector
) -> None:
    """Observe a state with the signs as they are held, and with the shares of machines' modes.

    Parameters
    ----------
    observe, on, t, y, mode, out
        As in `look`.
    """
    machines, surfaces = False, on.sliding.surfaces
    for c in range(on.sliding.count):
        machines = machines or surfaces.machine[on.sliding.which[c]] >= 0
    if len(surfaces.rise) > 0 and machines:
        slope_on(on, t, y, mode, on.sliding.slope)
        _combine(observe, on, t, y, mode, on.held, True, out)
    else:
        observe(t, y, mode, on.held, on.functions.p, out)


def _combine(
    observe: Callable[..., Any],
    on: Held,
    t: float,
    y: Vector,
    mode: list[int],
    signs: Vector,
    only_machines: bool,
    out: Vector,
) -> None:
    """Observe both sides of the surfaces slid on, and combine them by the sigmas of the slope."""
    p, sliding, surfaces = on.functions.p, on.sliding, on.sliding.surfaces
    which, sigma = sliding.which, sliding.sigma
    upper, lower = sliding.seen_upper, sliding.seen_lower
    count = 0
    for c in range(sliding.count):
        if surfaces.machine[which[c]] >= 0 or not only_machines:
            count += 1
    if count == 1:
        for j in range(len(out)):
            out[j] = 0.0
    else:
        observe(t, y, mode, signs, p, out)
        for j in range(len(out)):
            out[j] = (1.0 - count) * out[j]
    for c in range(sliding.count):
        if surfaces.machine[which[c]] >= 0 or not only_machines:
            share = min(max(sigma[c], -1.0), 1.0)
            kept = go_to(surfaces, which[c], 1.0, signs, mode)
            observe(t, y, mode, signs, p, upper)
            go_to(surfaces, which[c], -1.0, signs, mode)
            observe(t, y, mode, signs, p, lower)
            go_back(surfaces, which[c], kept, signs, mode)
            for j in range(len(out)):
                a, b = upper[j], lower[j]
                out[j] += 0.5 * (a + b) + share * (0.5 * (a - b))
