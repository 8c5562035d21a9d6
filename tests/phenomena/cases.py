"""Models for the tests of the bench."""

from __future__ import annotations

import functools

from gms_fsm import (
    Chart,
    ChartModel,
    LuGre,
    PhenomenaTable,
    State,
    Stribeck,
    Transition,
    measure_phenomena,
)
from gms_fsm.charts import CHARTS
from gms_fsm.phenomena.measure import Bench

BENCH = Bench()
CURVE = Stribeck(F_c=BENCH.F_c, F_s=BENCH.F_s, v_s=BENCH.v_s)
DRY = ChartModel(CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
LUGRE = LuGre(sigma_0=BENCH.sigma_0, sigma_1=BENCH.sigma_1, sigma_2=BENCH.sigma_2, stribeck=CURVE)

# Elastic up to z = limit, then plastic: no Stribeck curve, no rate, no damping.
ELEMENT = Chart(
    "Maxwell element",
    variables=("z",),
    parameters=("k", "limit"),
    states=(
        State("stick", flow={"z": "v"}),
        State("forward", flow={"z": "0"}),
        State("backward", flow={"z": "0"}),
    ),
    transitions=(
        Transition("yield_forward", "stick", "forward", guard="z >= limit and v > 0"),
        Transition("yield_backward", "stick", "backward", guard="z <= -limit and v < 0"),
        Transition("turn_backward", "forward", "stick", guard="v < 0"),
        Transition("turn_forward", "backward", "stick", guard="v > 0"),
    ),
    outputs={"F": "k * z"},
)
STIFFNESSES = (53e3, 27e3, 13e3, 7e3)  # N/m; 0.375 N each
MAXWELL = ChartModel(
    ELEMENT, {"k": STIFFNESSES, "limit": tuple(0.375 / k for k in STIFFNESSES)}, n=4
)


MODELS = ("lugre", "gms-signed", "gms-published", "stiction", "backlash")


@functools.cache
def known() -> PhenomenaTable:
    """Return what the bench measures of these models."""
    return measure_phenomena(MODELS)
