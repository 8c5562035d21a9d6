"""Lesson 5: How many elements.

How many elements are enough?

A measured first loading is a smooth curve, which n elements approximate by n straight segments.
Here the curve is the parabola f(x) = F_c (1 - (1 - x/X)**2) (chosen by us), because its best
approximation is known: evenly spaced thresholds, s_i = i X/n, and n equal springs of 2 F_c/(n X),
the last one half as stiff. The error is then at most F_c/(4 n**2).

The plateau is right for any n, even n = 1. Few elements lose the small loops: as long as no element
slips, nothing is dissipated.

## Predict

The first loading of a contact is a parabola that rises to F_c = 1 N at 100 um, where it is flat. A
bank of n springs follows it with n straight segments, which meet it at their ends: the springs slip
at n evenly spaced deflections, the last one at 100 um.

1. What is the largest error of four elements, in % of F_c?
2. In a small loop of ±40 um around 0, which part of the energy of the smooth curve do two elements
   dissipate, in %?

## Measure

Run: GMS, signed law, n = {COUNTS} elements fitted to a parabola that reaches F_c = {F_c:g} N at
{X!u:g} um; loaded once to {STROKE!u:g} um, and moved back and forth by {SMALL!u:g} um (chosen by
us).

Measured: the largest error of the first loading is {said_errors} of F_c: 1/(4 n^2).

Measured: of the energy that the smooth curve dissipates in a loop of {SMALL!u:g} um, the models
dissipate {said_losses}; a model whose first element slips beyond the loop dissipates none.

So: four elements give the curve within 2 %; the damping of small motions depends on the smallest
threshold: put it well below the smallest motion of interest.

## Why

A chord of width X/n misses a parabola by at most F_c/(4 n²): 1.56 % for n = 4. The first of two
elements slips at 50 um, so a loop of 40 um only loads springs. The plateau says nothing about small
motions.

## Vary a parameter

A bank of n elements approximates the parabola by n line segments.

```python
from matplotlib.figure import Figure

from gms_fsm import Prescribed, simulate
from gms_fsm.app.lessons.basics.l5_how_many import ATOL, RTOL, SPEED, STROKE, bank, parabola


def chain(n):
    trace = simulate(bank(n), Prescribed(SPEED), STROKE / SPEED, rtol=RTOL, atol=ATOL)
    fine = trace.refined(2000)
    error = abs(fine.F - parabola(fine.x)).max()
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    ax.plot(1e6 * fine.x, parabola(fine.x), color="0.75", linewidth=6, label="smooth curve")
    ax.plot(1e6 * fine.x, fine.F, label=f"n = {n}")
    ax.set(xlabel="$x$ [µm]", ylabel="$F$ [N]", title=f"error at most {100 * error:.2f} % of F_c")
    ax.legend()
    return figure


vary(chain, 3, 1, 20, 1, "n")
```

## Try

- How many elements reduce the error below 0.1 % of F_c? Use the formula first, then the slider.
- Space the thresholds geometrically instead of evenly. What happens to the small loop?
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, Trace, simulate
from gms_fsm.app.lessons.engine.lesson import BROAD, DOTS, Lesson, grid, note, ticks
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.charts.parameters import FloatArray
from plots.style import ELEMENT_DASHES, INK, PALE_GREY, TEXT_GREY, ramp

COUNTS = (1, 2, 4, 12)
F_c, X = 1.0, 100e-6  # N, m: the plateau, and where it begins
STROKE, SMALL = 1.2 * X, 0.4 * X  # m: length of the first loading, and amplitude of the small loop
SPEED, OMEGA = 10e-6, 1.0  # m/s, rad/s
RTOL, ATOL = 1e-10, 1e-13  # 1, m: z is in micrometres here
COLOURS = ramp("compared", len(COUNTS))


def run() -> dict[str, Any]:
    """Load each model once, and move it back and forth."""
    loading, swing = Prescribed(SPEED), Prescribed(f"{SMALL * OMEGA}*cos({OMEGA}*t)")
    loadings, loops = (
        {n: simulate(bank(n), rig, end, rtol=RTOL, atol=ATOL) for n in COUNTS}
        for rig, end in ((loading, STROKE / SPEED), (swing, 4.5 * math.pi / OMEGA))
    )
    replayed = {"four elements": loops[4]}
    fine = [trace.refined(4000) for trace in loadings.values()]
    errors = np.array([abs(trace.F - parabola(trace.x)).max() for trace in fine])
    losses = np.array([_work(small_loop(trace)) for trace in loops.values()])
    shares = abs(losses) / smooth_loss(SMALL)
    error_of_four = 100 * errors[COUNTS.index(4)] / F_c
    loss_of_two = 100 * shares[COUNTS.index(2)]
    said_errors, said_losses = (
        [f"{100 * value:{form}} % (n = {n})" for n, value in zip(COUNTS, values, strict=True)]
        for values, form in ((errors / F_c, ".3g"), (shares, ".1f"))
    )
    return locals()


def bank(n: int) -> GMS:
    """Return n elements that follow the parabola: plain springs and sliders, F_s = F_c.

    Examples
    --------
    >>> bank(4).parameters.k.tolist()
    [5000.0, 5000.0, 5000.0, 2500.0]
    """
    s = X * np.arange(1, n + 1) / n
    k = np.full(n, 2 * F_c / (n * X))
    k[-1] /= 2
    flat = Stribeck(F_c=F_c, F_s=F_c, v_s=1e-3)
    parameters = GMSParameters.from_shares(k * s / F_c, k, C=200.0, stribeck=flat, v_c=1e-6)
    return GMS(parameters, law="signed")


def parabola(x: ArrayLike) -> FloatArray:
    """Return the smooth first loading f(x) [N] at positions x >= 0 [m].

    Examples
    --------
    >>> parabola([0.0, 50e-6, 1.0]).tolist()
    [0.0, 0.75, 1.0]
    """
    return np.asarray(F_c * (1 - (1 - np.minimum(np.asarray(x, dtype=float), X) / X) ** 2))


def smooth_loss(a: float) -> float:
    """Return the energy dissipated in one loop of amplitude a <= X by the smooth curve, J.

    By Masing's rule both branches are f doubled; the area between them is 4 F_c a**3 / (3 X**2).
    """
    return 4 * F_c * a**3 / (3 * X**2)


def small_loop(trace: Trace) -> Trace:
    """Return one period of the loop, from its first reversal, with all rows and fine samples."""
    begin = 0.5 * math.pi / OMEGA
    times = np.linspace(begin, begin + 2 * math.pi / OMEGA, 4001)
    inside = trace.t[(trace.t > times[0]) & (trace.t < times[-1])]
    return trace.sample(np.union1d(times, inside))


def _work(trace: Trace) -> float:
    return float((0.5 * (trace.F[1:] + trace.F[:-1]) * np.diff(trace.x)).sum())


def _curves(ax: Any, traces: list[Trace]) -> None:
    for n, trace, colour, dash in zip(COUNTS, traces, COLOURS, ELEMENT_DASHES, strict=False):
        look = {"color": colour, "linestyle": dash, "linewidth": 1.6}
        ax.plot(1e6 * trace.x, trace.F, label=f"n = {n}", **look)
    ax.set(xlabel="$x$ [µm]", ylabel="$F$ [N]")


def _loading(ax: Any, r: Any) -> str:
    x = np.linspace(0, STROKE, 400)
    _curves(ax, [trace.refined(500) for trace in r.loadings.values()])
    ax.plot(1e6 * x, parabola(x), **BROAD, label="smooth curve")
    ax.legend(loc="lower right", handlelength=3.2)
    ax.set(xlim=(0, None), ylim=(0, None))
    return "first loading, signed law, $F_s$ = $F_c$"


def _loop(ax: Any, r: Any) -> str:
    swing = SMALL * np.linspace(-1, 1, 200)
    half = 2 * parabola((SMALL + swing) / 2) - float(parabola(SMALL))  # Masing
    for branch in (half, -half[::-1]):
        ax.plot(1e6 * swing, branch, **BROAD)
    _curves(ax, [small_loop(trace) for trace in r.loops.values()])
    text = "n = 1 and n = 2: no element slips,\na line and no loop"
    note(ax, text, (0.03, 0.97), inside=True, fontsize=9)
    return f"back and forth by {1e6 * SMALL:g} µm"


def _error(ax: Any, r: Any) -> str:
    many = np.geomspace(1, 14, 50)
    ax.loglog(many, 100 / (4 * many**2), color=TEXT_GREY, linewidth=0.9)
    note(ax, r"$F_c / 4n^2$", (5, 1), (5, 5), fontsize=9)
    for n, colour, error in zip(COUNTS, COLOURS, r.errors, strict=True):
        ax.plot(n, 100 * error / F_c, **DOTS | {"color": colour, "markersize": 7, "zorder": 3})
    ticks(ax, "x", COUNTS)
    ax.set(xlabel="elements $n$", ylabel="largest error [% of $F_c$]")
    return "error of the first loading"


def _damping(ax: Any, r: Any) -> str:
    places, shares = np.arange(len(COUNTS)), 100 * r.shares
    ax.bar(places, shares, width=0.6, facecolor=PALE_GREY, edgecolor=INK)
    ax.axhline(100, color=INK, linestyle="--", linewidth=0.9)
    for at in zip(places, shares, strict=True):
        shift = (0, 3 if at[1] < 90 else -4)
        note(ax, f"{at[1]:.1f} %", at, shift, ha="center", color=INK, fontsize=9)
    note(ax, "smooth curve", (-0.3, 100), (0, -4), fontsize=9)
    ticks(ax, "x", places, [str(n) for n in COUNTS])
    ax.set(xlabel="elements $n$", ylabel="energy per loop [%]", ylim=(0, 112))
    return "damping of the small loop"


LESSON = Lesson(
    __name__,
    run,
    (_loading, _loop, _error, _damping),
    grid("ab;cd", (8.2, 6.8), (1.5, 1)),
    level="undergraduate",
    questions=(
        Question("error_of_four", "%", rtol=0.05),
        Question("loss_of_two", "% of the smooth curve", atol=1.0),
    ),
    live=lambda: (
        (bank(4), Prescribed(f"{SMALL * OMEGA}*cos({OMEGA}*t)"), 4.5 * math.pi / OMEGA),
        {"weights1": None, "k1": None},
        {"rtol": RTOL, "atol": ATOL},
    ),
)
