"""Dahl's model: a bristle that yields, with the force as a function of the displacement alone.

The force approaches F_c exponentially with the displacement since the last reversal, with the
stiffness sigma_0 at F = 0. This is Dahl's equation with his exponent i = 1.

It shows pre-sliding hysteresis that does not depend on the rate. It cannot show stiction above F_c,
the Stribeck effect or frictional lag; it has no nonlocal memory, so inner loops do not close; and
it drifts, because every load, however small, leaves some plastic displacement.

References
----------
P. R. Dahl, "A Solid Friction Model", Report TOR-0158(3107-18)-1, The Aerospace Corporation, El
Segundo (1968).
K. J. Åström, C. Canudas de Wit, "Revisiting the LuGre Friction Model", IEEE Control Systems
Magazine 28(6), 101-114 (2008), doi:10.1109/MCS.2008.929425, for the form with z.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

DAHL = Chart(
    name="Dahl's model",
    variables=("z",),
    parameters=(
        Parameter("sigma_0", "N/m", "> 0", meaning="stiffness at F = 0"),
        Parameter("F_c", "N", "> 0", meaning="Coulomb friction"),
    ),
    states=(State("bristle", flow={"z": "v - sigma_0 * abs(v) * z / F_c"}),),
    outputs={"F": "sigma_0 * z"},
    reference="Dahl (1968)",
)
CHARTS = (Entry("dahl", DAHL, Demonstration({"sigma_0": 1e5, "F_c": 1.0}, "chosen by us")),)
