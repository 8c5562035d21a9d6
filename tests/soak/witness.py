"""A slow, hand-written simulation of a GMS bank, to check the reference of `tests.soak.trials`.

It shares no code with the packages: SciPy's DOP853 between points where a flag changes (whether v
is above v_c, below -v_c, of which sign; whether z_i is above s_i, below -s_i), guards as if-else
over those flags, and Filippov sliding written out: v rests at 0, and sigma in [-1, 1] replaces
sgn(v) so that dv/dt = 0. A flag changes at its located root and nowhere else, so that no rounding
at a root can fire a guard twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from gms_fsm import GMS, Prescribed, PulledSlider, Slider
from gms_fsm.systems.signals import Corners, Formula

RTOL = 1e-12
LOOKS = 6  # evaluations of the flags inside a step
NOTHING, LET_GO = -1, -2  # reasons for the end of an arc, besides the flags


@dataclass
class Witnessed:
    """Transitions (t, element, edge), intervals of sliding (t, t), the end, the peak of |v|."""

    transitions: list[tuple[float, int, str]]
    sliding: list[tuple[float, float]]
    x: float
    v: float
    z: np.ndarray
    peak: float


def _signal(given: Any) -> tuple[Callable[[float], float], list[float]]:
    """Return a signal as a function, and the times of its corners."""
    if isinstance(given, Formula):
        code = compile(given.text, "signal", "eval")
        names = {"sin": math.sin, "cos": math.cos, "exp": math.exp, "pi": math.pi}
        return lambda t: float(eval(code, {**names, "t": t})), []
    assert isinstance(given, Corners)
    return lambda t: float(np.interp(t, given.times, given.values)), given.times.tolist()


def witness(model: GMS, rig: Prescribed | Slider | PulledSlider, t_end: float) -> Witnessed:
    """Run a bank from rest (or along its velocity), everything in stick at z = 0."""
    p, n, signed = model.parameters, model.n, model.law == "signed"
    S, k, sigma, C, v_c = p.stribeck, p.k, p.sigma, p.C, p.v_c
    open_loop, corners = isinstance(rig, Prescribed), list[float]()
    if not isinstance(rig, PulledSlider):
        drive, corners = _signal(rig.signals["v" if open_loop else "F_a"])

    def pull(t: float, x: float) -> float:
        return rig.stiffness * (rig.speed * t - x) if isinstance(rig, PulledSlider) else drive(t)

    def v_of(t: float, y: np.ndarray) -> float:
        return drive(t) if open_loop else 0.0 if slides else float(y[1])

    def s_of(v: float) -> np.ndarray:
        return p.weights * (S.F_c + (S.F_s - S.F_c) * math.exp(-((v / S.v_s) ** 2)))

    def slope(t: float, y: np.ndarray, sign: float) -> np.ndarray:
        """Return dy/dt with `sign` in place of sgn(v)."""
        v, z = v_of(t, y), y[2:]
        ratio = z / s_of(v)
        dz = np.where(slip, C * (sign - ratio) if signed else sign * C * (1 - ratio), v)
        F = float(np.sum(k * z + sigma * dz)) + p.sigma_2 * v
        return np.array([v, 0.0 if open_loop else (pull(t, y[0]) - F) / rig.mass, *dz])

    def holding(t: float, y: np.ndarray) -> float:
        """Return the sigma that keeps dv/dt = 0; dv/dt is linear in it."""
        low, high = slope(t, y, -1.0)[1], slope(t, y, 1.0)[1]
        return float((low + high) / (low - high))

    # Watched: v - v_c, v + v_c, v, the rims of the dip, and z - s and z + s.
    def gaps(t: float, y: np.ndarray) -> np.ndarray:
        v, z = v_of(t, y), y[2:]
        s = s_of(v)
        return np.array([v - v_c, v + v_c, v, v - 6 * S.v_s, v + 6 * S.v_s, *(z - s), *(z + s)])

    noise = 1e-11 * np.array([v_c, v_c, v_c, S.v_s, S.v_s, *np.tile(p.weights * S.F_c, 2)])
    size = np.array([np.min(p.weights) * S.F_c, v_c, *(p.weights * S.F_c)])
    slip, slides, t, y = np.zeros(n, dtype=bool), False, 0.0, np.zeros(2 + n)
    turned = NOTHING
    bits = np.sign(gaps(0.0, y))
    said = Witnessed([], [], 0.0, 0.0, y[2:], 0.0)

    def ask() -> None:
        """Fire everything enabled; the flags of v and z are known."""
        over, under = bits[5 : 5 + n] >= 0, bits[5 + n :] <= 0
        fast, back = bits[0] > 0, bits[1] < 0
        arrests = slip & ~over & ~under & (not (fast or back))
        edges = np.select(
            [arrests, ~slip & over & fast, ~slip & under & back],
            ["arrest", "break_away_forward", "break_away_backward"],
            "",
        )
        for i in np.flatnonzero(edges != ""):
            said.transitions.append((t, int(i), str(edges[i])))
            slip[i] = not slip[i]

    while t < t_end:
        ask()
        if slides and not slip.any():  # the last one on the surface has arrested
            slides, said.sliding[-1] = False, (said.sliding[-1][0], t)
        elif not open_loop and slip.any() and (slides or y[1] == 0.0):  # on the surface
            low, high = slope(t, y, -1.0)[1], slope(t, y, 1.0)[1]
            stays = high < 0 < low and turned != LET_GO
            if stays and not slides:
                said.sliding.append((t, t))
            if slides and not stays:
                said.sliding[-1] = (said.sliding[-1][0], t)
            slides, bits[2] = stays, 0.0 if stays else np.sign(low + high)
        stop = min([c for c in corners if c > t] + [t_end])
        sign, turned = float(bits[2]), NOTHING
        solver = DOP853(
            lambda t, y, sign=sign, held=slides: slope(t, y, holding(t, y) if held else sign),
            t,
            y,
            stop,
            rtol=RTOL,
            atol=1e-11 * size,
            max_step=min(t_end / 200, stop - t),
        )
        while solver.status == "running" and turned == NOTHING:
            assert solver.step() is None, f"DOP853 gives up at t = {solver.t}"
            path, before = solver.dense_output(), solver.t_old
            for u in np.linspace(solver.t_old, solver.t, LOOKS + 1)[1:]:
                here = path(u)
                g = gaps(u, here)
                said.peak = max(said.peak, abs(v_of(u, here)))
                new = np.where(np.abs(g) > noise, np.sign(g), bits)
                if slides:
                    new[:5] = bits[:5]
                else:
                    bits = np.where(bits == 0, new, bits)  # started on a root: nothing has changed
                roots = {
                    int(j): _root(lambda w, j=j, path=path: gaps(w, path(w))[j], before, u)
                    for j in np.flatnonzero(new != bits)
                }
                if slides and abs(holding(u, here)) >= 1:
                    roots[LET_GO] = _root(
                        lambda w, path=path: 1 - abs(holding(w, path(w))), before, u
                    )
                if roots:
                    turned = min(roots, key=lambda j: roots[j])
                    t, y = roots[turned], path(roots[turned])
                    break
                before = u
        if turned == NOTHING:
            t, y = solver.t, solver.y
        elif turned != LET_GO:
            bits[turned] = -bits[turned]
        if slides or (turned == 2 and not open_loop):
            y[1] = 0.0
    ask()
    said.x, said.v, said.z = float(y[0]), v_of(t, y), y[2:]
    return said


def _root(g: Callable[[float], float], a: float, b: float) -> float:
    """Return where g changes its sign; a, if rounding hides that it had this sign before."""
    return b if g(b) == 0 else a if g(a) * g(b) >= 0 else float(brentq(g, a, b, xtol=1e-18))
