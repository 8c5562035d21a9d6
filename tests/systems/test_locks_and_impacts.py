"""Locks take no momentum by accident, and every impulse is accounted for.

Contacts may lock the same motion: earlier ones carry the force, and the trace marks it. Closed
forms of impacts, rest, belts, gears and clutches are cases of `benchmarks/conformance`.
"""

import random
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm import (
    Body,
    Chart,
    Contact,
    LockError,
    Parameter,
    State,
    System,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.charts import CHARTS
from tests.corpus import ENGINES
from tests.systems_cases import clutched_bearings, mass, pad, pushed_against_a_stop, stop


def run(system: System, t_end: float, **how: Any) -> Trace:
    """Run it; that engines agree where contacts lock is in tests/laws."""
    return simulate(system, t_end, engine="ifelse", **how)


def edges(trace: Trace) -> list[tuple[str, str]]:
    return [(str(row.contact), str(row.edge)) for row in trace.transitions]


def kinetic(trace: Trace, masses: Mapping[str, float], row: int) -> float:
    return sum(0.5 * m * trace.body(name).v[row] ** 2 for name, m in masses.items())


# --------------------------------------------------------------------------- impacts


def test_by_steps_an_impact_elsewhere_disturbs_no_arrest() -> None:
    """A sled that friction has slowed down since the start has not jumped."""
    system = System(
        "a ball and a sled",
        bodies=(mass("ball", 1.0), mass("sled", 1.0)),
        contacts=(stop("wall", "v_ball", x_s=1.0), pad("pad", "v_sled", 1.0, 1.5)),
    )
    start = {"v_ball": 1.0, "v_sled": 1.005, "pad.states": ["forward"]}
    trace = run(system, 2.0, initial=start, events="step", method="rk4", step=0.01)
    assert edges(trace) == [("wall", "bounce"), ("pad", "arrest_forward")]
    assert trace.transitions.t == pytest.approx([1.0, 1.01], abs=1e-12)


@pytest.mark.parametrize("kind", ["karnopp", "modelica", "stiction"])
def test_an_impact_turns_every_stiction_of_the_zoo_round(kind: str) -> None:
    entry = CHARTS[kind]
    values = {
        "karnopp": {"F_c": 0.1, "F_s": 0.2, "sigma_2": 0.0, "D": 1e-4},
        "modelica": {
            "mu_c": 0.1,
            "mu_s": 0.2,
            "v_s": 1e-3,
            "delta": 2.0,
            "peak": 1.0,
            "sigma_2": 0.0,
        },
        "stiction": {"F_c": 0.1, "F_s": 0.2, "b": 0.0},
    }[kind]
    inputs = {"N": "1"} if kind == "modelica" else {}
    friction = Contact("pad", entry, values, v="v_a", inputs=inputs)
    system = System("turned", bodies=[mass("a", 1.0)], contacts=[stop("stop", "v_a"), friction])
    trace = run(system, 1.0, initial={"v_a": 1.0, "pad.states": ["forward"]})
    assert edges(trace)[:2] == [("stop", "bounce"), ("pad", "reverse_forward")]
    v = np.sqrt(1.0 - 2 * 0.1 * 0.5)
    t = float(trace.transitions.t[0])
    assert trace.body("a").v[-1] == pytest.approx(-0.6 * v + 0.1 * (1.0 - t), abs=1e-7)


OLD = Chart(
    "no way back",
    (),
    parameters=("F_c",),
    states=(State("forward", outputs={"F": "F_c"}), State("stuck", locked=True)),
    transitions=(
        Transition("arrest", "forward", "stuck", "v < 0"),
        Transition("release", "stuck", "forward", "F > F_c"),
    ),
)


def test_an_arrest_that_would_take_an_impact_is_refused() -> None:
    contacts = [stop("stop", "v_a"), Contact("pad", OLD, {"F_c": 0.1}, v="v_a")]
    system = System("refused", bodies=[mass("a", 1.0)], contacts=contacts)
    with pytest.raises(LockError) as caught:
        run(system, 3.0, initial={"v_a": 1.0})
    assert caught.value.place == "contact 'pad', edge 'arrest'"
    assert caught.value.t == pytest.approx(0.5132, abs=1e-4)
    assert "impulse=True" in caught.value.advice
    assert [str(each) for each in caught.value.trace.transitions.edge] == ["bounce"]


def test_a_lock_that_is_moved_and_has_no_way_out_is_refused() -> None:
    """It lets go of a large F > 0 only, and is struck the other way."""
    contacts = [stop("stop", "v_b - v_a", x_s=0.5), Contact("pad", OLD, {"F_c": 0.1}, v="v_a")]
    system = System("refused", bodies=[mass("a", 1.0), mass("b", 1.0)], contacts=contacts)
    start = {"v_b": 1.0, "pad.states": ["stuck"]}
    assert simulate(system, 3.0, initial=start).transitions.edge[1] == "release"
    backward = System(
        "refused", bodies=system.bodies, contacts=[stop("stop", "v_a - v_b"), contacts[1]]
    )
    trace = simulate(backward, 3.0, initial={**start, "v_b": -1.0})
    assert [str(each) for each in trace.transitions.edge] == ["bounce"], "it carries the impulse"
    assert trace.body("b").v[-1] == pytest.approx(0.6)


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(
    m=st.lists(st.floats(0.1, 10.0), min_size=3, max_size=3),
    v=st.lists(st.integers(-2000, 2000).map(lambda u: u / 1000), min_size=3, max_size=3),
    ratio=st.floats(-3.0, 3.0).filter(lambda r: abs(r) > 0.1),
    e=st.floats(0.0, 0.9),
    F_s=st.floats(1e-6, 1e3),
)
def test_momentum_and_energy_of_every_impulse_are_accounted_for(
    m: list[float], v: list[float], ratio: float, e: float, F_s: float
) -> None:
    names = ["a", "b", "c"]
    contacts = [
        stop("hit", "v_a - v_b", x_s=0.05, e=e),
        pad("pad", "v_b", min(F_s, 0.5), F_s),
        Contact("gear", CHARTS["dog-clutch"], {"t_on": 0.05, "t_off": 0.5}, v="v_b - r * v_c"),
    ]
    bodies = [mass(name, each) for name, each in zip(names, m, strict=True)]
    system = System("audit", bodies=bodies, contacts=contacts, numbers={"r": ratio})
    start = dict(zip(("v_a", "v_b", "v_c"), v, strict=True))
    if v[1] != 0.0:
        start["pad.states"] = ["forward" if v[1] > 0.0 else "backward"]
    trace = run(system, 0.4, initial=start)
    rows: dict[str, dict[str, float]] = {
        "hit": {"a": 1.0, "b": -1.0}, "pad": {"b": 1.0}, "gear": {"b": 1.0, "c": -ratio},
    }  # fmt: skip
    masses = dict(zip(names, m, strict=True))
    for t, step in {(each.t, each.microstep) for each in trace.impulses}:
        here = [each for each in trace.impulses if (each.t, each.microstep) == (t, step)]
        (row,) = np.flatnonzero((trace.t == t) & (trace.microstep == step))
        scale = max(abs(each) for each in v) * max(m)
        for name in names:
            taken = sum(rows[each.carrier].get(name, 0.0) * each.P for each in here)
            change = masses[name] * (trace.body(name).v[row] - trace.body(name).v[row - 1])
            assert change == pytest.approx(-taken, abs=1e-12 * scale)
        lost = kinetic(trace, masses, row - 1) - kinetic(trace, masses, row)
        assert lost == pytest.approx(sum(each.energy for each in here), abs=1e-11 * scale)
        assert lost >= -1e-12 * scale
        assert not any(each.carrier == "pad" for each in here), "stiction carries no impulse"
    of_gear = [each for each in trace.impulses if "gear" in (each.contact, each.carrier)]
    assert trace.contact("gear").impulses.tolist() == [each.tolist() for each in of_gear]


def test_a_stuck_pad_beside_a_wall_carries_nothing_of_what_the_wall_takes() -> None:
    for order in (1, -1):
        locked = [stop("wall", "v_b", x_s=0.0), pad("pad", "v_b", 1.0, 2.0)][::order]
        bodies = [mass("a", 1.0), mass("b", 1.0, "0.5")]
        system = System("beside", bodies=bodies, contacts=[stop("hit", "v_a - v_b"), *locked])
        start = {"v_a": 1.0, "wall.states": ["rest"], "pad.states": ["stuck"]}
        trace = run(system, 0.6, initial=start)
        found = {str(each.carrier): float(each.P) for each in trace.impulses}
        assert found == {"hit": pytest.approx(1.6), "wall": pytest.approx(1.6)}


LATCH = Chart(
    "latch",
    variables=("wear",),
    parameters=("rate", "most"),
    states=(State("closed", {"wear": "rate"}, locked=True), State("open", outputs={"F": "0"})),
    transitions=(Transition("gives", "closed", "open", guard="wear > most and F > 1"),),
)


@pytest.mark.parametrize(
    "engine", [pytest.param(e, marks=pytest.mark.slow) if e == "compiled" else e for e in ENGINES]
)
def test_a_lock_lets_go_of_an_impulse_by_what_its_element_has_seen(engine: str) -> None:
    latch = Contact("latch", LATCH, {"rate": 1.0, "most": 1.0}, v="v_b")
    hit = stop("hit", "v_a - v_b")
    system = System("door", bodies=[mass("a", 1.0), mass("b", 1.0)], contacts=[latch, hit])
    for speed, gives in ((1.0, False), (0.25, True)):  # struck after 0.5 s, or after 2 s
        trace = simulate(system, 3.0, initial={"v_a": speed}, engine=engine)
        assert (("latch", "gives") in edges(trace)) == gives
        assert (trace.body("b").v[-1] > 0) == gives


HIT = Chart(
    "hit",
    inputs=("x", "v"),
    variables=("old", "new", "twice"),
    parameters=(Parameter("e", rule=">= 0"), Parameter("x_s", "m", "> 0")),
    let={"w": "2 * v"},
    states=(State("free", outputs={"F": "0"}),),
    transitions=(
        Transition(
            "bounce",
            "free",
            "free",
            guard="x >= x_s and v > 0",
            actions={"old": "v", "v": "-e * v", "new": "v", "twice": "w"},
        ),
    ),
)


@pytest.mark.parametrize(
    "engine", [pytest.param(e, marks=pytest.mark.slow) if e == "compiled" else e for e in ENGINES]
)
def test_an_action_after_an_impulse_reads_the_new_velocity(engine: str) -> None:
    system = System(
        "two masses",
        bodies=[mass("a", 2.0), mass("b", 3.0)],
        contacts=(Contact("stop", HIT, {"e": 0.5, "x_s": 1.0}, v="v_a - v_b"),),
    )
    trace = simulate(system, 2.0, initial={"v_a": 1.0}, engine=engine)
    stop = trace.contact("stop")
    found = [float(stop.variable(name)[-1, 0]) for name in HIT.variables]
    assert found == pytest.approx([1.0, -0.5, -1.0], abs=1e-15)
    momentum = 2.0 * trace.body("a").v[-1] + 3.0 * trace.body("b").v[-1]
    assert momentum == pytest.approx(2.0, abs=1e-15)


# --------------------------------------------------------------------------- rest


def test_two_gears_on_the_same_bodies_hold_them_exactly_at_zero() -> None:
    two = System(
        "two",
        bodies=[mass("a", 0.4, "-20 * x_a"), mass("b", 4.77, "sin(t)")],
        contacts=[pad("p", "v_b - 3 * v_a", 4.0, 5.0), pad("q", "v_b - v_a", 4.0, 5.0)],
    )
    trace = run(two, 10.0)
    assert len(trace.t) < 100
    assert not trace.rows.y.any(), "nothing has moved, not even by rounding"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_a_tree_of_locked_bodies_moves_as_one_whatever_the_order_of_its_contacts(seed: int) -> None:
    """Each contact pulls all that hangs on it; the velocities are equal to the last bit."""
    n, m = 11, 0.5
    weld = Chart("weld", states=(State("held", locked=True),))
    contacts = [Contact(f"c{i}", weld, v=f"v{i} - v{(i - 1) // 2}") for i in range(1, n)]
    random.Random(seed).shuffle(contacts)
    system = System(
        "tree",
        bodies=[
            Body(f"b{i}", inertia=m, force="0" if i else "sin(t)", x=f"x{i}", v=f"v{i}")
            for i in range(n)
        ],
        contacts=contacts,
    )
    trace = simulate(system, 5.0, rtol=1e-10, engine="ifelse")
    hanging = [1.0] * n
    for i in reversed(range(1, n)):
        hanging[(i - 1) // 2] += hanging[i]
    for i in range(1, n):
        assert trace.body(f"b{i}").v.tolist() == trace.body("b0").v.tolist()
        pull = -hanging[i] / n * np.sin(trace.t)
        np.testing.assert_allclose(trace.contact(f"c{i}").F, pull, rtol=0, atol=1e-14)
    v = (1.0 - np.cos(trace.t)) / (n * m)
    np.testing.assert_allclose(trace.body("b0").v, v, rtol=0, atol=1e-9)


@pytest.mark.parametrize("first", ["belt", "ground"])
def test_locks_that_contradict_each_other_are_no_scale_and_let_go(first: str) -> None:
    """A body sticks to a belt that starts to move, and to the ground: it follows the belt."""
    contacts = {
        "belt": pad("belt", "v_a - v_w", 0.5, 0.7),
        "ground": pad("ground", "v_a", 0.2, 0.3),
    }
    order = [contacts[first], *(each for name, each in contacts.items() if name != first)]
    bodies = [Body("w", velocity="0.1 * sin(t)", x="x_w", v="v_w"), mass("a", 1.0)]
    trace = run(System("both at once", bodies=bodies, contacts=order), 2.0)
    assert trace.body("a").v[-1] == pytest.approx(0.1 * np.sin(2.0), abs=1e-9)
    assert trace.contact("belt").states[-1, 0] == "stuck"
    assert trace.contact("ground").states[-1, 0] == "forward"


# --------------------------------------------------------------------------- locks that share
def shared(trace: Trace, contact: str) -> np.ndarray:
    """Return where the force of a locked contact is carried by earlier ones."""
    found: np.ndarray = trace.contact(contact).shared
    return found


def states(trace: Trace, contact: str) -> np.ndarray:
    found: np.ndarray = trace.contact(contact).states[:, 0]
    return found


@pytest.mark.parametrize("stop_first", [False, True])
def test_a_mass_with_stiction_comes_to_rest_at_a_stop_and_leaves_again(stop_first: bool) -> None:
    trace = pushed_against_a_stop(stop_first=stop_first).run("ifelse")
    stop, log = trace.contact("stop"), trace.transitions
    rest = states(trace, "stop") == "rest"
    assert rest.any()
    np.testing.assert_array_equal(trace.body("mass").v[rest], 0.0)
    push = 4.0 * np.sin(0.5 * trace.t)
    np.testing.assert_allclose((stop.F + trace.contact("pad").F)[rest], push[rest], atol=1e-9)
    assert [str(each) for each in log.edge[log.contact == "stop"]][-1] == "lift"
    assert trace.body("mass").x[-1] < 0.2
    assert {"release_forward", "release_backward"} <= {str(each) for each in log.edge}


def test_two_bearings_and_a_clutch_let_go_one_after_the_other() -> None:
    """The first bearing carries all, up to its stiction; then the second carries the rest."""
    trace = clutched_bearings().run("ifelse")
    log, R = trace.transitions, 0.5
    assert [(str(row.contact), str(row.edge)) for row in log] == [
        ("dog", "engage"),
        ("bearing_a", "release_forward"),
        ("bearing_b", "release_forward"),
    ]
    np.testing.assert_allclose(log.t, [1.0, 1.5 / R, (1.0 + 3.0) / R], rtol=0, atol=1e-9)
    both = (trace.t > 1.0) & (trace.t < log.t[1])
    assert both.any()
    np.testing.assert_array_equal(shared(trace, "bearing_b")[both], True)
    np.testing.assert_array_equal(trace.contact("bearing_b").F[both], 0.0)
    np.testing.assert_allclose(trace.contact("bearing_a").F[both], R * trace.t[both], atol=1e-12)
    for earlier in ("bearing_a", "dog"):
        np.testing.assert_array_equal(shared(trace, earlier), False)
    later = trace.t > log.t[1]
    np.testing.assert_array_equal(shared(trace, "bearing_b")[later], False)
    moving = trace.t > log.t[2]
    np.testing.assert_array_equal(trace.body("a").v[moving], trace.body("b").v[moving])
    assert trace.body("b").v[-1] > 0.0


# --------------------------------------------------------------------------- velocities that jump
def on_a_belt(velocity: str) -> System:
    """Return a cart of 1 kg that stiction of 2 N holds on a belt."""
    dry = {"F_c": 1.0, "F_s": 2.0, "b": 0.0}
    bodies = Body("cart", inertia=1.0), Body("belt", velocity=velocity, x="x_b", v="v_b")
    pads = (Contact("pad", CHARTS["stiction"], dry, v="v - v_b"),)
    return System("belt", bodies=bodies, contacts=pads)


@pytest.mark.parametrize("off", [0.0, 1e-10])
def test_a_belt_that_turns_at_once_leaves_what_it_carries_behind(off: float) -> None:
    """The cart then slides for a second: 1 N on 1 kg, 1 m/s between both. At the start it rests.

    Also where it does so but for rounding.
    """
    belt = on_a_belt("0.5 * sgn(cos(2*t))")
    found = run(belt, 3.9, initial={"v": 0.5 + off}, atol=1e-9).transitions
    names = ["release_forward", "arrest_forward", "release_backward", "arrest_backward"]
    assert found.edge.tolist() == names
    times = np.array([0.25, 0.25, 0.75, 0.75]) * np.pi + [0.0, 1.0, 0.0, 1.0]
    np.testing.assert_allclose(found.t, times, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("velocity", ["max(0, t - 1)", "max(0, sin(t - 101))"])
def test_a_belt_that_starts_gently_takes_along_what_it_carries(velocity: str) -> None:
    """It needs 1 N; where the start is located, a few clock ticks late, the belt moves already."""
    trace = run(on_a_belt(velocity), 1.5)
    assert len(trace.transitions) == 0
    np.testing.assert_allclose(trace.body("cart").v, trace.body("belt").v, atol=1e-14)
    assert trace.body("cart").v[-1] > 0.4
