"""The pulled mass (60 s, rtol 1e-6): gms-fsm's engines against hand-written SciPy.

Rounds are interleaved, because machines change their speed; compare the ratios. The SciPy loop is
what a careful user writes: `solve_ivp(RK45)` with terminal event functions for every guard, and
mode switching between the arcs. Run it with ``make bench``.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from gms_fsm import GMS, GMSParameters, PulledSlider, Stribeck, simulate

T_END = 60.0
K = np.array([40.0, 30.0, 20.0, 10.0])
SIGMA = np.array([0.4, 0.3, 0.2, 0.1])
W, C, SIGMA_2 = 1 / (4 * K), 0.02, 0.4
F_C, F_S, V_S, V_C = 1.0, 1.5, 0.05, 1e-6
STICK, SLIP = 0, 1


def by_hand(rtol: float = 1e-6, atol: float = 1e-9) -> int:
    """Integrate with solve_ivp and events; return the number of transitions."""
    y, t, mode, count = np.zeros(6), 0.0, np.zeros(4, dtype=int), 0

    def threshold(v: float) -> np.ndarray:
        return W * (F_C + (F_S - F_C) * np.exp(-((v / V_S) ** 2)))

    def enabled(y: np.ndarray) -> np.ndarray:
        v, z, s = y[1], y[2:], threshold(y[1])
        away = ((z >= s) & (v > V_C)) | ((z <= -s) & (v < -V_C))
        arrest = (abs(v) <= V_C) & (np.abs(z) < s)
        return np.where(mode == STICK, away, arrest)

    while t < T_END:
        sign = np.sign(y[1])

        def slope(t: float, y: np.ndarray, mode: np.ndarray = mode, sign: float = sign) -> list:
            v, z = y[1], y[2:]
            dz = np.where(mode == STICK, v, C * (sign - z / threshold(v)))
            F = K @ z + SIGMA @ dz + SIGMA_2 * v
            return [v, 2.0 * (0.1 * t - y[0]) - F, *dz]

        # One event function a guard, as most codes do; v_c is its own margin.
        events = []
        for i in np.flatnonzero(mode == STICK):
            events += [
                lambda t, y, i=i: y[2 + i] - threshold(y[1])[i],
                lambda t, y, i=i: y[2 + i] + threshold(y[1])[i],
            ]
        if (mode == SLIP).any():
            events += [lambda t, y, c=c: y[1] - c for c in (V_C, -V_C, 0.0)]
        for event in events:
            event.terminal = True
        arc = solve_ivp(slope, (t, T_END), y, method="RK45", rtol=rtol, atol=atol, events=events)
        t, y = arc.t[-1], arc.y[:, -1]
        if arc.status == 1:  # a root is not yet true in floating point: nudge past it
            y = y + 1e-12 * np.array(slope(t, y))
        switched = enabled(y)
        count += int(switched.sum())
        mode = np.where(switched, 1 - mode, mode)
    return count


def ours(engine: str) -> int:
    """Run simulate() and read the friction force of every row; return the transitions."""
    parameters = GMSParameters(
        K, SIGMA, [C] * 4, sigma_2=SIGMA_2, stribeck=Stribeck(F_C, F_S, V_S), v_c=V_C, weights=W
    )
    trace = simulate(
        GMS(parameters, law="signed"), PulledSlider(1.0, 2.0, 0.1), T_END, engine=engine
    )
    assert np.isfinite(trace.F).all()
    return len(trace.transitions)


def main(rounds: int = 7) -> None:
    """Print a table of medians and ratios."""
    runs: dict[str, Callable[[], int]] = {
        "gms-fsm, machines": lambda: ours("machines"),
        "gms-fsm, if-else": lambda: ours("ifelse"),
        "solve_ivp(RK45, events), by hand": by_hand,
    }
    times: dict[str, list[float]] = {name: [] for name in runs}
    found = {}
    for _ in range(rounds):
        for name, run in runs.items():
            start = time.perf_counter()
            found[name] = run()
            times[name].append(time.perf_counter() - start)
    base = times["solve_ivp(RK45, events), by hand"]
    print(f"{'':34}{'median':>10}{'to SciPy':>10}{'transitions':>13}   (72 is right)")
    for name, each in times.items():
        ratio = statistics.median(a / b for a, b in zip(each, base, strict=True))
        print(f"{name:34}{1e3 * statistics.median(each):8.0f} ms{ratio:10.2f}{found[name]:13d}")


if __name__ == "__main__":
    main()
