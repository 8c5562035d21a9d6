"""Small integer powers are printed as products, and sums run in element order, bit for bit.

``x**3`` of the C library and ``x*x*x`` differ in the last bit for many x, so a power left in the
text would make two engines disagree.
"""

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, simulate
from gms_fsm.lowering.program import lower
from tests.helpers import open_loop, pulled_mass, stick_slip

CUBE = Chart(
    name="cube",
    inputs=("v",),
    variables=("z",),
    parameters=("k",),
    states=(State("only", flow={"z": "v"}),),
    transitions=(),
    outputs={"F": "k * z**3 + z**2"},
)


def code(source):
    return "\n".join(line.partition("#")[0] for line in source.splitlines())


@pytest.mark.parametrize("law", ["signed", "published"])
def test_no_power_is_left_in_the_text(law):
    """The Stribeck curve of eq. (2) contains a square; its generated text a product."""
    source = code(lower(stick_slip(law), open_loop()).source)
    assert "v / v_s * (v / v_s)" in source
    assert "**" not in source
    assert "pow" not in source


@pytest.mark.slow
def test_powers_are_products_to_the_last_bit():
    """F = z**3 + z**2 equals the products for every row; the C library's power does not."""
    model = ChartModel(CUBE, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 1e-3))
    assert "**" not in code(lower(model, Prescribed("1")).source)
    trace = simulate(model, Prescribed("0.7*sin(t)+0.3"), 30.0, t_eval=np.linspace(0, 30, 3001))
    z = trace.z[:, 0].tolist()
    assert trace.F.tolist() == [1.0 * (u * u * u) + u * u for u in z]
    naive = [u**3 for u in z]
    assert sum(a != b * b * b for a, b in zip(naive, z, strict=True)) > 10


def test_sums_run_in_element_order():
    """F is ((F_1 + F_2) + F_3) + ... + sigma_2 v; another order gives other bits."""
    model, rig = pulled_mass()
    trace = simulate(model, rig, 30.0)
    F = np.zeros(len(trace))
    for i in range(trace.n):
        F = F + trace.F_elements[:, i]
    np.testing.assert_array_equal(trace.F, F + 0.4 * trace.v)
    backward = np.zeros(len(trace))
    for i in reversed(range(trace.n)):
        backward = backward + trace.F_elements[:, i]
    assert (backward + 0.4 * trace.v != trace.F).any()
