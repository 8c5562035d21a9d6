"""Fuzz bodies: bytes become a hostile input, and only documented exceptions may answer it.

Each body is a plain function of bytes, so that hypothesis, a loop over seeds (tests/soak) or any
other fuzzer can drive it. The bytes are read as choices: which valid input to start from, what to
break in it, and by how much. Accepted inputs are then used, because an input that is accepted and
breaks later code is a finding too.
"""

from __future__ import annotations

import contextlib
import copy
import datetime
import functools
import io
import json
import math
import tempfile
import tomllib
import warnings
import zipfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from gms_fsm import LuGre, Prescribed, Slider, Stribeck, Trace, simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import (
    ExpressionError,
    GMSError,
    MissingExtraError,
    RecordError,
    ScenarioError,
    TraceFileError,
)
from gms_fsm.language import (
    FUNCTIONS,
    MATLAB_LIKE,
    SHORT,
    Node,
    evaluate,
    names_in,
    parse_condition,
    parse_value,
    rough_points,
    spell,
    split,
)
from gms_fsm.lowering.generated import load
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import Run
from gms_fsm.scenarios import shipped
from gms_fsm.session.explain import explain
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.trace import dwell_times
from tests.helpers import pulled_mass, stick_slip
from tests.scenario_files import MEASURED, OPEN_LOOP, sine_table

Option = TypeVar("Option")

LONGEST_MESSAGE = 4000  # characters; a longer text is not a message


class Choices:
    """Bytes read as choices; when they run out, every choice is the first option."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.place = 0

    def byte(self) -> int:
        """Return the next byte."""
        self.place += 1
        return self.data[self.place - 1] if self.place <= len(self.data) else 0

    def below(self, bound: int) -> int:
        """Return an integer from 0 to bound - 1."""
        number, span = self.byte(), 256
        while span < bound:
            number, span = number * 256 + self.byte(), span * 256
        return number % bound

    def one_of(self, options: Sequence[Option]) -> Option:
        """Return one of several options."""
        return options[self.below(len(options))]

    def rest(self) -> bytes:
        """Return all remaining bytes."""
        self.place, start = len(self.data), self.place
        return self.data[start:]

    @property
    def over(self) -> bool:
        """Return whether the bytes have run out."""
        return self.place >= len(self.data)


@contextlib.contextmanager
def _strict() -> Iterator[None]:
    """Turn warnings into errors, except `UserWarning`, which is intended for the user."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", UserWarning)
        yield


def _in_place(error: ExpressionError, text: str) -> None:
    assert 1 <= error.column <= len(text) + 1, (error.column, len(text))
    assert error.text == text
    _is_a_message(error)


def _is_a_message(error: GMSError) -> None:
    text = str(error)
    assert text.strip(), repr(error)
    assert len(text) < LONGEST_MESSAGE, f"{len(text)} characters: {text[:300]}"
    assert "np.float64" not in text, text


# --------------------------------------------------------------------------- text
NUMBERS = [
    "0", "1", "-1", "0.5", "1e-3", "1e-300", "1e-400", "1e300", "1e308", "1e309", "1e999", "nan",
    "inf", "-inf", "-0.0", "1e5000", "9" * 310, "9" * 5000, "0x1f", "1_0", "1__0", "1.", ".5",
    "00", "1e", "0b1", "0o7", "1E+05", "2j", "4.9e-324", "1.7976931348623157e308",
    "123456789012345678",
]  # fmt: skip
MARKS = [
    "+", "-", "*", "/", "**", "<", "<=", ">", ">=", "==", "!=", "(", ")", "[", "]", "{", "}", ",",
    ".", ":", ";", "=", ":=", "'", '"', '"""', "#", "\\", "@", "%", "&", "|", "~", "^", "!", "?",
    "$", "`", " ", "\n", "\r\n", "\t", "\0", "\x0c", "\x1b[31m", "\x7f", "\x85", "\u00a0", "\u2028",
    "\u3000", "\ufeff", "\u202e", "\ud800", "\udfff", "\u00e9", "\u2212", "\u0661", "\U0001d467",
    "\U0001f600", "e\u0301", "\uff36",
]  # fmt: skip
WORDS = [
    "z", "s", "v", "v_c", "t", "u", "pi", "and", "or", "not", "if", "else", "lambda", "for", "in",
    "is", "await", "None", "True", "False", "__import__", "os", "exec", "state", "stick", "slip",
    *FUNCTIONS, *SHORT,
]  # fmt: skip
TOKENS = NUMBERS + MARKS + WORDS
NAMES = ("z", "s", "v", "v_c")
VALID_TEXTS = [
    "z >= s and v > v_c", "abs(v) <= v_c and abs(z) < s", "sgn(v) * v_c * (1 - z / s)",
    "v**2 + 1", "min(z, max(s, v), 3) * exp(-(v / v_c)**2)", "not (z < s or v > 0) and 0 < v < 1",
    "state(1) == slip and state(2) != stick", "z", "-z**-2", "tanh(cos(sin(sqrt(abs(z)))))",
    "0.2*sin(2*pi*v/20)", "((z**3)**4)**5 - z**0.5", "if(z < s and not v > 0, mod(z, s), v)",
    "round(z) == 3 and floor(v) != noise(z, 2) + 1", "quantise(z, 0.5) * saturate(v, -s, s)",
    "1 + (z if v < 0 or s < 1 else if(z > s, v, 2))",
]  # fmt: skip


def _mutated_text(choices: Choices, text: str) -> str:
    """Break a text in a few places."""
    for _ in range(1 + choices.below(5)):
        place = choices.below(len(text) + 1)
        length = choices.below(1 + min(20, len(text)))
        how = choices.below(6)
        if how == 0:
            text = text[:place] + text[place + length :]
        elif how == 1:
            text = text[:place] + choices.one_of(TOKENS) + text[place:]
        elif how == 2:
            text = text[:place] + choices.one_of(TOKENS) + text[place + length :]
        elif how == 3:  # a piece of it somewhere else
            piece = text[place : place + length]
            to = choices.below(len(text) + 1)
            text = text[:to] + piece + text[to:]
        elif how == 4:
            text = text[:place] + chr(choices.below(0x110000)) + text[place:]
        else:  # a piece of it many times
            piece = text[place : place + length]
            times = choices.one_of([2, 10, 70, 300])
            text = text[:place] + piece * times + text[place + length :]
    return text


WRAPS = [
    ("(", ")"), ("abs(", ")"), ("-", ""), ("not ", ""), ("", "**2"), ("", "+v"), ("min(", ",v)"),
    ("min(", ",v" * 48 + ")"), ("max(v,", ",z,s)"), ("v if z else ", ""), ("[", "]"), ("{", "}"),
    ("f'{", "}'"), ("", " < v"), ("", " and z < s"), ("", "*(v"), ("lambda: ", ""),
    ("state(", ")"), ("v**", ""), ("(", "**8)"), ("", ".a"), ("", "()"),
]  # fmt: skip


def _nested(choices: Choices) -> str:
    """Nest deeply, chain long, or both."""
    text = choices.one_of(["v", "z < s", "", "1"])
    for _ in range(1 + choices.below(4)):
        before, after = choices.one_of(WRAPS)
        times = choices.one_of([1, 3, 30, 58, 59, 60, 61, 100, 300, 1000, 5000])
        if times * (len(before) + len(after)) > 60_000:
            times = 60_000 // (len(before) + len(after))
        text = before * times + text + after * times
    return text


def _grammatical(choices: Choices, depth: int, truth: bool) -> str:
    """Return a valid text of the language, so that code after the parser is exercised too."""
    if truth:
        kind = choices.below(5) if depth else 0
        if kind == 1:
            return f"not ({_grammatical(choices, depth - 1, True)})"
        if kind in (2, 3):
            joint = choices.one_of([" and ", " or "])
            parts = [_grammatical(choices, depth - 1, True) for _ in range(2 + choices.below(2))]
            return joint.join(f"({part})" for part in parts)
        if kind == 4:
            element, state = choices.one_of("12"), choices.one_of(["stick", "slip"])
            return f"state({element}) {choices.one_of(['==', '!='])} {state}"
        sides = [_grammatical(choices, max(0, depth - 1), False) for _ in range(2)]
        return f"{sides[0]} {choices.one_of(['<', '<=', '>', '>='])} {sides[1]}"
    kind = choices.below(8) if depth else 0
    if kind == 0:
        return choices.one_of([*NAMES, "pi", "0", "1", "2.5", "1e-300", "1e300", "3e-7"])
    inner = _grammatical(choices, depth - 1, False)
    if kind == 1:
        return f"-({inner})"
    if kind == 2:
        one = [name for name in FUNCTIONS if name not in ("min", "max")]
        return f"{choices.one_of(one)}({inner})"
    other = _grammatical(choices, depth - 1, False)
    if kind == 3:
        return f"{choices.one_of(['min', 'max'])}({inner}, {other}, {inner})"
    if kind == 4:
        return f"({inner})**{choices.one_of(['2', '3', '-2', '8', '0.5', '0', '1', '-1', '9'])}"
    if kind == 5:
        return f"{choices.one_of(['mod', 'quantise', 'noise'])}({inner}, {other})"
    if kind == 6:
        return f"if({_grammatical(choices, max(0, depth - 1), True)}, {inner}, {other})"
    return f"({inner}) {choices.one_of('+-*/')} ({other})"


def _text(choices: Choices) -> str:
    """Return a hostile or valid text."""
    how = choices.below(6)
    if how == 0:
        return choices.rest().decode("utf-8", errors="surrogateescape")
    if how == 1:
        joint = choices.one_of(["", " "])
        return joint.join(choices.one_of(TOKENS) for _ in range(choices.below(30)))
    if how == 2:
        return _nested(choices)
    if how == 3:
        return _mutated_text(choices, choices.one_of(VALID_TEXTS))
    text = _grammatical(choices, choices.below(6), choices.below(2) == 1)
    return _mutated_text(choices, text) if how == 4 else text


# --------------------------------------------------------------------------- expressions
VALUES = [
    {"z": 0.3, "s": 1.5, "v": -0.1, "v_c": 1e-6},
    {"z": 0.0, "s": 1.0, "v": 0.0, "v_c": 1e-6},
    {"z": -1e200, "s": 5e-324, "v": 1e300, "v_c": 1.0},
]
STATES = {"state(1)": "stick", "state(2)": "slip"}


def one_expression(data: bytes) -> bool:
    """Parse one text as a value and as a condition; use accepted texts.

    Only `ExpressionError` may be raised, with a column inside the text. An accepted tree prints as
    a text that parses to the same values, and every algebra can process it.
    Returns whether it was accepted.
    """
    choices = Choices(data)
    text = _text(choices)
    accepted = False
    with _strict():
        for parse in (
            lambda text: parse_value(text, NAMES),
            lambda text: parse_condition(text, NAMES),
            lambda text: parse_condition(text, NAMES, ("stick", "slip"), 2),
        ):
            try:
                tree = parse(text)
            except ExpressionError as error:
                _in_place(error, text)
                continue
            accepted = True
            _use_tree(tree, text, parse)
    return accepted


@contextlib.contextmanager
def _only(*reasons: str) -> Iterator[None]:
    try:
        yield
    except ExpressionError as error:
        if not any(reason in error.reason for reason in reasons):
            raise


def _use_tree(tree: Node, text: str, parse: Callable[[str], Node]) -> None:
    assert names_in(tree) <= set(NAMES)
    printed = spell(tree)
    # Powers are printed as products, at most 64 factors each.
    assert len(printed) < 100 * len(text) + 1000, (len(printed), len(text))
    spell(tree, MATLAB_LIKE)
    if "state(" not in text:
        for reader in (split, rough_points):
            with contextlib.suppress(AttributeError, TypeError):  # of the other kind of tree
                reader(tree)  # type: ignore[operator]
    again = tree
    # The products of a power may be longer or deeper than a text may be.
    with _only("nested too deeply", "characters"):
        again = parse(printed)
    for values in VALUES:
        known = {**values, **STATES}
        assert _same(_computed(tree, known), _computed(again, known)), (text, printed, values)
        if "state(" not in printed:
            assert _same(_computed(tree, known), _generated(printed, values)), (text, values)


def _computed(tree: Node, values: dict[str, Any]) -> object:
    """Return the value, or the type of the arithmetic error (see `evaluate`)."""
    try:
        return evaluate(tree, values)
    except (ArithmeticError, ValueError) as error:
        return type(error)


def _generated(printed: str, values: dict[str, float]) -> object:
    names = ", ".join(values)
    source = f"def function({names}):\n    return {printed}\n"
    try:
        return load("fuzz", source)["function"](**values)
    except (ArithmeticError, ValueError) as error:
        return type(error)


def _same(a: object, b: object) -> bool:
    if isinstance(a, float) and isinstance(b, float):
        return (math.isnan(a) and math.isnan(b)) or (a == b and str(a) == str(b))
    return a == b


# --------------------------------------------------------------------------- scenarios
CLOSED_LOOP = """\
[model]
kind = "GMS"
law = "published"
preset = "non-drifting"
weights = [0.0025, 0.025, 0.25, 2.5]

[rig]
kind = "slider"
mass = 1.0
force = [[0.0, 0.0], [2.0, 0.5], [4.0, 0.25]]

[run]
t_start = 0.0
t_end = 5.0
method = "bs23"
rtol = 1e-5
atol = 1e-8
max_step = 0.5
events = "located"
engine = "ifelse"

[initial]
z = [0.0, 0.0, 0.0, 0.001]
states = ["stick", "slip", "stick", "stick"]
v = 0.0
x = 0.0

[output]
every = 0.1
figures = []
csv = true
"""
BENCH = """\
[model]
kind = "LuGre"
sigma_0 = 1000.0
sigma_1 = 31.6
sigma_2 = 4.0
stribeck = { F_c = 1.0, F_s = 1.5, v_s = 1e-3 }

[rig]
kind = "prescribed"
velocity = { file = "own.csv", time = { column = "t", unit = "s" }, \
value = { column = "x", unit = "mm/s" } }

[run]
t_end = 0.5
method = "rk4"
step = 0.01
"""
NASTY = [
    0, 1, -1, 2, 1.5, -0.5, 0.0, -0.0, 1e-300, 5e-324, 1e300, 1e308, -1e308, 1e-6, 1e9, 1e10,
    10**30,
    10**400, -(10**400), math.inf, -math.inf, math.nan, True, False, "", " ", "x", "1", "GMS",
    "record", "prescribed", "signed", "t", "exp(t)", "1/0", "1/t", "sqrt(t - 1)", "1e308*10*t",
    "sin(1e300*t)", "t**t", "v", "\0", "a\nb", "\u202e", "\U0001f600", "x" * 5000, "[red]",
    "own.csv",
    "../own.csv", "/etc/passwd", "own.csv\0", "C:\\own.csv", ".", [], [[]], [1.0], [1.0, 2.0],
    [[0, 1], [1, 0]], [[0, 0], [0, 1]], [[1, 0], [0, 0]], [[0, 1, 2]], ["a"], [1.0] * 500, {},
    {"a": 1}, {"kind": "GMS"}, {"column": "t", "unit": "s"}, {"": ""}, datetime.date(2020, 1, 1),
    datetime.datetime(2020, 1, 1, 12), datetime.time(12), [None], "stick", ["stick"],
    ["slip", "slip"],
    "normal > 4.5 N", "force > 0", "sqrt(force) > 1 N", "time < 1 h and not position > 1 mm",
    "force", "exp(1000*force) > 1", "1/force > 0", "force > 1e999", "time > 1 parsec",
]  # fmt: skip
# Not hostile, only unusual: a file with these is often accepted, and its run is tested.
PLAIN = [
    1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 0.01, 0.1, 0.5, 1.0, 1.5, 2.0, 3.0, 10.0, 100.0, 1e3, 1e4, 1e6,
    1e9, 1e12, 0.0, "t", "0.1*sin(t)", "sgn(sin(9*t))", "1/(t - 0.1)", "sqrt(0.1 - t)", "exp(t**2)",
    "abs(t - 0.05)**0.5", "max(0, t - 0.01)", "1e-5*t", "tanh(1e6*(t - 0.05))", "signed",
    "published", "dp45", "bs23", "heun", "euler", "rk4", "Radau", "LSODA", "located", "step",
    "ifelse", [[0.0, 0.0], [0.05, 0.2], [0.05, -0.2], [0.1, 0.0]], [0.5, 0.5], [1.0, 1e-3],
    ["slip", "stick"], "m", "mm", "um", "s", "ms", "N", "kN", "x", "F", 0.05, 1, -1,
]  # fmt: skip
OVERRIDES = [
    "model.law=published", "run.t_end=1", "run.engine=compiled", "rig.velocity=t", "a=b", "=",
    "a", "run.t_end=", "run.t_end=1\nx=2", "model=3", "model.k.a=1", "run.t_end=[",
    "a.b.c.d.e.f.g=1", "run.method='LSODA'", "record.where=force > 0 N", "run..t_end=1",
    "'run'.t_end=1",
]  # fmt: skip
CELLS = [
    "", "nan", "inf", "-inf", "1e999", "1e300", "-1e300", "1e-320", "x", "1,5", '"1"', '"', "0_3",
    "0", "-0.0", "1" * 400, " 1 ", "\u0661", "0x1", "None",
]  # fmt: skip


@functools.cache
def _valid_scenarios() -> list[str]:
    included = [path.read_text(encoding="utf-8") for path in shipped().values()]
    return [OPEN_LOOP, MEASURED, CLOSED_LOOP, BENCH, *included]


def toml_of(value: Any, top: bool = True) -> str:
    """Return a value, or at the top level a whole table, as TOML."""
    if top:
        return "".join(f"{json.dumps(key)} = {toml_of(v, False)}\n" for key, v in value.items())
    if isinstance(value, dict):
        inside = ", ".join(f"{json.dumps(key)} = {toml_of(v, False)}" for key, v in value.items())
        return "{ " + inside + " }"
    if isinstance(value, list):
        return "[" + ", ".join(toml_of(v, False) for v in value) + "]"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, bool):
        return str(value).lower()
    return str(value)


def _places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all parts of nested tables and lists."""
    items: Any = ()
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value[:6])
    found = [path] if path else []
    for key, part in items:
        found += _places(part, (*path, key))
    return found


def _mutated_table(choices: Choices, table: Any, nasty: Sequence[Any]) -> Any:
    """Replace, remove, move or add parts of nested tables and lists; mostly replace."""
    table = copy.deepcopy(table)
    for _ in range(1 + choices.below(4)):
        places = _places(table)
        if not places:
            break
        *path, last = choices.one_of(places)
        inside = table
        for key in path:
            inside = inside[key]
        how = choices.below(9)
        if nasty is PLAIN and choices.below(4):
            how = 0
        if how >= 6 or how <= 2:
            alike = [v for v in nasty if type(v) is type(inside[last])] if nasty is PLAIN else ()
            inside[last] = copy.deepcopy(choices.one_of(alike or nasty))
        elif how == 3:
            del inside[last]
        elif how == 4:
            other = choices.one_of(places)
            value = table
            with contextlib.suppress(KeyError, IndexError, TypeError):
                for key in other:
                    value = value[key]
            inside[last] = copy.deepcopy(value)
        elif isinstance(inside, dict):
            name = choices.one_of(["", "a", "kind", "step", "t_end", "k", f"{last}x", "\u00e9"])
            inside[name] = copy.deepcopy(choices.one_of(nasty))
        else:
            inside.append(copy.deepcopy(choices.one_of(nasty)))
    return table


def _mutated_record(choices: Choices) -> bytes:
    """Return a record with broken cells, rows or bytes."""
    rows = choices.one_of([60, 60, 60, 7, 5, 4, 2, 1, 0])
    lines = [line.split(",") for line in sine_table(rows).splitlines()]
    for _ in range(choices.below(4)):
        row = choices.below(len(lines))
        how = choices.below(6)
        if how == 0:
            lines[row][choices.below(len(lines[row])) if lines[row] else 0 :] = [
                choices.one_of(CELLS)
            ]
        elif how == 1 and lines[row]:
            lines[row][choices.below(len(lines[row]))] = choices.one_of(CELLS)
        elif how == 2:
            lines[row] = list(lines[choices.below(len(lines))])
        elif how == 3 and len(lines) > 1:
            del lines[row]
        elif how == 4:
            column = choices.below(3)
            cell = choices.one_of(CELLS)
            for line in lines[1:]:
                line[column : column + 1] = [cell]
        else:
            lines[row].append(choices.one_of(CELLS))
    text = "\n".join(",".join(line) for line in lines)
    content = text.encode("utf-8", errors="surrogatepass") + b"\n"
    return damaged(choices, content) if choices.below(8) == 7 else content


def damaged(choices: Choices, content: bytes) -> bytes:
    """Return bytes with a few places flipped, cut, dropped, zeroed or repeated."""
    data = bytearray(content)
    for _ in range(1 + choices.below(4)):
        i, how, amount = choices.below(len(data) + 1), choices.below(7), 1 + choices.byte()
        if how == 0 and i < len(data):
            data[i] ^= amount & 0xFF or 1
        elif how == 1:
            del data[i:]
        elif how == 2:
            data[i:i] = bytes([amount & 0xFF]) * 3
        elif how == 3:
            del data[i : i + amount]
        elif how == 4:
            data[i : i + amount] = bytes(len(data[i : i + amount]))
        elif how == 5:
            data[i:i] = data[i : i + amount] * 5
        elif how == 6 and i + 4 <= len(data):
            value = choices.one_of([0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0xFFFF])
            data[i : i + 4] = value.to_bytes(4, "little")
    return bytes(data)


def _scenario_text(choices: Choices) -> bytes:
    how = choices.below(10)
    text = choices.one_of(_valid_scenarios())
    if how == 0:
        return choices.rest()
    if how == 1:
        return damaged(choices, text.encode())
    if how == 2:
        return _mutated_text(choices, text).encode("utf-8", errors="surrogatepass")
    if how == 3:
        joint = choices.one_of(["", " ", "\n"])
        tokens = [*TOKENS, "[model]", "[rig]", "[[rig]]", "k = ", "kind = 'GMS'", "= 1", "\n"]
        words = joint.join(choices.one_of(tokens) for _ in range(choices.below(40)))
        return words.encode("utf-8", errors="surrogatepass")
    if how == 4:  # long and deep
        deep = choices.one_of([
            "a = " + "[" * 3000, "a = " + "{a = " * 3000, "a." * 5000 + "b = 1",
            "[" + "a." * 5000 + "b]",
            "a = " + "9" * 6000, "a = 1\n" * 3, "".join(f"a{i} = 1\n" for i in range(3000)),
            "model = " + "[" * 200 + "]" * 200, '"' + "k" * 100_000 + '" = 1', "#" + "x" * 100_000,
            "[model.k]\n", "[[model]]\n[[model]]\n", "a = " + "{a = " * 100 + "1" + "}" * 100,
        ])  # fmt: skip
        lines = text.splitlines()
        lines.insert(choices.below(len(lines) + 1), deep)
        return "\n".join(lines).encode()
    values = NASTY if how == 5 else PLAIN
    return toml_of(_mutated_table(choices, tomllib.loads(text), values)).encode(
        "utf-8", errors="surrogatepass"
    )


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    """Return a folder in memory if there is one."""
    shm = Path("/dev/shm")
    with tempfile.TemporaryDirectory(
        prefix="gms-fsm-fuzz-", dir=shm if shm.is_dir() else None
    ) as name:
        yield Path(name)


def one_scenario(data: bytes) -> bool:
    """Load one scenario file with its record; run accepted files for a few steps.

    Only `ScenarioError` and `RecordError` may be raised for a file, and only `GMSError` for its
    run; a run that fails keeps its rows.
    Returns whether it was accepted.
    """
    choices = Choices(data)
    record = _mutated_record(choices) if choices.below(3) == 2 else sine_table().encode()
    overrides = []
    if choices.below(5) == 4:
        for _ in range(1 + choices.below(2)):
            one = choices.one_of(OVERRIDES)
            overrides.append(_mutated_text(choices, one) if choices.below(2) else one)
    with _strict(), _folder() as folder:
        (folder / "own.csv").write_bytes(record)
        (folder / "rig.toml").write_bytes(_scenario_text(choices))
        try:
            loaded = load_scenario(folder / "rig.toml", overrides)
        except (ScenarioError, RecordError) as error:
            _is_a_message(error)
            return False
        try:
            _start_and_run(loaded)
        except SimulationError as error:
            _is_a_message(error)
            error.trace.t[0]
            with contextlib.suppress(MissingExtraError):  # of the engine selected in the file
                error.trace.columns()
        except GMSError as error:
            _is_a_message(error)
        return True


def _start_and_run(loaded: Any) -> None:
    """Run a few steps in the same way as `simulate`."""
    options = {name: value for name, value in loaded.arguments.items() if name != "monitors"}
    where = {name: options.pop(name) for name in ("t_end", "t_start", "initial") if name in options}
    what = (loaded.model, loaded.rig) if loaded.system is None else (loaded.system, None)
    if np.size(options.get("t_eval", ())) < 10_000:
        Problem.of(*what, settings=Settings(**options), **where)
    # With requested times an arc runs to the last of them, and hostile numbers make stiff runs.
    options.pop("t_eval", None)
    settings = Settings(**options)
    run = Run(Problem.of(*what, settings=settings, rows_at_once=20, **where))
    for _ in range(5):
        if not run.advance():
            break
    trace = run.recorder.trace()
    assert (np.diff(trace.t) >= 0).all()
    trace.columns()


# --------------------------------------------------------------------------- trace files
@functools.cache
def _valid_traces() -> list[dict[str, bytes]]:
    """Return small traces as files."""
    lugre = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    traces = [
        simulate(stick_slip("signed"), Prescribed("0.3"), 2.0),
        simulate(*pulled_mass(), 3.0, rtol=1e-3, t_eval=np.linspace(0, 3, 7)),
        simulate(lugre, Slider(1.0, [(0, 0), (2, 0.5)]), 0.02),
        simulate(stick_slip("published"), Prescribed(([0, 1, 2], [0.0, 0.4, 0.1])), 2.0),
    ]
    found = []
    for trace in traces:
        for ending in (".npz", ".csv"):
            with tempfile.TemporaryDirectory() as folder:
                trace.save(Path(folder) / f"run{ending}")
                found.append({path.name: path.read_bytes() for path in Path(folder).iterdir()})
    return found


HEADERS = [
    *[value for value in NASTY if not isinstance(value, datetime.date | datetime.time)],
    None, "formula", "corners", "function", "compiled", "located", "step", 10**15,
    "__import__('os')", "1 +", "z", ["v"], ["z", "z"], [{"name": "a", "flow": {"z": "v"}}],
    {"z": "v"}, "Slider", "PulledSlider", {"k": [1.0]}, {"engine": None}, [0.0] * 4, "stick",
    "z >= s",
]  # fmt: skip
_UNFIT = (ValueError, TypeError, OverflowError, RuntimeError)


def _mutated_array(choices: Choices, array: Any) -> Any:
    """Return a replacement for an array of a trace."""
    how = choices.below(12)
    if array.dtype.names:  # the log
        log = array.copy()
        if how < 6 and log.size:
            name = choices.one_of(log.dtype.names)
            wanted = choices.one_of([0, 1, -1, 99, 2**40, np.nan, np.inf, "nowhere", "stick", ""])
            with contextlib.suppress(*_UNFIT):
                log[name][choices.below(log.size)] = wanted
            return log
        others = log[:0], log[::-1], np.zeros(2), log[:, None], np.concatenate([log] * 3)
        return choices.one_of(others)
    if how == 0:
        return array[: choices.below(max(1, len(array)))] if array.ndim else array
    if how == 1:
        return array[::-1] if array.ndim else array
    if how == 2:
        kinds = ["f4", "f8", "i4", "i8", "u1", "?", "c16", "U5", "S5", ">f8", "f2", "M8[s]", "V8"]
        with contextlib.suppress(*_UNFIT), np.errstate(all="ignore"):
            return array.astype(choices.one_of(kinds))
        return array
    if how == 3:
        return array.reshape(-1)
    if how == 4:
        return array[..., None]
    if how == 5:
        return np.zeros(choices.one_of([(0,), (), (1,), (0, 4), (4, 0), (2, 2, 2)]), array.dtype)
    if how == 6:
        return np.asfortranarray(array)
    changed = array.copy()
    if changed.size and changed.dtype.kind in "fiu":
        flat = changed.reshape(-1)
        numbers = [0, -1, 1, 2, 7, 2**40, np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324]
        number = choices.one_of(numbers if changed.dtype.kind == "f" else numbers[:6])
        with np.errstate(all="ignore"), contextlib.suppress(*_UNFIT):
            if how < 10:
                flat[choices.below(flat.size)] = number
            else:
                flat[:] = number
    return changed


def _large_array(choices: Choices) -> bytes:
    """Return an array whose header claims many entries; it may have them."""
    head = io.BytesIO()
    count = choices.one_of([0, 10**4, 10**6, 4 * 10**7, 10**9, 10**15, 2**62, -1])
    shape = choices.one_of([(count,), (count, 5), (5, count), (count, 0)])
    kind = choices.one_of(["<f8", "<i8", "<U2000", "|V8", "|O", "<U2000000"])
    np.lib.format.write_array_header_1_0(
        head, {"descr": kind, "fortran_order": False, "shape": shape}
    )
    return head.getvalue() + bytes(min(max(0, count), 10**6) * 8 * choices.one_of([0, 1]))


def _mutated_npz(choices: Choices, content: bytes) -> bytes:
    how = choices.below(8)
    if how == 0:
        return damaged(choices, content)
    with np.load(io.BytesIO(content)) as file:
        arrays = dict(file)
    if how in (1, 2):  # a valid archive with a damaged member, or one that claims to be large
        name = choices.one_of(sorted(arrays))
        methods = [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA]
        method = choices.one_of(methods) if how == 1 else zipfile.ZIP_DEFLATED
        out, large = io.BytesIO(), _large_array(choices) if how == 2 else b""
        with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(out, "w", method) as new:
            for member in old.namelist():
                data = old.read(member)
                if member == f"{name}.npy":
                    data = large or damaged(choices, data)
                new.writestr(member, data)
        return out.getvalue()
    if how in (3, 4):
        header = json.loads(str(arrays["header"]))
        changed = _mutated_table(choices, header, HEADERS)
        arrays["header"] = np.array(json.dumps(changed))
    else:
        for _ in range(1 + choices.below(3)):
            name = choices.one_of(sorted(arrays))
            if choices.below(12) == 11:
                del arrays[name]
                if not arrays:
                    break
            else:
                arrays[name] = _mutated_array(choices, arrays[name])
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def _mutated_csv(choices: Choices, files: dict[str, bytes]) -> dict[str, bytes]:
    files = dict(files)
    name = choices.one_of(["run.csv", "run.csv", "run.transitions.csv"])
    how = choices.below(8)
    if how == 0:
        files[name] = damaged(choices, files[name])
    elif how == 1:
        text = _mutated_text(choices, files[name].decode())
        files[name] = text.encode("utf-8", errors="surrogatepass")
    elif how in (2, 3):
        first, _, rest = files["run.csv"].decode().partition("\n")
        changed = _mutated_table(choices, json.loads(first[2:]), HEADERS)
        files["run.csv"] = f"# {json.dumps(changed)}\n{rest}".encode()
    elif how == 4:
        del files[name]
    else:
        lines = [line.split(",") for line in files[name].decode().split("\n")]
        start = 1 if name == "run.csv" else 0
        for _ in range(1 + choices.below(3)):
            line = lines[min(len(lines) - 1, start + choices.below(len(lines)))]
            cell = choices.one_of([*CELLS, "stick", "slip", "arrest", "1e400", "99", "-1"])
            line[choices.below(len(line))] = cell
        if choices.below(4) == 3:
            del lines[choices.below(len(lines))]
        files[name] = "\n".join(",".join(line) for line in lines).encode()
    return files


def one_trace_file(data: bytes) -> bool:
    """Load one trace file; read everything in accepted files.

    Only `TraceFileError` may be raised. An accepted trace has all its columns, can be sampled,
    explained and summarized, and saves and loads unchanged.
    Returns whether it was accepted.
    """
    choices = Choices(data)
    if choices.below(12) == 11:
        name = choices.one_of(["run.npz", "run.csv"])
        start = choices.one_of([b"", b"PK\x03\x04", b"\x93NUMPY\x01\x00", b"# {", b"# {}\n"])
        files = {name: start + choices.rest()}
    else:
        files = choices.one_of(_valid_traces())
        if "run.npz" in files:
            files = {"run.npz": _mutated_npz(choices, files["run.npz"])}
        else:
            files = _mutated_csv(choices, files)
    with _strict(), _folder() as folder:
        for name, content in files.items():
            (folder / name).write_bytes(content)
        path = folder / ("run.npz" if "run.npz" in files else "run.csv")
        try:
            trace = Trace.load(path)
        except TraceFileError as error:
            _is_a_message(error)
            return False
        _use_trace(trace, path)
        return True


def _use_trace(trace: Trace, path: Path) -> None:
    columns = trace.columns()
    assert all(len(column) == len(trace) for column in columns.values())
    repr(trace)
    trace.transitions_csv()
    dwell_times(trace)
    again = Trace.load(trace.save(path.with_name(f"again{path.suffix}")))
    for name, column in again.columns().items():
        np.testing.assert_array_equal(column, columns[name], err_msg=name)
    try:
        sampled = trace.sample(np.linspace(trace.t[0], trace.t[-1], 5))
        sampled.columns()
        trace.refined(5)
        for element in range(min(trace.n, 3)):
            explain(trace, -1, element)
    except GMSError as error:
        _is_a_message(error)


BODIES: dict[str, Callable[[bytes], bool]] = {
    "expression": one_expression,
    "scenario": one_scenario,
    "trace": one_trace_file,
}
