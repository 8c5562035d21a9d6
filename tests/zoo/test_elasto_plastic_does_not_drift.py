"""Under a bias and a ripple below break-away LuGre drifts, and the elasto-plastic model does not.

The bench: sigma_0 = 1e5 N/m, F_c = 1 N, F_s = 1.5 N; elastic up to 0.9 N. The load is 0.6 N with a
ripple of 0.2 N. In 20 s LuGre creeps by 78 um, the elasto-plastic model
by less than 1e-9 m.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import ChartModel, Slider, Stribeck, simulate
from gms_fsm.charts import CHARTS

CURVE = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
BRISTLE = {"sigma_0": 1e5, "sigma_1": 316.23}
LOAD = "min(0.3 * t, 0.6) + 0.2 * sin(2 * pi * t)"
ELASTIC = (0.6 + 0.2) / 1e5  # m: the deflection at the largest load


def creep(name: str, **own: float) -> float:
    """Return how far the mass has moved between two times with the same load, m."""
    model = ChartModel(CHARTS[name], {**BRISTLE, **own}, stribeck=CURVE, sigma_2=0.4)
    trace = simulate(model, Slider(1.0, LOAD), 30.0, t_eval=[10.0, 30.0], engine="ifelse")
    return float(np.diff(trace.x)[0])


@pytest.mark.slow
def test_it_does_not_drift_where_lugre_does() -> None:
    drift, elastic = creep("lugre"), creep("elasto-plastic", z_ba=9e-6)
    assert drift > 7e-5 > ELASTIC
    assert abs(elastic) < 1e-9


@pytest.mark.slow
def test_it_drifts_beyond_its_elastic_range() -> None:
    assert creep("elasto-plastic", z_ba=4e-6) > 1e-6
