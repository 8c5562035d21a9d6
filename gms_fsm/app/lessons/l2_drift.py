"""Lesson 2: why LuGre drifts and GMS does not.

A slider is pushed with a force below break-away and then shaken. LuGre's bristle gives way at any
load: ``dz = v - sigma_0 |v| z / s(v)``, so x - z grows at the rate sigma_0 |v| z / s(v), which has
the sign of z whichever way the slider moves. Under a load every stroke, forward or backward,
creeps forward. A GMS element in stick has ``dz = v``: it is a spring, x - z is constant, and every
deflection is recovered.

With the numbers of Table I of the paper there is nothing else to see: no element can slip at 0.5 N,
so the run would look the same with four ordinary springs. A third run therefore scales the
thresholds by w_i = 0.25/k_i (chosen by us): an element really slips and arrests, and then nothing
drifts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm import GMS, GMSParameters, Slider, Trace, simulate
from gms_fsm.app.paper import FORCE
from gms_fsm.app.paper.experiments import lugre_like
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.language import evaluate
from gms_fsm.systems.signals import Formula

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "cycle_means", "figure", "run"]

TITLE = "Drift"
QUESTION = "Why does LuGre drift and GMS not?"

END = 30.0  # s
PERIOD, STEADY = 0.5, 10.0  # s: period of the shaking, and start of the measurement
TABLE_I = GMSParameters.paper("non-drifting")


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    lugre, springs, slipping : Trace
        LuGre; GMS with Table I, where no element can slip; GMS with weights 0.25/k.
    drifts : ndarray, shape (3,), m/s
        Steady drift of each.
    plastic : ndarray, shape (3,), m
        x - z_1 at the end: displacement that the first bristle does not recover.
    """

    lugre: Trace
    springs: Trace
    slipping: Trace
    drifts: FloatArray
    plastic: FloatArray

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {"GMS, weights 0.25/k": self.slipping, "LuGre": self.lugre}

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        x = 1e3 * self.lugre.sample([2.0, END]).x
        low, high = 1e3 * _range(self.springs)
        low_slipping, high_slipping = 1e3 * _range(self.slipping)
        log = self.slipping.transitions
        story = ", ".join(f"element {r.element + 1} {r.edge} at {r.t:.3f} s" for r in log)
        needed = float(TABLE_I.k[0]) * TABLE_I.stribeck.F_s
        return (
            f"Question: {QUESTION}",
            "Run: 1 kg pushed by F_a up to 0.5 N, then 0.25 N and a vibration of 0.1 N at 2 Hz "
            f"(chosen by us); {self.lugre.model.title}; {self.springs.model.title}, Table I; "
            f"{self.slipping.model.title}, Table I with weights 0.25/k (chosen by us).",
            f"Measured: LuGre is at {x[0]:.2f} mm at 2 s and at {x[1]:.2f} mm at {END:g} s, a "
            f"steady {1e3 * self.drifts[0]:.2f} mm/s; {1e3 * self.plastic[0]:.2f} mm of it is "
            f"plastic (x - z). GMS with Table I stays between {low:.3f} and {high:.3f} mm, with "
            f"{len(self.springs.transitions)} transitions: element 1 would need "
            f"{needed:.0f} N to slip.",
            f"Measured with elements that slip: {story}; then x stays between "
            f"{low_slipping:.2f} and {high_slipping:.2f} mm, drift {self.drifts[2]:.0e} m/s.",
            "So: under a load every stroke of LuGre, forward or backward, is slightly plastic; a "
            "GMS "
            "element is a pure spring below its threshold. To show this, use a run with slip: with "
            "Table I four springs behave the same.",
        )


def run() -> Result:
    """Push and shake the three sliders.

    Returns
    -------
    Result
        Traces and measured values.

    Examples
    --------
    >>> result = run()
    >>> bool(result.drifts[0] > 1e-4), bool(abs(result.drifts[2]) < 1e-9)
    (True, True)
    """
    slider = Slider(1.0, FORCE)
    models = (
        lugre_like(TABLE_I),
        GMS(TABLE_I, law="published"),
        GMS(TABLE_I.with_weights(0.25 / TABLE_I.k), law="signed"),
    )
    lugre, springs, slipping = (simulate(model, slider, END) for model in models)
    runs = (lugre, springs, slipping)
    slopes = [np.polyfit(*cycle_means(trace), 1)[0] for trace in runs]
    plastic = [trace.x[-1] - trace.z[-1, 0] for trace in runs]
    return Result(lugre, springs, slipping, np.array(slopes), np.array(plastic))


def cycle_means(trace: Trace) -> tuple[FloatArray, FloatArray]:
    """Return the middle of each cycle of the vibration, and the mean position in it.

    Parameters
    ----------
    trace : Trace
        A run to `END`.

    Returns
    -------
    (ndarray, ndarray)
        Times [s] and positions [m], each of shape (cycles,).
    """
    starts = np.arange(STEADY, END, PERIOD)
    phases = PERIOD * (np.arange(50) + 0.5) / 50
    x = trace.sample((starts[:, None] + phases).ravel()).x
    return starts + PERIOD / 2, x.reshape(starts.size, -1).mean(axis=1)


def _range(trace: Trace) -> FloatArray:
    """Return the lowest and the highest x after `STEADY`, m."""
    x = trace.sample(np.linspace(STEADY, END, 4001)).x
    return np.array([x.min(), x.max()])


def figure(result: Result) -> Figure:
    """Draw the force, the positions, and F over x of the three runs.

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
    from plots.style import INK, RC, TEXT_GREY

    runs = (
        ("c", result.lugre, "LuGre", "creeps with every stroke", INK, TEXT_GREY),
        ("d", result.springs, "GMS, Table I", "published law, no element can slip", INK, TEXT_GREY),
        (
            "e",
            result.slipping,
            "GMS, weights 0.25/k",
            "signed law, element 1 slips",
            INK,
            TEXT_GREY,
        ),
    )
    grid = np.linspace(0.0, END, 6001)
    F_a = [evaluate(Formula(FORCE).tree, {"t": t}) for t in grid.tolist()]
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 7.4), layout="constrained")
        axes = sheet.subplot_mosaic(
            [["a"] * 3, ["b"] * 3, ["c", "d", "e"]], height_ratios=(0.7, 1.7, 1.5)
        )
        push, place = axes["a"], axes["b"]
        push.plot(grid, F_a, color=INK, linewidth=0.9)
        push.set(xlim=(0, END), ylim=(0, 0.55), ylabel="$F_a$ [N]")
        panels.lettered(push, "a", "applied force (chosen by us)")
        push.tick_params(labelbottom=False)
        place.set(xlim=(0, END), ylim=(0, 19), xlabel="t [s]", ylabel="x [mm]")
        panels.lettered(place, "b", "position")
        for letter, trace, name, what, colour, ink in runs:
            x = 1e3 * trace.sample(grid).x
            place.plot(grid, x, color=colour, linewidth=0.9)
            under = letter == "d"  # the curve of LuGre is above it there
            place.annotate(
                f"{name}: {what}",
                (0.995 * END, x[-200:].min() if under else x[-200:].max()),
                (0, -5 if under else 5),
                textcoords="offset points",
                ha="right",
                va="top" if under else "bottom",
                color=ink,
            )
            ax = axes[letter]
            lines = panels.hysteresis(
                ax, trace, [("rising", 2.0), ("falling", 4.0), ("shaking", np.inf)]
            )
            lines[1].set(linestyle="--")
            ax.set_ylim(-0.02, 0.62)
            panels.lettered(ax, letter, name)
        peak = int(result.slipping.F.argmax())
        axes["e"].annotate(
            f"{result.slipping.F[peak]:.2f} N for a moment:\n" r"$\sigma_1$ dz as it stops",
            (1e3 * result.slipping.x[peak], 0.62),
            (-6, -3),
            textcoords="offset points",
            ha="right",
            va="top",
            color=TEXT_GREY,
            fontsize=8,
        )
        axes["c"].legend(loc="upper right")
        sheet.suptitle(f"Lesson 2: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet
