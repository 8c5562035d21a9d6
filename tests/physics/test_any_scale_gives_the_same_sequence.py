"""All lengths, forces or times of a run times 2^e, -40 <= e <= 20: the same sequence of switches.

The bits are also the same except for the factors: a power of two changes no digit.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, PulledSlider, Slider, Stribeck
from gms_fsm.app.scenario import load_scenario
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Formula
from tests.app.test_scenarios_run import SHIPPED
from tests.helpers import pulled_mass
from tests.scaled import AXES, Case, factors, other_bits, scaled, sequence
from tests.scenario_files import data_folder

pytestmark = pytest.mark.slow

HAS_FAST = bool(importlib.util.find_spec("llvmlite"))
EXPONENTS = (-40, -37, -33, -30, -27, -23, -20, -13, -10, -7, -3, -1, 4, 10, 15, 20)
FEW = (-40, -13, 20)


def engine_for(rig: Rig) -> str:
    """Each new text of a signal would have to be compiled, which takes longer than its run."""
    texts = any(isinstance(signal, Formula) for signal in rig.signals.values())
    return "compiled" if HAS_FAST and not texts else "ifelse"


ON_A_RIG = [path for path in SHIPPED if "[[body]]" not in path.read_text(encoding="utf-8")]


@pytest.fixture(params=ON_A_RIG, ids=lambda path: path.stem)
def shipped(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Case:
    path: Path = request.param
    if path.stem == "tribometer":
        monkeypatch.setenv("GMS_FSM_DATA", str(data_folder()))
    return Case.of(load_scenario(path))


@pytest.mark.parametrize("axis", AXES)
def test_shipped_scenarios(shipped: Case, axis: str) -> None:
    engine = engine_for(shipped.rig)
    base = shipped.run(engine)
    exponents = EXPONENTS if engine == "compiled" else FEW
    changed, rounded = [], []
    for exponent in exponents:
        by = factors(axis, exponent)
        trace = scaled(shipped, **by).run(engine)
        if sequence(trace) != sequence(base):
            changed.append(f"2^{exponent}: {len(trace.transitions)} transitions")
        elif differ := other_bits(trace, base, **by):
            rounded.append(f"2^{exponent}: {', '.join(differ)}")
    assert not changed, f"{axis}: instead of {len(base.transitions)} transitions {changed}"
    assert not rounded, f"{axis}: other bits {rounded}"


@pytest.mark.parametrize("length", [1e-6, 1e-9, 2.0**-30])
def test_pulled_mass_of_any_size(length: float) -> None:
    """A factor that is not a power of two rounds, and still gives 72 transitions."""
    model, rig = pulled_mass()
    case = scaled(Case(model, rig, {"t_end": 60.0}), length=length)
    assert len(case.run(engine_for(rig)).transitions) == 72


# --------------------------------------------------------------------------- the scaling itself


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize(
    "rig",
    [
        PulledSlider(1.0, 2.0, 0.1),
        Slider(1.0, "max(1.4*sin(-t), t**2/9)"),
        Slider(1.0, [(0, 0), (1, 2.0), (3, -1.0)]),
        Prescribed("0.2*sin(2*pi*t/20)"),
    ],
)
def test_fixed_steps_scale_to_the_bit(axis: str, rig: Rig) -> None:
    """Without tolerances only the units matter: `scaled` has them right."""
    model, _ = pulled_mass()
    lugre = LuGre(sigma_0=40.0, sigma_1=1.0, sigma_2=0.4, stribeck=Stribeck(1.0, 1.5, 0.05))
    for each in (model, lugre):
        initial = {"x": 0.01, "z": np.full(each.n, 1e-3)}
        arguments = {"method": "rk4", "step": 0.01, "t_end": 3.0, "events": "step"}
        case = Case(each, rig, {**arguments, "initial": initial})
        by = factors(axis, -7)
        assert other_bits(scaled(case, **by).run("ifelse"), case.run("ifelse"), **by) == []


def test_a_wrong_unit_is_detected() -> None:
    """The comparison is meaningful: a stiffness that is not scaled changes the bits."""
    model, rig = pulled_mass()
    case = Case(model, rig, {"method": "rk4", "step": 0.01, "t_end": 9.0, "events": "step"})
    by = factors("length", -7)
    right = scaled(case, **by)
    assert isinstance(right.model, GMS)
    p, old = right.model.parameters, model.parameters
    wrong = GMSParameters(
        old.k, p.sigma, p.C, sigma_2=p.sigma_2, stribeck=p.stribeck, v_c=p.v_c, weights=p.weights
    )
    trace = Case(GMS(wrong, law="signed"), right.rig, right.arguments).run("ifelse")
    assert {"x", "v", "z", "F"} <= set(other_bits(trace, case.run("ifelse"), **by))
