"""Systems without a typical size of motion run alike at any tolerance and any scale of length."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

import pytest

from gms_fsm import Body, Chart, Contact, Parameter, State, System, Trace, Transition, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from tests.systems_cases import PLANAR, PUCK

# The force is continuous at break-away: the mass starts with v = 0 and a = 0 at x = 0, so that
# nothing at that moment tells how large x is going to be.
WINDOW = Chart(
    "Friction with a velocity window",
    parameters=(
        Parameter("F_c", "N", "> 0"),
        Parameter("F_s", "N", ">= F_c"),
        Parameter("D", "m/s", "> 0"),
    ),
    states=(
        State("stuck", locked=True),
        State("creep", outputs={"F": "F_s"}),
        State("forward", outputs={"F": "F_c"}),
    ),
    transitions=(
        Transition("pull", "stuck", "creep", guard="F > F_s"),
        Transition("go", "creep", "forward", guard="v > D"),
        Transition("zone", "forward", "stuck", guard="v < D"),
    ),
)
MODES = entry("modelica").demonstration
Run: TypeAlias = Callable[[float, float], Trace]  # of the scale of length and rtol
LENGTHS = [2.0**-30, 2.0**10]


@cache
def _pulled(length: float, rtol: float) -> Trace:
    system = System(
        "pulled mass",
        bodies=(Body("mass", inertia="m", force="K * (V * t - x)"),),
        contacts=(Contact("pad", WINDOW, {"F_c": 1.0, "F_s": 1.5, "D": 1e-3 * length}),),
        numbers={"m": 1.0 / length, "K": 2.0 / length, "V": 0.1 * length},
    )
    return simulate(system, 40.0, rtol=rtol, engine="ifelse")


@cache
def _puck(length: float, rtol: float) -> Trace:
    values = PUCK | {"v_c": PUCK["v_c"] * length}
    system = System(
        "puck",
        bodies=(
            Body("bx", inertia="m", force="A * cos(0.2 * t)", x="qx", v="vx"),
            Body("by", inertia="m", force="A * sin(0.4 * t)", x="qy", v="vy"),
        ),
        contacts=(Contact("pad", PLANAR, values, v=("vx", "vy")),),
        numbers={"m": 1.0 / length, "A": 1.4},
    )
    return simulate(system, 60.0, rtol=rtol, engine="ifelse")


@pytest.mark.slow
@pytest.mark.parametrize("run", [_pulled, _puck])
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_the_sequence_is_that_of_a_fine_run(run: Run, rtol: float) -> None:
    coarse, fine = run(1.0, rtol).transitions, run(1.0, 1e-11).transitions
    assert coarse.edge.tolist() == fine.edge.tolist()
    assert len(coarse) == 14
    assert coarse.t == pytest.approx(fine.t, abs=100.0 * rtol)


@pytest.mark.parametrize("run", [_pulled, _puck])
@pytest.mark.parametrize("length", LENGTHS)
def test_lengths_change_nothing_but_lengths(run: Run, length: float) -> None:
    here, there = run(1.0, 1e-6), run(length, 1e-6)
    assert there.transitions.t.tolist() == here.transitions.t.tolist()
    assert there.t.tolist() == here.t.tolist()


@cache
def _loaded(t_end: float, rtol: float) -> Trace:
    system = System(
        "pulled mass",
        bodies=(Body("mass", inertia="m", force="K * (V * t - x)"),),
        contacts=(Contact("pad", CHARTS["modelica"], MODES.values, inputs=dict(MODES.inputs)),),
        numbers={"m": 1.0, "K": 2.0, "V": 0.1},
    )
    return simulate(system, t_end, rtol=rtol, engine="ifelse")


@pytest.mark.parametrize("t_end", [12.0, 40.0])
@pytest.mark.parametrize("rtol", [1e-5, 1e-10])
def test_a_mass_that_has_only_just_left_rest_goes_on(t_end: float, rtol: float) -> None:
    """After the release v is 1e-30 m/s, with an acceleration that is all rounding."""
    log, fine = _loaded(t_end, rtol).transitions, _loaded(40.0, 1e-11).transitions
    assert log.edge.tolist() == fine.edge[: len(log)].tolist()
    assert len(log) == (3 if t_end == 12.0 else len(fine))
