"""Lesson 10: Which model.

Which friction model shows what?

No friction model is the best one. Each leaves something out, and one with more state variables
costs more: more parameters to identify, more equations to integrate. So ask what a model must show.
Five models with the same friction, and the same stiffness and damping where they have any, are put
on one bench, and five phenomena are measured:

- Break-away over the force rate: a slow pull meets more friction than a fast one.
- Nonlocal memory: an inner loop of force and displacement closes where it began.
- Rest under bias and ripple: a load far below break-away must not move the contact.
- Frictional lag: friction is higher while the speed rises than while it falls.
- Passivity: a contact never gives back more energy than it has taken.

Each verdict is a number against a threshold, and its reason lies in the state of the model. A
contact that locks has no deflection: no loop in pre-sliding, no lag, and the same break-away force
at every rate. LuGre has one deflection, which yields under any load: it lags, but it drifts, and it
forgets where the force turned. The elasto-plastic model is LuGre with an elastic range: it rests,
but its single deflection still forgets. A GMS bank has one deflection per element; those that stick
remember the reversal. Its published law has the wrong sign for v < 0 (lesson 4): it makes energy.

## Predict

Five models with the same friction are put on one bench:

- `stiction`: the contact locks; it has no deflection;
- `lugre`: one deflection z, which yields at any load: dz = v - sigma_0 |v| z / s(v);
- `elasto-plastic`: the same, but elastic, dz = v, up to a break-away deflection;
- `gms-signed`: four deflections, each elastic up to its own threshold; beyond it
  dz = C (sgn(v) - z / s), which follows s(v) with a delay;
- `gms-published`: the same, but dz = sgn(v) C (1 - z / s), which for v < 0 drives z away from s.

1. Which one creeps under a load far below break-away, when it is shaken?
2. Which one makes energy in a cycle?
3. Which one does all of this: it rests under that load; its friction is higher while the speed
   rises than while it falls; an inner loop closes where it began; it makes no energy?

## Measure

Run: {MODELS} (GMS with {states[gms-signed]} elements, signed law and published law) with F_c =
{BENCH.F_c:g} N, F_s = {BENCH.F_s:g} N, sigma_0 = {BENCH.sigma_0:g} N/m on one bench (all values
chosen by us). Numbers below are in this order.

Measured: a ripple below break-away moves the slider by {drifts:.2f} µm per period (threshold
{limits[drift]:g} µm). The inner loops miss their beginning by {gaps:.2f} % of their stroke
(threshold {limits[memory]:g} %; the first and the last have no inner loop). In three cycles the
contacts make {made:.2f} mJ (threshold {limits[passivity]:g} % of the {exchanged[0]:.2f} to
{exchanged[4]:.2f} mJ exchanged).

Measured: from {SLOW:g} to {FAST:g} N/s the break-away force falls by {falls:.2f} N (threshold
{limits[break-away]:.2f} N). At 25 rad/s friction lags by {lags:.1f} mN (threshold {limits[lag]:g}
mN).

So: choose the model with the fewest state variables that shows what matters and nothing wrongly.
For a contact that rests: {chosen[0]}; that also lags: {chosen[1]}; that also remembers reversals:
{chosen[2]}.

## Why

LuGre has one deflection that yields under any load. The published law has the wrong sign for v < 0.
Memory of reversals needs elements that still stick while others slip: a bank.

## Choose a model

The model with the fewest states that shows what is wanted, and shows nothing wrongly:

```python
for wanted in (["drift"], ["drift", "lag"], ["break-away", "drift", "lag", "memory"]):
    print(f"{', '.join(wanted)}: {result.choice(wanted)}")
```

Every verdict can be opened: its experiment, its numbers, and the threshold with its reason.

```python
found = result.table.cell("elasto-plastic", "memory")
print(found.verdict, "-", found.said)
for number in found.numbers:
    print(f"  {number.name}: {number}")
phenomenon = next(each for each in result.table.phenomena if each.name == "memory")
print(textwrap.fill(phenomenon.experiment, 84))
for limit in phenomenon.limits.values():
    text = f"threshold {limit.value:g}: {limit.meaning} ({limit.reason})"
    print(textwrap.fill(text, 84))
```

## Vary a parameter

A GMS bank with a different number of elements, in the memory experiment. One element is a spring
below break-away: it has no loop at all.

```python
import numpy as np
from matplotlib.figure import Figure

from gms_fsm import GMS, GMSParameters, Stribeck, measure_phenomena


def bank(n):
    share = 0.5 ** np.arange(n)
    share /= share.sum()
    curve = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
    return GMSParameters.from_shares(
        np.full(n, 1 / n),
        1e5 * share,
        C=50.0,
        sigma=316.23 * share,
        stribeck=curve,
        v_c=1e-8,
        sigma_2=0.4,
    )


def nested(n):
    table = measure_phenomena({"bank": GMS(bank(n), law="signed")}, ["memory"])
    found = table.cell("bank", "memory")
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    ax = figure.subplots()
    ax.plot(found.curves[0].x, found.curves[0].y)
    ax.set(xlabel="$x$ [µm]", ylabel="applied force [N]")
    verdict = f"n = {n}, {found.verdict}: {found.said}; gap {found.numbers[0]}"
    ax.set_title(verdict, fontsize=9)
    return figure


vary(nested, 4, 1, 8, 1, "elements $n$")
```

## Try

- Measure Dahl's model, Maxwell slip and Karnopp, too
  (`measure_phenomena(["dahl", "maxwell-slip", "karnopp"], ...)`). Which of them would you take
  for a contact that must rest and remember reversals, and need not lag?
- Double sigma_1 of LuGre (`LuGre(...)` as a model of your own). Which numbers change, and does a
  verdict change?
- Which value of C of the bank halves the lag? Does the break-away force still fall with the rate?
- Read the reason of a threshold, and choose your own. At which threshold would LuGre rest?
- Step through the replay page. Which elements of the bank slip while the inner loop is run
  through, and in which order do they arrest?
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

from gms_fsm import PhenomenaTable, measure_phenomena
from gms_fsm.app.lessons.engine.lesson import FIRST, GUIDE, SECOND, Lesson, Result, note
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.phenomena.limits import LIMITS
from gms_fsm.phenomena.measure import Bench
from gms_fsm.phenomena.presliding import nested as inner_loops
from gms_fsm.phenomena.specimens import specimens_of
from plots.style import INK, LINE_GREY

MODELS = ("stiction", "lugre", "elasto-plastic", "gms-signed", "gms-published")
PHENOMENA = ("break-away", "memory", "drift", "lag", "passivity")
NAMES = {"lugre": "LuGre", "gms-signed": "GMS, signed law", "gms-published": "GMS, published law"}
SLOW, FAST = 0.1, 50.0  # N/s: the slowest and the fastest pull
BENCH = Bench()


def run() -> dict[str, Any]:
    """Put the models on the bench."""
    nested = {each.name: inner_loops(each)[1] for each in specimens_of(MODELS, BENCH)}
    replayed = {NAMES[name]: nested[name] for name in ("gms-signed", "lugre")}
    table = measure_phenomena(MODELS, PHENOMENA, bench=BENCH)
    states = {name: len(trace.places.variables) * trace.places.n for name, trace in nested.items()}

    def number(model: str, phenomenon: str, name: str = "") -> float:
        found = table.cell(model, phenomenon)
        return found.number(name) if name else found.numbers[0].value

    def each(phenomenon: str, digits: int, name: str = "") -> list[float]:
        values = (number(model, phenomenon, name) for model in MODELS)
        return [round(value, digits) + 0.0 for value in values]  # no -0.0

    drifts, gaps, made = each("drift", 2), each("memory", 2), each("passivity", 2)
    falls, lags = each("break-away", 2), each("lag", 1, "width of the loop at 25 rad/s")
    exchanged = sorted(each("passivity", 6, "energy exchanged"))
    slowest = number("stiction", "break-away", f"break-away force at {SLOW:g} N/s")
    limits = {  # in the unit of the first number: N, %, µm, mN; and % of what is exchanged
        "break-away": LIMITS["break-away.fall"].value * slowest,
        "memory": 100.0 * LIMITS["memory.gap"].value,
        "drift": 1e6 * LIMITS["drift.rate"].value * BENCH.bristle,
        "lag": 1e3 * LIMITS["lag.width"].value * BENCH.F_s,
        "passivity": 100.0 * LIMITS["passivity.made"].value,
    }
    choice = partial(smallest, table, states)
    wanted = (["drift"], ["drift", "lag"], ["drift", "lag", "memory"])
    chosen = [f"{model} ({states[model]})" for model in map(choice, wanted)]
    creeps, makes_energy = (
        max(MODELS, key=lambda model: number(model, each)) for each in ("drift", "passivity")
    )
    does_all = choice(["drift", "lag", "memory"])
    return locals()


def smallest(table: PhenomenaTable, states: dict[str, int], wanted: Iterable[str]) -> str:
    """Return the model with the fewest states that shows what is wanted, and nothing wrongly."""
    wanted = set(wanted)
    for model in sorted(MODELS, key=states.__getitem__):
        verdicts = {name: table.cell(model, name).verdict for name in PHENOMENA}
        shown = {name for name, verdict in verdicts.items() if verdict == "shows"}
        if wanted <= shown and "shows wrongly" not in verdicts.values():
            return model
    return ""


def _sheet(heading: str, r: Result) -> tuple[Any, list[Any]]:
    """Return the matrix of verdicts with thresholds under it, and three panels below."""
    from plots import figures

    form = {
        "break-away": "{:.2f} N",
        "memory": "{:g} %, and a loop",
        "drift": "{:g} µm",
        "lag": "{:g} mN at 25 rad/s",
        "passivity": "{:g} % of exchanged",
    }
    names = [each.name for each in r.table.phenomena]
    notes = ["threshold", *(form[name].format(r.limits[name]) for name in names)]
    figure = figures.phenomena_matrix(r.table, title=heading, notes=notes, below=2.7)
    high = figure.get_figheight()
    places = [(left, 0.5 / high, 0.235, 1.95 / high) for left in (0.075, 0.415, 0.75)]
    return figure, [figure.add_axes(place) for place in places]


def _curve(ax: Any, r: Any, model: str, phenomenon: str, **look: Any) -> None:
    curve = r.table.cell(model, phenomenon).curves[0]
    ax.plot(curve.x, curve.y, **look)


def _drift(ax: Any, r: Any) -> str:
    _curve(ax, r, "lugre", "drift", color=LINE_GREY, linewidth=0.9)
    _curve(ax, r, "gms-signed", "drift", **FIRST | {"linewidth": 0.9})
    _curve(ax, r, "elasto-plastic", "drift", **SECOND | {"linewidth": 0.9})
    note(ax, NAMES["lugre"], (6.5, 55.0))
    note(ax, NAMES["gms-signed"], (9.5, 14.0), color=INK)
    note(ax, "elasto-plastic", (10.5, -6.5))
    ax.set(xlabel="$t$ [s]", ylabel="$x$ [µm]", xlim=(0, 24), ylim=(-10, 95))
    return "bias and ripple: LuGre drifts"


def _memory(ax: Any, r: Any) -> str:
    _curve(ax, r, "lugre", "memory", **SECOND)
    _curve(ax, r, "gms-signed", "memory", **FIRST)
    gap, end = r.number("lugre", "memory", "gap"), r.nested["lugre"].x[-1] * 1e6
    arrow = {"arrowstyle": "<->", "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (end, 1.55), (end - gap, 1.55), arrowprops=arrow)
    note(ax, f"LuGre: gap {gap:.1f} µm", (end, 1.68), ha="right")
    note(ax, NAMES["gms-signed"], (17.0, -1.38), color=INK)
    ax.set(xlabel="$x$ [µm]", ylabel="applied force [N]", xlim=(-15, 66), ylim=(-1.5, 1.95))
    return "reversals: GMS remembers"


def _energy(ax: Any, r: Any) -> str:
    _curve(ax, r, "gms-published", "passivity", **SECOND)
    _curve(ax, r, "gms-signed", "passivity", **FIRST)
    note(ax, NAMES["gms-published"], (10.0, -3.6))
    note(ax, NAMES["gms-signed"], (10.0, 0.75), color=INK)
    ax.axhline(0, **GUIDE)
    ax.set(xlabel="$t$ [ms]", ylabel="energy taken [mJ]", xlim=(0, 450), ylim=(-4.2, 1.3))
    return "energy in three cycles"


LESSON = Lesson(
    __name__,
    run,
    (_drift, _memory, _energy),
    _sheet,
    level="graduate",
    questions=tuple(
        Question(name, choices=MODELS) for name in ("creeps", "makes_energy", "does_all")
    ),
)
