"""Lesson 2: Drift.

Why does LuGre drift and GMS not?

A slider is pushed with a force below break-away and then shaken. LuGre's bristle gives way at any
load: ``dz = v - sigma_0 |v| z / s(v)``, so x - z grows at the rate sigma_0 |v| z / s(v), which has
the sign of z whichever way the slider moves. Under a load every stroke, forward or backward,
creeps forward. A GMS element in stick has ``dz = v``: it is a spring, x - z is constant, and every
deflection is recovered.

With the numbers of Table I of the paper there is nothing else to see: no element can slip at 0.5 N,
so the run would look the same with four ordinary springs, and their stiffness is a ninth of
LuGre's. A third run therefore has a bank that is as stiff as LuGre, and as damped, with thresholds
of w_i = 0.25/k_i (chosen by us): an element really slips and arrests, and then nothing drifts.

## Predict

A mass of 1 kg is pushed with 0.5 N, then with a constant 0.25 N; a vibration of ±0.1 N at 2 Hz is
added. The friction can hold up to 1.5 N, far more than that: s(v) falls from 1.5 N at rest to 1.1 N
at 1.3 mm/s, about the largest speed of the vibration. Two models have a stiffness of
sigma_0 = 1000 N/m and carry F = sigma_0 z:

- LuGre, whose bristle yields at any load: x - z grows at the rate sigma_0 |v| z / s(v);
- a GMS bank, whose elements are springs until they reach a threshold.

1. How fast does the mass creep with LuGre, in mm/s? (How far does it move in a second, to and fro?)
2. And with the GMS bank, after it has slipped once?

## Measure

Run: 1 kg pushed by F_a up to 0.5 N, then 0.25 N and a vibration of 0.1 N at 2 Hz (chosen by us);
LuGre with sigma_0 = {stiffness:g} N/m; {springs.model.title}, Table I; {slipping.model.title}, as
stiff as LuGre, with weights 0.25/k (chosen by us).

Measured: LuGre is at {crept[0]!m:.2f} mm at 2 s and at {crept[1]!m:.2f} mm at {END:g} s, a steady
{drifts[0]!m:.2f} mm/s; {plastic[0]!m:.2f} mm of it is plastic (x - z). GMS with Table I stays
between {ranges[1][0]!m:.3f} and {ranges[1][1]!m:.3f} mm, with {switches} transitions: element 1
would need {needed:.0f} N to slip.

Measured with elements that slip: {story}; then x stays between {ranges[2][0]!m:.2f} and
{ranges[2][1]!m:.2f} mm, drift {drifts[2]:.0e} m/s.

So: under a load every stroke of LuGre, forward or backward, is slightly plastic; a GMS element is a
pure spring below its threshold. To show this, use a run with slip: with Table I four springs behave
the same.

## Why

LuGre's bristle yields under any load, in proportion to the distance moved, whichever way the slider
moves. The vibration moves it by 0.1 N / 1000 N/m = 0.1 mm each way, 0.8 mm in a second; of that it
keeps the share F/s, about 0.25/1.2: 0.17 mm/s. It is a little more, mainly because the mass swings
along: at 2 Hz its inertia makes the stroke almost a fifth longer. A GMS element below its threshold
is a spring: what it gives way it takes back. What is left is rounding.

## Vary a parameter

The force above oscillates with an amplitude of 0.1 N. LuGre's drift grows with the amplitude; the
GMS bank that has slipped once only oscillates with a larger stroke.

```python
from matplotlib.figure import Figure

from gms_fsm import GMS, Slider, simulate
from gms_fsm.app.lessons.basics.l2_drift import BANK, END, TABLE_I, cycle_means
from gms_fsm.app.paper.experiments import lugre_like


def shaken(amplitude):
    force = f"min(0.25*t, max(0.25, 0.75 - 0.125*t)) + {amplitude}*sin(2*pi*2*(max(t, 4) - 4))"
    gms = GMS(BANK, law="signed")
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    for name, model in (("LuGre", lugre_like(TABLE_I)), ("GMS, as stiff", gms)):
        trace = simulate(model, Slider(1.0, force), END)
        t, x = cycle_means(trace)
        drift = 1e3 * (x[-1] - x[0]) / (t[-1] - t[0])
        ax.plot(trace.t, 1e3 * trace.x, label=f"{name}: {drift:.2f} mm/s")
    ax.set(xlabel="$t$ [s]", ylabel="$x$ [mm]", title=f"force amplitude {amplitude:g} N")
    ax.legend()
    return figure


vary(shaken, 0.1, 0, 0.2, 0.02, "amplitude [N]")
```

## Try

- At which weights w_i = c/k_i does the first element begin to slip?
- Does LuGre drift backward if the load is removed before the oscillation starts?
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from gms_fsm import GMS, GMSParameters, Slider, Trace, simulate
from gms_fsm.app.lessons.engine.lesson import Lesson, draw, grid, note
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.app.paper import FORCE
from gms_fsm.app.paper.experiments import lugre_like
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.charts.zoo.bristles.lugre import BENCHMARK
from gms_fsm.language import evaluate
from gms_fsm.systems.signals import Formula
from plots.style import INK, LINE_GREY

END = 30.0  # s
PERIOD, STEADY = 0.5, 10.0  # s: period of the shaking, and start of the measurement
TABLE_I = GMSParameters.paper("non-drifting")
OF_LUGRE: Any = BENCHMARK.values
STIFFER = OF_LUGRE["sigma_0"] / TABLE_I.k.sum()
BANK = GMSParameters(  # the proportions of Table I, with LuGre's stiffness and damping
    STIFFER * TABLE_I.k,
    TABLE_I.sigma * (OF_LUGRE["sigma_1"] / TABLE_I.sigma.sum()),
    TABLE_I.C / STIFFER,
    sigma_2=TABLE_I.sigma_2,
    stribeck=TABLE_I.stribeck,
    v_c=TABLE_I.v_c,
    weights=0.25 / (STIFFER * TABLE_I.k),
)
GRID = np.linspace(0.0, END, 6001)


def run() -> dict[str, Any]:
    """Push and shake the three sliders."""
    models = (
        lugre_like(TABLE_I),
        GMS(TABLE_I, law="published"),
        GMS(BANK, law="signed"),
    )
    runs = [simulate(model, Slider(1.0, FORCE), END) for model in models]
    lugre, springs, slipping = runs
    replayed = {"GMS, as stiff": slipping, "LuGre": lugre}
    stiffness = BANK.k.sum()
    crept = lugre.sample([2.0, END]).x
    drifts = np.array([np.polyfit(*cycle_means(trace), 1)[0] for trace in runs])
    lugre_drift, gms_drift = 1e3 * drifts[0], 1e3 * abs(drifts[2])
    plastic = np.array([trace.x[-1] - trace.z[-1, 0] for trace in runs])
    steady = [trace.sample(np.linspace(STEADY, END, 4001)).x for trace in runs]
    ranges = [(x.min(), x.max()) for x in steady]
    switches, needed = len(springs.transitions), TABLE_I.k[0] * TABLE_I.stribeck.F_s
    story = [f"element {r.element + 1} {r.edge} at {r.t:.3f} s" for r in slipping.transitions]
    return locals()


def cycle_means(trace: Trace) -> tuple[FloatArray, FloatArray]:
    """Return the middle of each cycle of the vibration [s], and the mean position in it [m]."""
    starts = np.arange(STEADY, END, PERIOD)
    phases = PERIOD * (np.arange(50) + 0.5) / 50
    x = trace.sample((starts[:, None] + phases).ravel()).x
    return starts + PERIOD / 2, x.reshape(starts.size, -1).mean(axis=1)


def _push(ax: Any, _: Any) -> str:
    tree = Formula(FORCE).tree
    ax.plot(GRID, [evaluate(tree, {"t": t}) for t in GRID.tolist()], color=INK, linewidth=0.9)
    ax.set(xlim=(0, END), ylim=(0, 0.55), ylabel="$F_a$ [N]")
    return "applied force (chosen by us)"


def _place(ax: Any, r: Any) -> str:
    x = {name: 1e3 * r.values[name].sample(GRID).x for name in LOOPS}
    for name, colour in (("springs", LINE_GREY), ("slipping", INK), ("lugre", INK)):
        ax.plot(GRID, x[name], color=colour, linewidth=0.9)
    end, last = 0.995 * END, slice(-200, None)
    soft = x["springs"][last]
    note(ax, "LuGre: creeps with every stroke", (end, x["lugre"].max()), (-1, 5))
    note(ax, "black: GMS, as stiff, signed law", (end, soft.max()), (-1, 5))
    note(ax, "grey: GMS, Table I, published law", (end, soft.min()), (-1, -5))
    ax.set(xlim=(0, END), ylim=(0, 1.2 * max(map(np.max, x.values()))))
    ax.set(xlabel="$t$ [s]", ylabel="$x$ [mm]")
    return "position"


def _loop(ax: Any, r: Any, name: str, title: str) -> str:
    phases = [("rising", 2.0), ("falling", 4.0), ("shaking", np.inf)]
    draw("hysteresis", ax, r.values[name], phases)[1].set(linestyle="--")
    ax.set_ylim(-0.02, 0.62)
    if name == "lugre":
        ax.legend(loc="upper right")
    if name == "slipping":
        peak = r.slipping.F.argmax()
        text = f"{r.slipping.F[peak]:.2f} N for a moment:\n" r"$\sigma_1$ dz as it stops"
        note(ax, text, (1e3 * r.slipping.x[peak], 0.62), (-6, -3))
    return title


LOOPS = {"lugre": "LuGre", "springs": "GMS, Table I", "slipping": "GMS, as stiff"}
LESSON = Lesson(
    __name__,
    run,
    (_push, _place, *(partial(_loop, name=name, title=title) for name, title in LOOPS.items())),
    grid("aaa;bbb;cde", (8.2, 7.4), (0.7, 1.7, 1.5)),
    level="graduate",
    questions=(
        Question("lugre_drift", "mm/s", rtol=0.25),
        Question("gms_drift", "mm/s", atol=1e-3),
    ),
    live=lambda: (
        (GMS(BANK, law="signed"), Slider(1.0, FORCE), END),
        {"mass": (0.5, 2.0), "weights1": None},
        {},
    ),
)
