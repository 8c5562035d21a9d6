r"""Lesson 8: Chart or if-else.

Does it matter whether a chart or if-else code decides?

The paper runs the model twice, as a state chart and as if-else code, and finds a difference of
about 1e-3 N, with spikes at the transitions. It attributes this to the two implementations.

Here both are made from one chart. With the same driver they agree to the last bit, whether the
switches are located or searched for once per step. The difference comes from the driver: a guard
that is evaluated once per step responds late. During the delay the force is that of the old state,
which is a spike. After it the element is stretched too far, by the distance the slider moved in the
meantime, and this excess decays only slowly. That is a residual like the one in the paper. Its size
depends on the delay of the switch.

A chart in a block diagram may also have a sample time: its outputs are then held between the ticks.
The held force lags even where nothing switches, in proportion to the sample time. This explains the
residuals of both figures of the paper within a factor of 10. What the paper ran is not printed.

## Predict

One chart is run twice: by state machines, and by if-else code made from the same chart. Every
number of the two traces is compared. The element forces are k z + sigma dz: in stick dz = v, and an
element that begins to slip at z = s has dz = 0. The four sigma are 0.3, 0.4, 0.5 and 0.6 Ns/m; all
break away together at v = 0.14 m/s.

1. How many differ, with the same driver and located switches?
2. Now the if-else code evaluates its guards once per step of 1 ms. How large is the largest
   difference of the force just after the first break-away, in N?
3. At 12.5 s the motion reverses, and |v| is small enough for the elements to arrest for 50 us only.
   In the run that misses this they go on slipping. Is the largest difference after that "smaller",
   the "same" or "larger" than at the break-away?

## Measure

Run: {MODEL.title}, Table I (stick-slip), v = {VELOCITY} m/s (chosen by us), {END:g} s; transitions
machines and generated if-else code, with located switches, with guards evaluated once per step (max
step {PAPER_STEP!m:g} ms, rtol {PAPER_RTOL:.0e}), and with outputs held for {PAPER_STEP!m:g} ms.

Measured with the same driver: {differ[0]} of {differ[1]} numbers differ with located switches,
{differ_once[0]} of {differ_once[1]} once per step, {differ_held[0]} of {differ_held[1]} with held
outputs.

Measured, once per step minus located: {before:.0e} N before the first break-away, a spike of
{spike:.2f} N at it, then {after:.0e} N; the arrests at {arrest:.1f} s are missed, and the runs
diverge by up to {diverged:.1f} N. The paper's {PAPERS:.0e} N needs a switch that is
{late_for_the_papers!m:.1f} ms late. Held minus located: {early:.1e} N, {near:.2f} N, then
{later:.1e} N; in the experiment of Fig. 3 up to {pushed_largest[0]:.1e} N on the ramp and
{pushed_largest[1]:.1e} N while the force oscillates, in proportion to the sample time.

So: chart and if-else code are one program; what differs is when guards are evaluated and how long
outputs are held. Steps of {PAPER_STEP!m:g} ms explain the shape of the paper's residual, including
the spikes, but here it is {smaller:.0f} times smaller; outputs held for {PAPER_STEP!m:g} ms explain
it within a factor of {within:.0f}.

## Why

Both are made from one chart, so the same driver gives the same bits. A guard that is evaluated up
to 1 ms late leaves the force of the old state for that time: a spike of the size of the drop at
break-away, 1.8 Ns/m times 0.14 m/s. At a reversal the window |v| <= v_c is missed altogether, and
from there on the two runs are different motions.

## The if-else text

This is the program that was compared: generated from the chart, as the if-else engine runs it.

```python
from gms_fsm.lowering.program import lower

source = lower(result.ifelse.model, result.ifelse.rig).source
print(source[source.index("def switch") :].split("\n\n\n")[0])
```

## Try

- Run both drivers with `law="signed"`. Do they still diverge at the first reversal?
- How late must a guard be checked to produce the residual in the paper? Which step does that?
- Hold outputs for 0.7 ms (`events="held", step=7e-4`). Which transitions of `result.chart` are
  missed, and why?
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gms_fsm import GMS, GMSParameters, Prescribed, Slider, Trace, simulate
from gms_fsm.app.lessons.engine.lesson import (
    DOTS,
    FASTEST,
    FIRST,
    SECOND,
    Lesson,
    draw,
    forces,
    grid,
    note,
)
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.app.paper import FORCE, HELD_STEPS, PAPER_RTOL, PAPER_STEP, VELOCITY
from gms_fsm.app.paper.claims import differing_numbers, force_difference
from gms_fsm.app.paper.held import OSCILLATION, PAPERS_FORCE, PAPERS_PLACE, RAMP, lag_of
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.systems.rigs import Rig
from plots.style import LINE_GREY, REPORTED, TEXT_GREY

MODEL = GMS(GMSParameters.paper("stick-slip"), law="published")
RIG = Prescribed(VELOCITY)
END = 30.0  # s
STEPS = (0.3e-3, 0.9e-3, 2.1e-3, 3.3e-3, 5e-3, 10e-3, 23e-3, 50e-3)  # s
LOOK = 5.0  # s: time at which the residual is read, after the first break-away
PAPERS = 1e-3  # N: the residual in the paper
PUSHED = GMS(GMSParameters.paper("non-drifting"), law="published"), Slider(1.0, FORCE)
HELD_END, PUSHED_END = 12.0, 6.0  # s: ends of the runs with held outputs, of both experiments
ENGINES = ("machines", "ifelse")


def run() -> dict[str, Any]:
    """Run the chart and the if-else code with each driver, with delays, and with held outputs."""
    once: dict[str, Any] = {"events": "step", "max_step": PAPER_STEP, "rtol": PAPER_RTOL}
    chart, ifelse = (simulate(MODEL, RIG, END, engine=each) for each in ENGINES)
    chart_once, ifelse_once = (simulate(MODEL, RIG, END, engine=each, **once) for each in ENGINES)
    replayed = {"chart, located": chart, "if-else, once per step": ifelse_once}
    held_chart, held_ifelse = (hold(MODEL, RIG, HELD_END, PAPER_STEP, each) for each in ENGINES)
    differ = differing_numbers(chart, ifelse)
    differ_once = differing_numbers(chart_once, ifelse_once)
    differ_held = differing_numbers(held_chart, held_ifelse)

    t, residual = force_difference(ifelse_once, chart)
    log = chart.transitions
    first, arrest = float(log.t[0]), float(log.t[log.edge == "arrest"][0])

    def between(begin: float, end: float) -> FloatArray:
        return np.abs(residual[(t > begin) & (t < end)])

    spike, diverged = abs(residual[t == first])[0], between(arrest, END).max()
    numbers_that_differ, at_reversal = differ[0], "larger" if diverged > spike else "smaller"
    before, after = np.median(between(0.0, 4.9)), np.median(between(LOOK, arrest - 0.1))
    late, left = np.array([_late(step, chart) for step in STEPS]).T
    late_for_the_papers = PAPERS * np.median(late / left)  # they are proportional

    held = lag_of(held_chart, chart)
    early = held.during((0.0, first)).median[0]
    near = held.during((first - 0.01, first + 0.01)).largest[0]
    later = held.during((LOOK, HELD_END)).median[0]
    inside = simulate(*PUSHED, PUSHED_END, engine=FASTEST, max_step=PAPER_STEP)
    pushed = [lag_of(hold(*PUSHED, PUSHED_END, h), inside) for h in HELD_STEPS]
    paced = pushed[HELD_STEPS.index(PAPER_STEP)]
    pushed_largest = [paced.during(span).largest[0] for span in (RAMP, OSCILLATION)]
    smaller, within = PAPERS / after, max(PAPERS / early, pushed_largest[1] / PAPERS_FORCE)
    return locals()


def hold(model: GMS, rig: Rig, t_end: float, step: float, engine: str = FASTEST) -> Trace:
    """Run with outputs held between ticks; the rows are the ticks and the end."""
    ticks = np.append(step * np.arange(round(t_end / step)), t_end)
    return simulate(model, rig, t_end, events="held", step=step, engine=engine, t_eval=ticks)


def _late(step: float, chart: Trace) -> tuple[float, float]:
    """Return the delay of the first break-away [s] and the residual at `LOOK` [N]."""
    looked = simulate(MODEL, RIG, LOOK, method="rk4", step=step, events="step", engine=FASTEST)
    left = looked.sample([LOOK]).F - chart.sample([LOOK]).F
    return looked.transitions.t[0] - chart.transitions.t[0], abs(left)[0]


def predicted(late: FloatArray, chart: Trace) -> FloatArray:
    """Return the residual at `LOOK` [N] expected from late first break-aways [s].

    During the delay the slider moves by v late, and so do the deflections; afterwards each excess
    decays as exp(-C t / s).
    """
    p, first = MODEL.parameters, chart.transitions[0]
    rate = p.C / first.s  # 1/s
    per_metre = ((p.k - p.sigma * rate) * np.exp(-rate * (LOOK - first.t))).sum()
    return np.asarray(first.v * late * per_metre)


def _residual(ax: Any, r: Any) -> str:
    draw("difference", ax, r.t, r.residual)
    ax.set(ylim=(1e-7, 30), xlim=(0, END))
    ax.axhline(PAPERS, **REPORTED)
    note(ax, "the paper's $10^{-3}$ N", (0.3, 1.5 * PAPERS))
    note(ax, "spike at the\nbreak-away", (r.first + 0.25, 0.06))
    note(ax, "missed arrests →", (r.arrest - 0.2, 2.0), ha="right")
    same = "same driver: {} of {} numbers differ (located), {} of {} (once per step)"
    note(ax, same.format(*r.differ, *r.differ_once), (END - 0.3, 3e-7), ha="right")
    return "their difference"


def _breakaway(ax: Any, r: Any) -> str:
    window = (r.first - 0.8e-3, r.first + 1.2e-3)
    for trace, look in ((r.chart, FIRST), (r.ifelse_once, SECOND)):
        (line,) = draw("force", ax, trace, window=window)
        line.set(xdata=1e3 * (line.get_xdata() - r.first), **look)
    rows = r.ifelse_once
    near = (rows.t > window[0]) & (rows.t < window[1]) & (rows.microstep == 0)
    ax.plot(1e3 * (rows.t[near] - r.first), rows.F[near], **DOTS | {"color": TEXT_GREY})
    ax.set(xlabel=f"$t$ − {r.first:.4f} s [ms]", ylabel="$F$ [N]", xlim=(-0.8, 1.2))
    note(ax, "dots: ends of steps", (0.03, 0.4), inside=True)
    return "the break-away: late if once per step"


def _lateness(ax: Any, r: Any) -> str:
    times = np.geomspace(0.5 * r.late.min(), 2 * r.late.max(), 20)
    ax.loglog(1e3 * times, predicted(times, r.chart), color=LINE_GREY, zorder=1)
    ax.loglog(1e3 * r.late, r.left, **DOTS)
    ax.axhline(PAPERS, **REPORTED)
    text = f"the paper's $10^{{-3}}$ N:\n{1e3 * r.late_for_the_papers:.1f} ms late"
    note(ax, text, (1e3 * times[0], PAPERS), (2, 4))
    note(ax, "line: v late Σ k, decaying\nas exp(−C t/s)", (0.97, 0.05), inside=True)
    ax.set(xlabel="delay of the switch [ms]", ylabel=f"difference at {LOOK:g} s [N]")
    return "residual of a late switch"


def _held_over_time(ax: Any, r: Any) -> str:
    draw("lag_over_time", ax, r.pushed, PAPERS_FORCE, window=(0.0, PUSHED_END))
    ax.legend(loc="upper left")
    note(ax, "the paper's $10^{-4}$ N", (0.1, -1e3 * PAPERS_FORCE), (2, -4))
    return "outputs held for h, in Fig. 3"


def _held_over_period(ax: Any, r: Any) -> str:
    phases = {"ramp": RAMP, "oscillation": OSCILLATION}
    draw("lag_over_period", ax, r.pushed, (PAPERS_FORCE, PAPERS_PLACE), phases=phases)
    ax.legend(loc="upper left", ncols=2)
    return "the same at its largest, over h"


LESSON = Lesson(
    __name__,
    run,
    (forces, _residual, _breakaway, _lateness, _held_over_time, _held_over_period),
    grid("aa;bb;cd;ef", (8.2, 10.6), (1, 1.2, 1.5, 1.5)),
    level="graduate",
    questions=(
        Question("numbers_that_differ", atol=0.5),
        Question("spike", "N", rtol=0.1),
        Question("at_reversal", choices=("smaller", "same", "larger")),
    ),
)
