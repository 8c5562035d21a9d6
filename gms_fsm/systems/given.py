"""Checks of what a system is given."""

from __future__ import annotations

import keyword
import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import TINY, FloatArray, check_names, checked_values
from gms_fsm.errors import ParameterError, Part, shown
from gms_fsm.language import (
    CONSTANTS,
    FUNCTIONS,
    YIELDING,
    Binary,
    Name,
    Negative,
    Number,
    Value,
    derivative,
    evaluate,
    names_in,
    renamed,
)

if TYPE_CHECKING:
    from gms_fsm.systems.parts import Body

ZERO = Number(0.0)
WORDS = {*FUNCTIONS, *CONSTANTS, "pow"} - {*YIELDING}  # of the language
Text: TypeAlias = str | float  # an expression, or just a number


def check_text(text: object, place: str) -> None:
    """Refuse what is neither an expression nor a number."""
    if not isinstance(text, (str, int, float)) or isinstance(text, bool):
        raise ParameterError(
            "it must be an expression or a number", place=place, value=text, advice="such as '2*t'"
        )


def mapping_of(given: object, place: str) -> dict[str, Any]:
    """Return a copy of a mapping with texts as keys."""
    if not isinstance(given, (dict, Mapping)):  # that it is no dict takes longer to find out
        raise ParameterError(
            "it must be a mapping, such as {'name': ...}", place=place, value=given
        )
    return dict(given)


def texts_of(given: object, place: str) -> dict[str, str]:
    """Return a copy of a mapping of names to texts, with numbers as texts."""
    texts = mapping_of(given, place)
    for name, text in texts.items():
        if not isinstance(text, str):
            check_text(text, f"{place}[{name!r}]")
            texts[name] = repr(float(text))
    return texts


def several(given: object, kind: type, place: str) -> tuple[Any, ...]:
    """Return parts of a kind as a tuple; a single one may stand alone."""
    if isinstance(given, kind):
        return (given,)
    if not isinstance(given, (tuple, Iterable)) or isinstance(given, str):
        raise ParameterError(f"it must be a {kind.__name__}, or several", place=place, value=given)
    parts = tuple(given)
    for part in parts:
        if not isinstance(part, kind):
            raise ParameterError(f"it must be a {kind.__name__}", place=place, value=part)
    return parts


def check_name(name: object, place: str, key: tuple[str | int, ...] = ()) -> None:
    """Refuse what cannot be the name of a part or a quantity of a system."""
    if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
        raise ParameterError(
            f"{shown(name)} is not a name",
            place=place,
            advice="use letters, digits and _, not starting with a digit, and no Python keyword",
            key=key,
        )
    if name in WORDS:
        raise ParameterError(f"the name {name!r} is a word of the language", place=place, key=key)


def checked_numbers(
    chart: Chart, values: Mapping[str, Any], n: int, here: str
) -> Mapping[str, float | FloatArray]:
    """Return the numbers of a chart, checked against its parameters."""
    if isinstance(n, bool) or not isinstance(n, int) or n < 1:
        raise ParameterError(
            "a bank has an integer number of elements, at least one", place=f"{here}: n", value=n
        )
    if not isinstance(values, Mapping):
        raise ParameterError(
            "it must give a number for each parameter of the chart, for example {'k': 1.0}",
            place=f"{here}: values",
            value=values,
        )
    check_names(chart.parameters, values, here)
    return checked_values(chart.parameters, values, n)


def is_positive(tree: Value, numbers: Mapping[str, float]) -> bool:
    """Tell whether an inertia is positive and finite, as far as numbers alone decide."""
    return not names_in(tree) <= numbers.keys() or TINY < constant(tree, numbers) < math.inf


def constant(tree: Value, numbers: Mapping[str, float]) -> float:
    """Return a value over numbers; NaN if it has none."""
    try:
        return float(evaluate(tree, numbers))
    except (ArithmeticError, ValueError):
        return math.nan


def derivative_free(rest: Value) -> bool:
    """Tell whether a linear form without its velocities is zero."""
    match rest:
        case Number(value):
            return value == 0.0
        case Name():
            return False
        case Negative(operand):
            return derivative_free(operand)
        case Binary("+" | "-", a, b):
            return derivative_free(a) and derivative_free(b)
        case Binary("*", a, b):
            return derivative_free(a) or derivative_free(b)
        case Binary("/", a, _):
            return derivative_free(a)
    return False


def coefficients(
    tree: Value, moved: Mapping[str, Body], text: str, owner: Part
) -> Mapping[str, Value]:
    """Return the coefficients of a velocity that is linear in the bodies' velocities."""
    row: dict[str, Value] = {}
    rest = renamed(tree, dict.fromkeys(moved, ZERO))
    constant = derivative_free(rest)
    for v, body in moved.items():
        slope = derivative(tree, v)
        if slope is None or names_in(slope) & {*moved}:
            constant = False
        elif slope != ZERO:
            row[body.name] = slope
    if not constant or not row:
        raise ParameterError(
            f"v = {text!r} is not linear in the velocities {', '.join(moved)}",
            place=owner.words,
            advice="write it for example as 'v_1 - ratio * v_2'; what moves as prescribed is a "
            'driven body: velocity = "0.1" instead of its inertia',
            key=(*owner.key, "v"),
        )
    return row


def rank_of(banks: Iterable[Any], free: list[str], numbers: Mapping[str, float]) -> int:
    """Return how many velocities of contacts are independent of each other."""
    rows = [
        [float(evaluate(row.get(body, Number(0.0)), numbers)) for body in free]
        for bank in banks
        for row in bank.jacobian
    ]
    return int(np.linalg.matrix_rank(np.array(rows)))
