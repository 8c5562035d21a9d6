r"""Lesson 0: A first chart.

What do a traffic light and friction have in common?

Both wait in one of a few states, until something happens. A state chart says which states there
are, and for each way out of a state, an edge, when it is taken. What it waits for can be

- an event, such as a button that is pressed: it is heard at one instant, and then forgotten;
- a time: ``after(3)`` holds when the chart has been in the state for 3 s;
- a guard, a comparison of quantities that change smoothly, such as ``T > 21``. The edge is taken
  at the instant at which it begins to hold.

While a chart stays in a state, the state says what goes on: what it gives out (a heater on or off)
and how its quantities flow. A log lists each edge that was taken, and when.

| chart | states | an edge waits for | meanwhile |
|---|---|---|---|
| light | green, amber, red | an event, a time | nothing flows |
| thermostat | off, on | a guard over T | it heats, or not |
| friction | stick, slip | a guard over z and v | z follows v, or settles |

The third is a friction element: a bristle between two surfaces, bent by z, that pulls back with
k z. In stick its foot holds, and it bends as fast as the surfaces move: z' = v. In slip its foot
slides: z settles where the bristle carries the friction at this speed, z = s(v).

## Predict

A light for pedestrians, as a chart. It begins in its first state, green for the cars. Each edge
says from which state it leads to which, and what it waits for: an event, or a time:

```python
from gms_fsm import Chart, State, Transition

light = Chart(
    "traffic light",
    inputs=(),
    velocities=(),  # it is no contact: nothing rubs
    states=(State("green"), State("amber"), State("red")),
    transitions=(
        Transition("warn", "green", "amber", event="button"),
        Transition("halt", "amber", "red", guard="after(3)"),
        Transition("go", "red", "green", guard="after(12)"),
    ),
)
light
```

1. Somebody presses the button every 14 s, first at 14 s. How long is it from one red to the next,
   in s?

A thermostat has two states, too. Its guards read the temperature T of the room, in °C, and each
state gives out u, which switches the heater. Here low is 19 °C and high is 21 °C:

```python
from gms_fsm.app.lessons.basics.l0_first_chart import THERMOSTAT

THERMOSTAT
```

2. It is 20 °C. Is the heater "on", "off", or can it be "either"?

Now friction, a bristle of 100 N/m. It has states with a flow, and edges with a guard:

```python
from gms_fsm.app.lessons.basics.l0_first_chart import ELEMENT

ELEMENT
```

3. A mass of 1 kg lies on this bristle and is pulled from rest through a spring of 2 N/m, whose end
   moves at 0.1 m/s. Friction can hold 1.5 N. After how many seconds does the element slip?

## Measure

Run: the light, and a button that is pressed every {EVERY:g} s; a room that the heater brings to
{HOT:g} °C, and that cools to 0 °C without it, with a time constant of {TAU:g} s; {title},
{MASS:g} kg pulled through {STIFFNESS:g} N/m at {SPEED:g} m/s (all chosen by us).

Measured: {heard} of {presses} presses turn the light, and {red_to_red:g} s lie between two reds.
The heater is switched on at {low:.1f} °C and off at {high:.1f} °C, every {cycle:.1f} s; at 20 °C it
is {heater_at_20}: off while the room cools, on while it warms.

Measured: the element slips first after {slips[0]:.2f} s, bent by {bent!m:.1f} mm, and sticks again
after {arrests[0]:.2f} s; then it slips every {period:.2f} s. The spring pulls with {pulls[0]:.2f} N
at a slip, and with {pulls[1]:.2f} N when the element sticks again.

So: what happens next depends on the state and on what its edges wait for, in a light, in a heater,
in friction. A room goes to and fro between two temperatures, and the pull of the spring between two
forces: this is stick-slip.

## Why

The light turns amber at 14 s, red at 17 s and green at 29 s. The press at 28 s finds it red: no
edge out of red waits for it, so it is forgotten, and the next one is at 42 s. Between its two
limits the thermostat keeps the state that it has; this is called hysteresis. The spring pulls with
1.5 N after 1.5 / (2 · 0.1) = 7.5 s. The rest is the bristle, which lets the mass creep
by 15 mm, and its damping.

## Read the logs

They read alike: when, who, from which state to which, by which edge.

```python
for trace in result.lights, result.warmed, result.pulled:
    for r in trace.transitions[:5]:
        print(f"{r.t:8.2f} s  {r.contact}: {r.source} -> {r.target} by {r.edge}")
    print()
```

## Vary a parameter

The same light, and somebody with more or less patience.

```python
from matplotlib.figure import Figure

from gms_fsm import simulate
from gms_fsm.app.lessons.basics.l0_first_chart import crossing
from plots.panels import ribbons


def pressed(every):
    trace = simulate(crossing(every), 120.0)
    figure = Figure(figsize=(6.4, 1.8), layout="constrained")
    ax = figure.subplots()
    ribbons(ax, trace.supervisor("light"))
    log = trace.transitions
    ax.plot(log.t[log.edge == "press"], 0 * log.t[log.edge == "press"] + 0.5, "kv", clip_on=False)
    reds = (log.edge == "halt").sum()
    ax.set(yticks=[], title=f"pressed (triangles) every {every:g} s: {reds} times red in 120 s")
    return figure


vary(pressed, 14, 4, 40, 1, "every [s]")
```

## Try

- Give `warn` a guard as well, `guard="after(20)"`. Which presses are heard now?
- The light forgets a press while it is red. A state can remember it: write a chart of the button
  box, with the states idle and pressed, and let `warn` ask for it: an input `asked` of the light,
  bound to `"is_in(box.pressed)"`.
- Halve the distance between the limits of the thermostat. How often does it switch now? Why can the
  limits not be equal?
- What do four elements do that one cannot? This is lesson 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gms_fsm import (
    GMS,
    Body,
    Chart,
    Contact,
    GMSParameters,
    Spring,
    State,
    Stribeck,
    Supervisor,
    System,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.app.lessons.basics.l6_stick_slip import MASS, SIGMA_2, SPEED, STIFFNESS, V_S, F_c, F_s
from gms_fsm.app.lessons.engine.lesson import FIRST, GUIDE, SECOND, Lesson, draw, grid, note
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.charts import gms_element
from gms_fsm.charts.parameters import FloatArray
from plots.style import INK, LINE_GREY

EVERY = 14.0  # s, between two presses
LOW, MIDDLE, HIGH = 19.0, 20.0, 21.0  # °C
HOT, TAU = 30.0, 600.0  # °C with the heater on for ever; s
K, SIGMA, C = 100.0, 4.0, 0.3  # N/m, Ns/m, m/s: the bristle
BRISTLE = GMS(
    GMSParameters(
        np.array([K]),
        sigma=[SIGMA],
        C=[C],
        sigma_2=SIGMA_2,
        v_c=1e-6,
        weights=[1.0 / K],
        stribeck=Stribeck(F_c=F_c, F_s=F_s, v_s=V_S),
    ),
    law="signed",
)
ENDS = (90.0, 600.0, 40.0)  # s, of the three runs
LIGHT = Chart(
    "traffic light",
    inputs=(),
    velocities=(),
    states=(State("green"), State("amber"), State("red")),
    transitions=(
        Transition("warn", "green", "amber", event="button"),
        Transition("halt", "amber", "red", guard="after(3)"),
        Transition("go", "red", "green", guard="after(12)"),
    ),
)
BUTTON = Chart(
    "button",
    inputs=(),
    velocities=(),
    parameters=("every",),
    states=(State("waits"),),
    transitions=(Transition("press", "waits", "waits", guard="after(every)", emit="button"),),
)
THERMOSTAT = Chart(
    "thermostat",
    inputs=("T",),
    velocities=(),
    parameters=("low", "high"),
    states=(State("off", outputs={"u": "0"}), State("on", outputs={"u": "1"})),
    transitions=(
        Transition("switch_on", "off", "on", guard="T < low"),
        Transition("switch_off", "on", "off", guard="T > high"),
    ),
)
ELEMENT = gms_element("signed")


def crossing(every: float = EVERY) -> System:
    """Return a traffic light and a button that is pressed every so many seconds.

    Examples
    --------
    >>> [each.name for each in crossing().supervisors]
    ['light', 'button']
    """
    parts = Supervisor("light", LIGHT), Supervisor("button", BUTTON, {"every": every})
    return System("crossing", supervisors=parts)


def room() -> System:
    """Return a room with a heater and a thermostat.

    Examples
    --------
    >>> room().flow["T"]
    '(30 * heater.u - T) / 600'
    """
    heater = Supervisor("heater", THERMOSTAT, {"low": LOW, "high": HIGH})
    flow = {"T": f"({HOT:g} * heater.u - T) / {TAU:g}"}
    return System("room", supervisors=(heater,), flow=flow)


def mass() -> System:
    """Return a mass that is pulled through a spring over one element.

    Examples
    --------
    >>> mass().contacts[0].n
    1
    """
    return System(
        "pulled mass",
        bodies=(Body("mass", inertia="m"),),
        springs=(Spring("pulled", "mass", k="K", rest="V * t"),),
        contacts=(Contact("pad", BRISTLE),),
        numbers={"m": MASS, "K": STIFFNESS, "V": SPEED},
    )


def run() -> dict[str, Any]:
    """Run the light, the room and the mass."""
    lights = simulate(crossing(), ENDS[0])
    presses, heard = (times(lights, edge).size for edge in ("press", "warn"))
    red_to_red = np.diff(times(lights, "halt"))[0]

    warmed = simulate(room(), ENDS[1], initial={"T": MIDDLE})
    on, off = times(warmed, "switch_on"), times(warmed, "switch_off")
    low, high = (warmed.sample(each[-1:]).value("T")[0] for each in (on, off))
    cycle = np.diff(on)[0]
    fine = warmed.sample(np.linspace(0.0, ENDS[1], 2001)[1:])
    T, u = fine.value("T"), fine.value("heater.u")
    there = np.flatnonzero(np.diff(T > MIDDLE))
    only = {frozenset({0.0}): "off", frozenset({1.0}): "on"}
    heater_at_20 = only.get(frozenset(u[there]), "either")

    pulled = simulate(mass(), ENDS[2])
    replayed, title = {"pulled mass": pulled}, BRISTLE.title
    slips, arrests = times(pulled, "break_away_forward"), times(pulled, "arrest")
    bent, period, first_slip = pulled.transitions.z[0], np.diff(slips)[-1], slips[0]
    ends = pulled.sample([slips[-1], arrests[-1]])
    pulls = STIFFNESS * (SPEED * ends.t - ends.x)
    return locals()


def times(trace: Trace, edge: str) -> FloatArray:
    """Return when an edge was taken, s."""
    log = trace.transitions
    return np.asarray(log.t[log.edge == edge])


def _light(ax: Any, r: Any) -> str:
    lights = r.lights.supervisor("light")
    draw("ribbons", ax, lights)
    ends = np.array([0.0, *lights.transitions.t, ENDS[0]])
    names = ["green", *lights.transitions.target]
    look: dict[str, Any] = {"ha": "center", "va": "center", "color": INK}
    for middle, name in zip((ends[1:] + ends[:-1]) / 2, names, strict=True):
        note(ax, name, (middle, 1.0), rotation=90 * (name == "amber"), **look)
    pressed = times(r.lights, "press")
    ax.plot(pressed, np.full(pressed.size, 0.42), "v", color=INK, markersize=5)
    ax.set(yticks=[], ylim=(1.5, 0.2))
    return "a traffic light; triangles: the button is pressed"


def _room(ax: Any, r: Any) -> str:
    _shaded(ax, r.warmed, "on")
    for limit in (LOW, HIGH):
        ax.axhline(limit, **GUIDE)
    ax.plot(r.fine.t, r.T, **FIRST)
    ax.set(xlim=(0, ENDS[1]), ylim=(18.6, 21.4), xlabel="$t$ [s]", ylabel="$T$ [°C]")
    return "a thermostat; shaded: on"


def _bend(ax: Any, r: Any) -> str:
    fine = r.pulled.refined(4000)
    _shaded(ax, r.pulled, "slip")
    ax.plot(fine.t, 1e3 * fine.s[:, 0], **SECOND)
    ax.plot(fine.t, 1e3 * fine.z[:, 0], **FIRST)
    ax.set(xlim=(0, ENDS[2]), xlabel="$t$ [s]", ylabel="$z$ [mm]")
    return f"the bristle of {r.title}; dashed: s(v); shaded: slip"


def _speed(ax: Any, r: Any) -> str:
    _shaded(ax, r.pulled, "slip")
    fine = r.pulled.refined(4000)
    ax.plot(fine.t, fine.v, **FIRST)
    ax.axhline(SPEED, **GUIDE)
    ax.set(xlim=(0, ENDS[2]), xlabel="$t$ [s]", ylabel="$v$ [m/s]")
    return "the mass; line: speed of the pull"


def _shaded(ax: Any, trace: Trace, state: str) -> None:
    log = trace.transitions
    ends = [*log.t[log.source == state], trace.t[-1]]
    for begin, end in zip(log.t[log.target == state], ends, strict=False):
        ax.axvspan(begin, end, color=LINE_GREY, alpha=0.25, linewidth=0, zorder=0)


LESSON = Lesson(
    __name__,
    run,
    (_light, _room, _bend, _speed),
    grid("a;b;c;d", (8.2, 7.4), (0.5, 1, 1, 1)),
    level="school",
    questions=(
        Question("red_to_red", "s", rtol=0.01),
        Question("heater_at_20", choices=("on", "off", "either")),
        Question("first_slip", "s", rtol=0.05),
    ),
    live=lambda: ((mass(), ENDS[2]), {"numbers.V": (0.02, 0.3), "pad.F_s": (1.0, 3.0)}, {}),
)
