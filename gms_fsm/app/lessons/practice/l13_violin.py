"""Lesson 13: The violin.

Why does the violin sing?

The bow moves steadily, and the string sounds. It sticks to the hair, is carried along, and slips
back once a period. While it slips friction pushes it forward, for the bow is faster. As long as the
string moves forward, too, that puts energy in; while it swings back it takes energy out. But then
it slips faster and friction is lower, so that less is taken out than was put in. What is left over
makes up for the damping: the sound.

The motion is a limit cycle. Newton's method finds it, with its period to all digits, and the
derivative of the state after a period by that before it says that a disturbance dies out.

## Predict

A string is a mass of 1.14 g on a spring of 8713 N/m, with little damping. A bow moves at 0.15 m/s
and presses so that friction is 0.24 N at rest and falls to 0.08 N in sliding.

1. At which frequency does it sound, in Hz?
2. How far does it swing to either side, in um? While it sticks it is as fast as the bow.
3. The player presses the bow 50 % harder. Is the note "higher", "lower", or exactly the "same"?

## Measure

Run: {MODEL.title}, on a string of {MASS!m:g} g, {STIFFNESS:g} N/m and {DAMPING!m:g} mNs/m, bowed at
{SPEED:g} m/s with F_s = {F_S:g} N, F_c = F_s/3; the limit cycle by Newton's method from a run of
{END:g} s (chosen by us).

Measured: {sounds:.1f} Hz, {swing:.0f} um to either side; it sticks for {sticks!p:.0f} % of the
period. A deviation shrinks to {multiplier!p:.0f} % in each period.

Measured: in a period friction puts {forward!u:.1f} uJ into the string and takes {backward!u:.1f} uJ
back; {sound!u:.2f} uJ are left for the damping. Pressed with 0.16 to 0.36 N it sounds at
{pitches:.1f} Hz.

So: friction that falls with the speed gives more to the string that moves along than it takes from
the string that comes back. The string sets the note; a bow that presses harder holds it a little
longer.

## Why

A mass on a spring swings with sqrt(k/m)/(2 pi) = 440 Hz. It is carried at 0.15 m/s, and a swing
with this largest speed goes 0.15/(2 pi 440) m = 54 um to either side. While it sticks no swing of
its own goes on, and the larger the friction at rest, the farther the bow takes it before it slips:
the period grows, the note falls. Players know that as flattening.

## Try

- With friction that does not fall, `bow(F_S, F_S)`, the string comes to rest. Why?
- Move the bow twice as fast, `Belt(MASS, STIFFNESS, 2 * SPEED, DAMPING)`. What becomes of the note?

## Solutions

- Friction then pushes with the same force in both directions of the swing: it puts in nothing over
  a period, and the damping is not made up for.
- It is twice as loud, 113 um to either side, and 440.1 Hz high: the string sticks for a shorter
  part of the period.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gms_fsm import GMS, Belt, GMSParameters, LimitCycle, Stribeck, limit_cycle, simulate
from gms_fsm.app.lessons.engine.lesson import (
    DOTS,
    FASTEST,
    FIRST,
    GUIDE,
    SECOND,
    Lesson,
    grid,
    note,
)
from gms_fsm.app.lessons.engine.predict import Question

MASS, STIFFNESS, DAMPING, SPEED = 1.14e-3, 8713.0, 6.3e-3, 0.15  # kg, N/m, Ns/m, m/s
F_S, HARDER, END = 0.24, 1.5, 0.05  # N, 1, s
ROWS = 2000
FORCES = (0.16, 0.2, F_S, 0.3, HARDER * F_S)  # N


def bow(F_s: float, F_c: float) -> GMS:
    """Return the hair of the bow: one element."""
    curve = Stribeck(F_c=F_c, F_s=F_s, v_s=0.08)
    return GMS(
        GMSParameters.from_shares([1.0], [1e5], C=2000.0, sigma=[2.0], stribeck=curve, v_c=1e-4),
        law="signed",
    )


def bowed(F_s: float, F_c: float) -> LimitCycle:
    """Return a period of the string under a bow."""
    model, rig = bow(F_s, F_c), Belt(MASS, STIFFNESS, SPEED, DAMPING)
    return limit_cycle(model, rig, near=simulate(model, rig, END, rtol=1e-8, engine=FASTEST))


MODEL = bow(F_S, F_S / 3)


def run() -> dict[str, Any]:
    """Bow the string with several forces."""
    found = {F_s: bowed(F_s, F_s / 3) for F_s in FORCES}
    cycle = found[F_S]
    replayed = {f"{F_S:g} N": cycle.trace}
    fine = cycle.trace.refined(ROWS)  # with both sides of a switch, where F jumps
    v, push = fine.v + SPEED, -fine.F  # of the string, and what the bow does to it
    place = fine.x + SPEED * fine.t
    swing, power = 0.5e6 * np.ptp(place), push * v  # um, W
    forward, backward = (_integral(fine.t, np.maximum(sign * power, 0.0)) for sign in (1.0, -1.0))
    sound = forward - backward
    sticks = _integral(fine.t, 1.0 * (fine.states[:, 0] == "stick")) / cycle.period
    multiplier = abs(cycle.multipliers[0])
    pitches = [1.0 / each.period for each in found.values()]
    sounds, pressed = 1.0 / cycle.period, 1.0 / found[FORCES[-1]].period
    harder = "lower" if pressed < sounds else "higher"
    return locals()


def _integral(t: np.ndarray, u: np.ndarray) -> float:
    return float(0.5 * np.diff(t) @ (u[1:] + u[:-1]))


def _motion(ax: Any, r: Any) -> str:
    t = 1e3 * (r.fine.t - r.fine.t[0])
    ax.plot(t, r.v, **FIRST)
    ax.axhline(SPEED, **GUIDE)
    note(ax, "bow", (t[-1], SPEED), (-2, 3))
    ax.set(xlabel="$t$ [ms]", ylabel="speed of the string [m/s]")
    return f"a period, {MODEL.title}"


def _work(ax: Any, r: Any) -> str:
    ax.plot(r.v, r.push, **SECOND)
    note(ax, "swings back:\nenergy out", (-0.15, 0.1))
    note(ax, "moves along:\nenergy in", (0.01, -0.08))
    ax.axvline(0.0, **GUIDE)
    ax.set(xlabel="speed of the string [m/s]", ylabel="push of the bow [N]")
    return "friction on the string"


def _pitch(ax: Any, r: Any) -> str:
    ax.plot(FORCES, r.pitches, **DOTS)
    own = math.sqrt(STIFFNESS / MASS) / (2.0 * math.pi)
    ax.axhline(own, **GUIDE)
    note(ax, "string alone", (FORCES[0], own), (0, -3))
    ax.set(xlabel="$F_s$ [N]", ylabel="frequency [Hz]")
    return "flattening"


LESSON = Lesson(
    __name__,
    run,
    (_motion, _work, _pitch),
    grid("abc", (10.2, 3.6), widths=(1.2, 1.2, 1)),
    level="undergraduate",
    questions=(
        Question("sounds", "Hz", rtol=0.02),
        Question("swing", "um", rtol=0.25),
        Question("harder", choices=("higher", "lower", "same")),
    ),
    live=lambda: (
        (MODEL, Belt(MASS, STIFFNESS, SPEED, DAMPING), END),
        {"speed": (0.05, 0.3), "F_s": (0.1, 0.4), "damping": (1e-3, 0.1)},
        {},
    ),
)
