"""Lesson 7: Frictional lag.

Why does friction lag behind the speed?

In steady sliding the friction is s(v) + sigma_2 v. When the speed changes, the deflections follow
with a delay: by ``dz = C (1 - z/s)`` z approaches s with the time constant s/C. While the slider
accelerates, the friction is therefore still that of the lower speed, which is higher, and while it
decelerates the friction is lower: a loop around the steady curve.

The usual rule says that the loop grows with the frequency. It does, as long as the deflections can
follow. Above w = C/s they follow less and less, and the loop closes again.

## Predict

A contact slides at 1.5 + cos(w t) mm/s and never stops. In steady sliding friction is s(v), which
falls with the speed; here it is about 1 N. After a change of the speed the deflections follow s(v)
with the time constant s/C, C = 50 N/s.

1. While it accelerates, is the friction "higher", "lower", or the "same" as while it decelerates,
   at the same speed?
2. From 1 to 600 rad/s: at which w is the loop of friction over speed widest, in rad/s?

## Measure

Run: {MODEL.title}, all in slip, v = {MEAN!m:g} + {SWING!m:g} cos(w t) mm/s, F_s = {STRIBECK.F_s:g},
F_c = {STRIBECK.F_c:g} N, v_s = {STRIBECK.v_s!m:g} mm/s, C = {C:g} N/s (chosen by us), w =
{OMEGAS[0]:g} to {fastest:g} rad/s.

Measured: at {MEAN!m:g} mm/s friction is higher during acceleration than during deceleration, by
{said_widths}.

Measured: of {count} loops the widest is at {widest:g} rad/s ({at_widest!m:.0f} mN; C/F_c =
{corner:g}/s) and they close again above that: {at_100!m:.0f} mN at 100, {at_600!m:.0f} mN at 600
rad/s.

So: friction depends on the speed a time s/C ago. "Wider with frequency" holds up to about w = C/s;
the frequency of the widest loop reveals C.

## Why

The deflections follow s(v) with the time constant s/C, 1 N / 50 N/s = 20 ms. While the speed rises
the friction is still that of a lower speed, which is higher. Below w = C/s the delay grows with w;
above it the deflections hardly move any more.

## Vary a parameter

The loop opens as the frequency rises to about w = C/s, and closes again beyond that.

```python
from matplotlib.figure import Figure

from gms_fsm.app.lessons.practice.l7_frictional_lag import SIGMA_2, STRIBECK, last_period, moved


def loop(w):
    cycle = last_period(moved(w), w)
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    ax.plot(1e3 * cycle.v, STRIBECK(cycle.v) + SIGMA_2 * cycle.v, color="0.75", linewidth=5)
    ax.plot(1e3 * cycle.v, cycle.F)
    ax.set(xlabel="$v$ [mm/s]", ylabel="$F$ [N]", title=f"w = {w:.3g} rad/s (grey: steady sliding)")
    return figure


vary(loop, 45.0, 0.0, 2.7, 0.05, "w [rad/s]", log=True)
```

## Try

- Double C. At which frequency is the loop widest now?
- In which direction is the loop traversed? Does it depend on the frequency?

## Solutions

- At twice the frequency, 90 rad/s, and it is as wide as before: only the product of w and s/C
  counts.
- Clockwise with v to the right: on the way to higher speeds friction is above the steady curve, on
  the way back below it. A delay has one direction, whatever the frequency.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gms_fsm import (
    GMS,
    Body,
    Contact,
    GMSParameters,
    Prescribed,
    Stribeck,
    System,
    Trace,
    simulate,
)
from gms_fsm.app.lessons.engine.lesson import BROAD, DOTS, GUIDE, Lesson, grid, note, ticks
from gms_fsm.app.lessons.engine.predict import Question
from plots.style import ELEMENT_DASHES, INK, LINE_GREY, ramp

MEAN, SWING = 1.5e-3, 1e-3  # m/s: v = MEAN + SWING cos(w t), never zero
SHOWN = (1.0, 10.0, 25.0)  # rad/s
OMEGAS = (1.0, 3.0, 10.0, 25.0, 35.0, 45.0, 60.0, 100.0, 250.0, 600.0)  # rad/s
C = 50.0  # N/s, of the whole model
STRIBECK = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
SIGMA_2 = 0.4  # Ns/m
PARAMETERS = GMSParameters.from_shares(
    [0.25] * 4, [40e3, 30e3, 20e3, 10e3], C=C, stribeck=STRIBECK, v_c=1e-6, sigma_2=SIGMA_2
)
MODEL = GMS(PARAMETERS, law="signed")
RTOL, ATOL = 1e-9, 1e-12  # 1, m: z is in micrometres here
SETTLED = 1.0  # s: by then all elements slip and the initial transient has decayed
SHADES = dict(zip(SHOWN, ramp("compared", len(SHOWN)), strict=True))


def run() -> dict[str, Any]:
    """Move the model at ten frequencies."""
    runs = {w: moved(w) for w in OMEGAS}
    replayed = {"10 rad/s": runs[10.0]}
    loops = {w: last_period(trace, w) for w, trace in runs.items()}
    # From the top speed, the mean speed comes after a quarter and three quarters of a period.
    widths = np.array([loop.F[750] - loop.F[250] for loop in loops.values()])
    width = dict(zip(OMEGAS, widths, strict=True))
    widest = max(width, key=lambda w: float(width[w]))
    accelerating = "higher" if widths.min() > 0 else "lower"
    said_widths = [f"{1e3 * width[w]:.1f} mN at {w:g} rad/s" for w in SHOWN]
    count, fastest, corner = len(OMEGAS), OMEGAS[-1], C / STRIBECK.F_c
    at_widest, at_100, at_600 = width[widest], width[100.0], width[600.0]
    return locals()


def moved(w: float) -> Trace:
    """Run to the end of the first complete period after `SETTLED`, at a frequency w [rad/s]."""
    return simulate(
        MODEL, Prescribed(f"{MEAN} + {SWING}*cos({w}*t)"), _end(w), rtol=RTOL, atol=ATOL
    )


def _end(w: float) -> float:
    period = 2 * math.pi / w
    return period * (math.ceil(SETTLED / period) + 1)


def last_period(trace: Trace, w: float) -> Trace:
    """Return the last period of a run: 1001 samples, from top speed to top speed."""
    end = _end(w)
    return trace.sample(np.linspace(end - 2 * math.pi / w, end, 1001).clip(max=trace.t[-1]))


def _loops(ax: Any, r: Any) -> str:
    v = np.linspace(MEAN - SWING, MEAN + SWING, 300)
    ax.plot(1e3 * v, STRIBECK(v) + SIGMA_2 * v, **BROAD, label=r"steady: $s(v) + \sigma_2 v$")
    for (w, colour), dash in zip(SHADES.items(), ELEMENT_DASHES, strict=False):
        loop = r.loops[w]
        path = np.column_stack([1e3 * loop.v, loop.F])
        look = {"color": colour, "linestyle": dash, "linewidth": 1.6}
        ax.plot(*path.T, **look, label=f"{w:g} rad/s")
        head = {"arrowstyle": "-|>", "color": colour, "mutation_scale": 13}
        for row in (250, 750):  # an arrowhead on each branch, at the mean speed
            ax.annotate("", path[row + 4], path[row - 4], arrowprops=head)
    note(ax, "accelerating", (1.55, 1.235), fontsize=9)
    note(ax, "decelerating", (0.75, 0.99), fontsize=9)
    ax.set(xlabel="$v$ [mm/s]", ylabel="$F$ [N]", ylim=(0.96, None))
    ax.legend(loc="upper right", handlelength=3.2)
    return f"loops, {MODEL.title}"


def _widths(ax: Any, r: Any) -> str:
    ax.semilogx(OMEGAS, 1e3 * r.widths, color=LINE_GREY, zorder=1)
    for w, width in zip(OMEGAS, 1e3 * r.widths, strict=True):
        size = 7 if w in SHOWN else 4
        ax.plot(w, width, **DOTS | {"color": SHADES.get(w, INK), "markersize": size})
    ax.axvline(r.corner, **GUIDE, linestyle="--")
    note(ax, "C/F$_c$", (r.corner, 4), (4, 0), fontsize=9)
    ticks(ax, "x", (1, 3, 10, 30, 100, 300))
    ax.set(xlabel="$w$ [rad/s]", ylabel=f"width at {1e3 * MEAN:g} mm/s [mN]", ylim=(0, 200))
    return "width of the loop"


def _swung() -> System:
    """Return the contact with its frequency as a number, for a slider."""
    return System(
        "a contact that never stops",
        bodies=(Body("slider", velocity=f"{MEAN} + {SWING} * cos(w * t)"),),
        contacts=(Contact("pad", MODEL),),
        numbers={"w": 45.0},
    )


LESSON = Lesson(
    __name__,
    run,
    (_loops, _widths),
    grid("ab", (8.2, 4.8), widths=(1.5, 1)),
    level="undergraduate",
    questions=(
        Question("accelerating", choices=("higher", "lower", "same")),
        Question("widest", "rad/s", rtol=0.3),
    ),
    live=lambda: ((_swung(), 1.5), {"numbers.w": (1.0, 600.0)}, {"rtol": RTOL, "atol": ATOL}),
)
