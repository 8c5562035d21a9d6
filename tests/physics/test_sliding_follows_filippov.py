"""Where both sides push back onto a surface, a run slides along it, with the sigma that holds it.

The surface is v = 0 of a sign, of an element that slips and cannot arrest, or what lies between two
states of a chart. sgn(v) once chattered there, two states switched without end, and the run ended
in a livelock error.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import RK45, Radau

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    FrictionState,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    System,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.charts.zoo.joints.end_stop import END_STOP
from gms_fsm.session.explain import explain
from gms_fsm.traces.failures import LivelockError, NotUniqueError
from integrators.sliding import solve
from tests import older_files
from tests.corpus import (
    BESIDE,
    FALLING,
    HELD,
    PUSHED,
    Belt,
    coulomb,
    dry,
    relay,
    runs_down,
    side_by_side,
)
from tests.helpers import FASTEST, one_element, same_bits
from tests.physics.test_hard_random_runs import (
    guards_say_so,
    nothing_is_overdue,
    rows_and_log_agree,
)

LEAVES = 1.0 / 0.3  # where one of the two flows of a relay no longer leads to q
MEETS = (1.06**0.5 - 1.0) / 0.3  # t + 0.15 t^2 = 0.1


def run(p: float | list[float] = -0.1, model: ChartModel | None = None, **options: Any) -> Trace:
    """Run a relay from below its surface."""
    model = model or relay()
    initial = {"p": np.atleast_1d(p), "q": np.zeros(model.n)}
    options = {"engine": "ifelse", "initial": initial} | options
    return simulate(model, Prescribed("0"), 5.0, **options)


def on_surface(trace: Trace) -> np.ndarray:
    """Return the rows on a surface."""
    return np.asarray(trace.rows.mode[:, trace.n :].any(axis=1))


# --------------------------------------------------------------------------- a sign, exactly
SWINGS = {"v": 0.1 * (1.0 - np.cos(2.0**0.5 * 3.0)), "F": 1.0}
NOT_LINEAR = "F_c * (sgn(v) + 0.6 * sgn(v) * sgn(v)) / 1.6"
PULLED_SLOWLY = PulledSlider(1.0, 2.0, 0.1)
FORCE = Slider(1.0, "0.5")
RK4 = {"method": "rk4", "step": 0.0173}
# Model, rig, end, v at the start; first interval of sliding, and what is true at the end. F is 1 or
# -1/4 in the one that is not linear: its sigma is (2 F_a - 3/4) / (5/4).
EXACT: dict[str, tuple[Any, ...]] = {
    "waits for its spring": (coulomb(), PULLED_SLOWLY, 8.0, 0.0, (0.0, 5.0), SWINGS),
    "waits, fixed steps": (coulomb(), PULLED_SLOWLY, 8.0, 0.0, (0.0, 5.0), SWINGS, RK4),
    "comes to rest": (coulomb(), Slider(1.0, "0"), 5.0, 2.0, (2.0, 5.0), {"x": 2, "v": 0, "F": 0}),
    "is pushed back": (coulomb(), Slider(1.0, "-3"), 3.0, 1.0, None, {"v": -5.5}),
    "a corner beside": (
        coulomb("max(v, 0) + F_c * sgn(v)"), FORCE, 5.0, 1.0, (np.log(3), 5.0), {"v": 0, "F": 0.5},
    ),
    "a corner on the other side": (
        coulomb("min(0, v) + F_c * sgn(v)"), FORCE, 5.0, 1.0, (2.0, 5.0), {"v": 0, "F": 0.5},
    ),
    "a corner on both": (
        coulomb("F_c * sgn(v) + 0.3 * abs(v)"), FORCE, 5.0, 1.0, (np.log(1.6) / 0.3, 5.0),
        {"v": 0, "F": 0.5},
    ),
    "not linear": (coulomb(NOT_LINEAR), FORCE, 3.0, 0.0, (0.0, 3.0), {"F": 0.5, "sigma": 0.2}),
}  # fmt: skip


@pytest.mark.parametrize("name", EXACT)
def test_coulomb_friction_is_exact(name: str) -> None:
    model, rig, t_end, v, slides, wanted, *how = EXACT[name]
    trace = simulate(model, rig, t_end, initial={"v": v}, **(how[0] if how else {}))
    if slides is None:
        assert len(trace.sliding) == 0
    else:
        first = trace.sliding[0]
        assert (first.t_start, first.t_end) == pytest.approx(slides, abs=1e-6)
        assert first.surface == "v"
        on = on_surface(trace)
        assert np.ptp(trace.v[on]) == 0.0
        if rig is PULLED_SLOWLY:
            assert np.abs(trace.F[on] - 2.0 * 0.1 * trace.t[on]).max() < 1e-12
            assert (first.sigma_start, first.sigma_end) == (0.0, pytest.approx(1.0, abs=1e-9))
    found = {"x": trace.x[-1], "v": trace.v[-1], "F": trace.F[-1]}
    found["sigma"] = trace.sliding[-1].sigma_end if slides else 0.0
    assert {key: found[key] for key in wanted} == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize(
    ("w", "place"), [("0.1", lambda t: 0.1 * t), ("0.1 * cos(t)", lambda t: 0.1 * np.sin(t))]
)
def test_a_mass_rides_on_a_belt_along_a_surface_that_moves(w: str, place: Any) -> None:
    """In a text of the rig; the sign's argument depends on a signal."""
    trace = simulate(coulomb("0 * F_c"), Belt(w), 1.2, engine="ifelse", initial={"v": 0.1})
    assert trace.sliding[0].surface == "v - w"
    on = on_surface(trace)
    assert on.sum() >= 5
    assert np.abs(trace.x[on] - place(trace.t[on])).max() < 1e-7


@pytest.mark.slow
def test_elements_come_to_rest_on_their_own_surfaces() -> None:
    """dz = -C sgn(z) reaches 0 in a finite time, each by itself; twenty of them at once."""
    still = Slider(1e9, "0")
    start = {"z": [1.0, 1.0, -1.0, 1.0]}
    trace = simulate(runs_down([1.0, 2.0, 2.0, 0.1]), still, 2.0, engine="ifelse", initial=start)
    names = {str(r.surface): float(r.t_start) for r in trace.sliding}
    wanted = {"z of element 1": 1.0, "z of element 2": 0.5, "z of element 3": 0.5}
    assert names == pytest.approx(wanted, abs=1e-6)
    assert trace.z[-1] == pytest.approx([0.0, 0.0, 0.0, 0.8], abs=1e-6)
    many = simulate(runs_down(np.linspace(1.0, 2.0, 20)), still, 2.0, initial={"z": [1.0] * 20})
    assert len(many.sliding) == 20
    assert (many.z[-1] == 0.0).all()


@pytest.mark.parametrize("guard", ["v >= 0 and z > 4", "abs(v) <= 0 and z > 4", "v <= 0 and z > 4"])
def test_guards_that_compare_with_the_surface_are_evaluated_on_it(guard: str) -> None:
    """A rounding error off it another comparison keeps them false; they were not evaluated."""
    chart = Chart(
        "waits",
        inputs=("v",),
        variables=("z",),
        parameters=("F_c",),
        states=(State("a", flow={"z": "1"}), State("b", flow={"z": "1"})),
        transitions=(Transition("go", "a", "b", guard=guard),),
        outputs={"F": "F_c * sgn(v)"},
    )
    model = ChartModel(chart, {"F_c": 1.0})
    for v in (2.0, 1.7, -1.7, 0.3):
        trace = simulate(model, Slider(1.0, "0"), 8.0, engine="ifelse", initial={"v": v})
        assert trace.transitions.t.tolist() == [pytest.approx(4.0, abs=1e-9)]


@pytest.mark.slow
def test_the_force_next_to_sliding_is_that_of_the_arc() -> None:
    """Not that of the sign evaluated on the surface: no dip of F_c on either side."""
    for v in np.linspace(0.31, 2.9, 15):
        trace = simulate(coulomb(), Slider(1.0, [(0, 0), (4, 0), (5, 3)]), 6.0, initial={"v": v})
        (slide,) = trace.sliding
        assert (trace.F[trace.t <= slide.t_start - 1e-12] == 1.0).all()
        first, last = np.flatnonzero(on_surface(trace))[[0, -1]]
        assert trace.F[first - 1] == 1.0
        assert trace.F[last] == pytest.approx(1.0, abs=1e-9)
        assert (trace.F[last + 1 :] == 1.0).all()


# --------------------------------------------------------------------------- the bank
def test_a_slipping_element_holds_v_at_zero_until_it_arrests() -> None:
    """Times from an independent hybrid loop around DOP853."""
    trace = simulate(HELD, PUSHED, 4.0, engine=FASTEST)
    assert len(trace.transitions) == 14
    (slide,) = trace.sliding
    assert slide.surface == "v"
    assert (slide.t_start, slide.t_end) == pytest.approx((0.33227853, 0.33237728), abs=5e-7)
    assert slide.t_end in trace.transitions.t[trace.transitions.edge == "arrest"]
    on = (trace.microstep == 0) & on_surface(trace)
    assert (trace.v[on] == 0.0).all()
    assert np.abs(trace.F[on] - 2.9 * np.sin(4.7 * trace.t[on])).max() < 1e-12
    # sigma at the end is that before the firing, and before a jump of the load.
    row = int(np.flatnonzero(on)[-1])
    assert slide.sigma_end == trace.sigma(row)["v"] < 1.0
    jump = simulate(coulomb(), Slider(1.0, ([0, 1, 1, 3.0], [0.5, 0.5, 2.0, 2.0])), 3.0)
    assert jump.sliding.sigma_end[0] == pytest.approx(0.5, abs=1e-12)


def test_older_files_without_flags_of_surfaces_have_no_sliding(tmp_path: Any) -> None:
    trace = simulate(HELD, PUSHED, 0.3, engine="ifelse")
    assert len(trace.sliding) == 0
    arrays = older_files.format_1(trace, tmp_path / "a.npz")
    for kind in ("rows_mode", "stops_mode"):
        arrays[kind] = arrays[kind][:, :3]
    same_bits(trace, Trace.load(older_files.write(tmp_path / "old.npz", arrays)))


@pytest.mark.slow
def test_requested_times_and_samples_lie_on_the_surface() -> None:
    whole = simulate(HELD, PUSHED, 0.4, engine="ifelse")
    slide = whole.sliding[0]
    times = np.linspace(slide.t_start, slide.t_end, 7)[1:-1]
    wanted = simulate(HELD, PUSHED, 0.4, engine="ifelse", t_eval=times)
    for trace in (wanted, whole.sample(times)):
        assert (trace.v == 0.0).all()
        assert np.abs(trace.F - 2.9 * np.sin(4.7 * times)).max() < 1e-12
    assert wanted.sliding.tolist() == whole.sliding.tolist()
    assert len(simulate(HELD, PUSHED, 0.4, engine="ifelse", output="end").sliding) == 0
    fine = simulate(HELD, PUSHED, 0.4, engine="ifelse", rtol=1e-10)
    for name in ("t_start", "t_end", "sigma_start", "sigma_end"):
        assert whole.sliding[name][0] == pytest.approx(fine.sliding[name][0], rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("method", [RK45, Radau])
def test_scipy_solvers_slide_too(method: Any) -> None:
    trace = simulate(HELD, PUSHED, 0.4, method=method)
    assert trace.sliding.t_start[0] == pytest.approx(0.3322785, abs=3e-6)
    assert len(trace.transitions) == 4


# An element in slip with z <= -s cannot arrest; its force pushes v back to zero from both sides. At
# v = 0 the force is the applied one, so sigma dz/dt = F_a - k z: z tends to F_a / k like
# exp(-k t / sigma), and the sign is replaced by sigma = (dz/dt) / (C (1 - z / s)).
LASTING = one_element("published", C=0.1, sigma=5.0)
F_A = -2.4  # between the forces on both sides of v = 0
BEYOND = {"z": [-2.5], "states": ["slip"], "v": 0.05}


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"method": "bs23"}, {"method": "rk4", "step": 1e-2}])
def test_lasting_sliding_follows_its_closed_form(options: dict[str, Any]) -> None:
    """It reaches v = 0 after 38 ms and never leaves: |z| stays above s."""
    trace = simulate(LASTING, Slider(1.0, F_A), 20.0, initial=BEYOND, **options)
    (slide,) = trace.sliding
    assert (slide.t_start, slide.t_end) == (pytest.approx(0.0380130, abs=1e-5), 20.0)
    on = on_surface(trace)
    t, z = trace.t[on], trace.z[on, 0]
    exact = F_A + (z[0] - F_A) * np.exp(-(t - t[0]) / 5.0)
    assert np.abs(z - exact).max() < 2e-6
    assert (trace.v[on] == 0.0).all()
    assert np.abs(trace.F[on] - F_A).max() < 1e-14
    sigma = (F_A - z) / 5.0 / (0.1 * (1 - z / 1.5))
    assert (slide.sigma_start, slide.sigma_end) == pytest.approx(sigma[[0, -1]], abs=1e-12)


def test_it_leaves_when_the_push_exceeds_a_side_and_arrests_below_the_threshold() -> None:
    trace = simulate(LASTING, Slider(1.0, f"{F_A} - 5*t"), 5.0, initial=BEYOND)
    (slide,) = trace.sliding
    assert slide.sigma_end == pytest.approx(-1.0, abs=1e-9)
    assert (trace.v[trace.t > slide.t_end] < 0.0).all()
    below = simulate(LASTING, Slider(1.0, -1.2), 5.0, initial=BEYOND | {"z": [-1.2]})
    assert (below.transitions.edge[0], below.t[-1]) == ("arrest", 5.0)


@pytest.mark.matrix
@pytest.mark.slow
def test_however_long_a_step_v_stays_on_the_surface() -> None:
    """Steps of Euler's method that are far too long for these stiff bristles.

    They end where no sign between -1 and 1 holds the mass at rest; what a guard reads inside such a
    step must still be on the surface.
    """
    parameters = GMSParameters(
        [17.3, 41.8, 4.16, 33.5],
        [0.292, 1.0, 0.18, 0.133],
        [0.416, 0.187, 0.279, 0.199],
        sigma_2=0.191,
        stribeck=Stribeck(0.154, 0.462, 0.035),
        v_c=1e-4,
        weights=[0.0492, 0.277, 0.0315, 0.0492],
    )
    model = GMS(parameters, law="published")
    for mass, step in ((0.1, 0.02), (0.1, 0.065), (0.1, 0.07), (0.452, 0.055), (0.452, 0.0629)):
        trace = simulate(model, Slider(mass, "9*cos(t)"), 6.0, method="euler", step=step)
        slides = trace.rows.mode[:, trace.n :].any(axis=1)
        assert slides.sum() > 10
        np.testing.assert_allclose(trace.v[slides], 0.0, rtol=0.0, atol=1e-14)
        rows_and_log_agree(trace)
        guards_say_so(trace)
        nothing_is_overdue(trace)


# --------------------------------------------------------------------------- between two states
def test_it_stays_between_two_states_until_the_drift_exceeds_the_push() -> None:
    """Then p = 0.15 (t - t_1)^2; in between sigma is the drift, and nothing is switched."""
    trace = run()
    (slide,) = trace.sliding
    assert slide.surface == "p - q (below, above) of element 1"
    assert (slide.t_start, slide.t_end) == pytest.approx((MEETS, LEAVES), abs=1e-12)
    assert (slide.sigma_start, slide.sigma_end) == pytest.approx((0.3 * MEETS, 1.0), abs=1e-12)
    assert trace.transitions.edge.tolist() == ["rise"]
    on, after = on_surface(trace), trace.t > LEAVES
    assert np.abs(trace.z[on, 0]).max() < 1e-15
    assert np.abs(trace.dz[on]).max() < 1e-15
    exact = 0.15 * (trace.t[after] - LEAVES) ** 2
    assert np.abs(trace.z[after, 0] - exact).max() < 1e-12
    assert {row[0] for row in trace.states[trace.t > MEETS + 1e-9]} == {"above"}


@pytest.mark.parametrize(
    "guards",
    [("p > q", "p < q"), ("q < p", "q > p"), ("p - q > 0", "p < q"), ("0 < p - q", "p - q <= 0")],
)
def test_it_leaves_by_its_edge_however_the_guards_are_written(guards: tuple[str, str]) -> None:
    """Where the other state was entered last."""
    trace = run(model=relay(FALLING, guards))
    log = trace.transitions
    assert log.edge.tolist() == ["rise", "fall"]
    assert log.t[1] == trace.sliding[0].t_end == pytest.approx(LEAVES, abs=1e-12)
    assert trace.z[-1, 0] == pytest.approx(-0.15 * (5.0 - LEAVES) ** 2, abs=1e-12)
    exact = run(-0.5, relay(("1", "-1"), guards))  # p - q is 0 at the end of a step
    assert exact.transitions.edge.tolist() == ["rise"]
    assert exact.sliding[0].t_start == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize("source", ["above", "below"])
@pytest.mark.parametrize("first", [False, True])
def test_edges_of_both_states_leave_it(source: str, first: bool) -> None:
    """From the state that was not entered last, its edge there is taken first."""
    off = Transition("switch_off", source, "off", guard="t > 2")
    chart = relay().chart
    edges = (off, *chart.transitions) if first else (*chart.transitions, off)
    trace = run(model=ChartModel(replace(chart, transitions=edges), {"k": 1.0}))
    there = [] if source == "above" else ["fall"]
    assert trace.transitions.edge.tolist() == ["rise", *there, "switch_off"]
    assert trace.sliding[0].t_end == pytest.approx(2.0, abs=1e-12)
    assert trace.transitions.t[1:] == pytest.approx(2.0, abs=1e-12)
    assert trace.z[-1, 0] == pytest.approx(0.0, abs=1e-15)


def test_one_element_leaves_and_the_other_slides_on() -> None:
    off = Transition("switch_off", ("below", "above"), "off", guard="t > 2 and k > 1.5")
    chart = relay().chart
    chart = replace(chart, transitions=(*chart.transitions, off))
    for k in ([2.0, 1.0], [1.0, 2.0]):
        trace = run([-0.1, -0.2], ChartModel(chart, {"k": k}, n=2))
        ends = [each.t_end for each in sorted(trace.sliding, key=lambda each: str(each.surface))]
        assert ends == pytest.approx([2.0 if each == 2.0 else LEAVES for each in k], abs=1e-12)
        assert sorted(trace.transitions.edge) == ["rise", "rise", "switch_off"]


def test_a_curved_surface_that_moves_is_followed() -> None:
    """p^2 + q^2 = 1 + 0.1 t, while p grows below and decays above."""
    bent = ("p * p + q * q > 1 + 0.1 * t", "p * p + q * q < 1 + 0.1 * t")
    trace = run(0.5, relay(("p", "-p"), bent))
    start = trace.sliding[0].t_start  # p = 0.5 exp(t) until then
    assert 0.25 * np.exp(2.0 * start) == pytest.approx(1.0 + 0.1 * start, abs=1e-6)
    on = on_surface(trace)
    assert trace.z[on, 0] == pytest.approx(np.sqrt(1.0 + 0.1 * trace.t[on]), abs=1e-6)


def test_two_states_are_the_motion_with_a_sign() -> None:
    two, one = (  # with one tolerance: the default follows from the forces at the start
        simulate(ChartModel(dry(kind), {"F_c": 1.0}), PULLED_SLOWLY, 20.0, atol=1e-9)
        for kind in (True, False)
    )
    assert two.sliding[0].t_end == pytest.approx(one.sliding[0].t_end, abs=1e-12)
    assert two.rows.y[-1] == pytest.approx(one.rows.y[-1], abs=1e-12)
    on = on_surface(two)
    assert two.F[on] == pytest.approx(2.0 * 0.1 * two.t[on], abs=1e-12)


def test_an_edge_taken_far_from_the_surface_does_not_lead_onto_it() -> None:
    """Started in the state of the other side: the flow has to reach the surface first."""
    trace = run(initial={"p": [-0.1], "q": [0.0], "states": ["above"]})
    assert trace.transitions.edge.tolist() == ["fall", "rise"]
    assert trace.sliding[0].t_start == pytest.approx(MEETS, abs=1e-12)


def test_flows_that_do_not_push_back_are_crossed() -> None:
    trace = run(model=relay(("1", "0.5")))
    assert len(trace.sliding) == 0
    assert trace.transitions.edge.tolist() == ["rise"]
    assert trace.z[-1, 0] == pytest.approx(0.5 * 4.9, abs=1e-12)


def test_elements_that_do_not_bear_on_each_other_slide_at_once() -> None:
    trace = run([-1.0, -0.5], relay(FALLING, n=2))
    first, second = sorted(trace.sliding, key=lambda each: str(each.surface))
    assert "element 1" in first.surface
    assert "element 2" in second.surface
    assert first.t_end == second.t_end == pytest.approx(LEAVES, abs=1e-12)
    assert trace.z[-1] == pytest.approx(-0.15 * (5.0 - LEAVES) ** 2, abs=1e-12)


def test_signs_and_states_slide_side_by_side() -> None:
    """Pulled by 0.2 t, 0.3 t and 0.25 t; F_c is 1 N, at the second body with a ratio of 3."""
    trace = simulate(side_by_side(), 8.0, initial=BESIDE, engine="ifelse", rtol=1e-10)
    found = {str(each.surface)[:2]: (each.t_start, each.t_end) for each in trace.sliding}
    assert found == {
        "va": pytest.approx((5.0 - 15.0**0.5, 5.0), abs=1e-9),  # 1 - t + 0.1 t^2 = 0, 0.2 t = F_c
        "tw": pytest.approx((10.0 - (290.0 / 3.0) ** 0.5, 8.0), abs=1e-9),
        "vc": pytest.approx((4.0 - 14.8**0.5, 4.0), abs=1e-9),
    }
    assert trace.body("c").v[-1] == pytest.approx(4.0, abs=1e-9)
    for t in (3.5, 4.5):  # on three of them, and on two
        shown = trace.sample([t])
        forces = [shown.contact(name).F[0] for name in ("one", "two", "three")]
        assert forces == pytest.approx([0.2 * t, 0.1 * t, min(0.25 * t, 1.0)], abs=1e-12)


def test_a_run_may_begin_on_a_surface() -> None:
    trace = run(0.0, relay(guards=("p >= q", "p < q")))
    assert trace.transitions.edge.tolist() == ["rise"]
    assert trace.sliding[0].t_start == 0.0


def test_sigmas_are_those_of_a_linear_system() -> None:
    """Whichever entry is the largest; at most 2; and 0 or 2 where a sign has no effect."""
    rng = np.random.default_rng(3)
    for n in (1, 2, 3, 4) * 5:
        matrix, sigma = rng.normal(size=(n, n)), rng.uniform(-1.0, 1.0, n)
        matrix[0, 0] *= n == 1  # another row has to come first
        rows, found = np.column_stack([matrix, matrix @ sigma]).tolist(), [0.0] * n
        solve(rows, n, found, 2.0)
        assert found == pytest.approx(sigma, rel=1e-9)
    for row, wanted in (
        ([1.0, 9.0], 2.0),
        ([-1.0, 9.0], -2.0),
        ([0.0, -1.0], 2.0),
        ([0.0, 0.0], 0),
    ):
        solve([row], 1, found, 2.0)
        assert found[0] == wanted


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
    assert "not unique" in error.reason
    with pytest.raises(LivelockError, match=r"hold together; make the guards exclude"):
        run(model=relay(guards=("p >= q", "p <= q + 0.01")))


@pytest.mark.slow
def test_why_and_the_ribbon_name_both_states() -> None:
    trace = run([-0.1, -20.0], relay(n=2))  # the other element does not get there
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


# --------------------------------------------------------------------------- other loops, jumps
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
    on = on_surface(trace)
    assert on.sum() > 20
    assert trace.F[on] == pytest.approx(v[on], abs=1e-14)
    (both,) = np.nonzero(on[:-1] & on[1:])
    assert np.array(means)[both] == pytest.approx((v[both] + v[both + 1]) / 2.0, abs=1e-14)


@pytest.mark.parametrize("switching", [True, False], ids=["states", "sign"])
def test_what_jumps_away_drags_the_mass_after_it(switching: bool) -> None:
    """A belt that jumps: F_c = 1 N brings 1 kg to 0.5 m/s in half a second, not at once."""
    for belt in ([(0, 0), (1, 0), (1, 0.5), (3, 0.5)], "0.25 * (1 + sgn(t - 1))"):
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
