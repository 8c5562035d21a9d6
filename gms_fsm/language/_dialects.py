"""The notations of trees: a row for each, read by the one printer (`gms_fsm.language.spell`)."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from gms_fsm.language.functions import CHOICES, COMPARISONS, NAMESPACE, OPERATIONS

# How tightly each operator binds (its precedence).
LEVELS = {"or": 1, "and": 2, "not": 3, "<": 4, "+": 5, "-": 5, "*": 6, "/": 6, "neg": 7, "**": 8}
ATOM = 9


class Printed(NamedTuple):
    """A text and its precedence."""

    text: str
    level: int
    brackets: str

    def at(self, level: int) -> str:
        """Return the text, in parentheses if its precedence is below `level`."""
        return self.text if self.level >= level else self.brackets.format(self.text)


@dataclass(frozen=True)
class Form:
    """How an operator is written.

    Parameters
    ----------
    write : str or callable
        The text with ``{0}`` and ``{1}`` for the operands, for and and or what stands between
        them; or a function of the operands, as `Printed`, that returns the text.
    level : int
        How tightly it binds.
    inner : tuple of int
        How tightly operands must bind; others are put in parentheses.
    """

    write: str | Callable[..., str]
    level: int = ATOM
    inner: tuple[int, ...] = (0, 0)

    def __call__(self, *parts: Printed) -> str:
        """Return the text."""
        if callable(self.write):
            return self.write(*parts)
        texts = map(Printed.at, parts, self.inner)
        return self.write.format(*texts)


@dataclass(frozen=True)
class Dialect:
    """A notation for trees: how each operator, function, number and name is written.

    Parameters
    ----------
    operators : mapping of str to Form
        By the keys of `LEVELS`. Without ``**`` small integer powers are written as products, as the
        engines compute them, and other powers by the function ``pow``.
    functions : mapping of str to str
        The texts of calls, with ``{0}`` and ``{1}`` for the arguments or ``{all}`` for all of them.
        Calls of a function that is missing cannot be written. With ``after``, ``age >= T`` is
        written as that call.
    number : callable
        Writes a number.
    name : callable
        Writes a name that is not replaced.
    true : str
        The condition that always holds.
    brackets : str
        Parentheses.
    """

    operators: Mapping[str, Form] = field(hash=False)
    functions: Mapping[str, str] = field(hash=False)
    number: Callable[[float], str] = repr  # always with a point or an exponent: 1/2 is one half
    name: Callable[[str], str] = str
    true: str = "true"
    brackets: str = "({0})"


# --------------------------------------------------------------------------- numbers and names
def _short(value: float) -> str:
    """Return a number as people write it, with all its digits."""
    if value == math.pi:
        return "pi"
    return f"{value:g}" if float(f"{value:g}") == value else repr(value)


def _with_point(value: float) -> str:
    """Return a number with all its digits and a decimal point, which every language reads: 1.0e-06.

    >>> _with_point(1e-06), _with_point(0.5)
    ('1.0e-06', '0.5')
    """
    digits, _, exponent = repr(value).partition("e")
    if "." not in digits:
        digits += ".0"
    return f"{digits}e{exponent}" if exponent else digits


def raised(digits: str) -> str:
    """Return a whole number as an exponent.

    Examples
    --------
    >>> raised("-12")
    '⁻¹²'
    """
    return digits.translate(str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"))


def _typeset(value: float) -> str:
    """Return a number as in formulas of Unicode: 2·10⁻⁶."""
    if value == math.pi:
        return "π"
    text = _short(value)
    digits, _, exponent = text.removeprefix("-").partition("e")
    if exponent:
        power = f"10{raised(str(int(exponent)))}"
        digits = power if digits == "1" else f"{digits}·{power}"
    return f"−{digits}" if text.startswith("-") else digits


def _latex_number(value: float) -> str:
    if value == math.pi:
        return r"\pi"
    digits, _, exponent = f"{value:.12g}".partition("e")
    if not exponent:
        return digits
    power = rf"10^{{{int(exponent)}}}"
    return power if digits == "1" else rf"{digits} \cdot {power}"


_GREEK = frozenset(
    unicodedata.name(each).rpartition(" ")[2].lower().replace("lamda", "lambda")
    for each in "αβγδεζηθκλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ"
)


def latex_name(name: str) -> str:
    r"""Return a name as in formulas of LaTeX.

    Parameters
    ----------
    name : str
        A name of the language.

    Returns
    -------
    str
        Without dollar signs.

    Examples
    --------
    >>> print(latex_name("sigma_0"), latex_name("v_s"), latex_name("load"), latex_name("x2"))
    \sigma_{0} v_{s} \mathrm{load} x_{2}
    """
    head, _, index = name.partition("_")
    if head.lower() in _GREEK and len(head) > 1:
        head = "\\" + head
    elif head[1:].isdigit():
        head, index = head[:1], head[1:] + (f",{index}" if index else "")
    elif len(head) > 1:
        head = rf"\mathrm{{{head}}}"
    if not index:
        return head
    index = index.replace("_", ",")
    if len(index) > 1:
        index = rf"\mathrm{{{index}}}"
    return rf"{head}_{{{index}}}"


# --------------------------------------------------------------------------- operators
def _infix(op: str, level: int, written: str = "") -> Form:
    # The right operand of + and * gets parentheses too: floating-point arithmetic is not
    # associative, and the text must show the order of evaluation.
    return Form(f"{{0}} {written or op} {{1}}", level, (level, level + 1))


def _between(op: str, written: str = "") -> Form:
    return Form(f"{{0}} {written or op} {{1}}", LEVELS["<"], (LEVELS["+"], LEVELS["+"]))


def _logic(both: str, either: str, negation: Form) -> dict[str, Form]:
    """Return the operators of conditions."""
    return {
        "or": Form(either, LEVELS["or"], (LEVELS["and"],)),
        "and": Form(both, LEVELS["and"], (LEVELS["not"],)),
        "not": negation,
    }


_SIGN = Form("-{0}", LEVELS["neg"], (LEVELS["**"],))
_ARITHMETIC = {
    **{op: _infix(op, LEVELS[op]) for op in OPERATIONS},
    **{op: _between(op) for op in COMPARISONS},
    "neg": _SIGN,
}


def _compiled(both: str, either: str, negation: str) -> dict[str, Form]:
    """Return operators as compilers want them.

    A sign binds like a sum: many languages refuse two operators in a row. Mixed `and` and `or` are
    always in parentheses, and so is what is negated.
    """
    level = LEVELS["or"]
    return {
        **_ARITHMETIC,
        "neg": Form("-{0}", LEVELS["-"], (LEVELS["**"],)),
        "or": Form(either, level, (level + 1,)),
        "and": Form(both, level, (level + 1,)),
        "not": Form(f"{negation}({{0}})"),
    }


def _written_raised(base: Printed, exponent: Printed) -> str:
    whole = exponent.text.isdecimal()
    return base.at(ATOM) + (raised(exponent.text) if whole else f"^{exponent.at(ATOM)}")


def _product(left: Printed, right: Printed) -> str:
    sign = r"\cdot" if right.text[:1].isdigit() else r"\,"
    return f"{left.at(LEVELS['*'])} {sign} {right.at(LEVELS['*'])}"


def _calls(names: str, pattern: str = "{0}") -> dict[str, str]:
    """Return calls of functions that have the same names as here, but for capitals."""
    return {name.lower(): pattern.format(name) + "({all})" for name in names.split()}


def _choices(pattern: str, operators: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return choices between two values; ``{op}`` compares ``{0}`` and ``{1}``."""
    return {
        name: pattern.replace("{op}", (operators or {}).get(op, op)) for name, op in CHOICES.items()
    }


# --------------------------------------------------------------------------- the table
_ALL = " ".join(NAMESPACE)
_MATH = " ".join(name for name in NAMESPACE if name not in ("noise", "tooth"))

# Generated code. A small integer power is a product, so that all engines round identically.
PYTHON = Dialect(
    _ARITHMETIC | _logic(" and ", " or ", Form("not {0}", LEVELS["not"], (LEVELS["not"],))),
    _calls(_ALL) | _choices("({2} if {0} {op} {1} else {3})"),
    true="True",
)
# Stateflow text, for charts.
MATLAB_LIKE = Dialect(
    _ARITHMETIC
    | _logic(" && ", " || ", Form("!{0}", LEVELS["not"], (ATOM,)))
    | {"**": Form("{0}^{1}", LEVELS["**"], (ATOM, ATOM)), "==": _between("==")},
    _calls(f"{_ALL} mod quantise")
    | {"abs": "|{0}|", "after": "after({0})", "if": "if({0}, {1}, {2})"},
    _short,
)
# Formulas of Unicode, for charts.
MATHEMATICS = Dialect(
    _ARITHMETIC
    | _logic(" ∧ ", " ∨ ", Form("¬{0}", LEVELS["not"], (ATOM,)))
    | {
        "neg": Form("−{0}", LEVELS["neg"], (LEVELS["**"],)),
        "-": _infix("−", LEVELS["-"]),
        "*": _infix("·", LEVELS["*"]),
        "<=": _between("≤"),
        ">=": _between("≥"),
        "==": _between("="),
        "**": Form(_written_raised, LEVELS["**"]),
    },
    {
        **MATLAB_LIKE.functions,
        "sqrt": "√({0})",
        "floor": "⌊{0}⌋",
    },
    _typeset,
    true="⊤",
)
# The data model of SCXML. Negation is written as a comparison, and a choice as one of a list, of
# which a truth is the number: Python's readers of SCXML know these as well; they do not know "!"
# and "?".
ECMASCRIPT = Dialect(
    _ARITHMETIC | _logic(" && ", " || ", Form("{0} == false", LEVELS["<"], (ATOM,))),
    _calls(_MATH, "Math.{0}")
    | _choices("[{3}, {2}][+({0} {op} {1})]")
    | {
        "sgn": "Math.sign({0})",
        "round": "(Math.floor({0}) + (({0}) - Math.floor({0}) > 0.5) + (({0}) - Math.floor({0})"
        " == 0.5) * (Math.floor({0}) - 2.0 * Math.floor(0.5 * Math.floor({0}))))",
    },
)
# The elementary functions of C are our own, with the same bits everywhere: exports name them.
C99 = Dialect(
    _compiled(" && ", " || ", "!"),
    {"abs": "fabs({0})", "sqrt": "sqrt({0})"} | _choices("({0} {op} {1} ? {2} : {3})"),
    _with_point,
    true="1",
)
# MATLAB rounds halves away from zero, and has no expression that chooses: exports define these.
MATLAB = Dialect(
    _compiled(" && ", " || ", "~"),
    _calls("abs exp log sqrt min max sin cos tanh atan asinh")
    | {
        "sgn": "sign({0})",
        "pow": "power({0}, {1})",
    },
    _with_point,
)
# Corners and jumps are written as if-expressions: they make events, sign() and abs() do not. The
# language has no asinh of its own.
MODELICA = Dialect(
    _compiled(" and ", " or ", "not "),
    _calls("exp log sqrt sin cos tanh atan floor")
    | _choices("(if {0} {op} {1} then {2} else {3})")
    | {
        "round": "(if ({0}) - floor({0}) < 0.5 then floor({0}) elseif ({0}) - floor({0}) > 0.5"
        " then floor({0}) + 1.0 else 2.0 * floor(0.5 * floor({0}) + 0.5))",
        "abs": "(if {0} >= 0.0 then {0} else -({0}))",
        "sgn": "(if {0} > 0.0 then 1.0 elseif {0} < 0.0 then -1.0 else 0.0)",
        "min": "(if {1} < {0} then {1} else {0})",
        "max": "(if {1} > {0} then {1} else {0})",
        "pow": "(({0})^({1}))",
    },
    _with_point,
)
# IEC 61131-3. The standard has no tanh and no asinh; exports define sgn, floor and round.
STRUCTURED_TEXT = Dialect(
    _compiled(" AND ", " OR ", "NOT "),
    {
        name: f"{name.upper()}({{all}})"
        for name in ["abs", "exp", "sqrt", "min", "max", "sin", "cos", "atan"]
    }
    | _choices("SEL({0} {op} {1}, {3}, {2})")
    | {"log": "LN({0})", "pow": "EXPT({0}, {1})"},
    _with_point,
    true="TRUE",
)
# Values only. Sums and products of real numbers need no parentheses on the right.
LATEX = Dialect(
    {
        "+": Form("{0} + {1}", LEVELS["+"], (LEVELS["+"], LEVELS["+"])),
        "-": _infix("-", LEVELS["-"]),
        "*": Form(_product, LEVELS["*"]),
        "/": Form(r"\frac{{{0}}}{{{1}}}", LEVELS["*"]),
        "neg": Form("-{0}", LEVELS["neg"], (LEVELS["neg"],)),
        "**": Form("{0}^{{{1}}}", LEVELS["**"], (ATOM, 0)),
    },
    {
        **{name: rf"\{name}\left({{0}}\right)" for name in ["exp", "sin", "cos", "tanh"]},
        **{name: rf"\{name}\left({{0}},\,{{1}}\right)" for name in ("min", "max")},
        **{
            name: rf"\mathrm{{{{{written}}}}}\left({{0}}\right)"
            for name, written in (
                ("log", "ln"),
                ("sgn", "sgn"),
                ("atan", "arctan"),
                ("asinh", "arsinh"),
            )
        },
        "abs": r"\left|{0}\right|",
        "sqrt": r"\sqrt{{{0}}}",
        "floor": r"\left\lfloor {0} \right\rfloor",
        "round": r"\mathrm{{round}}\left({0}\right)",
        **_choices(
            r"\left({2}\ \mathrm{{if}}\ {0} {op} {1},\ \mathrm{{else}}\ {3}\right)",
            {"<=": r"\le", ">=": r"\ge"},
        ),
    },
    _latex_number,
    latex_name,
    brackets=r"\left({0}\right)",
)
