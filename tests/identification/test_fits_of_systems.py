"""A system is fitted like a model: driven by the record, or moving by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gms_fsm import Body, Contact, ParameterError, Record, System, fit, simulate
from tests.identification.records import bank, measured, noise, sine

pytest.importorskip("llvmlite", reason="fits take long without machine code")

LOAD = Body("load", inertia="m", force="K * (0.1 * t - x)")


def _pulled(m: float, F_c: float) -> System:
    pad = bank([200.0, 100.0], [3e-3, 1e-2], C=[0.1, 0.1], F_s=1.5 * F_c, v_s=0.05, v_c=1e-4)
    curve = replace(pad.parameters.stribeck, F_c=F_c)
    model = replace(pad, parameters=pad.parameters.replaced(stribeck=curve))
    return System(
        "pulled", bodies=(LOAD,), contacts=(Contact("pad", model),), numbers={"m": m, "K": 20.0}
    )


def test_a_mass_and_its_friction_from_positions() -> None:
    t = np.linspace(0.0, 8.0, 401)
    run = simulate(_pulled(1.0, 1.0), 8.0, t_eval=t, rtol=1e-9)
    seen = Record.from_arrays(time=t, position=run.body("load").x + 1e-5 * noise(0, t.size))
    found = fit(
        seen,
        _pulled(1.2, 0.9),
        free=("numbers.m", "pad.F_c", "pad.F_s"),
        measured="load.x",
        nuisance=(),
    )
    for name, truth in {"numbers.m": 1.0, "pad.F_c": 1.0, "pad.F_s": 1.5}.items():
        assert found[name].value == pytest.approx(truth, rel=1e-3)
        half = 0.5 * (found[name].high - found[name].low)
        assert abs(found[name].value - truth) < 2.0 * half
    assert found.training["rmse"] == pytest.approx(1e-5, rel=0.1)
    assert isinstance(found.model, System)


def test_a_driven_system_is_the_model_on_the_record() -> None:
    record = measured(bank([2e4], [5e-5]), sine(2e-4, 2.0, 3.0), 0.01, 0)
    start = bank([1e4], [4e-5])
    system = System(
        "rig",
        bodies=(Body("table", velocity="w"),),
        contacts=(Contact("pad", start),),
        signals={"w": 0.0},
    )
    alone = fit(record, start, free=("k", "weights"), search="local")
    inside = fit(record, system, free=("pad.k", "pad.weights"), search="local")
    assert inside["pad.k1"].value == pytest.approx(alone["k1"].value, rel=1e-6)
    assert inside["pad.weights1"].value == pytest.approx(alone["weights1"].value, rel=1e-6)


def test_which_signal_is_asked_for() -> None:
    two = System(
        "two",
        bodies=(
            Body("a", velocity="w", x="x_a", v="v_a"),
            Body("b", velocity="u", x="x_b", v="v_b"),
        ),
        contacts=(Contact("pad", bank([1e4], [4e-5]), v="v_a - v_b"),),
        signals={"w": 0.0, "u": 0.0},
    )
    record = measured(bank([2e4], [5e-5]), sine(2e-4, 2.0, 3.0), 0.01, 0)
    with pytest.raises(ParameterError, match=r"drive: it cannot be told which signal.*w, u"):
        fit(record, two, free=["pad.k"])
    with pytest.raises(ParameterError, match=r"drive: there is no signal 'q'; there are w, u"):
        fit(record, two, free=["pad.k"], drive="q")
    found = fit(record, two, free=["pad.k"], drive="w", search="local")
    assert found["pad.k1"].told
