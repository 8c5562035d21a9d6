"""What callers of a session may ask for: counts, elements, edges, branches that exist."""

from __future__ import annotations

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import SessionError, shown
from gms_fsm.systems.models import Model

__all__ = ["check_branch", "check_count", "check_element", "source_of"]


def check_count(count: int) -> None:
    """Raise a `SessionError` for a count below 0."""
    if count < 0:
        raise SessionError(f"count is {count}; it must be at least 0")


def check_branch(number: int, branches: int) -> None:
    """Raise a `SessionError` unless there is a branch of this number."""
    if not 0 <= number < branches:
        raise SessionError(f"no branch {number}; there are 0 to {branches - 1}")


def check_element(element: int, model: Model) -> None:
    """Raise a `SessionError` unless a model has this element."""
    whole = isinstance(element, int | np.integer) and not isinstance(element, bool)
    if not whole or not 0 <= element < model.n:
        said = shown(element)
        if said in [repr(edge.name) for edge in model.chart.transitions]:
            said += f" (an edge is asked for by edge={said})"
        raise SessionError(
            f"no element {said}; there are 0 to {model.n - 1} (counted from 0 in Python, from 1 in "
            "text)"
        )


def source_of(edge: str, chart: Chart) -> str:
    """Return the state that an edge leaves; raise a `SessionError` if there is no such edge."""
    sources = {each.name: each.source for each in chart.transitions}
    if edge not in sources:
        raise SessionError(f"no edge {edge!r}; there are {', '.join(sources) or 'none'}")
    return sources[edge]
