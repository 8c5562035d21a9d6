"""Rate-and-state friction with the ageing law or the slip law, regularized at v = 0.

The friction coefficient depends on the velocity and on a state theta [s], the mean age of the
contacts::

    F = a N asinh(v / (2 V_0) * exp((mu_0 + b log(V_0 theta / D_c)) / a))
    ageing law (Dieterich)   dtheta/dt = 1 - |v| theta / D_c
    slip law (Ruina)         dtheta/dt = -|v| theta / D_c * log(|v| theta / D_c)

For |v| well above the scale at which asinh is linear this is the usual form
``F = N (mu_0 + a log(v / V_0) + b log(V_0 theta / D_c))``. The variable of the chart is
``psi = log(V_0 theta / D_c)``, so that theta stays positive; psi = 0 is the steady state at V_0.

What it shows: the direct effect and the decay over the distance D_c after a velocity step; a
steady friction that falls with the speed where b > a; stick-slip of a spring softer than
N (b - a) / D_c; healing at rest (ageing law only: with the slip law nothing happens at v = 0).

What it cannot show: true stiction. A contact under load always creeps, at least by
2 V_0 exp(-(mu_0 + b psi) / a) sinh(F / (a N)). There is no elastic pre-sliding and no memory of
reversals. N is constant; a varying normal load would also change theta.

Where v is small the force is a very stiff damper, of slope a N / |v| down to the scale of that
creep. A mass that nearly rests therefore needs an implicit method, and as no guard gives a scale,
absolute tolerances: ``method=scipy.integrate.Radau, atol={"x": 1e-12, "v": 1e-12, "psi": 1e-8}``
with the engine ``machines`` or ``ifelse``. If the run starts at rest, the tolerance of v has to be
far below 2 V_0 exp(-mu_0 / a): ``"v": 1e-40`` if that is 2e-32 m/s. LSODA and BDF are less robust.

References
----------
J. H. Dieterich, "Modeling of rock friction: 1. Experimental results and constitutive equations",
Journal of Geophysical Research 84(B5), 2161-2168 (1979), doi:10.1029/JB084iB05p02161.

A. Ruina, "Slip instability and state variable friction laws", Journal of Geophysical Research
88(B12), 10359-10370 (1983), doi:10.1029/JB088iB12p10359.

J. R. Rice, N. Lapusta, K. Ranjith, "Rate and state dependent friction and the stability of sliding
between elastically deformable solids", Journal of the Mechanics and Physics of Solids 49(9),
1865-1898 (2001), doi:10.1016/S0022-5096(01)00042-4.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

# dpsi/dt = dtheta/dt / theta. The logarithm of a square does not depend on the sign that abs(v)
# keeps until the crossing of v = 0 is located; 1e-300 keeps it finite at v = 0.
THETA = {"theta": "D_c / V_0 * exp(psi)"}
LETS = {"ageing": THETA, "slip": THETA}
FLOWS = {
    "ageing": "1 / theta - abs(v) / D_c",
    "slip": "-abs(v) / D_c * 0.5 * log((v * theta / D_c)**2 + 1e-300)",
}
REFERENCES = {"ageing": "Dieterich (1979), regularized", "slip": "Ruina (1983), regularized"}


def _rate_state(law: str) -> Chart:
    return Chart(
        name=f"Rate-and-state friction, {law} law",
        inputs=("v",),
        variables=("psi",),
        parameters=(
            Parameter("N", "N", "> 0", meaning="normal load"),
            Parameter("mu_0", "1", "> 0", meaning="friction coefficient at V_0"),
            Parameter("a", "1", "> 0", meaning="direct effect"),
            Parameter("b", "1", ">= 0", meaning="effect of the state"),
            Parameter("D_c", "m", "> 0", meaning="characteristic slip distance"),
            Parameter("V_0", "m/s", "> 0", meaning="reference velocity"),
        ),
        states=(State("contact", flow={"psi": FLOWS[law]}),),
        transitions=(),
        outputs={"F": "a * N * asinh(v / (2 * V_0) * exp((mu_0 + b * psi) / a))"},
        reference=REFERENCES[law],
        let=LETS[law],
    )


RATE_STATE = {law: _rate_state(law) for law in FLOWS}
CHARTS = tuple(
    Entry(
        f"rate-state-{law}",
        RATE_STATE[law],
        Demonstration(
            {"N": 2.0, "mu_0": 0.5, "a": 0.05, "b": 0.08, "D_c": 1e-5, "V_0": 1e-3},
            "chosen by us: F_c = mu_0 N = 1 N at V_0; D_c = F_c / sigma_0 of the other models",
        ),
    )
    for law in FLOWS
)
