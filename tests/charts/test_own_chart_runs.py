"""A user's chart runs like the built-in ones: its texts determine everything, whatever its names.

Three states, two variables, actions on entry, exit and edges, `or` and `not` in guards, corners in
flows: as in the closed form. That engines agree over such charts is a law.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.errors import ChartError
from tests.corpus import trace
from tests.helpers import CURVE

FINE = {"rtol": 1e-9, "atol": 1e-12}


def element(
    flow: str, *, n: int = 1, force: str = "z", parameters: dict[str, Any] | None = None
) -> ChartModel:
    """Return an element with one state and one flow."""
    parameters = parameters or {}
    chart = Chart(
        "one",
        ("v", "t", "x"),
        ("z",),
        tuple(parameters),
        (State("on", {"z": flow}),),
        (),
        {"F": force},
    )
    return ChartModel(chart, parameters, n=n, stribeck=CURVE)


def test_three_states_and_two_variables() -> None:
    one = trace("wear")
    log = one.transitions
    assert {"yield_", "tear", "arrest"} <= set(log.edge.tolist())
    assert one.variable("w").shape == one.z.shape == (len(one), 3)
    for i in range(3):
        arrests = np.sum((log.edge == "arrest") & (log.element == i))
        assert arrests >= 1
        assert 0 < one.variable("w")[-1, i] - arrests <= 0.3 * 40


def test_an_arrest_resets_in_stateflows_order() -> None:
    """Exit of the source, action of the edge, entry of the target; one after another."""
    one = trace("order of actions")
    fired = [row for row in range(len(one)) if one.microstep[row] == 2]
    assert len(fired) == 1
    for i, z0 in enumerate((2.0, 3.0)):
        z = w = z0 + 1  # exit: w is the new z
        z, w = 10 * z, w * (10 * z)  # action
        z = z + 0.5  # entry
        w = w + z
        assert one.z[fired[0], i] == z
        assert one.variable("w")[fired[0], i] == w
        assert one.z[-1, i] == z
        assert one.variable("w")[-1, i] == pytest.approx(w + 1.0, rel=1e-12)
    assert one.transitions.z.tolist() == [2.0, 3.0], "the log shows z before the assignments"
    assert one.transitions.F_before[0] == 5.0
    assert one.transitions.F_after[0] == 30.5 + 3.0


def test_a_bouncing_reset_meets_its_closed_form() -> None:
    # z' = 1; at z = 1 z returns to 0: a sawtooth, through a self-loop.
    chart = Chart(
        "sawtooth",
        (),
        ("z",),
        ("top",),
        (State("rise", {"z": "1"}),),
        (Transition("drop", "rise", "rise", "z >= top", actions={"z": "0"}),),
        {"F": "z"},
    )
    model = ChartModel(chart, {"top": [1.0, 0.75]}, n=2, stribeck=CURVE)  # type: ignore[dict-item]
    found = simulate(model, Prescribed("0"), 5.5)
    for i, top in enumerate((1.0, 0.75)):
        times = found.transitions.t[found.transitions.element == i]
        np.testing.assert_allclose(times, top * np.arange(1, len(times) + 1), atol=1e-12)
        assert len(times) == int(5.5 / top)
        assert found.z[-1, i] == pytest.approx(5.5 % top, abs=1e-12)


@pytest.mark.slow
def test_or_and_not_fire_where_they_become_true() -> None:
    guards = {
        "z > 2 or (t >= 1.5 and not v < 0.3)": 1.5,
        "z > 0.5 or t > 9": 1.0,
        "not (z < 1 or t < 1)": 2.0,
        "not (z < 1 and t < 1)": 1.0,
        "not not (x >= 0.75)": 1.5,
        "(z > 0.25 or z > 0.5) and (t > 1.25 or z > 100)": 1.25,
        "0.5 <= z < 3 and not (t < 1.75 or v > 1)": 1.75,
        "abs(z - 1) <= 0.5 and abs(t - 2) < 0.5": 1.5,
        "max(z, t - 1) >= 1 or min(z, -1) > 0": 2.0,
    }
    for guard, wanted in guards.items():
        chart = Chart(
            "logic",
            ("v", "t", "x"),
            ("z",),
            (),
            (State("a", {"z": "v"}), State("b", {"z": "v"})),
            (Transition("e", "a", "b", guard),),
            {"F": "z"},
        )
        found = simulate(ChartModel(chart, {}, n=1, stribeck=CURVE), Prescribed("0.5"), 4.0)
        assert found.transitions.t.tolist() == [pytest.approx(wanted, abs=1e-9)], guard


# --------------------------------------------------------------------------- corners and jumps
def _waves(t: float) -> float:
    """Return the integral of |sin| from 0 to t."""
    whole, rest = divmod(t, math.pi)
    return 2.0 * whole + 1.0 - math.cos(rest)


def _triangle(t: float) -> float:
    """Return the integral of sgn(sin) from 0 to t."""
    rest = t % (2 * math.pi)
    return rest if rest <= math.pi else 2 * math.pi - rest


def _capped(t: float) -> float:
    """Return the integral of min(sin, 1/2) from 0 to t < pi."""
    a = math.pi / 6
    if t <= a:
        return 1.0 - math.cos(t)
    start = 1.0 - math.cos(a)
    if t <= math.pi - a:
        return start + 0.5 * (t - a)
    return start + 0.5 * (math.pi - 2 * a) + math.cos(math.pi - a) - math.cos(t)


@pytest.mark.parametrize(
    ("flow", "t_end", "exact"),
    [
        ("abs(v)", 10.0, _waves),
        ("sgn(v)", 10.0, _triangle),
        ("sgn(v) * abs(v)", 10.0, lambda t: 1.0 - math.cos(t)),
        ("max(v, -v)", 10.0, _waves),
        ("max(v, 0) - min(v, 0)", 10.0, _waves),
        ("min(v, 0.5)", 3.0, _capped),
        ("min(2, v, 0.5)", 3.0, _capped),
        ("abs(sgn(v)) + abs(-abs(v))", 10.0, lambda t: t + _waves(t)),
    ],
)
def test_steps_end_exactly_on_corners_of_a_flow(flow: str, t_end: float, exact: Any) -> None:
    times = np.linspace(0.0, t_end, 41)
    found = simulate(
        element(flow), Prescribed("sin(t)"), t_end, t_eval=times, rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(found.z[:, 0], [exact(t) for t in times], atol=2e-8)


def test_corners_in_an_elements_own_variable() -> None:
    # z' = 1 - c |z|, z(0) = -1: exponentials on either side that join at z = 0.
    rates = np.array([0.5, 0.25])
    times = np.linspace(0.0, 8.0, 33)
    found = simulate(
        element("1 - c * abs(z)", n=2, parameters={"c": rates}),
        Prescribed("0"),
        8.0,
        t_eval=times,
        initial={"z": [-1.0, -1.0]},
        rtol=1e-9,
        atol=1e-12,
    )
    for i, c in enumerate(rates):
        t0 = -math.log(1 - c) / c
        before = -1 / c + (1 / c - 1) * np.exp(c * times)
        after = (1 - np.exp(-c * (times - t0))) / c
        np.testing.assert_allclose(found.z[:, i], np.where(times < t0, before, after), atol=2e-8)


# --------------------------------------------------------------------------- names
def _named(parameter: str, variable: str, states: tuple[str, str], edge: str) -> ChartModel:
    chart = Chart(
        "names",
        inputs=("v", "s"),
        variables=(variable,),
        parameters=(parameter,),
        states=(
            State(states[0], {variable: f"v * {parameter}"}),
            State(states[1], {variable: f"sgn(v) * 0.1 - {parameter} * {variable} / s"}),
        ),
        transitions=(
            Transition(edge, states[0], states[1], f"{variable} >= s and {parameter} > 0"),
            Transition("home", states[1], states[0], f"abs(v) < 0.01 or {variable} < 0"),
        ),
        outputs={"F": f"{parameter} * {variable} + d{variable}"},
    )
    return ChartModel(chart, {parameter: np.array([0.5, 0.75, 1.0])}, n=3, stribeck=CURVE)


PLAIN = ("q", "u", ("resting", "moving"), "leave")
RIGS = [
    Prescribed("sin(t)"),
    Prescribed([(0.0, 0.5), (5.0, 0.6)]),
    Prescribed(lambda t: 0.5),
    Slider(2.0, [(0, 1), (5, 5.0)]),
    PulledSlider(1.0, 2.0, 0.5),
]
NAMES = (
    ["F_c", "F_s", "v_s", "v_dip", "sigma_2", "mass", "stiffness", "speed", "weights", "F_a"]
    + ["F_i", "S_", "n_", "i_", "sgn_v", "abs_v", "sgn_0", "v_signal", "F_a_signal", "len", "range"]
    + ["piecewise_linear", "float", "switch", "flow", "observe", "margins", "arm", "act", "load"]
    + ["y", "n", "p", "i", "S", "own", "tables", "mode", "out", "watch", "shared", "weight"]
    + ["element", "event", "self", "model", "holds", "inf", "nan", "print", "F_c_", "dF", "ds"]
)


@pytest.fixture(scope="module")
def plain() -> list[Trace]:
    found = [simulate(_named(*PLAIN), rig, 6.0) for rig in RIGS]
    assert all(len(each.transitions) > 0 for each in found)
    return found


def _equal_but_for_names(model: ChartModel, plain: list[Trace], place: int) -> None:
    """On one rig, and with machines, too, whose attributes are names of the chart."""
    place %= len(RIGS)
    for engine in ("machines", "ifelse"):
        one = simulate(model, RIGS[place], 6.0, engine=engine)
        for column in ("t", "x", "v", "z", "s", "F", "F_elements", "dz"):
            np.testing.assert_array_equal(getattr(one, column), getattr(plain[place], column))
        np.testing.assert_array_equal(one.rows.mode, plain[place].rows.mode)
        np.testing.assert_array_equal(one.transitions.t, plain[place].transitions.t)


def _allowed(name: str, kind: str) -> bool:
    try:
        _named(*({"parameter": (name, "u"), "variable": ("q", name)}[kind]), *PLAIN[2:])
    except ChartError as error:
        assert "reserved" in str(error)  # noqa: PT017
        return False
    return True


@pytest.mark.matrix
@pytest.mark.slow
def test_a_name_is_refused_or_changes_nothing(plain: list[Trace]) -> None:
    """Each name is the parameter once, and the variable once, beside another name; rigs in turn."""
    parameters = [name for name in NAMES if _allowed(name, "parameter")]
    variables = [name for name in reversed(NAMES) if _allowed(name, "variable")]
    assert min(len(parameters), len(variables)) > 20
    for place, (parameter, variable) in enumerate(zip(parameters, variables, strict=False)):
        if parameter not in (variable, f"d{variable}"):
            _equal_but_for_names(_named(parameter, variable, *PLAIN[2:]), plain, place)


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("states", "edge"),
    [
        (("S_", "F_"), "leave"),
        (("resting", "Resting"), "leave"),
        (("Q", "U"), "leave"),
        (("true", "none"), "leave"),
        (("len", "range"), "float"),
        (("resting", "in_resting"), "RESTING"),
        (("resting", "moving"), "Home"),
        (("resting", "moving"), "Moving"),
        (("a", "b"), "Q"),
        (("take_home", "b"), "in_b"),
    ],
)
def test_states_and_edges_may_differ_by_case_only(
    states: tuple[str, str], edge: str, plain: list[Trace]
) -> None:
    try:
        model = _named("q", "u", states, edge)
    except ChartError:
        return
    for place in range(len(RIGS)):
        _equal_but_for_names(model, plain, place)


def test_a_chart_without_variables_has_no_deflection(monkeypatch: pytest.MonkeyPatch) -> None:
    """NaN, whatever memory had before: a product of signalling NaNs is a warning."""
    chart = Chart("damper", ("v",), (), ("b",), (State("on"),), (), {"F": "b * v"})
    trace = simulate(ChartModel(chart, {"b": 2.0}), Prescribed("sin(t)"), 1.0)
    empty = np.empty

    def stray(*given: Any, **options: Any) -> Any:
        found = empty(*given, **options)
        if found.dtype == np.float64:
            found.view(np.int64)[...] = 0x7FF0000000000001
        return found

    monkeypatch.setattr(np, "empty", stray)
    assert np.isnan(trace.z).all()
    assert np.isnan(trace.dz).all()
