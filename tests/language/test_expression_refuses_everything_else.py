"""A text outside the expression language is refused with its column, and nothing is ever executed.

Columns count characters from 1 and point at the start of the offending construct; for a text that
ends too early, the column is one past its end. Only `ExpressionError` leaves the parser, whatever
the text, and no text makes Python execute, import or open anything.
"""

from __future__ import annotations

import ast
import contextlib
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import get_ident

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ExpressionError, GMSError
from gms_fsm.language import (
    FUNCTIONS,
    evaluate,
    names_in,
    parse_condition,
    parse_value,
    rough_points,
    spell,
)
from gms_fsm.systems.signals import Formula

NAMES = ("z", "s", "v", "v_c")
NUMBER_WANTED = "found a comparison where a number is needed"
COMPARISON_WANTED = "found a number where a comparison is needed"
FOREIGN = "is not part of the language"
GRAMMAR = "numbers, names, + - * / **"

NO_VALUES = [
    # attributes, calls, subscripts and other Python
    ("z.real", 1, "attribute", GRAMMAR),
    ("v + z.real", 5, "attribute", GRAMMAR),
    ("__import__('os').system('ls')", 1, FOREIGN, GRAMMAR),
    ("__import__('os')", 1, "unknown function '__import__'", "abs, exp, log, sqrt"),
    ("v + cosh(z)", 5, "unknown function 'cosh'", "abs, exp, log, sqrt"),
    ("abs(v)(z)", 1, FOREIGN, GRAMMAR),
    ("2(v)", 1, FOREIGN, GRAMMAR),
    ("lambda: 1", 1, "lambda", GRAMMAR),
    ("[v for v in z]", 1, FOREIGN, GRAMMAR),
    ("{v: z}", 1, FOREIGN, GRAMMAR),
    ("(v, z)", 1, FOREIGN, GRAMMAR),
    ("z[0]", 1, "index", GRAMMAR),
    ("v if z else s", 1, "if ... else", GRAMMAR),
    ("v * (z := 1)", 6, "assignment", GRAMMAR),
    ("v % 2", 1, FOREIGN, GRAMMAR),
    ("z + v // 2", 5, FOREIGN, GRAMMAR),
    ("z + v @ s", 5, FOREIGN, GRAMMAR),
    ("v | z", 3, FOREIGN, "abs(...) instead"),
    ("1 + ~v", 5, FOREIGN, GRAMMAR),
    ("...", 1, FOREIGN, GRAMMAR),
    ("await v", 1, FOREIGN, GRAMMAR),
    # constants that are not finite real numbers
    ("'a'", 1, FOREIGN, GRAMMAR),
    ("1 + 'a'", 5, FOREIGN, GRAMMAR),
    ("b'a'", 1, FOREIGN, GRAMMAR),
    ("f'{v}'", 1, "f-string", GRAMMAR),
    ("True", 1, "True is not a number", GRAMMAR),
    ("v * False", 5, "False is not a number", GRAMMAR),
    ("None", 1, FOREIGN, GRAMMAR),
    ("1j", 1, FOREIGN, GRAMMAR),
    ("v + 2.5j", 5, FOREIGN, GRAMMAR),
    ("1e999", 1, "too large", "finite"),
    ("-1e999", 2, "too large", "finite"),
    ("v + " + "9" * 400, 5, "too large", "finite"),
    ("0x" + "f" * 400, 1, "too large", "finite"),
    # wrong type
    ("z < s", 1, NUMBER_WANTED, GRAMMAR),
    ("1 + (z < s)", 6, NUMBER_WANTED, GRAMMAR),
    ("z == s", 1, NUMBER_WANTED, GRAMMAR),
    ("not v", 1, NUMBER_WANTED, GRAMMAR),
    ("v and z", 1, NUMBER_WANTED, GRAMMAR),
    # functions
    ("v + abs", 5, "the function 'abs' needs", "abs(...)"),
    ("abs()", 1, "abs got 0 arguments", "one argument"),
    ("1 + abs(v, z)", 5, "abs got 2 arguments", "one argument"),
    ("min(v)", 1, "min got 1 argument", "two or more arguments"),
    ("abs(v, x=1)", 9, FOREIGN, "<= or >= instead"),
    ("pow(v)", 1, "pow got 1 arguments", "two arguments"),
    ("abs(*v)", 5, FOREIGN, GRAMMAR),
    ("abs(**v)", 1, FOREIGN, GRAMMAR),
    # names
    ("u", 1, "unknown name 'u'", "z, s, v, v_c, and pi"),
    ("z * V", 5, "unknown name 'V'", "z, s, v, v_c, and pi"),
    ("z + __class__", 5, "unknown name '__class__'", "z, s, v, v_c, and pi"),
    # unicode: columns count characters, not bytes
    ("\u00e9", 1, "unknown name '\u00e9'", "z, s, v, v_c, and pi"),
    ("v + \u00e9 * u", 5, "unknown name '\u00e9'", "z, s, v, v_c, and pi"),
    ("'\u00e9\u20ac\U0001f600' + u", 1, FOREIGN, GRAMMAR),
    ("  z +\u3000u", 7, "unknown name 'u'", "z, s, v, v_c, and pi"),
    ("z\u00a0+\u2003u.real", 5, "attribute", GRAMMAR),
    ("v + \U0001f600", 5, "cannot be read", GRAMMAR),
    ("v + \u20ac + u", 5, "cannot be read", GRAMMAR),
    ("v \u2212 z", 3, FOREIGN, "- instead"),  # a typographer's minus
    ("v + \ud800", 5, "cannot be read", GRAMMAR),  # half a surrogate pair
    # not even Python
    ("", 1, "empty", GRAMMAR),
    (" \t\n", 1, "empty", GRAMMAR),
    ("v # comment", 3, "unexpected '#'", GRAMMAR),
    ("v; z", 2, "unexpected ';'", GRAMMAR),
    ("v \\ z", 3, "unexpected", GRAMMAR),
    ("v + \0", 5, "unexpected", GRAMMAR),
    ("v z", 3, "cannot be read", GRAMMAR),
    ("v = z", 3, FOREIGN, "<= or >= instead"),
    ("v)", 2, "cannot be read", GRAMMAR),
    ("1 + v) * (z", 6, "cannot be read", GRAMMAR),
    ("(v", 1, "cannot be read", GRAMMAR),
    ("1 + (v * (z)", 5, "cannot be read", GRAMMAR),
    ("1 + (v]", 7, "cannot be read", GRAMMAR),
    ("v + $", 5, "cannot be read", GRAMMAR),
    ("v +", 4, "ends too early", GRAMMAR),
    ("  v *", 6, "ends too early", GRAMMAR),
    ("\u00e9 + v **", 9, "ends too early", GRAMMAR),
    ("-", 2, "ends too early", GRAMMAR),
]

NO_CONDITIONS = [
    ("z", 1, COMPARISON_WANTED, "v > v_c"),
    ("after(0.2)", 1, "unknown function 'after'", "abs, exp, log, sqrt"),
    ("z < s and after(0.2)", 11, "unknown function 'after'", "abs, exp, log, sqrt"),
    ("abs(z)", 1, COMPARISON_WANTED, "v > v_c"),
    ("pow(z, 2)", 1, COMPARISON_WANTED, "v > v_c"),
    ("z + 1", 1, COMPARISON_WANTED, "v > v_c"),
    ("z < s and v", 11, COMPARISON_WANTED, "v > v_c"),
    ("z < s or not 1", 14, COMPARISON_WANTED, "v > v_c"),
    ("z < s and False", 11, "", ""),
    ("z < (s < v)", 6, NUMBER_WANTED, GRAMMAR),
    ("(z < s) + 1 < 2", 2, NUMBER_WANTED, GRAMMAR),
    ("z == s", 6, "only < <= > >=", "< <= > >="),
    ("z != s", 6, "only < <= > >=", "< <= > >="),
    ("z < s == v", 10, "only < <= > >=", "< <= > >="),
    ("z is s", 6, "only < <= > >=", "< <= > >="),
    ("z is not s", 10, "only < <= > >=", "< <= > >="),
    ("z in s", 6, "only < <= > >=", "< <= > >="),
    ("z not in s", 10, "only < <= > >=", "< <= > >="),
    ("z <> s", 3, "cannot be read", GRAMMAR),
    ("z => s", 3, "cannot be read", GRAMMAR),
    ("z < s && v > 0", 7, FOREIGN, "and instead"),
    ("abs(v) < s \u2228 z > s", 12, FOREIGN, "or instead"),
    ("!(z < s)", 1, FOREIGN, "not instead"),
    ("z \u2265 s", 3, FOREIGN, ">= instead"),
    ("z < s & v", 7, FOREIGN, "and instead"),
    ("z < s, v > 0", 1, FOREIGN, GRAMMAR),
    ("z < s if v > 0 else z > s", 1, "if ... else", GRAMMAR),
    ("any(z < s)", 1, "", ""),
    ("z < s and \u00e9 > u", 11, "unknown name '\u00e9'", "z, s, v, v_c, and pi"),
    ("z <=\u3000\u00e9", 6, "unknown name '\u00e9'", "z, s, v, v_c, and pi"),
    ("z < s and", 10, "ends too early", GRAMMAR),
    ("z <", 4, "ends too early", GRAMMAR),
    ("not", 4, "ends too early", GRAMMAR),
    ("", 1, "empty", GRAMMAR),
]


def _refused(parse: Callable[..., object], text: str) -> ExpressionError:
    with pytest.raises(ExpressionError) as caught:
        parse(text, NAMES)
    return caught.value


@pytest.mark.parametrize(("text", "column", "reason", "allowed"), NO_VALUES)
def test_an_invalid_value_is_refused_with_its_column(
    text: str, column: int, reason: str, allowed: str
) -> None:
    error = _refused(parse_value, text)
    assert (error.column, error.text) == (column, text)
    assert reason in error.reason
    assert allowed in error.allowed
    assert f"column {column}" in str(error)


@pytest.mark.parametrize(("text", "column", "reason", "allowed"), NO_CONDITIONS)
def test_an_invalid_condition_is_refused_with_its_column(
    text: str, column: int, reason: str, allowed: str
) -> None:
    error = _refused(parse_condition, text)
    assert (error.column, error.text) == (column, text)
    assert reason in error.reason
    assert allowed in error.allowed


@pytest.mark.parametrize("text", [row[0] for row in NO_VALUES])
def test_messages_refer_to_the_text_not_to_pythons_syntax_tree(text: str) -> None:
    words = set(_refused(parse_value, text).reason.replace("'", " ").split())
    classes = {name for name, kind in vars(ast).items() if isinstance(kind, type)}
    assert {word for word in words & classes if word[0].isupper()} == set()


def test_the_caret_is_under_the_column_even_in_a_long_text() -> None:
    for lead in (3, 200):
        text = "v" + "+v" * 2 + " " * lead + "+ \u00e9"
        error = _refused(parse_value, text)
        *_, shown, caret = str(error).splitlines()
        assert shown[len(caret) - 1] == "\u00e9"


def test_line_breaks_count_as_spaces_for_columns() -> None:
    assert spell(parse_value("v\n  + z", NAMES)) == "v + z"
    assert _refused(parse_value, "v\n + u").column == 6


@pytest.mark.parametrize("given_instead", [None, 5, b"v", ["v"], object()])
def test_values_other_than_text_are_refused(given_instead: object) -> None:
    for parse in (parse_value, parse_condition):
        with pytest.raises(ExpressionError, match="expected a text, got"):
            parse(given_instead, NAMES)


@pytest.mark.parametrize(
    "text",
    [
        "-" * 5000 + "v",
        "(" * 5000 + "v" + ")" * 5000,
        "(" * 150 + "v" + ")" * 150 + "+" + "-" * 70 + "v",
        "abs(" * 70 + "v" + ")" * 70,
        "v" + "**v" * 70,
        "v+" * 6000 + "v",
        "9" * 20_000,
        "not " * 2000 + "v",
    ],
    ids=lambda text: f"{text[:8]}... {len(text)} characters",
)
def test_too_deep_or_too_long_is_refused(text: str) -> None:
    assert len(str(_refused(parse_value, text))) < 1000
    assert len(str(_refused(parse_condition, text + " < v"))) < 1000


@pytest.mark.parametrize("function", ["min", "max"])
@pytest.mark.parametrize("count", [3, 50, 500, 3000])
def test_many_arguments_are_refused_or_handled_by_every_reader(function: str, count: int) -> None:
    try:
        tree = parse_value(f"{function}({','.join(['v'] * count)})", NAMES)
    except ExpressionError:
        assert count > 50
        return
    assert names_in(tree) == {"v"}
    assert evaluate(tree, {"v": 2.0}) == 2.0
    assert len(rough_points(tree)) >= 1
    assert spell(tree).count("v") == count


@pytest.mark.parametrize("text", ["1if v else z", "z*0x1or v", "1and v < z", "z > 1and v > 0"])
def test_no_python_warning_reaches_the_user(text: str) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for parse in (parse_value, parse_condition):
            with contextlib.suppress(ExpressionError):
                parse(text, NAMES)
    assert [str(warning.message) for warning in caught] == []


# --------------------------------------------------------------------------- nothing is executed
_watching = -1
_seen: list[str] = []
_ACTS = {"exec", "import", "open", "os.system", "subprocess.Popen"}


def _hook(event: str, _: object) -> None:
    # An audit hook cannot be removed; it is inactive while `_watching` is not a thread's number.
    if get_ident() == _watching and event in {
        "exec",
        "import",
        "open",
        "os.system",
        "subprocess.Popen",
    }:
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

TOKENS = (
    [*NAMES, *FUNCTIONS, "pi", "u", "__import__", "os", "eval", "exec", "open", "True", "None"]
    + ["+", "-", "*", "/", "**", "<", "<=", ">", ">=", "==", "!=", ":=", "=", "(", ")", "[", "]"]
    + ["and", "or", "not", "if", "else", "lambda", "for", "in", "is", "await", "yield", ":", ","]
    + [".", "'", '"', "f'{", "}'", "1", "0.5", "1e999", "1e-400", "0x1f", "1_0", "2j", "#", "\\"]
    + [" ", "\n", "\t", "\0", ";", "\u00e9", "\u3000", "\ufeff", "\ud800", "\U0001d467", "@", "%"]
)
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


@pytest.mark.parametrize(
    ("text", "meant"),
    [("sign(v)", "sgn"), ("Abs(v)", "abs"), ("F_Y * v", "F_y"), ("vc", "v_c"), ("q", None)],
)
def test_the_nearest_name_is_suggested(text: str, meant: str | None) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse_value(text, ["v", "v_c", "F_y"])
    question = f"(did you mean {meant!r}?)"
    assert (question in caught.value.reason) == (meant is not None)
    assert ("did you mean" in caught.value.reason) == (meant is not None)
