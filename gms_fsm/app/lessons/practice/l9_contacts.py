"""Lesson 9: Contacts.

What counts as a contact?

A machine has a bearing, a gear, an end stop, a clutch. They look like different kinds of models.
Here they are one kind. Whatever moves is a body: it has inertia and smooth forces, and its
equations never change. Whatever switches is a contact: a chart on a relative velocity. The chart
gives a force, holds the velocity at 0 (it locks), or sets the velocity (an impact). It does not
know the bodies, and the bodies do not know its states.

| part | relative velocity | chart | in contact it |
|---|---|---|---|
| bearing | load against ground | stiction | locks |
| bearing with pre-sliding | load against ground | a bank of GMS elements | gives a force |
| gear with backlash | motor against load | backlash | gives a force |
| end stop | one mass against another | end stop | sets the velocity |
| dog clutch | shaft against shaft | dog clutch | locks |

Because a contact acts on both bodies with the same impulse, momentum is kept in an impact and when
a clutch closes; energy is not. Because a lock is exact, the velocity of a stuck contact is 0, not
merely small. Each of these statements is checked here on a run, against a formula.

## Predict

1. A mass with Coulomb stiction (F_s = 1.5 N) is pulled from rest through a spring of 2 N/m at
   0.1 m/s. When is it released, in s?
2. What is the largest speed it has while it is stuck, in m/s?
3. A motor turns a load to and fro through a gear: its speed jumps from 0.05 to -0.05 rad/s and
   back. A bearing stops the load at once when nothing drives it. A tooth has 0.04 rad to cross from
   one flank to the other. How long is the load without contact at a reversal, in s?
4. A mass of 1 kg at 1 m/s hits one of 3 kg at rest; the restitution is 0.5. How much energy is
   lost, in J?

## Measure

Run: a mass of {MASS:g} kg, pulled through {STIFFNESS:g} N/m at {SPEED:g} m/s, with stiction and
with {title}; a motor that turns a load to and fro through a backlash; two masses
with a stop between them; two shafts with a dog clutch (all values chosen by us).

Measured: with stiction the mass is stuck at {rows} rows, where the largest |v| is {fastest:g} m/s;
it is released at {released:.6f} s (F_s / (K V) = {due:g} s). With the bank it has crept
{crept[1]!m:.1f} mm when all elements slip, at {crept[0]:.2f} s. The gear has a dead time of
{gap_time:.4f} s at each reversal (2 gap / V + d / k = {gap_due:.4f} s), during which the load
stands still.

Measured: the impact changes the velocities from {v[0]:g} and {v[1]:g} m/s to {v[2]:g} and {v[3]:g}
m/s; momentum changes by {moved[0]:g} kg m/s, energy by {gained[0]:.4f} J. The clutch changes
{w[0]:g} and {w[1]:g} rad/s to {w[2]:.4f} and {w[3]:.4f} rad/s; angular momentum changes by
{moved[1]:g} Nms, energy by {gained[1]:.2f} J.

So: whatever switches is a contact, a chart on a relative velocity; whatever moves is a body. To
exchange stiction for a bank, or a clutch for a bearing, exchange the chart: the bodies stay as they
are.

## Why

The spring needs F_s/(K V) = 7.5 s to pull with 1.5 N. A lock holds the velocity at 0, exactly. The
motor crosses 0.04 rad at 0.05 rad/s in 0.8 s; the damping of the flanks adds 2 ms. An impact loses
(1 - e²)/2 of the reduced mass, 0.75 kg, times the speed squared: 0.28 J.

## A system as code

Two bodies, two contacts. Nothing in the bodies says that they touch.

```python
import inspect

from gms_fsm.app.lessons import l9_contacts

source = inspect.getsource(l9_contacts.gear)
print("return System(" + source.partition("return System(")[2])
```

## Vary a parameter

The same gear with a different gap. While the motor crosses it, the load stands still.

```python
from matplotlib.figure import Figure

from gms_fsm import simulate
from gms_fsm.app.lessons.practice.l9_contacts import PERIOD, dead_time, dead_times, gear


def with_gap(gap):
    trace = simulate(gear(gap), 2 * PERIOD)
    dead = dead_times(trace)
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    ax = figure.subplots()
    ax.plot(trace.t, trace.body("motor").x, "--", color="0.3", label="motor")
    ax.plot(trace.t, trace.body("load").x, label="load")
    ax.set(xlabel="$t$ [s]", ylabel="angle [rad]")
    measured = f"{(dead[:, 1] - dead[:, 0]).mean():.4f}"
    ax.set_title(f"dead time {measured} s; formula {dead_time(gap):.4f} s")
    ax.legend()
    return figure


vary(with_gap, 0.02, 0.005, 0.05, 0.005, "gap [rad]")
```

## Try

- Set the restitution to 0 and to 0.9 (`impact(e=...)`). How much energy is lost? Derive it from
  the reduced mass, and compare.
- Give the clutch a ratio: `v="v_1 - 3 * v_2"`. Which combination of the two angular momenta is
  kept now?
- Replace stiction by the bank in the bearing of the gear. Does the load still stand exactly
  still?
- Damp the flanks twenty times as much (`FLANK`, d = 8). Why does the formula for the dead time
  fail? Look at the speed of the load when the flank lets go.

## Solutions

- 0.375 J and 0.071 J: (1 - e²)/2 times the reduced mass, m_1 m_2/(m_1 + m_2) = 0.75 kg, times the
  speed squared.
- The contact takes P from the first shaft and gives 3 P to the second: 3 J_1 w_1 + J_2 w_2 is kept.
  With 10 rad/s at the start the shafts turn at 8.18 and 2.73 rad/s.
- No: the load moves on the bristles of the bank, in a bank of 100 Nm/rad by 0.45 mrad while it has
  no contact.
- The formula assumes that the load stands still when the flank lets go, and lets it go 40 ms early.
  But the flank is pressed in by no more than 0.1 Nm / 200 Nm/rad, which the motor takes back in
  10 ms; it lets go at once, while the load still turns at 0.05 rad/s. The dead time is 0.809 s.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from gms_fsm import Body, Contact, Spring, System, Trace, simulate
from gms_fsm.app.lessons.basics.l6_stick_slip import SIGMA_2, F_c, F_s, bank
from gms_fsm.app.lessons.engine.lesson import FIRST, GUIDE, SECOND, Lesson, draw, grid, note
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.charts import CHARTS
from gms_fsm.charts.parameters import FloatArray
from plots.style import INK, LINE_GREY

MASS, STIFFNESS, SPEED = 1.0, 2.0, 0.1  # kg, N/m, m/s: the pulled mass
DRY = {"F_c": F_c, "F_s": F_s, "b": SIGMA_2}  # N, N, Ns/m
FLANK = {"k": 200.0, "d": 0.4, "gap": 0.02}  # Nm/rad, Nms/rad, rad
MOTOR, PERIOD = 0.05, 8.0  # rad/s, s: the motor turns at this speed, forward and backward
BEARING = {"F_c": 0.1, "F_s": 0.15, "b": 0.01}  # Nm, Nm, Nms/rad
STOP = {"x_s": 0.1, "e": 0.5, "v_r": 1e-6}  # m, 1, m/s
MASSES, PUSH = (1.0, 3.0), 1.0  # kg, m/s: speed of the mass that hits the other
DOG = {"t_on": 1.0, "t_off": 10.0}  # s
INERTIAS, SPUN = (1.0, 2.0), 10.0  # kg m2, rad/s: speed of the shaft that turns


def pulled(*, bristles: bool = False) -> System:
    """Return a mass pulled through a spring, with stiction or with the bank of lesson 6.

    Examples
    --------
    >>> pulled().contacts[0].chart.name
    'Coulomb friction with stiction'
    """
    pad = Contact("pad", bank()) if bristles else Contact("pad", CHARTS["stiction"], DRY)
    return System(
        "pulled mass",
        bodies=(Body("mass", inertia="m"),),
        springs=(Spring("pulled", "mass", k="K", rest="V * t"),),
        contacts=(pad,),
        numbers={"m": MASS, "K": STIFFNESS, "V": SPEED},
    )


def gear(gap: float = FLANK["gap"]) -> System:
    """Return a motor that turns to and fro, and a load with stiction behind a backlash [rad].

    Examples
    --------
    >>> [contact.name for contact in gear().contacts]
    ['gear', 'bearing']
    """
    return System(
        "gear with backlash",
        bodies=(
            Body("motor", velocity="V * sgn(sin(2 * pi * t / T))", x="q_m", v="w_m", rotary=True),
            Body("load", inertia="J", x="q_l", v="w_l", rotary=True),
        ),
        contacts=(
            Contact("gear", CHARTS["backlash"], {**FLANK, "gap": gap}, v="w_m - w_l"),
            Contact("bearing", CHARTS["stiction"], BEARING, v="w_l"),
        ),
        numbers={"V": MOTOR, "T": PERIOD, "J": 5e-3},
    )


def impact(e: float = STOP["e"]) -> System:
    """Return two masses with a stop between them, of restitution e.

    Examples
    --------
    >>> impact().contacts[0].v
    ('v_1 - v_2',)
    """
    stop = Contact("stop", CHARTS["end-stop"], {**STOP, "e": e}, v="v_1 - v_2")
    return _pair(stop, MASSES)


def clutch() -> System:
    """Return two shafts with a dog clutch.

    Examples
    --------
    >>> clutch().contacts[0].chart.locks
    True
    """
    dog = Contact("dog", CHARTS["dog-clutch"], DOG, v="v_1 - v_2")
    return _pair(dog, INERTIAS, rotary=True)


def _pair(contact: Contact, inertias: tuple[float, float], *, rotary: bool = False) -> System:
    bodies = (
        Body(name, inertia=f"m_{i}", x=f"x_{i}", v=f"v_{i}", rotary=rotary)
        for i, name in enumerate(("one", "two"), 1)
    )
    numbers = dict(zip(("m_1", "m_2"), inertias, strict=True))
    return System(contact.name, bodies=tuple(bodies), contacts=(contact,), numbers=numbers)


def run() -> dict[str, Any]:
    """Run the five systems."""
    stiction, bristles = (simulate(pulled(bristles=each), 25.0) for each in (False, True))
    replayed = {"stiction": stiction, "GMS bank": bristles}
    speeds_while_stuck = stiction.v[stiction.states[:, 0] == "stuck"]
    rows, fastest = speeds_while_stuck.size, abs(speeds_while_stuck).max()
    speed_while_stuck = fastest
    released, due = float(stiction.transitions.t[0]), F_s / (STIFFNESS * SPEED)
    slips = np.flatnonzero((bristles.states == "slip").all(axis=1))[0]
    crept = bristles.t[slips], bristles.x[slips]
    title = bank().title

    turned = simulate(gear(), 2 * PERIOD)
    dead = dead_times(turned)
    gap_time, gap_due = np.diff(dead).mean(), dead_time()
    dead_time_of_gear = gap_time

    hit = simulate(impact(), 0.3, initial={"one.v": PUSH})
    closed = simulate(clutch(), 2.0, initial={"one.v": SPUN})
    pairs = ((hit, MASSES), (closed, INERTIAS))
    v, w = (_speeds(trace)[:, [0, -1]].T.ravel() for trace, _ in pairs)
    momentum, spin = (_total(inertias, trace) for trace, inertias in pairs)
    moved = np.ptp(momentum), np.ptp(spin)
    gained = [np.diff(0.5 * _total(m, trace, 2)[[0, -1]])[0] for trace, m in pairs]
    lost = -gained[0]
    return locals()


def dead_times(trace: Trace) -> FloatArray:
    """Return begin and end of the intervals without contact in the gear, after the first, s."""
    log = trace.contact("gear").transitions
    return np.column_stack([log.t[log.target == "apart"], log.t[log.source == "apart"][1:]])


def dead_time(gap: float = FLANK["gap"]) -> float:
    """Return the time in which the motor crosses the gap [rad] while the load stands still, s.

    With damping a flank lets go early, d V / k before the gap opens, since it cannot pull.

    Examples
    --------
    >>> round(dead_time(0.02), 9)
    0.802
    """
    return 2 * gap / MOTOR + FLANK["d"] / FLANK["k"]


def _speeds(trace: Trace) -> FloatArray:
    return np.stack([trace.body(name).v for name in ("one", "two")])


def _total(inertias: tuple[float, float], trace: Trace, power: int = 1) -> FloatArray:
    """Return inertia times speed**power, summed over the bodies, at all rows."""
    one, two = _speeds(trace) ** power
    return np.asarray(inertias[0] * one + inertias[1] * two)


def _mass(ax: Any, r: Any, end: float, name: str, factor: float) -> None:
    for trace, look in ((r.stiction, FIRST), (r.bristles, SECOND)):
        fine = trace.sample(np.linspace(0.0, end, 2001))
        ax.plot(fine.t, factor * getattr(fine, name), **look)


def _moving(ax: Any, r: Any) -> str:
    _mass(ax, r, r.stiction.t[-1], "v", 1.0)
    ax.set(xlabel="$t$ [s]", ylabel="$v$ [m/s]", xlim=(0, r.stiction.t[-1]))
    return f"pulled mass; dashed: {r.title}"


def _states(ax: Any, r: Any) -> str:
    draw("ribbons", ax, r.stiction)
    ax.set(yticklabels=["pad"])
    return "states with stiction"


def _before(ax: Any, r: Any) -> str:
    _mass(ax, r, r.released, "x", 1e3)
    note(ax, "bank: the bristles yield", (3.0, 600 * r.crept[1]))
    note(ax, "stiction: x = 0", (3.0, 1.0), color=INK)
    ax.set(xlabel="$t$ [s]", ylabel="$x$ [mm]", xlim=(0, 8))
    return "before stiction lets go"


def _gear(ax: Any, r: Any) -> str:
    for begin, end in r.dead:
        ax.axvspan(begin, end, color=LINE_GREY, alpha=0.25, linewidth=0, zorder=0)
    for name, look in (("motor", SECOND), ("load", FIRST)):
        ax.plot(r.turned.t, r.turned.body(name).x, **look, label=name)
    ax.axhline(0, **GUIDE)
    begin, end = r.dead[0]
    note(ax, f"dead time {end - begin:.3f} s", (end, 0.005), (4, 0))
    ax.legend(loc="upper right")
    ax.set(xlabel="$t$ [s]", ylabel="angle [rad]", xlim=(0, 2 * PERIOD))
    return "gear with backlash; shaded: no contact"


def _both(ax: Any, r: Any, pair: tuple[str, ...]) -> str:
    """Draw two velocities, and the mean weighted by inertia, which the contact cannot change."""
    name, kept, unit, mean, title = pair
    trace = r.values[name]
    for speed, look, body in zip(_speeds(trace), (FIRST, SECOND), ("one", "two"), strict=True):
        ax.plot(trace.t, speed, **look, label=body)
    total = r.values[kept] / sum(MASSES if name == "hit" else INERTIAS)
    ax.plot(trace.t, total, ":", color=LINE_GREY, linewidth=2, label=mean)
    ax.legend(loc="upper right")
    ax.set(xlabel="$t$ [s]", ylabel=unit, xlim=(0, trace.t[-1]))
    return title


PAIRS = (
    ("hit", "momentum", "v [m/s]", "centre of mass", "impact at a stop"),
    ("closed", "spin", "speed [rad/s]", "mean by inertia", "a dog clutch closes"),
)
LESSON = Lesson(
    __name__,
    run,
    (_moving, _states, _before, _gear, *(partial(_both, pair=pair) for pair in PAIRS)),
    grid("ac;bc;dd;ef", (8.2, 8.6), (1.6, 0.5, 1.8, 1.8)),
    level="undergraduate",
    questions=(
        Question("released", "s", rtol=0.02),
        Question("speed_while_stuck", "m/s", atol=1e-4),
        Question("dead_time_of_gear", "s", rtol=0.02),
        Question("lost", "J", rtol=0.02),
    ),
    live=lambda: (
        (pulled(), 25.0),
        {"numbers.V": (0.02, 0.3), "numbers.K": (1.0, 8.0), "pad.F_s": (1.0, 3.0)},
        {},
    ),
)
