"""Two calls that turn at the same point are each computed, whatever their names."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, simulate
from tests.helpers import matrix

FLOWS = {
    "max": (
        "max(v, 2) + 10 * max(v - 2, 0)",
        lambda v: np.maximum(v, 2) + 10 * np.maximum(v - 2, 0),
    ),
    "min": ("min(v, 2) - 3 * min(v - 2, 0)", lambda v: np.minimum(v, 2) - 3 * np.minimum(v - 2, 0)),
    "thrice": (
        "max(v, 2) + max(2, v) + max(v - 2, 0) + min(v, 2)",
        lambda v: 2 * np.maximum(v, 2) + np.maximum(v - 2, 0) + np.minimum(v, 2),
    ),
    "one inside": (
        "max(2 * max(v, 2), 4) + max(v - 2, 0)",
        lambda v: 2 * np.maximum(v, 2) + np.maximum(v - 2, 0),
    ),
}


CASES = [(name, engine) for name in FLOWS for engine in ("machines", "ifelse", "compiled")]
KEPT = [each for each in CASES if each[1] != "compiled" or each[0] == "thrice"]


@pytest.mark.parametrize(("name", "engine"), matrix(CASES, KEPT))
def test_the_flow_is_what_its_text_says(name: str, engine: str) -> None:
    if engine == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    text, exact = FLOWS[name]
    chart = Chart(
        name="integral",
        inputs=("v",),
        variables=("z",),
        parameters=(),
        states=(State("only", flow={"z": text}),),
        transitions=(),
        outputs={"F": "z"},
    )
    trace = simulate(ChartModel(chart, {}, n=1), Prescribed("t"), 4.0, engine=engine)
    t = np.linspace(0.0, 4.0, 400_001)
    wanted = np.trapezoid(exact(t), t) if hasattr(np, "trapezoid") else np.trapz(exact(t), t)
    assert trace.z[-1, 0] == pytest.approx(wanted, rel=1e-7)
