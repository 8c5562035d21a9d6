"""`linearize` gives what a run does near an instant, all elements staying in their states."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    PulledSlider,
    Slider,
    Spring,
    State,
    Stribeck,
    System,
    SystemState,
    Trace,
    Transition,
    linearize,
    simulate,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import CHARTS
from gms_fsm.linear.linearize import LinearSystem
from tests.helpers import FASTEST

FINE = {"rtol": 1e-11, "atol": 1e-14, "engine": FASTEST}
STICTION = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}


def bank(**more: float) -> GMS:
    """A bank of four elements with lag and damping."""
    parameters = GMSParameters.from_shares(
        [0.25] * 4, [4e3, 3e3, 2e3, 1e3], C=20.0, sigma=[4.0, 3.0, 2.0, 1.0],
        stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=1e-2), v_c=1e-6, sigma_2=0.5, **more,
    )  # fmt: skip
    return GMS(parameters, law="signed")


def servo() -> LinearSystem:
    """The servo at rest: all elements of its bearing stick."""
    return linearize(load_scenario("servo").simulate(), 0.2)


def test_sticking_elements_are_one_spring() -> None:
    found = servo()
    assert found.states == ("x_m", "v_m", "x_l", "v_l")
    assert found.inputs == ("u",)
    assert found.outputs == ("x_m", "v_m", "x_l", "v_l", "F")
    assert found.units == {
        **dict.fromkeys(("x_m", "x_l"), "m"), **dict.fromkeys(("v_m", "v_l"), "m/s"), "F": "N",
    }  # fmt: skip
    assert found.pattern == {"bearing": ("stick",) * 4}
    k, d, all_k = 2e4, 5.0, 1e5
    A = [[0, 1, 0, 0], [-k / 0.5, -d / 0.5, k / 0.5, d / 0.5],
         [0, 0, 0, 1], [k, d, -k - all_k, -d]]  # fmt: skip
    np.testing.assert_allclose(found.A, A, rtol=1e-15)
    np.testing.assert_array_equal(found.B, [[0], [2], [0], [0]])
    np.testing.assert_allclose(found.C[-1], [0, 0, all_k, 0], rtol=1e-15)
    np.testing.assert_array_equal(found.D, np.zeros((5, 1)))


@pytest.mark.matrix
def test_states_and_outputs_have_the_names_of_values() -> None:
    plant = replace(load_scenario("servo").system, sampled=(), inputs=("u",))
    two = replace(plant, contacts=(*plant.contacts, Contact("seal", bank(), v="v_m")))
    for system, first in ((plant, "z1"), (two, "bearing.z1")):
        found = linearize(simulate(system, 0.1, inputs={"u": "50"}), 0.1)
        assert first in found.states
        assert {*found.states, *found.outputs} <= {*SystemState(system).names}


@pytest.mark.every(2)
@pytest.mark.parametrize(
    ("force", "t", "states"),
    [("0.5*min(t, 1)", 3.0, "stick"), ("2.5*min(t, 1)", 3.0, "slip")],
    ids=["elements that stick", "elements that slip, at speed"],
)
def test_a_run_with_a_little_more_force_goes_as_the_linear_system_says(
    force: str, t: float, states: str
) -> None:
    small, after = 1e-5, np.linspace(0.0, 0.02, 21)
    runs = [
        simulate(bank(), Slider(1.0, f"{force} + {more!r} * min(max(t - {t}, 0) * 1e9, 1)"),
                 t + 0.02, t_eval=t + after, **FINE)
        for more in (0.0, small)
    ]  # fmt: skip
    found = linearize(runs[0], t)
    assert found.pattern == {"friction": (states,) * 4}
    _, y, _ = lsim(StateSpace(*found), np.full(after.size, small), after)
    for name, of in (("x", "x"), ("v", "v"), ("F", "F")):
        change = getattr(runs[1], of) - getattr(runs[0], of)
        scale = np.abs(change).max()
        predicted = y[:, found.outputs.index(name)]
        np.testing.assert_allclose(predicted, change, atol=3e-4 * scale, err_msg=name)


def test_what_a_lock_holds_is_left_out() -> None:
    pulled = System(
        "pulled", bodies=(Body("mass", inertia=2.0, force="u - 3 * x"),), numbers={"m": 2.0},
        contacts=(Contact("pad", CHARTS["stiction"], STICTION),), signals={"u": "0.5"},
    )  # fmt: skip
    found = linearize(simulate(pulled, 1.0), 0.5)
    assert found.states == ()
    assert found.inputs == ("u",)
    np.testing.assert_array_equal(found.D, [[0], [0], [1]])  # the lock takes all of it


def test_bodies_locked_to_each_other_are_one() -> None:
    two = System(
        "two",
        bodies=(Body("a", inertia=2.0, force="u", x="x_a", v="v_a"),
                Body("b", inertia=3.0, x="x_b", v="v_b")),
        springs=(Spring("wall", "b", k=20.0, d=0.5),),
        contacts=(Contact("pad", CHARTS["stiction"], STICTION, v="v_a - v_b"),),
        signals={"u": "0.1*sin(t)"},
    )  # fmt: skip
    found = linearize(simulate(two, 1.0), 0.7)
    assert len(found.states) == 2
    np.testing.assert_allclose(found.A, [[0, 1], [-4, -0.1]], rtol=1e-15)
    np.testing.assert_allclose(found.B, [[0], [0.2]], rtol=1e-15)
    np.testing.assert_allclose(found.C[-1], [8, 0.2], rtol=1e-15)  # of u, 3/5 reach b
    np.testing.assert_allclose(found.D[-1], [0.6], rtol=1e-15)


def test_a_body_locked_on_a_belt_goes_with_the_belt() -> None:
    belt = System(
        "belt",
        bodies=(Body("mass", inertia=1.0, force="-2 * x_m", x="x_m", v="v_m"),
                Body("belt", velocity="v_b", x="x_b", v="v_b")),
        contacts=(Contact("pad", CHARTS["stiction"], STICTION, v="v_m - v_b"),),
        signals={"v_b": "0.1"},
    )  # fmt: skip
    run = simulate(belt, 1.0, initial={"mass.v": 0.1})
    found = linearize(run, 0.5)
    assert set(found.states) <= {"x_m", "x_b"}
    of = found.outputs.index
    response = found.C[[of("x_m")]] @ found.B
    np.testing.assert_array_equal(response, [[1.0]])
    np.testing.assert_array_equal(found.D[of("v_m")], [1.0])


def test_on_a_surface_the_sign_follows() -> None:
    coulomb = Chart("Coulomb", parameters=("F_c",), states=(State("on"),),
                    outputs={"F": "F_c * sgn(v)"})  # fmt: skip
    run = simulate(ChartModel(coulomb, {"F_c": 1.0}), Slider(1.0, "0.5*sin(t)"), 1.0)
    found = linearize(run, 0.5)
    assert found.states == ()
    np.testing.assert_allclose(found.D, [[0], [0], [1]], atol=1e-15)


FORMS = (
    "exp(-x) * sin(3 * x) + cos(v) * tanh(x)", "log(2 + x) / sqrt(1 + x**2)", "atan(x) * asinh(v)",
    "(2 + x)**1.5 + x**3", "min(x, 5, 2 * x) + max(x, v)", "abs(x - 1) * sgn(x)",
    "if(x > 0.1, x * v, 3)", "saturate(x, -1, 1) + floor(x) * v", "2**x",
)  # fmt: skip


@pytest.mark.parametrize("text", FORMS)
def test_every_function_of_the_language_has_its_derivative(text: str) -> None:
    still = Chart("none", parameters=(), states=(State("on"),), outputs={"F": "0 * v"})

    def acceleration(x: float, v: float) -> float:
        moved = System("one", bodies=(Body("mass", inertia=1.0, force=text),), flow={"w": text},
                       contacts=(Contact("pad", still, {}),))  # fmt: skip
        start = {"x": x, "v": v}
        h = 1e-6
        return float(simulate(moved, h, initial=start, t_eval=[0.0, h]).value("w")[-1]) / h

    moved = System("one", bodies=(Body("mass", inertia=1.0, force=text),),
                   contacts=(Contact("pad", still, {}),))  # fmt: skip
    x, v, d = 0.4, 0.3, 1e-4
    found = linearize(simulate(moved, 1e-3, initial={"x": x, "v": v}), 0.0)
    slopes = [
        (acceleration(x + d, v) - acceleration(x - d, v)) / (2 * d),
        (acceleration(x, v + d) - acceleration(x, v - d)) / (2 * d),
    ]
    np.testing.assert_allclose(found.A[1], slopes, atol=2e-5)


def test_signals_and_numbers_can_be_inputs() -> None:
    run: Trace = simulate(bank(), PulledSlider(mass=2.0, stiffness=5.0, speed=0.1), 0.01)
    found = linearize(run, 0.01, inputs=("speed",))
    np.testing.assert_allclose(found.B[1], 5.0 * 0.01 / 2.0, rtol=1e-15)


def test_after_a_switch_the_pattern_is_the_new_one() -> None:
    run = simulate(bank(), Slider(1.0, "3*t"), 1.0)
    first = run.transitions[0]
    assert linearize(run, first.t).pattern["friction"].count("slip") >= 1
    assert set(linearize(run, first.t * (1 - 1e-9)).pattern["friction"]) == {"stick"}


def test_python_control_gets_names() -> None:
    control = pytest.importorskip("control")
    from gms_fsm.adapters.control import state_space

    found = servo()
    plant = state_space(found)
    assert plant.input_labels == ["u"]
    assert plant.output_labels == list(found.outputs)
    np.testing.assert_allclose(sorted(control.poles(plant)), sorted(found.poles), rtol=1e-9)
    several = load_scenario("two_blocks_on_a_belt").simulate()
    assert "pad_1_F" in state_space(linearize(several, 60.0)).output_labels


def test_a_chart_that_frees_a_lock_gives_back_the_states() -> None:
    lets_go = Chart(
        "brake", states=(State("on", locked=True), State("off", outputs={"F": "0"})),
        transitions=(Transition("release", "on", "off", guard="t >= 1"),),
        inputs=("v", "t"), parameters=(),
    )  # fmt: skip
    one = System("one", bodies=(Body("mass", inertia=1.0, force="1 - x"),),
                 contacts=(Contact("brake", lets_go, {}),))  # fmt: skip
    run = simulate(one, 2.0)
    assert linearize(run, 0.5).states == ()
    assert linearize(run, 1.5).states == ("x", "v")
