"""Lesson 4: the sign of s(v) for v < 0.

Eq. (1) of the paper, ``dz = sgn(v) C (1 - z/s)``, and the signed law of Al-Bender, Lampaert and
Swevers, ``dz = C (sgn(v) - z/s)``, are identical for v > 0. For v < 0 the signed law pulls z to -s;
the published law pushes it away from +s, where its eigenvalue is +C/s. An element that slips
backward then stretches its spring further than the slider moves: the spring gains energy that was
not supplied.

An energy balance shows this independently of the choice of law. A part of the work of the motion is
stored in the springs; the rest is heat, and heat can only increase.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gms_fsm import GMS, GMSParameters, Prescribed, Trace, simulate
from gms_fsm.app.paper import FIG4_END, VELOCITY
from gms_fsm.charts.gms import Law
from gms_fsm.charts.parameters import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Energy", "Result", "energy", "figure", "run"]

TITLE = "The sign of s(v)"
QUESTION = "What depends on the sign of s(v) for v < 0?"

PARAMETERS = GMSParameters.paper("stick-slip")
POINTS = 20_000  # for the integrals over time


@dataclass(frozen=True, eq=False)
class Energy:
    """The energy balance of a run.

    Parameters
    ----------
    t : ndarray, shape (m,), s
        Time.
    v : ndarray, shape (m,), m/s
        Velocity.
    work, stored : ndarray, shape (m,), J
        The integral of F v; the sum of k z**2 / 2.
    """

    t: FloatArray
    v: FloatArray
    work: FloatArray
    stored: FloatArray

    @property
    def heat(self) -> FloatArray:
        """Work minus stored energy, shape (m,), J."""
        return self.work - self.stored

    @property
    def lost_heat(self) -> FloatArray:
        """Decrease of heat from each time to the next, shape (m - 1,), J, >= 0."""
        return np.maximum(-np.diff(self.heat), 0.0)

    @property
    def outside_dip(self) -> NDArray[np.bool_]:
        """Whether s(v) is flat between each time and the next, shape (m - 1,)."""
        outside = np.abs(self.v) > PARAMETERS.stribeck.dip
        return outside[1:] & outside[:-1]


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    published, signed : Trace
        Fig. 4 under both laws.
    published_energy, signed_energy : Energy
        Their energy balances.
    vanished : ndarray, shape (2,), J
        Total decrease of heat, published and signed.
    outside_dip : ndarray, shape (2,), J
        The part of it where s(v) is flat.
    """

    published: Trace
    signed: Trace
    published_energy: Energy
    signed_energy: Energy
    vanished: FloatArray
    outside_dip: FloatArray

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {"published law": self.published, "signed law": self.signed}

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        lowest = ", ".join(f"{z:.2f}" for z in self.published.z.min(axis=0))
        t, z = self.published.t, self.published.z[:, 0]
        cycles = ", ".join(f"{z[(t >= a) & (t <= a + 25)].min():.2f}" for a in (0, 25, 50, 75))
        published, signed = self.published_energy, self.signed_energy
        return (
            f"Question: {QUESTION}",
            f"Run: GMS, Table I (stick-slip), v = {VELOCITY} m/s (chosen by us), {FIG4_END:g} s, "
            "under the published law (eq. (1) as printed) and under the signed law.",
            f"Measured: with the published law the z_i fall to {lowest} m (z_1 to {cycles} m in "
            "the four "
            f"cycles); signed, |z_i| is {np.abs(self.signed.z).max():.4f} m at most, in both "
            f"directions (s is {PARAMETERS.stribeck.F_c:g} m in sliding, weights 1 m/N).",
            f"Measured: of {published.work[-1]:.2f} J of work the springs of the published law "
            f"store {published.stored[-1]:.2f} J at the end; meanwhile {self.vanished[0]:.1f} J "
            f"of heat turn back into spring energy. Signed law: {signed.stored[-1]:.2f} J of "
            f"{signed.work[-1]:.2f} J, and {1e3 * self.vanished[1]:.1f} mJ of heat vanish, "
            f"{1e3 * self.outside_dip[1]:.1g} mJ of them outside the Stribeck dip.",
            'So: with s(v) unsigned for v < 0 the model creates energy. Use law="signed"; it also '
            "creates a little, where s(v) rises at a reversal and z follows while the slider "
            "hardly moves.",
        )


def run() -> Result:
    """Run Fig. 4 under both laws and compute the energy balances.

    Returns
    -------
    Result
        Traces and measured values.

    Examples
    --------
    >>> result = run()
    >>> bool(result.vanished[0] > 1.0), bool(result.vanished[1] < 0.02)
    (True, True)
    """

    def under(law: Law) -> Trace:
        return simulate(GMS(PARAMETERS, law=law), Prescribed(VELOCITY), FIG4_END)

    published, signed = under("published"), under("signed")
    balances = (energy(published), energy(signed))
    return Result(
        published=published,
        signed=signed,
        published_energy=balances[0],
        signed_energy=balances[1],
        vanished=np.array([each.lost_heat.sum() for each in balances]),
        outside_dip=np.array([each.lost_heat[each.outside_dip].sum() for each in balances]),
    )


def energy(trace: Trace) -> Energy:
    """Compute the energy balance of a run.

    Parameters
    ----------
    trace : Trace
        A run of a GMS model.

    Returns
    -------
    Energy
        The energy balance.
    """
    fine = trace.refined(POINTS)  # both sides of every jump of F are rows
    power = fine.F * fine.v
    steps = 0.5 * (power[1:] + power[:-1]) * np.diff(fine.t)
    work = np.concatenate([[0.0], np.cumsum(steps)])
    stored = (0.5 * PARAMETERS.k * fine.z**2).sum(axis=1)
    return Energy(fine.t, fine.v, work, stored)


def figure(result: Result) -> Figure:
    """Draw deflections, energies and states under both laws.

    Parameters
    ----------
    result : Result
        From `run`.

    Returns
    -------
    Figure
        Two columns of three panels.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from plots import panels
    from plots.style import LINE_GREY, RC, TEXT_GREY

    columns = (
        ("published law, eq. (1) as printed", result.published, result.published_energy),
        ("signed law (Al-Bender et al. 2005)", result.signed, result.signed_energy),
    )
    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 7.6), layout="constrained")
        axes = sheet.subplots(3, 2, sharex=True, sharey="row", height_ratios=(1.3, 1.5, 0.9))
        for column, (_, trace, balance) in zip(axes.T, columns, strict=True):
            panels.deflections(column[0], trace)
            for sign in (1, -1):
                column[0].axhline(
                    sign * PARAMETERS.stribeck.F_c, color=LINE_GREY, linewidth=0.7, zorder=0
                )
            _balance(column[1], balance)
            panels.ribbons(column[2], trace)
            for ax in column[:2]:
                ax.set_xlabel("")
        for ax in axes[:, 1]:
            ax.set_ylabel("")
        panels.lettered(axes[0, 0], "a", columns[0][0])
        panels.lettered(axes[0, 1], "b", columns[1][0])
        panels.lettered(axes[1, 0], "c", "energy (hatched: heat turns back)")
        panels.lettered(
            axes[1, 1], "d", f"energy ({1e3 * result.vanished[1]:.1f} mJ turn back: invisible)"
        )
        axes[0, 1].annotate(
            "all four $z_i$ together\ngrey: ± s(v) away from reversals",
            (0.97, 0.04),
            xycoords="axes fraction",
            ha="right",
            color=TEXT_GREY,
        )
        handles, labels = axes[0, 0].get_legend_handles_labels()
        axes[0, 0].legend(
            handles,
            labels,
            loc="lower left",
            ncols=4,
            handlelength=1.8,
            columnspacing=1.0,
            borderaxespad=0.0,
        )
        axes[1, 1].legend(loc="upper left")
        sheet.suptitle(f"Lesson 4: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet


def _balance(ax: Axes, balance: Energy) -> None:
    from plots.style import INK, LINE_GREY, PALE_GREY, TEXT_GREY

    for values, colour, dash, name in (
        (balance.work, INK, "-", "work of the motion"),
        (balance.stored, TEXT_GREY, "--", "stored in the springs"),
        (balance.heat, LINE_GREY, "-", "heat: work minus stored"),
    ):
        ax.plot(balance.t, values, color=colour, linestyle=dash, linewidth=1.5, label=name)
    # Where more than 0.05 W turns back.
    falls = np.append(balance.lost_heat > 0.05 * np.diff(balance.t), False)
    ax.fill_between(
        balance.t,
        0,
        1,
        where=falls,
        transform=ax.get_xaxis_transform(),
        facecolor=PALE_GREY,
        edgecolor=LINE_GREY,
        linewidth=0.0,
        hatch="////",
        alpha=0.6,
        zorder=0,
    )
    ax.set_ylabel("energy [J]")
