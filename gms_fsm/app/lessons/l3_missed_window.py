"""Lesson 3: an integrator that steps over v_c.

An element arrests only while |v| <= v_c = 1e-6 m/s. At a reversal of this motion that window is 32
us wide. A program that evaluates its guards once per step of 1 ms hits it at one reversal in
thirty, by chance. Otherwise the element continues to slip with the wrong sign of v, and from then
on its deflection and the friction are wrong. A tighter tolerance does not help: each step is
accurate, but the guards are evaluated too rarely.

``events="step"`` is such a program. ``events="located"`` takes the same steps, but monitors the
comparisons inside them, cuts a step where one changes, and evaluates the guards there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm import GMS, GMSParameters, Prescribed, Trace, simulate
from gms_fsm.charts.parameters import FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "figure", "run", "samples_in_window", "window_width"]

TITLE = "The missed window"
QUESTION = "What happens when an integrator misses v_c?"

A, PERIOD, END = 0.2, 20.0, 61.0  # m/s, s, s
RIG = Prescribed(f"{A}*sin(2*pi*t/{PERIOD})")
MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")
V_C = MODEL.parameters.v_c
REVERSALS = np.arange(PERIOD / 2, END, PERIOD / 2)  # s
STEP = 1.003e-3  # s: does not divide the period
STEPS = (1e-3, 1.0001e-3, 1.001e-3, STEP, 1.007e-3)
ROWS = np.linspace(0.0, END, 6101)


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    located, once : Trace
        Runs with fixed steps of `STEP`: switches located, and guards evaluated once per step.
    counts : tuple of int
        Number of switches found with guards evaluated once per step, for each of `STEPS`.
    met : tuple of int
        Number of reversals with a sample of that grid in the window.
    late : float
        Largest delay of the first break-aways with guards evaluated once per step, s.
    arrest_error : float
        Largest deviation of a located arrest from the time at which |v| = v_c, s.
    z_error, F_error : float
        Largest errors with guards evaluated once per step, m and N.
    """

    located: Trace
    once: Trace
    counts: tuple[int, ...]
    met: tuple[int, ...]
    late: float
    arrest_error: float
    z_error: float
    F_error: float

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {"located": self.located, "once per step": self.once}

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        total = len(self.located.transitions)
        luck = ", ".join(
            f"{count} with {1e3 * h:g} ms ({met} of {REVERSALS.size} reversals hit)"
            for h, count, met in zip(STEPS, self.counts, self.met, strict=True)
        )
        odds = window_width() / STEP
        return (
            f"Question: {QUESTION}",
            f"Run: {MODEL.title}, Table I (stick-slip), v = {A:g} sin(2 pi t/{PERIOD:g}) m/s "
            f"(chosen by us), {END:g} s, rk4 with steps of {1e3 * STEP:g} ms; guards evaluated "
            "once per step, and located.",
            f"Measured: once per step, {len(self.once.transitions)} of {total} switches are "
            "found, the "
            f"first ones {1e3 * self.late:.2f} ms late; z is wrong by up to {self.z_error:.2f} m, "
            f"F by {self.F_error:.2f} N. With the same steps, locating finds all {total}, and "
            f"arrests at |v| = v_c within {self.arrest_error:.0e} s.",
            f"Measured: |v| <= v_c lasts {1e6 * window_width():.0f} us, so a step hits it with a "
            f"probability of {100 * odds:.0f} %. Switches found once per step: {luck}.",
            "So: a step that hits the window is luck, not accuracy (1 ms divides the half period, "
            "1.0001 ms "
            "nearly does). Locate the switches, or test with a step that does not divide the "
            "period.",
        )


def run() -> Result:
    """Run the same steps with guards evaluated once per step and located, and other steps.

    Returns
    -------
    Result
        Traces and measured values.
    """
    located = simulate(MODEL, RIG, END, method="rk4", step=STEP, t_eval=ROWS)
    looked = {step: once_a_step(step) for step in STEPS}
    once = looked[STEP]
    arrests = located.transitions[located.transitions.edge == "arrest"]
    # Times at which |v| falls to v_c, shortly before the reversal: A |sin| = v_c.
    due = REVERSALS - PERIOD / (2 * math.pi) * math.asin(V_C / A)
    nearest = np.abs(arrests.t[:, None] - due).min(axis=1)
    return Result(
        located=located,
        once=once,
        counts=tuple(len(trace.transitions) for trace in looked.values()),
        met=tuple(samples_in_window(step) for step in STEPS),
        late=float((once.transitions.t[: MODEL.n] - located.transitions.t[: MODEL.n]).max()),
        arrest_error=float(nearest.max()),
        z_error=float(np.abs(once.z - located.z).max()),
        F_error=float(np.abs(once.F - located.F).max()),
    )


def once_a_step(step: float) -> Trace:
    """Run with guards evaluated once per step.

    Parameters
    ----------
    step : float
        Step size, s.

    Returns
    -------
    Trace
        The run, with rows at `ROWS`.
    """
    return simulate(
        MODEL, RIG, END, method="rk4", step=step, events="step", engine="ifelse", t_eval=ROWS
    )


def window_width() -> float:
    """Return the duration of |v| <= v_c at a reversal, s.

    Examples
    --------
    >>> round(1e6 * window_width(), 1)
    31.8
    """
    return PERIOD / math.pi * math.asin(V_C / A)


def samples_in_window(step: float) -> int:
    """Count the reversals with a sample of the grid in the window, without a run.

    Parameters
    ----------
    step : float
        Step size, s.

    Returns
    -------
    int
        Count, 0 to `REVERSALS.size`.

    Examples
    --------
    >>> samples_in_window(1e-3), samples_in_window(1.003e-3)
    (6, 0)
    """
    return sum(bool(np.abs(_velocity(t)).min() <= V_C) for t in _samples(step))


def _samples(step: float) -> list[FloatArray]:
    """Return the times of the samples next to each reversal, s."""
    return [step * (round(t / step) + np.arange(-3, 4)) for t in REVERSALS.tolist()]


def _velocity(t: FloatArray) -> FloatArray:
    return np.asarray(A * np.sin(2 * math.pi * t / PERIOD))


def figure(result: Result) -> Figure:
    """Draw a reversal, the friction, the states, and the number of switches found per step size.

    Parameters
    ----------
    result : Result
        From `run`.

    Returns
    -------
    Figure
        Panels a to e.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from plots import panels
    from plots.style import INK, LINE_GREY, PALE_GREY, RC, TEXT_GREY

    found = {"located": result.located, "once per step": result.once}
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 8.2), layout="constrained")
        axes = sheet.subplot_mosaic(
            [["a", "b"], ["c", "c"], ["d", "d"], ["e", "e"]], height_ratios=(1.7, 1.5, 1, 1)
        )
        near, counts, force = axes["a"], axes["b"], axes["c"]
        # The reversal that is missed by the largest margin.
        t = max(_samples(STEP), key=lambda t: float(np.abs(_velocity(t)).min()))
        turn = round(float(t.mean()))
        t = t[np.abs(t - turn) < 2e-3]
        line = turn + np.array([-2e-3, 2e-3])
        up = np.sign(_velocity(line)[1])
        near.axhspan(-1e6 * V_C, 1e6 * V_C, color=LINE_GREY, linewidth=0.8, zorder=1)
        near.plot(1e3 * (line - turn), 1e6 * _velocity(line), color=INK, zorder=2)
        near.plot(1e3 * (t - turn), 1e6 * _velocity(t), "o", color=INK, markersize=7, zorder=3)
        near.set(xlabel=f"t − {turn:g} s [ms]", ylabel="v [µm/s]", xlim=(-2, 2))
        panels.lettered(near, "a", f"samples of {1e3 * STEP:g} ms at a reversal")
        near.annotate(
            f"|v| ≤ $v_c$, {1e6 * window_width():.0f} µs long",
            (1.95, 0),
            (0, -up * 4),
            textcoords="offset points",
            ha="right",
            va="top" if up > 0 else "bottom",
            color=TEXT_GREY,
        )

        places = np.arange(len(STEPS))
        counts.bar(places, result.counts, width=0.62, facecolor=PALE_GREY, edgecolor=INK)
        for place, count, met in zip(places, result.counts, result.met, strict=True):
            counts.annotate(
                f"{met} of {REVERSALS.size}",
                (place, count),
                (0, 3),
                textcoords="offset points",
                ha="center",
                fontsize=8,
            )
        counts.set_xticks(places, [f"{1e3 * h:g}" for h in STEPS], fontsize=8)
        counts.set(xlabel="step [ms]", ylabel="switches found once per step", ylim=(0, 62))
        panels.lettered(counts, "b", "luck (above: reversals hit by a sample)")
        counts.axhline(len(result.located.transitions), color=INK, linestyle="--", linewidth=0.9)
        counts.annotate(
            f"located, {1e3 * STEP:g} ms: {len(result.located.transitions)}",
            (places[-1] + 0.4, len(result.located.transitions)),
            (0, 3),
            textcoords="offset points",
            ha="right",
            color=TEXT_GREY,
            fontsize=8,
        )

        looks = ((INK, "-"), (TEXT_GREY, "--"))
        for (name, trace), (colour, dash) in zip(found.items(), looks, strict=True):
            lines = panels.force(force, trace)
            lines[0].set(color=colour, linestyle=dash, label=name, linewidth=1.4)
        panels.lettered(force, "c", f"friction, {MODEL.title}")
        force.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
        for letter, (name, trace) in zip("de", found.items(), strict=True):
            panels.ribbons(axes[letter], trace)
            panels.lettered(
                axes[letter], letter, f"states, {name}: {len(trace.transitions)} switches"
            )
        for letter in "cd":
            axes[letter].set_xlabel("")
            axes[letter].tick_params(labelbottom=False)
        sheet.suptitle(
            f"Lesson 3: {QUESTION.replace('v_c', '$v_c$')}", x=0.01, ha="left", fontsize=12
        )
    return sheet
