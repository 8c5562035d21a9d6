"""Machines that are no contacts switch when they should, see others, and hear events."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm import (
    Body,
    Chart,
    ChartError,
    ChartModel,
    Contact,
    ParameterError,
    Prescribed,
    Session,
    State,
    Supervisor,
    System,
    Trace,
    Transition,
    simulate,
)
from tests.supervisor_cases import (
    BRAKE,
    HEATING,
    SIDE,
    THERMOSTAT,
    crossing,
    gear_shift,
    hot_brake,
    intermittent_drive,
    thermostat,
)


def times(trace: Trace, edge: str) -> list[float]:
    log = trace.transitions
    return log.t[log.edge == edge].tolist()


def test_a_thermostat_switches_at_the_times_of_its_exponentials():
    trace = thermostat().run()
    first, cool, heat = HEATING
    cycle = cool + heat
    off = [first + k * cycle for k in range(6)]
    assert times(trace, "switch_off") == pytest.approx(off, rel=1e-9)
    assert times(trace, "switch_on") == pytest.approx([0.0, *(t + cool for t in off)], abs=1e-9)


def test_traffic_lights_see_each_other_and_events_are_counted_at_the_same_instant():
    trace = crossing().run()
    assert times(trace.supervisor("main"), "go") == pytest.approx([30.0, 90.0, 150.0])
    assert times(trace.supervisor("side"), "halt") == pytest.approx([30.0, 90.0, 150.0])
    assert times(trace.supervisor("side"), "go") == pytest.approx([2.0, 60.0, 120.0, 180.0])
    assert times(trace.supervisor("cycles"), "count_one") == pytest.approx([60.0, 120.0, 180.0])
    assert trace.value("cycles.n")[-1] == 3.0


def test_a_drive_shifts_gears():
    trace = gear_shift().run()
    declutch = math.log(4.0)  # w = 4 (1 - exp(-t)) reaches 3
    assert times(trace, "declutch") == pytest.approx([declutch], rel=1e-9)
    assert times(trace, "engage") == pytest.approx([declutch + 0.25], rel=1e-9)
    left = 2.0 - declutch - 0.25
    after = 2.0 + (3.0 * math.exp(-0.25) - 2.0) * math.exp(-left)
    assert trace.body("drive").v[-1] == pytest.approx(after, rel=1e-9)


def test_an_intermittent_drive_moves_a_mass_that_stops_in_between():
    """v = 2 t for 1 s, then 1 m/s^2 less: it stops after 2 s, 1 + 2 m further."""
    trace = intermittent_drive().run()
    assert times(trace.supervisor("drive"), "stop") == pytest.approx([1.0, 5.0])
    arrests = [r.t for r in trace.contact("pad").transitions if r.target == "stuck"]
    assert arrests == pytest.approx([3.0, 7.0], rel=1e-9)
    assert trace.body("sled").x[-1] == pytest.approx(6.0, rel=1e-9)


def test_the_heat_of_a_brake_eases_it_as_scipy_says():
    trace = hot_brake().run()

    def flow(_: float, y: np.ndarray, N: float) -> list[float]:
        F = 0.4 * N * math.tanh(y[0] / 0.1)
        return [(20.0 - 2.0 * y[0] - F) / 2.0, (F * y[0] - y[1]) / 5.0]

    t, y, N, found = 0.0, [0.0, 0.0], 30.0, []
    while t < 60.0:
        limit = 30.0 if N == 30.0 else 15.0

        def reaches(_: float, y: np.ndarray, N: float, limit: float = limit) -> float:
            return y[1] - limit

        reaches.terminal, reaches.direction = True, 1.0 if N == 30.0 else -1.0
        done = solve_ivp(
            flow, (t, 60.0), y, "DOP853", events=reaches, args=(N,), rtol=1e-11, atol=1e-12
        )
        t, y = done.t[-1], done.y[:, -1]
        if done.status == 1:
            found.append(t)
            N = 3.0 if N == 30.0 else 30.0
    assert len(found) >= 2
    assert trace.transitions.t.tolist() == pytest.approx(found, rel=1e-7)


def test_the_flow_of_a_variable_reads_the_force_of_its_own_element_and_contact():
    chart = Chart(
        "wear",
        inputs=("v",),
        variables=("z", "W"),
        parameters=("k",),
        states=(State("on", flow={"z": "v", "W": "F * v"}),),
        outputs={"F": "k * z"},
    )
    trace = simulate(ChartModel(chart, {"k": [3.0, 5.0]}, n=2), Prescribed(0.5), 2.0)
    assert trace.variable("W")[-1] == pytest.approx([4.0, 4.0])  # (3 + 5) * 1**2 / 2


def test_a_rate_that_its_force_follows_from_cannot_read_it():
    with pytest.raises(ChartError, match="algebraic loop"):
        Chart(
            "loop",
            inputs=("v",),
            variables=("z",),
            states=(State("on", flow={"z": "v - F"}),),
            outputs={"F": "z + dz"},
        )


def test_outputs_that_follow_from_each_other_are_refused_with_the_cycle():
    twice = Chart(
        "twice", inputs=("u",), velocities=(), states=(State("on", outputs={"y": "2 * u"}),)
    )
    with pytest.raises(ParameterError, match=r"outputs of p, q follow .* \(an algebraic loop\)"):
        System(
            "loop",
            supervisors=(
                Supervisor("p", twice, inputs={"u": "q.y"}),
                Supervisor("q", twice, inputs={"u": "p.y"}),
            ),
        )


def test_elements_in_a_state_are_counted():
    chart = Chart(
        "slips",
        inputs=("v",),
        variables=("z",),
        parameters=("s_0",),
        states=(State("stick", flow={"z": "v"}), State("slip")),
        transitions=(Transition("go", "stick", "slip", guard="z >= s_0"),),
        outputs={"F": "z"},
    )
    most = Chart(
        "alarm",
        inputs=("slipping",),
        velocities=(),
        states=(State("calm"), State("alarmed")),
        transitions=(Transition("ring", "calm", "alarmed", guard="slipping > 1.5"),),
    )
    system = System(
        "bank",
        bodies=(Body("belt", velocity="1"),),
        contacts=(Contact("pad", chart, {"s_0": [1.0, 2.0, 3.0]}, n=3),),
        supervisors=(Supervisor("alarm", most, inputs={"slipping": "count(pad.slip)"}),),
    )
    assert times(simulate(system, 4.0), "ring") == pytest.approx([2.0])


def test_a_periodic_supervisor_is_asked_at_its_ticks():
    heater = Supervisor("heater", THERMOSTAT, {"low": 19.0, "high": 21.0}, period=0.5)
    room = System("room", supervisors=(heater,), flow={"T": "30 * heater.u - T"})
    assert (simulate(room, 5.0).transitions.t % 0.5 == 0.0).all()


def test_a_system_without_supervisors_and_contacts_is_refused():
    with pytest.raises(ParameterError, match="no contacts and no supervisors"):
        System("empty", bodies=(Body("one", inertia=1.0),))
    with pytest.raises(ParameterError, match="Supervisor"):
        Contact("pad", SIDE)
    with pytest.raises(ParameterError, match="velocities="):
        Supervisor("mode", BRAKE)


def test_a_session_steps_through_a_supervisor():
    case = thermostat()
    session = Session(case.system, case.t_end)
    here = session.next_transition()
    assert str(here.fired) == "heater 1: off -> on by switch_on"
    assert "heater: u = 1, on" in str(here)
    assert session.until("heater.u < 0.5").t == pytest.approx(HEATING[0])
    assert session.why("heater 1")[0].edge.name == "switch_off"


def test_an_event_is_sent_to_a_session():
    case = crossing()
    session = Session(case.system, 20.0)
    session.goto(3.0)
    session.poke({"red": 1.0})
    assert str(session.next_transition().fired) == "cycles 1: counting -> counting by count_one"
