"""Conditions and watches of a session: parsed for a run, evaluated at a row or point."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from gms_fsm.errors import ExpressionError, SessionError
from gms_fsm.language import Condition, InState, Value, evaluate, parse_condition, parse_value
from gms_fsm.run.problem import Problem
from gms_fsm.session.explain import holds
from gms_fsm.session.tree.branch import Branch, BranchRow
from gms_fsm.traces.system_scope import in_si, names_of, owners_of

_STATE = re.compile(r"\s*(?:(\w+)\.)?state(?:\s*\(\s*\d{1,9}\s*\))?\s*")


def read(start: Problem, text: str) -> Condition:
    """Parse a condition such as ``"z1 > 0.3 and state(2) == slip"``."""
    states, n, owners = [], 0, {}
    if len(start.system.machines) == 1:
        states, n = [state.name for state in start.model.chart.states], start.model.n
    if start.what.named:
        owners = owners_of(start.system)
    with _explained(start):
        text = in_si(start.what, text)
        return parse_condition(
            text, names_of(start.what), states, n, own_state=n == 1, owners=owners
        )


def holds_at(condition: Condition, branch: Branch, row: BranchRow) -> bool:
    """Return whether a condition holds at a row of a branch, or at a point between two rows."""
    return holds(condition, branch.watches(row))


def seen_by(start: Problem, text: str) -> Callable[[Branch, BranchRow], object]:
    """Return what an expression is at a row: a number, a truth, or the state in ``state(2)``.

    What cannot be computed is None.
    """
    if (state := _STATE.fullmatch(text)) and text.strip() not in names_of(start.what):
        contact = start.system.contact(state[1]) if state[1] in _contacts(start) else None
        chart = (contact or start.system.machines[0]).chart
        tree = read(start, f"{text} == {chart.states[0].name}")
        assert isinstance(tree, InState)
        return lambda branch, row: branch.watches(row)[f"state({tree.element})"]
    if re.search(r"[<>]|==|!=|\b(and|or|not)\b", text):
        condition = read(start, text)
        return lambda branch, row: holds_at(condition, branch, row)
    value = _value(start, text)

    def computed(branch: Branch, row: BranchRow) -> float | None:
        try:
            found = float(evaluate(value, branch.watches(row)))
        except (ArithmeticError, ValueError):
            return None
        return None if math.isnan(found) else found

    return computed


def _contacts(start: Problem) -> list[str]:
    """Return the names of contacts that a text can have in front."""
    return [each.name for each in start.system.machines] if start.what.named else []


def value_of(start: Problem, text: str, values: Mapping[str, Any]) -> float:
    """Return the value of a watch expression, given the values of its names."""
    tree = _value(start, text)
    try:
        return float(evaluate(tree, values))
    except (ArithmeticError, ValueError) as error:
        raise SessionError(f"{text!r} cannot be computed here: {error}") from None


def _value(start: Problem, text: str) -> Value:
    """Parse a text that stands for a number."""
    with _explained(start):
        return parse_value(in_si(start.what, text), names_of(start.what))


@contextmanager
def _explained(start: Problem) -> Iterator[None]:
    """Say how to write a name that lacks the number of an element or its contact, or is none."""
    try:
        yield
    except ExpressionError as error:
        for name, instead in _complete(start).items():
            if error.reason.startswith(f"unknown name {name!r}"):
                reason = f"unknown name {name!r}; {instead}"
                raise ExpressionError(reason, error.text, error.column, error.allowed) from None
        raise


def _complete(start: Problem) -> dict[str, str]:
    """Return how to complete names that are incomplete."""
    known, found = names_of(start.what), dict[str, str]()
    for contact in start.system.machines:
        lead = start.what.of(contact.name, "")
        for name in contact.chart.variables:
            for each in (name, f"{lead}{name}"):
                found.setdefault(each, f"for element 1 write {lead}{name}1")
        for name, value in contact.values.items():
            found.setdefault(name, f"it is a parameter, {np.asarray(value).tolist()}")
        for each in known:
            if lead and each.startswith(lead):
                found.setdefault(each.removeprefix(lead), f"write {each}")
    return {name: text for name, text in found.items() if name not in known}
