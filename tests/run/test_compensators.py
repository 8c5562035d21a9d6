"""A `Compensator` is the friction of a run along its reference, and as C99 the same to the bit."""

import ctypes
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Compensator,
    Contact,
    Fit,
    GMSParameters,
    Prescribed,
    Record,
    Sampled,
    State,
    Stribeck,
    System,
    SystemState,
    export,
    fit,
    simulate,
)
from gms_fsm.coupling.compensator import Compensator as SameName
from tests.exporters.c_programs import COMPILERS, needs_c

TICK = 1e-3  # s
RANDOM = np.random.default_rng(46)


def bank(n: int, F_c: float, k: float, **more: Any) -> GMS:
    """A bank whose elements let go between 20 and 800 um."""
    z, share = np.geomspace(2e-5, 8e-4, n), np.full(n, 1 / n)
    parameters = GMSParameters.from_shares(
        share, share * 4.0 / z * k, C=20.0, v_c=1e-6, sigma_2=10.0,
        stribeck=Stribeck(F_c=F_c, F_s=1.2 * F_c, v_s=5e-3), **more,
    )  # fmt: skip
    return GMS(parameters, law="signed")


MODEL = bank(4, 4.0, 1.0)


def velocities(n: int = 400) -> np.ndarray:
    """A smooth velocity with many reversals, m/s, from rest."""
    t = TICK * np.arange(n)
    return 0.01 * np.sin(17 * t) * np.sin(110 * t + 0.3) + 0.002 * np.sin(3 * t)


def test_its_forces_are_those_of_a_run_along_the_reference() -> None:
    v = velocities()
    compensator = Compensator(MODEL, TICK)
    forces = [compensator.advance(each) for each in v[1:].tolist()]
    t = TICK * np.arange(v.size)
    run = simulate(MODEL, Prescribed((t, np.concatenate([[0.0], v[1:]]))), t[-1], t_eval=t)
    np.testing.assert_allclose(forces, run.F[1:], rtol=1e-9, atol=1e-9)
    assert len(run.transitions) > 20
    assert compensator.friction.t == pytest.approx(t[-1])


def test_gain_limit_and_feedback() -> None:
    plain, half = Compensator(MODEL, TICK), Compensator(MODEL, TICK, gain=0.5, limit=1.0)
    mixed = Compensator(MODEL, TICK, feedback=0.25)
    limited = 0
    for v in velocities().tolist():
        force = plain.advance(v)
        assert half.advance(v) == min(max(0.5 * force, -1.0), 1.0)
        limited += abs(force) > 2.0
        assert mixed.advance(v - 0.25, v + 0.75) == pytest.approx(force, abs=1e-6)
    assert 0 < limited < 400


def test_a_fit_gives_its_model() -> None:
    t = np.linspace(0.0, 4.0, 200)
    run = simulate(MODEL, Prescribed("3e-3*cos(2*t)"), 4.0, t_eval=t)
    record = Record.from_arrays(time=t, position=run.x, force=run.F)
    found: Fit = fit(record, MODEL, free=["F_c"], search="local")
    compensator = Compensator(found, TICK)
    assert compensator.model is found.model
    assert compensator.advance(0.01) == Compensator(found.model, TICK).advance(0.01)


def test_it_is_public() -> None:
    assert Compensator is SameName


COULOMB = Chart(
    "Coulomb", parameters=("F_c", "b"), states=(State("on"),), outputs={"F": "F_c * sgn(v) + b * v"}
)
COUNT = 0.04 / 4096  # m: 12 bits over 40 mm
M, W = 1.0, 2 * math.pi * 20


def table() -> System:
    """The plant: eight elements, an encoder, a PID controller that acts one tick later."""
    return System(
        "table",
        bodies=(Body("table", inertia=M, force="u_old"),),
        contacts=(Contact("guide", bank(8, 4.0, 1.0, sigma=[2.0] * 8)),),
        numbers={"q": COUNT, "k_p": M * W**2, "k_d": 1.6 * M * W, "k_i": 0.2 * M * W**3},
        inputs=("ref", "v_ref", "ff"),
        sampled=(
            Sampled("pid", period=TICK, updates={
                "u_old": "u", "y": "quantise(x, q)", "e": "ref - y", "I": "I + k_i * period * e",
                "v_m": "0.8 * v_m + 0.2 * (y - y_old) / period",
                "u": "k_p * e + I + k_d * (v_ref - v_m) + ff", "y_old": "y",
            }),
        ),
    )  # fmt: skip


def rms(x: np.ndarray, compensator: Compensator | None) -> float:
    """Return the error along a motion, m."""
    v = np.gradient(x, TICK)
    a, state, found = np.gradient(v, TICK), SystemState(table()), []
    for k in range(x.size - 2):
        force = 0.0 if compensator is None else compensator.advance(float(v[k + 2]))
        force += M * float(a[k + 1])
        state.advance(TICK, ref=float(x[k]), v_ref=float(v[k]), ff=force)
        found.append(state.value("x") - x[k + 1])
    return float(np.sqrt(np.mean(np.square(found[300:]))))


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [(0.8, 1.2), (1.2, 0.8), (0.8, 0.8), (1.2, 1.2)])
def test_a_plant_that_is_not_the_model_follows_better(wrong: tuple[float, float]) -> None:
    pytest.importorskip("llvmlite", reason="thousands of ticks")
    F_c, k, t = 4.0 * wrong[0], wrong[1], TICK * np.arange(2002)
    motions = (
        2e-3 * np.sin(2 * np.pi * 0.25 * t) + 8e-4 * np.sin(2 * np.pi * 1.5 * t),
        5e-4 * (1 - np.cos(2 * np.pi * 0.5 * t)),
    )
    for x in motions:
        found = {
            name: rms(x, None if model is None else Compensator(model, TICK))
            for name, model in {
                "none": None,
                "Coulomb": ChartModel(COULOMB, {"F_c": F_c, "b": 10.0 * k}),
                "GMS": bank(4, F_c, k),
            }.items()
        }
        assert found["GMS"] <= max(0.3 * found["none"], 3 * COUNT)
        assert found["GMS"] <= max(0.5 * found["Coulomb"], 3 * COUNT)


# --------------------------------------------------------------------------- as C99
def compiled(compensator: Compensator, folder: Path, arguments: str, call: str) -> Any:
    """Return the exported compensator as a function of its arguments."""
    export(compensator, "c99", folder, name="pad")
    (folder / "tick.c").write_text(
        f'#include "pad_compensator.h"\nstatic pad_compensator c;\n'
        f"void begin(void) {{ pad_compensator_init(&c); }}\n"
        f"double tick({arguments})\n"
        f"{{ return pad_compensate(&c, {call}) == pad_OK ? c.force : -1e9; }}\n"
    )
    common = ["-std=c99", "-O0", "-ffp-contract=off", "-fPIC", "-c"]
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]
    commands = [[each, *common, *strict, "tick.c"] for each in reversed(COMPILERS)]
    for command in (*commands, [COMPILERS[0], *common, "pad.c"]):
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    library = folder / "pad.so"
    subprocess.run(
        [COMPILERS[0], "-shared", "-o", str(library), "tick.o", "pad.o", "-lm"],
        cwd=folder, check=True,
    )  # fmt: skip
    loaded = ctypes.CDLL(str(library))
    loaded.begin()
    loaded.tick.restype = ctypes.c_double
    loaded.tick.argtypes = [ctypes.c_double] * arguments.count("double")
    return loaded.tick


@pytest.mark.matrix
@needs_c
@pytest.mark.slow
def test_as_c99_it_has_the_same_bits(tmp_path: Path) -> None:
    ours = Compensator(MODEL, TICK, feedback=0.3, gain=1.1, limit=3.5)
    tick = compiled(ours, tmp_path, "double r, double m", "r, m")
    limited = 0
    for v in velocities().tolist():
        measured = v + 1e-3 * float(RANDOM.standard_normal())
        force = ours.advance(v, measured)
        assert tick(v, measured) == force
        limited += abs(force) == 3.5
    assert 0 < limited < 400


@pytest.mark.matrix
@needs_c
@pytest.mark.slow
def test_as_c99_inputs_and_no_feedback(tmp_path: Path) -> None:
    chart = Chart("loaded", inputs=("v", "N"), parameters=(), variables=("z",),
                  states=(State("on", flow={"z": "v - 1e4 * abs(v) * z / N"}),),
                  outputs={"F": "1e4 * z"})  # fmt: skip
    ours = Compensator(Contact("pad", chart, {}, inputs={"N": "1 + N_0"}), TICK)
    tick = compiled(ours, tmp_path, "double r, double a, double b", "r, a, b")
    for v in velocities(100).tolist():
        assert tick(v, 0.1, 0.1 + v * v) == ours.advance(v, N_0=(0.1, 0.1 + v * v))
