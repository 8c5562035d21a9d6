"""Where two states push back onto the surface between them, a run slides along it (Filippov).

A chart with the edges `below -> above` where p > q and `above -> below` where p < q switched
without end, and the run ended in a livelock error; written with sgn(p - q) it was exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    FrictionState,
    Prescribed,
    PulledSlider,
    State,
    System,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.charts.zoo.joints.end_stop import END_STOP
from gms_fsm.session.explain import explain
from gms_fsm.traces.failures import LivelockError, NotUniqueError
from tests.corpus import FALLING, relay
from tests.helpers import FASTEST

LEAVES = 1.0 / 0.3  # where one of the two no longer leads to q


def run(model: ChartModel, p: float | list[float] = -0.1, **options: Any) -> Trace:
    """Run a relay from below its surface."""
    options = {"engine": "ifelse"} | options
    options = {"initial": {"p": np.atleast_1d(p), "q": np.zeros(model.n)}} | options
    return simulate(model, Prescribed("0"), 5.0, **options)


def dry(switching: bool) -> Chart:
    """Return Coulomb friction: as two states, or as a sign."""
    if not switching:
        return Chart(
            "sign",
            inputs=("v",),
            parameters=("F_c",),
            states=(State("on", outputs={"F": "F_c * sgn(v)"}),),
        )
    return Chart(
        "two states",
        parameters=("F_c",),
        states=(State("fwd", outputs={"F": "F_c"}), State("bwd", outputs={"F": "-F_c"})),
        transitions=(
            Transition("go", "bwd", "fwd", guard="v > 0"),
            Transition("back", "fwd", "bwd", guard="v < 0"),
        ),
    )


# --------------------------------------------------------------------------- on the surface
def test_it_stays_on_the_surface_until_the_drift_exceeds_the_push() -> None:
    """Then p = 0.15 (t - t_1)^2; in between sigma is the drift, and nothing is switched."""
    trace = run(relay())
    (slide,) = trace.sliding
    assert slide.surface == "p - q (below, above) of element 1"
    start = (np.sqrt(1.0 + 0.6 * 0.1) - 1.0) / 0.3  # t + 0.15 t^2 = 0.1
    assert slide.t_start == pytest.approx(start, abs=1e-12)
    assert slide.t_end == pytest.approx(LEAVES, abs=1e-12)
    assert slide.sigma_start == pytest.approx(0.3 * start, abs=1e-12)
    assert slide.sigma_end == pytest.approx(1.0, abs=1e-12)
    assert trace.transitions.edge.tolist() == ["rise"]
    on, after = trace.rows.mode[:, 1] == 1, trace.t > LEAVES
    assert np.abs(trace.z[on, 0]).max() < 1e-15
    assert np.abs(trace.dz[on]).max() < 1e-15
    exact = 0.15 * (trace.t[after] - LEAVES) ** 2
    assert np.abs(trace.z[after, 0] - exact).max() < 1e-12
    assert {row[0] for row in trace.states[trace.t > start + 1e-9]} == {"above"}


def test_it_leaves_by_its_edge_where_the_other_state_was_entered_last() -> None:
    trace = run(relay(FALLING))
    log = trace.transitions
    assert log.edge.tolist() == ["rise", "fall"]
    assert log.t[1] == trace.sliding[0].t_end == pytest.approx(LEAVES, abs=1e-12)
    assert trace.z[-1, 0] == pytest.approx(-0.15 * (5.0 - LEAVES) ** 2, abs=1e-12)


@pytest.mark.parametrize("source", ["above", "below"])
def test_edges_of_both_states_leave_it(source: str) -> None:
    """From the state that was not entered last, its edge there is taken first."""
    off = Transition("switch_off", source, "off", guard="t > 2")
    trace = run(relay(more=[off]))
    there = [] if source == "above" else ["fall"]
    assert trace.transitions.edge.tolist() == ["rise", *there, "switch_off"]
    assert trace.sliding[0].t_end == pytest.approx(2.0, abs=1e-12)
    assert trace.transitions.t[1:] == pytest.approx(2.0, abs=1e-12)
    assert trace.z[-1, 0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    "guards",
    [("q < p", "q > p"), ("p - q > 0", "p < q"), ("p >= q", "p < q"), ("0 < p - q", "p - q <= 0")],
)
def test_however_the_guards_are_written(guards: tuple[str, str]) -> None:
    one, other = run(relay(FALLING), engine="ifelse"), run(relay(FALLING, guards), engine="ifelse")
    assert other.transitions.edge.tolist() == ["rise", "fall"]
    np.testing.assert_allclose(other.transitions.t, one.transitions.t, atol=1e-12)


def test_a_curved_surface_that_moves_is_followed() -> None:
    """p^2 + q^2 = 1 + 0.1 t, while p grows below and decays above."""
    bent = ("p * p + q * q > 1 + 0.1 * t", "p * p + q * q < 1 + 0.1 * t")
    trace = run(relay(("p", "-p"), bent), 0.5)
    (slide,) = trace.sliding
    start = slide.t_start  # p = 0.5 exp(t) until then
    assert 0.25 * np.exp(2.0 * start) == pytest.approx(1.0 + 0.1 * start, abs=1e-6)
    on = trace.rows.mode[:, 1] == 1
    assert trace.z[on, 0] == pytest.approx(np.sqrt(1.0 + 0.1 * trace.t[on]), abs=1e-6)


def test_it_is_the_motion_with_a_sign() -> None:
    rig = PulledSlider(1.0, 2.0, 0.1)
    two, one = (  # with one tolerance: the default follows from the forces at the start
        simulate(ChartModel(dry(kind), {"F_c": 1.0}), rig, 20.0, atol=1e-9)
        for kind in (True, False)
    )
    assert two.sliding[0].t_end == pytest.approx(one.sliding[0].t_end, abs=1e-12)
    assert two.rows.y[-1] == pytest.approx(one.rows.y[-1], abs=1e-12)
    on = two.rows.mode[:, 1] == 1
    assert two.F[on] == pytest.approx(2.0 * 0.1 * two.t[on], abs=1e-12)


def test_an_edge_taken_far_from_the_surface_does_not_lead_onto_it() -> None:
    """Started in the state of the other side: the flow has to reach the surface first."""
    trace = run(relay(), initial={"p": [-0.1], "q": [0.0], "states": ["above"]})
    assert trace.transitions.edge.tolist() == ["fall", "rise"]
    assert trace.sliding[0].t_start == pytest.approx((1.06**0.5 - 1.0) / 0.3, abs=1e-12)


# --------------------------------------------------------------------------- several, or none
def test_elements_that_do_not_bear_on_each_other_slide_at_once() -> None:
    trace = run(relay(FALLING, n=2), [-1.0, -0.5])
    first, second = sorted(trace.sliding, key=lambda each: str(each.surface))
    assert "element 1" in first.surface
    assert "element 2" in second.surface
    assert first.t_end == second.t_end == pytest.approx(LEAVES, abs=1e-12)
    assert trace.z[-1] == pytest.approx(-0.15 * (5.0 - LEAVES) ** 2, abs=1e-12)


def test_surfaces_that_bear_on_each_other_are_refused() -> None:
    """A block on a block: once both rest, either pad could hold the upper one."""
    system = System(
        "blocks",
        bodies=(
            Body("a", inertia=1.0, force="0.5", v="va", x="xa"),
            Body("b", inertia=1.0, force="0.1", v="vb", x="xb"),
        ),
        contacts=(
            Contact("floor", dry(True), {"F_c": 1.0}, v="va"),
            Contact("top", dry(True), {"F_c": 1.0}, v="vb - va"),
        ),
    )
    with pytest.raises(NotUniqueError) as caught:
        simulate(system, 8.0, initial={"va": 1.0, "vb": 1.0})
    error = caught.value
    assert error.t == error.trace.t[-1] == pytest.approx(5.0, abs=1e-9)  # both at -0.2 m/s^2
    assert "va (bwd, fwd) of element 1 of floor = 0 and " in error.reason
    assert "(bwd, fwd) of element 1 of top = 0 at once" in error.reason
    assert "not unique" in error.reason


def test_flows_that_do_not_push_back_are_crossed() -> None:
    trace = run(relay(("1", "0.5")))
    assert len(trace.sliding) == 0
    assert trace.transitions.edge.tolist() == ["rise"]
    assert trace.z[-1, 0] == pytest.approx(0.5 * 4.9, abs=1e-12)


def test_guards_that_hold_together_are_a_livelock() -> None:
    with pytest.raises(LivelockError, match=r"\(chattering\); separate the guards"):
        run(relay(guards=("p >= q", "p <= q")))


# --------------------------------------------------------------------------- where it is shown
def test_why_and_the_ribbon_name_both_states() -> None:
    trace = run(relay(n=2), [-0.1, -20.0])  # the other element does not get there
    name = "p - q (below, above) of element 1"
    row = int(np.flatnonzero(trace.t > 2.0)[0])
    assert trace.sigma(row) == {name: pytest.approx(0.3 * trace.t[row], abs=1e-12)}
    assert f"held on {name} = 0, σ = " in str(explain(trace, row=row, element=0))
    pytest.importorskip("matplotlib", reason="ribbons need the extra plots")
    from matplotlib.figure import Figure

    from plots.panels import ribbons

    ax = Figure().add_subplot()
    band = ribbons(ax, trace)[-1]
    assert band.get_label() == f"held on {name} = 0"
    low, high = sorted(ax.transData.inverted().transform(band.get_extents())[:, 1])
    assert 0.5 < low < 1.0 < high < 1.5  # the row of the first element, not of the second


# --------------------------------------------------------------------------- other loops
def follower() -> ChartModel:
    """Return z driven back to 0 by c; there F is the velocity itself."""
    chart = Chart(
        "follower",
        inputs=("v",),
        variables=("z",),
        parameters=("c",),
        states=(
            State("below", flow={"z": "v + c"}, outputs={"F": "-c"}),
            State("above", flow={"z": "v - c"}, outputs={"F": "c"}),
        ),
        transitions=(
            Transition("rise", "below", "above", guard="z > 0"),
            Transition("fall", "above", "below", guard="z < 0"),
        ),
    )
    return ChartModel(chart, {"c": 1.0})


@pytest.mark.parametrize("engine", sorted({"ifelse", FASTEST}))
def test_stepping_gives_the_same_bits_and_the_mean_force(engine: str) -> None:
    t = np.linspace(0.0, 6.0, 121)
    v = 1.5 * np.sin(t) + 0.3 * np.sin(7.0 * t)
    trace = simulate(follower(), Prescribed((t, v)), 6.0, engine="ifelse", t_eval=t)
    friction = FrictionState(follower(), engine=engine)
    forces, means, log = [friction.peek(v[0], v[0], 0.0)], [], []
    for j in range(1, len(t)):
        forces.append(friction.advance_to(v[j - 1], v[j], t[j]))
        means.append(friction.mean_force)
        log += [switch.t for switch in friction.switches]
    assert forces == trace.F.tolist()
    assert log == trace.transitions.t.tolist()
    on = trace.rows.mode[:, 1] == 1
    assert on.sum() > 20
    assert trace.F[on] == pytest.approx(v[on], abs=1e-14)
    (both,) = np.nonzero(on[:-1] & on[1:])
    assert np.array(means)[both] == pytest.approx((v[both] + v[both + 1]) / 2.0, abs=1e-14)


# --------------------------------------------------------------------------- what jumps away
@pytest.mark.parametrize("switching", [True, False], ids=["states", "sign"])
@pytest.mark.parametrize(
    "belt", [[(0, 0), (1, 0), (1, 0.5), (3, 0.5)], "0.25 * (1 + sgn(t - 1))"], ids=["table", "sgn"]
)
def test_a_belt_that_jumps_drags_the_mass_after_it(belt: Any, switching: bool) -> None:
    """The friction F_c = 1 N brings 1 kg to 0.5 m/s in half a second, not at once."""
    system = System(
        "belt",
        bodies=(Body("m", inertia=1.0, force="0"), Body("belt", velocity="vw", x="xw", v="vw")),
        contacts=(Contact("pad", dry(switching), {"F_c": 1.0}, v="v - vw"),),
        signals={"vw": belt},
    )
    trace = simulate(system, 3.0, engine="ifelse")
    ends = [(float(each.t_start), float(each.t_end)) for each in trace.sliding]
    assert np.array(ends) == pytest.approx(np.array([(0.0, 1.0), (1.5, 3.0)]), abs=1e-9)
    assert trace.body("m").x[-1] == pytest.approx(0.125 + 0.75, abs=1e-9)


@pytest.mark.parametrize("switching", [True, False], ids=["states", "sign"])
def test_an_impact_moves_a_mass_that_friction_held(switching: bool) -> None:
    """Of two equal masses with restitution 0.6 the struck one takes 0.8 of the speed."""
    system = System(
        "impact",
        bodies=(
            Body("a", inertia=1.0, force="0", v="va", x="xa"),
            Body("b", inertia=1.0, force="0", v="vb", x="xb"),
        ),
        contacts=(
            Contact("pad", dry(switching), {"F_c": 1.0}, v="vb"),
            Contact("stop", END_STOP, {"x_s": 0.5, "e": 0.6, "v_r": 1e-3}, v="va - vb"),
        ),
    )
    trace = simulate(system, 2.0, initial={"va": 1.0})
    assert trace.body("a").v[-1] == pytest.approx(0.2, abs=1e-12)
    assert trace.body("b").v[-1] == pytest.approx(0.0, abs=1e-15)
    assert trace.body("b").x[-1] == pytest.approx(0.32, abs=1e-12)  # v^2 / 2 a
    assert trace.sliding[-1].t_start == pytest.approx(1.3, abs=1e-9)
