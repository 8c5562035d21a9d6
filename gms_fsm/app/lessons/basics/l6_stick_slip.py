"""Lesson 6: Stick-slip.

Why does a pulled mass stick and slip?

A mass is pulled through a soft spring whose end moves at V. It waits until the spring pulls with
F_s. When it begins to slide, friction falls along the Stribeck curve from F_s to F_c, and the
surplus force throws it forward until the spring is slack enough for it to stop. Then it waits
again.

A cycle thus has two different parts. The wait is the time needed to stretch the spring again by
the same amount: a length divided by V. The slip is a swing of a mass on a spring and hardly
depends on V. At a high speed the mass no longer comes to rest and slides.

## Predict

A mass of 1 kg is pulled through a spring of 2 N/m whose end moves at V. Friction is 1.5 N at rest
and falls to 1 N in sliding, from about 0.05 m/s on; to that comes a viscous friction of
sigma_2 = 0.4 Ns/m.

1. V = 0.1 m/s: with which force does the spring pull when the mass begins to slide, in N?
2. And when it comes to rest again, in N? It swings about the force of steady sliding,
   F_c + sigma_2 V, and sigma_2 damps the swing.
3. At V = 0.01 m/s, how long is a period of stick and slip, in s?

## Measure

Run: {portrait.model.title}, {MASS:g} kg pulled from rest through {STIFFNESS:g} N/m at {SPEED:g}
m/s, and at {SPEEDS[0]:g} to {TOO_FAST:g} m/s (F_s = {F_s:g}, F_c = {F_c:g} N, v_s = {V_S:g} m/s,
all chosen by us).

Measured at {SPEED:g} m/s: {switches} transitions in {END:g} s, {arrests} of them arrests, v from
{slowest:.3f} to {fastest:.2f} m/s; the spring pulls with {here.pull_at_slip:.2f} N at gross slip
and with {here.pull_at_stop:.2f} N at the first arrest; period {here.period:.2f} s.

Measured: the period falls from {cycles[0].period:.1f} s at {SPEEDS[0]:g} m/s to {last.period:.1f} s
at {last.V:g} m/s: a wait of {shortest!m:.0f} to {longest!m:.0f} mm / V and a slip of
{slips_range[0]:.1f} to {slips_range[1]:.1f} s. Arrests in other runs: {said_rests}.

So: stick-slip needs friction that falls with speed, and a slow pull; the wait is a length divided
by V. At {last.V:g} m/s both are possible: started from rest the mass sticks and slips, started in
motion it keeps sliding.

## Why

The mass begins to slide at F_s. The surplus of 0.5 N accelerates it, and it overshoots. Without
damping the spring would end as far below the force of sliding as it began above it. A mass of 1 kg
on 2 N/m with 0.4 Ns/m has a damping ratio of 0.4/(2 √2) = 0.14, so that half a swing leaves 64 %:
from about 0.46 N above 1.04 N to 0.3 N below it, 0.75 N. Friction does not fall at once, so that it
is a little more. The wait is the time to stretch the spring again by some 0.36 m: 36 s at 0.01 m/s.
To it comes the slip. Half a swing would take 2.2 s; it takes longer, because it starts slowly:
friction falls only as the speed grows.

## Vary a parameter

The same mass on the same spring, pulled from rest at a different speed.

```python
from matplotlib.figure import Figure

from gms_fsm import PulledSlider, simulate
from gms_fsm.app.lessons.basics.l6_stick_slip import MASS, STIFFNESS, bank


def pulled(V):
    trace = simulate(bank(), PulledSlider(MASS, STIFFNESS, V), 60.0)
    arrests = (trace.transitions.edge == "arrest").sum()
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    ax = figure.subplots()
    ax.plot(trace.t, trace.v)
    ax.axhline(V, color="0.6", linestyle="--", linewidth=1)
    ax.set(xlabel="$t$ [s]", ylabel="$v$ [m/s]", title=f"V = {V:g} m/s (dashed): {arrests} arrests")
    return figure


vary(pulled, 0.05, 0.02, 0.3, 0.01, "V [m/s]")
```

## Try

- At which speed does stick-slip end? Does a stiffer spring raise or lower that speed?
- Remove the Stribeck curve: `bank(F_s=1.0)`.
- With v_s = 1e-3 m/s it never comes to rest again. Why? Look at v just before break-away.

## Solutions

- Started from rest the mass sticks and slips up to 0.21 m/s. A stiffer spring lowers that speed: it
  is 0.14 m/s with 8 N/m. The surplus of 0.5 N lasts for a shorter way, so the swing is smaller.
- With F_s = F_c there is no surplus, and the mass slides on at V: no arrests.
- The bristles creep at 2 mm/s when the first element breaks away, and at 23 mm/s when the last one
  does. That is far beyond 1e-3 m/s: friction is down at F_c before the mass slides, as without a
  Stribeck curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm import GMS, GMSParameters, PulledSlider, Stribeck, Trace, simulate
from gms_fsm.app.lessons.engine.lesson import GUIDE, Lesson, draw, grid, note, shown, ticks
from gms_fsm.app.lessons.engine.predict import Question
from plots.style import INK, LINE_GREY, TEXT_GREY

MASS, STIFFNESS = 1.0, 2.0  # kg, N/m
SPEED, END = 0.1, 60.0  # m/s, s: for the phase portrait
SPEEDS = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2)  # m/s
TOO_FAST = 0.25  # m/s
F_c, F_s, V_S = 1.0, 1.5, 0.05  # N, N, m/s
SIGMA_2 = 0.4  # Ns/m
K = np.array([40.0, 30.0, 20.0, 10.0])  # N/m
WINDOW = (30.0, 60.0)  # s


@dataclass(frozen=True)
class Cycle:
    """The last complete cycle of a run at V [m/s].

    Times from gross slip to the first arrest, and from there to the next gross slip [s]; forces
    of the spring at both ends of the wait [N].
    """

    V: float
    slip: float
    wait: float
    pull_at_slip: float
    pull_at_stop: float

    @property
    def period(self) -> float:
        """Of stick and slip, s."""
        return self.wait + self.slip


def run() -> dict[str, Any]:
    """Pull the mass at several speeds."""
    portrait = pulled(bank(), SPEED)
    replayed = {f"pulled at {SPEED:g} m/s": portrait}
    switches, arrests = len(portrait.transitions), _arrests(portrait)
    slowest, fastest = portrait.v.min(), portrait.v.max()
    # Long enough for the first pull and three cycles.
    cycles = [last_cycle(pulled(bank(), V, 2.0 / V + 20.0)) for V in SPEEDS]
    here, last = cycles[SPEEDS.index(SPEED)], cycles[-1]
    pull_at_slip, pull_at_stop, period = here.pull_at_slip, here.pull_at_stop, cycles[0].period
    waits, slips = (np.array([getattr(each, name) for each in cycles]) for name in ("wait", "slip"))
    lengths = waits * SPEEDS
    shortest, longest = lengths.min(), lengths.max()
    slips_range = slips.min(), slips.max()
    s = float(bank().stribeck(last.V))
    sliding = {
        "x": -(s + SIGMA_2 * last.V) / STIFFNESS,
        "v": last.V,
        "z": s * bank().weights,
        "states": ["slip"] * K.size,
    }
    others = {
        f"at {TOO_FAST:g} m/s": pulled(bank(), TOO_FAST),
        f"at {SPEED:g} m/s with F_s = F_c": pulled(bank(F_s=F_c), SPEED),
        f"at {last.V:g} m/s, started in motion": pulled(bank(), last.V, initial=sliding),
    }
    rests = {name: _arrests(trace) for name, trace in others.items()}
    said_rests = [f"{count} {name}" for name, count in rests.items()]
    return locals()


def bank(F_s: float = F_s) -> GMS:
    """Return four elements, each with a quarter of the friction; F_s is the stiction, N.

    Examples
    --------
    >>> bank().title
    'GMS, 4 elements, signed law'
    """
    curve = Stribeck(F_c=F_c, F_s=F_s, v_s=V_S)
    damping: dict[str, Any] = {"sigma": [0.4, 0.3, 0.2, 0.1], "C": [0.02] * 4, "sigma_2": SIGMA_2}
    parameters = GMSParameters(K, stribeck=curve, v_c=1e-6, weights=1 / (4 * K), **damping)
    return GMS(parameters, law="signed")


def pulled(model: GMS, V: float, end: float = END, **options: Any) -> Trace:
    """Run a mass that is pulled at V, m/s."""
    return simulate(model, PulledSlider(MASS, STIFFNESS, V), end, **options)


def _arrests(trace: Trace) -> int:
    return int((trace.transitions.edge == "arrest").sum())


def last_cycle(trace: Trace) -> Cycle:
    """Measure the last complete cycle of a run with at least two gross slips."""
    log = trace.transitions
    slipping = np.cumsum(np.where(log.target == "slip", 1, -1))
    starts = log.t[(slipping == trace.n) & (log.target == "slip")][-2:]
    arrests = log.t[log.edge == "arrest"]
    stop = arrests[np.searchsorted(arrests, starts[0])]
    ends = trace.sample([stop, starts[1]])
    assert isinstance(trace.rig, PulledSlider)
    V = float(trace.rig.speed)
    at_stop, at_slip = trace.rig.stiffness * (V * ends.t - ends.x)
    return Cycle(V, stop - starts[0], starts[1] - stop, pull_at_slip=at_slip, pull_at_stop=at_stop)


def _portrait(ax: Any, r: Any) -> str:
    draw("portrait", ax, r.portrait, window=WINDOW)
    v = np.linspace(0.0, 0.38, 400)
    look = GUIDE | {"linestyle": "--", "linewidth": 1.2}
    ax.plot(1e3 * v, bank().stribeck(v) + SIGMA_2 * v, **look)
    ax.set_ylim(0.6, 1.55)
    for text, place in (
        ("thrown forward →", (150, 1.33)),
        ("← slows down", (200, 1.03)),
        ("waits, oscillating\non its bristles", (45, 0.77)),
        (r"dashed: steady, s(v) + $\sigma_2$ v", (120, 0.63)),
    ):
        note(ax, text, place)
    return "friction over velocity"


def _parts(ax: Any, r: Any) -> str:
    V = np.array(SPEEDS)
    guide = np.geomspace(V[0], V[-1], 20)
    length = float(np.median(r.waits * V))
    ax.loglog(guide, length / guide, ":", color=LINE_GREY)
    note(ax, f"{length:.2f} m / V", (0.03, length / 0.03), (-4, -4))
    for name, times, look, colour in (
        ("period", r.waits + r.slips, "D-", INK),
        ("wait", r.waits, "o-", TEXT_GREY),
        ("slip", r.slips, "s--", LINE_GREY),
    ):
        ax.loglog(V, times, look, color=colour, markersize=5)
        ink = INK if name == "period" else TEXT_GREY
        note(ax, name, (V[-1], times[-1]), (7, 0), va="center", color=ink, fontsize=9)
    ticks(ax, "x", (0.01, 0.02, 0.05, 0.1, 0.2))
    ticks(ax, "y", (1, 2, 5, 10, 20, 50))
    ax.set(xlabel="pulling speed $V$ [m/s]", ylabel="time [s]", xlim=(0.009, 0.33))
    return "a cycle and its parts"


VELOCITY = "velocity, pulled at {SPEED:g} m/s; {portrait.model.title}"
LESSON = Lesson(
    __name__,
    run,
    (
        shown("velocity", "portrait", VELOCITY, window=WINDOW),
        shown("ribbons", "portrait", "states", window=WINDOW),
        _portrait,
        _parts,
    ),
    grid("aa;bb;cd", (8.2, 7.8), (1, 0.9, 2)),
    level="undergraduate",
    questions=(
        Question("pull_at_slip", "N", rtol=0.05),
        Question("pull_at_stop", "N", rtol=0.15),
        Question("period", "s", rtol=0.1),
    ),
    live=lambda: (
        (bank(), PulledSlider(MASS, STIFFNESS, SPEED), END),
        {"speed": (0.02, 0.3), "stiffness": (1.0, 8.0), "F_s": (1.0, 2.0)},
        {},
    ),
)
