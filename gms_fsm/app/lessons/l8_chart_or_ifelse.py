"""Lesson 8: state chart and if-else code.

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
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm import GMS, GMSParameters, Prescribed, Slider, Trace, simulate
from gms_fsm.app.paper import FORCE, HELD_STEPS, PAPER_RTOL, PAPER_STEP, VELOCITY
from gms_fsm.app.paper.claims import differing_numbers, force_difference
from gms_fsm.app.paper.held import OSCILLATION, PAPERS_FORCE, PAPERS_PLACE, RAMP, Lag, lag_of
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.systems.rigs import Rig

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "figure", "predicted", "run"]

TITLE = "Chart or if-else"
QUESTION = "Does it matter whether a chart or if-else code decides?"

MODEL = GMS(GMSParameters.paper("stick-slip"), law="published")
RIG = Prescribed(VELOCITY)
END = 30.0  # s
STEPS = (0.3e-3, 0.9e-3, 2.1e-3, 3.3e-3, 5e-3, 10e-3, 23e-3, 50e-3)  # s
LOOK = 5.0  # s: time at which the residual is read, after the first break-away
PAPERS = 1e-3  # N: the residual in the paper
PUSHED = GMS(GMSParameters.paper("non-drifting"), law="published"), Slider(1.0, FORCE)
HELD_END, PUSHED_END = 12.0, 6.0  # s: ends of the runs with held outputs, of both experiments


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    chart, ifelse : Trace
        Runs with located switches, decided by the machines and by the if-else code.
    chart_once, ifelse_once : Trace
        Runs with guards evaluated once per step, with the settings of the paper.
    differ, differ_once : (int, int)
        How many numbers differ between the two, and how many there are.
    t, residual : ndarray, shape (m,), s and N
        Difference between if-else code once per step and the chart with located switches.
    late, left : ndarray, shape (8,), s and N
        Delay of the first break-away for each of `STEPS`, and the residual at `LOOK`.
    differ_held : (int, int)
        As `differ`, with outputs held for `PAPER_STEP`.
    held : Lag
        Difference between the chart with outputs held for `PAPER_STEP` and the chart with located
        switches.
    pushed : tuple of Lag
        The same in the experiment of Fig. 3, where nothing switches, for each of `HELD_STEPS`.
    """

    chart: Trace
    ifelse: Trace
    chart_once: Trace
    ifelse_once: Trace
    differ: tuple[int, int]
    differ_once: tuple[int, int]
    t: FloatArray
    residual: FloatArray
    late: FloatArray
    left: FloatArray
    differ_held: tuple[int, int]
    held: Lag
    pushed: tuple[Lag, ...]

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {"chart, located": self.chart, "if-else, once per step": self.ifelse_once}

    @property
    def late_for_the_papers(self) -> float:
        """Delay of a switch that leaves the residual of the paper, s."""
        return float(PAPERS * np.median(self.late / self.left))  # they are proportional

    def between(self, begin: float, end: float) -> FloatArray:
        """Return the magnitude of the residual from begin to end [s], N."""
        return np.abs(self.residual[(self.t > begin) & (self.t < end)])

    @property
    def pushed_largest(self) -> tuple[float, float]:
        """Largest difference of F at the ticks in Fig. 3, held for `PAPER_STEP`, N.

        On the ramp, and while the force oscillates.
        """
        lag = self.pushed[HELD_STEPS.index(PAPER_STEP)]
        return lag.during(RAMP).largest[0], lag.during(OSCILLATION).largest[0]

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        log = self.chart.transitions
        first, arrest = float(log.t[0]), float(log.t[log.edge == "arrest"][0])
        spike = np.abs(self.residual[self.t == first])[0]
        after = float(np.median(self.between(LOOK, arrest - 0.1)))
        early, later = self.held.during((0.0, first)), self.held.during((LOOK, HELD_END))
        near = self.held.during((first - 0.01, first + 0.01))
        ramp, swing = self.pushed_largest
        return (
            f"Question: {QUESTION}",
            f"Run: {MODEL.title}, Table I (stick-slip), v = {VELOCITY} m/s (chosen by us), "
            f"{END:g} s; transitions machines and generated if-else code, with located switches, "
            f"with guards evaluated once per step (max step {1e3 * PAPER_STEP:g} ms, rtol "
            f"{PAPER_RTOL:.0e}), and with outputs held for {1e3 * PAPER_STEP:g} ms.",
            f"Measured with the same driver: {self.differ[0]} of {self.differ[1]} numbers differ "
            f"with located switches, {self.differ_once[0]} of {self.differ_once[1]} once per step, "
            f"{self.differ_held[0]} of {self.differ_held[1]} with held outputs.",
            f"Measured, once per step minus located: {np.median(self.between(0.0, 4.9)):.0e} N "
            f"before the first break-away, a spike of {spike:.2f} N at it, then "
            f"{after:.0e} N; the arrests at {arrest:.1f} s "
            f"are missed, and the runs diverge by up to {self.between(arrest, END).max():.1f} N. "
            f"The paper's {PAPERS:.0e} N needs a switch that is "
            f"{1e3 * self.late_for_the_papers:.1f} ms late. Held minus located: "
            f"{early.median[0]:.1e} N, {near.largest[0]:.2f} N, then {later.median[0]:.1e} N; in "
            f"the experiment of Fig. 3 up to {ramp:.1e} N on the ramp and {swing:.1e} N while the "
            "force oscillates, in proportion to the sample time.",
            "So: chart and if-else code are one program; what differs is when guards are "
            f"evaluated and how long outputs are held. Steps of {1e3 * PAPER_STEP:g} ms explain "
            "the shape of the paper's residual, including the spikes, but here it is "
            f"{PAPERS / after:.0f} times smaller; outputs held for {1e3 * PAPER_STEP:g} ms explain "
            f"it within a factor of {max(PAPERS / early.median[0], swing / PAPERS_FORCE):.0f}.",
        )


def run() -> Result:
    """Run the chart and the if-else code with each driver, with delays, and with held outputs.

    Returns
    -------
    Result
        Traces and measured values.
    """
    chart, ifelse = (simulate(MODEL, RIG, END, engine=e) for e in ("machines", "ifelse"))
    chart_once, ifelse_once = (
        simulate(
            MODEL, RIG, END, engine=engine, events="step", max_step=PAPER_STEP, rtol=PAPER_RTOL
        )
        for engine in ("machines", "ifelse")
    )
    t, residual = force_difference(ifelse_once, chart)
    late, left = zip(*(_late(step, chart) for step in STEPS), strict=True)
    held, held_ifelse = (
        _held(MODEL, RIG, HELD_END, PAPER_STEP, engine) for engine in ("machines", "ifelse")
    )
    inside = simulate(*PUSHED, PUSHED_END, engine="ifelse", max_step=PAPER_STEP)
    return Result(
        chart=chart,
        ifelse=ifelse,
        chart_once=chart_once,
        ifelse_once=ifelse_once,
        differ=differing_numbers(chart, ifelse),
        differ_once=differing_numbers(chart_once, ifelse_once),
        t=t,
        residual=residual,
        late=np.array(late),
        left=np.array(left),
        differ_held=differing_numbers(held, held_ifelse),
        held=lag_of(held, chart),
        pushed=tuple(lag_of(_held(*PUSHED, PUSHED_END, h), inside) for h in HELD_STEPS),
    )


def _held(model: GMS, rig: Rig, t_end: float, step: float, engine: str = "machines") -> Trace:
    """Run with outputs held between ticks; the rows are the ticks and the end."""
    ticks = np.append(step * np.arange(round(t_end / step)), t_end)
    return simulate(model, rig, t_end, events="held", step=step, engine=engine, t_eval=ticks)


def _late(step: float, chart: Trace) -> tuple[float, float]:
    """Return the delay of the first break-away [s] and the residual at `LOOK` [N]."""
    looked = simulate(MODEL, RIG, LOOK, method="rk4", step=step, events="step", engine="ifelse")
    left = looked.sample([LOOK]).F - chart.sample([LOOK]).F
    return float(looked.transitions.t[0] - chart.transitions.t[0]), float(np.abs(left)[0])


def predicted(late: FloatArray, chart: Trace) -> FloatArray:
    """Return the residual at `LOOK` expected from a late first break-away.

    During the delay the slider moves by v late, and so do the deflections; afterwards each excess
    decays as exp(-C t / s).

    Parameters
    ----------
    late : ndarray, shape (m,), s
        Delays.
    chart : Trace
        The run with located switches.

    Returns
    -------
    ndarray, shape (m,), N
        The residuals.
    """
    p, first = MODEL.parameters, chart.transitions[0]
    rate = p.C / first.s  # 1/s
    per_metre = ((p.k - p.sigma * rate) * np.exp(-rate * (LOOK - first.t))).sum()
    return np.asarray(first.v * late * per_metre)


def figure(result: Result) -> Figure:
    """Draw the friction, its residual over time and over the delay, and that of held outputs.

    Parameters
    ----------
    result : Result
        From `run`.

    Returns
    -------
    Figure
        Panels a to f.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from plots import panels
    from plots.style import INK, RC, REPORTED, TEXT_GREY

    log = result.chart.transitions
    first, arrest = float(log.t[0]), float(log.t[log.edge == "arrest"][0])
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 10.6), layout="constrained")
        axes = sheet.subplot_mosaic(
            [["a", "a"], ["b", "b"], ["c", "d"], ["e", "f"]], height_ratios=(1, 1.2, 1.5, 1.5)
        )
        force, residual, zoom, lateness = (axes[letter] for letter in "abcd")
        looks = (
            (result.chart, "chart, located", INK, "-"),
            (result.ifelse_once, "if-else, once per step", TEXT_GREY, "--"),
        )
        for trace, name, colour, dash in looks:
            (line,) = panels.force(force, trace)
            line.set(color=colour, linestyle=dash, label=name, linewidth=1.4)
        panels.lettered(force, "a", f"friction, {MODEL.title}")
        force.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
        force.set_xlabel("")
        force.tick_params(labelbottom=False)

        panels.difference(residual, result.t, result.residual)
        residual.set(ylim=(1e-7, 30), xlim=(0, END))
        panels.lettered(residual, "b", "their difference")
        residual.axhline(PAPERS, **REPORTED)
        for text, place, align in (
            ("the paper's $10^{-3}$ N", (0.3, 1.5 * PAPERS), "left"),
            ("spike at the\nbreak-away", (first + 0.25, 0.06), "left"),
            ("missed arrests →", (arrest - 0.2, 2.0), "right"),
            (
                f"same driver: {result.differ[0]} of {result.differ[1]} numbers differ (located), "
                f"{result.differ_once[0]} of {result.differ_once[1]} (once per step)",
                (END - 0.3, 3e-7),
                "right",
            ),
        ):
            residual.annotate(text, place, ha=align, fontsize=8, color=TEXT_GREY)

        window = (first - 0.8e-3, first + 1.2e-3)
        for trace, _, colour, dash in looks:
            part = panels.shown(trace, window)
            zoom.plot(1e3 * (part.t - first), part.F, color=colour, linestyle=dash, linewidth=1.6)
        rows = result.ifelse_once
        near = (rows.t > window[0]) & (rows.t < window[1]) & (rows.microstep == 0)
        zoom.plot(1e3 * (rows.t[near] - first), rows.F[near], "o", color=TEXT_GREY, markersize=5)
        zoom.set(xlabel=f"t − {first:.4f} s [ms]", ylabel="F [N]", xlim=(-0.8, 1.2))
        panels.lettered(zoom, "c", "the break-away: late if once per step")
        zoom.annotate(
            "dots: ends of steps",
            (0.97, 0.94),
            xycoords="axes fraction",
            ha="right",
            va="top",
            color=TEXT_GREY,
            fontsize=8,
        )

        _draw_lateness(lateness, result)
        _draw_held(axes["e"], axes["f"], result)
        sheet.suptitle(f"Lesson 8: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet


def _draw_lateness(ax: Axes, result: Result) -> None:
    """Draw the residual of a switch over its delay."""
    from plots import panels
    from plots.style import INK, LINE_GREY, REPORTED, TEXT_GREY

    times = np.geomspace(0.5 * result.late.min(), 2 * result.late.max(), 20)
    ax.loglog(1e3 * times, predicted(times, result.chart), color=LINE_GREY, zorder=1)
    ax.loglog(1e3 * result.late, result.left, "o", color=INK, markersize=5)
    ax.axhline(PAPERS, **REPORTED)
    ax.annotate(
        f"the paper's $10^{{-3}}$ N:\n{1e3 * result.late_for_the_papers:.1f} ms late",
        (1e3 * times[0], PAPERS),
        (2, 4),
        textcoords="offset points",
        color=TEXT_GREY,
        fontsize=8,
    )
    ax.annotate(
        "line: v late Σ k, decaying\nas exp(−C t/s)",
        (0.97, 0.05),
        xycoords="axes fraction",
        ha="right",
        color=TEXT_GREY,
        fontsize=8,
    )
    ax.set(xlabel="delay of the switch [ms]", ylabel=f"difference at {LOOK:g} s [N]")
    panels.lettered(ax, "d", "residual of a late switch")


def _draw_held(over_time: Axes, over_period: Axes, result: Result) -> None:
    """Draw the residual of held outputs in the experiment of Fig. 3."""
    from plots import panels
    from plots.style import TEXT_GREY

    panels.lag_over_time(over_time, result.pushed, PAPERS_FORCE, window=(0.0, PUSHED_END))
    over_time.legend(loc="upper left")
    over_time.annotate(
        "the paper's $10^{-4}$ N",
        (0.02, -1e3 * PAPERS_FORCE),
        (2, -4),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        va="top",
        color=TEXT_GREY,
        fontsize=8,
    )
    panels.lettered(over_time, "e", "outputs held for h, in Fig. 3")
    panels.lag_over_period(
        over_period,
        result.pushed,
        (PAPERS_FORCE, PAPERS_PLACE),
        phases={"ramp": RAMP, "oscillation": OSCILLATION},
    )
    over_period.legend(loc="upper left", ncols=2)
    panels.lettered(over_period, "f", "the same at its largest, over h")
