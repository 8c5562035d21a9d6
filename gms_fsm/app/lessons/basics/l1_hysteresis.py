"""Lesson 1: Pre-sliding hysteresis.

What is pre-sliding hysteresis?

A contact gives way before it slides. Each Maxwell element is a spring that slips at its own
deflection s_i, so on the first loading the elements slip one after another, and the stiffness falls
from the sum of all springs to zero on a plateau. After a reversal an element must travel 2 s_i
before it slips in the other direction: the return branch is the first loading curve, twice as large
(Masing's rule). The elements that still stick are a memory: when the motion returns to an earlier
reversal point, the force passes through the same point again and continues as if the inner loop
had never happened.

Here the motion is 0, A, B, C, D, E with |v| = 10 um/s, and each element has F_s = F_c, so that it
is a plain spring and slider.

## Predict

Four springs of 40, 30, 20 and 10 N/mm lie in parallel. Each slips when it carries a quarter of the
friction, 0.25 N. The contact is pulled slowly from 0.

1. Where does the first spring slip, in um?
2. The motion goes from 0 up to A, back to B, up to C below A, down to D above B, and up again past
   C and A. How far is the force from its old value when the motion is back at A, in N: 0, a little
   (0.01), or much (0.1)?

## Measure

Run: {gms.model.title}, F_s = F_c (a spring and a slider each), moved to {TURNS!u:+.0f} um at
{SPEED!u:g} um/s; for comparison LuGre with the same initial stiffness and F_c. Motion and
parameters are chosen by us.

Measured: on the first loading the elements slip at x = {let_go!u:.2f} um, so the curve is piecewise
linear, from {stiffness!k:.1f} N/mm to a plateau of {plateau:.3f} N; from A back to A {loss!u:.2f}
uJ are dissipated.

Measured: on return to C the force differs by {gaps[0]:.0e} N, on return to A by {gaps[1]:.0e} N;
every branch is the doubled first loading curve (Masing) within {masing_error:.0e} N. LuGre misses C
by {lugre_gaps[0]:.3f} N and A by {lugre_gaps[1]:.3f} N.

So: pre-sliding hysteresis comes from elements that slip one by one, and its memory from those that
still stick. A single LuGre bristle also makes loops, but they do not close.

## Why

The stiffest spring carries 0.25 N first: 0.25 N / 40 N/mm = 6.25 um. At A the force is that of the
first visit, because an element that still sticks has returned to its old deflection, and one that
slips has the same limit as before.

## Vary a parameter

The motion goes to +20 um, back to b, and on to +30 um. Wherever b is, the force passes again
through the point (circle) at which the inner loop began.

```python
from matplotlib.figure import Figure

from gms_fsm import GMS, Prescribed, simulate
from gms_fsm.app.lessons.basics.l1_hysteresis import FINE, PARAMETERS, strokes


def inner_loop(b):
    velocity, times = strokes([20e-6, 1e-6 * b, 30e-6])
    trace = simulate(GMS(PARAMETERS, law="signed"), Prescribed(velocity), times[-1], atol=FINE)
    turn = trace.sample(times[:1])
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    ax.plot(1e6 * trace.x, trace.F)
    ax.plot(1e6 * turn.x, turn.F, "o", markersize=9, markerfacecolor="none")
    ax.set(xlabel="$x$ [µm]", ylabel="$F$ [N]", title=f"reversals at 20 µm and at {b:g} µm")
    return figure


vary(inner_loop, 0, -20, 18, 1, "b [µm]")
```

## Try

- How far back must b be before an element slips backward? Derive it from `PARAMETERS.weights`.
- Add an element to the bank (`GMSParameters.from_shares`). Where does the loop change?
- Run the same strokes with `LuGre` and look at the circle.

## Solutions

- The first element slips backward after 2 s_1 = 2 · 0.25 N / 40 N/mm = 12.5 um, so when b is below
  20 - 12.5 = 7.5 um.
- The first loading has one more corner, at the deflection s_i of the new element; each branch has
  one at 2 s_i from its reversal.
- The last stroke misses the circle: on the way to 0 and back LuGre loses 0.10 N.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, Stribeck, simulate
from gms_fsm.app.lessons.engine.lesson import DOTS, FIRST, GUIDE, Lesson, draw, grid, note
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.charts.parameters import FloatArray
from plots.style import INK, LINE_GREY, PAPER, TEXT_GREY

NAMES = "ABCDE"
TURNS = np.array([20e-6, -12e-6, 12e-6, -6e-6, 30e-6])  # m: reversal points; the motion ends at E
SPEED, RAMP = 10e-6, 0.02  # m/s; s for the velocity to grow from 0 to that
K = np.array([40e3, 30e3, 20e3, 10e3])  # N/m
STRIBECK = Stribeck(F_c=1.0, F_s=1.0, v_s=1e-3)  # flat
PARAMETERS = GMSParameters.from_shares([0.25] * 4, K, C=200.0, stribeck=STRIBECK, v_c=1e-6)
FINE = 1e-13  # m, absolute tolerance: z is in micrometres here
BOLD: dict[str, Any] = {"color": INK, "fontsize": 9, "fontweight": "bold"}


def run() -> dict[str, Any]:
    """Move the GMS model, and a bristle of the same initial stiffness, through nested reversals."""
    velocity, turn_times = strokes(TURNS)
    bristle = LuGre(sigma_0=float(K.sum()), sigma_1=0.0, sigma_2=0.0, stribeck=STRIBECK)
    gms, lugre = (
        simulate(model, Prescribed(velocity), float(turn_times[-1]), atol=FINE)
        for model in (GMS(PARAMETERS, law="signed"), bristle)
    )
    replayed = {"GMS": gms}
    # Times at which the last stroke, at constant speed from D, is at C and at A again.
    back = turn_times[3] + RAMP / 2 + (TURNS[[2, 0]] - TURNS[3]) / SPEED
    misses, lugre_misses = (
        trace.sample(back).F - trace.sample(turn_times[[2, 0]]).F for trace in (gms, lugre)
    )
    gaps, lugre_gaps = abs(misses), abs(lugre_misses)
    gap_at_a = gaps[1]
    log, first, plateau = gms.transitions, gms.transitions[0], gms.F[-1]
    let_go = gms.sample([log.t[log.element == i][0] for i in range(gms.n)]).x
    stiffness = first.F_before / let_go[first.element]
    first_slip = 1e6 * let_go.min()
    fine = gms.refined(4000)
    masing_error = abs(fine.F - masing(fine.t, fine.x, turn_times)).max()
    cycle = (fine.t >= turn_times[0]) & (fine.t <= back[1])
    x, F = fine.x[cycle], fine.F[cycle]
    loss = (0.5 * (F[1:] + F[:-1]) * np.diff(x)).sum()
    return locals()


def strokes(turns: Sequence[float] | FloatArray) -> tuple[list[tuple[float, float]], FloatArray]:
    """Return a velocity that leads from 0 to each reversal point, and the times of the reversals.

    The velocity passes through 0 in ramps, since a jump would skip the window |v| <= v_c.

    Examples
    --------
    >>> corners, times = strokes([10e-6])
    >>> corners, times.tolist()
    ([(0.0, 0.0), (0.02, 1e-05), (1.0, 1e-05), (1.02, 0.0)], [1.02])
    """
    corners, times = [(0.0, 0.0)], []
    t = here = 0.0
    for there in turns:
        v = float(np.copysign(SPEED, there - here))
        end = t + abs(there - here) / SPEED + RAMP
        corners += [(t + RAMP, v), (end - RAMP, v), (end, 0.0)]
        times.append(end)
        t, here = end, float(there)
    return corners, np.array(times)


def first_loading(x: ArrayLike) -> FloatArray:
    """Return the force of the first loading at x, of either sign: springs that slip at s_i.

    Examples
    --------
    >>> first_loading([-5e-6, 1.0]).round(12).tolist()
    [-0.5, 1.0]
    """
    s = PARAMETERS.weights * STRIBECK.F_c
    return np.asarray((K * np.clip(np.asarray(x)[..., None], -s, s)).sum(axis=-1))


def masing(t: FloatArray, x: FloatArray, turn_times: FloatArray) -> FloatArray:
    """Return the force by Masing's rule, which uses reversal points but no elements."""
    F, F_turn = np.empty_like(x), list[float]()
    for stroke, end in enumerate(turn_times):
        now = (t <= end) & (t >= (turn_times[stroke - 1] if stroke else 0.0))
        F[now] = _branch(stroke, F_turn, x[now])
        F_turn.append(float(_branch(stroke, F_turn, TURNS[stroke])))
    return F


def _branch(stroke: int, F_turn: Sequence[float], x: ArrayLike) -> FloatArray:
    """Return the force of a stroke; even strokes rise, odd strokes fall.

    From the last reversal (x_r, F_r) the stroke follows ``F_r +- 2 f(|x - x_r| / 2)``, where f is
    the first loading. At the reversal before that the inner loop closes, and the stroke continues
    along the older branch.
    """
    x, sign = np.asarray(x), 1.0 if stroke % 2 == 0 else -1.0
    F = first_loading(x)
    for i in range(1 - stroke % 2, stroke, 2):  # from the oldest branch to the newest
        branch = F_turn[i] + 2 * sign * first_loading(sign * (x - TURNS[i]) / 2)
        F = branch if i == 0 else np.where(sign * (TURNS[i - 1] - x) > 0, branch, F)
    return F


def _loops(ax: Any, name: str, result: Any) -> None:
    """Draw F over x, name the reversals, and mark where the last stroke returns to them."""
    trace = result.values[name]
    ends = [("", end) for end in (*result.turn_times[[0, 3]], np.inf)]
    looks = (FIRST | {"linestyle": "--"}, FIRST | {"color": LINE_GREY, "linewidth": 2.4}, FIRST)
    for line, look in zip(draw("hysteresis", ax, trace, ends), looks, strict=True):
        line.set(**look)
    corners, again = trace.sample(result.turn_times), trace.sample(result.back)
    ax.plot(1e6 * corners.x, corners.F, **DOTS, zorder=5)
    ax.plot(1e6 * again.x, again.F, "s", color=INK, markersize=8, markerfacecolor="none", zorder=6)
    for letter, x, F in zip(NAMES, 1e6 * corners.x, corners.F, strict=True):
        shift = (0, 10) if x > 0 else (-9, -4)
        note(ax, letter, (x, F), shift, **BOLD, ha="center", va="center")
    ax.margins(y=0.12)
    ax.set_xlim(-17, 33)


def _closed(ax: Any, r: Any) -> str:
    _loops(ax, "gms", r)
    t = np.linspace(0, r.turn_times[-1], 44)[1:-1]
    x = r.gms.sample(t).x
    look = DOTS | {"color": TEXT_GREY, "markersize": 4.5, "markerfacecolor": PAPER, "zorder": 4}
    ax.plot(1e6 * x, masing(t, x, r.turn_times), **look)
    note(ax, "circles: doubled first loading\n(Masing's rule)", (0.98, 0.04), inside=True)
    return f"{r.gms.model.title}: loops close"


def _opened(ax: Any, r: Any) -> str:
    _loops(ax, "lugre", r)
    key = "dashed: first loading\nblack: last stroke, D to E\nsquares: back at C and A"
    note(ax, key, (0.98, 0.04), inside=True)
    ax.sharey(ax.figure.axes[0])
    return "LuGre, same initial stiffness: open loops"


def _motion(ax: Any, r: Any) -> str:
    ax.plot(r.gms.t, 1e6 * r.gms.x, color=INK)
    ax.set(xlim=(0, r.turn_times[-1]), ylabel="$x$ [µm]")
    ax.margins(y=0.25)
    for name, t, x in zip(NAMES, r.turn_times, 1e6 * TURNS, strict=True):
        side = "right" if name == "E" else "center"
        note(ax, name, (t, x), (0, 3 if x > 0 else -3), **BOLD, ha=side)
    for name, t, shift in (("C", r.back[0], (6, -3)), ("A", r.back[1], (-6, 3))):
        at = (t, 1e6 * TURNS[NAMES.index(name)])
        ax.plot(*at, "s", color=INK, markersize=4)
        note(ax, f"back at {name}", at, shift, color=INK)
    return "motion (chosen by us)"


def _states(ax: Any, r: Any) -> str:
    draw("ribbons", ax, r.gms)
    for t in r.turn_times[:-1]:
        ax.axvline(t, **GUIDE)
    return "states of the elements"


def _live() -> Any:
    velocity, times = strokes(TURNS)
    subject = GMS(PARAMETERS, law="signed"), Prescribed(velocity), float(times[-1])
    return subject, {"k1": None, "weights1": None}, {"atol": FINE}


LESSON = Lesson(
    __name__,
    run,
    (_closed, _opened, _motion, _states),
    grid("ab;cc;dd", (8.2, 7.0), (3, 1, 1.1)),
    level="undergraduate",
    questions=(Question("first_slip", "um", rtol=0.02), Question("gap_at_a", "N", atol=1e-3)),
    live=_live,
)
