"""Machines that are no contacts switch when they should, see others, and hear events."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm import (
    Body,
    Chart,
    ChartError,
    ChartModel,
    Contact,
    ExpressionError,
    ParameterError,
    Prescribed,
    Session,
    State,
    Supervisor,
    System,
    Trace,
    Transition,
    prove,
    simulate,
    sweep,
)
from gms_fsm.traces.failures import LivelockError, NotFiniteError
from tests.helpers import FASTEST
from tests.scenario_files import CommandLine
from tests.supervisor_cases import (
    BRAKE,
    CHOUDHURY,
    DAY,
    HEATING,
    KANO,
    LIGHT,
    LONG_DAY,
    LONG_NIGHT,
    NIGHT,
    SIDE,
    THERMOSTAT,
    TWO_LEVELS,
    clutches,
    crossing,
    gear_shift,
    hot_brake,
    hunting,
    intermittent_drive,
    lift,
    relay,
    sampled_valve,
    thermostat,
    valve,
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


def test_ribbons_show_the_states_of_a_supervisor():
    figure = pytest.importorskip("matplotlib.figure", reason="pictures need the extra 'plots'")
    from plots import panels

    trace = crossing().run().supervisor("main")
    _, green, _ = panels.ribbons(figure.Figure().subplots(), trace)
    ends = [end for path in green.get_paths() for end in path.get_extents().intervalx]
    assert ends == pytest.approx([30.0, 55.0, 90.0, 115.0, 150.0, 175.0])


def test_a_light_of_two_levels_blinks_by_night_and_goes_on_by_day_where_it_was():
    log = simulate(System("light", supervisors=(Supervisor("light", TWO_LEVELS),)), 600.0)
    expected, now, active = [], 0.0, "red"
    while now < 600.0:
        for around, inside, length in (("day", DAY, LONG_DAY), ("night", NIGHT, LONG_NIGHT)):
            first, at = (active if around == "day" else "lit"), now
            names = [*inside]
            here = names.index(first)
            while at + inside[names[here]] < now + length:
                at += inside[names[here]]
                here = (here + 1) % len(names)
                expected.append((at, f"{around}.{names[here]}"))
            active = names[here] if around == "day" else active
            now += length
            expected.append((now, "night.lit" if around == "day" else f"day.{active}"))
    entered = [(each.t, str(each.target)) for each in log.transitions if each.t < 599.9]
    expected = [(t, name) for t, name in expected if t < 599.9]
    assert [name for _, name in entered] == [name for _, name in expected]
    assert [t for t, _ in entered] == pytest.approx([t for t, _ in expected], rel=1e-9)
    assert {name for _, name in entered} >= {"day.amber", "night.dark"}


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


def test_a_relay_draws_a_mass_to_rest_by_thirds():
    """Inwards it is pushed with 1 - 0.5 N, outwards held back with 1 + 0.5 N."""
    trace = relay().run()
    assert times(trace, "fall_below") == pytest.approx([2.0], rel=1e-9)
    assert times(trace, "arrest_backward") == pytest.approx([8.0 / 3.0], rel=1e-9)
    since = 3.5 - 8.0 / 3.0  # from rest at x = -1/3 m
    assert trace.body("mass").x[-1] == pytest.approx(-1.0 / 3.0 + 0.25 * since**2, rel=1e-9)


def test_a_valve_sticks_and_jumps_as_the_published_rule_says():
    """Q. P. He et al., Industrial & Engineering Chemistry Research 46(4), 2007."""
    case = valve()
    ticks = np.arange(60.0)
    left = before = stem = 0.0
    expected = []
    for u in np.sin(0.25 * ticks).tolist():
        force = left + u - before
        if abs(force) > 0.3:
            left = math.copysign(0.2, force)
            stem = u - left
        else:
            left = force
        before = u
        expected.append(stem)
    trace = simulate(case.system, case.t_end, t_eval=ticks + 0.5).sample(ticks + 0.5)
    assert trace.value("valve.y").tolist() == expected
    assert 20 < len(set(expected)) < 60


def kano(signal: Sequence[float], S: float, J: float) -> list[float]:
    """Return the stem after each sample by the rule of Kano; it begins at rest."""
    stem = before = change_before = rested_at = 0.0
    direction, stopped, found = 1.0, True, []
    for u in signal:
        change = u - before
        if change * change_before <= 0.0 and not stopped:
            rested_at, stopped = before, True
        if stopped and -direction * (u - rested_at) > S:
            direction, stopped = -direction, False
        elif stopped and direction * (u - rested_at) > J:
            stopped = False
        if not stopped:
            stem = u - direction * (S - J) / 2.0
        before, change_before = u, change
        found.append(stem)
    return found


def choudhury(signal: Sequence[float], S: float, J: float) -> list[float]:
    """Return the stem after each sample by the rule of Choudhury; it begins halted."""
    stem = before = stuck_at = 0.0
    needed: float | None = J
    direction, found = 1.0, []
    for u in signal:
        if (u - before) * direction < 0.0:
            direction, stuck_at, needed = -direction, before, S
        elif needed is None and u == before:
            stuck_at, needed = before, J
        elif needed is None or abs(u - stuck_at) > needed:
            stem, needed = u - direction * (S - J) / 2.0, None
        before = u
        found.append(stem)
    return found


@pytest.mark.parametrize(("S", "J"), [(1.0, 0.0), (1.0, 0.5), (0.75, 0.75), (0.5, 1.0)])
@pytest.mark.parametrize(("chart", "rule"), [(KANO, kano), (CHOUDHURY, choudhury)])
def test_a_sampled_valve_moves_as_its_published_rule_says(chart, rule, S: float, J: float):
    """M. Kano et al., 7th IFAC DYCOPS, 2004; Choudhury, Thornhill, Shah, CEP 13, 641-658, 2005.

    S is deadband and stickband, J the slip jump. Choudhury's flow chart leaves open what follows a
    reversal. Our reading, here and in the chart: in its sample the stem keeps still; from there the
    signal has to change by S, after a halt in the same direction by J; each reversal counts anew.
    Saturation is left out. All numbers are sixteenths, so that both sides are exact.
    """
    taken = set()
    for seed in range(4):
        random = np.random.default_rng(seed)
        turns = np.where(random.random(150) < 0.25, -1, 1).cumprod()
        steps = np.where(random.random(150) < 0.2, 0, random.integers(1, 8, 150)) * turns
        signal = (steps.cumsum() / 16.0).tolist()
        case, ticks = sampled_valve(chart, S, J, signal), np.arange(150.0)
        trace = simulate(case.system, case.t_end, t_eval=ticks + 0.5, engine=FASTEST)
        stem = trace.sample(ticks + 0.5).value("valve.stem").tolist()
        assert stem == rule(signal, S, J), f"seed {seed}"
        taken |= {*trace.transitions.edge.tolist()}
    assert taken == {each.name for each in chart.transitions}


def test_a_car_shifts_up_through_an_open_clutch():
    """Engine 1 kg m^2, car 20: locked by 3, apart for 0.5 s, slipping to 2, locked by 2."""
    trace = clutches().run()
    release = 100.0 * (20.0 + 9.0) / (3.0 * (3.0 * 30.0 - 10.0))
    close = release + 0.5
    engine, car = 100.0 - 20.0 * 0.5, 100.0 / 3.0 - 0.5 * 10.0 / 20.0
    gain = (2.0 * 60.0 - 10.0) / 20.0  # of the car, 1/s^2, while the second clutch slips
    slips = (engine - 2.0 * car) / (60.0 - 30.0 + 2.0 * gain)
    lock = close + slips
    found = [times(trace, edge) for edge in ("release", "close", "arrest_up", "locked")]
    assert found == [[pytest.approx(t, rel=1e-9)] for t in (release, close, lock, lock)]
    end = car + gain * slips + (2.0 * 30.0 - 10.0) / (20.0 + 4.0) * (15.0 - lock)
    assert trace.body("car").v[-1] == pytest.approx(end, rel=1e-9)
    assert trace.body("engine").v[-1] == pytest.approx(2.0 * end, rel=1e-9)


@pytest.mark.parametrize("band", [1e-9, 0.05])
def test_a_supervisor_ends_the_hunting_of_a_servo(band: float):
    trace, expected = hunting(band).run(), servo_by_hand(band)
    arrests = trace.contact("pad").transitions.t
    assert arrests.tolist() == pytest.approx(expected, rel=1e-7, abs=1e-9)
    frozen = times(trace, "freeze")
    assert frozen == ([pytest.approx(expected[-1])] if band > 0.01 else [])
    assert len(expected) == (10 if band > 0.01 else 20)


def servo_by_hand(band: float) -> list[float]:
    """Return when the servo of `hunting` breaks away and stops."""
    t, y, found = 0.0, np.zeros(3), []
    while abs(1.0 - y[0]) >= band:
        e, pull = 1.0 - y[0], 20.0 * (1.0 - y[0]) + 40.0 * y[2]
        if abs(pull) <= 1.5:  # at rest the integral grows by e
            wait = (math.copysign(1.5, e) - pull) / (40.0 * e)
            t, y = t + wait, y + [0.0, 0.0, e * wait]
        if t > 20.0:
            break
        side = math.copysign(1.0, 20.0 * (1.0 - y[0]) + 40.0 * y[2])

        def flow(_: float, y: np.ndarray, side: float = side) -> list[float]:
            force = 20.0 * (1.0 - y[0]) + 40.0 * y[2] - 3.0 * y[1]
            return [y[1], force - side, 1.0 - y[0]]

        def stops(_: float, y: np.ndarray) -> float:
            return y[1]

        stops.terminal, stops.direction = True, -side
        found.append(t)
        done = solve_ivp(flow, (t, 20.0), y, events=stops, rtol=1e-12, atol=1e-14)
        t, y = done.t[-1], done.y[:, -1] * [1.0, 0.0, 1.0]
        if done.status == 0:
            break
        found.append(t)
    return found


def test_a_lift_is_eased_when_the_motor_carries_it_and_stops_above_its_floor():
    trace = lift().run()
    rise = 3.0 ** (1.0 / 3.0)  # 2 x'' = 4 (t - 5): x = (t - 5)^3 / 3 reaches 1 m
    v = rise**2
    assert times(trace, "ease") == pytest.approx([5.0], rel=1e-9)
    assert times(trace, "apply") == pytest.approx([5.0 + rise], rel=1e-9)
    assert times(trace, "arrest_up") == pytest.approx([5.0 + rise + v / 25.0], rel=1e-9)
    assert trace.body("cage").x[-1] == pytest.approx(1.0 + v**2 / 50.0, rel=1e-9)


def test_each_supervisor_can_be_proved_alone_and_in_its_system():
    pytest.importorskip("z3", reason="proofs need z3")
    assert not prove(LIGHT).refuted
    found = prove(thermostat().system, contact="heater").refuted
    assert [each.check for each in found] == ["livelock"]  # low > high is not excluded


@pytest.mark.matrix
def test_a_sweep_varies_a_system_with_supervisors():
    case = hot_brake()
    result = sweep(case.system, case.t_end, {"pad.mu": [0.3, 0.4]}, engine=FASTEST, rtol=1e-10)
    assert result.outcome.tolist() == ["ok", "ok"]
    alone = case.run()
    assert result.contact("pad").F[1] == alone.contact("pad").F[-1]
    assert np.isnan(result.contact("mode").F).all()


def test_an_input_that_reads_the_force_that_it_makes_is_refused():
    pad = Contact("pad", BRAKE, {"mu": 0.4, "v_0": 0.1}, inputs={"N": "30 + pad.F"})
    with pytest.raises(ParameterError, match=r"an input of pad reads pad\.F"):
        simulate(
            System("loop", bodies=(Body("disc", inertia=2.0, force="20"),), contacts=(pad,)), 1.0
        )


@pytest.mark.matrix
@pytest.mark.every(2)
@pytest.mark.parametrize("make", [hot_brake, thermostat])
def test_the_command_line_runs_checks_and_exports_supervisors(gms_fsm: CommandLine, make):
    for module in ("z3", "matplotlib"):
        pytest.importorskip(module, reason="check and figures need the extras")
    make().system.save("one.toml")
    assert gms_fsm("run", "one.toml", "--set", "run.t_end=2", "-o", "out").code == 0
    drawn = {each.name for each in Path("out").glob("overview*.svg")}
    assert drawn == ({"overview-pad.svg"} if make is hot_brake else set())
    assert gms_fsm("check", "one.toml").code in (0, 1)  # 1: something is refuted
    done = gms_fsm("export", "one.toml", "--to", "scxml", "-o", "out")
    assert "takes friction only, and one.toml has the supervisors" in done.err


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


@pytest.mark.matrix
def test_a_sweep_has_no_columns_for_a_motion_that_there_is_not():
    found = sweep(thermostat().system, 3.0, {"heater.low": [18.0, 19.0]}, engine=FASTEST)
    names = ["heater.low", "outcome", "message", "t", "T", "heater.state1", "transitions"]
    assert list(found.columns()) == names
    mixed = sweep(hunting().system, 1.0, {"calm.band": [0.01]}, engine=FASTEST).columns()
    assert {"pad.x", "pad.v", "pad.F"} <= mixed.keys()
    assert not {"calm.x", "calm.v", "calm.F"} & mixed.keys()


def test_why_shows_the_input_that_a_guard_reads_also_if_it_is_called_as_a_motion():
    session = Session(lift().system, 8.0)  # reads x
    session.until("x > 0.5")
    (apply,) = session.why("control 1")
    (clause,) = apply.clauses
    assert clause.left == session.here.bodies["cage"].x
    assert clause.margin == clause.left - 1.0


def test_why_says_which_event_an_edge_waits_for_and_sends():
    case = crossing()
    session = Session(case.system, case.t_end)
    session.goto(56.0)
    why = session.why("cycles 1")
    assert why[0].verdict == "count_one does not fire: it waits for the event red."
    assert "margin" not in str(why)
    assert "halt: amber -> red, sends red" in str(session.why("main 1"))


def test_names_without_an_owner_are_those_of_the_only_machine():
    session = Session(thermostat().system, 3.0)
    assert session.until("u < 0.5").t == pytest.approx(HEATING[0])
    with pytest.raises(ExpressionError, match=r"write pad\.F"):
        Session(hunting().system, 1.0).until("F > 1")


def test_an_event_is_sent_to_a_session():
    case = crossing()
    session = Session(case.system, 20.0)
    session.goto(3.0)
    session.poke({"red": 1.0})
    assert str(session.next_transition().fired) == "cycles 1: counting -> counting by count_one"


@pytest.mark.parametrize(("variables", "values"), [((), ""), (("z",), r" \(z = 0\)")])
def test_switching_without_end_shows_no_velocity(variables: tuple[str, ...], values: str) -> None:
    edges = (Transition("go", "a", "b", "v > 0.5"), Transition("back", "b", "a", "v > 0.4"))
    chart = Chart(
        "w", ("v",), variables, velocities=(), states=(State("a"), State("b")), transitions=edges
    )
    system = System("s", supervisors=(Supervisor("m", chart, inputs={"v": "t"}),))
    with pytest.raises(LivelockError, match=f"last by 'back' from b to a{values}: guard"):
        simulate(system, 1.0)


def test_a_flow_that_is_not_finite_is_not_called_a_velocity() -> None:
    states = (State("on", {"z": "log(u)"}),)
    chart = Chart("g", ("u",), ("z",), velocities=(), states=states)
    system = System("s", supervisors=(Supervisor("m", chart, inputs={"u": "t - 1"}),))
    with pytest.raises(
        NotFiniteError, match=r"the flow of z in state on, \[log\(u\)\], is not finite"
    ):
        simulate(system, 1.0)
