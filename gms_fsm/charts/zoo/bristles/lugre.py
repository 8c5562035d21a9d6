"""LuGre: one elastic bristle that bends and yields, without any switching.

It is the paper's benchmark, and runs by the same code as every chart. Its chart has one state and
no edges.

It shows pre-sliding, the Stribeck effect, frictional lag, stick-slip, and a break-away force that
falls with the force rate. It cannot show an exact rest: under a load below break-away that varies,
it drifts. It has no nonlocal memory: an inner loop does not return to the point where it began.

References
----------
C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, "A New Model for Control of Systems with
Friction", IEEE Trans. Automatic Control 40(3), 419-425 (1995), doi:10.1109/9.376053.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.gms import TABLE_I
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

LUGRE = Chart(
    name="LuGre bristle",
    inputs=("v", "s"),
    variables=("z",),
    parameters=(
        Parameter("sigma_0", "N/m", "> 0", meaning="bristle stiffness"),
        Parameter("sigma_1", "Ns/m", ">= 0", meaning="bristle damping"),
    ),
    states=(State("bristle", flow={"z": "v - sigma_0 * abs(v) * z / s"}),),
    transitions=(),
    outputs={"F": "sigma_0 * z + sigma_1 * dz"},
    reference="Canudas de Wit et al. (1995)",
)

# The paper compares LuGre with a column of its Table I, but prints no values for the bristle.
BENCHMARK = Demonstration(
    {"sigma_0": 1e3, "sigma_1": 31.6},
    "sigma_0 and sigma_1 chosen by us; the rest from the paper's Table I, column stick-slip",
    stribeck=TABLE_I["stick-slip"].stribeck,
    sigma_2=TABLE_I["stick-slip"].sigma_2,
)
CHARTS = (Entry("lugre", LUGRE, BENCHMARK, title="LuGre model"),)
