"""Lesson 5: the number of elements.

A measured first loading is a smooth curve, which n elements approximate by n straight segments.
Here the curve is the parabola f(x) = F_c (1 - (1 - x/X)**2) (chosen by us), because its best
approximation is known: evenly spaced thresholds, s_i = i X/n, and n equal springs of 2 F_c/(n X),
the last one half as stiff. The error is then at most F_c/(4 n**2).

The plateau is right for any n, even n = 1. Few elements lose the small loops: as long as no element
slips, nothing is dissipated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, Trace, simulate
from gms_fsm.charts.parameters import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "bank", "figure", "parabola", "run", "small_loop"]

TITLE = "How many elements"
QUESTION = "How many elements are enough?"

COUNTS = (1, 2, 4, 12)
F_c, X = 1.0, 100e-6  # N, m: the plateau, and where it begins
STROKE, SMALL = 1.2 * X, 0.4 * X  # m: length of the first loading, and amplitude of the small loop
SPEED, OMEGA = 10e-6, 1.0  # m/s, rad/s
RTOL, ATOL = 1e-10, 1e-13  # 1, m: z is in micrometres here


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    loadings, loops : dict of int to Trace
        Runs of the first loading and of the small loop, by the number of elements.
    errors : ndarray, shape (4,), N
        Largest deviation of the first loading from the parabola.
    losses : ndarray, shape (4,), J
        Energy dissipated in one small loop.
    """

    loadings: dict[int, Trace]
    loops: dict[int, Trace]
    errors: FloatArray
    losses: FloatArray

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {"four elements": self.loops[4]}

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        errors = ", ".join(
            f"{100 * e / F_c:.3g} % (n = {n})" for n, e in zip(COUNTS, self.errors, strict=True)
        )
        losses = ", ".join(
            f"{100 * abs(e) / smooth_loss(SMALL):.1f} % (n = {n})"
            for n, e in zip(COUNTS, self.losses, strict=True)
        )
        return (
            f"Question: {QUESTION}",
            f"Run: GMS, {bank(1).law} law, n = {', '.join(map(str, COUNTS))} elements fitted to a "
            f"parabola that reaches F_c = {F_c:g} N at {1e6 * X:g} um; loaded once to "
            f"{1e6 * STROKE:g} um, and moved back and forth by {1e6 * SMALL:g} um (chosen by us).",
            f"Measured: the largest error of the first loading is {errors} of F_c: 1/(4 n^2).",
            "Measured: of the energy that the smooth curve dissipates in a loop of "
            f"{1e6 * SMALL:g} "
            f"um, the models dissipate {losses}; a model whose first element slips beyond the loop "
            "dissipates none.",
            "So: four elements give the curve within 2 %; the damping of small motions depends on "
            "the smallest threshold: put it well below the smallest motion of interest.",
        )


def run() -> Result:
    """Load each model once, and move it back and forth.

    Returns
    -------
    Result
        Traces and measured values.

    Examples
    --------
    >>> run().errors.round(6).tolist()
    [0.25, 0.0625, 0.015625, 0.001736]
    """
    loading = Prescribed(SPEED)
    swing = Prescribed(f"{SMALL * OMEGA}*cos({OMEGA}*t)")
    loadings = {n: simulate(bank(n), loading, STROKE / SPEED, rtol=RTOL, atol=ATOL) for n in COUNTS}
    loops = {
        n: simulate(bank(n), swing, 4.5 * math.pi / OMEGA, rtol=RTOL, atol=ATOL) for n in COUNTS
    }
    errors = []
    for trace in loadings.values():
        fine = trace.refined(4000)
        errors.append(float(np.abs(fine.F - parabola(fine.x)).max()))
    losses = [_work(small_loop(trace)) for trace in loops.values()]
    return Result(loadings, loops, np.array(errors), np.array(losses))


def bank(n: int) -> GMS:
    """Return n elements that follow the parabola.

    Parameters
    ----------
    n : int
        Number of elements.

    Returns
    -------
    GMS
        A model of plain springs and sliders, F_s = F_c.

    Examples
    --------
    >>> bank(4).parameters.k.tolist()
    [5000.0, 5000.0, 5000.0, 2500.0]
    """
    s = X * np.arange(1, n + 1) / n
    k = np.full(n, 2 * F_c / (n * X))
    k[-1] /= 2
    parameters = GMSParameters.from_shares(
        k * s / F_c, k, C=200.0, stribeck=Stribeck(F_c=F_c, F_s=F_c, v_s=1e-3), v_c=1e-6
    )
    return GMS(parameters, law="signed")


def parabola(x: ArrayLike) -> FloatArray:
    """Return the smooth first loading f(x), N.

    Parameters
    ----------
    x : array_like, m
        Positions >= 0.

    Returns
    -------
    ndarray, N
        Forces, of the same shape.

    Examples
    --------
    >>> parabola([0.0, 50e-6, 1.0]).tolist()
    [0.0, 0.75, 1.0]
    """
    return np.asarray(F_c * (1 - (1 - np.minimum(np.asarray(x, dtype=float), X) / X) ** 2))


def smooth_loss(a: float) -> float:
    """Return the energy dissipated in one loop of amplitude a <= X by the smooth curve, J.

    By Masing's rule both branches are f doubled; the area between them is 4 F_c a**3 / (3 X**2).
    """
    return 4 * F_c * a**3 / (3 * X**2)


def small_loop(trace: Trace) -> Trace:
    """Return one period of the loop, from its first reversal, with all rows and fine samples."""
    begin = 0.5 * math.pi / OMEGA
    grid = np.linspace(begin, begin + 2 * math.pi / OMEGA, 4001)
    inside = trace.t[(trace.t > grid[0]) & (trace.t < grid[-1])]
    return trace.sample(np.union1d(grid, inside))


def _work(trace: Trace) -> float:
    return float((0.5 * (trace.F[1:] + trace.F[:-1]) * np.diff(trace.x)).sum())


def figure(result: Result) -> Figure:
    """Draw first loadings, small loops, and the errors over n.

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
    from plots.style import ELEMENT_DASHES, PALE_GREY, RC, TEXT_GREY, ramp

    colours = ramp("compared", len(COUNTS))
    looks = list(zip(COUNTS, colours, ELEMENT_DASHES, strict=False))
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 6.8), layout="constrained")
        (loading, loop), (error, loss) = sheet.subplots(2, 2, height_ratios=(1.5, 1))
        x = np.linspace(0, STROKE, 400)
        loading.plot(1e6 * x, parabola(x), color=PALE_GREY, linewidth=6, zorder=1)
        swing = SMALL * np.linspace(-1, 1, 200)
        half = 2 * parabola((SMALL + swing) / 2) - float(parabola(SMALL))  # Masing
        for branch in (half, -half[::-1]):
            loop.plot(1e6 * swing, branch, color=PALE_GREY, linewidth=6, zorder=1)
        for n, colour, dash in looks:
            trace = result.loadings[n].refined(500)
            cycle = small_loop(result.loops[n])
            for ax, run_ in ((loading, trace), (loop, cycle)):
                ax.plot(
                    1e6 * run_.x,
                    run_.F,
                    color=colour,
                    linestyle=dash,
                    label=f"n = {n}",
                    linewidth=1.6,
                )
        loading.plot([], [], color=PALE_GREY, linewidth=6, label="smooth curve")
        loading.legend(loc="lower right", handlelength=3.2)
        loading.set(xlabel="x [µm]", ylabel="F [N]", xlim=(0, None), ylim=(0, None))
        panels.lettered(loading, "a", "first loading, signed law, $F_s$ = $F_c$")
        loop.set(xlabel="x [µm]", ylabel="F [N]")
        panels.lettered(loop, "b", f"back and forth by {1e6 * SMALL:g} µm")
        loop.annotate(
            "n = 1 and n = 2: no element slips,\na line and no loop",
            (0.03, 0.97),
            xycoords="axes fraction",
            va="top",
            color=TEXT_GREY,
        )

        many = np.geomspace(1, 14, 50)
        error.loglog(many, 100 / (4 * many**2), color=TEXT_GREY, linewidth=0.9)
        error.annotate(r"$F_c / 4n^2$", (5, 1), (5, 5), textcoords="offset points", color=TEXT_GREY)
        error.set_xticks(COUNTS, [str(n) for n in COUNTS])
        error.set_xticks([], minor=True)
        error.set(xlabel="elements n", ylabel="largest error [% of $F_c$]")
        panels.lettered(error, "c", "error of the first loading")
        for n, colour, e in zip(COUNTS, colours, result.errors, strict=True):
            error.plot(n, 100 * e / F_c, "o", color=colour, markersize=7, zorder=3)
        _draw_losses(loss, result)
        sheet.suptitle(f"Lesson 5: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet


def _draw_losses(ax: Axes, result: Result) -> None:
    """Draw the energy dissipated in the small loop over n."""
    from plots import panels
    from plots.style import INK, PALE_GREY, TEXT_GREY

    share = 100 * np.abs(result.losses) / smooth_loss(SMALL)
    places = np.arange(len(COUNTS))
    ax.bar(places, share, width=0.6, facecolor=PALE_GREY, edgecolor=INK)
    ax.axhline(100, color=INK, linestyle="--", linewidth=0.9)
    for place, value in zip(places, share, strict=True):
        ax.annotate(
            f"{value:.1f} %",
            (place, value),
            (0, 3 if value < 90 else -4),
            textcoords="offset points",
            ha="center",
            va="bottom" if value < 90 else "top",
        )
    ax.annotate(
        "smooth curve",
        (-0.3, 100),
        (0, -4),
        textcoords="offset points",
        va="top",
        color=TEXT_GREY,
    )
    ax.set_xticks(places, [str(n) for n in COUNTS])
    ax.set(xlabel="elements n", ylabel="energy per loop [%]", ylim=(0, 112))
    panels.lettered(ax, "d", "damping of the small loop")
