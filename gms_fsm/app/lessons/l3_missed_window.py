"""Lesson 3: what happens when a stepper misses v_c.

An element arrests only while |v| <= v_c = 1e-6 m/s. At a reversal of this motion that window is 32
us wide. A program that looks at its guards once a step of 1 ms meets it at one reversal in thirty,
by chance; else the element goes on slipping with the wrong sign of v, and from then on its
deflection and the friction are wrong. No tolerance helps: each step is accurate, the question is
asked too seldom.

``events="step"`` is such a program. ``events="located"`` makes the same steps, but it watches the
comparisons inside them, cuts a step where one changes, and asks there.
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
QUESTION = "What happens when a stepper misses v_c?"

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
    """What was run and measured.

    Parameters
    ----------
    located, once : Trace
        The same fixed steps of `STEP`, with located switches and with guards looked at once a step.
    counts : tuple of int
        Switches that are found once a step with each of `STEPS`.
    met : tuple of int
        Reversals at which a sample of that grid lies in the window.
    late : float
        Largest lateness of the first break-aways, once a step, s.
    arrest_error : float
        Largest distance of a located arrest from the instant at which |v| = v_c, s.
    z_error, F_error : float
        Largest error once a step, m and N.
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
        """The runs of the replay page, by their names."""
        return {"located": self.located, "once a step": self.once}

    def lines(self) -> tuple[str, ...]:
        """Return the lesson in five lines.

        Returns
        -------
        tuple of str
            Question, what was run, two lines of measured figures, what follows.
        """
        total = len(self.located.transitions)
        luck = ", ".join(
            f"{1e3 * h:g} ms {count} ({met} of {REVERSALS.size} reversals met)"
            for h, count, met in zip(STEPS, self.counts, self.met, strict=True)
        )
        odds = window_width() / STEP
        return (
            f"Question: {QUESTION}",
            f"Run: {MODEL.title}, Table I (stick-slip), v = {A:g} sin(2 pi t/{PERIOD:g}) m/s "
            f"(chosen by us), {END:g} s, rk4 with steps of {1e3 * STEP:g} ms; guards looked at "
            "once a step, and located.",
            f"Measured: once a step finds {len(self.once.transitions)} of {total} switches, the "
            f"first ones {1e3 * self.late:.2f} ms late; z is wrong by up to {self.z_error:.2f} m, "
            f"F by {self.F_error:.2f} N. Located, with the same steps, it finds all {total}, and "
            f"arrests at |v| = v_c within {self.arrest_error:.0e} s.",
            f"Measured: |v| <= v_c lasts {1e6 * window_width():.0f} us, so a step meets it with "
            f"odds of {100 * odds:.0f} %. Switches found with other steps: {luck}.",
            "So: a step that hits is luck, not accuracy (1 ms divides the half period, 1.0001 ms "
            "nearly does). Locate the switches, or test with a step that does not divide the "
            "period.",
        )


def run() -> Result:
    """Run the same steps with guards looked at once a step and located, and other steps.

    Returns
    -------
    Result
        Traces and measured figures.
    """
    located = simulate(MODEL, RIG, END, method="rk4", step=STEP, t_eval=ROWS)
    looked = {step: once_a_step(step) for step in STEPS}
    once = looked[STEP]
    arrests = located.transitions[located.transitions.edge == "arrest"]
    # v falls below v_c this long before it is zero: A |sin| = v_c.
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
    """Run with guards looked at once a step.

    Parameters
    ----------
    step : float
        s.

    Returns
    -------
    Trace
        With `ROWS`.
    """
    return simulate(
        MODEL, RIG, END, method="rk4", step=step, events="step", engine="ifelse", t_eval=ROWS
    )


def window_width() -> float:
    """Return how long |v| <= v_c at a reversal, s.

    Examples
    --------
    >>> round(1e6 * window_width(), 1)
    31.8
    """
    return PERIOD / math.pi * math.asin(V_C / A)


def samples_in_window(step: float) -> int:
    """Count the reversals at which a sample of the grid lies in the window; no run is needed.

    Parameters
    ----------
    step : float
        s.

    Returns
    -------
    int
        0 to `REVERSALS.size`.

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
    """Draw a reversal, the friction, the states, and how many switches each step finds.

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
    from plots.style import BLUE, INK, RC, STATE_FILLS, TEXT_GREY, TEXT_ORANGE, VERMILION

    found = {"located": result.located, "once a step": result.once}
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 8.2), layout="constrained")
        axes = sheet.subplot_mosaic(
            [["a", "b"], ["c", "c"], ["d", "d"], ["e", "e"]], height_ratios=(1.7, 1.5, 1, 1)
        )
        near, counts, force = axes["a"], axes["b"], axes["c"]
        # The reversal that is missed by most.
        t = max(_samples(STEP), key=lambda t: float(np.abs(_velocity(t)).min()))
        turn = round(float(t.mean()))
        t = t[np.abs(t - turn) < 2e-3]
        line = turn + np.array([-2e-3, 2e-3])
        up = np.sign(_velocity(line)[1])
        near.axhspan(-1e6 * V_C, 1e6 * V_C, color=VERMILION, linewidth=0.8, zorder=1)
        near.plot(1e3 * (line - turn), 1e6 * _velocity(line), color=INK, zorder=2)
        near.plot(1e3 * (t - turn), 1e6 * _velocity(t), "o", color=BLUE, markersize=7, zorder=3)
        near.set(xlabel=f"t − {turn:g} s [ms]", ylabel="v [µm/s]", xlim=(-2, 2))
        near.set_title(f"a) samples of {1e3 * STEP:g} ms at a reversal")
        near.annotate(
            f"|v| ≤ $v_c$, {1e6 * window_width():.0f} µs long",
            (1.95, 0),
            (0, -up * 4),
            textcoords="offset points",
            ha="right",
            va="top" if up > 0 else "bottom",
            color=TEXT_ORANGE,
        )

        places = np.arange(len(STEPS))
        counts.bar(places, result.counts, width=0.62, facecolor=STATE_FILLS[0], edgecolor=BLUE)
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
        counts.set(xlabel="step [ms]", ylabel="switches found once a step", ylim=(0, 62))
        counts.set_title("b) luck (above: reversals met by a sample)")
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

        looks = ((INK, "-"), (VERMILION, "--"))
        for (name, trace), (colour, dash) in zip(found.items(), looks, strict=True):
            lines = panels.force(force, trace)
            lines[0].set(color=colour, linestyle=dash, label=name, linewidth=1.4)
        force.set_title(f"c) friction, {MODEL.title}")
        force.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
        for letter, (name, trace) in zip("de", found.items(), strict=True):
            panels.ribbons(axes[letter], trace)
            axes[letter].set_title(f"{letter}) states, {name}: {len(trace.transitions)} switches")
        for letter in "cd":
            axes[letter].set_xlabel("")
            axes[letter].tick_params(labelbottom=False)
        sheet.suptitle(
            f"Lesson 3: {QUESTION.replace('v_c', '$v_c$')}", x=0.01, ha="left", fontsize=12
        )
    return sheet
