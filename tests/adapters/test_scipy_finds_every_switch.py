"""`adapters.scipy.solve_ivp` finds the switches of `simulate`, with SciPy's methods and by samples.

Errors are those of the switch times against runs of `simulate` with a tight tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.integrate

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    System,
    Trace,
    simulate,
)
from gms_fsm.adapters.scipy import Solution, solve_ivp
from tests.helpers import FASTEST, matrix, pulled_mass

MODEL, _ = pulled_mass()
END = 20.0  # s


def _pulled(mass: float, stiffness: float, speed: float) -> Callable[..., list[float]]:
    def rates(t: float, y: Any, F: float) -> list[float]:
        x, v = y
        return [v, (stiffness * (speed * t - x) - F) / mass]

    return rates


def _late(solution: Solution, trace: Trace) -> float:
    """Return the largest error of a switch time, after comparing the sequences."""
    log = trace.transitions
    assert solution.success, solution.message
    assert [(s.element, s.edge) for s in solution.switches] == [
        (int(row.element), str(row.edge)) for row in log
    ]
    return float(np.max(np.abs(np.array([s.t for s in solution.switches]) - log.t)))


@pytest.fixture(scope="module")
def reference() -> Trace:
    trace = simulate(*pulled_mass(), END, engine=FASTEST, rtol=1e-9)
    assert len(trace.transitions) == 16
    return trace


# A method or a sample in s, and the largest error of a switch time.
WAYS: dict[Any, float] = {"RK45": 5e-5, "Radau": 1e-6, "LSODA": 5e-4, "dp45": 5e-6, 1e-2: 1e-2}
WAYS |= {scipy.integrate.DOP853: 5e-6, 2e-3: 4e-4}


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("way", matrix([*WAYS], ["RK45", "Radau", "LSODA", "dp45", 1e-2]))
def test_located_or_on_straight_lines_between_samples(reference: Trace, way: Any) -> None:
    how = {"sample": way} if isinstance(way, float) else {"method": way}
    found = solve_ivp(_pulled(1.0, 2.0, 0.1), (0.0, END), [0.0, 0.0], MODEL, 1, **how)
    assert _late(found, reference) < WAYS[way]
    if isinstance(way, float):
        assert len(found.t) == round(END / way) + 1
        return
    assert found.y[0, -1] == pytest.approx(reference.x[-1], abs=2e-5)
    assert found.F[-1] == pytest.approx(reference.F[-1], abs=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("length", "method", "error"), [(1e-6, "RK45", 5e-5), (1e3, "Radau", 1e-6)]
)
def test_other_scales(length: float, method: str, error: float) -> None:
    p = MODEL.parameters
    numbers = p.replaced(
        k=p.k / length,
        sigma=p.sigma / length,
        C=p.C * length,
        sigma_2=0.4 / length,
        stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=0.05 * length),
        v_c=1e-6 * length,
        weights=p.weights * length,
    )
    model, rig = GMS(numbers, law="signed"), (1.0 / length, 2.0 / length, 0.1 * length)
    trace = simulate(model, PulledSlider(*rig), END, engine=FASTEST, rtol=1e-9)
    assert len(trace.transitions) == 16
    found = solve_ivp(_pulled(*rig), (0.0, END), [0.0, 0.0], model, 1, method=method)
    assert _late(found, trace) < error


def test_other_parameters() -> None:
    model = GMS(GMSParameters.paper("stick-slip"), law="published")
    trace = simulate(model, PulledSlider(2.0, 3.0, 0.3), 20.0, rtol=1e-9)
    assert len(trace.transitions) == 4
    found = solve_ivp(_pulled(2.0, 3.0, 0.3), (0.0, 20.0), [0.0, 0.0], model, 1)
    assert _late(found, trace) < 1e-4


def _coupled(t: float, y: Any, F: Any) -> list[float]:
    x, v, x_b, v_b = y
    spring = 3.0 * (x - x_b)
    return [v, 2.0 * (0.1 * t - x) - spring - F[0], v_b, spring - F[1]]


@pytest.mark.matrix
@pytest.mark.slow
def test_several_frictions() -> None:
    system = System(
        "two masses",
        bodies=(
            Body("a", inertia=1.0, force="2*(0.1*t - x_a) - 3*(x_a - x_b)", x="x_a", v="v_a"),
            Body("b", inertia=1.0, force="3*(x_a - x_b)", x="x_b", v="v_b"),
        ),
        contacts=(Contact("front", MODEL, v="v_a"), Contact("back", MODEL, v="v_b")),
    )
    trace = simulate(system, 12.0, rtol=1e-9, engine=FASTEST)
    log = [(str(r.contact), int(r.element), str(r.edge)) for r in trace.transitions]
    ways: list[tuple[Any, dict[str, Any]]] = [
        ([1, 3], {}),
        (lambda y: y[[1, 3]], {"t_eval": [5.0, 12.0]}),
        (np.array([1, 3]), {"sample": 5e-3}),
    ]
    for velocity, how in ways:
        found = solve_ivp(_coupled, (0.0, 12.0), [0.0] * 4, system.contacts, velocity, **how)
        assert [(s.contact, s.element, s.edge) for s in found.switches] == log
        assert found.y[2, -1] == pytest.approx(trace.body("b").x[-1], abs=2e-5)
        assert found.F.shape == (2, len(found.t))
        assert found.t.tolist() == how.get("t_eval", found.t.tolist())


@pytest.mark.slow
@pytest.mark.parametrize("velocity", [1, lambda y: y[1]])
def test_motion_along_a_jump_of_the_force(velocity: Any) -> None:
    """Coulomb friction by sgn(v): where it holds the mass, the motion slides along v = 0."""
    chart = Chart(
        "Coulomb", parameters=("F_c",), states=(State("on"),), outputs={"F": "F_c*sgn(v)"}
    )
    model = ChartModel(chart, {"F_c": 1.0})
    trace = simulate(model, Slider(1.0, "1.5*sin(t)"), 7.0, rtol=1e-9, atol=1e-12)

    def rates(t: float, y: Any, F: float) -> list[float]:
        return [y[1], 1.5 * np.sin(t) - F]

    found = solve_ivp(rates, (0.0, 7.0), [0.0, 0.0], model, velocity, atol=1e-9, t_eval=[0.3, 7.0])
    assert found.success
    assert found.F[0] == pytest.approx(1.5 * np.sin(0.3), abs=1e-9)  # held: not yet moving
    assert found.y[:, -1] == pytest.approx([trace.x[-1], trace.v[-1]], abs=1e-6)
