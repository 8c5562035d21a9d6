"""The known properties of the GMS guards, and of their faulty readings, are found.

Every counterexample is checked with the guards and flows of the chart.
"""

from __future__ import annotations

import doctest
import functools
import inspect
import itertools
from collections.abc import Mapping
from typing import Any

import pytest

pytest.importorskip("z3", reason="needs z3 (extra: check)")

from gms_fsm import Chart, Finding, Parameter, Report, State, Transition, prove
from gms_fsm.charts import LAWS, LUGRE, gms_element
from gms_fsm.charts.broken import BROKEN
from gms_fsm.language import evaluate, parse_condition
from gms_fsm.verification import _checks, _flows, _prover
from gms_fsm.verification.prove import CHECKS, Check, default_domain

STEP = 2.0**-20  # s; exact in floats
OF_EVERY_CHART = [check for check in CHECKS if check not in ("release", "zeno")]


@functools.cache
def proved(law: str) -> Report:
    """Return the report on the paper's chart."""
    return prove(gms_element(law))  # type: ignore[arg-type]


@functools.cache
def report(name: str) -> Report:
    """Return the report on a faulty reading, in the domain where its fault shows."""
    return prove(BROKEN[name].chart, BROKEN[name].domain)


def passes(found: Report, *checks: Check) -> None:
    """Assert that nothing is refuted or undecided in these checks."""
    for check in checks:
        assert {f.status for f in found.of(check)} == {"proved"}, check


def only(found: Report, check: Check) -> Finding:
    """Return the only refuted finding, which belongs to this check."""
    (finding,) = found.refuted
    assert finding.check == check
    return finding


def both_hold(chart: Chart, edges: tuple[str, str], point: Mapping[str, float]) -> bool:
    return all(evaluate(chart.guards[edge], point) for edge in edges)


def after_a_moment(chart: Chart, state: str, point: Mapping[str, float]) -> dict[str, float]:
    """Take a short step with the flow of a state; inputs change at the rates of the example."""
    rates = {name: float(evaluate(chart.flows[state, name], point)) for name in chart.variables}
    rates |= {name: point.get(f"d{name}/dt", 0.0) for name in chart.inputs}
    return {name: value + STEP * rates.get(name, 0.0) for name, value in point.items()}


# --------------------------------------------------------------------------- the paper's guards
@pytest.mark.parametrize("law", LAWS)
def test_the_papers_guards_pass(law: str) -> None:
    found = proved(law)
    assert found.domain == ("s > 0", "C > 0", "v_c > 0")
    passes(found, "determinism", "livelock", "reachability", "chattering")
    assert found.of("determinism")[0].where == (
        "stick",
        "break_away_forward",
        "break_away_backward",
    )
    assert [f.where for f in found.of("livelock")] == [
        ("stick", "break_away_forward", "slip", "arrest"),
        ("stick", "break_away_backward", "slip", "arrest"),
    ]


@pytest.mark.slow
def test_the_published_law_is_unstable_for_v_below_0_and_the_signed_law_is_not() -> None:
    published = gms_element("published")
    finding = only(prove(published), "stability")
    assert (finding.where, finding.case) == (("slip",), "z for v < 0")
    assert "z = s" in finding.text
    point = finding.counterexample
    assert point["v"] < 0 < point["C"]
    assert point["z"] == point["s"] > 0
    flow = published.flows["slip", "z"]
    assert evaluate(flow, point) == 0
    assert evaluate(flow, {**point, "z": point["z"] + 0.25}) > 0  # away from it, on both sides
    assert evaluate(flow, {**point, "z": point["z"] - 0.25}) < 0
    signed = proved("signed")
    assert signed.refuted == ()
    assert [f.text for f in signed.of("stability") if f.where == ("slip",)] == [
        "stable: z = s attracts",
        "stable: z = -s attracts",
        "stable: z = 0 attracts",
    ]


def test_lugre_has_nothing_to_contradict() -> None:
    found = prove(LUGRE)
    assert found.domain == ("s > 0", "sigma_0 > 0")
    passes(found, *OF_EVERY_CHART)
    assert "z = -s / sigma_0" in str(found)


# --------------------------------------------------------------------------- broken readings
@pytest.mark.slow
def test_break_away_by_z_with_arrest_by_v_livelocks() -> None:
    found = report("overlap")
    finding = only(found, "livelock")
    assert finding.where == ("stick", "break_away", "slip", "arrest")
    point = finding.counterexample
    assert 0 < abs(point["v"]) <= point["v_c"]
    assert both_hold(found.chart, ("break_away", "arrest"), point)
    passes(found, "determinism", "reachability", "chattering", "stability")


@pytest.mark.slow
def test_the_paper_read_literally_livelocks_at_z_equal_s_and_v_equal_0() -> None:
    found = report("literal")
    finding = only(found, "livelock")
    assert both_hold(found.chart, ("break_away", "arrest"), finding.counterexample)
    known = {"z": 1.0, "s": 1.0, "v": 0.0, "v_c": 1e-6}
    assert both_hold(found.chart, ("break_away", "arrest"), known)
    at_rest = prove(found.chart, ["s > 0", "v_c > 0", "C > 0", "v >= 0", "v <= 0", "z <= s"])
    point = only(at_rest, "livelock").counterexample
    assert (point["v"], point["z"]) == (0, point["s"])


@pytest.mark.slow
def test_memoryless_guards_chatter_while_s_rises() -> None:
    found = report("memoryless")
    finding = only(found, "chattering")
    passes(found, "determinism", "livelock", "reachability", "stability")
    point = finding.counterexample
    assert point["ds/dt"] > 0
    assert point["z"] == point["s"]
    assert "z = s" in finding.text
    stuck = after_a_moment(found.chart, "stick", point)
    slipped = after_a_moment(found.chart, "slip", point)
    for edge, there, other in (("break_away", stuck, slipped), ("arrest", slipped, stuck)):
        assert evaluate(found.chart.guards[edge], there)
        assert not evaluate(found.chart.guards[edge], other)


@pytest.mark.slow
def test_with_s_equal_0_both_arms_hold_unless_the_velocity_separates_them() -> None:
    arms = ("break_away_forward", "break_away_backward")
    found = report("arms")
    assert found.refuted == ()
    (finding,) = found.settled
    assert (finding.check, finding.status) == ("determinism", "settled by order")
    assert finding.where == ("stick", *arms)
    assert finding.counterexample == {"s": 0, "z": 0}
    assert both_hold(found.chart, arms, finding.counterexample)
    passes(prove(found.chart), "determinism")  # s > 0
    # The paper's arms also require v > v_c and v < -v_c, so they never hold at the same time.
    passes(prove(gms_element("published"), ["s >= 0", "v_c > 0"]), "determinism")
    passes(prove(gms_element("published"), []), "livelock")
    loose = prove(gms_element("published"), ["s >= 0"])  # v_c < 0 allowed
    point = loose.of("determinism")[0].counterexample
    assert point["v_c"] < 0
    assert both_hold(loose.chart, arms, point)


# --------------------------------------------------------------------------- other charts
def chart(go: str = "z >= s", back: str = "z < 0.5 * s", **changes: Any) -> Chart:
    """Two states, two edges."""
    sound: dict[str, Any] = {
        "name": "two",
        "inputs": ("v", "s", "t", "x"),
        "variables": ("z",),
        "parameters": (Parameter("C", "m/s", ">= 0", assumed="> 0"),),
        "states": (State("one", {"z": "v"}), State("two", {"z": "C * (sgn(v) - z / s)"})),
        "transitions": (Transition("go", "one", "two", go), Transition("back", "two", "one", back)),
        "outputs": {"F": "z"},
    }
    return Chart(**{**sound, **changes})


def states(one: str = "v", two: str = "-z") -> dict[str, Any]:
    return {"states": (State("one", {"z": one}), State("two", {"z": two}))}


@pytest.mark.parametrize("flow", ["C * tanh(v)", "sqrt(s)", "z ** 0.5"])
def test_what_is_not_encoded_is_undecided_with_a_reason(flow: str) -> None:
    found = prove(chart(back="z < s", **states(two=flow)))
    passes(found, "determinism", "livelock", "reachability")
    (chattering,) = found.of("chattering")
    words = "powers" if "**" in flow else f"{flow.partition('(')[0].split()[-1]} is not encoded"
    for finding in (chattering, found.of("stability")[-1]):
        assert finding.status == "undecided"
        assert words in finding.text
        assert not finding.counterexample


def test_a_guard_that_is_not_encoded_leaves_dependent_statements_undecided() -> None:
    found = prove(chart(go="exp(z) > s"))
    open_ = {(f.check, f.where) for f in found.findings if f.status == "undecided"}
    assert open_ == {
        ("livelock", ("one", "go", "two", "back")),
        ("chattering", ("one", "go", "two", "back")),
        ("reachability", ("go",)),
        ("reachability", ("one",)),
        ("reachability", ("two",)),
    }


def test_what_is_too_much_is_left_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_checks, "MOST_CYCLES", 0)
    monkeypatch.setattr(_flows, "MOST_WAYS", 3)
    wide = "(z > s or z < -s) and (v > 0 or v < 0)"
    found = prove(chart(go=wide, back="z < s"))
    told = {f.check: f.text for f in found.findings if f.status == "undecided"}
    assert told["livelock"] == "more than 0 cycles; the others were not checked"
    assert told["chattering"] == "a guard has more than 3 alternatives"


def test_a_high_power_is_not_attempted_whatever_its_sign() -> None:
    for power in ("99", "(-99)"):
        (found, *_) = prove(chart(go=f"z**{power} > s")).of("livelock")
        assert found.status == "undecided"
        assert found.text.startswith("a polynomial of degree 99 is not attempted")


@pytest.mark.parametrize("after", range(0, 40, 3))
def test_what_is_given_up_is_left_undecided(after: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many questions were answered before, no answer changes into another one."""
    own, asked = _prover.Prover.find, itertools.count()

    def find(self: Any, *formulas: Any) -> Any:
        if next(asked) >= after:
            raise _prover.GaveUp("z3 gave up")
        return own(self, *formulas)

    answers = {(f.check, f.where): f.status for f in proved("published").findings}
    monkeypatch.setattr(_prover.Prover, "find", find)
    for each in prove(gms_element("published")).findings:
        assert each.status in (answers.get((each.check, each.where)), "undecided"), each


def test_a_guard_without_a_value_is_not_enabled() -> None:
    guard = parse_condition("1 / z > 0", ["z"])
    assert _prover.enabled([guard], {"z": 1.0})
    assert not _prover.enabled([guard], {"z": 0.0})


def on(surface: str, one: str, two: str, rest: str = "") -> Chart:
    """Two states whose guards share a surface, and the rates of z in them."""
    return chart(f"z >= {surface}{rest}", f"z < {surface}{rest}", **states(one, two))


def assigned(action: dict[str, str]) -> Chart:
    edges = (
        Transition("go", "one", "two", "z >= s or z <= -s", action),
        Transition("back", "two", "one", "abs(z) <= 2 * s"),
    )
    return chart(transitions=edges)


def again(**action: str) -> Chart:
    return chart(transitions=(Transition("again", "one", "one", "z > s", action),))


def resting(guard: str, one: str, two: str) -> Chart:
    """Two variables, of which w rests."""
    pair = tuple(State(n, {"z": flow, "w": "0"}) for n, flow in (("one", one), ("two", two)))
    both = {"variables": ("z", "w"), "states": pair}
    return chart(f"z >= 1 and {guard}", f"z < 1 and {guard}", **both)


AT_1 = ["t >= 1", "t <= 1"]
ROUNDED = "z <= 1 and z > 0.5 and z + 1e-20 >= z and z >= 1"
ANSWERS: dict[str, tuple[Chart, list[str] | None, Check, str, str]] = {
    "a quotient by s": (chart("z / s >= 1"), None, "livelock", "proved", ""),
    "a quotient by v": (chart("z / v >= 1"), None, "livelock", "undecided", "v can be 0"),
    "... which is not 0": (chart("z / v >= 1"), ["v > 0", "s > 0"], "livelock", "refuted", ""),
    "hysteresis": (chart(), None, "chattering", "proved", ""),
    "no hysteresis": (chart(back="z < s"), None, "chattering", "refuted", ""),
    "flows that meet": (on("1", "1", "-1"), None, "chattering", "refuted", ""),
    "flows that part": (on("1", "-1", "1"), None, "chattering", "proved", ""),
    "flows in one direction": (on("1", "2", "1"), None, "chattering", "proved", ""),
    "t runs, and they meet": (on("t", "2", "0.5"), None, "chattering", "refuted", ""),
    "t runs, and they part": (on("t", "0.5", "2"), None, "chattering", "proved", ""),
    "x moves with v": (on("x", "v + 1", "v - 1"), None, "chattering", "refuted", ""),
    "x moves with v, and they part": (on("x", "v - 1", "v + 1"), None, "chattering", "proved", ""),
    # From t = 1 on what comes next counts, and not what was before.
    "falls": (on("min(t, 2 - t)", "-0.5", "-1.5"), AT_1, "chattering", "refuted", ""),
    "rises": (on("max(t, 2 - t)", "1.5", "0.5"), AT_1, "chattering", "refuted", ""),
    "fell": (on("1 + abs(t - 1)", "-0.5", "-1.5"), AT_1, "chattering", "proved", ""),
    "w rests on the edge of both guards": (
        resting("w >= 0 and w <= 0", "1", "-1"), None, "chattering", "undecided", "first order"
    ),
    "both flows jump there": (
        resting("v >= 0 and v <= 0", "1 + sgn(v)", "sgn(v) - 1"),
        None, "chattering", "undecided", "first order",
    ),
    "a jump in a guard": (
        chart("sgn(z) >= 1", "sgn(z) < 1", **states("1", "-1")),
        None, "chattering", "undecided", "a value jumps in a guard",
    ),
    "z = 0 ends it": (assigned({"z": "0"}), None, "livelock", "proved", "end it"),
    "z = z does not": (assigned({"z": "z"}), None, "livelock", "refuted", "at one point"),
    "z = -z may": (assigned({"z": "-z"}), None, "livelock", "undecided", "only two passes"),
    "z = 3 s leaves": (assigned({"z": "3 * s"}), None, "livelock", "proved", "never all enabled"),
    "assigned on a surface": (assigned({"z": "0"}), None, "chattering", "undecided", ""),
    "an edge to itself": (again(), None, "livelock", "refuted", ""),
    "an edge to itself that ends": (again(z="0"), None, "livelock", "proved", ""),
    "a root": (chart("z ** 2 >= 2", "z ** 2 <= 2"), None, "livelock", "undecided", "1.41421"),
    "beyond floats": (
        chart("z > 1e300 * 1e300", "z > 0"),
        None, "livelock", "undecided", "z = outside the range of floats",
    ),
    "rounded": (
        chart("z + 1e-20 > 1", ROUNDED), None, "livelock", "undecided", "rounding hides it"
    ),
    "a high degree": (
        chart("(z * v) ** 8 * s > 1", "z > 0"), None, "livelock", "undecided", "degree 17"
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", ANSWERS)
def test_the_answer_is_known(name: str) -> None:
    asked, domain, check, status, words = ANSWERS[name]
    (finding,) = prove(asked, domain).of(check)
    assert finding.status == status
    assert words in finding.text
    assert not [each for each in finding.counterexample if each in ("dt/dt", "dx/dt")]


def test_states_and_guards_without_use_are_found() -> None:
    lost = chart(
        states=(*states()["states"], State("three", {"z": "0"})),
        transitions=(
            Transition("go", "one", "two", "z >= s and z < 0"),
            Transition("leave", "three", "one", "z > s"),
        ),
    )
    found = {(f.where, f.text.partition(":")[0]) for f in prove(lost).refuted}
    assert found == {
        (("go",), "its guard can never hold"),
        (("one",), "no edge leaves it"),
        (("two",), "no edge leaves it"),
        (("two",), "no chain of edges leads to it"),
        (("three",), "no chain of edges leads to it"),
    }


@pytest.mark.slow
def test_order_settles_which_edge_is_taken_and_can_hide_one() -> None:
    first, second, back = (
        Transition("far", "one", "two", "z >= 2 * s"),
        Transition("near", "one", "two", "z >= s"),
        Transition("back", "two", "one", "z < 0"),
    )
    found = prove(chart(transitions=(first, second, back)))
    (finding,) = found.settled
    assert found.refuted == ()
    assert (finding.check, finding.where) == ("determinism", ("one", "far", "near"))
    assert finding.text == "both are enabled at the same time; the machine takes the earlier, far"
    assert both_hold(found.chart, ("far", "near"), finding.counterexample)
    assert str(finding).startswith("settled by order  one, far, near: both are enabled")
    assert "1 settled by order, 0 refuted" in str(found)
    # In the other order the nearer one takes precedence wherever the far one could fire.
    hidden = prove(chart(transitions=(second, first, back)))
    assert [f.where for f in hidden.settled] == [("one", "near", "far")]
    dead = only(hidden, "reachability")
    assert dead.where == ("far",)
    said = "never taken: wherever its guard holds, an earlier edge takes precedence (near)"
    assert dead.text == said


def test_a_state_behind_a_hidden_edge_is_never_entered() -> None:
    edges = (
        Transition("stay", "one", "two", "v > 0 or v <= 0"),
        Transition("leave", "one", "three", "z > s"),
        Transition("back", "two", "one", "z < 0"),
        Transition("home", "three", "one", "z < 0"),
    )
    found = prove(
        chart(states=(*states()["states"], State("three", {"z": "0"})), transitions=edges)
    )
    dead = {f.where for f in found.refuted if f.check == "reachability"}
    assert dead == {("leave",), ("three",)}


def test_nonlinear_or_coupled_flows_are_undecided() -> None:
    for flow, words in (("v * abs(z)", "not linear"), ("-sgn(z)", "not linear")):
        finding = prove(chart(**states(two=flow))).of("stability")[-1]
        assert finding.status == ("proved" if finding.case.endswith("= 0") else "undecided")
        assert any(words in f.text for f in prove(chart(**states(two=flow))).of("stability"))
    pair = tuple(State(name, {"z": "w", "w": "-z - w"}) for name in ("one", "two"))
    for finding in prove(chart(variables=("z", "w"), states=pair)).of("stability"):
        assert (finding.status, "also" in finding.text) == ("undecided", True)


# --------------------------------------------------------------------------- examples, honesty
@pytest.mark.slow
def test_a_long_question_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_prover, "PATIENCE", 0.1)
    hard = " and ".join(
        f"({a}*{b}*{b} - {c}*{d}*{d} + {a}*{d}*{c} - 1)**2 <= 0"
        for a, b, c, d in ("efgh", "fghj", "ghjl", "hjle", "jlef")
    )
    found = prove(chart(f"{hard} and z > 0", "z > 0", parameters=(*"Cefghjl",)))
    (finding,) = found.of("livelock")
    assert (finding.status, finding.text) == ("undecided", "z3 gave up after 0.1 s")


def test_the_report_says_what_was_asked_and_of_what() -> None:
    found = proved("published")
    assert [check for check in CHECKS if found.of(check)] == OF_EVERY_CHART
    text = str(found)
    assert text.startswith("GMS element, published law\nassumed: s > 0, C > 0, v_c > 0\n")
    assert "over the reals, not floats" in text
    assert "18 proved, 0 settled by order, 1 refuted, 0 undecided" in text
    assert "for example at C = 1, v = -1, s = 1, z = 1" in text
    assert str(prove(gms_element("published"))) == text


def test_what_is_declared_of_the_names_in_use_is_assumed() -> None:
    C, unused = Parameter("C", "m/s", ">= 0 and < 1"), Parameter("k", "N/m", "> 0")
    share = Parameter("share", "1", "<= C", assumed="> 0")
    own = chart(parameters=(C, share, unused), go="z >= share * s")
    assert default_domain(own) == ("s > 0", "C >= 0", "C < 1", "share > 0")
    assert default_domain(chart(parameters=("C",))) == ("s > 0",)
    assert prove(own, "s > 0").domain == ("s > 0",)
    assert prove(own, []).domain == ()


def test_the_example_of_the_docstring_is_true() -> None:
    text = (inspect.getdoc(prove) or "").replace("# doctest: +SKIP", "")
    example = doctest.DocTestParser().get_doctest(text, {"prove": prove}, "prove", None, None)
    assert len(example.examples) == 4
    assert doctest.DocTestRunner().run(example).failed == 0
