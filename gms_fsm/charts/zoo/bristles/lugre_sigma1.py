"""LuGre with a damping sigma_1(v) that falls with speed.

The bristle is that of LuGre; its damping is ``sigma_1 exp(-(v / v_d)**2)``. At rest it damps the
bristle; in sliding it vanishes, so that the force follows sigma_0 z without the spikes that
sigma_1 dz/dt makes where the speed changes fast. With v_d much larger than all speeds it is LuGre.

It shows what LuGre shows: stiction that depends on the force rate, the Stribeck effect, frictional
lag, stick-slip. It cannot show what LuGre cannot: it drifts under a load below break-away, and it
has no nonlocal memory.

References
----------
H. Olsson, K. J. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky, "Friction Models and Friction
Compensation", European Journal of Control 4(3), 176-195 (1998), doi:10.1016/S0947-3580(98)70113-X.
K. J. Åström, C. Canudas de Wit, "Revisiting the LuGre Friction Model", IEEE Control Systems
Magazine 28(6), 101-114 (2008), doi:10.1109/MCS.2008.929425.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.charts.zoo.bristles.lugre import LUGRE

LUGRE_SIGMA1 = Chart(
    name="LuGre, damping falls with speed",
    inputs=LUGRE.inputs,
    variables=LUGRE.variables,
    parameters=(
        *LUGRE.parameters,
        Parameter("v_d", "m/s", "> 0", meaning="speed at which the damping has fallen to 1/e"),
    ),
    states=LUGRE.states,
    outputs={"F": "sigma_0 * z + sigma_1 * exp(-(v / v_d)**2) * dz"},
    reference="Olsson et al. (1998)",
)
CHARTS = (
    Entry(
        "lugre-sigma1",
        LUGRE_SIGMA1,
        Demonstration(
            {"sigma_0": 1e5, "sigma_1": 316.23, "v_d": 1e-3},
            "chosen by us",
            stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3),
            sigma_2=0.4,
        ),
    ),
)
