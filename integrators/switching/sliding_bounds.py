"""Start and end of sliding: which surfaces the motion is seized by, and which it leaves.

The rest, how it goes on along them, is in `integrators.sliding`.
"""

from __future__ import annotations

from integrators.advance import tick_at
from integrators.crossings import FOR_A_SIGN, Watched
from integrators.sliding import (
    BEYOND,
    Held,
    Sliding,
    Surfaces,
    flow_on,
    go_back,
    go_to,
    slope_on,
    to_neither,
)
from integrators.steps import Now, Vector, time_of

ROUNDING = 2.0**-52  # of a sum, relative to its terms
SMALLEST = 1e-300  # distance to move where all terms are 0
NEGLIGIBLE, NEARLY = 0.01, 1e-12  # a jump: more than this of an absolute tolerance, and of y
CLEARLY = 1e-9  # not just by rounding
BRACKETS = 4.0  # ticks: so much before a crossing, it has not happened yet
BRACKET = 2.0**-48  # of the time and of the end: a crossing is located to less
FOR_A_SURFACE = 8  # why a relation is evaluated, as a bit besides those of `crossings`
PUSHES = 500  # attempts to leave a surface to one side, each four times as far as the one before


def own_edge(surfaces: Surfaces, k: int, mode: int) -> int:
    """Return the edge that leads from a mode across a machine's surface."""
    return surfaces.rise[k] if mode == surfaces.lower[k] else surfaces.fall[k]


def drop(sliding: Sliding, k: int) -> None:
    """Stop sliding on a surface."""
    which, count = sliding.which, sliding.count
    sliding.flags[k] = 0
    for c in range(count):
        if which[c] == k:
            which[c] = which[count - 1]
            which[count - 1] = k
            sliding.count = count - 1


def release(on: Held, now: Now, w: Watched, k: int, side: float) -> None:
    """Leave a machine's surface to one side: y moves there by as little as is needed to tell.

    The edge to the mode of that side is then enabled, and the one back is not.
    """
    t, y, mode = time_of(now), now.y, now.mode
    g, p = on.sliding.upper, on.functions.p
    above, size, probe = on.sliding.surfaces.above[k], len(y), w.search.probe
    on.functions.normal(k, t, y, mode, p, g)
    square, large = 0.0, 0.0
    for j in range(size):
        square += g[j] * g[j]
        large += abs(g[j] * y[j])
    flag = w.watch[above]
    w.watch[above] = FOR_A_SIGN
    on.functions.margins(t, y, mode, p, w.watch, probe)
    push = max(abs(probe[above]), ROUNDING * large, SMALLEST)
    tries = PUSHES if square > 0.0 else 0
    while tries > 0 and not (probe[above] > 0.0 if side > 0.0 else probe[above] < 0.0):
        for j in range(size):
            step = g[j] * (push / square)
            y[j] += step if side > 0.0 else -step
        on.functions.margins(t, y, mode, p, w.watch, probe)
        push *= 4.0
        tries -= 1
    w.watch[above] = flag
    on.sliding.arrived[k] = -1


def entangled(on: Held, t: float, y: Vector, mode: list[int]) -> bool:
    """Return whether machines slide on surfaces that bear on each other, or on that of a sign."""
    which, machine = on.sliding.which, on.sliding.surfaces.machine
    found = False
    for r in range(on.sliding.count):
        for c in range(on.sliding.count):
            if r != c and (machine[which[r]] >= 0 or machine[which[c]] >= 0):
                found = found or _bears(on, t, y, mode, r, c)
    return found


def _bears(on: Held, t: float, y: Vector, mode: list[int], r: int, c: int) -> bool:
    """Return whether the sides of one surface slid on differ in the slope across another."""
    flow, surfaces, p, held = on.functions.flow, on.sliding.surfaces, on.functions.p, on.held
    upper, lower, g = on.sliding.upper, on.sliding.lower, on.sliding.normals[r]
    here, other = on.sliding.which[r], on.sliding.which[c]
    to_neither(on.sliding, held)
    on.functions.normal(here, t, y, mode, p, g)
    found = False
    for side in (1.0, -1.0):
        kept = go_to(surfaces, here, side, held, mode)
        before = go_to(surfaces, other, 1.0, held, mode)
        flow(t, y, mode, held, p, upper)
        go_to(surfaces, other, -1.0, held, mode)
        flow(t, y, mode, held, p, lower)
        go_back(surfaces, other, before, held, mode)
        go_back(surfaces, here, kept, held, mode)
        change = 0.0
        for j in range(len(y)):
            change += g[j] * (upper[j] - lower[j])
        found = found or change != 0.0
    return found


def repels(on: Held, now: Now, w: Watched) -> bool:
    """Find a surface that is met exactly and from which the flows on both sides lead away.

    If there is one, it is left as the only one slid on.
    """
    t, y, mode = time_of(now), now.y, now.mode
    sliding, surfaces = on.sliding, on.sliding.surfaces
    slope, half, g = sliding.slope, sliding.halves[0], sliding.normals[0]
    found = False
    for k in range(len(surfaces.sign)):
        above = surfaces.above[k]
        if not found and surfaces.machine[k] < 0 and w.watch[above] and w.start[above] == 0.0:
            kept = on.held[surfaces.sign[k]]
            sliding.which[0] = k
            sliding.count = 1
            slope_on(on, t, y, mode, slope)
            on.held[surfaces.sign[k]] = kept
            size = 0.0
            for j in range(len(y)):
                size += abs(g[j]) * (abs(slope[j]) + abs(half[j]))
            gain = sliding.gains[0]
            found = gain > CLEARLY * size and abs(sliding.sigma[0]) < 1.0 - CLEARLY
    if not found:
        sliding.count = 0
    return found


def seize(on: Held, now: Now, w: Watched) -> bool:
    """Choose the surfaces to slide on from here, and put y onto them.

    They are candidates that were slid on, have just been reached, or are met exactly. One that does
    not attract, or whose sigma lies beyond 1, is released again: its sign is that of the side to
    which the flow leads.
    """
    t, y, mode = time_of(now), now.y, now.mode
    held, sliding, surfaces = on.held, on.sliding, on.sliding.surfaces
    which, sigma, rates, gains = sliding.which, sliding.sigma, sliding.rates, sliding.gains
    most, size = len(sigma), len(y)
    if len(surfaces.rise) > 0:
        for k in range(len(surfaces.sign)):
            if surfaces.machine[k] >= 0 and sliding.arrived[k] == 1 and _is_far(on, now, w, k):
                sliding.arrived[k] = 0
    count = 0
    for k in range(len(surfaces.sign)):
        above, i = surfaces.above[k], surfaces.machine[k]
        met = sliding.flags[k] == 1 or sliding.arrived[k] == 1
        if len(surfaces.rise) == 0 or i < 0:
            met = met or w.start[above] == 0.0
        else:
            met = met and (mode[i] == surfaces.upper[k] or mode[i] == surfaces.lower[k])
            for c in range(count):  # two of one machine exclude each other
                met = met and surfaces.machine[which[c]] != i
        sliding.arrived[k] = 0
        if w.watch[above] and met and count < most:
            which[count] = k
            count += 1
    candidates = count
    while count > 0:
        sliding.count = count
        slope_on(on, t, y, mode, sliding.slope)
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
        if len(surfaces.rise) == 0 or surfaces.machine[k] < 0:
            held[surfaces.sign[k]] = _sign(pushed if u == 0.0 or sliding.flags[k] == 1 else u)
        elif sliding.flags[k] == 1 and pushed != 0.0:
            release(on, now, w, k, pushed)
        count -= 1
        which[worst], which[count] = which[count], k
    sliding.count = count
    if candidates > count:
        dy, g = sliding.slope, rates
        flow_on(t, y, mode, held, on, dy)
        for c in range(count, candidates):
            if surfaces.machine[which[c]] >= 0:
                continue
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
        u, g, square = w.start[surfaces.above[which[c]]], sliding.normals[c], 0.0
        for j in range(size):
            square += g[j] * g[j]
        if u != 0.0 and square > 0.0:
            for j in range(size):
                y[j] -= g[j] * (u / square)
    return changed


def _is_far(on: Held, now: Now, w: Watched, k: int) -> bool:
    """Return whether a machine took an edge of a surface elsewhere, after a jump or at the start.

    Near are what it covers in the time to which crossings are located, and an absolute tolerance.
    """
    sliding = on.sliding
    sliding.which[0] = k
    sliding.count = 1
    slope_on(on, time_of(now), now.y, now.mode, sliding.slope)
    fastest = abs(sliding.rates[0]) + abs(sliding.gains[0])
    located = BRACKET * (abs(now.t) + now.latest)
    u, g, square, far = w.start[sliding.surfaces.above[k]], sliding.normals[0], 0.0, False
    for j in range(len(now.y)):
        square += g[j] * g[j]
    for j in range(len(now.y)):
        far = far or abs(g[j] * u) > (now.floor[j] + NEARLY * abs(now.y[j])) * square
    return far and abs(u) > fastest * located


def _sign(u: float) -> float:
    if u > 0.0:
        return 1.0
    return -1.0 if u < 0.0 else 0.0


def look_back(on: Held, now: Now, w: Watched) -> None:
    """Keep where the surfaces slid on are before something may jump; see `let_go`."""
    if len(on.sliding.which) > 0 and on.sliding.count > 0:
        _values(on, now, w)
        for k in range(len(on.sliding.before)):
            on.sliding.before[k] = w.search.probe[on.sliding.surfaces.above[k]]


def let_go(on: Held, now: Now, w: Watched) -> None:
    """Stop sliding on surfaces that have jumped away, or from which the state has."""
    if len(on.sliding.which) > 0 and on.sliding.count > 0:
        sliding, y = on.sliding, now.y
        g = sliding.upper
        _values(on, now, w)
        for k in range(len(sliding.flags)):
            jump = w.search.probe[sliding.surfaces.above[k]] - sliding.before[k]
            if sliding.flags[k] == 1 and jump != 0.0:
                on.functions.normal(k, time_of(now), y, now.mode, on.functions.p, g)
                square, far = 0.0, False
                for j in range(len(y)):
                    square += g[j] * g[j]
                for j in range(len(y)):
                    least = NEGLIGIBLE * now.floor[j] + NEARLY * abs(y[j])
                    far = far or abs(g[j] * jump) > least * square
                if far:
                    drop(sliding, k)


def _values(on: Held, now: Now, w: Watched) -> None:
    """Evaluate the surfaces slid on, which are not watched meanwhile, into ``w.search.probe``."""
    which, above = on.sliding.which, on.sliding.surfaces.above
    for c in range(on.sliding.count):
        w.watch[above[which[c]]] |= FOR_A_SURFACE
    on.functions.margins(time_of(now), now.y, now.mode, on.functions.p, w.watch, w.search.probe)
    for c in range(on.sliding.count):
        w.watch[above[which[c]]] &= FOR_A_SURFACE - 1


def leave(on: Held, now: Now, relations: Watched, left: int) -> None:
    """Stop sliding on a machine's surface, on the side of its other mode."""
    surfaces = on.sliding.surfaces
    mode = now.mode[surfaces.machine[left]]
    drop(on.sliding, left)
    release(on, now, relations, left, 1.0 if mode == surfaces.lower[left] else -1.0)


def let_go_in_time(on: Held, now: Now, relations: Watched) -> None:
    """Stop sliding on surfaces that have moved with the crossing just located: a sign of time."""
    t = now.t
    now.t = t - BRACKETS * tick_at(t)
    look_back(on, now, relations)
    now.t = t
    let_go(on, now, relations)


def crossed(sliding: Sliding, machine: int, edge: int) -> None:
    """Note that an edge leads onto a machine's surface, or away from it."""
    surfaces = sliding.surfaces
    for k in range(len(surfaces.rise)):
        if surfaces.machine[k] == machine:
            if edge == surfaces.rise[k] or edge == surfaces.fall[k]:
                sliding.arrived[k] = min(sliding.arrived[k] + 1, 1)
            elif sliding.flags[k] == 1:
                drop(sliding, k)
