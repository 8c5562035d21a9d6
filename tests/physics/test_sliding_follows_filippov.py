"""Where both sides push back onto v = 0, a run slides along it, with the sigma that keeps it there.

An element that slips with |z| >= s while v changes sign cannot arrest; sgn(v) then chattered, and
the run ended in a livelock error.
"""

import numpy as np
import pytest
from scipy.integrate import RK45, Radau

from gms_fsm import (
    Chart,
    ChartModel,
    PulledSlider,
    Session,
    Slider,
    State,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.session.explain import explain
from tests import older_files
from tests.corpus import HELD, PUSHED, Belt, coulomb, runs_down
from tests.helpers import same_bits


# --------------------------------------------------------------------------- the bank
def test_a_slipping_element_holds_v_at_zero_until_it_arrests():
    """Times from an independent hybrid loop around DOP853."""
    trace = simulate(HELD, PUSHED, 4.0, engine="ifelse")
    assert len(trace.transitions) == 14
    (slide,) = trace.sliding
    assert slide.surface == "v"
    assert slide.t_start == pytest.approx(0.33227853, abs=5e-7)
    assert slide.t_end == pytest.approx(0.33237728, abs=5e-7)
    assert slide.t_end in trace.transitions.t[trace.transitions.edge == "arrest"]
    on = (trace.microstep == 0) & (trace.rows.mode[:, 3] == 1)
    assert (trace.v[on] == 0.0).all()
    assert np.abs(trace.F[on] - 2.9 * np.sin(4.7 * trace.t[on])).max() < 1e-12


def test_finer_tolerances_move_sliding_as_little_as_the_rest():
    coarse, fine = (simulate(HELD, PUSHED, 0.4, engine="ifelse", rtol=r) for r in (1e-6, 1e-10))
    for name in ("t_start", "t_end", "sigma_start", "sigma_end"):
        assert coarse.sliding[name][0] == pytest.approx(fine.sliding[name][0], rel=1e-4)


# --------------------------------------------------------------------------- Coulomb friction
def test_a_mass_on_coulomb_friction_waits_for_its_spring():
    """At rest until the spring pulls with F_c, then v = speed (1 - cos): exact."""
    trace = simulate(coulomb(), PulledSlider(1.0, 2.0, 0.1), 10.0, engine="ifelse")
    slide = trace.sliding[0]
    assert (slide.t_start, slide.sigma_start) == (0.0, 0.0)
    assert slide.t_end == pytest.approx(1.0 / (2.0 * 0.1), abs=1e-12)
    assert slide.sigma_end == pytest.approx(1.0, abs=1e-9)
    free = trace.t > slide.t_end
    w = np.sqrt(2.0)
    exact = 0.1 * (1.0 - np.cos(w * (trace.t[free] - 5.0)))
    assert np.abs(trace.v[free] - exact).max() < 1e-6
    on = trace.rows.mode[:, 1] == 1
    assert on.sum() >= 5
    assert np.abs(trace.F[on] - 2.0 * 0.1 * trace.t[on]).max() < 1e-12


def test_it_comes_to_rest_and_stays():
    """Pushed once: decelerated by F_c / m, it stops after v^2 / 2 and is held there."""
    trace = simulate(coulomb(), Slider(1.0, "0"), 5.0, initial={"v": 2.0})
    (slide,) = trace.sliding
    assert slide.t_start == pytest.approx(2.0, abs=1e-12)
    assert slide.t_end == 5.0
    assert trace.x[-1] == pytest.approx(2.0, abs=1e-9)
    assert trace.v[-1] == 0.0
    assert trace.F[-1] == 0.0


def test_a_stronger_push_reverses_the_mass_without_a_stop():
    trace = simulate(coulomb(), Slider(1.0, "-3"), 3.0, initial={"v": 1.0})
    assert len(trace.sliding) == 0
    assert trace.v[-1] == pytest.approx(-2.0 * (3.0 - 0.25), abs=1e-9)


@pytest.mark.parametrize(
    "text", ["max(v, 0) + F_c * sgn(v)", "min(0, v) + F_c * sgn(v)", "F_c * sgn(v) + 0.3 * abs(v)"]
)
def test_other_corners_at_the_same_place_do_not_interfere(text):
    trace = simulate(coulomb(text), Slider(1.0, "0.5"), 5.0, initial={"v": 1.0})
    assert len(trace.sliding) == 1
    assert trace.v[-1] == 0.0
    assert trace.F[-1] == pytest.approx(0.5, abs=1e-15)


def test_a_flow_that_is_not_linear_in_the_sign_is_combined_from_both_sides():
    """F = 1 or -1/4 depending on the side: sigma is (2 F_a - 3/4) / (5/4), and F is F_a."""
    model = coulomb("F_c * (sgn(v) + 0.6 * sgn(v) * sgn(v)) / 1.6")
    trace = simulate(model, Slider(1.0, "0.5"), 3.0)
    (slide,) = trace.sliding
    assert slide.sigma_start == pytest.approx((2 * 0.5 - 0.75) / 1.25, abs=1e-12)
    assert trace.F[-1] == pytest.approx(0.5, abs=1e-15)


@pytest.mark.parametrize(
    ("w", "place"), [("0.1", lambda t: 0.1 * t), ("0.1 * cos(t)", lambda t: 0.1 * np.sin(t))]
)
def test_a_mass_rides_on_a_belt_along_a_surface_that_moves(w, place):
    """In a text of the rig; the sign's argument depends on a signal."""
    free = coulomb("0 * F_c")
    initial = {"v": 0.1}
    trace = simulate(free, Belt(w), 1.2, engine="ifelse", initial=initial)
    assert trace.sliding[0].surface == "v - w"
    on = trace.rows.mode[:, 1] == 1
    assert on.sum() >= 5
    assert np.abs(trace.x[on] - place(trace.t[on])).max() < 1e-7


def test_elements_come_to_rest_on_their_own_surfaces():
    """dz = -C sgn(z) reaches 0 in a finite time, each element by itself, two of them together."""
    model = runs_down([1.0, 2.0, 2.0, 0.1])
    trace = simulate(
        model, Slider(1e9, "0"), 2.0, engine="ifelse", initial={"z": [1.0, 1.0, -1.0, 1.0]}
    )
    names = {str(r.surface): float(r.t_start) for r in trace.sliding}
    assert names == pytest.approx(
        {"z of element 1": 1.0, "z of element 2": 0.5, "z of element 3": 0.5}, abs=1e-6
    )
    assert trace.z[-1] == pytest.approx([0.0, 0.0, 0.0, 0.8], abs=1e-6)


@pytest.mark.parametrize("guard", ["v >= 0 and z > 4", "abs(v) <= 0 and z > 4", "v <= 0 and z > 4"])
@pytest.mark.parametrize("v0", [2.0, 1.7, -1.7, 0.3])
def test_guards_that_compare_with_the_surface_are_evaluated_on_it(guard, v0):
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
    trace = simulate(model, Slider(1.0, "0"), 8.0, engine="ifelse", initial={"v": v0})
    assert trace.transitions.t.tolist() == [pytest.approx(4.0, abs=1e-9)]


@pytest.mark.parametrize("v0", np.linspace(0.31, 2.9, 30))
def test_the_force_next_to_sliding_is_that_of_the_arc(v0):
    """Not that of the sign evaluated on the surface: no dip of F_c on either side."""
    trace = simulate(coulomb(), Slider(1.0, [(0, 0), (4, 0), (5, 3)]), 6.0, initial={"v": v0})
    (slide,) = trace.sliding
    assert (trace.F[trace.t <= slide.t_start - 1e-12] == 1.0).all()
    on = trace.rows.mode[:, 1] == 1
    first, last = np.flatnonzero(on)[[0, -1]]
    assert trace.F[first - 1] == 1.0
    assert trace.F[last] == pytest.approx(1.0, abs=1e-9)
    assert (trace.F[last + 1 :] == 1.0).all()


def test_sigma_at_the_end_is_that_before_a_firing_or_a_jump():
    trace = simulate(HELD, PUSHED, 0.4)
    row = int(np.flatnonzero(trace.rows.mode[:, 3])[-1])
    while trace.microstep[row]:
        row -= 1
    assert trace.sliding.sigma_end[0] == trace.sigma(row)["v"] < 1.0
    jump = simulate(coulomb(), Slider(1.0, ([0, 1, 1, 3.0], [0.5, 0.5, 2.0, 2.0])), 3.0)
    assert jump.sliding.sigma_end[0] == pytest.approx(0.5, abs=1e-12)


@pytest.mark.slow
def test_twenty_elements_slide_at_once():
    model = runs_down(np.linspace(1.0, 2.0, 20))
    trace = simulate(model, Slider(1e9, "0"), 2.0, initial={"z": [1.0] * 20})
    assert len(trace.sliding) == 20
    assert (trace.z[-1] == 0.0).all()


# --------------------------------------------------------------------------- where it shows


def test_older_files_without_sliding_are_read(tmp_path):
    """Their rows have no flags of surfaces, which means no sliding."""
    trace = simulate(HELD, PUSHED, 0.3, engine="ifelse")
    assert len(trace.sliding) == 0
    arrays = older_files.format_1(trace, tmp_path / "a.npz")
    for kind in ("rows_mode", "stops_mode"):
        arrays[kind] = arrays[kind][:, :3]
    same_bits(trace, Trace.load(older_files.write(tmp_path / "old.npz", arrays)))


def test_requested_times_and_samples_lie_on_the_surface():
    whole = simulate(HELD, PUSHED, 0.4, engine="ifelse")
    slide = whole.sliding[0]
    times = np.linspace(slide.t_start, slide.t_end, 7)[1:-1]
    wanted = simulate(HELD, PUSHED, 0.4, engine="ifelse", t_eval=times)
    for trace in (wanted, whole.sample(times)):
        assert (trace.v == 0.0).all()
        assert np.abs(trace.F - 2.9 * np.sin(4.7 * times)).max() < 1e-12
    assert wanted.sliding.tolist() == whole.sliding.tolist()
    assert len(simulate(HELD, PUSHED, 0.4, engine="ifelse", output="end").sliding) == 0


def test_why_explains_sliding():
    trace = simulate(coulomb(), PulledSlider(1.0, 2.0, 0.1), 10.0)
    row = int(np.flatnonzero(trace.t > 3.0)[0])
    sigma = 2.0 * 0.1 * trace.t[row]
    why = explain(trace, row, 0)
    assert why.sigma == {"v": pytest.approx(sigma, abs=1e-12)}
    assert f"held on v = 0, σ = {sigma:.2g}" in str(why)


def test_a_session_steps_over_sliding():
    session = Session(HELD, PUSHED, 0.4)
    session.proceed()
    rows = session.branch.trace()
    same_bits(rows, simulate(HELD, PUSHED, 0.4))
    (first,) = np.flatnonzero(np.diff(rows.rows.mode[:, 3]) == 1) + 1
    assert session.at(int(first)).fired is None
    assert session.at(int(first)).v == 0.0


@pytest.mark.parametrize("method", [RK45, Radau])
def test_scipy_solvers_slide_too(method):
    trace = simulate(HELD, PUSHED, 0.4, method=method)
    assert trace.sliding.t_start[0] == pytest.approx(0.3322785, abs=3e-6)
    assert len(trace.transitions) == 4


def test_fixed_steps_slide_too():
    trace = simulate(coulomb(), PulledSlider(1.0, 2.0, 0.1), 6.0, method="rk4", step=0.0173)
    assert trace.sliding.t_end[0] == pytest.approx(5.0, abs=1e-9)
