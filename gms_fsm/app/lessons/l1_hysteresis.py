"""Lesson 1: pre-sliding hysteresis.

A contact gives way before it slides. Each Maxwell element is a spring that slips at its own
deflection s_i, so on the first loading the elements slip one after another, and the stiffness falls
from the sum of all springs to zero on a plateau. After a reversal an element must travel 2 s_i
before it slips in the other direction: the return branch is the first loading curve, twice as large
(Masing's rule). The elements that still stick are a memory: when the motion returns to an earlier
reversal point, the force passes through the same point again and continues as if the inner loop
had never happened.

Here the motion is 0, A, B, C, D, E with |v| = 10 um/s, and each element has F_s = F_c, so that it
is a plain spring and slider.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, Stribeck, Trace, simulate
from gms_fsm.charts.parameters import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "figure", "first_loading", "masing", "run", "strokes"]

TITLE = "Pre-sliding hysteresis"
QUESTION = "What is pre-sliding hysteresis?"

NAMES = "ABCDE"
TURNS = np.array([20e-6, -12e-6, 12e-6, -6e-6, 30e-6])  # m: reversal points; the motion ends at E
SPEED, RAMP = 10e-6, 0.02  # m/s; s for the velocity to grow from 0 to that
K = np.array([40e3, 30e3, 20e3, 10e3])  # N/m
STRIBECK = Stribeck(F_c=1.0, F_s=1.0, v_s=1e-3)  # flat
PARAMETERS = GMSParameters.from_shares([0.25] * 4, K, C=200.0, stribeck=STRIBECK, v_c=1e-6)
FINE = 1e-13  # m, absolute tolerance: z is in micrometres here


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    gms, lugre : Trace
        The GMS model, and a LuGre bristle of the same initial stiffness with the same motion.
    turn_times : ndarray, shape (5,), s
        Times at A, B, C, D, E.
    back : ndarray, shape (2,), s
        Times at which the last stroke returns to C and to A.
    let_go : ndarray, shape (4,), m
        Positions at which the elements slip on the first loading.
    misses, lugre_misses : ndarray, shape (2,), N
        Force on return minus the force at the reversal, at C and at A.
    masing_error : float
        Largest deviation of the run from Masing's rule, N.
    loss : float
        Energy dissipated from A back to A, J.
    """

    gms: Trace
    lugre: Trace
    turn_times: FloatArray
    back: FloatArray
    let_go: FloatArray
    misses: FloatArray
    lugre_misses: FloatArray
    masing_error: float
    loss: float

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {"GMS": self.gms}

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        path = ", ".join(f"{1e6 * x:+.0f}" for x in TURNS)
        let_go = ", ".join(f"{1e6 * x:.2f}" for x in self.let_go)
        at_C, at_A = np.abs(self.misses)
        first = self.gms.transitions[0]
        stiffness = first.F_before / self.let_go[first.element]
        return (
            f"Question: {QUESTION}",
            f"Run: {self.gms.model.title}, F_s = F_c (a spring and a slider each), moved to "
            f"{path} um at {1e6 * SPEED:g} um/s; for comparison LuGre with the same initial "
            "stiffness and F_c. Motion and parameters are chosen by us.",
            f"Measured: on the first loading the elements slip at x = {let_go} um, so the curve "
            f"is piecewise linear, from {stiffness / 1e3:.1f} N/mm to a plateau of "
            f"{self.gms.F[-1]:.3f} N; from A back to A {1e6 * self.loss:.2f} uJ are dissipated.",
            f"Measured: on return to C the force differs by {at_C:.0e} N, on return to A by "
            f"{at_A:.0e} N; every branch is the doubled first loading curve (Masing) within "
            f"{self.masing_error:.0e} N. LuGre misses C by {abs(self.lugre_misses[0]):.3f} N and "
            f"A by {abs(self.lugre_misses[1]):.3f} N.",
            "So: pre-sliding hysteresis comes from elements that slip one by one, and its memory "
            "from "
            "those that still stick. A single LuGre bristle also makes loops, but they do not "
            "close.",
        )


def run() -> Result:
    """Move the GMS model and the bristle through nested reversals.

    Returns
    -------
    Result
        Traces and measured values.

    Examples
    --------
    >>> [float(x) for x in np.round(1e6 * run().let_go, 3)]
    [6.25, 8.333, 12.5, 25.0]
    """
    velocity, turn_times = strokes(TURNS)
    end = float(turn_times[-1])
    lugre = LuGre(sigma_0=float(K.sum()), sigma_1=0.0, sigma_2=0.0, stribeck=STRIBECK)
    gms_run = simulate(GMS(PARAMETERS, law="signed"), Prescribed(velocity), end, atol=FINE)
    lugre_run = simulate(lugre, Prescribed(velocity), end, atol=FINE)

    # Times at which the last stroke, at constant speed from D, is at C and at A again.
    back = turn_times[3] + RAMP / 2 + (TURNS[[2, 0]] - TURNS[3]) / SPEED
    misses, lugre_misses = (
        trace.sample(back).F - trace.sample(turn_times[[2, 0]]).F for trace in (gms_run, lugre_run)
    )
    log = gms_run.transitions
    let_go = gms_run.sample([log.t[log.element == i][0] for i in range(gms_run.n)]).x
    fine = gms_run.refined(4000)
    cycle = (fine.t >= turn_times[0]) & (fine.t <= back[1])
    x, F = fine.x[cycle], fine.F[cycle]
    return Result(
        gms=gms_run,
        lugre=lugre_run,
        turn_times=turn_times,
        back=back,
        let_go=let_go,
        misses=misses,
        lugre_misses=lugre_misses,
        masing_error=float(np.abs(fine.F - masing(fine.t, fine.x, turn_times)).max()),
        loss=float((0.5 * (F[1:] + F[:-1]) * np.diff(x)).sum()),
    )


def strokes(turns: Sequence[float] | FloatArray) -> tuple[list[tuple[float, float]], FloatArray]:
    """Return a velocity that leads from 0 to each reversal point, and the times of the reversals.

    The velocity passes through 0 in ramps, since a jump would skip the window |v| <= v_c.

    Parameters
    ----------
    turns : sequence of float, m
        Reversal points.

    Returns
    -------
    (list of (float, float), ndarray)
        Corners (t [s], v [m/s]), and times [s].

    Examples
    --------
    >>> corners, times = strokes([10e-6])
    >>> corners, times.tolist()
    ([(0.0, 0.0), (0.02, 1e-05), (1.0, 1e-05), (1.02, 0.0)], [1.02])
    """
    corners, times = [(0.0, 0.0)], []
    t = here = 0.0
    for there in turns:
        v = float(np.copysign(SPEED, there - here))
        end = t + abs(there - here) / SPEED + RAMP
        corners += [(t + RAMP, v), (end - RAMP, v), (end, 0.0)]
        times.append(end)
        t, here = end, float(there)
    return corners, np.array(times)


def first_loading(x: ArrayLike) -> FloatArray:
    """Return the force of the first loading at x: springs that slip at s_i.

    Parameters
    ----------
    x : array_like, m
        Positions, of either sign.

    Returns
    -------
    ndarray, N
        Forces, of the same shape.

    Examples
    --------
    >>> first_loading([-5e-6, 1.0]).round(12).tolist()
    [-0.5, 1.0]
    """
    s = PARAMETERS.weights * STRIBECK.F_c
    return np.asarray((K * np.clip(np.asarray(x)[..., None], -s, s)).sum(axis=-1))


def masing(t: FloatArray, x: FloatArray, turn_times: FloatArray) -> FloatArray:
    """Return the force by Masing's rule, which uses reversal points but no elements.

    Parameters
    ----------
    t, x : ndarray, shape (m,)
        Times, s, and positions, m.
    turn_times : ndarray, shape (5,), s
        Times at A, B, C, D, E.

    Returns
    -------
    ndarray, shape (m,), N
        The force.
    """
    F, F_turn = np.empty_like(x), list[float]()
    for stroke, end in enumerate(turn_times):
        now = (t <= end) & (t >= (turn_times[stroke - 1] if stroke else 0.0))
        F[now] = _branch(stroke, F_turn, x[now])
        F_turn.append(float(_branch(stroke, F_turn, TURNS[stroke])))
    return F


def _branch(stroke: int, F_turn: Sequence[float], x: ArrayLike) -> FloatArray:
    """Return the force of a stroke; even strokes rise, odd strokes fall.

    From the last reversal (x_r, F_r) the stroke follows ``F_r +- 2 f(|x - x_r| / 2)``, where f is
    the first loading. At the reversal before that the inner loop closes, and the stroke continues
    along the older branch.
    """
    x, sign = np.asarray(x), 1.0 if stroke % 2 == 0 else -1.0
    F = first_loading(x)
    for i in range(1 - stroke % 2, stroke, 2):  # from the oldest branch to the newest
        branch = F_turn[i] + 2 * sign * first_loading(sign * (x - TURNS[i]) / 2)
        F = branch if i == 0 else np.where(sign * (TURNS[i - 1] - x) > 0, branch, F)
    return F


def figure(result: Result) -> Figure:
    """Draw the loops of both models, Masing's rule, the motion and the states.

    Parameters
    ----------
    result : Result
        From `run`.

    Returns
    -------
    Figure
        Panels a to d.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from plots import panels
    from plots.style import INK, LINE_GREY, PAPER, RC, TEXT_GREY

    gms, lugre = result.gms, result.lugre
    end = float(result.turn_times[-1])
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 7.0), layout="constrained")
        axes = sheet.subplot_mosaic([["a", "b"], ["c", "c"], ["d", "d"]], height_ratios=(3, 1, 1.1))
        for ax, trace in ((axes["a"], gms), (axes["b"], lugre)):
            _loops(ax, trace, result)
        t = np.linspace(0, end, 44)[1:-1]
        x = gms.sample(t).x
        axes["a"].plot(
            1e6 * x,
            masing(t, x, result.turn_times),
            "o",
            color=TEXT_GREY,
            markersize=4.5,
            markerfacecolor=PAPER,
            zorder=4,
        )
        panels.lettered(axes["a"], "a", f"{gms.model.title}: loops close")
        notes = {
            "a": "circles: doubled first loading\n(Masing's rule)",
            "b": "dashed: first loading\nblack: last stroke, D to E\nsquares: back at C and A",
        }
        for name, note in notes.items():
            axes[name].annotate(
                note, (0.98, 0.04), xycoords="axes fraction", ha="right", color=TEXT_GREY
            )
        panels.lettered(axes["b"], "b", "LuGre, same initial stiffness: open loops")
        axes["b"].sharey(axes["a"])

        motion = axes["c"]
        motion.plot(gms.t, 1e6 * gms.x, color=INK)
        motion.set(xlim=(0, end), ylabel="x [µm]")
        panels.lettered(motion, "c", "motion (chosen by us)")
        motion.tick_params(labelbottom=False)
        motion.margins(y=0.25)
        for name, time, place in zip(NAMES, result.turn_times, TURNS, strict=True):
            up = place > 0
            motion.annotate(
                name,
                (float(time), 1e6 * place),
                (0, 3 if up else -3),
                textcoords="offset points",
                ha="right" if time == end else "center",
                va="bottom" if up else "top",
                fontweight="bold",
            )
        for i, time, left in ((2, result.back[0], False), (0, result.back[1], True)):
            motion.plot(time, 1e6 * TURNS[i], "s", color=INK, markersize=4)
            motion.annotate(
                f"back at {NAMES[i]}",
                (time, 1e6 * TURNS[i]),
                (-6, 3) if left else (6, -3),
                textcoords="offset points",
                ha="right" if left else "left",
                va="bottom" if left else "top",
            )
        panels.ribbons(axes["d"], gms)
        panels.lettered(axes["d"], "d", "states of the elements")
        for time in result.turn_times[:-1]:
            axes["d"].axvline(time, color=LINE_GREY, linewidth=0.7, zorder=0)
        sheet.suptitle(f"Lesson 1: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet


def _loops(ax: Axes, trace: Trace, result: Result) -> None:
    """Draw F over x, label the reversals, and mark where the last stroke returns to them."""
    from plots import panels
    from plots.style import INK, LINE_GREY

    phases = [("", float(result.turn_times[0])), ("", float(result.turn_times[3])), ("", np.inf)]
    lines = panels.hysteresis(ax, trace, phases)
    looks = ((INK, "--", 1.4), (LINE_GREY, "-", 2.4), (INK, "-", 1.4))
    for line, (colour, dash, width) in zip(lines, looks, strict=True):
        line.set(color=colour, linestyle=dash, linewidth=width)
    corners = trace.sample(result.turn_times)
    ax.plot(1e6 * corners.x, corners.F, "o", color=INK, markersize=5, zorder=5)
    for name, x, F, place in zip(NAMES, corners.x, corners.F, TURNS, strict=True):
        ax.annotate(
            name,
            (1e6 * x, F),
            (0, 10) if place > 0 else (-9, -4),
            textcoords="offset points",
            ha="center",
            va="center",
            fontweight="bold",
        )
    again = trace.sample(result.back)
    ax.plot(1e6 * again.x, again.F, "s", color=INK, markersize=8, markerfacecolor="none", zorder=6)
    ax.margins(y=0.12)
    ax.set_xlim(-17, 33)
