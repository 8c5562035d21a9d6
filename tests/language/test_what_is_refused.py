"""A text outside the expression language is refused with its column, and nothing is ever executed.

Columns count characters of the text as written, from 1, and point at the start of the offending
construct; for a text that ends too early, the column is one past its end. Only `ExpressionError`
leaves the parser, no text makes Python execute, import or open anything, and none costs much.
"""

from __future__ import annotations

import ast
import contextlib
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import get_ident
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Transition, simulate
from gms_fsm.errors import ExpressionError, GMSError
from gms_fsm.language import (
    InState,
    Name,
    Node,
    Not,
    evaluate,
    names_in,
    parse_condition,
    parse_value,
    spell,
)
from gms_fsm.language._read import Owner
from gms_fsm.systems.signals import Formula
from tests.soak.fuzz import TOKENS

NAMES = ("z", "s", "v", "v_c")
NUMBER_WANTED = "found a comparison where a number is needed"
COMPARISON_WANTED = "found a number where a comparison is needed"
FOREIGN = "is not part of the language"

# What is said, or advised: texts and their columns.
NO_VALUES: dict[str, list[tuple[str, int]]] = {
    "attribute": [("z.real", 1), ("v + z.real", 5), ("z\xa0+\u2003u.real", 5)],
    FOREIGN: [
        ("__import__('os').system('ls')", 1), ("abs(v)(z)", 1), ("2(v)", 1), ("[v for v in z]", 1),
        ("{v: z}", 1), ("(v, z)", 1), ("v % 2", 1), ("z + v // 2", 5), ("z + v @ s", 5),
        ("1 + ~v", 5), ("...", 1), ("await v", 1), ("'a'", 1), ("1 + 'a'", 5), ("b'a'", 1),
        ("None", 1), ("1j", 1), ("v + 2.5j", 5), ("abs(*v)", 5), ("abs(**v)", 1),
        ("'\xe9\u20ac\U0001f600' + u", 1),
    ],
    "unknown function '__import__'": [("__import__('os')", 1)],
    "unknown function 'cosh'": [("v + cosh(z)", 5)],
    "lambda": [("lambda: 1", 1)],
    "index": [("z[0]", 1)],
    "a comparison is needed": [("v if z else s", 6), ("if(z, v, s)", 4)],
    "if got 2 arguments": [("if(z > 0, v)", 1)],
    "mod got 1 arguments": [("2 * mod(z)", 5)],
    "saturate got 4 arguments": [("saturate(z, 1, 2, 3)", 1)],
    "round(...)": [("round * z", 1)],
    "at most 2000 parts": [("mod(" * 12 + "z" + ", s)" * 12, 13)],
    "assignment": [("v * (z := 1)", 6)],
    "abs(...) instead": [("v | z", 3)],
    "f-string": [("f'{v}'", 1)],
    "True is not a number": [("True", 1)],
    "False is not a number": [("v * False", 5)],
    "too large": [("1e999", 1), ("-1e999", 2), ("v + " + "9" * 400, 5), ("0x" + "f" * 400, 1)],
    NUMBER_WANTED: [("z < s", 1), ("1 + (z < s)", 6), ("z == s", 1), ("not v", 1), ("v and z", 1)],
    "the function 'abs' needs": [("v + abs", 5)],
    "abs got 0 arguments": [("abs()", 1)],
    "abs got 2 arguments": [("1 + abs(v, z)", 5)],
    "min got 1 argument": [("min(v)", 1)],
    "<= or >= instead": [("abs(v, x=1)", 9), ("v = z", 3)],
    "pow got 1 arguments": [("pow(v)", 1)],
    "unknown name 'u'": [("u", 1), ("  z +\u3000u", 7)],
    "unknown name 'V'": [("z * V", 5)],
    "unknown name '__class__'": [("z + __class__", 5)],
    "unknown name '\xe9'": [("\xe9", 1), ("v + \xe9 * u", 5)],
    "cannot be read": [
        ("v + \u20ac + u", 5), ("v + \ud800", 5), ("v z", 3), ("v)", 2), ("1 + (v * (z)", 5),
        ("1 + (v]", 7), ("v + $", 5), ("v + \U0001f600", 5), ("1 + v) * (z", 6), ("(v", 1),
    ],
    "- instead": [("v \u2212 z", 3)],
    "empty": [("", 1), (" \t\n", 1)],
    "unexpected '#'": [("v # comment", 3)],
    "unexpected ';'": [("v; z", 2)],
    "unexpected": [("v \\ z", 3), ("v + \x00", 5)],
    "ends too early": [("v +", 4), ("  v *", 6), ("\xe9 + v **", 9), ("-", 2)],
}  # fmt: skip
NO_CONDITIONS: dict[str, list[tuple[str, int]]] = {
    COMPARISON_WANTED: [
        ("z", 1), ("abs(z)", 1), ("pow(z, 2)", 1), ("z + 1", 1), ("z < s and v", 11),
        ("z < s or not 1", 14),
    ],
    "after does not stand here": [("after(0.2)", 1), ("z < s and after(0.2)", 11)],
    "": [("z < s and False", 11), ("any(z < s)", 1)],
    NUMBER_WANTED: [("z < (s < v)", 6), ("(z < s) + 1 < 2", 2)],
    "only < <= > >=": [
        ("z == s", 6), ("z != s", 6), ("z < s == v", 10), ("z is s", 6), ("z is not s", 10),
        ("z in s", 6), ("z not in s", 10),
    ],
    "cannot be read": [("z <> s", 3)],
    "and instead": [("z < s && v > 0", 7), ("z < s & v", 7)],
    "or instead": [("abs(v) < s \u2228 z > s", 12)],
    "not instead": [("!(z < s)", 1)],
    ">= instead": [("z \u2265 s", 3), ("z => s", 3)],
    "a sign between factors": [("z < 2 s", 7), ("2 pi < z", 3)],
    FOREIGN: [("z < s, v > 0", 1)],
    "if ... else": [("z < s if v > 0 else z > s", 1)],
    "unknown name '\xe9'": [("z < s and \xe9 > u", 11), ("z <=\u3000\xe9", 6)],
    "ends too early": [("z < s and", 10), ("z <", 4), ("not", 4)],
    "empty": [("", 1)],
}  # fmt: skip


def _refused(
    parse: Callable[..., object], text: Any, names: Any = NAMES, **more: Any
) -> ExpressionError:
    with pytest.raises(ExpressionError) as caught:
        parse(text, names, **more)
    return caught.value


@pytest.mark.parametrize("parse", [parse_value, parse_condition])
def test_an_invalid_text_is_refused_with_its_column(parse: Callable[..., Node]) -> None:
    classes = {name for name, kind in vars(ast).items() if isinstance(kind, type)}
    for said, texts in (NO_VALUES if parse is parse_value else NO_CONDITIONS).items():
        for text, column in texts:
            error = _refused(parse, text)
            assert (error.column, error.text) == (column, text)
            assert said in f"{error.reason} {error.allowed}", text
            assert error.allowed
            assert f"column {column}" in str(error)
            # Python's syntax tree is not what the message refers to.
            words = set(error.reason.replace("'", " ").split())
            assert {word for word in words & classes if word[0].isupper()} == set()


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("\u03bc + w", 5),
        ("  \u03bc*\u03bc + w", 9),
        ("v\n+ w", 5),
        ("v\n + w", 6),
        ("  v )", 5),
        ("   ", 1),
    ],
)
def test_columns_count_characters_and_line_breaks(text: str, column: int) -> None:
    assert _refused(parse_value, text, ("v", "\u03bc")).column == column


def test_the_caret_is_under_the_column_even_in_a_long_text() -> None:
    for lead in (3, 200):
        text = "v" + "+v" * 2 + " " * lead + "+ \u00e9"
        error = _refused(parse_value, text)
        *_, shown, caret = str(error).splitlines()
        assert shown[len(caret) - 1] == "\u00e9"


@pytest.mark.parametrize(
    ("text", "meant"),
    [("sign(v)", "sgn"), ("Abs(v)", "abs"), ("F_Y * v", "F_y"), ("vc", "v_c"), ("q", None)],
)
def test_the_nearest_name_is_suggested(text: str, meant: str | None) -> None:
    error = _refused(parse_value, text, ["v", "v_c", "F_y"])
    question = f"(did you mean {meant!r}?)"
    assert (question in error.reason) == ("did you mean" in error.reason) == (meant is not None)


def test_half_a_character_is_named() -> None:
    for text, half in (("\ud800", True), ("\udfff", True), ("\ue000", False), ("\ud7ff", False)):
        assert ("half a character" in _refused(parse_value, f"v + {text}").reason) == half


@pytest.mark.parametrize("given_instead", [None, 5, b"v", ["v"], object()])
def test_values_other_than_text_are_refused(given_instead: object) -> None:
    for parse in (parse_value, parse_condition):
        assert "expected a text, got" in _refused(parse, given_instead).reason


@pytest.mark.parametrize("text", ["1if v else z", "z*0x1or v", "1and v < z", "z > 1and v > 0"])
def test_no_python_warning_reaches_the_user(text: str) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for parse in (parse_value, parse_condition):
            with contextlib.suppress(ExpressionError):
                parse(text, NAMES)
    assert [str(warning.message) for warning in caught] == []


# --------------------------------------------------------------------------- states
OWNERS = {"pad": Owner(0, 2, ("stick", "slip")), "gear": Owner(2, 1, ("free", "left"))}
OWNED: dict[str, Any] = {"names": ["gear.F", "v"], "owners": OWNERS}


def test_states_are_referred_to_by_number_from_one_and_by_equality() -> None:
    known: dict[str, Any] = {"states": ["slip"], "elements": 2}
    assert parse_condition("state(1) == slip", "v", **known) == InState(1, "slip")
    assert parse_condition("state(2) != slip", "v", **known) == Not(InState(2, "slip"))
    for number in ("0", "3", "1.0", "True"):
        _refused(parse_condition, f"state({number}) == slip", "v", **known)
    for wrong in ("state(1) > slip", "state(1) == fly", "state == slip"):
        _refused(parse_condition, wrong, "v", **known)
    for elements in ("state(1) == slip", "state == slip"):
        _refused(parse_condition, elements, "v", states=["slip"])
        _refused(parse_condition, elements, "v", states=())


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("pad.state(1) == stick", InState(1, "stick")),
        ("pad.state(2) == slip", InState(2, "slip")),
        ("gear.state(1) == left", InState(3, "left")),
        ("gear.state == left", InState(3, "left")),
        ("gear.state != free", Not(InState(3, "free"))),
    ],
)
def test_an_element_of_an_owner_is_counted_over_all_owners(text: str, tree: object) -> None:
    assert parse_condition(text, **OWNED) == tree
    found = parse_condition(f"gear.F > 1 and {text}", **OWNED)
    assert spell(found).startswith("gear.F > 1.0 and ")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("pad.state == slip", ("pad.state needs a number", "pad.state(1)")),
        ("pad.state(0) == slip", ("takes an element number", "pad.state(1) to pad.st")),
        ("pad.state(3) == slip", ("takes an element number",)),
        ("gear.state(2) == left", ("gear.state(1) to gear.state(1)",)),
        ("gear.state == slip", ("unknown state",)),
        ("rope.state == slip", ("unknown name 'rope.state'",)),
        ("state(1) == slip", ("state needs its owner", "pad.state(1)")),
        ("state == slip", ("state needs its owner",)),
    ],
)
def test_other_elements_are_refused(text: str, said: tuple[str, ...]) -> None:
    error = _refused(parse_condition, text, **OWNED)
    assert all(each in str(error) for each in said), error


# --------------------------------------------------------------------------- limits
def test_the_longest_text_has_ten_thousand_characters() -> None:
    assert parse_value("v" + " " * 9_999, "v") == Name("v")
    assert _refused(parse_value, "v" + " " * 10_000, "v").column == 10_001


def test_the_deepest_tree_has_sixty_levels() -> None:
    assert parse_value("-" * 59 + "v", "v")
    assert "nested" in str(_refused(parse_value, "-" * 60 + "v", "v"))
    deep = _refused(parse_value, "-" * 9_000 + "v", "v")  # too deep even for Python
    assert ("nested" in deep.reason, deep.column) == (True, 1)
    assert parse_condition("not " * 58 + "v > 1", "v")
    with pytest.raises(ExpressionError, match="nested"):
        parse_condition("not " * 59 + "v > 1", "v")


def test_min_takes_fifty_arguments_folded_from_the_left_as_deep_as_any_tree_may_be() -> None:
    assert spell(parse_value("min(a, b, c, d)", "abcd")) == "min(min(min(a, b), c), d)"
    assert parse_value("max(" + "v, " * 49 + "v)", "v")
    assert "at most 50" in str(_refused(parse_value, "max(" + "v, " * 50 + "v)", "v"))
    assert parse_value("-" * 10 + "max(" + "v, " * 49 + "v)", "v")  # 10 + 1 + 48 + 1 levels
    assert "nested" in str(_refused(parse_value, "-" * 11 + "max(" + "v, " * 49 + "v)", "v"))
    for several in (2, 3, 4, 5, 6):  # a fold may skip the deepest level, and is still detected
        nested = "v"
        for _ in range(59 // (several - 1)):
            nested = f"min({nested}{', v' * (several - 1)})"
        assert parse_value(nested, "v")
        over = f"min({nested}{', v' * (several - 1)})"
        assert "nested" in str(_refused(parse_value, over, "v"))
    # The last argument is at the top of the fold, the first two at its bottom.
    assert parse_value("max(" + "v, " * 49 + "-" * 58 + "v)", "v")
    assert "nested" in str(_refused(parse_value, "max(" + "v, " * 49 + "-" * 59 + "v)", "v"))
    assert parse_value("max(v, " + "-" * 10 + "v, " + "v, " * 47 + "v)", "v")
    assert "nested" in str(
        _refused(parse_value, "max(v, " + "-" * 11 + "v, " + "v, " * 47 + "v)", "v")
    )


def test_a_text_has_a_hundred_comparisons_at_most() -> None:
    """The program that watches each of them separately was too deep for Python to compile."""
    assert parse_condition(" and ".join(["v > 0"] * 100), "v")
    for text in (
        " and ".join(["v > 0"] * 101),
        "z >= s" + " >= v" * 1500,
        " and ".join(["(" + " or ".join(["z < s"] * 20) + ")"] * 20),
    ):
        assert "too many comparisons" in _refused(parse_condition, text).reason


def test_pow_takes_two_arguments() -> None:
    assert parse_value("pow(a, b)", "ab") == parse_value("a**b", "ab")
    for arguments in ("", "a", "a, b, a"):
        assert "two arguments" in str(_refused(parse_value, f"pow({arguments})", "ab"))


@pytest.mark.parametrize(
    "text",
    [
        "-" * 5000 + "v",
        "(" * 150 + "v" + ")" * 150 + "+" + "-" * 70 + "v",
        "v" + "**v" * 70,
        "9" * 20_000,
        "not " * 2000 + "v",
        f"min({', '.join(['v'] * 500)})",
        f"max(v{', min(v' * 40}{')' * 41}" + ", v" * 20,
    ],
    ids=lambda text: f"{text[:8]}... {len(text)} characters",
)
def test_too_deep_or_too_long_is_refused_in_few_words(text: str) -> None:
    assert len(str(_refused(parse_value, text))) < 1000
    assert len(str(_refused(parse_condition, text + " < v"))) < 1000


# --------------------------------------------------------------------------- what texts cost
LONG = "x" * 9000


def calls_of(work: Callable[[], object]) -> int:
    """Return the number of Python function calls; give up at a million."""
    count = 0

    def look(_frame: Any, what: str, _argument: Any) -> None:
        nonlocal count
        count += what == "call"
        assert count < 1_000_000, "unbounded work"

    sys.setprofile(look)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize(
    "power", ["2", "8", "9", pytest.param("0.5", marks=pytest.mark.slow), "-3"]
)
def test_powers_of_powers_cost_no_more_than_their_length(power: str) -> None:
    """The work once doubled with each level: 50 levels would have taken years."""
    text = "(" * 50 + "v" + f")**{power}" * 50

    def read() -> None:
        tree = parse_value(text, ["v"])
        assert names_in(tree) == {"v"}
        assert len(spell(tree)) < 100 * len(text)
        assert evaluate(tree, {"v": 1.0}) == 1.0

    assert calls_of(read) < 100_000


def test_exponents_count_as_part_of_what_is_multiplied() -> None:
    """64 copies of a power whose exponent has 64 copies of a power ...: a line made gigabytes."""
    text = "v"
    for _ in range(9):
        text = f"((v**({text} + z))**8)**8"
    tree = parse_value(text, ["v", "z"])
    assert len(spell(tree)) < 100 * len(text)
    assert evaluate(tree, {"v": 1.0, "z": 0.0}) == 1.0


@pytest.mark.parametrize("text", [LONG, f"{LONG}(v)", f"'{LONG}'"])
def test_a_long_name_does_not_make_a_long_message(text: str) -> None:
    for parse in (parse_value, parse_condition):
        with pytest.raises(ExpressionError) as caught:
            parse(text, ["v"])
        assert len(str(caught.value)) < 1000


def _switches(name: str, guard: str) -> None:
    states = State("a", {"z": "v"}), State("b", {"z": "0"})
    edge = Transition("e", "a", "b", guard)
    chart = Chart(name, ("v", "s"), ("z",), (), states, (edge,), {"F": "z"})
    model = ChartModel(chart, {}, n=1, stribeck=Stribeck(1, 1.5, 1e-3))
    for engine in ("machines", "ifelse"):
        assert len(simulate(model, Prescribed("1"), 2.0, engine=engine).transitions) == 1


@pytest.mark.parametrize("name", ["a\0b", "a\nb", "<>", '"""', "\u202e"])
def test_any_name_of_a_chart_can_be_run(name: str) -> None:
    """Python accepts no null character in a file name, which the generated text is given."""
    _switches(name, "z >= s")


def test_a_hundred_comparisons_run() -> None:
    _switches("long", " or ".join(f"z >= s + {i}" for i in range(50)) + " or z" + " >= s" * 50)


# --------------------------------------------------------------------------- nothing is executed
_watching = -1
_seen: list[str] = []
_ACTS = {"exec", "import", "open", "os.system", "subprocess.Popen"}


def _hook(event: str, _: object) -> None:
    # An audit hook cannot be removed; it is inactive while `_watching` is not a thread's number.
    if get_ident() == _watching and event in _ACTS:
        _seen.append(event)


@contextlib.contextmanager
def nothing_executed() -> Iterator[None]:
    """Fail if Python executes code, imports or opens anything meanwhile."""
    global _watching
    if _hook not in _installed:
        _installed.append(_hook)
        sys.addaudithook(_hook)
    _seen.clear()
    _watching = get_ident()
    try:
        yield
    finally:
        _watching = -1
    assert _seen == []


_installed: list[object] = []

TEXTS = st.one_of(
    st.text(max_size=40),
    st.text(alphabet="vzs0123456789.+-*/<>=()e, ", max_size=40),
    st.lists(st.sampled_from(TOKENS), max_size=20).map(" ".join),
    st.lists(st.sampled_from(TOKENS), max_size=20).map("".join),
)


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(TEXTS)
@example("(" * 199 + "v" + ")" * 199)
@example("'" * 3)
@example("f'{v!r:{z}}'")
@example("\N{DIGIT ONE}\N{ARABIC-INDIC DIGIT ONE}")
@example("1__0")
@example("\ufeffv")
def test_only_expression_errors_are_raised_whatever_the_text(text: str) -> None:
    for parse in (parse_value, parse_condition):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)
            warnings.simplefilter("ignore", DeprecationWarning)
            with nothing_executed():
                try:
                    tree = parse(text, NAMES)
                except ExpressionError as refusal:
                    error = refusal
                else:
                    error = None
                    read = spell(tree), names_in(tree)
        if error is None:
            assert read[1] <= set(NAMES)
        else:
            assert 1 <= error.column <= len(text) + 1
            assert error.text == text
            assert error.reason
            assert error.allowed


def _places(text: str) -> list[Callable[[], object]]:
    def chart(flow: str = "v", guard: str = "z >= s", out: str = "z", action: str = "0") -> Chart:
        states = (State("a", {"z": flow}, entry={"z": action}), State("b", {"z": "0"}))
        edge = Transition("e", "a", "b", guard, actions={"z": action})
        return Chart("c", ("v", "s"), ("z",), (), states, (edge,), {"F": out})

    return [
        lambda: parse_value(text, [*NAMES, "__import__", "open", "exec"]),
        lambda: parse_condition(text, [*NAMES, "__import__", "open", "exec"]),
        lambda: Formula(text),
        lambda: chart(flow=text),
        lambda: chart(guard=text),
        lambda: chart(out=text),
        lambda: chart(action=text),
    ]


@pytest.mark.parametrize(
    "text",
    [
        "__import__('pathlib').Path({path!r}).touch()",
        "open({path!r}, 'w')",
        "exec({code!r})",
        "[open({path!r}, 'w') for v in (1,)]",
        "(lambda: open({path!r}, 'w'))()",
        "f'{{open({path!r}, chr(119))}}' < v",
        "z < open({path!r}, 'w')",
        "v\nopen({path!r}, 'w')",
        "abs(open({path!r}, 'w'))",
        "(z := open({path!r}, 'w'))",
        "().__class__.__base__.__subclasses__()",
    ],
)
def test_hostile_text_creates_nothing(text: str, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    hostile = text.format(path=str(canary), code=f"open({str(canary)!r}, 'w')")
    for place in _places(hostile):
        with nothing_executed(), pytest.raises(GMSError):
            place()
    assert list(tmp_path.iterdir()) == []


def test_the_audit_hook_detects_execution(tmp_path: Path) -> None:
    with pytest.raises(AssertionError), nothing_executed():
        (tmp_path / "canary").touch()
    with pytest.raises(AssertionError), nothing_executed():
        eval("1 + 1")
