"""Claim: friction in python-control is that of `simulate`, sampled; its memory is in x alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, Contact, FrictionState, Prescribed, State, simulate
from gms_fsm.adapters.control import friction_system
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ParameterError
from tests.adapters.loops import LOAD, T_END, loaded_pad, servo_in_control
from tests.helpers import pulled_mass

control = pytest.importorskip("control", reason="systems of python-control are extra control")

DT = 1.0 / 128.0  # s: steps add up without rounding
T = DT * np.arange(1281)
V = 0.1 * np.sin(T)


def force(system: Any, x0: Any = 0.0) -> Any:
    return control.input_output_response(system, T, V, x0).outputs


def test_on_the_same_samples_it_is_simulate_to_the_bit() -> None:
    model, _ = pulled_mass()
    expected = simulate(model, Prescribed((T, V)), 10.0, t_eval=T)
    F = force(friction_system(model, DT))
    assert len(expected.transitions) >= 8
    assert F[1:].tolist() == expected.F[1:].tolist()


@pytest.mark.slow
def test_the_servo_stops_where_it_should() -> None:
    dt = 2e-5
    t = dt * np.arange(round(T_END / dt) + 1)
    response = control.input_output_response(servo_in_control(dt), t, np.zeros((0, t.size)))
    assert response.outputs[2, -1] == pytest.approx(LOAD, rel=5e-4)


def test_the_functions_are_pure() -> None:
    """Any x gives the same answer, in any order, from any system made in the same way."""
    model, _ = pulled_mass()
    one, two = friction_system(model, DT), friction_system(model, DT, name="other")
    states = control.input_output_response(one, T, V).states
    for k in (1280, 3, 700, 0, 701, 3):
        u = V[k : k + 1]
        shuffled = one.output(T[k], states[:, k], u), one.dynamics(T[k], states[:, k], u)
        other = two.dynamics(T[k], states[:, k], u), two.output(T[k], states[:, k], u)
        assert shuffled[0].tolist() == other[1].tolist()
        assert shuffled[1].tolist() == other[0].tolist()
        if k < 1280:
            assert shuffled[1].tolist() == states[:, k + 1].tolist()


def test_a_response_can_be_continued() -> None:
    model, _ = pulled_mass()
    system = friction_system(model, DT)
    whole = force(system)
    first = control.input_output_response(system, T[:501], V[:501])
    rest = control.input_output_response(system, T[500:], V[500:], first.states[:, -1])
    assert rest.outputs.tolist() == whole[500:].tolist()


def test_a_response_may_begin_at_any_time_and_speed() -> None:
    model, _ = pulled_mass()
    system = friction_system(model, DT)
    later = control.input_output_response(system, T + 3.0, V + 0.05)
    friction = FrictionState(model)
    friction.advance(0.05, 0.05, 0.0)
    assert later.outputs[0] == friction.peek(0.05, 0.05, 0.0)
    assert later.outputs[1] == friction.advance(V[0] + 0.05, V[1] + 0.05, DT)


def test_two_joints_are_two_systems() -> None:
    model, _ = pulled_mass()
    joints = [friction_system(model, DT, name=name) for name in ("hip", "knee")]
    both = control.interconnect(
        joints,
        inplist=["hip.v", "knee.v"],
        outlist=["hip.F", "knee.F"],
        inputs=["v_hip", "v_knee"],
        outputs=["F_hip", "F_knee"],
        dt=DT,
    )
    response = control.input_output_response(both, T, np.stack([V, 2 * V]))
    assert response.outputs[0].tolist() == force(friction_system(model, DT)).tolist()
    assert response.outputs[1].tolist() != response.outputs[0].tolist()


def test_what_a_contact_names_are_further_inputs() -> None:
    system = friction_system(loaded_pad(), DT)
    assert system.input_labels == ["v", "load"]
    response = control.input_output_response(system, T, np.stack([V, 2.0 + T]))
    assert response.outputs[0] == pytest.approx(3.0 * V * (2.0 + T))


@pytest.mark.parametrize("dt", [0.0, -1e-3, float("nan"), True])
def test_a_wrong_sample_time_is_refused(dt: Any) -> None:
    with pytest.raises(ParameterError, match="dt"):
        friction_system(pulled_mass()[0], dt)


def test_a_lock_is_refused() -> None:
    pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.1})
    with pytest.raises(ParameterError, match="locks the contact"):
        friction_system(pad, DT)


def test_a_state_that_was_not_returned_is_refused_and_does_no_harm() -> None:
    system = friction_system(pulled_mass()[0], DT)
    whole = force(system)
    wrong = np.full(system.nstates, 0.5)
    with pytest.raises(ParameterError, match="no state of this friction"):
        force(system, wrong)
    with pytest.raises(ParameterError, match="v1"):
        control.input_output_response(system, T, np.where(T < 1.0, V, np.nan))
    assert force(system).tolist() == whole.tolist()


def test_it_begins_at_the_time_of_the_first_sample() -> None:
    """Texts over t see the right time, and each response starts afresh."""
    system = friction_system(loaded_by_time(), 0.01)
    for begin in (5.0, 0.0, 5.0):
        t = begin + 0.01 * np.arange(100)
        found = control.input_output_response(system, t, np.full(100, 0.1)).outputs
        friction = FrictionState(loaded_by_time(), t=begin)
        F = [friction.peek(0.1, 0.1, 0.0), *(friction.advance(0.1, 0.1, 0.01) for _ in t[1:])]
        assert found == pytest.approx(F, rel=1e-12)


def loaded_by_time() -> Contact:
    state = State("only", flow={"z": "v"}, outputs={"F": "k * z * N"})
    chart = Chart("loaded", inputs=("v", "N"), variables=("z",), parameters=("k",), states=(state,))
    return Contact("pad", chart, {"k": 1.0}, inputs={"N": "t"})
