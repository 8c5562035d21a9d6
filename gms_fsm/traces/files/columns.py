"""The rows of a trace as flat columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.systems.numbers import column_name
from gms_fsm.traces.files.parts import stored_names

if TYPE_CHECKING:
    from gms_fsm.traces.trace import Trace


FORCES = "_elements"  # how the names of the elements' forces end in a layout


def column_title(layout: SystemLayout, name: str, *, short: bool) -> str:
    """Return the title of the column of a quantity; without the number of its element."""
    title = name.removesuffix(FORCES)
    return title.removeprefix(layout.contact().of("")) if short else title


def columns_of(trace: Trace) -> dict[str, NDArray[Any]]:
    """Return the rows of a trace as flat columns."""
    layout, system = trace.program.layout, trace.what.system
    table: dict[str, NDArray[Any]] = {"t": trace.t, "microstep": trace.microstep}
    slid = trace.rows.mode[:, layout.slides].T
    slides = {column_name("slides", k): flags for k, flags in enumerate(slid)}
    if not trace.subject.named:
        shared, own = _of_contact(trace)
        return table | shared | slides | own
    table |= {name: trace.rows.y[:, layout.y.index(name)] for name in layout.y.shared}
    table |= {body.v: trace.body(body.name).v for body in system.bodies if body.driven}
    table |= slides
    for name in trace.what.machines:
        for part in _of_contact(trace.contact(name)):
            table |= {f"{name}.{title}": column for title, column in part.items()}
    return table


def _of_contact(trace: Trace) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
    """Return the columns of one contact: those with one value, and those of its elements."""
    bank, layout = trace.places, trace.program.layout
    start = bank.of("")
    kept = [
        name
        for name in stored_names(trace.what, layout).values()
        if name.startswith(start) and name in trace.seen
    ]
    shared = {"x": trace.x} if bank.position else {}
    shared |= {
        name.removeprefix(start): trace.seen[name]
        for name in kept
        if name in layout.observed.shared
    }
    y = trace.rows.y
    held = [name for name, i in layout.y if i in (None, 0) and name.startswith(start)]
    shared |= {name.removeprefix(start): y[:, layout.y.index(name)] for name in held
               if name in layout.y.shared}  # fmt: skip
    blocks: dict[str, NDArray[Any]] = {
        column_title(layout, name, short=False).removeprefix(start): y[:, layout.y.all_of(name)]
        for name in held
        if name not in layout.y.shared
    }
    blocks["state"] = trace.states
    blocks |= {
        column_title(layout, name, short=False).removeprefix(start): trace.seen[name]
        for name in kept
        if name in layout.observed.own
    }
    own = {
        column_name(title, i): values[:, i]
        for title, values in blocks.items()
        for i in range(bank.n)
    }
    return shared, own
