"""The expression language: text -> checked tree -> every other spelling.

All physics and all switching of this package is written as short texts (``z >= s and v > v_c``).
Here such a text becomes a tree that can be evaluated, printed as Python or as Stateflow text, and
split into its atomic comparisons. Nothing is ever handed to `eval`: the text is parsed with `ast`
and only nodes on an allow-list survive; code is generated from the checked tree alone.

Grammar: numbers, declared names, ``pi``, ``+ - * / **``, ``< <= > >=`` (chains are split),
``and or not``, ``abs exp sqrt sgn min max sin cos tanh``. ``==`` on floats is refused.
``pow(a, b)``, as code prints some powers, is read as ``a**b``.
"""

from __future__ import annotations

import ast
import difflib
import math
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from gms_fsm.errors import ExpressionError, shown
from gms_fsm.language._parser import PARSER

__all__ = [
    "MATLAB_LIKE",
    "PYTHON",
    "Binary",
    "Both",
    "Call",
    "Comparison",
    "Condition",
    "Either",
    "InState",
    "Literal",
    "Name",
    "Negative",
    "Not",
    "Number",
    "Relation",
    "Spelling",
    "Value",
    "clauses",
    "comparisons",
    "derivative",
    "evaluate",
    "names_in",
    "parse_condition",
    "parse_value",
    "product_power",
    "renamed",
    "rough_points",
    "spell",
    "split",
    "states_in",
    "substitute",
    "turning_inside",
]

LONGEST_TEXT = 10_000  # characters; a chart's text is a line, not a program
DEEPEST_TREE = 60  # levels; keeps every recursive reader far from Python's own limit
LARGEST_PRODUCT_POWER = 8  # x**8 and below are printed as products ...
LARGEST_PRODUCT = 64  # ... unless the text would grow beyond this many parts
MOST_ARGUMENTS = 50  # of min and max
MOST_COMPARISONS = 100  # in one text; a guard is a line, and each is watched on its own


# --------------------------------------------------------------------------- the tree
@dataclass(frozen=True)
class Number:
    """A finite constant."""

    value: float


@dataclass(frozen=True)
class Name:
    """A declared name."""

    id: str


@dataclass(frozen=True)
class Negative:
    """``-operand``."""

    operand: Value


@dataclass(frozen=True)
class Binary:
    """``left op right`` with op one of ``+ - * / **``."""

    op: str
    left: Value
    right: Value


@dataclass(frozen=True)
class Call:
    """``function(*arguments)``."""

    function: str
    arguments: tuple[Value, ...]


@dataclass(frozen=True)
class Relation:
    """One atomic comparison, ``left op right`` with op one of ``< <= > >=``."""

    op: str
    left: Value
    right: Value


@dataclass(frozen=True)
class InState:
    """``state(element) == name``, elements counted from 1: of breakpoints, never of guards.

    Element 0 is the one that is asked: ``state == name``, of invariants.
    """

    element: int
    state: str


@dataclass(frozen=True)
class Not:
    """``not operand``."""

    operand: Condition


@dataclass(frozen=True)
class Both:
    """``a and b and ...``."""

    operands: tuple[Condition, ...]


@dataclass(frozen=True)
class Either:
    """``a or b or ...``."""

    operands: tuple[Condition, ...]


Value: TypeAlias = Number | Name | Negative | Binary | Call
Condition: TypeAlias = Relation | InState | Not | Both | Either
Node: TypeAlias = Value | Condition


# --------------------------------------------------------------------------- functions
def sgn(u: float) -> float:
    """Sign of u with sgn(0) = 0.

    >>> sgn(-2.5), sgn(0.0), sgn(1e-300)
    (-1.0, 0.0, 1.0)
    """
    if u > 0.0:
        return 1.0
    if u < 0.0:
        return -1.0
    return 0.0


# Scalar functions on purpose: numpy's array exp differs from math.exp in the last bit now and then,
# and the readable and the compiled engine have to agree bit for bit.
FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "abs": abs,
    "exp": math.exp,
    "sqrt": math.sqrt,
    "sgn": sgn,
    "min": min,
    "max": max,
    "sin": math.sin,
    "cos": math.cos,
    "tanh": math.tanh,
}
NAMESPACE: Mapping[str, Callable[..., float]] = {**FUNCTIONS, "pow": math.pow}  # of printed code
CONSTANTS: Mapping[str, float] = {"pi": math.pi}
ROUGH = ("sgn", "abs", "min", "max")  # functions whose flow has a corner or a jump

_OPERATORS: Mapping[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}
_COMPARISONS: Mapping[type[ast.cmpop], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}
# What pictures show and other languages write, and what is written here.
_INSTEAD: Mapping[str, str] = {
    "&&": "and",
    "&": "and",
    "∧": "and",
    "||": "or",
    "∨": "or",
    "|": "abs(...)",
    "!": "not",
    "¬": "not",
    "=": "<= or >=",
    "≤": "<=",
    "≥": ">=",
    "^": "**",
    "·": "*",
    "−": "-",
}
_FOREIGN = re.compile(r"&&?|\|\|?|!(?!=)|(?<![<>=!:])=(?![=>])|[∧∨¬≤≥^·−]")
_ALIASES: Mapping[str, str] = {"sign": "sgn", "signum": "sgn", "fabs": "abs"}
_GRAMMAR = "numbers, names, + - * / **, < <= > >=, and or not, " + " ".join(FUNCTIONS) + " pi"


# --------------------------------------------------------------------------- reading
def parse_value(text: str, names: Iterable[str]) -> Value:
    """Read a text that stands for a number.

    Parameters
    ----------
    text : str
        For example ``"C * (sgn(v) - z / s)"``.
    names : iterable of str
        The names that may occur.

    Returns
    -------
    Value
        The checked tree.

    Raises
    ------
    ExpressionError
        With the text, the column and what would be allowed.

    Examples
    --------
    >>> parse_value("2 * v", ["v"])
    Binary(op='*', left=Number(value=2.0), right=Name(id='v'))
    """
    return _Reader(text, names).value(_tree(text), 0)


def parse_condition(
    text: str,
    names: Iterable[str],
    states: Iterable[str] = (),
    elements: int = 0,
    *,
    own_state: bool = False,
) -> Condition:
    """Read a text that is true or false, such as a guard.

    Parameters
    ----------
    text : str
        For example ``"abs(v) <= v_c and abs(z) < s"``.
    names : iterable of str
        The names that may occur.
    states : iterable of str, optional
        State names that ``state(i) == name`` may ask for (breakpoints do, guards do not).
    elements : int, optional
        How many elements there are; i counts from 1.
    own_state : bool
        Whether ``state == name`` may ask for the element at hand (invariants do).

    Returns
    -------
    Condition
        The checked tree; a chain ``a < b < c`` is split at once.

    Raises
    ------
    ExpressionError
        With the text, the column and what would be allowed.

    Examples
    --------
    >>> spell(parse_condition("0 < v < 1", ["v"]))
    '0.0 < v and v < 1.0'
    """
    return _Reader(text, names, states, elements, own_state).condition(_tree(text), 0)


def _tree(text: str) -> ast.expr:
    if not isinstance(text, str):
        raise ExpressionError(
            f"expected a text, got {type(text).__name__}", repr(text), 1, "a text in quotes"
        )
    if len(text) > LONGEST_TEXT:
        raise ExpressionError(
            f"the text has {len(text)} characters",
            text,
            LONGEST_TEXT + 1,
            f"at most {LONGEST_TEXT} characters",
        )
    for column, mark in enumerate(text, start=1):
        if mark in "#\\\0;" or "\ud800" <= mark <= "\udfff":
            reason = (
                f"unexpected {mark!a}" if mark < "\ud800" else "half a character cannot be read"
            )
            raise ExpressionError(reason, text, column, _GRAMMAR)
    foreign = _FOREIGN.search(text)
    if foreign:
        mark = foreign[0]
        raise ExpressionError(
            f"{mark} is not part of the language",
            text,
            foreign.start() + 1,
            f"{_INSTEAD[mark]}, in its place",
        )
    flat = "".join(" " if c.isspace() else c for c in text)  # same length: columns stay true
    lead = len(flat) - len(flat.lstrip())
    if lead == len(flat):
        raise ExpressionError("the text is empty", text, 1, _GRAMMAR)
    try:
        with PARSER, warnings.catch_warnings():
            warnings.simplefilter("error")  # "1and v" is a warning to Python, a mistake here
            body = ast.parse(flat[lead:], mode="eval").body
    except SyntaxError as error:
        # Python reports offset 0 where it reached the end and wanted more.
        column = min(error.offset + lead, len(text) + 1) if error.offset else len(text) + 1
        reason = "the text ends too early" if column > len(text) else "cannot be read from here"
        raise ExpressionError(reason, text, column, _GRAMMAR) from None
    except (ValueError, RecursionError, MemoryError):
        raise ExpressionError("cannot be read (nested too deeply)", text, 1, _GRAMMAR) from None
    raw = flat[lead:].encode()
    for node in ast.walk(body):
        if isinstance(node, ast.expr):  # ast counts bytes, a reader counts characters
            node.col_offset = lead + len(raw[: node.col_offset].decode(errors="ignore"))
    return body


def _meant(name: str, known: Iterable[str]) -> str:
    """Return the known name that is nearest to a wrong one, as a question."""
    by_case = {each.casefold(): each for each in known}
    wanted = _ALIASES.get(name, name).casefold()
    near = difflib.get_close_matches(wanted[:100], by_case, n=1, cutoff=0.75)
    return f" (did you mean {by_case[near[0]]!r}?)" if near else ""


class _Reader:
    """Turns `ast` nodes into our own, refusing everything that is not on the list."""

    def __init__(
        self,
        text: str,
        names: Iterable[str],
        states: Iterable[str] = (),
        elements: int = 0,
        own_state: bool = False,
    ) -> None:
        self.text = text
        self.names = tuple(dict.fromkeys(names))
        self.states, self.elements, self.own_state = tuple(states), elements, own_state
        self.comparisons = 0

    def refuse(self, reason: str, node: ast.expr, allowed: str = _GRAMMAR) -> ExpressionError:
        return ExpressionError(reason, self.text, node.col_offset + 1, allowed)

    def deeper(self, node: ast.expr, depth: int) -> int:
        if depth >= DEEPEST_TREE:
            raise self.refuse(
                "nested too deeply", node, f"at most {DEEPEST_TREE} levels of nesting"
            )
        return depth + 1

    def value(self, node: ast.expr, depth: int) -> Value:
        depth = self.deeper(node, depth)
        match node:
            case ast.Constant(value=bool()):
                raise self.refuse(f"{node.value!r} is not a number", node)
            case ast.Constant(value=int() | float() as number):
                try:
                    real = float(number)
                except OverflowError:
                    real = math.inf
                if not math.isfinite(real):
                    raise self.refuse("the number is too large", node, "finite numbers")
                return Number(real)
            case ast.Name(id=name):
                if name in self.names:
                    return Name(name)
                if name in CONSTANTS:
                    return Number(CONSTANTS[name])
                if name in FUNCTIONS:
                    raise self.refuse(f"the function {name!r} needs (...)", node, f"{name}(...)")
                known = ", ".join(self.names) or "none"
                raise self.refuse(
                    f"unknown name {shown(name)}{_meant(name, self.names)}",
                    node,
                    f"the names {known}, and pi",
                )
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return Negative(self.value(operand, depth))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.value(operand, depth)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                return Binary(
                    _OPERATORS[type(op)], self.value(left, depth), self.value(right, depth)
                )
            case ast.Call(func=ast.Name(id=function), args=arguments, keywords=[]):
                self.known(node, function)
                return self.call(node, function, arguments, depth)
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
                raise self.refuse("a comparison stands where a number is needed", node)
        raise self.refuse(f"{_plain(node)} is not part of the language", node)

    def known(self, node: ast.expr, function: str) -> None:
        if function not in NAMESPACE:
            raise self.refuse(
                f"unknown function {shown(function)}{_meant(function, FUNCTIONS)}",
                node,
                "the functions " + ", ".join(FUNCTIONS),
            )

    def call(self, node: ast.expr, function: str, arguments: list[ast.expr], depth: int) -> Value:
        if function == "pow":
            if len(arguments) != 2:
                raise self.refuse(f"pow got {len(arguments)} arguments", node, "two arguments")
            return Binary("**", self.value(arguments[0], depth), self.value(arguments[1], depth))
        several = function in ("min", "max")
        if (len(arguments) < 2) if several else (len(arguments) != 1):
            wanted = "two or more arguments" if several else "one argument"
            raise self.refuse(f"{function} got {len(arguments)} arguments", node, wanted)
        if len(arguments) > MOST_ARGUMENTS:
            raise self.refuse(
                f"{function} got {len(arguments)} arguments", node, f"at most {MOST_ARGUMENTS}"
            )
        # min(a, b, c) is min(min(a, b), c), one corner at a time: the first arguments lie deepest.
        folds = max(0, len(arguments) - 2)
        values = [
            self.value(argument, depth + min(folds, len(arguments) - 1 - i))
            for i, argument in enumerate(arguments)
        ]
        result = Call(function, tuple(values[:2]))
        for value in values[2:]:
            result = Call(function, (result, value))
        return result

    def condition(self, node: ast.expr, depth: int) -> Condition:
        depth = self.deeper(node, depth)
        match node:
            case ast.Compare(
                left=ast.Call(func=ast.Name(id="state")) as call, ops=[op], comparators=[name]
            ) if self.states:
                return self.in_state(self.numbered(call), op, name)
            case ast.Compare(left=ast.Name(id="state"), ops=[op], comparators=[name]) if (
                self.own_state
            ):
                return self.in_state(0, op, name)
            case ast.Compare(left=left, ops=ops, comparators=comparators):
                sides = [left, *comparators]
                self.comparisons += len(ops)
                if self.comparisons > MOST_COMPARISONS:
                    raise self.refuse(
                        "too many comparisons", node, f"at most {MOST_COMPARISONS} in one text"
                    )
                parts: list[Condition] = []
                for i, op in enumerate(ops):
                    if type(op) not in _COMPARISONS:
                        raise self.refuse(
                            "only < <= > >= compare floats (== and != almost never hold)",
                            sides[i + 1],
                            "< <= > >=, for example a <= x <= b",
                        )
                    parts.append(
                        Relation(
                            _COMPARISONS[type(op)],
                            self.value(sides[i], depth),
                            self.value(sides[i + 1], depth),
                        )
                    )
                return parts[0] if len(parts) == 1 else Both(tuple(parts))
            case ast.BoolOp(op=op, values=values):
                operands = tuple(self.condition(value, depth) for value in values)
                return Both(operands) if isinstance(op, ast.And) else Either(operands)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return Not(self.condition(operand, depth))
            case ast.Constant() | ast.Name() | ast.BinOp() | ast.UnaryOp() | ast.Call():
                match node:
                    case ast.Call(func=ast.Name(id=function)):  # after(0.2), say
                        self.known(node, function)
                raise self.refuse(
                    "a number stands where a comparison is needed", node, "for example v > v_c"
                )
        raise self.refuse(f"{_plain(node)} is not part of the language", node)

    def numbered(self, call: ast.Call) -> int:
        match call.args:
            case [ast.Constant(value=element)] if type(element) is int:  # True is not 1 here
                if 1 <= element <= self.elements:
                    return element
        raise self.refuse(
            "state(...) takes an element's number", call, f"state(1) to state({self.elements})"
        )

    def in_state(self, element: int, op: ast.cmpop, name: ast.expr) -> Condition:
        if not isinstance(name, ast.Name) or name.id not in self.states:
            raise self.refuse("unknown state", name, "the states " + ", ".join(self.states))
        if not isinstance(op, ast.Eq | ast.NotEq):
            raise self.refuse("states are compared by == or !=", name, "state(1) == slip")
        found = InState(element, name.id)
        return found if isinstance(op, ast.Eq) else Not(found)


def _plain(node: ast.expr) -> str:
    match node:
        case ast.Constant(value=value) if value is not ...:
            return f"the constant {shown(value)}"
        case ast.BinOp(op=op) | ast.UnaryOp(op=op):
            signs = {
                "Mod": "%",
                "FloorDiv": "//",
                "MatMult": "@",
                "BitAnd": "&",
                "BitOr": "|",
                "BitXor": "^",
                "LShift": "<<",
                "RShift": ">>",
                "Invert": "~",
            }
            return f"the operator {signs.get(type(op).__name__, type(op).__name__.lower())}"
    words = {
        ast.Attribute: "an attribute (.)",
        ast.Subscript: "an index ([ ])",
        ast.Lambda: "lambda",
        ast.IfExp: "if ... else",
        ast.NamedExpr: "an assignment (:=)",
        ast.JoinedStr: "an f-string",
        ast.Call: "this call",
        ast.Tuple: "a comma",
        ast.Starred: "a star",
        ast.Await: "await",
        ast.Yield: "yield",
        ast.YieldFrom: "yield",
    }
    return words.get(type(node), "a bracket like this")


# --------------------------------------------------------------------------- spelling
@dataclass(frozen=True)
class Spelling:
    """How a tree is written: the words of the logic and how functions and powers look.

    Parameters
    ----------
    both, either, negation : str
        The words for and, or, not, with their spaces.
    bars : bool
        Write ``|u|`` for ``abs(u)``.
    products : bool
        Write small integer powers as products, and other powers as ``pow(a, b)``.
    """

    both: str
    either: str
    negation: str
    bars: bool
    products: bool


PYTHON = Spelling(" and ", " or ", "not ", bars=False, products=True)
MATLAB_LIKE = Spelling(" && ", " || ", "!", bars=True, products=False)

_LEVEL = {"or": 1, "and": 2, "not": 3, "<": 4, "+": 5, "-": 5, "*": 6, "/": 6, "neg": 7, "**": 8}
_ATOM = 9


def spell(node: Node, spelling: Spelling = PYTHON, rename: Mapping[str, str] | None = None) -> str:
    """Write a tree as text.

    Parameters
    ----------
    node : Node
        A value or a condition.
    spelling : Spelling
        `PYTHON` for generated code (a small integer power is printed as a product, so that the
        readable and the compiled engine round alike), `MATLAB_LIKE` for charts.
    rename : mapping, optional
        Names to write differently, for example ``{"k": "k[i]"}``.

    Returns
    -------
    str
        The text, with no more parentheses than needed.

    Examples
    --------
    >>> guard = parse_condition("abs(v) <= v_c and not z >= s", ["v", "v_c", "z", "s"])
    >>> spell(guard, MATLAB_LIKE)
    '|v| <= v_c && !(z >= s)'
    >>> spell(parse_value("(v / v_s)**2", ["v", "v_s"]))
    'v / v_s * (v / v_s)'
    """
    return _spell(node, spelling, rename or {})[0]


def _number(value: float, spelling: Spelling) -> str:
    if spelling.products:
        return repr(value)  # always with a point or an exponent: 1/2 stays one half everywhere
    return f"{value:g}" if float(f"{value:g}") == value else repr(value)


def _spell(node: Node, spelling: Spelling, rename: Mapping[str, str]) -> tuple[str, int]:
    def part(child: Node, level: int) -> str:
        text, own = _spell(child, spelling, rename)
        return text if own >= level else f"({text})"

    match node:
        case Number(value):
            return _number(value, spelling), _ATOM if value >= 0 else _LEVEL["neg"]
        case Name(name):
            return rename.get(name, name), _ATOM
        case Negative(operand):
            return "-" + part(operand, _LEVEL["neg"] + 1), _LEVEL["neg"]
        case Binary("**", base, exponent):
            return _power(base, exponent, spelling, rename)
        case Binary(op, left, right):
            level = _LEVEL[op]
            # The right side of + and * is bracketed too: floats do not associate, and the text
            # has to say which order is computed.
            return f"{part(left, level)} {op} {part(right, level + 1)}", level
        case Call("abs", (argument,)) if spelling.bars:
            return f"|{part(argument, 0)}|", _ATOM
        case Call(function, arguments):
            return f"{function}({', '.join(part(a, 0) for a in arguments)})", _ATOM
        case Relation(op, left, right):
            return f"{part(left, _LEVEL['+'])} {op} {part(right, _LEVEL['+'])}", _LEVEL["<"]
        case InState(element, state):
            own = f"state({element})" if element else "state"
            return f"{own} == {state}", _LEVEL["<"]
        case Not(operand):
            inner = part(operand, _ATOM if spelling.negation == "!" else _LEVEL["not"])
            return spelling.negation + inner, _LEVEL["not"]
        case Both(operands):
            return spelling.both.join(part(o, _LEVEL["and"] + 1) for o in operands), _LEVEL["and"]
        case Either(operands):
            return spelling.either.join(part(o, _LEVEL["or"] + 1) for o in operands), _LEVEL["or"]


def _power(
    base: Value, exponent: Value, spelling: Spelling, rename: Mapping[str, str]
) -> tuple[str, int]:
    inner, level = _spell(base, spelling, rename)
    if not spelling.products:
        power, power_level = _spell(exponent, spelling, rename)
        power = power if power_level == _ATOM else f"({power})"
        return f"{inner if level == _ATOM else f'({inner})'}^{power}", _LEVEL["**"]
    whole = product_power(base, exponent)
    if whole is None:
        return f"pow({inner}, {_spell(exponent, spelling, rename)[0]})", _ATOM
    if whole == 0:
        return "1.0", _ATOM
    if whole == 1:
        return inner, level
    first = inner if level >= _LEVEL["*"] else f"({inner})"
    other = inner if level > _LEVEL["*"] else f"({inner})"
    product = " * ".join([first] + [other] * (abs(whole) - 1))
    if whole < 0:
        return f"1.0 / {other if whole == -1 else f'({product})'}", _LEVEL["/"]
    return product, _LEVEL["*"]


def product_power(base: Value, exponent: Value) -> int | None:
    """Return the power if it is computed as a product, else None (it is computed by pow).

    Parameters
    ----------
    base, exponent : Value
        Of ``base**exponent``.

    Returns
    -------
    int or None
        The whole power, -8 to 8.

    Examples
    --------
    >>> product_power(Name("v"), Number(2.0)), product_power(Name("v"), Number(0.5))
    (2, None)
    """
    return _fitting_power(_parts(base), exponent)


def _fitting_power(parts: int, exponent: Value) -> int | None:
    whole = _whole_power(exponent)
    return None if whole is None or abs(whole) * parts > LARGEST_PRODUCT else whole


def _parts(node: Value) -> int:
    """Count the names and numbers of a value as printed, powers as products."""
    match node:
        case Binary("**", base, exponent):
            parts = _parts(base)  # once: a power of a power of a power would double the work
            whole = _fitting_power(parts, exponent)
            return parts + _parts(exponent) if whole is None else max(1, parts * abs(whole))
        case Negative(operand):
            return _parts(operand)
        case Binary(_, left, right):
            return _parts(left) + _parts(right)
        case Call(_, arguments):
            return sum(_parts(argument) for argument in arguments)
    return 1


def _whole_power(exponent: Value) -> int | None:
    sign = 1.0
    while isinstance(exponent, Negative):
        sign, exponent = -sign, exponent.operand
    if not isinstance(exponent, Number) or not exponent.value.is_integer():
        return None
    whole = int(sign * exponent.value)
    return whole if abs(whole) <= LARGEST_PRODUCT_POWER else None


# --------------------------------------------------------------------------- readers of the tree
def evaluate(node: Node, values: Mapping[str, Any]) -> float | bool:
    """Compute a tree, rounding exactly as the generated code does.

    Parameters
    ----------
    node : Node
        A value or a condition.
    values : mapping of str to float
        A number for every name in the tree; for ``state(1)`` under that key a state's name.

    Returns
    -------
    float or bool
        The number, or the truth.

    Examples
    --------
    >>> evaluate(parse_condition("z >= s and v > 0", "zsv"), {"z": 1.0, "s": 1.0, "v": 0.1})
    True
    """
    match node:
        case Number(value):
            return value
        case Name(name):
            return float(values[name])
        case Negative(operand):
            return -evaluate(operand, values)
        case Binary("**", base, exponent):
            return _evaluate_power(base, exponent, values)
        case Binary(op, left, right):
            a, b = evaluate(left, values), evaluate(right, values)
            if op == "+":
                return a + b
            if op == "-":
                return a - b
            return a * b if op == "*" else a / b
        case Call(function, arguments):
            return FUNCTIONS[function](*(evaluate(a, values) for a in arguments))
        case Relation(op, left, right):
            return _compare(op, evaluate(left, values), evaluate(right, values))
        case InState(element, state):
            return bool(values[f"state({element})"] == state)
        case Not(operand):
            return not evaluate(operand, values)
        case Both(operands):
            return all(evaluate(o, values) for o in operands)
        case Either(operands):
            return any(evaluate(o, values) for o in operands)


def _compare(op: str, a: float, b: float) -> bool:
    if op == "<":
        return a < b
    if op == "<=":
        return a <= b
    return a > b if op == ">" else a >= b


def _evaluate_power(base: Value, exponent: Value, values: Mapping[str, float]) -> float:
    whole = product_power(base, exponent)
    if whole is None:
        return math.pow(evaluate(base, values), evaluate(exponent, values))
    if whole == 0:
        return 1.0
    product = factor = evaluate(base, values)
    for _ in range(abs(whole) - 1):
        product *= factor
    return 1.0 / product if whole < 0 else product


def _children(node: Node) -> tuple[Node, ...]:
    match node:
        case Negative(operand) | Not(operand):
            return (operand,)
        case Binary(_, left, right) | Relation(_, left, right):
            return (left, right)
        case Call(_, arguments):
            return arguments
        case Both(operands) | Either(operands):
            return operands
    return ()


def _walk(node: Node) -> Iterator[Node]:
    for child in _children(node):
        yield from _walk(child)
    yield node


def names_in(node: Node) -> frozenset[str]:
    """Return the names a tree depends on.

    Parameters
    ----------
    node : Node
        A value or a condition.

    Returns
    -------
    frozenset of str
        Without order.

    Examples
    --------
    >>> sorted(names_in(parse_value("k * z + pi", ["k", "z"])))
    ['k', 'z']
    """
    return frozenset(n.id for n in _walk(node) if isinstance(n, Name))


def states_in(node: Node) -> frozenset[int]:
    """Return the elements whose states a condition asks for, 0 for the one at hand.

    Parameters
    ----------
    node : Node
        A value or a condition.

    Returns
    -------
    frozenset of int
        Without order.

    Examples
    --------
    >>> asked = parse_condition("v > 0 or state(2) == slip", ["v"], ["slip"], 2)
    >>> sorted(states_in(asked))
    [2]
    """
    return frozenset(n.element for n in _walk(node) if isinstance(n, InState))


def clauses(condition: Condition) -> tuple[Condition, ...]:
    """Return the parts of a conjunction, or the condition alone.

    Parameters
    ----------
    condition : Condition
        For example a guard.

    Returns
    -------
    tuple of Condition
        In the order of the text.

    Examples
    --------
    >>> [spell(c) for c in clauses(parse_condition("z >= s and v > 0", "zsv"))]
    ['z >= s', 'v > 0.0']
    """
    return condition.operands if isinstance(condition, Both) else (condition,)


# --------------------------------------------------------------------------- atomic comparisons
@dataclass(frozen=True)
class Comparison:
    """The one relation behind ``z >= s`` and ``z < s``: its margin is ``left - right``.

    True where the margin is positive, and, unless `strict`, also where it is zero. In IEEE
    arithmetic the sign of ``left - right`` is exactly the raw comparison.
    """

    left: Value
    right: Value
    strict: bool


@dataclass(frozen=True)
class Literal:
    """A comparison that has to be true (or, with `holds` False, false)."""

    comparison: Comparison
    holds: bool

    @property
    def relation(self) -> Relation:
        """The literal as ordinary text would write it."""
        strict = self.comparison.strict
        op = (">" if strict else ">=") if self.holds else ("<=" if strict else "<")
        return Relation(op, self.comparison.left, self.comparison.right)


Split: TypeAlias = "Literal | tuple[str, tuple[Split, ...]]"


def split(condition: Condition, holds: bool = True) -> Split:
    """Split a condition into comparisons joined by ``"both"`` and ``"either"`` only.

    ``abs(u) <= c`` becomes ``u <= c`` and ``u >= -c`` (a root finder on ``c - abs(u)`` steps over
    a narrow window, two monotone margins do not), negations move down to the comparisons, and
    ``z < s`` and ``z >= s`` become the same `Comparison`.

    Parameters
    ----------
    condition : Condition
        A checked condition.
    holds : bool
        False to split its negation.

    Returns
    -------
    Literal or (str, tuple)
        A literal, or ``("both" | "either", parts)``.

    Examples
    --------
    >>> word, parts = split(parse_condition("abs(v) <= c", ["v", "c"]))
    >>> word, [spell(p.relation) for p in parts]
    ('both', ['v <= c', 'v >= -c'])
    """
    match condition:
        case InState():
            raise TypeError("a guard depends on values, not on states")
        case Not(operand):
            return split(operand, not holds)
        case Both(operands) | Either(operands):
            word = "both" if isinstance(condition, Both) == holds else "either"
            parts: list[Split] = []
            for operand in operands:
                part = split(operand, holds)
                if isinstance(part, Literal) or part[0] != word:
                    parts.append(part)
                else:  # a conjunction inside a conjunction
                    parts.extend(part[1])
            return word, tuple(parts)
        case Relation(op, Call("abs", (Call("abs") as inner,)), bound):
            return split(Relation(op, inner, bound), holds)  # ||u|| is |u|
        case Relation(op, Call("abs", (inner,)), bound):
            below = op in ("<", "<=")
            other = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}[op]
            two = (Relation(op, inner, bound), Relation(other, inner, Negative(bound)))
            return split(Both(two) if below else Either(two), holds)
        case Relation(op, left, Call("abs", (inner,))):
            mirrored = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}[op]
            return split(Relation(mirrored, Call("abs", (inner,)), left), holds)
        case Relation(op, left, right):
            positive = op in (">", ">=")
            strict = op in (">", "<=")  # a <= b is the negation of a > b
            return Literal(Comparison(left, right, strict), positive == holds)


def comparisons(part: Split) -> tuple[Comparison, ...]:
    """Return the atomic comparisons of a split condition.

    Parameters
    ----------
    part : Literal or (str, tuple)
        From `split`.

    Returns
    -------
    tuple of Comparison
        In the order of the text, with repetitions.

    Examples
    --------
    >>> [spell(c.left) for c in comparisons(split(parse_condition("z >= s and v > 0", "zsv")))]
    ['z', 'v']
    """
    if isinstance(part, Literal):
        return (part.comparison,)
    return tuple(c for each in part[1] for c in comparisons(each))


# --------------------------------------------------------------------------- corners and jumps
def rough_points(value: Value) -> tuple[Value, ...]:
    """Return each u whose sign decides a corner or a jump of `value`, innermost first.

    ``sgn(u)`` and ``abs(u)`` turn at u = 0, ``min(a, b)`` and ``max(a, b)`` at a - b = 0.

    Parameters
    ----------
    value : Value
        A flow or a signal.

    Returns
    -------
    tuple of Value
        Without repetition.

    Examples
    --------
    >>> [spell(u) for u in rough_points(parse_value("sgn(v) + max(v, 2)", ["v"]))]
    ['v', 'v - 2.0']
    """
    found = [_turning(n) for n in _walk(value) if isinstance(n, Call) and n.function in ROUGH]
    return tuple(dict.fromkeys(found))


def turning_inside(value: Value, new: Mapping[str, Value]) -> Value:
    """Return a value with names replaced inside its rough calls only.

    Parameters
    ----------
    value : Value
        For example an output that names the rate dz.
    new : mapping of str to Value
        What the names stand for.

    Returns
    -------
    Value
        A tree whose corners are written without these names.

    Examples
    --------
    >>> spell(turning_inside(parse_value("k * dz + abs(dz)", ["k", "dz"]), {"dz": Name("v")}))
    'k * dz + abs(v)'
    """
    match value:
        case Call(function, arguments) if function in ROUGH:
            return renamed(value, new)
        case Negative(operand):
            return Negative(turning_inside(operand, new))
        case Binary(op, left, right):
            return Binary(op, turning_inside(left, new), turning_inside(right, new))
        case Call(function, arguments):
            return Call(function, tuple(turning_inside(a, new) for a in arguments))
    return value


def _turning(call: Call) -> Value:
    if call.function in ("sgn", "abs"):
        return call.arguments[0]
    a, b = call.arguments
    return a if b == Number(0.0) else Binary("-", a, b)


def substitute(value: Value, sign_names: Mapping[Value, str]) -> tuple[Value, dict[str, Call]]:
    """Replace every rough call by a name, to be computed beforehand from a held sign.

    Parameters
    ----------
    value : Value
        A flow or a signal.
    sign_names : mapping of Value to str
        For its `rough_points` the name that holds the sign; those without one stay as they are.

    Returns
    -------
    smooth : Value
        The tree with names in place of the calls.
    calls : dict of str to Call
        For each such name the call it stands for, in the order they must be computed; arguments
        are already smooth. A call under a square root or a power stays where it is: with its sign
        held it would go below zero behind the corner, where these are not defined.
    """
    calls: dict[str, Call] = {}

    def smooth(node: Value) -> Value:
        match node:
            case Negative(operand):
                return Negative(smooth(operand))
            case Binary("**", base, exponent) if _whole_power(exponent) is None:
                return Binary("**", base, smooth(exponent))
            case Binary(op, left, right):
                return Binary(op, smooth(left), smooth(right))
            case Call("sqrt"):
                return node
            case Call(function, arguments):
                inner = Call(function, tuple(smooth(a) for a in arguments))
                if function not in ROUGH or _turning(node) not in sign_names:
                    return inner
                name = f"{function}_{sign_names[_turning(node)]}"
                calls.setdefault(name, inner)
                return Name(name)
        return node

    return smooth(value), calls


# --------------------------------------------------------------------------- derivatives
ZERO, ONE = Number(0.0), Number(1.0)


def derivative(value: Value, name: str) -> Value | None:
    """Return the partial derivative of a value by a name; its corners count as smooth.

    Parameters
    ----------
    value : Value
        A flow, a signal, one side of a guard.
    name : str
        By which.

    Returns
    -------
    Value or None
        None where the language cannot write it: a power with the name in its exponent.

    Examples
    --------
    >>> print(spell(derivative(parse_value("C * (sgn(v) - z / s)", "Cvzs"), "z")))
    C * -(1.0 / s)
    """
    try:
        return _derivative(value, name)
    except ArithmeticError:
        return None


def _derivative(value: Value, name: str) -> Value:
    if name not in names_in(value):
        return ZERO
    match value:
        case Name():
            return ONE
        case Negative(operand):
            return _minus(ZERO, _derivative(operand, name))
        case Binary("+", a, b):
            return _plus(_derivative(a, name), _derivative(b, name))
        case Binary("-", a, b):
            return _minus(_derivative(a, name), _derivative(b, name))
        case Binary("*", a, b):
            return _plus(_times(_derivative(a, name), b), _times(a, _derivative(b, name)))
        case Binary("/", a, b):
            rest = _times(value, _derivative(b, name))
            return _over(_minus(_derivative(a, name), rest), b)
        case Binary("**", base, exponent):
            if name in names_in(exponent):
                raise ArithmeticError("a logarithm is not part of the language")
            power = Binary("**", base, _minus(exponent, ONE))
            return _times(_times(exponent, power), _derivative(base, name))
        case Call("min" | "max" as function, (a, b)):
            # The mean of both on the corner itself.
            du, dw = _derivative(a, name), _derivative(b, name)
            apart = _times(Call("sgn", (Binary("-", a, b),)), _minus(du, dw))
            half = Binary("*", Number(0.5), _plus(du, dw))
            other = Binary("*", Number(0.5), apart)
            return _minus(half, other) if function == "min" else _plus(half, other)
        case Call(function, (u,)):
            return _times(_outer(function, u), _derivative(u, name))
    raise AssertionError(value)


def _outer(function: str, u: Value) -> Value:
    call = Call(function, (u,))
    match function:
        case "abs":
            return Call("sgn", (u,))
        case "sgn":
            return ZERO
        case "exp":
            return call
        case "sqrt":
            return Binary("/", Number(0.5), call)
        case "sin":
            return Call("cos", (u,))
        case "cos":
            return Negative(Call("sin", (u,)))
        case "tanh":
            return Binary("-", ONE, Binary("*", call, call))
    raise ArithmeticError(f"no derivative of {function} is known")


def _plus(a: Value, b: Value) -> Value:
    if a == ZERO:
        return b
    return a if b == ZERO else Binary("+", a, b)


def _minus(a: Value, b: Value) -> Value:
    if b == ZERO:
        return a
    if isinstance(a, Number) and isinstance(b, Number):
        return Number(a.value - b.value)
    return Negative(b) if a == ZERO else Binary("-", a, b)


def _times(a: Value, b: Value) -> Value:
    if ZERO in (a, b):
        return ZERO
    if a == ONE:
        return b
    return a if b == ONE else Binary("*", a, b)


def _over(a: Value, b: Value) -> Value:
    return ZERO if a == ZERO else Binary("/", a, b)


def renamed(value: Value, new: Mapping[str, Value]) -> Value:
    """Return a value with other values in place of some names.

    Parameters
    ----------
    value : Value
        A tree.
    new : mapping of str to Value
        By name.

    Returns
    -------
    Value
        Another tree.

    Examples
    --------
    >>> spell(renamed(parse_value("k * dz", ["k", "dz"]), {"dz": Name("v")}))
    'k * v'
    """
    match value:
        case Name(name):
            return new.get(name, value)
        case Negative(operand):
            return Negative(renamed(operand, new))
        case Binary(op, left, right):
            return Binary(op, renamed(left, new), renamed(right, new))
        case Call(function, arguments):
            return Call(function, tuple(renamed(a, new) for a in arguments))
    return value
