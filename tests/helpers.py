"""Cases shared by the tests: models and rigs with known results, and small helper functions."""

from __future__ import annotations

import functools
import importlib.util
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    Trace,
    Transition,
)
from gms_fsm.systems.signals import as_signal

ROOT = Path(__file__).resolve().parents[1]  # of the repository
# For long runs in tests that claim nothing of engines, which all give the same bits.
FASTEST = "compiled" if importlib.util.find_spec("llvmlite") else "ifelse"
SINE = "0.2*sin(2*pi*t/20)"
FIG4_SINE = "0.15*sin(2*pi*t/25)"
FIG3_FORCE = "min(0.25*t, max(0.25, 0.75 - 0.125*t)) + 0.1*sin(2*pi*2*(max(t, 4) - 4))"


def needs(*packages: str, reason: str) -> None:
    """Skip the tests of a file without these packages, which are imported only if the tests run."""
    for name in packages:
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"{name} is not installed: {reason}", allow_module_level=True)


def matrix(every: Sequence[Any], kept: Collection[Any]) -> list[Any]:
    """Return values for `pytest.mark.parametrize`; those not kept are left to make foreign."""
    marks = pytest.mark.matrix
    return [
        value
        if value in kept
        else pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=marks)
        for value in every
    ]


def stick_slip(law: str) -> GMS:
    """Table I, stick-slip column."""
    return GMS(GMSParameters.paper("stick-slip"), law=law)  # type: ignore[arg-type]


def open_loop() -> Prescribed:
    """A sine whose period is not a multiple of any step."""
    return Prescribed(SINE)


def pulled_mass(k: np.ndarray | None = None) -> tuple[GMS, PulledSlider]:
    """The stick-slip rig: a mass pulled through a spring, 72 transitions in 60 s."""
    k = np.array([40.0, 30.0, 20.0, 10.0]) if k is None else k
    parameters = GMSParameters(
        k,
        [0.4, 0.3, 0.2, 0.1],
        [0.02] * 4,
        sigma_2=0.4,
        stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=0.05),
        v_c=1e-6,
        weights=1 / (4 * k),
    )
    return GMS(parameters, law="signed"), PulledSlider(1.0, 2.0, 0.1)


def non_drifting(law: str, *, slipping: bool = False) -> tuple[GMS, Slider]:
    """Fig. 3; with `slipping` the weights are 0.25/k, so that element 1 breaks away."""
    parameters = GMSParameters.paper("non-drifting")
    if slipping:
        parameters = parameters.with_weights(0.25 / parameters.k)
    return GMS(parameters, law=law), Slider(1.0, FIG3_FORCE)  # type: ignore[arg-type]


def one_element(
    law: str,
    *,
    F_c: float = 1.0,
    F_s: float = 1.5,
    v_s: float = 0.05,
    C: float = 0.1,
    v_c: float = 1e-6,
    sigma: float = 0.1,
    k: float = 1.0,
) -> GMS:
    """Return a model of one element with all its numbers as arguments."""
    parameters = GMSParameters(
        [k], [sigma], [C], sigma_2=0.0, stribeck=Stribeck(F_c, F_s, v_s), v_c=v_c
    )
    return GMS(parameters, law=law)  # type: ignore[arg-type]


def bank(n: int) -> GMS:
    """Return a GMS model of n different elements."""
    parameters = GMSParameters(
        k=np.linspace(1.5, 0.5, n),
        sigma=np.full(n, 0.3),
        C=np.full(n, 0.02),
        sigma_2=0.1,
        stribeck=Stribeck(0.4, 1.5, 1e-3),
        v_c=1e-6,
        weights=np.linspace(0.15, 0.85, n),
    )
    return GMS(parameters, law="signed")


@functools.lru_cache(maxsize=2)  # one run is compared with several others
def bits(trace: Trace | None) -> dict[str, tuple[Any, ...]]:
    """Return everything in a trace, as bytes with shapes and kinds."""
    if trace is None:
        return {}
    arrays = {f"columns {name}": each for name, each in trace.columns().items()}
    for kind in ("rows", "stops"):
        table = getattr(trace, kind)
        arrays |= {f"{kind} {name}": getattr(table, name) for name in ("t", "y", "mode")}
        arrays[f"{kind} microstep"] = table.microstep
    arrays |= {f"log {name}": trace.transitions[name] for name in trace.transitions.dtype.names}
    arrays |= {f"sliding {name}": trace.sliding[name] for name in trace.sliding.dtype.names}
    found = {}
    for name, each in arrays.items():
        array = np.ascontiguousarray(each)
        text = array.dtype.kind in "UO"
        if array.dtype.kind == "f":
            array = np.where(np.isnan(array), np.nan, array)  # a NaN is a NaN, whatever its payload
        content = tuple(array.ravel().tolist()) if text else array.tobytes()
        found[name] = ("text" if text else array.dtype.str, array.shape, content)
    return found


def other_parts(one: Trace | None, other: Trace | None) -> list[str]:
    """Return the names of what is not equal to the last bit, in everything that a trace has."""
    mine, its = bits(one), bits(other)
    return [name for name in mine | its if mine.get(name) != its.get(name)]


def same_bits(a: Trace, b: Trace) -> None:
    """Assert that rows, what they show and the log of two traces are equal; stops may differ."""
    for name in ("t", "microstep", "y", "mode"):
        np.testing.assert_array_equal(getattr(a.rows, name), getattr(b.rows, name), err_msg=name)
    mine, its = a.columns(), b.columns()
    assert [*mine] == [*its]
    for name, column in mine.items():
        np.testing.assert_array_equal(column, its[name], err_msg=name)
    same_logs(a, b)


def same_logs(a: Trace, b: Trace) -> None:
    """Assert that the logs of two traces are equal."""
    for name in a.transitions.dtype.names:
        np.testing.assert_array_equal(a.transitions[name], b.transitions[name], err_msg=name)


def event_sequence(trace: Trace) -> list[tuple[int, str]]:
    """Return which element took which edge, in order."""
    log = trace.transitions
    return list(zip(log.element.tolist(), log.edge.tolist(), strict=True))


CURVE = Stribeck(F_c=1.0, F_s=1.5, v_s=0.02)

# Stick, creep in pre-sliding, slip with wear w; a reset of z at each arrest.
WEAR = Chart(
    "wear",
    inputs=("v", "s", "t", "x"),
    variables=("z", "w"),
    parameters=("k", "C", "v_c", "share"),
    states=(
        State("stick", flow={"z": "v", "w": "0"}, entry={"z": "0.5 * z"}),
        State("creep", flow={"z": "v * (1 - 0.5 * abs(z) / s)", "w": "0"}),
        State("slip", flow={"z": "C * (sgn(v) - z / s)", "w": "abs(v)"}, exit={"w": "w + 1"}),
    ),
    transitions=(
        Transition("yield_", "stick", "creep", guard="abs(z) >= share * s"),
        Transition("tear", "creep", "slip", guard="abs(z) >= s and (v > v_c or v < -v_c)"),
        Transition("heal", "creep", "stick", guard="not abs(z) >= 0.5 * share * s"),
        Transition("arrest", "slip", "stick", guard="abs(v) <= v_c", actions={"z": "0.8 * z"}),
    ),
    outputs={"F": "k * z + 0.1 * dz"},
)


def banging(gap: float) -> ChartModel:
    """Return an element driven back and forth between two guards that are `gap` apart."""
    chart = Chart(
        "to and fro",
        inputs=("v",),
        variables=("z",),
        parameters=("gap",),
        states=(State("up", flow={"z": "1"}), State("down", flow={"z": "-1"})),
        transitions=(
            Transition("fall", "up", "down", guard="z >= 1"),
            Transition("rise", "down", "up", guard="z <= 1 - gap"),
        ),
        outputs={"F": "z"},
    )
    return ChartModel(chart, {"gap": gap})


class FunctionBelt:
    """A mass on a belt whose speed is a Python function; friction of 1 N between them."""

    title = "mass on a belt"
    acceleration = "(-F - sgn(v - w)) / mass"

    def __init__(self) -> None:
        self.signals = {"w": as_signal(_belt)}
        self.numbers = {"mass": 1.0}


def _belt(t: float) -> float:
    return 0.1 + 0.0 * t


def wear(n: int = 3) -> ChartModel:
    """Return a bank of the chart above: three states, two variables, actions of every kind."""
    values = {"k": np.linspace(1, 2, n), "C": 0.3, "v_c": 1e-6, "share": np.linspace(0.5, 0.7, n)}
    return ChartModel(WEAR, values, n=n, stribeck=CURVE, weights=np.linspace(0.5, 1, n))
