"""Motion along a surface where the flow jumps and pushes back from both sides (Filippov).

A surface is u(t, y) = 0, and the flow depends on the sign of u. Where the flow on either side leads
onto the surface, the solution continues along it, with the sign replaced by a number sigma from -1
to 1 such that du/dt = 0. It leaves where sigma reaches 1 or -1. Flows that are not linear in the
sign are combined as Filippov does: the mean of both sides plus sigma times half their difference,
which is the same where they are linear.

Sliding on several surfaces at once takes as many sigmas, from a linear system of that size.

Alternatives considered: letting the sign chatter costs one switch per clock tick; smoothing it by a
steep ramp changes the solution and makes the system stiff.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from integrators.crossings import Watched
from integrators.steps import Flow, Margins, Now, T, Vector

__all__ = [
    "LIVE",
    "MOST_SLIDING",
    "Functions",
    "Held",
    "Sliding",
    "Surfaces",
    "flow_on",
    "look",
    "margins_on",
    "seize",
    "sliding_scratch",
    "slope_on",
]

MOST_SLIDING = 32  # surfaces at once
LIVE = 2.0  # in place of a held sign: evaluate the sign live
BEYOND = 2.0  # sigma is clipped here: above 1 only the fact matters
# Rows of the scratch table after three per surface (its gradient over y and rate in t; half the
# difference of both sides; its row of the linear system): du/dt with all their signs 0, the
# response of du/dt to its own sign, flow and observed values on either side, a slope.
RATES, GAINS, UPPER, LOWER, SEEN_UPPER, SEEN_LOWER, SLOPE = range(7)
NORMAL, COLUMN, MATRIX = range(3)


class Functions(NamedTuple):
    """The functions of a system, and their parameters."""

    flow: Flow
    arm: Callable[..., Any]  # arm(t, y, mode, p, held, watch): signs to hold, relations to watch
    margins: Margins
    normal: Callable[..., Any]  # normal(surface, t, y, mode, p, out): gradient over y, rate in t
    p: Any


class Surfaces(NamedTuple):
    """The surfaces on which the motion can slide."""

    sign: list[int]  # the index of each one's sign among the held signs, shape (S,)
    above: list[int]  # its relation u > 0, shape (S,)
    at_least: list[int]  # its relation u >= 0, shape (S,)


class Sliding(NamedTuple):
    """The surfaces on which the motion slides, with scratch space."""

    surfaces: Surfaces
    which: list[int]  # the sliding surfaces; their number in the last entry, (MOST_SLIDING + 1,)
    sigma: Vector  # replaces their signs, shape (MOST_SLIDING,)
    table: list[Vector]  # scratch space, see the rows above
    flags: list[int]  # whether the motion slides on each, shape (S,)
    arrived: list[int]  # whether each has just been reached, shape (S,)
    live: Vector  # signs, all set to LIVE
    watch: list[int]  # unused flags, shape (r,)


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

    Returns
    -------
    Sliding
        Made of lists.
    """
    number = len(surfaces.sign)
    most = min(number, MOST_SLIDING)
    on = [k for k, flag in enumerate(flags) if flag]
    width = max(size + 1, most + 1, seen) if most else 0
    return Sliding(
        surfaces=surfaces,
        which=on + [0] * (most - len(on)) + [len(on)],
        sigma=[0.0] * most,
        table=[[0.0] * width for _ in range(3 * most + 7)],
        flags=list(flags) or [0] * number,
        arrived=[0] * number,
        live=[LIVE] * signs,
        watch=[0] * relations,
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
    held, sign = on.held, on.sliding.surfaces.sign
    which, sigma, table = on.sliding.which, on.sliding.sigma, on.sliding.table
    most = len(sigma)
    count = which[most]
    size = len(y)
    first = 3 * most
    rates, gains = table[first + RATES], table[first + GAINS]
    upper, lower = table[first + UPPER], table[first + LOWER]
    for c in range(count):
        held[sign[which[c]]] = 0.0
    # A mean that is exact for any sum of functions of one sign each.
    if count == 1:
        for j in range(size):
            dy[j] = 0.0
    else:
        flow(t, y, mode, held, p, dy)
        for j in range(size):
            dy[j] = (1.0 - count) * dy[j]
    for c in range(count):
        k = sign[which[c]]
        held[k] = 1.0
        flow(t, y, mode, held, p, upper)
        held[k] = -1.0
        flow(t, y, mode, held, p, lower)
        held[k] = 0.0
        column = table[COLUMN * most + c]
        for j in range(size):
            dy[j] += 0.5 * (upper[j] + lower[j])
            column[j] = 0.5 * (upper[j] - lower[j])
    for r in range(count):
        g, row = table[NORMAL * most + r], table[MATRIX * most + r]
        normal(which[r], t, y, mode, p, g)
        rate = g[size]
        for j in range(size):
            rate += g[j] * dy[j]
        row[count] = -rate
        for c in range(count):
            column = table[COLUMN * most + c]
            gain = 0.0
            for j in range(size):
                gain += g[j] * column[j]
            row[c] = gain
        rates[r], gains[r] = rate, row[r]
    _solve(table, MATRIX * most, count, sigma)
    for c in range(count):
        held[sign[which[c]]] = sigma[c]
        column = table[COLUMN * most + c]
        for j in range(size):
            dy[j] += sigma[c] * column[j]
    # Nothing normal to the surface, not even by rounding: v itself does not move. Nor where sigma
    # is clipped, past the end of the slide: a step may end there, and guards are read before it.
    for r in range(count):
        g = table[NORMAL * most + r]
        rate, square = g[size], 0.0
        for j in range(size):
            rate += g[j] * dy[j]
            square += g[j] * g[j]
        if square > 0.0:
            for j in range(size):
                dy[j] -= g[j] * (rate / square)


def _solve(table: list[Vector], first: int, count: int, out: Vector) -> None:
    """Solve a small linear system, right side in the last column; clip large values."""
    for c in range(count):
        best = c
        for r in range(c + 1, count):
            if abs(table[first + r][c]) > abs(table[first + best][c]):
                best = r
        if best != c:
            for j in range(count + 1):
                swapped = table[first + c][j]
                table[first + c][j] = table[first + best][j]
                table[first + best][j] = swapped
        pivot = table[first + c][c]
        if pivot != 0.0:
            for r in range(c + 1, count):
                factor = table[first + r][c] / pivot
                for j in range(c, count + 1):
                    table[first + r][j] -= factor * table[first + c][j]
    for back in range(count):
        r = count - 1 - back
        row = table[first + r]
        rest = row[count]
        for c in range(r + 1, count):
            rest -= row[c] * out[c]
        if row[r] != 0.0:
            out[r] = min(max(rest / row[r], -BEYOND), BEYOND)
        else:  # the sign has no effect on it
            out[r] = 0.0 if rest == 0.0 else BEYOND


def flow_on(t: float, y: Vector, mode: list[int], held: Vector, on: Held, dy: Vector) -> None:
    """Fill dy, along the surfaces if the motion slides on some; usable as a flow.

    Parameters
    ----------
    t, y, mode, held, dy
        As for a flow.
    on : Held
        The system, as the parameters.
    """
    if on.sliding.which[-1] == 0:
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
    which, sigma, table = on.sliding.which, on.sliding.sigma, on.sliding.table
    count, most = which[-1], len(sigma)
    if count == 0:
        return
    slope_on(on, t, y, mode, table[3 * most + SLOPE])
    first = len(watch) - 2 * most
    for c in range(count):
        out[first + 2 * c] = 1.0 - sigma[c]
        out[first + 2 * c + 1] = 1.0 + sigma[c]


# --------------------------------------------------------------------------- start, end of sliding
def seize(on: Held, now: Now, w: Watched) -> bool:
    """Choose the surfaces to slide on from here, and put y onto them.

    They are candidates that were slid on, have just been reached, or are met exactly. One that does
    not attract, or whose sigma lies beyond 1, is released again: its sign is that of the side to
    which the flow leads.

    Parameters
    ----------
    on : Held
        The system, and what it slides on; the held signs of candidates are set.
    now : Now
        The state of the run; y is moved onto the surfaces, which it left only by rounding.
    w : Watched
        Armed, with ``w.start`` filled with margins.

    Returns
    -------
    bool
        Whether the set of sliding surfaces has changed.
    """
    t, y, mode = now.clock[T], now.y, now.mode
    held, sliding, surfaces = on.held, on.sliding, on.sliding.surfaces
    which, sigma, table = sliding.which, sliding.sigma, sliding.table
    most, size = len(sigma), len(y)
    rates, gains = table[3 * most + RATES], table[3 * most + GAINS]
    count = 0
    for k in range(len(surfaces.sign)):
        above = surfaces.above[k]
        met = sliding.flags[k] == 1 or sliding.arrived[k] == 1 or w.start[above] == 0.0
        sliding.arrived[k] = 0
        if w.watch[above] and met and count < most:
            which[count] = k
            count += 1
    candidates = count
    while count > 0:
        which[most] = count
        slope_on(on, t, y, mode, table[3 * most + SLOPE])
        worst, excess = -1, 0.0
        for c in range(count):
            beyond = abs(sigma[c]) - 1.0 if gains[c] < 0.0 else BEYOND
            if beyond > excess:
                worst, excess = c, beyond
        if worst < 0:
            break
        k = which[worst]
        u = w.start[surfaces.above[k]]
        pushed = sigma[worst] if gains[worst] < 0.0 else rates[worst]
        held[surfaces.sign[k]] = _sign(pushed if u == 0.0 or sliding.flags[k] == 1 else u)
        count -= 1
        which[worst], which[count] = which[count], k
    which[most] = count
    if candidates > count:
        dy, g = table[3 * most + SLOPE], table[3 * most + RATES]
        flow_on(t, y, mode, held, on, dy)
        for c in range(count, candidates):
            # On a surface on which another one keeps it, for example a mere corner at v = 0 next to
            # sgn(v), it goes to neither side.
            on.functions.normal(which[c], t, y, mode, on.functions.p, g)
            rate = g[size]
            for j in range(size):
                rate += g[j] * dy[j]
            u, square = w.start[surfaces.above[which[c]]], 0.0
            for j in range(size):
                square += g[j] * g[j]
            if rate == 0.0 and u == 0.0:
                held[surfaces.sign[which[c]]] = 0.0
            elif sliding.flags[which[c]] == 1 and square > 0.0:  # left only by accumulated errors
                for j in range(size):
                    y[j] -= g[j] * (u / square)
    changed = False
    for k in range(len(surfaces.sign)):
        slid = 0
        for c in range(count):
            if which[c] == k:
                slid = 1
        changed = changed or slid != sliding.flags[k]
        sliding.flags[k] = slid
    for c in range(count):
        u, g, square = w.start[surfaces.above[which[c]]], table[NORMAL * most + c], 0.0
        for j in range(size):
            square += g[j] * g[j]
        if u != 0.0 and square > 0.0:
            for j in range(size):
                y[j] -= g[j] * (u / square)
    return changed


def _sign(u: float) -> float:
    if u > 0.0:
        return 1.0
    return -1.0 if u < 0.0 else 0.0


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
    live, sign, which = sliding.live, sliding.surfaces.sign, sliding.which
    sigma, table, most = sliding.sigma, sliding.table, len(sliding.sigma)
    count = which[most]
    if count == 0:
        observe(t, y, mode, live, p, out)
        return
    on.functions.arm(t, y, mode, p, on.held, sliding.watch)
    slope_on(on, t, y, mode, table[3 * most + SLOPE])
    upper, lower = table[3 * most + SEEN_UPPER], table[3 * most + SEEN_LOWER]
    for c in range(count):
        live[sign[which[c]]] = 0.0
    if count == 1:
        for j in range(len(out)):
            out[j] = 0.0
    else:
        observe(t, y, mode, live, p, out)
        for j in range(len(out)):
            out[j] = (1.0 - count) * out[j]
    for c in range(count):
        k, share = sign[which[c]], min(max(sigma[c], -1.0), 1.0)
        live[k] = 1.0
        observe(t, y, mode, live, p, upper)
        live[k] = -1.0
        observe(t, y, mode, live, p, lower)
        live[k] = 0.0
        for j in range(len(out)):
            a, b = upper[j], lower[j]
            out[j] += 0.5 * (a + b) + share * (0.5 * (a - b))
    for c in range(count):
        live[sign[which[c]]] = LIVE
