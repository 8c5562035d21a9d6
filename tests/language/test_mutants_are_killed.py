"""A small change in language, chart, machines, crossings or advance is detected.

Each test covers a mutant of `tests/mutation.py` that survived at first. The comment at the end
lists the mutants that no test can detect, and why.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import pytest

from gms_fsm import ChartModel, Prescribed, Stribeck, simulate
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ChartError, ExpressionError
from gms_fsm.language import (
    MATLAB_LIKE,
    Binary,
    InState,
    Name,
    Negative,
    Not,
    Number,
    Requirement,
    evaluate,
    parse_condition,
    parse_value,
    product_power,
    rough_points,
    sgn,
    spell,
    split,
    substitute,
)
from gms_fsm.language._tree import walk
from gms_fsm.run.machines import Element, ElementMachines, Guard
from integrators import advance as kernel
from integrators.crossings import NO_CHANGE, Path, first_change, is_quiet_step, watched
from integrators.hybrid import Buffers, Equations, Options, buffers
from integrators.sliding import Surfaces
from integrators.step_size import next_factor
from integrators.steps import ERROR_BEFORE, T_STOP, Dense, H, Motion, Now, Scratch, T
from integrators.tableaux import DP45, RK4
from tests.helpers import pulled_mass, stick_slip


# --------------------------------------------------------------------------- chart
def _chart() -> Chart:
    return Chart(
        "sticky",
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("stick", flow={"z": "v"}, entry={"z": "0"}), State("slip", flow={"z": "0"})),
        transitions=(Transition("leave", "stick", "slip", "z > 1"),),
        outputs={"F": "k * z"},
    )


def test_no_part_of_a_chart_can_be_exchanged_afterwards() -> None:
    chart = _chart()
    parts = ((chart, "name"), (chart.states[0], "flow"), (chart.transitions[0], "guard"))
    for part, attribute in parts:
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, attribute, "another")


def test_charts_are_shown_and_compared_by_text_not_by_tree() -> None:
    chart = _chart()
    assert "guards=" not in repr(chart)
    assert "flows=" not in repr(chart)
    assert "assignments=" not in repr(chart)
    assert "forces=" not in repr(chart)
    assert chart == _chart()


# --------------------------------------------------------------------------- language
def _refused(text: str, *names: str, **states: Any) -> ExpressionError:
    read = parse_condition if states else parse_value
    with pytest.raises(ExpressionError) as caught:
        read(text, names, **states)
    return caught.value


def test_a_tree_and_its_spelling_cannot_be_changed() -> None:
    condition = parse_condition(
        "not -a > b * 2 and (state(1) == slip or max(a, b) > c)", "abc", ["slip"], 1
    )
    parts = list(walk(condition))
    assert len({type(part) for part in parts}) == 10
    comparison = split(parse_condition("a > b", "abc"))
    assert isinstance(comparison, Requirement)
    for part in (*parts, MATLAB_LIKE, comparison, comparison.comparison):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, dataclasses.fields(part)[0].name, None)


def test_the_sign_of_nan_is_zero() -> None:
    assert [sgn(u) for u in (math.nan, 0.0, -0.0, 5e-324, -5e-324)] == [0.0, 0.0, 0.0, 1.0, -1.0]


def test_the_longest_text_has_ten_thousand_characters() -> None:
    assert parse_value("v" + " " * 9_999, "v") == Name("v")
    assert _refused("v" + " " * 10_000, "v").column == 10_001


def test_the_deepest_tree_has_sixty_levels() -> None:
    assert parse_value("-" * 59 + "v", "v")
    assert "nested" in str(_refused("-" * 60 + "v", "v"))
    deep = _refused("-" * 9_000 + "v", "v")  # too deep even for Python
    assert ("nested" in deep.reason, deep.column) == (True, 1)
    assert parse_condition("not " * 58 + "v > 1", "v")
    with pytest.raises(ExpressionError, match="nested"):
        parse_condition("not " * 59 + "v > 1", "v")


def test_min_takes_fifty_arguments_folded_from_the_left_as_deep_as_any_tree_may_be() -> None:
    assert spell(parse_value("min(a, b, c, d)", "abcd")) == "min(min(min(a, b), c), d)"
    assert parse_value("max(" + "v, " * 49 + "v)", "v")
    assert "at most 50" in str(_refused("max(" + "v, " * 50 + "v)", "v"))
    assert parse_value("-" * 10 + "max(" + "v, " * 49 + "v)", "v")  # 10 + 1 + 48 + 1 levels
    assert "nested" in str(_refused("-" * 11 + "max(" + "v, " * 49 + "v)", "v"))
    for several in (2, 3, 4, 5, 6):  # a fold may skip the deepest level, and is still detected
        nested = "v"
        for _ in range(59 // (several - 1)):
            nested = f"min({nested}{', v' * (several - 1)})"
        assert parse_value(nested, "v")
        over = f"min({nested}{', v' * (several - 1)})"
        assert "nested" in str(_refused(over, "v"))
    # The last argument is at the top of the fold, the first two at its bottom.
    assert parse_value("max(" + "v, " * 49 + "-" * 58 + "v)", "v")
    assert "nested" in str(_refused("max(" + "v, " * 49 + "-" * 59 + "v)", "v"))
    assert parse_value("max(v, " + "-" * 10 + "v, " + "v, " * 47 + "v)", "v")
    assert "nested" in str(_refused("max(v, " + "-" * 11 + "v, " + "v, " * 47 + "v)", "v"))


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("w", 1),
        ("  w", 3),
        ("v + w", 5),
        ("\u03bc + w", 5),
        ("  \u03bc*\u03bc + w", 9),
        ("v +", 4),
        ("  v + ", 7),
        ("  v )", 5),
        ("v # w", 3),
        ("", 1),
        ("   ", 1),
        ("v\n+ w", 5),
        ("v + \ud800", 5),
    ],
)
def test_the_column_is_counted_in_characters_of_the_text_as_written(text: str, column: int) -> None:
    assert _refused(text, "v", "\u03bc").column == column


def test_a_text_has_a_hundred_comparisons_at_most() -> None:
    assert parse_condition(" and ".join(["v > 0"] * 100), "v")
    with pytest.raises(ExpressionError, match="too many comparisons"):
        parse_condition(" and ".join(["v > 0"] * 101), "v")


def test_pow_takes_two_arguments() -> None:
    assert parse_value("pow(a, b)", "ab") == parse_value("a**b", "ab")
    for arguments in ("", "a", "a, b, a"):
        assert "two arguments" in str(_refused(f"pow({arguments})", "a", "b"))


def test_which_marks_cannot_be_read() -> None:
    assert "half a character" in str(_refused("v + \ud800", "v"))
    assert "half a character" in str(_refused("v + \udfff", "v"))
    assert "half a character" not in str(_refused("v + \ue000", "v"))
    assert "half a character" not in str(_refused("v + \ud7ff", "v"))
    assert "unexpected ';'" in str(_refused("v;", "v"))


def test_small_powers_are_products_until_the_text_grows_too_long() -> None:
    def power(base: str, exponent: str) -> int | None:
        tree = parse_value(f"({base})**({exponent})", "abcdefghv")
        assert isinstance(tree, Binary)
        return product_power(tree.left, tree.right)

    assert [power("v", e) for e in ("8", "-8", "--8", "0", "-0", "1")] == [8, -8, 8, 0, 0, 1]
    assert [power("v", e) for e in ("9", "-9", "0.5", "v", "1 + 1")] == [None] * 5
    eight = "a + b + c + d + e + f + g + h"
    assert power(eight, "8") == 8  # 64 parts
    assert power(eight + " + v", "7") == 7  # 63
    assert power(eight + " + v", "8") is None  # 72
    assert power("a + b + c + d + e + f + g + h + v + a + b + c + d", "5") is None  # 65
    assert power("(a + b + c + d + e + f + g)**h", "8") == 8  # 7 + 1 parts
    assert power(f"({eight})**v", "8") is None  # 8 + 1
    assert power(f"({eight})**1", "8") == 8
    assert power(f"({eight} + v)**0", "8") == 8
    seven = "a + b + c + d + e + f + g"
    for one in ("h", "h**1", "(h * v)**0"):  # each is one part
        assert power(f"{seven} + {one}", "8") == 8  # 64
        assert power(f"{eight} + {one}", "8") is None  # 72
    assert power("(a * -b)**8", "4") == 4  # 16 * 4
    assert power("(a * -b)**8", "-5") is None
    assert power("(a + b)**0.5", "8") == 8  # by pow once: two parts, not eight
    assert power("min(a, b)**-4", "8") == 8  # 2 * 4 * 8
    assert power("min(a, b, c)**-4", "8") is None


@pytest.mark.parametrize(
    ("text", "python", "matlab"),
    [
        ("a - (b - c)", "a - (b - c)", "a - (b - c)"),
        ("a + b - c", "a + b - c", "a + b - c"),
        ("a + (b + c)", "a + (b + c)", "a + (b + c)"),
        ("(a + b) * c", "(a + b) * c", "(a + b) * c"),
        ("a / (b * c)", "a / (b * c)", "a / (b * c)"),
        ("-(a * b)", "-(a * b)", "-(a * b)"),
        ("-(-a)", "-(-a)", "-(-a)"),
        ("-a * b", "-a * b", "-a * b"),
        ("a**1", "a", "a^1"),
        ("(a + b)**1", "a + b", "(a + b)^1"),
        ("a**0", "1.0", "a^0"),
        ("(a * b)**2", "a * b * (a * b)", "(a * b)^2"),
        ("(a + b)**2", "(a + b) * (a + b)", "(a + b)^2"),
        ("(-a)**2", "-a * -a", "(-a)^2"),
        ("a**-2", "1.0 / (a * a)", "a^(-2)"),
        ("c / a**2", "c / (a * a)", "c / a^2"),
        ("a**0.5 * b", "pow(a, 0.5) * b", "a^0.5 * b"),
        ("a**b**c", "pow(a, pow(b, c))", "a^(b^c)"),
        ("abs(a - b)", "abs(a - b)", "|a - b|"),
        ("exp(a) * max(a, b)", "exp(a) * max(a, b)", "exp(a) * max(a, b)"),
        (
            "0.1 + 1e-7 + 0.30000000000000004",
            "0.1 + 1e-07 + 0.30000000000000004",
            "0.1 + 1e-07 + 0.30000000000000004",
        ),
        ("1234567", "1234567.0", "1234567.0"),
    ],
)
def test_values_have_exactly_the_parentheses_they_need(text: str, python: str, matlab: str) -> None:
    tree = parse_value(text, "abc")
    assert (spell(tree), spell(tree, MATLAB_LIKE)) == (python, matlab)


def test_a_negative_number_binds_like_a_sign() -> None:  # of derivatives: read are none
    assert spell(Negative(Number(-0.5))) == "-(-0.5)"
    assert spell(Binary("**", Name("a"), Number(-0.5)), MATLAB_LIKE) == "a^(-0.5)"


@pytest.mark.parametrize(
    ("text", "python", "matlab"),
    [
        ("a - b > c and a + b < c", "a - b > c and a + b < c", "a - b > c && a + b < c"),
        ("not a > b and c > 0", "not a > b and c > 0.0", "!(a > b) && c > 0"),
        ("not (a > b and c > 0)", "not (a > b and c > 0.0)", "!(a > b && c > 0)"),
        ("not not a > b", "not not a > b", "!(!(a > b))"),
        ("(a > b or b > c) and c > a", "(a > b or b > c) and c > a", "(a > b || b > c) && c > a"),
        ("a > b or b > c and c > a", "a > b or b > c and c > a", "a > b || b > c && c > a"),
        ("a > b and (b > c and c > a)", "a > b and (b > c and c > a)", "a > b && (b > c && c > a)"),
        ("a > b or (b > c or c > a)", "a > b or (b > c or c > a)", "a > b || (b > c || c > a)"),
        ("a + b <= -c", "a + b <= -c", "a + b <= -c"),
        ("state(2) == slip", "state(2) == slip", "state(2) == slip"),
        ("state != slip", "not state == slip", "!(state == slip)"),
    ],
)
def test_conditions_have_exactly_the_parentheses_they_need(
    text: str, python: str, matlab: str
) -> None:
    tree = parse_condition(text, "abc", ["stick", "slip"], 2, own_state=True)
    assert (spell(tree), spell(tree, MATLAB_LIKE)) == (python, matlab)


def test_states_are_referred_to_by_number_from_one_and_by_equality() -> None:
    known: dict[str, Any] = {"states": ["slip"], "elements": 2}
    assert parse_condition("state(1) == slip", "v", **known) == InState(1, "slip")
    assert parse_condition("state(2) != slip", "v", **known) == Not(InState(2, "slip"))
    for number in ("0", "3", "1.0", "True"):
        _refused(f"state({number}) == slip", "v", **known)
    for wrong in ("state(1) > slip", "state(1) == fly", "state == slip"):
        _refused(wrong, "v", **known)
    _refused("state(1) == slip", "v", states=())
    asked = {"state(1)": "slip", "state(2)": "stick"}
    assert evaluate(InState(1, "slip"), asked) is True
    assert evaluate(InState(2, "slip"), asked) is False
    assert evaluate(InState(1, "slip"), {"state(1)": "arrested"}) is False


def _requirements(text: str, holds: bool = True) -> Any:
    def told(part: Any) -> Any:
        if isinstance(part, Requirement):
            return spell(part.relation)
        return (part[0], *(told(p) for p in part[1]))

    return told(split(parse_condition(text, "abc"), holds))


def test_splitting_handles_both_directions_of_every_comparison() -> None:
    for op, not_op in ((">", "<="), (">=", "<"), ("<", ">="), ("<=", ">")):
        assert _requirements(f"a {op} b") == f"a {op} b"
        assert _requirements(f"a {op} b", holds=False) == f"a {not_op} b"
        assert _requirements(f"not a {op} b") == f"a {not_op} b"
        mirrored = op.translate(str.maketrans("<>", "><"))
        word = "both" if op[0] == "<" else "either"
        assert _requirements(f"abs(a) {op} b") == (word, f"a {op} b", f"a {mirrored} -b")
        assert _requirements(f"b {mirrored} abs(a)") == (word, f"a {op} b", f"a {mirrored} -b")
        assert _requirements(f"abs(abs(a)) {op} b") == _requirements(f"abs(a) {op} b")


def test_splitting_flattens_nesting_and_swaps_words_under_negation() -> None:
    text = "a > b and (b > c and (c > a or abs(a) > c))"
    assert _requirements(text) == ("both", "a > b", "b > c", ("either", "c > a", "a > c", "a < -c"))
    turned = ("either", "a <= b", "b <= c", ("both", "c <= a", "a <= c", "a >= -c"))
    assert _requirements(text, holds=False) == turned
    assert _requirements(f"not ({text})") == turned


def test_a_corner_against_zero_turns_where_the_other_side_does() -> None:
    for text, turning in (("max(a, 0)", "a"), ("min(a, 1)", "a - 1.0"), ("max(a, -1)", "a - -1.0")):
        assert [spell(u) for u in rough_points(parse_value(text, "a"))] == [turning]


def test_rough_calls_become_names_in_the_order_they_are_computed_and_smooth_ones_stay() -> None:
    flow = parse_value("C * sgn(v) - max(v, -exp(abs(z)))", ["C", "v", "z"])
    names = dict(zip(rough_points(flow), "abc", strict=True))
    assert [spell(u) for u in names] == ["v", "z", "v - -exp(abs(z))"]
    smooth, calls = substitute(flow, lambda u, call: f"{call.function}_{names[u]}")
    assert spell(smooth) == "C * sgn_a - max_c"
    assert [(name, spell(call)) for name, call in calls.items()] == [
        ("sgn_a", "sgn(v)"),
        ("abs_b", "abs(z)"),
        ("max_c", "max(v, -exp(abs_b))"),
    ]


# --------------------------------------------------------------------------- machines
def test_an_element_has_its_index_and_its_parameters_as_floats() -> None:
    machines = ElementMachines(stick_slip("signed"))
    assert [e.index for e in machines.elements] == [0, 1, 2, 3]
    k = machines.model.values["k"]
    assert [e.k for e in machines.elements] == [float(each) for each in k]
    assert {type(e.k) for e in machines.elements} == {float} == {type(machines.elements[0].v_c)}


def test_a_guard_shows_its_text_and_accepts_an_event_or_an_element() -> None:
    guard = Guard("leave", parse_condition("z >= s", "zs"))
    assert repr(guard) == "<guard z >= s>"
    for z, truth in ((0.9, False), (1.0, True)):
        element = Element()
        element.z, element.s = z, 1.0
        assert guard.holds(element) is guard(SimpleNamespace(model=element)) is truth


def test_a_machine_that_was_changed_is_refused() -> None:
    model = stick_slip("signed")
    leaving = model.chart.leaving("stick")[0][1].name
    changes: list[Callable[[Any], Any]] = [
        lambda m: m.add_transition("arrest", "slip", "stick"),
        lambda m: m.add_transition("arrest", "slip", "slip"),
        lambda m: m.add_transition("fly", "slip", "stick"),
        lambda m: m.add_transition(
            "arrest",
            "slip",
            "stick",
            conditions=m.get_transitions("arrest", "slip")[0].conditions[0].func,
        ),
        lambda m: m.remove_transition("arrest", "slip", "stick"),
        lambda m: m.get_transitions("arrest", "slip")[0].conditions.clear(),
        lambda m: setattr(m.get_transitions("arrest", "slip")[0], "dest", "slip"),
        lambda m: setattr(m.get_transitions(leaving, "stick")[0], "dest", "stick"),
    ]
    for change in changes:
        machines = ElementMachines(model)
        assert [len(row) for row in machines.table(model.chart)] == [2, 1]
        change(machines.machine)
        with pytest.raises(ChartError):
            machines.table(model.chart)


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
@pytest.mark.parametrize("first", ["fly", "dive"])
def test_of_two_edges_enabled_at_once_the_earlier_is_taken(engine: Any, first: str) -> None:
    edges = {name: Transition(name, "stick", name + "s", "z >= 0.1") for name in ("fly", "dive")}
    chart = Chart(
        "forked",
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("stick", {"z": "v"}), State("flys", {"z": "v"}), State("dives", {"z": "v"})),
        transitions=(edges.pop(first), *edges.values()),
        outputs={"F": "k * z"},
    )
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 0.05))
    trace = simulate(model, Prescribed("0.2"), 1.0, engine=engine)
    assert [str(edge) for edge in trace.transitions.edge] == [first]


def test_an_element_shows_the_values_of_the_present_moment() -> None:
    model, rig = pulled_mass()
    seen = []

    class Looking(Element):
        def on_enter_slip(self, event: Any) -> None:
            seen.append((self.t, self.x, self.v, self.s, self.z, self.index))

    trace = simulate(model, rig, 20.0, engine=ElementMachines(model, Looking))
    log = trace.transitions[trace.transitions.target == "slip"]
    assert len(log) >= 4
    assert {index for *_, index in seen} == {0, 1, 2, 3}
    for (t, x, v, s, z, index), row in zip(seen, log, strict=True):
        assert (t, v, s, z, index) == (row.t, row.v, row.s, row.z, row.element)
        assert x == trace.x[trace.t == t][0]


def test_an_element_shows_all_its_variables() -> None:
    chart = Chart(
        "two",
        ("v",),
        ("z", "w"),
        ("k",),
        (State("rest", {"z": "v", "w": "2*v"}), State("gone", {"z": "v", "w": "0"})),
        (Transition("leave", "rest", "gone", "z >= 0.25*k"),),
        {"F": "z"},
    )
    model = ChartModel(chart, {"k": [1.0, 2.0]}, n=2)
    seen = []

    class Looking(Element):
        def on_enter_gone(self, event: Any) -> None:
            seen.append((self.index, self.z, self.w))

    simulate(model, Prescribed("1"), 1.0, engine=ElementMachines(model, Looking))
    assert [index for index, *_ in seen] == [0, 1]
    assert [value for _, *pair in seen for value in pair] == pytest.approx([0.25, 0.5, 0.5, 1.0])


# --------------------------------------------------------------------------- crossings
Margin = Callable[[float], float]


def _first(*margins: Margin, strict: bool = False, resolution: float = 1e-12) -> tuple:
    """Return the point in [0, 1] where a truth value first changes, and the number of probes."""
    w = watched([strict] * len(margins), 1)
    looks = []

    def fill(t: float, y: list[float], mode: list, p: None, watch: list, out: list) -> None:
        looks.append(t)
        for r, margin in enumerate(margins):
            out[r] = margin(t)

    for r, margin in enumerate(margins):
        w.watch[r] = 1
        w.active.append(r)
        g = margin(0.0)
        w.truth[r], w.start[r] = g > 0.0 or (g == 0.0 and not strict), g

    def interpolate(_: None, theta: float, out: list[float]) -> None:
        out[0] = theta

    path = Path(Motion(fill, fill, None), [], interpolate, None, 0.0, 1.0, [1.0])
    place = first_change(path, w, resolution)
    looks.clear()
    # Whatever the scratch space contained before the search.
    assert first_change(path, w, resolution) == place
    return place, len(looks)


@pytest.mark.parametrize("resolution", [1e-3, 1e-6, 1e-12])
@pytest.mark.parametrize(
    "margin",
    [
        lambda t: t - 0.3,
        lambda t: 0.3 - t,
        lambda t: t**3 - 0.027,
        lambda t: (t - 0.3) * (2.0 - t),
        lambda t: -1.0 if t < 0.3 else 1e-9,
        lambda t: 1e-9 if t < 0.3 else -1.0,
    ],
)
def test_the_place_is_right_of_the_change_by_at_most_the_resolution(
    margin: Margin, resolution: float
) -> None:
    place, _ = _first(margin, resolution=resolution)
    assert (margin(place) >= 0.0) != (margin(0.0) >= 0.0)
    assert (margin(place - 1.001 * resolution) >= 0.0) == (margin(0.0) >= 0.0)


def test_a_straight_margin_is_found_by_its_slope_not_by_halving() -> None:
    # The end, both sides of the point, and the middle of the quiet step before it.
    assert _first(lambda t: t - 0.3)[1] <= 4
    assert _first(lambda t: 0.3 - t)[1] <= 6  # exactly zero is still true: one more probe
    assert _first(lambda t: t - 0.3, lambda t: 0.8 - t)[1] <= 4


def test_a_jump_is_found_by_halving_when_the_slope_misleads() -> None:
    # Forty halvings close a bracket to 1e-12; every other guess may be the slope's.
    assert _first(lambda t: -1.0 if t < 0.3 else 1e-9)[1] <= 90


@pytest.mark.parametrize("middle", [0.1003, 0.3007, 0.4997, 0.62, 0.9001])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_window_of_a_256th_of_a_step_is_found_wherever_it_lies(
    middle: float, sign: float
) -> None:
    half = 0.51 / 256
    place, _ = _first(lambda t: sign * ((t - middle) ** 2 - half**2))
    assert place == pytest.approx(middle - half, abs=1e-11)


def test_a_margin_that_is_never_quiet_is_evaluated_512_times_per_step() -> None:
    def rough(t: float, window: float) -> float:
        halvings = Fraction(t).denominator.bit_length() - 1
        return 1.0 if abs(t - window) < 1e-9 else -1.0 if halvings % 2 else -1e-3

    for k in range(1, 512, 2):
        place, _ = _first(lambda t, k=k: rough(t, k / 512))
        assert place == pytest.approx(k / 512, abs=1.1e-9)
    assert _first(lambda t: rough(t, 2.0)) == (NO_CHANGE, 512)  # the end, and 511 in between


def test_of_two_windows_the_earlier_counts_though_the_later_is_seen_first() -> None:
    def two(t: float) -> float:
        return -(t - 0.18) * (t - 0.22) * (t - 0.48) * (t - 0.52)

    assert _first(two)[0] == pytest.approx(0.18, abs=1e-11)
    assert _first(lambda t: t - 0.9, two)[0] == pytest.approx(0.18, abs=1e-11)


def test_a_window_before_the_first_candidate_is_found() -> None:
    # False position lands after the window, at 0.59, and converges to 0.75 first.
    assert _first(lambda t: (t - 0.39) * (t - 0.43) * (t - 0.75))[0] == pytest.approx(
        0.39, abs=1e-11
    )


def test_a_margin_that_starts_or_touches_at_zero_changes_as_its_kind_says() -> None:
    assert _first(lambda t: t)[0] == NO_CHANGE  # already true at zero
    assert 0.0 < _first(lambda t: t, strict=True)[0] <= 1e-12
    assert _first(lambda t: 0.0)[0] == _first(lambda t: 0.0, strict=True)[0] == NO_CHANGE
    touching = -((0.5) ** 2)
    assert _first(lambda t: touching + t * (1 - t))[0] == pytest.approx(0.5, abs=1e-6)
    assert _first(lambda t: touching + t * (1 - t), strict=True)[0] == NO_CHANGE


def test_a_distant_curved_margin_is_quiet_after_one_evaluation() -> None:
    assert _first(lambda t: -10.0 + t * (1 - t)) == (NO_CHANGE, 2)
    assert _first(lambda t: 10.0 - t * (1 - t)) == (NO_CHANGE, 2)
    assert _first(lambda t: -1e-3 - t * t * 0.1 - t) == (NO_CHANGE, 2)  # near, but monotone
    assert _first(lambda t: -1e-9) == (NO_CHANGE, 2)


def test_the_cubic_between_two_ends_is_that_of_both_slopes() -> None:
    # y = t**3 between 1 and 3: the cubic's midpoint is 8, a line's is 14, and t = 2 is passed on.
    w = watched([False], 1)
    w.watch[0] = 1
    w.active.append(0)
    seen = []

    def fill(t: float, y: list[float], mode: list, p: None, watch: list, out: list) -> None:
        seen.append((t, y[0]))
        out[0] = y[0] - 100.0

    w.start[0] = 1.0 - 100.0
    now = Now([1.0], y=[1.0], f=[3.0], mode=[], held=[], floor=[])
    scratch = Scratch([], y_new=[27.0], f_new=[27.0], error=[], dense=Dense([], [], [], [], []))
    assert is_quiet_step(Motion(fill, fill, None), now, 3.0, scratch, w)
    assert seen == [(3.0, 27.0), (2.0, 8.0)]


# --------------------------------------------------------------------------- advance
class _Run:
    """A run of y' = slope(t, y), y(0) = 1, without machines, called directly."""

    def __init__(
        self,
        slope: Callable[[float, float], float] = lambda t, y: 0.0,
        margin: Callable[[float, float], float] | None = None,
        *,
        t: float = 0.0,
        step: float | None = None,
        max_step: float = math.inf,
        tolerance: float = 1e-6,
        times: list[float] | None = None,
        knots: tuple[float, ...] = (),
        capacity: int | None = None,
        origin: float = 0.0,
    ) -> None:
        self.asked: list[float] = []

        def flow(t: float, y: list, mode: list, held: list, p: None, dy: list) -> None:
            self.asked.append(t)
            dy[0] = slope(t, y[0])

        def margins(t: float, y: list, mode: list, p: None, watch: list, out: list) -> None:
            assert margin is not None, "nothing is watched, but margins are requested"
            out[0] = margin(t, y[0])

        equations = Equations(
            flow=flow,
            flow_live=flow,
            arm=lambda *_: None,
            margins=margins,
            normal=lambda *_: None,
            p=None,
            held=0,
            strict=[False],
            relations=["g"],
            surfaces=Surfaces([], [], []),
            knots=list(knots),
        )
        method = RK4 if step else DP45
        options = Options(method, step, tolerance, [tolerance], max_step, 0.0, 10**6, True, times)
        self.b: Buffers = buffers(equations, origin, [1.0], [], 100.0, options, capacity)
        self.motion, self.y = Motion(flow, margins, None), self.b.now.y
        self.b.now.clock[T], self.b.now.f[0] = t, slope(t, 1.0)
        if margin is not None:
            w = self.b.relations
            w.watch[0] = 1
            w.active.append(0)
            w.start[0] = margin(t, 1.0)
            w.truth[0] = w.start[0] >= 0.0

    def to(
        self, t_stop: float, *, h: float = 0.1, before: float = 1.0, steps: int = 1000
    ) -> tuple[int, float, float, float]:
        b, clock = self.b, self.b.now.clock
        clock[T_STOP], clock[H], clock[ERROR_BEFORE] = t_stop, h, before
        status = kernel.advance(self.motion, b.plan, b.now, b.relations, b.out, b.scratch, steps)
        return status, clock[T], clock[H], clock[ERROR_BEFORE]

    @property
    def rows(self) -> list[float]:
        return self.b.out.rows_t[: self.b.out.cursor[0]]


def test_fixed_steps_end_on_the_grid_wherever_they_begin() -> None:
    run = _Run(step=0.25)
    assert run.to(1.1)[:2] == (kernel.REACHED, 1.1)
    assert run.rows == [0.25, 0.5, 0.75, 1.0, 1.1]
    late = _Run(step=0.25, t=0.6)
    late.to(1.25)
    assert late.rows == [0.75, 1.0, 1.25]
    shifted = _Run(step=0.25, t=2.1, origin=2.1)
    shifted.to(3.0)
    assert shifted.rows == [2.35, 2.6, 2.85, 3.0]


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_no_sliver_is_stepped_at_either_end(share: float) -> None:
    sliver = share * kernel.tick_at(0.125)
    run = _Run(step=0.25, t=0.5 - sliver)
    run.to(1.0 + sliver)
    assert run.rows == [0.75, 1.0 + sliver]
    adaptive = _Run()
    adaptive.to(0.125 + sliver, h=0.125)
    assert adaptive.rows == [0.125 + sliver]


@pytest.mark.parametrize("step", [None, 0.25])
def test_steps_end_on_knots_and_continue_as_before(step: float | None) -> None:
    run = _Run(step=step, knots=(0.0, 0.3, 0.31, 5.0), max_step=0.25)
    run.to(1.0, h=0.25)
    assert {0.3, 0.31, 1.0} <= set(run.rows)
    assert 4 <= len(run.rows) <= 6


def test_no_step_is_longer_than_the_longest_allowed() -> None:
    run = _Run(max_step=0.3)
    run.to(3.0)
    assert max(b - a for a, b in zip([0.0, *run.rows], run.rows, strict=False)) <= 0.3 + 1e-12
    assert 10 <= len(run.rows) <= 12


def test_a_step_cut_short_by_a_stop_does_not_shorten_the_one_after_it() -> None:
    assert _Run().to(1e-9, h=0.5)[2] == 0.5  # ten times the sliver would be 1e-8
    assert _Run().to(0.2, h=0.5)[2] == 2.0  # but it may grow from the tried length: 10 * 0.2
    assert _Run().to(0.5, h=0.5)[2] == 5.0


def test_the_step_after_a_rejected_one_does_not_grow_at_once() -> None:
    run = _Run(lambda t, y: math.inf if t > 0.3 else 1.0)
    assert run.to(100.0, h=1.0, steps=1)[1:3] == (0.2, 0.2)  # a fifth; no error from there on
    assert run.to(100.0, h=0.05, steps=1)[2] == pytest.approx(0.5)  # but the next one may grow


def test_a_narrowly_accepted_step_is_followed_by_a_shorter_one() -> None:
    narrow = 0
    for i in range(60):
        h = 0.04 + 0.001 * i
        run = _Run(lambda t, y: math.cos(40.0 * t))
        _, t, h_next, error = run.to(10.0, h=h, steps=1)
        assert error <= 1.0
        if t == h and error > 0.8:
            narrow += 1
            assert h_next == h * next_factor(error, 1.0, 5) < h
    assert narrow >= 1


def test_the_remembered_error_is_that_of_the_last_step_but_never_vanishes() -> None:
    assert _Run().to(1.0, steps=1)[3] == 1e-4
    run = _Run(lambda t, y: math.cos(40.0 * t))
    assert 1e-4 < run.to(10.0, h=0.04, steps=1)[3] <= 1.0


def test_it_returns_when_the_steps_or_the_rows_are_used_up() -> None:
    run = _Run(step=0.25)
    assert run.to(100.0, steps=3)[:2] == (kernel.FULL, 0.75)
    assert run.to(100.0, steps=1)[:2] == (kernel.FULL, 1.0)
    full = _Run(step=0.25, capacity=2)
    assert full.to(100.0)[:2] == (kernel.FULL, 0.5)
    assert full.rows == [0.25, 0.5]
    wanted = _Run(step=0.25, times=[0.3], capacity=1)  # one row per time, however many steps
    assert wanted.to(1.0)[:2] == (kernel.REACHED, 1.0)


def test_rows_at_wanted_times_are_right_continuous_and_each_written_once() -> None:
    run = _Run(lambda t, y: 2.0 * t, times=[0.0, 0.1, 0.3, 0.5, 1.0], step=0.5)
    run.to(0.5)
    assert run.rows == [0.0, 0.1, 0.3]
    run.to(1.0)
    assert run.rows == [0.0, 0.1, 0.3, 0.5]
    for t, (y,) in zip(run.rows, run.b.out.rows_y, strict=False):
        assert y == pytest.approx(1.0 + t * t, abs=1e-14)


def test_a_crossing_ends_the_arc_there_with_state_and_row() -> None:
    for step in (0.25, None):
        run = _Run(lambda t, y: 2.0 * t, lambda t, y: y - 1.36, step=step)
        status, t, _, _ = run.to(2.0)
        assert (status, t) == (kernel.CROSSED, pytest.approx(0.6, abs=1e-12))
        assert run.y[0] == pytest.approx(1.36, abs=1e-12)
        assert run.y[0] >= 1.36
        assert run.rows[-1] == t


def test_rows_after_a_crossing_wait_for_the_switch() -> None:
    run = _Run(lambda t, y: 1.0, lambda t, y: y - 1.6, step=1.0, times=[0.5, 0.7])
    assert run.to(1.0)[0] == kernel.CROSSED
    assert run.rows == [0.5]


def test_an_adaptive_step_with_an_early_crossing_is_repeated_up_to_it() -> None:
    run = _Run(lambda t, y: math.cos(t), lambda t, y: t - 0.2)
    _, t, _, _ = run.to(2.0, h=0.5)
    assert t == pytest.approx(0.2, abs=1e-12)
    assert max(run.asked) >= 0.5
    assert max(run.asked[-6:]) <= 0.2 + 1e-12  # no stage of the accepted step lies beyond it
    later = _Run(lambda t, y: 1.0, lambda t, y: t - 0.9)  # after a quiet step in the same call
    assert later.to(2.0, h=0.1)[1] == pytest.approx(0.9, abs=1e-12)
    assert later.rows[0] == 0.1
    assert max(later.asked[-6:]) <= 0.9 + 1e-12
    late = _Run(lambda t, y: math.cos(t), lambda t, y: t - 0.097)
    late.to(2.0, h=0.1)
    assert max(late.asked[-6:]) == 0.1  # near the step's end the step is kept


def test_between_stops_a_quiet_step_passes_its_margins_to_the_next() -> None:
    run = _Run(lambda t, y: 1.0, lambda t, y: t - 1.1, step=0.25)
    assert run.to(2.0)[1] == pytest.approx(1.1, abs=1e-12)
    assert run.b.relations.start[0] == pytest.approx(-0.1)


def test_an_infinite_slope_and_a_zero_step_are_distinguished() -> None:
    known = (kernel.REACHED, kernel.CROSSED, kernel.FULL, kernel.TOO_SMALL, kernel.NOT_FINITE)
    assert len(set(known)) == 5

    def wall(t: float, y: float) -> float:
        return math.inf if t > 0.5 else 1.0

    assert _Run(wall, step=0.3).to(1.0)[:2] == (kernel.NOT_FINITE, 0.3)
    gap = {"slope": lambda t, y: math.nan if t > 0.5 else 1.0}
    assert _Run(**gap, step=0.3).to(1.0)[:2] == (kernel.NOT_FINITE, 0.3)
    for run in (_Run(wall), _Run(**gap)):
        status, t, _, _ = run.to(1.0)
        assert status == kernel.NOT_FINITE
        assert t == pytest.approx(0.5, abs=1e-9)
    # Only the slope at the step's end is infinite: no stage has that y.
    cliff = _Run(lambda t, y: math.inf if 0.778 < y < 0.779 else -y, step=0.25)
    assert cliff.to(1.0)[:2] == (kernel.NOT_FINITE, 0.0)
    assert _Run(t=1.0).to(2.0, h=1e-30)[:2] == (kernel.TOO_SMALL, 1.0)
    blind = _Run(lambda t, y: 1e200 * math.sin(1e30 * t), tolerance=1e-12, t=0.5)
    assert blind.to(1.0)[0] == kernel.TOO_SMALL


# --------------------------------------------------------------------------- undetectable mutants
# These mutants survive, grouped by reason:
#
# - Cannot occur: a bend, a depth, a count of steps and `quiet` are never negative; a cursor is
#   never past its list, a time never past its stop, no point beyond `NO_CHANGE`; a chain of
#   comparisons is never empty; nothing binds tighter than an atom; an error estimate is infinite
#   rather than NaN; Python reports no column past a text's end; integer powers 0 and 1 are handled
#   before; `sgn` and `abs` have one argument. So `> 0` and `!= 0`, `>=` and `==`, `<` and `!=` are
#   the same there.
# - Equality of floats: where two computed numbers are exactly equal, `<` and `<=` differ by a
#   halving, a probe or a repeated step, never by the point found.
# - Never read: scratch space is filled before it is read, and may be longer; the point returned
#   with `NO_CHANGE`; which negative number means "no edge"; a sum that is only compared with
#   infinity; a dense output fitted for a time that is not in the step.
# - Hints: the grid's index may be too low, a loop counts up from there; a guess in `_bracket` is
#   clamped to the bracket. Both only take longer.
# - Names: the numbers of statuses and of `NO_CHANGE`; of the precedence levels only the order
#   matters, and only between those that can be adjacent.
# - Words: no function sorts before `abs`, no word for not before `!`, and only `min` and `max` have
#   two arguments. So `==` and `<=`, or `>=`, are the same there.
# - Scale: a margin times 2 is on the same side of every comparison.
# - The smallest tolerance of a bracket matters only for a step longer than the times at its ends.
# - Implied by the rest: `compare=True` for the trees of a `Chart`, because equal texts give equal
#   trees; `strict=True` for two lists derived from one; input that a reader of values never
#   receives; how much of a long name is compared with the known ones.
