"""Runs end at conditions, events come at given times, values late, and conditions last."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from gms_fsm import (
    Body,
    Chart,
    Contact,
    FrictionBank,
    FrictionState,
    PulledSlider,
    Sampled,
    State,
    Supervisor,
    System,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.charts import CHARTS, timetable
from gms_fsm.run.simulate import Moment
from gms_fsm.traces.failures import SimulationError
from tests.corpus import HEALS, OILED, switched
from tests.helpers import FASTEST, bits, pulled_mass, stick_slip
from tests.systems_cases import mass, pad

MODEL, RIG = stick_slip("signed"), PulledSlider(1.0, 2.0, 0.1)
END = 30.0
IDLE = Supervisor("idle", Chart("idle", (), velocities=(), states=(State("on"),)))


def begins_like(part: Trace, whole: Trace) -> None:
    """All rows but the last one of a run are the first rows of another, bit for bit."""
    count = len(part) - 1
    for name in ("t", "microstep", "y", "mode"):
        ours, theirs = getattr(part.rows, name), getattr(whole.rows, name)
        assert np.array_equal(ours[:count], theirs[:count]), name
    fired = len(part.transitions)
    assert repr(part.transitions.tolist()) == repr(whole.transitions[:fired].tolist())


# --------------------------------------------------------------------------- until
@pytest.mark.every(2)
@pytest.mark.parametrize("engine", [FASTEST, "machines"])
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("F > 1.1", lambda trace: trace.F - 1.1),
        ("v > 150 mm/s", lambda trace: trace.v - 0.15),
        ("friction.F + x > 1.2", lambda trace: trace.F + trace.x - 1.2),
        ("t >= 3.25", lambda trace: trace.t - 3.25),
    ],
)
def test_a_run_ends_where_a_condition_becomes_true(text: str, value: Any, engine: str) -> None:
    whole = simulate(MODEL, RIG, END)
    part = simulate(MODEL, RIG, END, until=text, engine=engine)
    begins_like(part, whole)
    margin = value(part)
    assert 0.0 <= margin[-1] < 1e-12
    assert (margin[:-1] <= 0.0).all()
    assert part.settings["t_end"] == part.t[-1]
    assert (part.model, part.contacts) == (whole.model, whole.contacts)


def test_a_run_ends_with_the_switch_that_a_condition_waits_for() -> None:
    whole = simulate(MODEL, RIG, END)
    part = simulate(MODEL, RIG, END, until="count(slip) == 4")
    begins_like(part, whole)
    assert (part.states[-1] == "slip").all()
    assert part.t[-1] == whole.transitions.t[3]
    assert len(part.transitions) == 4


def test_a_condition_that_is_true_at_the_start_must_first_become_false() -> None:
    trace = simulate(MODEL, RIG, END, until="v < 0.05")
    assert trace.t[-1] > 1.0
    assert 0.0 <= 0.05 - trace.v[-1] < 1e-12
    assert (trace.v > 0.05).any()
    assert (np.diff(trace.microstep) <= 1).all()


def test_a_condition_that_never_comes_true_changes_no_bit() -> None:
    whole = simulate(MODEL, RIG, END)
    part = simulate(MODEL, RIG, END, until="v > 100")
    assert bits(part) == bits(whole)


def test_the_requested_rows_end_with_the_run() -> None:
    times = np.arange(0.0, END, 0.5)
    part = simulate(MODEL, RIG, END, until="F > 1.1", t_eval=times)
    whole = simulate(MODEL, RIG, END, t_eval=times)
    end = simulate(MODEL, RIG, END, until="F > 1.1").t[-1]
    assert part.t.tolist() == times[times <= end].tolist()
    assert np.array_equal(part.F, whole.F[: len(part)])
    assert part.stops.t[-1] == end


def test_a_system_with_supervisors_ends_at_a_condition_on_one_of_them() -> None:
    system = switched()
    trace = simulate(system, 2.0, until="is_in(hand.done)", monitors="coverage")
    assert trace.t[-1] == OILED[-1]
    assert trace.supervisor("hand").states[-1, 0] == "done"
    assert {*trace.monitors} == {f"{name}: coverage" for name in ("pad", "hand", "seer")}
    begins_like(trace, simulate(system, 2.0))


def test_a_run_ends_behind_the_whole_instant_of_its_condition() -> None:
    chart = Chart(
        "two at once",
        inputs=("t",),
        velocities=(),
        states=(State("a"), State("b"), State("c")),
        transitions=(
            Transition("first", "a", "b", guard="t >= 1"),
            Transition("second", "b", "c", guard="t >= 1"),
        ),
    )
    system = System("two", supervisors=(Supervisor("m", chart),))
    trace = simulate(system, 2.0, until="t >= 1")
    assert trace.transitions.edge.tolist() == ["first", "second"]
    assert (trace.states[-1, 0], trace.microstep.tolist()[-3:]) == ("c", [0, 1, 2])
    assert trace.trust(again=True).warnings == ()


def test_the_state_of_a_contact_on_a_driven_body_ends_a_run() -> None:
    bodies = (
        Body("mass", inertia=1.0, x="xm", v="vm"),
        Body("belt", velocity="if(t < 1, 0, 0.2)", x="xb", v="vb"),
    )
    pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0}, v="vm - vb")
    system = System("belt", bodies=bodies, contacts=(pad,))
    assert simulate(system, 5.0, until="is_in(pad.backward)").t[-1] == 1.0
    assert simulate(system, 5.0, until="is_in(pad.stuck)").t[-1] == pytest.approx(1.2)


def test_a_run_that_fails_before_its_condition_keeps_its_own_rows() -> None:
    chart = Chart("grows", (), velocities=(), variables=("z",), states=(State("on", {"z": "z*z"}),))
    system = System("grows", supervisors=(Supervisor("s", chart),))
    with pytest.raises(SimulationError) as failed:
        simulate(system, 2.0, until="s.z < 0", initial={"z": [1.0]})
    trace = failed.value.trace
    assert trace.t[-1] == pytest.approx(1.0, abs=1e-3)
    assert trace.rows.mode.shape[1] == 1


def test_listeners_of_a_run_do_not_see_what_ends_it() -> None:
    seen: list[Moment] = []
    trace = simulate(MODEL, RIG, END, until="count(slip) == 4", progress=seen.append)
    last = seen[-1]
    assert (last.t, last.states) == (trace.t[-1], trace.states[-1].tolist())
    assert last.values["F"] == trace.F[-1]
    assert [each.edge for each in last.transitions()] == trace.transitions.edge.tolist()
    assert last.at(1.0).modes == [0, 0, 0, 0]


# --------------------------------------------------------------------------- events
def test_a_timetable_sends_its_events_at_their_times() -> None:
    log = simulate(switched(), 2.0).transitions
    assert log.t[log.contact == "hand"].tolist() == [*OILED]
    heard = log[(log.contact == "pad") & (log.edge == "oil")]
    assert heard.t.tolist() == [0.0, 1.0, OILED[3]]  # at 0.2 s it is still oiled


@pytest.mark.parametrize("engine", sorted({FASTEST, "ifelse"}))
def test_a_stepping_friction_hears_events_as_a_run_does(engine: str) -> None:
    times = np.union1d(np.linspace(0.0, 2.0, 401), OILED)
    speeds = 0.3 * np.sin(7 * times)
    system = switched()
    record = {"v": (times, speeds)}
    run = System(
        "run",
        bodies=system.bodies,
        contacts=system.contacts,
        supervisors=system.supervisors,
        signals=record,
    )
    expected = simulate(run, 2.0, t_eval=times).contact("pad")
    friction = FrictionState(system.contacts[0], engine=engine)
    switches = []
    for k, t in enumerate(times[:-1]):
        if t in OILED:
            friction.send("oil")
            friction = pickle.loads(pickle.dumps(friction))
        ahead = friction.peek(speeds[k], speeds[k + 1], times[k + 1] - t)
        force = friction.advance_to(speeds[k], speeds[k + 1], times[k + 1])
        if times[k] + (times[k + 1] - t) == times[k + 1]:
            assert ahead == force
        if times[k + 1] not in OILED:  # there the row of the run is that after the event
            assert force == expected.F[k + 1]
        switches += [(each.t, each.edge) for each in friction.switches]
    assert switches == [(each.t, each.edge) for each in expected.transitions]


def test_a_bank_sends_an_event_to_all_joints_that_wait_for_it() -> None:
    bank = FrictionBank([switched().contacts[0], MODEL, switched().contacts[0]])
    bank.send("oil")
    bank.advance([0.0] * 3, [0.1] * 3, 0.1)
    assert [states[0] for states in bank.states] == ["oiled", "stick", "oiled"]


@pytest.mark.parametrize("engine", sorted({FASTEST, "ifelse"}))
def test_nobody_misses_an_event_or_a_tick_while_others_go_first(engine: str) -> None:
    """They do after an impulse, and where a lock lets go."""

    def counter(event: str | None) -> Chart:
        count = Transition("count", "on", "on", "k >= 0", event=event, actions={"k": "k + 1"})
        return Chart("counter", (), ("k",), (), (State("on"),), (count,), velocities=())

    kick = Transition("kick", "on", "on", event="go", actions={"v": "v + 1"}, emit="kicked")
    kicked = Chart("kicked", ("v",), (), (), (State("on"),), (kick,), {"F": "0"})
    system = System(
        "kicked",
        bodies=(mass("m", 1.0), Body("belt", velocity="u", x="x_b", v="v_b")),
        contacts=(
            *(Contact(name, kicked, v="v_m") for name in ("one", "two")),
            pad("pad", "v_m - v_b", 1.0, 1.5),
        ),
        supervisors=(
            Supervisor("hand", timetable({"go": 0.7})),
            *(Supervisor(f"{name}s", counter(name)) for name in ("go", "kicked")),
            Supervisor("ticks", counter(None), period=0.25),
        ),
        signals={"u": ([0.0, 0.25, 0.25, 1.0], [0.0, 0.0, 0.05, 0.05])},
    )
    log = simulate(system, 0.9, engine=engine).transitions
    assert log.contact.tolist() == [
        *("ticks", "pad", "ticks", "pad", "ticks", "hand"),
        *("one", "pad", "two", "gos", "kickeds", "ticks"),
    ]
    assert (log.t[6:11] == 0.7).all()


@pytest.mark.parametrize("engine", sorted({FASTEST, "ifelse"}))
def test_one_impulse_after_another_waits_for_nobody(engine: str) -> None:
    """Also where another machine hears an event meanwhile, and then has no edge any more."""
    struck = Chart(
        "struck",
        inputs=("v", "c"),
        states=(State("free"), State("bounced"), State("slowed")),
        transitions=(
            Transition("bounce", "free", "bounced", "c > 0.5", actions={"v": "-0.5 * v"}),
            Transition("slow", "bounced", "slowed", "v < 0", actions={"v": "0.1 * v"}),
        ),
        outputs={"F": "0"},
    )
    calls = Transition("call", "off", "on", "t >= 1", emit="called")
    answers = Transition("answer", "off", "on", "w > 0", event="called")
    clock = Chart(
        "clock", ("t",), states=(State("off"), State("on")), transitions=(calls,), velocities=()
    )
    other = Chart(
        "other", ("w",), states=(State("off"), State("on")), transitions=(answers,), velocities=()
    )
    system = System(
        "struck twice",
        bodies=(mass("m", 1.0),),
        contacts=(Contact("hit", struck, v="v_m", inputs={"c": "is_in(clock.on)"}),),
        supervisors=(Supervisor("other", other, inputs={"w": "v_m"}), Supervisor("clock", clock)),
    )
    log = simulate(system, 3.0, initial={"v_m": 1.0}, engine=engine).transitions
    assert log.edge.tolist() == ["call", "bounce", "slow"]
    assert log.t.tolist() == [1.0, 1.0, 1.0]


def test_a_timetable_with_a_period_sends_at_its_ticks() -> None:
    hand = Supervisor("hand", timetable({"oil": 1.0}), period=0.3)
    log = simulate(System("by hand", supervisors=(hand,)), 3.0).transitions
    assert log.t.tolist() == [pytest.approx(1.2)]


@pytest.mark.parametrize("seed", range(6))
def test_a_guard_that_follows_time_alone_misses_no_crossing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b, c = rng.uniform(0.3, 1.0), rng.uniform(0.2, 0.6), rng.uniform(1.5, 4.0)
    level = 0.4 * (a + b)
    signal = f"{a!r} * sin(t) + {b!r} * sin({c!r} * t)"
    chart = Chart(
        "relay",
        inputs=("v",),
        velocities=(),
        states=(State("low"), State("high")),
        transitions=(
            Transition("rise", "low", "high", guard=f"v > {level!r}"),
            Transition("fall", "high", "low", guard=f"v < {-level!r}"),
        ),
    )
    system = System("relay", supervisors=(Supervisor("relay", chart),), signals={"v": signal})
    expected, high = [], False
    times = np.linspace(0.0, 100.0, 200_001)
    for t, v in zip(times, a * np.sin(times) + b * np.sin(c * times), strict=True):
        if (v < -level) if high else (v > level):
            high = not high
            expected.append(t)
    log = simulate(system, 100.0).transitions
    assert len(expected) > 10, f"seed {seed}"
    assert log.t == pytest.approx(expected, abs=1e-3), f"seed {seed}"


# --------------------------------------------------------------------------- late values
def test_a_delayed_value_is_the_one_of_so_many_ticks_before() -> None:
    late = Sampled(
        "late",
        period=0.1,
        updates={"n": "n + 1", "m": "10 * delay(n, 3) + delay(n, 1)", "w": "delay(y, 2)"},
        initial={"n": 7.0},
    )
    system = System("late", supervisors=(IDLE,), sampled=(late,), flow={"y": "1"})
    ticks = np.arange(12)
    trace = simulate(system, 1.15, t_eval=0.1 * ticks + 0.04)
    n = 8.0 + ticks
    before = [np.concatenate([[7.0] * k, n[:-k]]) for k in (1, 3)]
    assert trace.value("n").tolist() == n.tolist()
    assert trace.value("m").tolist() == (10 * before[1] + before[0]).tolist()
    assert trace.value("w") == pytest.approx(np.maximum(ticks - 2, 0) * 0.1, abs=1e-12)


def test_samplers_delay_the_same_value_and_begin_with_its_start() -> None:
    one = Sampled("one", period=0.1, updates={"u": "u + 1", "w": "delay(u, 1)"})
    two = Sampled("two", period=0.1, updates={"q": "delay(u, 2)"})
    system = System("late", supervisors=(IDLE,), sampled=(one, two))
    trace = simulate(system, 0.45, t_eval=0.1 * np.arange(5) + 0.04, initial={"u": 7.0})
    assert trace.value("w").tolist() == [7.0, 8.0, 9.0, 10.0, 11.0]
    assert trace.value("q").tolist() == [7.0, 7.0, 8.0, 9.0, 10.0]


# --------------------------------------------------------------------------- lasting conditions
def test_the_output_of_another_machine_lasts() -> None:
    other = Chart("wave", ("t",), velocities=(), states=(State("on", outputs={"o": "sin(t)"}),))
    chart = Chart(
        "waits",
        ("o",),
        velocities=(),
        states=(State("a"), State("b")),
        transitions=(Transition("go", "a", "b", guard="duration(o > 0.5) >= 1"),),
    )
    machines = Supervisor("wave", other), Supervisor("waits", chart, inputs={"o": "wave.o"})
    log = simulate(System("two", supervisors=machines), 5.0).transitions
    assert log.t.tolist() == [pytest.approx(math.pi / 6 + 1, abs=1e-8)]


@pytest.mark.parametrize("seed", range(4))
def test_a_condition_has_lasted_as_long_as_its_signal_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b, T = rng.uniform(0.5, 1.0), rng.uniform(2.0, 5.0), rng.uniform(0.15, 0.35)
    phase = rng.uniform(0.0, 6.0)

    def v(t: float) -> float:
        return math.sin(b * t + phase) + a * math.sin(2.7 * b * t)

    chart = Chart(
        "waits for rest",
        inputs=("v",),
        velocities=(),
        parameters=("T",),
        states=(State("moving"), State("resting")),
        transitions=(
            Transition("rests", "moving", "resting", guard="duration(abs(v) < 0.6) >= T"),
            Transition("moves", "resting", "moving", guard="abs(v) > 0.9"),
        ),
    )
    signal = f"sin({b!r} * t + {phase!r}) + {a!r} * sin(2.7 * {b!r} * t)"
    end = 20.0
    system = System("rest", supervisors=(Supervisor("s", chart, {"T": T}),), signals={"v": signal})
    log = simulate(system, end).transitions
    # The same by the crossings of |v| - 0.6 and |v| - 0.9 alone.
    grid = np.linspace(0.0, end, 40_001)
    speed = np.abs(np.array([v(t) for t in grid]))

    def crossings(level: float, *, rising: bool) -> list[float]:
        above = speed > level
        at = np.flatnonzero(above[1:] & ~above[:-1] if rising else ~above[1:] & above[:-1])
        return [brentq(lambda t: abs(v(t)) - level, grid[k], grid[k + 1]) for k in at]

    slow, fast, away = crossings(0.6, rising=False), crossings(0.6, rising=True), []
    away = crossings(0.9, rising=True)
    expected, now, moving = [], 0.0, True
    while now < end:
        if moving:
            begins = [now] * bool(abs(v(now)) < 0.6) + [t for t in slow if t > now]
            ends = [next((t for t in fast if t > begin), end) for begin in begins]
            rests = (t + T for t, stop in zip(begins, ends, strict=True) if t + T < stop)
            now = next(rests, end)
        else:
            now = next((t for t in away if t > now), end)
        moving = not moving
        expected += [now] * (now < end)
    assert len(expected) >= 2, f"seed {seed}"
    assert log.t == pytest.approx(expected, abs=2e-6), f"seed {seed}"


def test_a_condition_lasts_for_each_element_from_its_own_entry() -> None:
    log = simulate(HEALS, pulled_mass()[1], 0.4).transitions
    # v stays below 0.3 m/s: each element is held when its own time is over.
    healed = [(each.element, each.t) for each in log if each.edge == "heal"]
    assert healed == [(0, pytest.approx(0.1)), (1, pytest.approx(0.15))]


def test_charts_show_a_condition_that_lasts_as_it_is_written() -> None:
    assert HEALS.chart.guard_text("heal") == "duration(|v| < 0.3) >= T"
