"""Lesson 3: The missed window.

What happens when an integrator misses v_c?

An element arrests only while |v| <= v_c = 1e-6 m/s. At a reversal of this motion that window is 32
us wide. A program that evaluates its guards once per step of 1 ms hits it at one reversal in
thirty, by chance. Otherwise the element continues to slip with the wrong sign of v, and from then
on its deflection and the friction are wrong. A tighter tolerance does not help: each step is
accurate, but the guards are evaluated too rarely.

``events="step"`` is such a program. ``events="located"`` takes the same steps, but monitors the
comparisons inside them, cuts a step where one changes, and evaluates the guards there.

## Predict

Four elements begin in stick, and all break away in the first second. Each can break away again only
after it has arrested, and it may arrest only while |v| <= 1e-6 m/s. The velocity is
0.2 sin(2 pi t/20) m/s, and in 61 s it reverses six times. With correct switching there are 48
switches.

1. For how long does |v| stay within ±1e-6 m/s at a reversal, in us?
2. A program takes steps of 1.003 ms and evaluates its guards once per step. How many of the 48
   switches does it most likely find?

## Measure

Run: {MODEL.title}, Table I (stick-slip), v = {A:g} sin(2 pi t/{PERIOD:g}) m/s (chosen by us),
{END:g} s, rk4 with steps of {STEP!m:g} ms; guards evaluated once per step, and located.

Measured: once per step, {found} of {total} switches are found, the first ones {late!m:.2f} ms late;
z is wrong by up to {z_error:.2f} m, F by {F_error:.2f} N. With the same steps, locating finds all
{total}, and arrests at |v| = v_c within {arrest_error:.0e} s.

Measured: |v| <= v_c lasts {window!u:.0f} us, so a step hits it with a probability of {odds!p:.0f}
%. Switches found once per step: {luck}.

So: a step that hits the window is luck, not accuracy (1 ms divides the half period, 1.0001 ms
nearly does). Locate the switches, or test with a step that does not divide the period.

## Why

At a reversal the acceleration is 2 pi 0.2/20 = 0.063 m/s², so |v| <= 1e-6 m/s lasts 2e-6/0.063 s =
32 us. A step of about 1 ms falls into it once in 30 times. No reversal was hit; only the first four
break-aways were found, since nothing arrested after that.

## Vary a parameter

Choose a step. How many of the 48 switches are found by a program that checks its guards once per
step is a matter of luck: a smaller step is not always better.

```python
from matplotlib.figure import Figure

from gms_fsm.app.lessons.basics.l3_missed_window import (
    REVERSALS,
    ROWS,
    once_a_step,
    samples_in_window,
)


def with_step(ms):
    trace = once_a_step(1e-3 * ms)
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    ax = figure.subplots()
    ax.plot(ROWS, result.located.F, color="0.6", linewidth=3, label="located")
    ax.plot(ROWS, trace.F, linestyle="--", label="once per step")
    ax.set(xlabel="$t$ [s]", ylabel="$F$ [N]")
    ax.set_title(
        f"{ms:g} ms: {len(trace.transitions)} of 48 switches, "
        f"{samples_in_window(1e-3 * ms)} of {REVERSALS.size} reversals hit"
    )
    ax.legend()
    return figure


vary(with_step, 1.003, 0.5, 2, 0.001, "step [ms]")
```

## Try

- How small must a fixed step be to hit every reversal, whatever its phase? Compare it with
  `window_width()`.
- Run the same model with `method="dp45"`, `events="step"` and `max_step=1e-3`. Is an adaptive
  step any better?
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gms_fsm import GMS, GMSParameters, Prescribed, Trace, simulate
from gms_fsm.app.lessons.engine.lesson import (
    DOTS,
    FASTEST,
    Lesson,
    forces,
    grid,
    note,
    shown,
    ticks,
)
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.charts.parameters import FloatArray
from plots.style import INK, LINE_GREY, PALE_GREY

A, PERIOD, END = 0.2, 20.0, 61.0  # m/s, s, s
RIG = Prescribed(f"{A}*sin(2*pi*t/{PERIOD})")
MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")
V_C = MODEL.parameters.v_c
REVERSALS = np.arange(PERIOD / 2, END, PERIOD / 2)  # s
STEP = 1.003e-3  # s: does not divide the period
STEPS = (1e-3, 1.0001e-3, 1.001e-3, STEP, 1.007e-3)
ROWS = np.linspace(0.0, END, 6101)


def run() -> dict[str, Any]:
    """Run the same steps with guards evaluated once per step and located, and other steps."""
    located = simulate(MODEL, RIG, END, method="rk4", step=STEP, t_eval=ROWS)
    looked = {step: once_a_step(step) for step in STEPS}
    once = looked[STEP]
    replayed = {"located": located, "once per step": once}
    counts = [len(trace.transitions) for trace in looked.values()]
    met = [samples_in_window(step) for step in STEPS]
    luck = [
        f"{count} with {1e3 * step:g} ms ({hit} of {REVERSALS.size} reversals hit)"
        for step, count, hit in zip(STEPS, counts, met, strict=True)
    ]
    found, total = len(once.transitions), len(located.transitions)
    late = (once.transitions.t[: MODEL.n] - located.transitions.t[: MODEL.n]).max()
    z_error, F_error = abs(once.z - located.z).max(), abs(once.F - located.F).max()
    window, odds = window_width(), window_width() / STEP
    within_v_c, switches_found = 1e6 * window, found
    # |v| falls to v_c half a window before the reversal.
    arrests = located.transitions[located.transitions.edge == "arrest"].t
    arrest_error = abs(arrests[:, None] - (REVERSALS - window / 2)).min(axis=1).max()
    return locals()


def once_a_step(step: float) -> Trace:
    """Run with guards evaluated once per step [s]."""
    options: dict[str, Any] = {"method": "rk4", "events": "step", "engine": FASTEST}
    return simulate(MODEL, RIG, END, step=step, t_eval=ROWS, **options)


def window_width() -> float:
    """Return the duration of |v| <= v_c at a reversal, s.

    Examples
    --------
    >>> round(1e6 * window_width(), 1)
    31.8
    """
    return PERIOD / math.pi * math.asin(V_C / A)


def samples_in_window(step: float) -> int:
    """Count the reversals with a sample of the grid in the window, without a run.

    Examples
    --------
    >>> samples_in_window(1e-3), samples_in_window(1.003e-3)
    (6, 0)
    """
    return sum(bool(abs(_velocity(t)).min() <= V_C) for t in _samples(step))


def _samples(step: float) -> list[FloatArray]:
    """Return the times of the samples next to each reversal, s."""
    return [step * (round(t / step) + np.arange(-3, 4)) for t in REVERSALS.tolist()]


def _velocity(t: FloatArray) -> FloatArray:
    return np.asarray(A * np.sin(2 * math.pi * t / PERIOD))


def _reversal(ax: Any, _: Any) -> str:
    # The reversal that is missed by the largest margin.
    t = max(_samples(STEP), key=lambda t: float(abs(_velocity(t)).min()))
    turn = round(float(t.mean()))
    line, t = turn + np.array([-2e-3, 2e-3]), t[abs(t - turn) < 2e-3]
    ax.axhspan(-1e6 * V_C, 1e6 * V_C, color=LINE_GREY, linewidth=0.8, zorder=1)
    ax.plot(1e3 * (line - turn), 1e6 * _velocity(line), color=INK)
    ax.plot(1e3 * (t - turn), 1e6 * _velocity(t), **DOTS | {"markersize": 7})
    ax.set(xlabel=f"$t$ − {turn:g} s [ms]", ylabel="$v$ [µm/s]", xlim=(-2, 2))
    below = -4 if _velocity(line)[1] > 0 else 4
    note(ax, f"|v| ≤ $v_c$, {1e6 * window_width():.0f} µs long", (1.95, 0), (-1, below), fontsize=9)
    return f"samples of {1e3 * STEP:g} ms at a reversal"


def _luck(ax: Any, r: Any) -> str:
    places = np.arange(len(STEPS))
    ax.bar(places, r.counts, width=0.62, facecolor=PALE_GREY, edgecolor=INK)
    for at, met in zip(zip(places, r.counts, strict=True), r.met, strict=True):
        note(ax, f"{met} of {REVERSALS.size}", at, (0, 3), ha="center", color=INK)
    ticks(ax, "x", places, [f"{1e3 * step:g}" for step in STEPS])
    ax.set(xlabel="step [ms]", ylabel="switches found once per step", ylim=(0, 62))
    ax.axhline(r.total, color=INK, linestyle="--", linewidth=0.9)
    note(ax, f"located, {1e3 * STEP:g} ms: {r.total}", (places[-1] + 0.4, r.total), (-1, 3))
    return "luck (above: reversals hit by a sample)"


LESSON = Lesson(
    __name__,
    run,
    (
        _reversal,
        _luck,
        forces,
        shown("ribbons", "located", "states, located: {total} switches"),
        shown("ribbons", "once", "states, once per step: {found} switches"),
    ),
    grid("ab;cc;dd;ee", (8.2, 8.2), (1.7, 1.5, 1, 1)),
    level="undergraduate",
    questions=(
        Question("within_v_c", "us", rtol=0.05),
        Question("switches_found", atol=0.5),
    ),
)
