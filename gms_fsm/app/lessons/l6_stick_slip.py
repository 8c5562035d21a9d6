"""Lesson 6: stick-slip of a pulled mass.

A mass is pulled through a soft spring whose end moves at V. It waits until the spring pulls with
F_s. When it begins to slide, friction falls along the Stribeck curve from F_s to F_c, and the
surplus force throws it forward until the spring is slack enough for it to stop. Then it waits
again.

A cycle thus has two different parts. The wait is the time needed to stretch the spring again by
the same amount: a length divided by V. The slip is half an oscillation of a mass on a spring and
hardly depends on V. At a high speed the mass no longer comes to rest and slides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm import GMS, GMSParameters, PulledSlider, Stribeck, Trace, simulate
from gms_fsm.charts.parameters import FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Cycle", "Result", "bank", "figure", "last_cycle", "run"]

TITLE = "Stick-slip"
QUESTION = "Why does a pulled mass stick and slip?"

MASS, STIFFNESS = 1.0, 2.0  # kg, N/m
SPEED, END = 0.1, 60.0  # m/s, s: for the phase portrait
SPEEDS = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2)  # m/s
TOO_FAST = 0.25  # m/s
F_c, F_s, V_S = 1.0, 1.5, 0.05  # N, N, m/s
SIGMA_2 = 0.4  # Ns/m
K = np.array([40.0, 30.0, 20.0, 10.0])  # N/m


@dataclass(frozen=True)
class Cycle:
    """The last complete cycle of a run.

    Parameters
    ----------
    slip, wait : float
        Times from gross slip to the first arrest, and from there to the next gross slip, s.
    pull_at_slip, pull_at_stop : float
        Force of the spring at both ends of the wait, N.
    """

    slip: float
    wait: float
    pull_at_slip: float
    pull_at_stop: float


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    portrait : Trace
        The run at `SPEED`.
    cycles : tuple of Cycle
        At each of `SPEEDS`.
    rests : dict of str to int
        Number of arrests in runs without stick-slip.
    """

    portrait: Trace
    cycles: tuple[Cycle, ...]
    rests: dict[str, int]

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {f"pulled at {SPEED:g} m/s": self.portrait}

    @property
    def waits(self) -> FloatArray:
        """Waiting times at each of `SPEEDS`, s."""
        return np.array([cycle.wait for cycle in self.cycles])

    @property
    def slips(self) -> FloatArray:
        """Slip times at each of `SPEEDS`, s."""
        return np.array([cycle.slip for cycle in self.cycles])

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        log, v = self.portrait.transitions, self.portrait.v
        here = self.cycles[SPEEDS.index(SPEED)]
        slow, fast = self.waits[0] + self.slips[0], self.waits[-1] + self.slips[-1]
        lengths = 1e3 * self.waits * np.array(SPEEDS)
        never = ", ".join(f"{count} {name}" for name, count in self.rests.items())
        return (
            f"Question: {QUESTION}",
            f"Run: {self.portrait.model.title}, {MASS:g} kg pulled from rest through {STIFFNESS:g} "
            f"N/m at {SPEED:g} m/s, and at {SPEEDS[0]:g} to {TOO_FAST:g} m/s (F_s = {F_s:g}, F_c = "
            f"{F_c:g} N, v_s = {V_S:g} m/s, all chosen by us).",
            f"Measured at {SPEED:g} m/s: {len(log)} transitions in {END:g} s, "
            f"{int((log.edge == 'arrest').sum())} of them arrests, v from {v.min():.3f} to "
            f"{v.max():.2f} m/s; the spring pulls with {here.pull_at_slip:.2f} N at gross slip and "
            f"with {here.pull_at_stop:.2f} N at the first arrest; period "
            f"{here.wait + here.slip:.2f} s.",
            f"Measured: the period falls from {slow:.1f} s at {SPEEDS[0]:g} m/s to {fast:.1f} s at "
            f"{SPEEDS[-1]:g} m/s: a wait of {lengths.min():.0f} to {lengths.max():.0f} mm / V and "
            f"a slip of {self.slips.min():.1f} to {self.slips.max():.1f} s. Arrests in other runs: "
            f"{never}.",
            "So: stick-slip needs friction that falls with speed, and a slow pull; the wait is a "
            "length "
            f"divided by V. At {SPEEDS[-1]:g} m/s both are possible: started from rest the mass "
            "sticks and slips, started in motion it keeps sliding.",
        )


def run() -> Result:
    """Pull the mass at several speeds.

    Returns
    -------
    Result
        Traces and measured values.
    """
    portrait = simulate(bank(), PulledSlider(MASS, STIFFNESS, SPEED), END)
    cycles = tuple(
        # Long enough for the first pull and three cycles.
        last_cycle(simulate(bank(), PulledSlider(MASS, STIFFNESS, V), 2.0 / V + 20.0))
        for V in SPEEDS
    )
    fastest = SPEEDS[-1]
    s = float(bank().stribeck(fastest))
    sliding = {
        "x": -(s + SIGMA_2 * fastest) / STIFFNESS,
        "v": fastest,
        "z": s * bank().weights,
        "states": ["slip"] * K.size,
    }
    others = {
        f"at {TOO_FAST:g} m/s": simulate(bank(), PulledSlider(MASS, STIFFNESS, TOO_FAST), END),
        f"at {SPEED:g} m/s with F_s = F_c": simulate(
            bank(F_s=F_c), PulledSlider(MASS, STIFFNESS, SPEED), END
        ),
        f"at {fastest:g} m/s, started in motion": simulate(
            bank(), PulledSlider(MASS, STIFFNESS, fastest), END, initial=sliding
        ),
    }
    rests = {
        name: int((trace.transitions.edge == "arrest").sum()) for name, trace in others.items()
    }
    return Result(portrait, cycles, rests)


def bank(F_s: float = F_s) -> GMS:
    """Return the friction model: four elements, each with a quarter of the friction.

    Parameters
    ----------
    F_s : float
        Stiction, N.

    Returns
    -------
    GMS
        The model, with the signed law.

    Examples
    --------
    >>> bank().title
    'GMS, 4 elements, signed law'
    """
    parameters = GMSParameters(
        K,
        [0.4, 0.3, 0.2, 0.1],
        [0.02] * 4,
        sigma_2=SIGMA_2,
        stribeck=Stribeck(F_c=F_c, F_s=F_s, v_s=V_S),
        v_c=1e-6,
        weights=1 / (4 * K),
    )
    return GMS(parameters, law="signed")


def last_cycle(trace: Trace) -> Cycle:
    """Measure the last complete cycle of a run with stick-slip.

    Parameters
    ----------
    trace : Trace
        A run with at least two gross slips.

    Returns
    -------
    Cycle
        The parts of the cycle.
    """
    log = trace.transitions
    slipping = np.cumsum(np.where(log.target == "slip", 1, -1))
    starts = log.t[(slipping == trace.n) & (log.target == "slip")][-2:]
    arrests = log.t[log.edge == "arrest"]
    stop = arrests[np.searchsorted(arrests, starts[0])]
    pulled = trace.sample([stop, starts[1]])
    assert isinstance(trace.rig, PulledSlider)
    pull = trace.rig.stiffness * (trace.rig.speed * pulled.t - pulled.x)
    return Cycle(
        slip=float(stop - starts[0]),
        wait=float(starts[1] - stop),
        pull_at_slip=float(pull[1]),
        pull_at_stop=float(pull[0]),
    )


def figure(result: Result) -> Figure:
    """Draw v and states over time, the phase portrait, and the parts of the period over speed.

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
    from plots.style import INK, LINE_GREY, RC, TEXT_GREY

    trace = result.portrait
    window = (30.0, 60.0)
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 7.8), layout="constrained")
        axes = sheet.subplot_mosaic([["a", "a"], ["b", "b"], ["c", "d"]], height_ratios=(1, 0.9, 2))
        panels.velocity(axes["a"], trace, window=window)
        panels.lettered(axes["a"], "a", f"velocity, pulled at {SPEED:g} m/s; {trace.model.title}")
        axes["a"].set_xlabel("")
        axes["a"].tick_params(labelbottom=False)
        panels.ribbons(axes["b"], trace, window=window)
        panels.lettered(axes["b"], "b", "states")
        loop = axes["c"]
        panels.portrait(loop, trace, window=window)
        v = np.linspace(0.0, 0.38, 400)
        curve = trace.model.stribeck
        assert curve is not None  # a GMS model has one
        steady = curve(v) + SIGMA_2 * v
        loop.plot(v, steady, color=LINE_GREY, linestyle="--", linewidth=1.2, zorder=1)
        panels.lettered(loop, "c", "friction over velocity")
        loop.set_ylim(0.6, 1.55)
        for text, place in (
            ("thrown forward →", (0.13, 1.31)),
            ("← slows down", (0.2, 1.03)),
            ("waits, oscillating\non its bristles", (0.045, 0.77)),
            (r"dashed: steady, s(v) + $\sigma_2$ v", (0.12, 0.63)),
        ):
            loop.annotate(text, place, color=TEXT_GREY, fontsize=8)

        V, parts = np.array(SPEEDS), axes["d"]
        guide = np.geomspace(V[0], V[-1], 20)
        length = float(np.median(result.waits * V))
        parts.loglog(guide, length / guide, ":", color=LINE_GREY)
        parts.annotate(
            f"{length:.2f} m / V",
            (0.03, length / 0.03),
            (-4, -4),
            textcoords="offset points",
            ha="right",
            va="top",
            color=TEXT_GREY,
            fontsize=8,
        )
        curves = (
            ("period", result.waits + result.slips, "D-", INK, INK),
            ("wait", result.waits, "o-", TEXT_GREY, TEXT_GREY),
            ("slip", result.slips, "s--", LINE_GREY, TEXT_GREY),
        )
        for name, times, look, colour, ink in curves:
            parts.loglog(V, times, look, color=colour, markersize=5)
            parts.annotate(
                name, (V[-1], times[-1]), (7, 0), textcoords="offset points", va="center", color=ink
            )
        ticks = {"x": (0.01, 0.02, 0.05, 0.1, 0.2), "y": (1, 2, 5, 10, 20, 50)}
        parts.set_xticks(ticks["x"], [f"{tick:g}" for tick in ticks["x"]])
        parts.set_yticks(ticks["y"], [f"{tick:g}" for tick in ticks["y"]])
        parts.minorticks_off()
        parts.set(xlabel="pulling speed V [m/s]", ylabel="time [s]", xlim=(0.009, 0.33))
        panels.lettered(parts, "d", "a cycle and its parts")
        sheet.suptitle(f"Lesson 6: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet
