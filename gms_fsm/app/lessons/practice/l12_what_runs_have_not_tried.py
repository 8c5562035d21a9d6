r"""Lesson 12: What runs have not tried.

What have my runs not tried?

A chart is right if it does the right thing wherever it is asked. A run asks it at few points: at
its steps, in the states it happens to be in. What no run has asked, no run has tested. Coverage
counts what was asked:

- edges: each one taken;
- clauses: each comparison of each guard, seen true and seen false in the state that its edge
  leaves;
- MC/DC (modified condition/decision coverage): each comparison seen to decide alone. For ``a and
  b`` that takes three points: both true, only a false, only b false.

## Predict

One slipping element, signed law, whose threshold s is 15 mm at rest and 10 mm at speed. A colleague
has copied its chart, and has lost one sign in one guard:

| edge | from | guard | the copy |
|---|---|---|---|
| break_away_forward | stick | ``z >= s and v > v_c`` | the same |
| break_away_backward | stick | ``z <= -s and v < -v_c`` | ``z <= -s and v < v_c`` |
| arrest | slip | ``abs(v) <= v_c and abs(z) < s`` | the same |

v_c = 1 mm/s is the speed below which an element may arrest. A comparison of a guard has *decided
alone* if it was seen both true and false while the other one was true.

Two runs first: a mass of 1 kg is pulled forward through a spring of 2 N/m at 0.1 m/s for 40 s, and
sticks and slips; a slider is moved at 0.2 + 0.1 sin(t) m/s for 10 s. A third run moves to and fro,
v = 0.2 sin(t) m/s for 20 s. With it all three edges are taken: by the number of edges nothing is
missing. When z reaches -s in this run, v is about -0.1 m/s.

1. How many of the three edges do the first two runs take together?
2. In how many of the three runs does the copy switch at other times, or by other edges, than the
   original?
3. The guard of break_away_backward has two comparisons. How many of them has the third run seen to
   decide alone?
4. Last, the element begins in stick, bent to z = -s, and rests: v = 0. Which chart slips at once:
   the original, the copy, both or none?

## Measure

Run: {MODEL.title}, v_c = {V_C!m:g} mm/s, k = {K:g} N/m, F_s = {F_s:g}, F_c = {F_c:g} N (chosen by
us), and the same with the copied chart; three runs by hand, then the motions of `gms_fsm.generate`.

Measured: the first two runs take {edges_taken} of 3 edges, all three runs {with_third}; of the 6
comparisons {undecided} have never decided alone. The copy has another log in {runs_that_differ} of
these runs.

Measured: {motions} generated motions take all edges, all {pairs} pairs of edges, and see every
comparison decide; {telling} of them tell the copy apart. One begins in stick at z = {z!m:.1f} mm
(put there, beyond the threshold) with v = {v!m:.3g} mm/s, which is -v_c. At rest, bent to z = -s,
the {slips_at_rest} slips at once.

So: runs that look good test what they ask. An edge that was taken says that its guard was true
once, not which comparison decided it; a motion made for a comparison asks just there.

## Why

Forward runs bend the element forward only: z never comes near -s. On the way back z passes -s while
v is far below -v_c, so both ``v < -v_c`` and ``v < v_c`` are true. Whether the element breaks away
is then decided by z alone, and the second comparison might be anything: nobody has asked. At rest
``v < -v_c`` is false and ``v < v_c`` is true. A real element comes there when it is bent back
to -s and stopped: the copy lets go of what the original holds.

## Read what is missing

The report says it without knowing of any copy: which comparison was never seen to decide.

```python
print(result.by_hand)
print()
print(result.generated)
```

## Vary a parameter

The element begins in stick at z = -s and moves at a constant speed. Between -v_c and v_c the copy
slips and the original does not; everywhere else both do the same.

```python
from matplotlib.figure import Figure

from gms_fsm.app.lessons.practice.l12_what_runs_have_not_tried import V_C, begun
from plots.panels import ribbons


def both(share):
    figure = Figure(figsize=(6.4, 2.4), layout="constrained")
    axes = figure.subplots(2, sharex=True)
    for ax, (name, trace) in zip(axes, begun(share * V_C).items(), strict=True):
        ribbons(ax, trace)
        ax.set(yticks=[], title=f"{name}, v = {share:g} v_c")
    return figure


vary(both, 0.0, -3.0, 3.0, 0.25, "v / v_c")
```

## Try

- Which single run by hand would have told the copy apart? Write it as a velocity over t.
- Lose another sign: ``abs(z) > s`` in the guard of arrest. Do the three runs by hand notice?
- Write ``z > s`` in place of ``z >= s``. Can any run tell it apart? What do the generated motions
  say?
- `gms-fsm cover pulled_mass --generate -o motions` makes motions for a scenario of your own. Which
  edge pairs had your runs never taken?
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gms_fsm import (
    GMS,
    ChartModel,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Stribeck,
    Trace,
    coverage,
    generate,
    simulate,
)
from gms_fsm.app.lessons.engine.lesson import DOTS, FASTEST, GUIDE, Lesson, grid, note, ticks
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.charts.chart import Chart
from gms_fsm.charts.files.tables import ChartTable
from gms_fsm.generation.generate import GeneratedRun
from gms_fsm.traces.failures import SimulationError
from plots.style import ELEMENT_DASHES, INK, LINE_GREY, PALE_GREY

K, F_c, F_s, V_S, V_C = 100.0, 1.0, 1.5, 0.05, 1e-3  # N/m, N, N, m/s, m/s
EDGE, LOST = "break_away_backward", "z <= -s and v < v_c"
BRIEF = 1e-3  # s, of a run from z = -s
MODEL = GMS(
    GMSParameters(
        np.array([K]),
        sigma=[4.0],
        C=[0.3],
        sigma_2=0.1,
        v_c=V_C,
        weights=[1.0 / K],
        stribeck=Stribeck(F_c=F_c, F_s=F_s, v_s=V_S),
    ),
    law="signed",
)
RUNS: Mapping[str, tuple[Any, float]] = {
    "pulled": (PulledSlider(1.0, 2.0, 0.1), 40.0),
    "forward": (Prescribed("0.2 + 0.1 * sin(t)"), 10.0),
    "to and fro": (Prescribed("0.2 * sin(t)"), 20.0),
}


def copied() -> Chart:
    """Return the chart in which a sign is lost.

    Examples
    --------
    >>> copied().guard_text("break_away_backward")
    'z <= -s && v < v_c'
    """
    table = ChartTable.of(MODEL.chart)
    edges = [
        each.model_copy(update={"guard": LOST}) if each.name == EDGE else each
        for each in table.transitions
    ]
    return table.model_copy(update={"name": "the copy", "transitions": edges}).build(Chart)


COPY = ChartModel(
    copied(),
    MODEL.values,
    stribeck=MODEL.stribeck,
    sigma_2=MODEL.sigma_2,
    weights=MODEL.weights,
)


def run() -> dict[str, Any]:
    """Make the runs by hand, with both charts, and generate motions."""
    traces, differ = {}, []
    for name, (rig, t_end) in RUNS.items():
        traces[name] = simulate(MODEL, rig, t_end, engine=FASTEST)
        if log(simulate(COPY, rig, t_end, engine=FASTEST)) != log(traces[name]):
            differ.append(name)
    runs_that_differ = len(differ)
    pulled, forward, waved = traces.values()
    edges_taken = coverage([pulled, forward]).scores["edges"].seen
    by_hand = coverage(traces.values())
    with_third, counts = by_hand.scores["edges"].seen, by_hand.contact()
    edge, decision = counts.edge(EDGE, "stick"), counts.decisions[EDGE]
    decided = sum(all(decision.shown(edge.asked, i)) for i in range(2))
    undecided = by_hand.scores["MC/DC"].of - by_hand.scores["MC/DC"].seen

    generated = generate(MODEL)
    motions, pairs = len(generated.runs), generated.pairs.of
    apart = [each for each in generated.runs if told(each)]
    telling = len(apart)
    z, v = beginning(next(each for each in apart if in_stick(each)))

    rested = begun(0.0)
    slipped = [name for name, trace in rested.items() if len(trace.transitions)]
    slips_at_rest = slipped[0] if len(slipped) == 1 else ("none", "both")[bool(slipped)]
    shares = {
        "two runs": coverage([pulled, forward]).scores,
        "three runs": by_hand.scores,
        "generated": generated.coverage.scores,
    }
    replayed = {"pulled": pulled, "to and fro": waved}
    return locals()


def log(trace: Trace) -> list[tuple[float, str]]:
    """Return when which edge was taken."""
    return [(float(r.t), str(r.edge)) for r in trace.transitions]


def told(motion: GeneratedRun) -> bool:
    """Return whether a motion shows that the copy is another chart."""
    try:
        return log(motion.again(COPY.chart)) != log(motion.trace)
    except SimulationError:  # it switches without end
        return True


def beginning(motion: GeneratedRun) -> tuple[float, float]:
    """Return z [m] and v [m/s] at the start."""
    return float(motion.trace.z[0, 0]), float(motion.trace.v[0])


def in_stick(motion: GeneratedRun) -> bool:
    """Return whether the element begins in stick."""
    return list(motion.initial["contact.states"]) == ["stick"]


def begun(v: float) -> dict[str, Trace]:
    """Return runs of both charts that begin in stick at z = -s, and move at a constant v [m/s].

    Examples
    --------
    >>> [len(trace.transitions) for trace in begun(0.002).values()]
    [0, 0]
    """
    start = {"z": -MODEL.weights * MODEL.stribeck(v)}
    found = {}
    for name, model in (("original", MODEL), ("copy", COPY)):
        try:
            found[name] = simulate(model, Prescribed(v), BRIEF, initial=start, max_steps=400)
        except SimulationError as error:
            found[name] = error.trace
    return found


def _plane(ax: Any, r: Any) -> str:
    ax.fill_between([-2.4, -1.0], -1.0, 1.0, color=PALE_GREY, linewidth=0, zorder=0)
    for side in (-1.0, 1.0):
        ax.axvline(side, **GUIDE)
    for (name, trace), dash in zip(r.traces.items(), ELEMENT_DASHES, strict=False):
        fine = trace.refined(4000)
        asked = np.where(fine.modes[:, 0] == 0, fine.v / V_C, np.nan)
        ax.plot(fine.z[:, 0] / fine.s[:, 0], asked, color=INK, linestyle=dash, label=name)
    z, v = np.transpose([beginning(each) for each in r.generated.runs if in_stick(each)])
    ax.plot(z / (MODEL.weights[0] * MODEL.stribeck(v)), v / V_C, **DOTS, label="generated, start")
    note(ax, "only the copy slips", (-2.35, 1.2), (0, 4))
    ax.set_yscale("symlog", linthresh=2.0)
    ticks(ax, "y", (-100, -10, -1, 0, 1, 10, 100))
    ax.set(xlim=(-2.4, 2.4), ylim=(-2e4, 1e3), xlabel="$z / s$ [1]", ylabel="$v / v_c$ [1]")
    ax.legend(loc="lower right", fontsize=8, handlelength=3.2)
    return f"asked in stick, {MODEL.title}"


def _shares(ax: Any, r: Any) -> str:
    names = [*next(iter(r.shares.values()))]
    for i, (label, scores) in enumerate(r.shares.items()):
        at = np.arange(len(names)) + 0.27 * (i - 1)
        percent = [scores[name].percent for name in names]
        shade = (PALE_GREY, LINE_GREY, INK)[i]
        ax.bar(at, percent, 0.24, color=shade, edgecolor=INK, linewidth=0.6, label=label)
    ticks(ax, "x", range(len(names)), names)
    ax.set(ylabel="seen [%]", ylim=(0, 135))
    ax.legend(loc="upper center", ncols=3, fontsize=8, columnspacing=1.0)
    return "coverage"


LESSON = Lesson(
    __name__,
    run,
    (_plane, _shares),
    grid("ab", (8.2, 4.4), widths=(1.4, 1)),
    level="graduate",
    questions=(
        Question("edges_taken", atol=0.5),
        Question("runs_that_differ", atol=0.5),
        Question("decided", atol=0.5),
        Question("slips_at_rest", choices=("original", "copy", "both", "none")),
    ),
)
