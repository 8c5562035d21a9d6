"""Checkpoints: an interrupted run continues where it stopped, bit for bit.

Therefore it continues only with the same program and the same functions, and only with values that
a run can have: compiled code would use an invalid one as a memory address.
"""

from __future__ import annotations

import hashlib
import platform
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import CheckpointError, ParameterError, SignalError, cut, shown
from gms_fsm.foundation.files import write_whole
from gms_fsm.lowering.log_columns import CONTACT, LOG_TEXTS
from gms_fsm.run._identity import identity
from gms_fsm.run.plausible import check_ranges, check_state, last_edges, last_states
from gms_fsm.run.problem import Problem
from gms_fsm.systems.signals import Function
from gms_fsm.systems.system import Contact
from gms_fsm.traces.files.archives import member
from gms_fsm.traces.files.unreadable import unreadable
from integrators import hybrid
from integrators.runners import states

_FORMAT = "gms-fsm checkpoint 2"


class Resumable(Protocol):
    """A run whose state can be saved and restored."""

    start: Problem

    @property
    def buffers(self) -> hybrid.Buffers:
        """The buffers in which the loop keeps its state."""

    @property
    def rows_wait(self) -> bool:
        """Whether the buffers have rows that `kept` does not have yet."""

    def kept(self) -> dict[str, Any]:
        """Return the recorder's contents as arrays."""

    def restore(self, kept: dict[str, Any]) -> None:
        """Restore what `kept` returned; the buffers are already filled."""


class Checkpointer:
    """Saves a run's state to a file at intervals, and resumes the run from it.

    Parameters
    ----------
    run : Resumable
        A run that has not started yet.
    path : Path
        The file.
    every : float
        Wall-clock time in s between two checkpoints.

    Raises
    ------
    CheckpointError
        If the file exists and is damaged, or belongs to another run or another program.
    ParameterError
        If the integrator is a SciPy solver, whose history cannot be saved, or if a signal is a
        function that cannot be identified.
    OutputError
        If the file cannot be written.
    """

    def __init__(self, run: Resumable, path: Path, every: float) -> None:
        if run.buffers.plan.foreign:
            raise ParameterError(
                "checkpoint: the history of a SciPy solver cannot be saved",
                advice="use method='dp45' or another built-in method, or leave checkpoint out",
            )
        self.run, self.path, self.every = run, path, every
        self.identity = _identity(run.start)
        if path.exists():
            self._restore()
        else:
            self.save()
        self.saved_at = time.monotonic()

    def look(self) -> None:
        """Write a checkpoint if one is due; not while rows wait that it would not have."""
        if self.run.rows_wait:
            return
        if time.monotonic() - self.saved_at >= self.every:
            self.save()
            self.saved_at = time.monotonic()

    def save(self) -> None:
        """Write a checkpoint atomically."""
        # First the rows, which come back into the columns that the state counts.
        kept = {f"kept_{name}": u for name, u in self.run.kept().items()}
        state = {f"loop_{name}": u for name, u in states.state_of(self.run.buffers).items()}
        head: dict[str, Any] = {"format": _FORMAT, "program": _program(), "identity": self.identity}
        write_whole(self.path, lambda file: np.savez(file, **head, **state, **kept))

    def finish(self) -> None:
        """Remove the file because the run has ended."""
        self.path.unlink(missing_ok=True)

    def _restore(self) -> None:
        places, columns = states.state_of(self.run.buffers), self.run.kept()
        ours = [_FORMAT, _program(), self.identity]
        try:
            most = self.path.stat().st_size  # nothing in it is compressed
            # Opened here because np.load does not close a damaged file.
            with self.path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                head = [str(member(file, "format", most))]
                if head[0].startswith("gms-fsm checkpoint"):
                    names = [name for name in ("program", "identity") if name in file.files]
                    head += [str(member(file, name, most)) for name in names]
                else:
                    raise ValueError(f"format {shown(head[0])}")
                if head == ours:
                    state = {name: member(file, f"loop_{name}", most) for name in places}
                    kept = {name: member(file, f"kept_{name}", most) for name in columns}
                    _check(self.run, state, kept)
        except Exception as error:  # numpy and zipfile raise many kinds for damaged files
            advice = "remove it to restart the run"
            raise unreadable(
                self.path, "checkpoint", error, CheckpointError, advice=advice
            ) from None
        if head[:2] != ours[:2]:
            begun = cut(head[1]) if len(head) == 3 else "an older gms-fsm"
            raise CheckpointError(
                f"started by {begun}, but this is {_program()}, which may compute different bits",
                place=str(self.path),
                advice="continue with that one, or remove the file to restart the run",
            )
        if head != ours:
            raise CheckpointError(
                "belongs to a run with another model, rig, signal or setting",
                place=str(self.path),
                advice="remove it, or use a separate file for this run",
            )
        states.put_state(self.run.buffers, {name: u.tolist() for name, u in state.items()})
        self.run.restore(kept)


def _program() -> str:
    """Identify the program: another version might compute other bits or use another layout."""
    from gms_fsm._version import __version__
    from integrators.runners.edition import edition

    return f"gms-fsm {__version__} ({edition()[:8]}) on Python {platform.python_version()}"


def _identity(start: Problem) -> str:
    """Return a hash of everything that determines a run."""
    from gms_fsm.traces.files.header import Header  # only files need pydantic

    header = Header.of(start.what, start.settings)
    head = header.model_dump_json()
    functions = {}
    for name, signal in start.system.signals.items():
        if isinstance(signal, Function):
            try:
                functions[name] = identity(signal.call)
            except SignalError as error:
                raise ParameterError(
                    f"checkpoint: {error}, so a run with it as signal {name!r} cannot be resumed",
                    advice="give an expression in t, arrays (times, values) or a Python function "
                    "over plain values, or leave checkpoint out",
                ) from None
    text = start.program.source
    times = None if start.options.times is None else [*map(float, start.options.times)]
    what = head, functions, text, start.output, times, start.y, start.mode
    return hashlib.sha256(repr(what).encode()).hexdigest()


# --------------------------------------------------------------------------- plausibility
def _check(run: Resumable, state: Mapping[str, Any], kept: Mapping[str, Any]) -> None:
    """Raise a ValueError unless a run like this one can have reached such values."""
    start, b, layout = run.start, run.buffers, run.start.program.layout
    for name, place in states.state_of(b).items():
        _expect(name, state[name], np.asarray(place), rows=False)
    for name, column in run.kept().items():
        _expect(name, kept[name], np.asarray(column), rows=name not in ("counts", "seen"))
    check_state(start, b, state, start.t_end)
    counts, cursor, last = state["counts"], state["cursor"], last_states(start)
    row = cursor[states.CURSOR.index("row")]
    # Compiled rows are in the saved columns, others in the buffer.
    capacity = max(len(kept["rows_t"]), len(b.out.rows_t))
    within = {
        "row": (row, 0, capacity),
        "rows taken": (counts[states.COUNTS.index("taken")], 0, row),
        "rows' mode": (kept["rows_mode"][:, layout.elements], 0, last),
        "stops' mode": (kept["stops_mode"][:, layout.elements], 0, last),
        "rows slid": (kept["rows_mode"][:, layout.slides], 0, 1),
        "stops slid": (kept["stops_mode"][:, layout.slides], 0, 1),
    }
    groups = [[name for name in kept if name.startswith(kind)] for kind in ("rows_", "stops_")]
    if "log" in kept:  # from a run in Python
        contacts = {each.name: each for each in start.system.machines}
        _check_log(kept["log"], contacts, named=start.what.named)
    else:  # from a compiled run
        groups.append(["t", "machine", "edge", "numbers"])
        firings, stops = kept["counts"]
        _, last_edge = last_edges(start)
        within["firings"] = firings, 0, len(kept["t"])
        within["stops"] = stops, 0, len(kept["stops_t"])
        within["firing machines"] = kept["machine"], 0, len(b.now.mode) - 1
        within["fired edges"] = kept["edge"], 0, max(0, last_edge.max())
    for group in groups:
        if len({len(kept[name]) for name in group}) != 1:
            raise ValueError(f"{', '.join(group)}: lengths differ")
    check_ranges(within)


def _check_log(log: Any, contacts: Mapping[str, Contact], *, named: bool) -> None:
    """Raise a ValueError unless a run of these contacts can have written a log."""
    if (CONTACT in log.dtype.names) != (named and log.size > 0):
        raise ValueError("log: only those of systems name contacts")
    names = log[CONTACT] if CONTACT in log.dtype.names else np.full(log.size, next(iter(contacts)))
    for name in np.unique(names).tolist():
        if name not in contacts:
            raise ValueError(f"log: no contact {shown(name)}")
        mine, contact = log[names == name], contacts[name]
        if not ((mine["element"] >= 0) & (mine["element"] < contact.n)).all():
            raise ValueError(f"log: not within 0 to {contact.n - 1}")
        known = {(edge.name, edge.source, edge.target) for edge in contact.chart.transitions}
        if not known >= {tuple(row) for row in mine[[*LOG_TEXTS]].tolist()}:
            raise ValueError("log: an edge that the chart does not have")


def _expect(name: str, found: NDArray[Any], like: NDArray[Any], *, rows: bool) -> None:
    """Refuse an array whose type or shape differs from the run's, except for its number of rows."""
    shape = (len(found), *like.shape[1:]) if rows and found.ndim else like.shape
    fitting = np.can_cast(found.dtype, like.dtype, "safe")
    if like.dtype.fields:  # the log, whose texts may have any length
        fitting = _kinds(found.dtype) == _kinds(like.dtype)
    if found.shape != shape or not fitting:
        raise ValueError(f"{name}: {found.dtype} {found.shape} is not {like.dtype} {shape}")


def _kinds(record: np.dtype[Any]) -> list[tuple[str, str]]:
    fields = (record.fields or {}).items()  # the contact is only in logs that are not empty
    return [(name, field[0].kind) for name, field in fields if name != CONTACT]
