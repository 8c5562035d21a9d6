"""The same run in other units: lengths, forces or times times a power of two give the same bits.

A power of two changes no digit, so a program without scales of its own gives the same numbers but
for the factors: the same switches, at the same places, with the same steps.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, PulledSlider, Slider, Trace, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.systems.models import ChartModel
from tests.corpus import DEMONSTRATIONS, KINDS, RIG_RUNS, Run, each, run, trace
from tests.helpers import event_sequence, pulled_mass
from tests.scaled import AXES, factors, other_bits, scaled
from tests.zoo import zoo_cases

MICRO = 2.0**-20  # about 1e-6
LENGTHS = [MICRO, 2.0**-30, 2.0**10]
POWERS = {"N/m": -1, "Ns/m": -1, "m": 1, "m/s": 1}  # of a length, in the units of parameters
SHIPPED = ("nested_reversals", "paper_fig4_stick_slip", "pulled_mass", "stribeck_sweep")
EXPONENTS = (-40, -13, 20)
IN_TURN = [
    (name, axis, EXPONENTS[(i + j) % 3])
    for i, name in enumerate(SHIPPED)
    for j, axis in enumerate(AXES)
]


def in_units(name: str, **by: float) -> list[str]:
    """Return what is not the same in a run with other units."""
    base, (model, rig) = run(name), run(name).subject
    if "atol" in base.how:
        how = {key: u for key, u in base.how.items() if key not in ("atol", "rtol")}
        base = Run((model, rig), base.t_end, how)
    here, there = base(engine="ifelse"), scaled(base, **by)(engine="ifelse")
    if event_sequence(here) != event_sequence(there):
        return [f"{len(there.transitions)} transitions instead of {len(here.transitions)}"]
    return other_bits(there, here, **by)


@pytest.mark.every(6)
@each(RIG_RUNS, KINDS)
def test_every_run_on_a_shipped_rig(name: str) -> None:
    """Each in one other unit, in turn."""
    model, rig = run(name).subject
    if not isinstance(model, GMS | LuGre) or not isinstance(
        rig, Prescribed | Slider | PulledSlider
    ):
        return
    if name == "a function":
        return
    place = [*RIG_RUNS].index(name)
    by = factors(AXES[place % 3], EXPONENTS[place % 2])
    assert in_units(name, **by) == [], by


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize(("name", "axis", "exponent"), IN_TURN)
def test_shipped_scenarios_in_all_units(name: str, axis: str, exponent: int) -> None:
    assert in_units(f"scenario {name}", **factors(axis, exponent)) == []


@pytest.mark.parametrize("unit", LENGTHS)
@each(zoo_cases.CASES)
def test_the_zoo_at_any_length(name: str, unit: float) -> None:
    here, there = trace_of_zoo(name, 1.0), trace_of_zoo(name, unit)
    assert there.transitions.edge.tolist() == here.transitions.edge.tolist()
    assert there.t.tolist() == here.t.tolist()
    assert (there.F == here.F).all()
    assert (there.x == unit * here.x).all()


def trace_of_zoo(name: str, unit: float) -> Trace:
    """Run a case of the zoo in a unit of length."""
    return zoo_cases.CASES[name](unit).run()


@each(DEMONSTRATIONS)
def test_the_demonstrations_at_micrometres(name: str) -> None:
    (model, rig), here = run(name).subject, trace(name, "ifelse")
    units = {each.name: each.unit for each in CHARTS[name].parameters}
    values = {
        key: np.asarray(value) * MICRO ** POWERS.get(units[key], 0)
        for key, value in model.values.items()
    }
    small = (
        PulledSlider(rig.mass / MICRO, rig.stiffness / MICRO, rig.speed * MICRO)
        if isinstance(rig, PulledSlider)
        else Prescribed(f"{MICRO!r} * 2e-3 * (cos(3 * t) + 0.9 * cos(9.3 * t))")
    )
    there = simulate(ChartModel(CHARTS[name], values), small, run(name).t_end, engine="ifelse")
    assert there.t.tolist() == here.t.tolist()
    assert there.F.tolist() == here.F.tolist()
    assert there.x.tolist() == (MICRO * here.x).tolist()
    assert abs(here.F).max() > 0.5


@pytest.mark.parametrize("length", [1e-6, 1e-9])
def test_a_factor_that_rounds_keeps_the_sequence(length: float) -> None:
    base = Run(pulled_mass(), 60.0)
    assert len(scaled(base, length=length)().transitions) == 72


def test_a_wrong_unit_is_detected() -> None:
    """The comparison is meaningful: a stiffness that is not scaled changes the bits."""
    model, rig = pulled_mass()
    base = Run((model, rig), 9.0, {"method": "rk4", "step": 0.01, "events": "step"})
    by = factors("length", -7)
    right = scaled(base, **by)
    p, old = right.subject[0].parameters, model.parameters
    wrong = GMSParameters(
        old.k, p.sigma, p.C, sigma_2=p.sigma_2, stribeck=p.stribeck, v_c=p.v_c, weights=p.weights
    )
    found = Run((GMS(wrong, law="signed"), right.subject[1]), right.t_end, right.how)()
    assert {"x", "v", "z", "F"} <= set(other_bits(found, base(), **by))
