"""Bouc-Wen hysteresis: a smooth spring that yields, in one differential equation.

A hysteretic deflection z [m] follows the motion and saturates::

    dz/dt = A v - (beta |v| z + gamma v |z|) |z / D|^(p - 1) / D
    F     = alpha k x + (1 - alpha) k z

This is the normalized form, in which D has the unit of length and A, beta and gamma have none. z
saturates at D (A / (beta + gamma))^(1 / p). The exponent p sets how sharply it yields; the plastic
limit is p to infinity. With alpha = 0 the force is bounded, as that of friction.

What it shows: smooth hysteresis loops of many shapes, softening or hardening, rate-independent.

What it cannot show: anything that depends on the rate: no Stribeck curve, no lag, no difference
between F_s and F_c. It has no stiction: under a load below the limit with ripple it drifts as
LuGre and Dahl do, and small loops do not close (it violates Drucker's postulate). It is passive
for -beta <= gamma <= beta; the rule checks only the upper bound.

References
----------
Y.-K. Wen, "Method for Random Vibration of Hysteretic Systems", Journal of the Engineering
Mechanics Division 102(2), 249-263 (1976), doi:10.1061/JMCEA3.0002106.

M. Ismail, F. Ikhouane, J. Rodellar, "The Hysteresis Bouc-Wen Model, a Survey", Archives of
Computational Methods in Engineering 16, 161-188 (2009), doi:10.1007/s11831-009-9031-8.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

BOUC_WEN = Chart(
    name="Bouc-Wen hysteresis",
    inputs=("x", "v"),
    variables=("z",),
    parameters=(
        Parameter("k", "N/m", "> 0", meaning="initial stiffness"),
        Parameter("alpha", "1", ">= 0 and <= 1", meaning="share of the elastic force"),
        Parameter("D", "m", "> 0", meaning="yield deflection"),
        Parameter("A", "1", "> 0", meaning="initial slope of z"),
        Parameter("beta", "1", "> 0", meaning="shape: both branches"),
        Parameter("gamma", "1", "<= beta", meaning="shape: loading against unloading"),
        Parameter("p", "1", ">= 1", meaning="exponent: sharpness of yield"),
    ),
    states=(
        State(
            "contact",
            flow={
                "z": "A * v - (beta * abs(v) * z + gamma * v * abs(z)) * abs(z / D)**(p - 1) / D"
            },
        ),
    ),
    transitions=(),
    outputs={"F": "alpha * k * x + (1 - alpha) * k * z"},
    reference="Wen (1976); Ismail et al. (2009)",
)
CHARTS = (
    Entry(
        "bouc-wen",
        BOUC_WEN,
        Demonstration(
            {"k": 1e5, "alpha": 0.0, "D": 1e-5, "A": 1.0, "beta": 0.5, "gamma": 0.5, "p": 2.0},
            "chosen by us: k = sigma_0 and k D = F_c of the other models",
        ),
    ),
)
