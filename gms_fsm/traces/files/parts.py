"""The contents of a trace file, and checks that they are consistent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import TraceFileError
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.lowering.log_columns import LOG_NUMBERS
from gms_fsm.lowering.program import lower
from gms_fsm.systems.mounted import Mounted
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.rows import Rows

if TYPE_CHECKING:
    from gms_fsm.traces.files.header import Header


@dataclass(frozen=True, eq=False)
class RunDescription:
    """What ran, as a file describes it.

    Parameters
    ----------
    what : Mounted
        A system, or a model on a rig.
    """

    what: Mounted

    @cached_property
    def layout(self) -> SystemLayout:
        """Where everything is."""
        return lower(self.what.system).layout

    @cached_property
    def names(self) -> Mapping[str, str]:
        """For each observed quantity in the file its name in the layout."""
        return stored_names(self.what, self.layout)


def stored_names(what: Mounted, layout: SystemLayout) -> dict[str, str]:
    """Return for each observed quantity in a file its name in the layout."""
    if what.named:
        driven = [body.v for body in what.system.bodies if body.driven]
        return {name: name for name in (*layout.observed.shared, *layout.observed.own, *driven)}
    bank = layout.contact()
    names = {"v": bank.of(bank.velocity)}
    names |= {name: bank.of(name) for name in ("F", "s", "F_elements")}
    if bank.variables:
        names["dz"] = bank.of(f"d{bank.variables[0]}")
    return names


@dataclass(frozen=True, eq=False)
class Parts:
    """A run as stored in a file.

    Parameters
    ----------
    header : Header
        Description of what ran, and the settings.
    ran : RunDescription
        What ran.
    rows, stops : Rows
        The rows, and both sides of every stop; one object if they are the same.
    firings : Firings
        The log.
    stored : mapping of str to ndarray
        Observed quantities, by their names in the layout.
    """

    header: Header
    ran: RunDescription
    rows: Rows
    stops: Rows
    firings: Firings
    stored: Mapping[str, FloatArray]


def checked(parts: Parts) -> Parts:
    """Check the parts of a file and return them, completed."""
    layout, system = parts.ran.layout, parts.ran.what.system
    states = [len(each.chart.states) for each in system.machines for _ in range(each.n)]
    tables = {"rows": _with_slides(parts.rows, layout)}
    if parts.stops is not parts.rows:
        tables["stops"] = _with_slides(parts.stops, layout)
    for kind, table in tables.items():
        _check_table(kind, table, layout, np.array(states))
        tables[kind] = replace(
            table,
            microstep=table.microstep.astype(np.int64, copy=False),
            mode=table.mode.astype(np.int64, copy=False),
        )
    rows = tables["rows"]
    if not len(rows):
        raise TraceFileError("the file has no rows")
    for name, value in parts.stored.items():
        own = name in layout.observed.own
        shape = (len(rows), len(layout.observed.all_of(name))) if own else (len(rows),)
        _expect(name, value, shape, "f")
    firings = _checked_firings(parts.firings)
    for kind, table in tables.items():
        times = firings.t
        fired = np.searchsorted(times, table.t, "right") - np.searchsorted(times, table.t)
        if not ((table.microstep >= 0) & (table.microstep <= fired)).all():
            raise TraceFileError(
                f"{kind} microstep: the micro-steps do not match the firings in the log"
            )
    return replace(parts, rows=rows, stops=tables.get("stops", rows), firings=firings)


def _check_table(kind: str, table: Rows, layout: SystemLayout, states: Any) -> None:
    count = table.t.size
    _expect(f"{kind} t", table.t, (count,), "f")
    _expect(f"{kind} microstep", table.microstep, (count,), "i")
    _expect(f"{kind} y", table.y, (count, layout.y.size), "f")
    _expect(f"{kind} mode", table.mode, (count, layout.modes), "i")
    if not (np.diff(table.t) >= 0).all() or not np.isfinite(table.t).all():
        raise TraceFileError(f"{kind} t: times must be finite and must not decrease")
    active, slid = table.mode[:, layout.elements], table.mode[:, layout.slides]
    if not ((active >= 0) & (active < states)).all():
        raise TraceFileError(f"{kind} mode: it contains a number that is not a state of the chart")
    if slid.size and not 0 <= slid.min() <= slid.max() <= 1:
        raise TraceFileError(f"{kind} mode: a slide flag must be 0 or 1")


def _checked_firings(firings: Firings) -> Firings:
    layout, count = firings.layout, firings.t.size
    _expect("log t", firings.t, (count,), "f")
    _expect("log machine", firings.machine, (count,), "i")
    _expect("log edge", firings.edge, (count,), "i")
    _expect("log numbers", firings.numbers, (count, len(LOG_NUMBERS)), "f")
    if not (np.diff(firings.t) >= 0).all() or not np.isfinite(firings.t).all():
        raise TraceFileError("the transition log: times must be finite and must not decrease")
    machine, edge = firings.machine, firings.edge
    if not ((machine >= 0) & (machine < layout.n)).all():
        raise TraceFileError("the transition log names an element that the model does not have")
    if not ((edge >= 0) & (edge < len(layout.edges))).all() or not np.array_equal(
        layout.edge_owners[edge], layout.owners(machine)
    ):
        raise TraceFileError("the transition log names an edge that the chart does not have")
    return replace(firings, machine=machine.astype(np.int32), edge=edge.astype(np.int32))


def _with_slides(rows: Rows, layout: SystemLayout) -> Rows:
    """Return rows with slide flags for the surfaces, which files of older versions lack."""
    if rows.mode.shape != (len(rows), layout.n) or not layout.surfaces:
        return rows
    none = np.zeros((len(rows.mode), layout.surfaces), dtype=np.int64)
    return replace(rows, mode=np.concatenate([rows.mode, none], axis=1))


def _expect(name: str, array: Any, shape: tuple[int, ...], kind: str) -> None:
    """Raise unless an array from a file has the expected shape and type."""
    kinds = {"f": "f", "i": "iu"}[kind]
    if not isinstance(array, np.ndarray) or array.shape != shape or array.dtype.kind not in kinds:
        found = getattr(array, "shape", None), str(getattr(array, "dtype", type(array).__name__))
        wanted = shape, {"f": "float", "i": "integer"}[kind]
        raise TraceFileError(f"{name} is {found}, expected {wanted}")
