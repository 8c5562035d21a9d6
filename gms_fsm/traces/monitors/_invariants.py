"""The invariant monitor: whether a condition held at every row, and where it first failed."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ExpressionError, SignalError, UnitError
from gms_fsm.foundation.quantities import named_numbers
from gms_fsm.language import Condition, names_in, parse_condition, states_in, truths
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted
from gms_fsm.traces.between import first_true, interpolated
from gms_fsm.traces.monitors._kinds import Invariant, elements_text
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.scope import Scope, invariant_names
from gms_fsm.traces.system_scope import SystemScope, in_si, owners_of, system_names
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import InvariantVerdict


def read_invariant(monitor: Invariant, what: Mounted) -> Condition:
    """Parse an invariant of what runs, or of its contact."""
    what = what.only(monitor.contact) if monitor.contact else what
    names, owners = [], {}
    if what.named:
        names, owners = system_names(what.system), owners_of(what.system)
    model = None if what.several else what.model
    states: list[str] = []
    if model is not None:
        names += invariant_names(model)
        states = [state.name for state in model.chart.states]
    n = 0 if model is None else model.n
    try:
        return parse_condition(
            in_si(what, monitor.text, names=names),
            names,
            states,
            n,
            own_state=model is not None,
            owners=owners,
        )
    except ExpressionError as error:
        raise error.at("invariant") from None
    except UnitError as error:
        raise error.inside(f"invariant {monitor.text!r}") from None


@dataclass(frozen=True)
class _Held:
    """An invariant parsed for a model."""

    tree: Condition
    of_elements: bool
    single: bool  # whether the run is that of one contact
    whole: bool  # whether it is the whole run of a system

    def columns(self, trace: Trace) -> dict[str, NDArray[Any]]:
        """Return the columns it refers to."""
        asked = states_in(self.tree)
        names = [*sorted(names_in(self.tree)), *(f"state({i})" for i in sorted(asked))]
        if self.single:
            columns = Scope.over(trace).invariants(states=bool(asked))
            if not self.whole:
                return {name: columns[name] for name in names}
            shared = SystemScope.over(trace)
            # A name of the system means what it means in its texts.
            columns = {**shared.watches(), **columns}
            columns |= {name: shared.value(name) for name in shared.system.names}
        else:
            columns = SystemScope.over(trace).watches()
        return {name: columns[name] for name in names}

    def at(self, trace: Trace) -> NDArray[np.bool_]:
        """Return where it holds, shape (n, rows), or (1, rows) if it does not refer to elements."""
        width = trace.n if self.of_elements else 1
        return truths(self.tree, self.columns(trace), (width, len(trace)))


def _of_elements(tree: Condition, model: Model) -> bool:
    own = {"s", *model.chart.variables}
    own |= {name for name, value in model.values.items() if np.ndim(value) > 0}
    return bool(own & names_in(tree)) or 0 in states_in(tree)


def invariant_verdict(monitor: Invariant, trace: Trace) -> InvariantVerdict:
    what = trace.subject
    single = not what.several
    tree = read_invariant(replace(monitor, contact=""), what)
    by_element = single and _of_elements(tree, trace.model)
    invariant, rows = _Held(tree, by_element, single, what.named), len(trace)
    broken = np.flatnonzero(~invariant.at(trace).all(axis=0))
    if not broken.size:
        text = f"held at all {rows} rows"
        return InvariantVerdict(True, text, monitor.text, rows, 0, None, None, "", {}, None)
    place = _located(invariant, trace, int(broken[0]))
    i, n = int(np.argmin(invariant.at(place)[:, 0])), trace.n if single else 1
    values = {
        name: float(np.broadcast_to(column, (n, 1))[i, 0])
        for name, column in invariant.columns(place).items()
        if np.asarray(column).dtype.kind == "f"
    }
    t, t_last = float(place.t[0]), float(trace.t[broken[-1]])
    who, state = "", ""
    if invariant.of_elements:
        state = str(place.states[0, i])
        who = f", {elements_text([i])} in {state}"
    text = (
        f"first broken at t = {t:.9g} s{who}{f' ({named_numbers(values)})' if values else ''}, at "
        f"{broken.size} of {rows} rows, last at t = {t_last:.9g} s; look at it with "
        f"`goto {t:.9g}` in gms-fsm debug, or widen the bound if this is intended"
    )
    return InvariantVerdict(
        False,
        text,
        monitor.text,
        rows,
        int(broken.size),
        t,
        i if who else None,
        state,
        values,
        t_last,
    )


def _located(invariant: _Held, trace: Trace, row: int) -> Trace:
    """Return a one-row trace where an invariant first fails, between the previous row and this."""
    rows = trace.rows
    seen = {name: values[row : row + 1] for name, values in trace.seen.items()}

    def at(t: float, y: FloatArray, stored: Mapping[str, FloatArray]) -> Trace:
        one = Rows(np.array([t]), np.zeros(1, np.int64), y[np.newaxis], rows.mode[row : row + 1])
        return replace(trace, rows=one, stops=one, stored=stored)

    place = at(float(rows.t[row]), rows.y[row], seen)
    low, high = float(rows.t[max(0, row - 1)]), float(rows.t[row])
    ends = low, rows.y[row - 1], high, rows.y[row]

    def breaks(t: float) -> bool:
        nonlocal place
        y = interpolated(trace.program, rows.mode[row].tolist(), *ends, t)
        there = at(t, y, {})
        if invariant.at(there).all():
            return False
        place = there
        return True

    # A trace read from a file has lost a signal that was a Python function.
    with contextlib.suppress(SignalError):
        first_true(low, high, breaks)
    return place
