"""By default every component has a tolerance from the model's own scales, and from nothing else.

With one absolute tolerance for all components, these cases gave wrong results without warning.
"""

from dataclasses import replace

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    LuGre,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    System,
    Transition,
    simulate,
    sweep,
)
from gms_fsm.charts import CHARTS, gms_element
from gms_fsm.errors import ParameterError
from gms_fsm.lowering.scales import scales_of
from gms_fsm.run.problem import Problem
from tests.corpus import MICROMETRES
from tests.helpers import FASTEST, ROOT, pulled_mass


@pytest.mark.slow
def test_a_carriage_on_micrometres_creeps_and_does_not_break_away():
    """k = 4e6 N/m, thresholds of 2 um: atol = 1e-9 made a break-away at 3.826 s."""
    times = np.linspace(0.0, 8.0, 8001)
    trace = simulate(MICROMETRES, PulledSlider(40, 1600, 1.8e-3), 8.0, engine=FASTEST, t_eval=times)
    assert len(trace.transitions) == 0
    assert trace.v[-1] == pytest.approx(7.19712e-7, rel=3e-4)
    assert trace.v.max() == pytest.approx(1.19883e-6, rel=1e-4)


def test_the_scales_of_a_bank_are_its_thresholds_its_stiffness_and_its_velocities():
    p = GMSParameters(
        [40.0, 10.0],
        [0.0, 0.0],
        [0.02, 0.01],
        sigma_2=0.4,
        stribeck=Stribeck(2.0, 3.0, 0.05),
        v_c=1e-7,
        weights=[0.01, 0.5],
    )
    scales = scales_of(GMS(p, law="signed"))
    values = {"k": p.k, "sigma": p.sigma, "C": p.C, "v_c": p.v_c}
    element = gms_element("signed")
    own = ChartModel(element, values, n=2, stribeck=p.stribeck, weights=p.weights)
    assert scales_of(own).variables == scales.variables
    assert scales.variables["z"] == pytest.approx((0.02, 0.2))  # w F_c; F_c / k
    assert scales.x == pytest.approx(0.02)
    assert scales.v == pytest.approx(1e2 * 1e-7)
    assert scales.time == pytest.approx(0.02 / 0.02)  # s / C of the faster element


def test_only_what_relaxes_at_a_constant_rate_has_a_relaxation_time():
    bank = pulled_mass()[0]
    p = bank.parameters
    slip = p.weights * p.stribeck.F_c / p.C
    assert scales_of(bank).relaxing == tuple((0.0, pytest.approx(time)) for time in slip)
    lugre = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    assert scales_of(lugre).relaxing == ((0.0,),)  # its rate grows with v


def test_without_guards_the_scale_is_the_deflection_that_carries_the_friction():
    lugre = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    assert scales_of(lugre).variables["z"] == pytest.approx((1e-3,))
    assert scales_of(lugre).v == 1e-3


@pytest.mark.parametrize(
    ("guard", "scale"),
    [
        ("z >= 0.02", 0.02),
        ("3 * abs(z) - 0.06 > 0", 0.02),
        ("k * z > 5", 0.05),
        ("z > 0", 0.0),
        ("z > 0 or z < -0.5", 0.5),
        ("t > 3", 0.0),
    ],
)
def test_user_defined_charts_have_the_scales_of_their_guards(guard, scale):
    """How far from 0 a comparison turns, by its slope; one that turns at 0 has no scale."""
    chart = Chart(
        "own",
        inputs=("t", "v"),
        variables=("z",),
        parameters=("k",),
        states=(State("a", flow={"z": "2 * v"}), State("b", flow={"z": "0"})),
        transitions=(Transition("go", "a", "b", guard=guard),),
        outputs={"F": "k * z"},
    )
    scales = scales_of(ChartModel(chart, {"k": 100.0}))
    assert scales.variables["z"] == pytest.approx((scale,))
    assert scales.x == pytest.approx(scale / 2.0)  # x follows z at half its rate


@pytest.mark.parametrize("length", [1.0, 1e-6, 1e6])
def test_a_component_without_a_scale_is_measured_by_its_own_size(length):
    """A spring and a mass: v and x are measured by their largest values, whatever the unit."""
    spring = Chart(
        "spring",
        inputs=("x",),
        variables=("z",),
        parameters=("k",),
        states=(State("on", flow={"z": "0"}),),
        transitions=(),
        outputs={"F": "k * x"},
    )
    model = ChartModel(spring, {"k": 4.0})
    trace = simulate(model, Slider(1.0, "0"), 10.0, initial={"x": length})
    assert trace.settings["atol"] == {"x": 0.0, "v": 0.0, "z": [0.0]}
    assert np.abs(trace.x - length * np.cos(2.0 * trace.t)).max() < 3e-5 * length
    assert len(trace) < 500


def test_the_default_depends_on_model_and_rtol_only():
    model = pulled_mass()[0]
    one = simulate(model, PulledSlider(1.0, 2.0, 0.1), 1.0).settings["atol"]
    other = simulate(model, PulledSlider(7.0, 0.2, 3.0), 2.0, t_start=1.5).settings["atol"]
    finer = simulate(model, PulledSlider(1.0, 2.0, 0.1), 1.0, rtol=1e-8).settings["atol"]
    assert one == other
    assert finer["z"] == pytest.approx([u / 100 for u in one["z"]])


def test_a_tolerance_may_be_a_number_or_given_by_name():
    model, rig = pulled_mass()[0], PulledSlider(1.0, 2.0, 0.1)
    default = simulate(model, rig, 0.5).settings["atol"]
    assert simulate(model, rig, 0.5, atol=1e-7).settings["atol"] == 1e-7
    used = simulate(model, rig, 0.5, atol={"v": 1e-8, "z": [1e-9, 2e-9, 3e-9, 4e-9]}).settings
    assert used["atol"] == {"x": default["x"], "v": 1e-8, "z": [1e-9, 2e-9, 3e-9, 4e-9]}


def test_an_invalid_tolerance_is_refused():
    for atol, said in (
        (0.0, "atol is 0.0; it must be > 0"),
        ({"w": 1e-9}, "atol: there is no key 'w'; there are x, v, z"),
        ({"z": [1e-9, 1e-9]}, "atol['z'] has 2 entries, but there are 4 elements"),
        ({"v": -1.0}, "atol['v'] is -1.0; it must be > 0"),
        ("fine", "atol is 'fine'; it must be a number"),
    ):
        with pytest.raises(ParameterError) as caught:
            simulate(pulled_mass()[0], PulledSlider(1.0, 2.0, 0.1), 1.0, atol=atol)
        assert said in str(caught.value)


def test_a_scipy_solver_requires_a_tolerance_for_components_without_scale():
    """SciPy's own error norm divides by it."""
    from scipy.integrate import RK45

    states = (State("on", flow={"z": "0"}),)
    model = ChartModel(Chart("idle", ("v",), ("z",), (), states, (), {"F": "v"}), {})
    with pytest.raises(ParameterError, match="needs an absolute tolerance"):
        simulate(model, Slider(1.0, "1"), 1.0, method=RK45)
    trace = simulate(model, Slider(1.0, "1"), 1.0, method=RK45, atol=1e-9)
    assert trace.v[-1] == pytest.approx(1.0 - np.exp(-1.0), abs=1e-6)


@pytest.mark.parametrize("engine", ["ifelse", "compiled"])
def test_each_run_of_a_sweep_has_the_tolerances_of_its_own_model(engine):
    """The same buffers serve one run after the other."""
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    p = pulled_mass()[0].parameters
    axes = {"weights": np.outer([1e-6, 1.0], p.weights), "C": np.outer([1e-6, 1.0], p.C)}
    rig = Prescribed("1e-3*sin(t)")
    many = sweep(pulled_mass()[0], rig, 6.0, axes, engine=engine)
    for row in range(2):
        own = replace(p, **{name: values[row] for name, values in axes.items()})
        alone = simulate(GMS(own, law="signed"), rig, 6.0, engine="ifelse")
        assert many.x[row] == alone.x[-1]
        assert many.z[row].tolist() == alone.z[-1].tolist()


def test_a_scenario_takes_both_forms(tmp_path):

    from gms_fsm.app.scenario import load_scenario

    path = ROOT / "gms_fsm/scenarios" / "pulled_mass.toml"
    assert "atol" not in load_scenario(path).arguments
    assert load_scenario(path, ["run.atol=1e-8"]).arguments["atol"] == 1e-8
    named = load_scenario(path, ["run.atol={ v = 1e-9, z = [1e-9, 1e-9, 1e-9, 1e-9] }"])
    assert named.arguments["atol"] == {"v": 1e-9, "z": [1e-9] * 4}


def test_where_no_scale_is_known_forces_give_free_bodies_a_floor():
    """A user's function is not called ahead of time for it."""
    called = []

    def force(t):
        called.append(t)
        return 1.0

    system = System(
        "cart on a belt",
        bodies=(Body("cart", inertia=1.0, force="f"), Body("belt", velocity="0", x="x_b", v="v_b")),
        contacts=(
            Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 2.0, "b": 0.0}, v="v - v_b"),
        ),
        signals={"f": force},
    )
    start = Problem.of(system, None, 10.0)
    floor = dict(zip(start.program.layout.y.shared, start.options.floor, strict=True))
    assert floor == pytest.approx({"x": 1e-13, "v": 1e-14, "x_b": 0.0}, rel=1e-6, abs=0.0)
    assert {*called} == {0.0}
