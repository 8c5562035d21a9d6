"""Lesson 9: what counts as a contact.

A machine has a bearing, a gear, an end stop, a clutch. They look like different kinds of models.
Here they are one kind. Whatever moves is a body: it has inertia and smooth forces, and its
equations never change. Whatever switches is a contact: a chart on a relative velocity. The chart
gives a force, holds the velocity at 0 (it locks), or sets the velocity (an impact). It does not
know the bodies, and the bodies do not know its states.

| part | relative velocity | chart | in contact it |
|---|---|---|---|
| bearing | load against ground | stiction | locks |
| bearing with pre-sliding | load against ground | a bank of GMS elements | gives a force |
| gear with backlash | motor against load | backlash | gives a force |
| end stop | one mass against another | end stop | sets the velocity |
| dog clutch | shaft against shaft | dog clutch | locks |

Because a contact acts on both bodies with the same impulse, momentum is kept in an impact and when
a clutch closes; energy is not. Because a lock is exact, the velocity of a stuck contact is 0, not
merely small. Each of these statements is checked here on a run, against a formula.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm import Body, Contact, Spring, System, Trace, simulate
from gms_fsm.app.lessons.l6_stick_slip import SIGMA_2, F_c, F_s, bank
from gms_fsm.charts import CHARTS
from gms_fsm.charts.parameters import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "clutch", "figure", "gear", "impact", "pulled", "run"]

TITLE = "Contacts"
QUESTION = "What counts as a contact?"

MASS, STIFFNESS, SPEED = 1.0, 2.0, 0.1  # kg, N/m, m/s: the pulled mass
DRY = {"F_c": F_c, "F_s": F_s, "b": SIGMA_2}  # N, N, Ns/m
FLANK = {"k": 200.0, "d": 0.4, "gap": 0.02}  # Nm/rad, Nms/rad, rad
MOTOR, PERIOD = 0.05, 8.0  # rad/s, s: the motor turns at this speed, forward and backward
BEARING = {"F_c": 0.1, "F_s": 0.15, "b": 0.01}  # Nm, Nm, Nms/rad
STOP = {"x_s": 0.1, "e": 0.5, "v_r": 1e-6}  # m, 1, m/s
MASSES, FIRST = (1.0, 3.0), 1.0  # kg, m/s: speed of the mass that hits the other
DOG = {"t_on": 1.0, "t_off": 10.0}  # s
INERTIAS, SPUN = (1.0, 2.0), 10.0  # kg m2, rad/s: speed of the shaft that turns


def pulled(*, bristles: bool = False) -> System:
    """Return a mass pulled through a spring, with stiction or with a bank of GMS elements.

    Parameters
    ----------
    bristles : bool
        Whether the contact is the bank of lesson 6.

    Returns
    -------
    System
        One body, one contact.

    Examples
    --------
    >>> pulled().contacts[0].chart.name
    'Coulomb friction with stiction'
    """
    pad = Contact("pad", bank()) if bristles else Contact("pad", CHARTS["stiction"], DRY)
    return System(
        "pulled mass",
        bodies=(Body("mass", inertia="m"),),
        springs=(Spring("pulled", "mass", k="K", rest="V * t"),),
        contacts=(pad,),
        numbers={"m": MASS, "K": STIFFNESS, "V": SPEED},
    )


def gear(gap: float = FLANK["gap"]) -> System:
    """Return a motor that turns to and fro, and a load with stiction behind a backlash.

    Parameters
    ----------
    gap : float
        Half of the gap, rad.

    Returns
    -------
    System
        A driven body, a load, and two contacts.

    Examples
    --------
    >>> [contact.name for contact in gear().contacts]
    ['gear', 'bearing']
    """
    return System(
        "gear with backlash",
        bodies=(
            Body("motor", velocity="V * sgn(sin(2 * pi * t / T))", x="q_m", v="w_m"),
            Body("load", inertia="J", x="q_l", v="w_l"),
        ),
        contacts=(
            Contact("gear", CHARTS["backlash"], {**FLANK, "gap": gap}, v="w_m - w_l"),
            Contact("bearing", CHARTS["stiction"], BEARING, v="w_l"),
        ),
        numbers={"V": MOTOR, "T": PERIOD, "J": 5e-3},
    )


def impact(e: float = STOP["e"]) -> System:
    """Return two masses with a stop between them.

    Parameters
    ----------
    e : float
        Restitution.

    Returns
    -------
    System
        Two bodies, one contact.

    Examples
    --------
    >>> impact().contacts[0].v
    ('v_1 - v_2',)
    """
    return System(
        "impact",
        bodies=(
            Body("one", inertia="m_1", x="x_1", v="v_1"),
            Body("two", inertia="m_2", x="x_2", v="v_2"),
        ),
        contacts=(Contact("stop", CHARTS["end-stop"], {**STOP, "e": e}, v="v_1 - v_2"),),
        numbers={"m_1": MASSES[0], "m_2": MASSES[1]},
    )


def clutch() -> System:
    """Return two shafts with a dog clutch.

    Returns
    -------
    System
        Two bodies, one contact.

    Examples
    --------
    >>> clutch().contacts[0].chart.locks
    True
    """
    return System(
        "dog clutch",
        bodies=(
            Body("one", inertia="J_1", x="q_1", v="w_1"),
            Body("two", inertia="J_2", x="q_2", v="w_2"),
        ),
        contacts=(Contact("dog", CHARTS["dog-clutch"], DOG, v="w_1 - w_2"),),
        numbers={"J_1": INERTIAS[0], "J_2": INERTIAS[1]},
    )


@dataclass(frozen=True, eq=False)
class Result:
    """The runs and the measured values.

    Parameters
    ----------
    stiction, bristles : Trace
        The pulled mass, with stiction and with a bank of GMS elements.
    gear : Trace
        The gear with backlash.
    impact : Trace
        Two masses, before and after the impact.
    clutch : Trace
        Two shafts, before and after the clutch closes.
    """

    stiction: Trace
    bristles: Trace
    gear: Trace
    impact: Trace
    clutch: Trace

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return {"stiction": self.stiction, "GMS bank": self.bristles}

    @property
    def speeds_while_stuck(self) -> FloatArray:
        """Velocity of the pulled mass at all rows at which it is stuck, m/s."""
        stuck: FloatArray = self.stiction.v[self.stiction.states[:, 0] == "stuck"]
        return stuck

    @property
    def released(self) -> float:
        """Time at which stiction releases the mass, s."""
        return float(self.stiction.transitions.t[0])

    @property
    def crept(self) -> tuple[float, float]:
        """Time at which all elements of the bank slip [s], and how far it has crept by then [m]."""
        trace = self.bristles
        row = int(np.flatnonzero((trace.states == "slip").all(axis=1))[0])
        return float(trace.t[row]), float(trace.x[row])

    @property
    def dead(self) -> FloatArray:
        """Begin and end of the intervals without contact in the gear after the first, s."""
        log = self.gear.contact("gear").transitions
        leaves = log.t[log.target == "apart"]
        touches = log.t[log.source == "apart"][1:]
        return np.column_stack([leaves, touches])

    @property
    def momentum(self) -> FloatArray:
        """Momentum of the two masses, at all rows, kg m/s."""
        return _sum(MASSES, self.impact)

    @property
    def spin(self) -> FloatArray:
        """Angular momentum of the two shafts, at all rows, Nms."""
        return _sum(INERTIAS, self.clutch)

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        stuck, dead = self.speeds_while_stuck, self.dead[:, 1] - self.dead[:, 0]
        slipped, crept = self.crept
        v = [self.impact.body(name).v for name in ("one", "two")]
        w = [self.clutch.body(name).v for name in ("one", "two")]
        lost_v, lost_w = _lost(MASSES, self.impact), _lost(INERTIAS, self.clutch)
        return (
            f"Question: {QUESTION}",
            f"Run: a mass of {MASS:g} kg, pulled through {STIFFNESS:g} N/m at {SPEED:g} m/s, with "
            f"stiction and with {bank().title}; a motor that turns a load to and fro through a "
            "backlash; two masses with a stop between them; two shafts with a dog clutch (all "
            "values chosen by us).",
            f"Measured: with stiction the mass is stuck at {stuck.size} rows, where the largest "
            f"|v| is {np.abs(stuck).max():g} m/s; it is released at {self.released:.6f} s "
            f"(F_s / (K V) = {F_s / (STIFFNESS * SPEED):g} s). With the bank it has crept "
            f"{1e3 * crept:.1f} mm when all elements slip, at {slipped:.2f} s. The gear has a dead "
            f"time of {dead.mean():.4f} s at each reversal (2 gap / V + d / k = "
            f"{dead_time():.4f} s), during which the load stands still.",
            f"Measured: the impact changes the velocities from {v[0][0]:g} and {v[1][0]:g} m/s to "
            f"{v[0][-1]:g} and {v[1][-1]:g} m/s; momentum changes by {np.ptp(self.momentum):g} kg "
            f"m/s, energy by {-lost_v:.4f} J. The clutch changes {w[0][0]:g} and {w[1][0]:g} rad/s "
            f"to {w[0][-1]:.4f} and {w[1][-1]:.4f} rad/s; angular momentum changes by "
            f"{np.ptp(self.spin):g} Nms, energy by {-lost_w:.2f} J.",
            "So: whatever switches is a contact, a chart on a relative velocity; whatever moves is "
            "a body. To exchange stiction for a bank, or a clutch for a bearing, exchange the "
            "chart: the bodies stay as they are.",
        )


def dead_time(gap: float = FLANK["gap"]) -> float:
    """Return the time in which the motor crosses the gap while the load stands still.

    With damping a flank lets go early, d V / k before the gap opens, since it cannot pull.

    Parameters
    ----------
    gap : float
        Half of the gap, rad.

    Returns
    -------
    float
        s.

    Examples
    --------
    >>> round(dead_time(0.02), 9)
    0.802
    """
    return 2 * gap / MOTOR + FLANK["d"] / FLANK["k"]


def _sum(inertias: tuple[float, float], trace: Trace, power: int = 1) -> FloatArray:
    """Return inertia times speed**power, summed over the bodies, at all rows."""
    one, two = (trace.body(name).v for name in ("one", "two"))
    total: FloatArray = inertias[0] * one**power + inertias[1] * two**power
    return total


def _lost(inertias: tuple[float, float], trace: Trace) -> float:
    """Return the kinetic energy lost from the first to the last row, J."""
    energy = 0.5 * _sum(inertias, trace, power=2)
    return float(energy[0] - energy[-1])


def run() -> Result:
    """Run the five systems.

    Returns
    -------
    Result
        Traces and measured values.
    """
    return Result(
        stiction=simulate(pulled(), 25.0),
        bristles=simulate(pulled(bristles=True), 25.0),
        gear=simulate(gear(), 2 * PERIOD),
        impact=simulate(impact(), 0.3, initial={"one.v": FIRST}),
        clutch=simulate(clutch(), 2.0, initial={"one.v": SPUN}),
    )


def figure(result: Result) -> Figure:
    """Draw each system: velocities, angles, and what is kept.

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
    from plots.style import RC

    with rc_context(RC):
        sheet = Figure(figsize=(8.2, 8.6), layout="constrained")
        axes = sheet.subplot_mosaic(
            [["a", "c"], ["b", "c"], ["d", "d"], ["e", "f"]], height_ratios=(1.6, 0.5, 1.8, 1.8)
        )
        _draw_pulled(axes["a"], axes["c"], result)
        panels.ribbons(axes["b"], result.stiction)
        axes["b"].set(yticklabels=["pad"])
        panels.lettered(axes["b"], "b", "states with stiction")
        _draw_gear(axes["d"], result)
        _draw_pair(axes["e"], result.impact, MASSES, "v [m/s]", "centre of mass")
        panels.lettered(axes["e"], "e", "impact at a stop")
        _draw_pair(axes["f"], result.clutch, INERTIAS, "speed [rad/s]", "mean by inertia")
        panels.lettered(axes["f"], "f", "a dog clutch closes")
        sheet.suptitle(f"Lesson 9: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet


def _draw_pulled(moving: Axes, before: Axes, result: Result) -> None:
    from plots import panels
    from plots.style import INK, TEXT_GREY

    for trace, look, colour in ((result.stiction, "-", INK), (result.bristles, "--", TEXT_GREY)):
        fine = trace.sample(np.linspace(0.0, trace.t[-1], 2001))
        moving.plot(fine.t, fine.v, look, color=colour)
        shown = fine.t <= result.released
        before.plot(fine.t[shown], 1e3 * fine.x[shown], look, color=colour)
    moving.set(ylabel="v [m/s]", xlim=(0, result.stiction.t[-1]))
    moving.tick_params(labelbottom=False)
    panels.lettered(moving, "a", f"pulled mass; dashed: {bank().title}")
    for text, height, colour in (
        ("bank: the bristles yield", 0.6 * 1e3 * result.crept[1], TEXT_GREY),
        ("stiction: x = 0", 1.0, INK),
    ):
        before.annotate(text, (3.0, height), color=colour, fontsize=8)
    before.set(xlabel="t [s]", ylabel="x [mm]", xlim=(0, 8))
    panels.lettered(before, "c", "before stiction lets go")


def _draw_gear(ax: Axes, result: Result) -> None:
    from plots import panels
    from plots.style import INK, LINE_GREY, TEXT_GREY

    for begin, end in result.dead:
        ax.axvspan(begin, end, color=LINE_GREY, alpha=0.25, linewidth=0, zorder=0)
    for name, look, colour in (("motor", "--", TEXT_GREY), ("load", "-", INK)):
        body = result.gear.body(name)
        ax.plot(result.gear.t, body.x, look, color=colour, label=name)
    ax.axhline(0, color=LINE_GREY, linewidth=0.8, zorder=0)
    begin, end = result.dead[0]
    ax.annotate(
        f"dead time {end - begin:.3f} s",
        (end, 0.005),
        (4, 0),
        textcoords="offset points",
        color=TEXT_GREY,
        fontsize=8,
    )
    ax.legend(loc="upper right")
    ax.set(xlabel="t [s]", ylabel="angle [rad]", xlim=(0, 2 * PERIOD))
    panels.lettered(ax, "d", "gear with backlash; shaded: no contact")


def _draw_pair(
    ax: Axes, trace: Trace, inertias: tuple[float, float], label: str, mean: str
) -> None:
    """Draw two velocities, and the mean weighted by inertia, which the contact cannot change."""
    from plots.style import INK, LINE_GREY, TEXT_GREY

    speeds = [trace.body(name).v for name in ("one", "two")]
    ax.plot(trace.t, speeds[0], color=INK, label="one")
    ax.plot(trace.t, speeds[1], "--", color=TEXT_GREY, label="two")
    ax.plot(
        trace.t,
        np.average(speeds, axis=0, weights=inertias),
        ":",
        color=LINE_GREY,
        linewidth=2,
        label=mean,
    )
    ax.legend(loc="upper right")
    ax.set(xlabel="t [s]", ylabel=label, xlim=(0, trace.t[-1]))
