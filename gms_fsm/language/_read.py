"""Parsing of text into a checked tree.

Nothing is ever passed to `eval`: a text is parsed with `ast`, and only nodes on an allow-list are
accepted. An error gives the position in the text and what would be allowed.
"""

from __future__ import annotations

import ast
import functools
import itertools
import math
import re
import warnings
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from gms_fsm.errors import ExpressionError, shown
from gms_fsm.foundation.arguments import nearest, some_of
from gms_fsm.foundation.parser import PARSER
from gms_fsm.foundation.quantities import in_si
from gms_fsm.language._print import spell
from gms_fsm.language.functions import (
    ALIASES,
    CONSTANTS,
    ELSEWHERE,
    FUNCTIONS,
    NAMESPACE,
    SEVERAL,
    SHORT,
    YIELDING,
)
from gms_fsm.language.normal import chosen, written_out
from gms_fsm.language.tree import (
    LASTING,
    Binary,
    Both,
    Call,
    Condition,
    Either,
    InState,
    Name,
    Negative,
    Not,
    Number,
    Relation,
    Value,
    is_whole,
    walk,
)

LONGEST_TEXT = 10_000  # characters; a chart's text is a line, not a program
DEEPEST_TREE = 60  # levels; keeps every recursive reader far below Python's recursion limit
MOST_ARGUMENTS = 50  # of min and max
MOST_COMPARISONS = 100  # in one text; a guard is a line, and each comparison is watched separately
MOST_PARTS = 2_000  # of a value that is read from short forms, in which arguments are repeated

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
# What pictures show and other languages use, and its equivalent here.
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
    "=>": ">=",
    "=<": "<=",
    "≤": "<=",
    "≥": ">=",
    "^": "**",
    "·": "*",
    "×": "*",
    "²": "**2",
    "³": "**3",
    "−": "-",
}
_FOREIGN = re.compile(r"&&?|\|\|?|!(?!=)|(?<![<>=!:])=[<>]|(?<![<>=!:])=(?!=)|[∧∨¬≤≥^·×²³−]")
_STATE = re.compile(r"\bstate\d*\s*(\(\s*\d+\s*\)\s*)?$")
_WORDS = re.compile(r"\b(AND|OR|NOT)\b")
_COMPARISON = "found a comparison where a number is needed"
_DECIMAL_COMMA = re.compile(r"(?<![\w.])(\d+),(\d+)")
_NO_SIGN_BETWEEN = re.compile(r"[\w.)]\s+[\w(]|\)[\w(]|\d[^\W\d_eE]")  # 2 pi, 2pi, (a)(b)
_AFTER = re.compile(  # as in Stateflow: after(2, sec)
    r"\bafter\(\s*([\d.]+(?:[eE][+-]?\d+)?)\s*,?\s*([mnuµ]?s(?=ec|\W)|min)(?:ec)?\s*\)"
)
_CALLED = (*FUNCTIONS, *SHORT)
_GRAMMAR = "numbers, names, + - * / **, < <= > >=, and or not, " + " ".join(_CALLED) + " pi"
# A call of if: nothing, an operator, a bracket, a comma or a word of conditions stands before it.
_IF = re.compile(
    r"(?:(?<![\w.)\]\s])|(?<=\band)|(?<=\bor)|(?<=\bnot)|(?<=\belse))(\s*)\bif(?=\s*\()"
)


class Owner(NamedTuple):
    """Elements that belong to a name: ``gear.state(2) == slip``.

    Parameters
    ----------
    first : int
        How many elements come before its first one, counted over all owners.
    n : int
        Number of its elements.
    states : tuple of str
        Names of their states.
    """

    first: int
    n: int
    states: tuple[str, ...]


def parse_value(text: str, names: Iterable[str]) -> Value:
    """Parse a text that stands for a number.

    Parameters
    ----------
    text : str
        For example ``"C * (sgn(v) - z / s)"``.
    names : iterable of str
        The names that may occur, also with a dot, such as ``gear.F``.

    Returns
    -------
    Value
        The checked tree.

    Raises
    ------
    ExpressionError
        With the text, the column and what would be allowed there.

    Examples
    --------
    >>> from gms_fsm.language import parse_value
    >>> parse_value("2 * v", ["v"])
    Binary(op='*', left=Number(value=2.0), right=Name(id='v'))
    """
    return _read_value(_as_text(text), tuple(names))


@functools.lru_cache(maxsize=4096)
def _read_value(text: str, names: tuple[str, ...]) -> Value:
    """Parse a text; trees cannot be changed, so that all who give the same text share one."""
    return _Reader(text, names).value(_parsed(text), 0)


def parse_condition(
    text: str,
    names: Iterable[str],
    states: Iterable[str] = (),
    elements: int = 0,
    *,
    own_state: bool = False,
    owners: Mapping[str, Owner] | None = None,
) -> Condition:
    """Parse a text that is true or false, such as a guard.

    Parameters
    ----------
    text : str
        For example ``"abs(v) <= v_c and abs(z) < s"``.
    names : iterable of str
        The names that may occur.
    states : iterable of str, optional
        State names that ``state(i) == name`` may use (in breakpoints, not in guards).
    elements : int, optional
        Number of elements; i counts from 1.
    own_state : bool
        Whether ``state == name`` may refer to the current element (as in invariants).
    owners : mapping of str to Owner, optional
        Names whose elements ``gear.state(i) == name`` may use, and ``gear.state == name`` if there
        is one. In the tree elements are counted over all owners.

    Returns
    -------
    Condition
        The checked tree; a chain ``a < b < c`` is already split.

    Raises
    ------
    ExpressionError
        With the text, the column and what would be allowed there.

    Examples
    --------
    >>> from gms_fsm.language import parse_condition, spell
    >>> spell(parse_condition("0 < v < 1", ["v"]))
    '0.0 < v and v < 1.0'
    """
    reader = _Reader(text, names, states, elements, own_state, owners or {})
    return reader.condition(_parsed(text), 0)


def _as_text(text: object) -> str:
    if not isinstance(text, str):
        raise ExpressionError(
            f"expected a text, got {type(text).__name__}", repr(text), 1, "a text in quotes"
        )
    return text


def _parsed(text: str) -> ast.expr:
    _as_text(text)
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
        state = mark == "=" and _STATE.search(text[: foreign.start()])
        raise ExpressionError(
            f"{mark} is not part of the language",
            text,
            foreign.start() + 1,
            f"{'==' if state else _INSTEAD[mark]} instead",
        )
    if timed := _AFTER.search(text):
        seconds = in_si(f"{timed[1]} {timed[2]}")
        raise ExpressionError(
            "after takes one time, in seconds", text, timed.start(2) + 1, f"after({seconds})"
        )
    flat = "".join(" " if c.isspace() else c for c in text)  # same length: columns stay correct
    # Python has a word if, but no function: these letters are the same name to it, and no word.
    flat = _IF.sub(r"\1𝑖𝑓", flat)
    lead = len(flat) - len(flat.lstrip())
    if lead == len(flat):
        raise ExpressionError("the text is empty", text, 1, _GRAMMAR)
    try:
        with PARSER, warnings.catch_warnings():
            warnings.simplefilter("error")  # Python only warns about "1and v"; here it is an error
            body = ast.parse(flat[lead:], mode="eval").body
    except SyntaxError as error:
        if word := _WORDS.search(text):
            raise ExpressionError(
                f"{word[0]} is not part of the language",
                text,
                word.start() + 1,
                f"{word[0].lower()} instead",
            ) from None
        # Python reports offset 0 when it reached the end and expected more.
        column = min(error.offset + lead, len(text) + 1) if error.offset else len(text) + 1
        reason = "the text ends too early" if column > len(text) else "cannot be read from here"
        factors = _NO_SIGN_BETWEEN.search(text, max(0, column - 3), column + 1)
        allowed = "a sign between factors, as in 2*pi*t, and no unit" if factors else _GRAMMAR
        if text.count("(") != text.count(")"):
            allowed = "as many ( as )"
        if (comma := _DECIMAL_COMMA.search(text)) and comma.start(2) < column <= comma.end():
            allowed = f"a decimal point: {comma[1]}.{comma[2]}"
        raise ExpressionError(reason, text, column, allowed) from None
    except (ValueError, RecursionError, MemoryError):
        raise ExpressionError("cannot be read (nested too deeply)", text, 1, _GRAMMAR) from None
    raw = flat[lead:].encode()
    for node in ast.walk(body):
        if isinstance(node, ast.expr):  # ast counts bytes, the reader counts characters
            node.col_offset = lead + len(raw[: node.col_offset].decode(errors="ignore"))
    return body


def _suggestion(name: str, known: Iterable[str]) -> str:
    """Return a question that suggests the known name closest to a wrong one."""
    near = nearest(ALIASES.get(name, name), known, 0.75)
    return f" (did you mean {near!r}?)" if near else ""


class _Reader:
    """Turns `ast` nodes into tree nodes, refusing everything not on the allow-list."""

    def __init__(
        self,
        text: str,
        names: Iterable[str],
        states: Iterable[str] = (),
        elements: int = 0,
        own_state: bool = False,
        owners: Mapping[str, Owner] | None = None,
    ) -> None:
        self.text = text
        self.names = tuple(dict.fromkeys(names))
        self.own = Owner(0, elements, tuple(states))
        self.own_state, self.owners = own_state, owners or {}
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
                return self.name(node, name)
            case ast.Attribute(value=ast.Name(id=owner), attr=attribute) if self.dotted:
                return self.name(node, f"{owner}.{attribute}")
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return Negative(self.value(operand, depth))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.value(operand, depth)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                return Binary(
                    _OPERATORS[type(op)], self.value(left, depth), self.value(right, depth)
                )
            case ast.Call(ast.Name("is_in" | "count" as f), [ast.Attribute() as of]) if self.dotted:
                return self.name(node, f"{f}({ast.unparse(of)})")
            case ast.Call(ast.Name("duration"), [test], []) if self.lasting:
                return Name(f"{LASTING}{spell(self.condition(test, depth))})")
            case ast.Call(func=ast.Name(id="after")) if "age" in self.names:
                raise self.refuse(_COMPARISON, node, "age, the time in the present state")
            case ast.Call(func=ast.Name(id=function), args=arguments, keywords=[]):
                self.known(node, function)
                return self.call(node, function, arguments, depth)
            case ast.IfExp(test=test, body=yes, orelse=no):
                return self.choice(node, [test, yes, no], depth)
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
                raise self.refuse(_COMPARISON, node)
        raise self.foreign(node)

    def foreign(self, node: ast.expr) -> ExpressionError:
        """Return the error of what is not on the allow-list."""
        instead = _GRAMMAR
        match node:
            case ast.Tuple() if comma := _DECIMAL_COMMA.search(self.text):
                return ExpressionError(
                    "a comma is not part of the language",
                    self.text,
                    comma.end(1) + 1,
                    f"a decimal point: {comma[1]}.{comma[2]}",
                )
            case ast.Call(func=ast.Attribute(attr=function)) if function in FUNCTIONS:
                instead = f"{function}(...), without a module before it"
        return self.refuse(f"{_plain(node)} is not part of the language", node, instead)

    def name(self, node: ast.expr, name: str) -> Value:
        if name in self.names:
            return Name(name)
        if name in CONSTANTS:
            return Number(CONSTANTS[name])
        if name in _CALLED:
            raise self.refuse(f"the function {name!r} needs (...)", node, f"{name}(...)")
        raise self.refuse(
            f"unknown name {shown(name)}{_suggestion(name, [*self.names, *CONSTANTS])}",
            node,
            f"the names {some_of(self.listed)}, and pi",
        )

    @property
    def listed(self) -> list[str]:
        """The names that messages list: those of others after one's own, without states."""
        return sorted(
            (name for name in self.names if "(" not in name), key=lambda name: "." in name
        )

    @functools.cached_property
    def dotted(self) -> bool:
        """Whether names with a dot may occur."""
        return any("." in name for name in self.names)

    @functools.cached_property
    def lasting(self) -> bool:
        """Whether ``duration(v > 0)`` stands here; a declared name hides it."""
        return "age" in self.names and "duration" not in self.names

    def known(self, node: ast.expr, function: str) -> None:
        if function in self.names and function in (*YIELDING, *ELSEWHERE):
            raise self.refuse(f"{function!r} is a declared name here", node, "another name for it")
        if function in ELSEWHERE:
            if here := [name for name in self.names if name.startswith(f"{function}(")]:
                raise self.refuse(f"{function} takes a state of a machine", node, some_of(here))
            if function == "duration" and self.lasting:
                if isinstance(node, ast.Call) and len(node.args) == 1:
                    raise self.refuse("a comparison is missing", node, f"{ast.unparse(node)} >= 1")
                raise self.refuse("duration takes one condition", node, "duration(v > 0) >= 1")
            raise self.refuse(f"{function} does not stand here", node, ELSEWHERE[function])
        if function not in NAMESPACE and function not in SHORT:
            raise self.refuse(
                f"unknown function {shown(function)}{_suggestion(function, _CALLED)}",
                node,
                "the functions " + ", ".join(_CALLED),
            )

    def call(self, node: ast.expr, function: str, arguments: list[ast.expr], depth: int) -> Value:
        if function == "pow":
            if len(arguments) != 2:
                raise self.refuse(f"pow got {len(arguments)} arguments", node, "two arguments")
            return Binary("**", self.value(arguments[0], depth), self.value(arguments[1], depth))
        if function in SHORT:
            if len(arguments) != SHORT[function]:
                wanted = "three arguments" if SHORT[function] == 3 else "two arguments"
                raise self.refuse(f"{function} got {len(arguments)} arguments", node, wanted)
            if function == "if":
                return self.choice(node, arguments, depth)
            parts = [self.value(each, depth + 2) for each in arguments]
            return self.within(node, written_out(function, *parts))
        several = function in SEVERAL
        if (len(arguments) < 2) if several else (len(arguments) != 1):
            wanted = "two or more arguments" if several else "one argument"
            raise self.refuse(f"{function} got {len(arguments)} arguments", node, wanted)
        if len(arguments) > MOST_ARGUMENTS:
            raise self.refuse(
                f"{function} got {len(arguments)} arguments", node, f"at most {MOST_ARGUMENTS}"
            )
        # min(a, b, c) is min(min(a, b), c), one corner at a time: the first arguments are deepest.
        folds = max(0, len(arguments) - 2)
        values = [
            self.value(argument, depth + min(folds, len(arguments) - 1 - i))
            for i, argument in enumerate(arguments)
        ]
        result = Call(function, tuple(values[:2]))
        for value in values[2:]:
            result = Call(function, (result, value))
        return result

    def choice(self, node: ast.expr, given: list[ast.expr], depth: int) -> Value:
        """Read a choice between two values, one comparison at a time."""
        test, *values = given
        levels = sum(isinstance(each, ast.cmpop) for each in ast.walk(test))
        yes, no = (self.value(each, depth + levels) for each in values)
        try:
            return self.within(node, chosen(self.condition(test, depth), yes, no))
        except TypeError as error:
            raise self.refuse(str(error), test) from None

    def within(self, node: ast.expr, value: Value) -> Value:
        """Refuse a value whose repeated parts make it too large."""
        if next(itertools.islice(walk(value), MOST_PARTS, None), None) is not None:
            raise self.refuse("the value is too large", node, f"at most {MOST_PARTS} parts")
        return value

    def condition(self, node: ast.expr, depth: int) -> Condition:
        depth = self.deeper(node, depth)
        match node:
            case ast.Compare(
                left=ast.Call(func=ast.Name(id="state")) as call, ops=[op], comparators=[name]
            ) if self.own.states:
                return self.in_state(self.own, self.numbered(call, self.own), op, name)
            case ast.Compare(left=ast.Name(id="state"), ops=[op], comparators=[name]) if (
                self.own_state
            ):
                return self.in_state(self.own, 0, op, name)
            case ast.Compare(
                left=ast.Call(func=ast.Attribute(value=ast.Name(id=of), attr="state")) as call,
                ops=[op],
                comparators=[name],
            ) if of in self.owners:
                element = self.numbered(call, self.owners[of], f"{of}.")
                return self.in_state(self.owners[of], element, op, name)
            case ast.Compare(
                left=ast.Attribute(value=ast.Name(id=of), attr="state") as left,
                ops=[op],
                comparators=[name],
            ) if of in self.owners:
                if self.owners[of].n > 1:
                    raise self.refuse(f"{of}.state needs a number", left, f"{of}.state(1)")
                return self.in_state(self.owners[of], self.owners[of].first + 1, op, name)
            case ast.Compare(
                left=(ast.Name(id="state") | ast.Call(func=ast.Name(id="state"))) as left
            ) if self.owners:
                some = next(iter(self.owners))
                raise self.refuse("state needs its owner", left, f"for example {some}.state(1)")
            case ast.Compare(left=left, ops=ops, comparators=comparators):
                sides = [left, *comparators]
                self.comparisons += len(ops)
                if self.comparisons > MOST_COMPARISONS:
                    raise self.refuse(
                        "too many comparisons", node, f"at most {MOST_COMPARISONS} in one text"
                    )
                parts: list[Condition] = []
                for i, op in enumerate(ops):
                    a, b = self.value(sides[i], depth), self.value(sides[i + 1], depth)
                    if type(op) in _COMPARISONS:
                        parts.append(Relation(_COMPARISONS[type(op)], a, b))
                    elif isinstance(op, ast.Eq | ast.NotEq) and is_whole(a) and is_whole(b):
                        equal = Both((Relation("<=", a, b), Relation(">=", a, b)))
                        parts.append(equal if isinstance(op, ast.Eq) else Not(equal))
                    else:
                        raise self.refuse(
                            "only < <= > >= compare floats (== and != are almost never true)",
                            sides[i + 1],
                            "< <= > >=, for example a <= x <= b; whole numbers, round(x) == 2",
                        )
                return parts[0] if len(parts) == 1 else Both(tuple(parts))
            case ast.BoolOp(op=op, values=values):
                operands = tuple(self.condition(value, depth) for value in values)
                return Both(operands) if isinstance(op, ast.And) else Either(operands)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return Not(self.condition(operand, depth))
            case ast.Constant(value=True):
                return Both(())
            case ast.Call(
                func=ast.Name(id="after" | "every" as word), args=[time], keywords=[]
            ) if "age" in self.names and word not in self.names:
                return Relation(">=", Name("age"), self.value(time, depth))
            case ast.Call(func=ast.Name(id="is_in"), args=[ast.Attribute() as of]):
                return Relation(">", self.name(node, f"is_in({ast.unparse(of)})"), Number(0.5))
            case ast.Call(func=ast.Name(id="after"), args=given) if "age" in self.names:
                wanted = "one time in seconds, for example after(0.2)"
                raise self.refuse(f"after got {len(given)} arguments", node, wanted)
            case ast.Name(id="state") | ast.Call(func=ast.Name(id="state")) if self.own.states:
                raise self.refuse("a state is compared with a name", node, self.compared())
            case ast.Constant() | ast.Name() | ast.BinOp() | ast.UnaryOp() | ast.Call():
                match node:
                    case ast.Call(func=ast.Name(id=function)):  # after(0.2), for example
                        self.known(node, function)
                raise self.refuse(
                    "found a number where a comparison is needed", node, "for example v > v_c"
                )
        raise self.foreign(node)

    def numbered(self, call: ast.Call, whose: Owner, lead: str = "") -> int:
        match call.args:
            case [ast.Constant(value=element)] if type(element) is int:  # True is not 1 here
                if 1 <= element <= whose.n:
                    return whose.first + element
        raise self.refuse(
            f"{lead}state(...) takes an element number",
            call,
            f"{lead}state(1) to {lead}state({whose.n})",
        )

    def compared(self) -> str:
        """Return how a state is compared, for example."""
        return f"state(1) == {self.own.states[-1]}"

    def in_state(self, whose: Owner, element: int, op: ast.cmpop, name: ast.expr) -> Condition:
        lead = f"{ast.unparse(name)}."  # of a composite state several are inside
        inside = [InState(element, each) for each in whose.states if f"{each}.".startswith(lead)]
        if not inside:
            raise self.refuse("unknown state", name, "the states " + ", ".join(whose.states))
        if not isinstance(op, ast.Eq | ast.NotEq):
            raise self.refuse("states are compared by == or !=", name, self.compared())
        found = inside[0] if len(inside) == 1 else Either(tuple(inside))
        return found if isinstance(op, ast.Eq) else Not(found)


def _plain(node: ast.expr) -> str:
    match node:
        case ast.Constant(value=value) if value is not ...:
            return f"the constant {shown(value)}"
        case ast.BinOp(op=op) | ast.UnaryOp(op=op):
            signs = {
                "Mod": "%", "FloorDiv": "//", "MatMult": "@", "BitAnd": "&", "BitOr": "|",
                "BitXor": "^", "LShift": "<<", "RShift": ">>", "Invert": "~",
            }  # fmt: skip
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
