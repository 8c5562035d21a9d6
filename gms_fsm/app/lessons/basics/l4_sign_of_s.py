"""Lesson 4: The sign of s(v).

What depends on the sign of s(v) for v < 0?

Eq. (1) of the paper, ``dz = sgn(v) C (1 - z/s)``, and the signed law of Al-Bender, Lampaert and
Swevers, ``dz = C (sgn(v) - z/s)``, are identical for v > 0. For v < 0 the signed law pulls z to -s;
the published law pushes it away from +s, where its eigenvalue is +C/s. An element that slips
backward then stretches its spring further than the slider moves: the spring gains energy that was
not supplied.

An energy balance shows this independently of the choice of law. A part of the work of the motion is
stored in the springs; the rest is heat, and heat can only increase.

## Predict

Two laws differ only for v < 0. A bank is moved to and fro, v = 0.15 sin(2 pi t/25) m/s, for four
periods. In sliding s = 0.4 m: an element breaks away at z = 0.4 m or -0.4 m. Then it slips, by

- the signed law, dz = C (sgn(v) - z/s), or
- the published law, dz = sgn(v) C (1 - z/s).

1. With the signed law: what is the largest |z| of all elements, in m?
2. With the published law the first element, C = 0.1 m/s, breaks away backward at 20.1 s, at
   z = -0.4 m, and slips until the motion reverses at 25 s. What is z then, in m?
3. An element that slips backward by the published law stretches its spring further than the slider
   moves. After four periods: is the energy in the springs "less" than the work that was put in, the
   "same", or "more"?

## Measure

Run: GMS, Table I (stick-slip), v = {VELOCITY} m/s (chosen by us), {FIG4_END:g} s, under the
published law (eq. (1) as printed) and under the signed law.

Measured: with the published law the z_i fall to {lowest:.2f} m (z_1 to {cycles:.2f} m in the four
cycles); signed, |z_i| is {largest:.4f} m at most, in both directions (s is
{PARAMETERS.stribeck.F_c:g} m in sliding, weights 1 m/N).

Measured: of {works[0]:.2f} J of work the springs of the published law store {stores[0]:.2f} J at
the end; meanwhile {vanished[0]:.1f} J of heat turn back into spring energy. Signed law:
{stores[1]:.2f} J of {works[1]:.2f} J, and {vanished[1]!m:.1f} mJ of heat vanish,
{outside_dip[1]!m:.1g} mJ of them outside the Stribeck dip.

So: with s(v) unsigned for v < 0 the model creates energy. Use law="signed"; it also creates a
little, where s(v) rises at a reversal and z follows while the slider hardly moves.

## Why

For v < 0 the published law is dz = -C (1 - z/s): at z = s it rests, but a smaller z moves away from
s, downwards and ever faster, s - z = 0.8 m exp(C t/s). In 4.9 s it grows to 2.7 m, and nothing
stops it before the motion reverses. The springs then hold more energy than was put in.

## The text of the two laws

The laws are texts in a chart; nothing else differs between the two runs above.

```python
from gms_fsm.charts import SLIP_LAWS

for name, text in SLIP_LAWS.items():
    print(f"{name:<9}  dz = {text}")
```

## Try

- `gms_fsm.prove(result.published.model.chart)` finds the error without a run. What does it say,
  and at which point?
- What is each element's share of the missing heat?
- Halve the period of the motion. Does z_1 decrease further, or less far?
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm import GMS, GMSParameters, Prescribed, Trace, simulate
from gms_fsm.app.lessons.engine.lesson import FIRST, GUIDE, SECOND, Lesson, draw, grid, note
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.app.paper import FIG4_END, VELOCITY
from gms_fsm.charts.parameters import FloatArray
from plots.style import LINE_GREY, PALE_GREY

PARAMETERS = GMSParameters.paper("stick-slip")
POINTS = 20_000  # for the integrals over time
LAWS = {
    "published": "published law, eq. (1) as printed",
    "signed": "signed law (Al-Bender et al. 2005)",
}


@dataclass(frozen=True, eq=False)
class Energy:
    """The energy balance of a run: time [s], velocity [m/s], ∫ F v dt [J], and Σ k z²/2 [J]."""

    t: FloatArray
    v: FloatArray
    work: FloatArray
    stored: FloatArray

    @property
    def heat(self) -> FloatArray:
        """Work minus stored energy, J."""
        return self.work - self.stored

    @property
    def lost_heat(self) -> FloatArray:
        """Decrease of heat from each time to the next, J, >= 0."""
        return np.maximum(-np.diff(self.heat), 0.0)

    @property
    def outside_dip(self) -> NDArray[np.bool_]:
        """Whether s(v) is flat between each time and the next."""
        outside = np.abs(self.v) > PARAMETERS.stribeck.dip
        return outside[1:] & outside[:-1]


def run() -> dict[str, Any]:
    """Run Fig. 4 under both laws and compute the energy balances."""
    published, signed = (
        simulate(GMS(PARAMETERS, law=law), Prescribed(VELOCITY), FIG4_END)
        for law in ("published", "signed")
    )
    replayed = {"published law": published, "signed law": signed}
    t, z = published.t, published.z
    lowest, largest = z.min(axis=0), abs(signed.z).max()
    cycles = [z[(t >= a) & (t <= a + 25), 0].min() for a in (0, 25, 50, 75)]
    published_energy, signed_energy = balances = energy(published), energy(signed)
    works, stores = np.array([(each.work[-1], each.stored[-1]) for each in balances]).T
    signed_z, z_at_reversal = largest, published.sample([25.0]).z[0, 0]
    stored_energy = "more" if stores[0] > works[0] else "less"
    vanished = [each.lost_heat.sum() for each in balances]
    outside_dip = [each.lost_heat[each.outside_dip].sum() for each in balances]
    return locals()


def energy(trace: Trace) -> Energy:
    """Compute the energy balance of a run of a GMS model."""
    fine = trace.refined(POINTS)  # both sides of every jump of F are rows
    power = fine.F * fine.v
    steps = 0.5 * (power[1:] + power[:-1]) * np.diff(fine.t)
    work = np.concatenate([[0.0], np.cumsum(steps)])
    return Energy(fine.t, fine.v, work, (0.5 * PARAMETERS.k * fine.z**2).sum(axis=1))


def _deflections(ax: Any, r: Any, law: str) -> str:
    draw("deflections", ax, r.values[law])
    for s in (PARAMETERS.stribeck.F_c, -PARAMETERS.stribeck.F_c):
        ax.axhline(s, **GUIDE)
    if law == "published":
        ax.legend(loc="lower left", ncols=4, handlelength=1.8, columnspacing=1.0, borderaxespad=0)
    else:
        text = "all four $z_i$ together\ngrey: ± s(v) away from reversals"
        note(ax, text, (0.97, 0.04), inside=True, fontsize=9)
        _beside(ax, 0)
    return LAWS[law]


def _balance(ax: Any, r: Any, law: str) -> str:
    balance = r.values[f"{law}_energy"]
    ax.plot(balance.t, balance.work, **FIRST, label="work of the motion")
    ax.plot(balance.t, balance.stored, **SECOND, label="stored in the springs")
    heat = "heat: work minus stored"
    ax.plot(balance.t, balance.heat, color=LINE_GREY, linewidth=1.5, label=heat)
    # Where more than 0.05 W turns back.
    falls = np.append(balance.lost_heat > 0.05 * np.diff(balance.t), False)
    height = {"where": falls, "transform": ax.get_xaxis_transform(), "zorder": 0}
    look = {"facecolor": PALE_GREY, "edgecolor": LINE_GREY, "hatch": "////", "alpha": 0.6}
    ax.fill_between(balance.t, 0, 1, **height, **look, linewidth=0.0)
    ax.set(xlabel="$t$ [s]", ylabel="energy [J]", xlim=(0, FIG4_END))
    if law == "published":
        return "energy (hatched: heat turns back)"
    ax.legend(loc="upper left")
    _beside(ax, 2)
    ax.autoscale(axis="y")  # to both
    return f"energy ({1e3 * r.vanished[1]:.1f} mJ turn back: invisible)"


def _states(ax: Any, r: Any, law: str) -> str:
    draw("ribbons", ax, r.values[law])
    if law == "signed":
        _beside(ax, 4)
    return f"states, {law} law"


def _beside(ax: Any, left: int) -> None:
    """Share the vertical axis of the panel on the left."""
    ax.sharey(ax.figure.axes[left])
    ax.set_ylabel("")
    ax.tick_params(labelleft=False)


LESSON = Lesson(
    __name__,
    run,
    tuple(partial(panel, law=law) for panel in (_deflections, _balance, _states) for law in LAWS),
    grid("ab;cd;ef", (8.2, 7.8), (1.3, 1.5, 0.9)),
    level="graduate",
    questions=(
        Question("signed_z", "m", rtol=0.05),
        Question("z_at_reversal", "m", rtol=0.1),
        Question("stored_energy", choices=("less", "same", "more")),
    ),
    live=lambda: (
        (GMS(PARAMETERS, law="published"), Prescribed(VELOCITY), FIG4_END),
        {"C1": (0.02, 0.2), "F_c": (0.2, 1.0)},
        {},
    ),
)
