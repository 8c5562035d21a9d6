"""Conditions and watches of a session: parsed for a model, evaluated at a row or point."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from gms_fsm.errors import ExpressionError, SessionError
from gms_fsm.inspection._branch import Branch, Row
from gms_fsm.inspection.explain import holds
from gms_fsm.language import Condition, evaluate, parse_condition, parse_value
from gms_fsm.systems.models import Model
from gms_fsm.traces.scope import watch_names

__all__ = ["holds_at", "read", "value_of"]


def read(model: Model, text: str) -> Condition:
    """Parse a condition such as ``"z1 > 0.3 and state(2) == slip"``."""
    states = [state.name for state in model.chart.states]
    with _numbered(model):
        return parse_condition(text, watch_names(model), states, model.n, own_state=model.n == 1)


def holds_at(condition: Condition, branch: Branch, row: Row) -> bool:
    """Return whether a condition holds at a row of a branch, or at a point between two rows."""
    return holds(condition, branch.scope(row).watches())


def value_of(model: Model, text: str, values: Mapping[str, Any]) -> float:
    """Return the value of a watch expression, given the values of its names."""
    with _numbered(model):
        tree = parse_value(text, watch_names(model))
    try:
        return float(evaluate(tree, values))
    except (ArithmeticError, ValueError) as error:
        raise SessionError(f"{text!r} cannot be computed here: {error}") from None


@contextmanager
def _numbered(model: Model) -> Iterator[None]:
    """Explain that a variable without an element number needs one."""
    try:
        yield
    except ExpressionError as error:
        for name in model.chart.variables:
            if error.reason == f"unknown name {name!r}":
                reason = f"{error.reason}; for element 1 write {name}1"
                raise ExpressionError(reason, error.text, error.column, error.allowed) from None
        raise
