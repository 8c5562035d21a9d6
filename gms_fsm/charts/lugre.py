"""LuGre, the paper's benchmark: one state, no edges, on the same machinery.

References
----------
C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, "A New Model for Control of Systems with
Friction", IEEE Trans. Automatic Control 40 (1995).
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State

__all__ = ["LUGRE"]

LUGRE = Chart(
    name="LuGre bristle",
    inputs=("v", "s"),
    variables=("z",),
    parameters=("sigma_0", "sigma_1"),
    states=(State("bristle", flow={"z": "v - sigma_0 * abs(v) * z / s"}),),
    transitions=(),
    outputs={"F": "sigma_0 * z + sigma_1 * dz"},
    reference="Canudas de Wit et al. (1995)",
)
