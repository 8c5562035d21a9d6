"""Lesson 7: frictional lag.

In steady sliding the friction is s(v) + sigma_2 v. When the speed changes, the deflections follow
with a delay: by ``dz = C (1 - z/s)`` z approaches s with the time constant s/C. While the slider
accelerates, the friction is therefore still that of the lower speed, which is higher, and while it
decelerates the friction is lower: a loop around the steady curve.

The usual rule says that the loop grows with the frequency. It does, as long as the deflections can
follow. Above w = C/s they follow less and less, and the loop closes again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, Trace, simulate
from gms_fsm.charts.parameters import FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "figure", "last_period", "run"]

TITLE = "Frictional lag"
QUESTION = "Why does friction lag behind the speed?"

MEAN, SWING = 1.5e-3, 1e-3  # m/s: v = MEAN + SWING cos(w t), never zero
SHOWN = (1.0, 10.0, 25.0)  # rad/s
OMEGAS = (1.0, 3.0, 10.0, 25.0, 35.0, 45.0, 60.0, 100.0, 250.0, 600.0)  # rad/s
C = 50.0  # N/s, of the whole model
STRIBECK = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
SIGMA_2 = 0.4  # Ns/m
PARAMETERS = GMSParameters.from_shares(
    [0.25] * 4, [40e3, 30e3, 20e3, 10e3], C=C, stribeck=STRIBECK, v_c=1e-6, sigma_2=SIGMA_2
)
MODEL = GMS(PARAMETERS, law="signed")
RTOL, ATOL = 1e-9, 1e-12  # 1, m: z is in micrometres here
SETTLED = 1.0  # s: by then all elements slip and the initial transient has decayed


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    runs : dict of float to Trace
        Complete runs, by the frequency w, rad/s.
    loops : dict of float to Trace
        Last period of each run.
    widths : ndarray, shape (10,), N
        Friction during acceleration minus friction during deceleration, at the mean speed.
    """

    runs: dict[float, Trace]
    loops: dict[float, Trace]
    widths: FloatArray

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {"10 rad/s": self.runs[10.0]}

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        width = dict(zip(OMEGAS, 1e3 * self.widths, strict=True))
        shown = ", ".join(f"{width[w]:.1f} mN at {w:g} rad/s" for w in SHOWN)
        widest = OMEGAS[int(self.widths.argmax())]
        return (
            f"Question: {QUESTION}",
            f"Run: {MODEL.title}, all in slip, v = {1e3 * MEAN:g} + {1e3 * SWING:g} cos(w t) mm/s, "
            f"F_s = {STRIBECK.F_s:g}, F_c = {STRIBECK.F_c:g} N, v_s = {1e3 * STRIBECK.v_s:g} mm/s, "
            f"C = {C:g} N/s (chosen by us), w = {OMEGAS[0]:g} to {OMEGAS[-1]:g} rad/s.",
            f"Measured: at {1e3 * MEAN:g} mm/s friction is higher during acceleration than "
            f"during deceleration, by {shown}.",
            f"Measured: of {len(OMEGAS)} loops the widest is at {widest:g} rad/s "
            f"({width[widest]:.0f} mN; C/F_c = {C / STRIBECK.F_c:g}/s) and they close again "
            f"above that: {width[100.0]:.0f} mN at 100, {width[600.0]:.0f} mN at 600 rad/s.",
            'So: friction depends on the speed a time s/C ago. "Wider with frequency" holds up to '
            "about w = C/s; the frequency of the widest loop reveals C.",
        )


def run() -> Result:
    """Move the model at ten frequencies.

    Returns
    -------
    Result
        Traces and measured values.

    Examples
    --------
    >>> result = run()
    >>> bool((result.widths > 0).all()), OMEGAS[int(result.widths.argmax())]
    (True, 45.0)
    """
    runs = {w: simulate(MODEL, _rig(w), _end(w), rtol=RTOL, atol=ATOL) for w in OMEGAS}
    loops = {w: last_period(trace, w) for w, trace in runs.items()}
    widths = []
    for w, trace in runs.items():
        # From the top speed, the mean speed comes after a quarter and three quarters of a period.
        top = _end(w) - 2 * math.pi / w
        down, up = trace.sample(top + np.array([0.25, 0.75]) * 2 * math.pi / w).F
        widths.append(up - down)
    return Result(runs, loops, np.array(widths))


def _rig(w: float) -> Prescribed:
    return Prescribed(f"{MEAN} + {SWING}*cos({w}*t)")


def _end(w: float) -> float:
    """Return the end of the first complete period that begins after `SETTLED`, s."""
    period = 2 * math.pi / w
    return period * (math.ceil(SETTLED / period) + 1)


def last_period(trace: Trace, w: float) -> Trace:
    """Return the last period of a run.

    Parameters
    ----------
    trace : Trace
        The run.
    w : float
        Frequency, rad/s.

    Returns
    -------
    Trace
        1001 evenly spaced samples, from top speed to top speed.
    """
    end = _end(w)
    return trace.sample(np.linspace(end - 2 * math.pi / w, end, 1001).clip(max=trace.t[-1]))


def figure(result: Result) -> Figure:
    """Draw three loops around the steady curve, and the loop width over frequency.

    Parameters
    ----------
    result : Result
        From `run`.

    Returns
    -------
    Figure
        Panels a and b.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from plots import panels
    from plots.style import (
        ELEMENT_DASHES,
        INK,
        LINE_GREY,
        PALE_GREY,
        RC,
        TEXT_GREY,
        ramp,
    )

    shades = ramp("compared", len(SHOWN))
    looks = list(zip(SHOWN, shades, ELEMENT_DASHES, strict=False))
    colours = dict(zip(SHOWN, shades, strict=True))
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 4.8), layout="constrained")
        loops, widths = sheet.subplots(1, 2, width_ratios=(1.5, 1))
        v = np.linspace(MEAN - SWING, MEAN + SWING, 300)
        loops.plot(
            1e3 * v,
            STRIBECK(v) + SIGMA_2 * v,
            color=PALE_GREY,
            linewidth=6,
            zorder=1,
            label=r"steady: s(v) + $\sigma_2$ v",
        )
        for w, colour, dash in looks:
            loop = result.loops[w]
            loops.plot(
                1e3 * loop.v,
                loop.F,
                color=colour,
                linestyle=dash,
                linewidth=1.6,
                label=f"{w:g} rad/s",
            )
            for row in (250, 750):  # an arrowhead on each branch, at the mean speed
                loops.annotate(
                    "",
                    (1e3 * loop.v[row + 4], loop.F[row + 4]),
                    (1e3 * loop.v[row - 4], loop.F[row - 4]),
                    arrowprops={"arrowstyle": "-|>", "color": colour, "mutation_scale": 13},
                )
        loops.annotate("accelerating", (1.55, 1.235), color=TEXT_GREY)
        loops.annotate("decelerating", (0.75, 0.99), color=TEXT_GREY)
        loops.set(xlabel="v [mm/s]", ylabel="F [N]", ylim=(0.96, None))
        panels.lettered(loops, "a", f"loops, {MODEL.title}")
        loops.legend(loc="upper right", handlelength=3.2)

        widths.semilogx(OMEGAS, 1e3 * result.widths, "-", color=LINE_GREY, zorder=1)
        marked = dict(zip(OMEGAS, 1e3 * result.widths, strict=True))
        for w, width in marked.items():
            colour = colours.get(w, INK)
            widths.plot(w, width, "o", color=colour, markersize=7 if w in SHOWN else 4)
        widths.axvline(C / STRIBECK.F_c, color=LINE_GREY, linestyle="--", linewidth=0.9, zorder=0)
        widths.annotate(
            "C/F$_c$", (C / STRIBECK.F_c, 4), (4, 0), textcoords="offset points", color=TEXT_GREY
        )
        widths.set(xlabel="w [rad/s]", ylabel=f"width at {1e3 * MEAN:g} mm/s [mN]", ylim=(0, 200))
        panels.lettered(widths, "b", "width of the loop")
        ticks = (1, 3, 10, 30, 100, 300)
        widths.set_xticks(ticks, [str(tick) for tick in ticks])
        widths.minorticks_off()
        sheet.suptitle(f"Lesson 7: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet
