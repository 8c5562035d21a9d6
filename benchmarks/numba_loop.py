"""The loop of c_loop.c written by hand for numba: pulled mass and open loop.

The same method, tolerances, stops and checks in the same order. The numbers of the case are frozen
into the code when it is compiled, which takes some ten seconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from rivals import EDGES, Array, Case, Outcome

__all__ = ["numba_loop"]

X, V = 4, 5  # in y, after z
A = np.array(
    [
        [0.2, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
NODES = (0.2, 0.3, 0.8, 8 / 9, 1.0, 1.0)
E = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
BUMP = (
    -12715105075 / 11282082432,
    0.0,
    87487479700 / 32700410799,
    -10690763975 / 1880347072,
    701980252875 / 199316789632,
    -1453857185 / 822651844,
    69997945 / 29380423,
)


# Long because numba compiles closures together, with the case's numbers as constants.
def _loop(
    case: Case, rtol: float = 1e-6, atol: float = 1e-9
) -> Callable[[Array, Array, np.ndarray], int]:
    """Return ``run(rows, times, what)``, which fills its arguments and counts transitions."""
    K, SIGMA, C, W = (tuple(each.tolist()) for each in (case.k, case.sigma, case.C, case.w))
    SIGMA_2, F_C, RISE, V_S, V_C = case.sigma_2, case.F_c, case.F_s - case.F_c, case.v_s, case.v_c
    T_END, V_DIP, OPEN = case.t_end, 6.1 * case.v_s, bool(case.signal)
    H_START, OMEGA, LEAST = (0.01 if OPEN else 0.03), 2 * math.pi / 20, 1e-10
    loop: Any = njit(inline="always", error_model="numpy")

    @loop
    def velocity(t, y):
        return 0.2 * math.sin(OMEGA * t) if OPEN else y[V]

    @loop
    def acceleration(t, f):
        return 0.2 * OMEGA * math.cos(OMEGA * t) if OPEN else f[V]

    @loop
    def stribeck(v):
        if abs(v) > V_DIP:
            return F_C
        u = v / V_S
        return F_C + RISE * math.exp(-(u * u))

    @loop
    def flow(arc, slips, t, v, y, f):
        S, share = 0.0, 0.0
        if slips:
            S = stribeck(v)
            share = 1.0 / S
        F = SIGMA_2 * v
        for i in range(4):
            f[i] = arc[0, i] * v + arc[1, i] - arc[2, i] * y[i] * share
            F += K[i] * y[i] + SIGMA[i] * f[i]
        f[X] = v
        f[V] = 0.0 if OPEN else 2.0 * (0.1 * t - y[X]) - F
        return S

    @loop
    def at(dense, theta, y):
        rest = 1.0 - theta
        for j in range(6):
            u = dense[3, j] + rest * dense[4, j]
            y[j] = dense[0, j] + theta * (dense[1, j] + rest * (dense[2, j] + theta * u))

    @loop
    def fire(state, t, v, y, count, times, what):
        S = stribeck(v)
        for i in range(4):
            s = W[i] * S
            edge = -1
            if state[i] == 0:
                if y[i] >= s and v > V_C:
                    edge = 0
                elif y[i] <= -s and v < -V_C:
                    edge = 1
            elif abs(v) <= V_C and abs(y[i]) < s:
                edge = 2
            if edge >= 0:
                state[i] = 0 if edge == 2 else 1
                times[count] = t
                what[count] = 3 * i + edge
                count += 1
        return count

    @loop
    def arm(arc, state, watch, zone, v, y):
        S, sign = stribeck(v), 1.0 * (v > 0.0) - 1.0 * (v < 0.0)
        slips = any_z = pinned = False
        for i in range(4):
            slip = state[i] == 1
            zone[i] = int(y[i] >= W[i] * S) - int(y[i] <= -W[i] * S)
            arc[0, i] = 0.0 if slip else 1.0
            arc[1, i] = C[i] * sign if slip else 0.0
            arc[2, i] = C[i] / W[i] if slip else 0.0
            slips = slips or slip
            watch[i] = not slip or (abs(v) <= V_C and zone[i] != 0)
            any_z = any_z or watch[i]
            pinned = pinned or (watch[i] and zone[i] != 0)
        speed, low, high = abs(v), -V_DIP, V_DIP
        if speed > V_DIP:
            low, high = np.nextafter(V_DIP, 1.0), np.inf
        elif slips or pinned:
            if speed > V_C:
                low, high = np.nextafter(V_C, 1.0), V_DIP
            elif speed > 0.0:
                low, high = np.nextafter(0.0, 1.0), V_C
            else:
                low = high = 0.0
        if v < 0.0 and low > 0.0:
            low, high = -high, -low
        return slips, any_z, pinned, low, high

    @loop
    def changed(watch, zone, any_z, low, high, S, v, y, g):
        any_changed = not (low <= v <= high)
        g[4] = high - v
        g[5] = v - low
        if any_z:
            for i in range(4):
                s = W[i] * S
                if not watch[i]:
                    g[i] = 1.0
                elif zone[i] != 0:
                    g[i] = zone[i] * y[i] - s
                    any_changed = any_changed or g[i] < 0.0
                else:
                    g[i] = s - abs(y[i])
                    any_changed = any_changed or g[i] <= 0.0
        return any_changed

    plain: Any = njit(error_model="numpy")

    @plain
    def look(dense, theta, t, h, watch, zone, any_z, low, high, y, g):
        at(dense, theta, y)
        v = velocity(t + theta * h, y)
        S = stribeck(v) if any_z else 0.0
        return changed(watch, zone, any_z, low, high, S, v, y, g)

    @plain
    def bracket(dense, left, right, tick, t, h, watch, zone, any_z, low, high, y, g):
        """Shrink the bracket; g: margins at the left end, at the right end, and in between."""
        halve = False
        while right - left > tick:
            width = right - left
            guess = 0.5 * (left + right)
            if not halve:
                guess = right
                for r in range(0 if any_z else 4, 6):
                    if g[1, r] <= 0.0 and g[0, r] > g[1, r]:
                        root = left + width * (g[0, r] / (g[0, r] - g[1, r]))
                        guess = min(guess, root)
            guess = min(max(guess, left + 0.5 * tick), right - 0.5 * tick)
            if look(dense, guess, t, h, watch, zone, any_z, low, high, y, g[2]):
                right = guess
                g[1, :] = g[2]
            else:
                left = guess
                g[0, :] = g[2]
            halve = right - left > 0.5 * width
        return left, right

    @loop
    def suspicious(watch, any_z, pinned, low, high, h, y, y_new, v, v_new, a, a_new, S, S_new):
        over = 0.0 if a * a_new > 0.0 else 0.25 * h * max(abs(a), abs(a_new))
        if over > 0.0 and (max(v, v_new) + over > high or min(v, v_new) - over < low):
            return True
        if not any_z or pinned:
            return any_z
        fastest = max(abs(v), abs(v_new)) + over
        farther = 0.0 if v * v_new > 0.0 else 0.25 * h * fastest
        least = stribeck(fastest) if over > 0.0 else min(S, S_new)
        found = False
        for i in range(4):
            reach = max(abs(y[i]), abs(y_new[i])) + farther
            found = found or (watch[i] and reach >= W[i] * least)
        return found

    @loop
    def put(arc, slips, t, y, row, f):
        v = velocity(t, y)
        flow(arc, slips, t, v, y, f)
        F = SIGMA_2 * v
        for i in range(4):
            row[3 + i] = y[i]
            F += K[i] * y[i] + SIGMA[i] * f[i]
        row[0], row[1], row[2], row[7] = t, y[X], v, F

    @plain
    def run(rows, times, what):
        y, y_new, f, seen = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6)
        k, dense, g, last = np.zeros((7, 6)), np.zeros((5, 6)), np.zeros((3, 6)), np.zeros(6)
        arc, state = np.zeros((3, 4)), np.zeros(4, np.int64)
        watch, zone = np.zeros(4, np.bool_), np.zeros(4, np.int64)
        wanted = len(rows) if len(rows) > 1 else 0
        spacing = T_END / (wanted - 1) if wanted else 0.0
        t, count, row = 0.0, 0, 0
        while t < T_END:
            v, h = velocity(t, y), H_START
            count = fire(state, t, v, y, count, times, what)
            slips, any_z, pinned, low, high = arm(arc, state, watch, zone, v, y)
            S = stribeck(v)
            flow(arc, slips, t, v, y, k[0])
            a = acceleration(t, k[0])
            changed(watch, zone, any_z, low, high, S, v, y, g[0])
            before, rejected, redone, crossed = -13.0, False, False, False
            while not crossed and t < T_END:
                t_new = t + h
                if t_new + 1e-13 >= T_END:
                    t_new = T_END
                    h = T_END - t
                S_new, v_new = S, v
                for stage in range(6):
                    for j in range(6):
                        total = A[stage, 0] * k[0, j]
                        for i in range(1, stage + 1):
                            total += A[stage, i] * k[i, j]
                        y_new[j] = y[j] + h * total
                    t_stage = t + NODES[stage] * h if stage < 4 else t_new
                    v_new = velocity(t_stage, y_new)
                    S_new = flow(arc, slips, t_stage, v_new, y_new, k[stage + 1])
                worst = 0.0
                for j in range(6):
                    error = 0.0
                    for i in range(7):
                        error += E[i] * k[i, j]
                    allowed = atol + rtol * max(abs(y[j]), abs(y_new[j]))
                    worst = max(worst, abs(h * error) / allowed)
                size = math.log2(max(worst, LEAST))
                if not worst <= 1.0:
                    h *= max(0.2, 0.9 * 2.0 ** (-0.2 * size))
                    rejected = True
                    if not h > 1e-14:
                        return -1
                    continue
                factor = max(0.2, 0.9 * 2.0 ** (0.08 * before - 0.14 * size))
                h_next = h * min(1.0 if rejected else 10.0, factor)
                before, rejected = max(size, -13.0), False

                if any_z and not slips:
                    S_new = stribeck(v_new)
                a_new, theta = acceleration(t_new, k[6]), 1.0
                crossed = changed(watch, zone, any_z, low, high, S_new, v_new, y_new, g[1])
                doubt = crossed or suspicious(
                    watch, any_z, pinned, low, high, h, y, y_new, v, v_new, a, a_new, S, S_new
                )
                if doubt or (row < wanted and row * spacing < t_new):
                    for j in range(6):
                        rise = y_new[j] - y[j]
                        bend = h * k[0, j] - rise
                        bump = 0.0
                        for i in range(7):
                            bump += BUMP[i] * k[i, j]
                        dense[0, j], dense[1, j], dense[2, j] = y[j], rise, bend
                        dense[3, j], dense[4, j] = rise - h * k[6, j] - bend, h * bump
                if doubt:
                    tick, left, quiet = 2e-14 / h, 0.0, 1.0
                    last[:] = g[1]
                    if crossed:
                        left, found = bracket(
                            dense, 0.0, 1.0, 0.01, t, h, watch, zone, any_z, low, high, seen, g
                        )
                        if found < 0.9 and not redone:  # the stages lay far beyond: repeat the step
                            h *= 1.01 * found
                            redone, crossed = True, False
                            changed(watch, zone, any_z, low, high, S, v, y, g[0])
                            continue
                        quiet, theta = bracket(
                            dense, left, found, tick, t, h, watch, zone, any_z, low, high, seen, g
                        )
                        at(dense, quiet, seen)
                        t_low = t + quiet * h
                        v_low = velocity(t_low, seen)
                        S_low = flow(arc, slips, t_low, v_low, seen, f)
                        if any_z and not slips:
                            S_low = stribeck(v_low)
                        a_low = acceleration(t_low, f)
                        doubt = suspicious(
                            watch, any_z, pinned, low, high, quiet * h, y, seen, v, v_low, a, a_low,
                            S, S_low,
                        )  # fmt: skip
                    while doubt:  # is there an earlier one?
                        changed(watch, zone, any_z, low, high, S, v, y, g[0])
                        left, found = 0.0, -1.0
                        for i in range(1, 16):
                            point = quiet * i / 16
                            if look(dense, point, t, h, watch, zone, any_z, low, high, seen, g[2]):
                                g[1, :] = g[2]
                                found = point
                                break
                            g[0, :] = g[2]
                            left = point
                        if found < 0.0:
                            break
                        crossed = True
                        quiet, theta = bracket(
                            dense, left, found, tick, t, h, watch, zone, any_z, low, high, seen, g
                        )
                    if not crossed:
                        g[1, :] = last
                redone = False
                if crossed:
                    t_new = t + theta * h
                while row < wanted and row * spacing < t_new:
                    time = row * spacing
                    at(dense, (time - t) / h, seen)
                    put(arc, slips, time, seen, rows[row], f)
                    row += 1
                if crossed:
                    at(dense, theta, y)
                else:
                    y[:] = y_new
                    k[0, :] = k[6]
                    g[0, :] = g[1]
                t, v, S, a, h = t_new, v_new, S_new, a_new, h_next
        v = velocity(t, y)
        count = fire(state, t, v, y, count, times, what)
        slips, any_z, pinned, low, high = arm(arc, state, watch, zone, v, y)
        put(arc, slips, t, y, rows[-1], f)
        return count

    return run


def numba_loop(case: Case) -> Callable[[Array], Outcome]:
    """Return the loop as a callable with the requested times."""
    run = _loop(case)

    def call(times: Array) -> Outcome:
        rows = np.empty((max(times.size, 1), 8))
        t, what = np.empty(4096), np.empty(4096, dtype=np.int64)
        count = run(rows, t, what)
        edge = [EDGES[i] for i in (what[:count] % 3).tolist()]
        return Outcome(t[:count], what[:count] // 3, edge, rows[:, 3:7])

    return call
