"""Checkpoints: a long run that is interrupted goes on where it was, bit for bit.

So it goes on by the same program and the same functions only, and with numbers only that a run can
have: compiled code would take a wrong one for a place in memory.
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

from gms_fsm._files import written_whole
from gms_fsm.errors import CheckpointError, ParameterError, SignalError, cut, shown, why
from gms_fsm.lowering.layout import LOG_TEXTS
from gms_fsm.run._identity import identity
from gms_fsm.run.start import Start
from gms_fsm.systems.signals import Function
from gms_fsm.traces._archives import member
from gms_fsm.traces._header import Header
from integrators import hybrid, loop
from integrators.advance import NEXT_KNOT, NEXT_TIME, ROW
from integrators.steps import T

__all__ = ["Keeper"]

_FORMAT = "gms-fsm checkpoint 2"


class Resumable(Protocol):
    """A run whose state can be taken and put back."""

    start: Start

    @property
    def buffers(self) -> hybrid.Buffers:
        """Where the loop keeps its state."""

    def kept(self) -> dict[str, Any]:
        """Return what the recorder holds, as arrays."""

    def go_on_from(self, kept: dict[str, Any]) -> None:
        """Take over what `kept` returned; the buffers are filled already."""


class Keeper:
    """Writes a run's state to a file now and then, and starts it from there.

    Parameters
    ----------
    run : Resumable
        A run that has not begun.
    path : Path
        The file.
    every : float
        s of the computer's time between two checkpoints.

    Raises
    ------
    CheckpointError
        If the file is there and damaged, or belongs to another run or another program.
    ParameterError
        If a SciPy solver takes the steps, whose history cannot be kept, or if a signal is a
        function that cannot be known again.
    OutputError
        If the file cannot be written, or the rig is of a class of the user's own.
    """

    def __init__(self, run: Resumable, path: Path, every: float) -> None:
        if run.buffers.plan.foreign:
            raise ParameterError(
                "checkpoint: a SciPy solver's history cannot be kept",
                advice="use method='dp45' or another of our own, or leave checkpoint out",
            )
        self.run, self.path, self.every = run, path, every
        self.identity = _identity(run.start)
        if path.exists():
            self._restore()
        else:
            self.save()
        self.saved_at = time.monotonic()

    def look(self) -> None:
        """Write a checkpoint if it is time."""
        if time.monotonic() - self.saved_at >= self.every:
            self.save()
            self.saved_at = time.monotonic()

    def save(self) -> None:
        """Write a checkpoint: the old file or the new, never a half."""
        state = {f"loop_{name}": u for name, u in hybrid.state_of(self.run.buffers).items()}
        kept = {f"kept_{name}": u for name, u in self.run.kept().items()}
        head: dict[str, Any] = {"format": _FORMAT, "program": _program(), "identity": self.identity}
        written_whole(self.path, lambda file: np.savez(file, **head, **state, **kept))

    def finish(self) -> None:
        """Remove the file: the run is over."""
        self.path.unlink(missing_ok=True)

    def _restore(self) -> None:
        places, columns = hybrid.state_of(self.run.buffers), self.run.kept()
        ours = [_FORMAT, _program(), self.identity]
        try:
            most = self.path.stat().st_size  # nothing in it is packed
            # Opened here: np.load leaves a damaged file open.
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
        except Exception as error:  # numpy and zipfile raise many kinds over damaged files
            raise CheckpointError(
                f"not a checkpoint, or damaged ({why(error)})",
                place=str(self.path),
                advice="remove it to start the run anew",
            ) from None
        if head[:2] != ours[:2]:
            begun = cut(head[1]) if len(head) == 3 else "an older gms-fsm"
            raise CheckpointError(
                f"begun by {begun}, and this is {_program()}, which may compute other bits",
                place=str(self.path),
                advice="go on with that one, or remove the file to start the run anew",
            )
        if head != ours:
            raise CheckpointError(
                "belongs to a run with another model, rig, signal or setting",
                place=str(self.path),
                advice="remove it, or give this run a file of its own",
            )
        for name, place in places.items():
            place[:] = state[name] if isinstance(place, np.ndarray) else state[name].tolist()
        self.run.go_on_from(kept)


def _program() -> str:
    """Return what runs: another version might go on with other bits, or lay out its state anew."""
    from gms_fsm._version import __version__
    from integrators.compiled import edition

    return f"gms-fsm {__version__} ({edition()[:8]}) on Python {platform.python_version()}"


def _identity(start: Start) -> str:
    """Return a short name for all that decides a run."""
    head = Header.of(start.model, start.rig, start.settings).model_dump_json()
    functions = {}
    for name, signal in start.rig.signals.items():
        if isinstance(signal, Function):
            try:
                functions[name] = identity(signal.call)
            except SignalError as error:
                raise ParameterError(
                    f"checkpoint: {error}, so a run with it as signal {name!r} cannot be resumed",
                    advice="give an expression of t, arrays (times, values) or a Python function "
                    "over plain values, or leave checkpoint out",
                ) from None
    text = start.program.source
    what = head, functions, text, start.output, start.options.times, start.y, start.mode
    return hashlib.sha256(repr(what).encode()).hexdigest()


# --------------------------------------------------------------------------- what a run can have
def _check(run: Resumable, state: Mapping[str, Any], kept: Mapping[str, Any]) -> None:
    """Raise a ValueError unless a run like this one can have come to such numbers."""
    start, b, chart = run.start, run.buffers, run.start.model.chart
    for name, place in hybrid.state_of(b).items():
        _expect(name, state[name], np.asarray(place), rows=False)
    for name, column in run.kept().items():
        _expect(name, kept[name], np.asarray(column), rows=name not in ("counts", "seen"))
    states, edges, n = len(chart.states), len(chart.transitions), len(b.now.mode)
    layout = start.program.layout
    counts, cursor = state["counts"], state["cursor"]
    # Compiled rows lie in the columns that were kept, others in the buffer.
    capacity = max(len(kept["rows_t"]), len(b.out.rows_t))
    machine = 0 if counts[loop.PHASE] == loop.FIRE else -1
    within = {
        "time": (state["clock"][T], start.t_start, start.t_end),
        "mode": (state["mode"], 0, states - 1),
        "edges": (state["edges"], -1, edges - 1),
        "room": (state["room"], 0, len(b.relations.watch) - 1),
        "watch": (state["watch"], 0, 1),
        "phase": (counts[loop.PHASE], loop.START, loop.END),
        "machine": (counts[loop.MACHINE], machine, n - 1),
        "edge": (counts[loop.EDGE], 0, max(0, edges - 1)),
        "jump": (counts[loop.JUMP], 0, len(b.plan.jumps)),
        "active relations": (counts[loop.ACTIVE], 0, len(b.relations.watch)),
        "row": (cursor[ROW], 0, capacity),
        "rows taken": (counts[loop.TAKEN], 0, cursor[ROW]),
        "wanted time": (cursor[NEXT_TIME], 0, len(b.out.times)),
        "knot": (cursor[NEXT_KNOT], 0, len(b.plan.knots)),
        "surfaces": (state["which"][:-1], 0, max(0, layout.surfaces - 1)),
        "surfaces slid on": (state["which"][-1], 0, len(b.sliding.sigma)),
        "slid": (state["slid"], 0, 1),
        "arrived": (state["arrived"], 0, 1),
        "rows' mode": (kept["rows_mode"][:, layout.elements], 0, states - 1),
        "stops' mode": (kept["stops_mode"][:, layout.elements], 0, states - 1),
        "rows slid": (kept["rows_mode"][:, layout.slides], 0, 1),
        "stops slid": (kept["stops_mode"][:, layout.slides], 0, 1),
    }
    groups = [[name for name in kept if name.startswith(kind)] for kind in ("rows_", "stops_")]
    if "log" in kept:  # of a run by Python
        log = kept["log"]
        within["log"] = log["element"], 0, n - 1
        known = {(edge.name, edge.source, edge.target) for edge in chart.transitions}
        if not known >= {tuple(row) for row in log[[*LOG_TEXTS]].tolist()}:
            raise ValueError("log: an edge that the chart has not")
    else:  # of a compiled one
        groups.append(["t", "machine", "edge", "numbers"])
        firings, stops = kept["counts"]
        within["firings"] = firings, 0, len(kept["t"])
        within["stops"] = stops, 0, len(kept["stops_t"])
        within["firing machines"] = kept["machine"], 0, n - 1
        within["fired edges"] = kept["edge"], 0, max(0, edges - 1)
    for group in groups:
        if len({len(kept[name]) for name in group}) != 1:
            raise ValueError(f"{', '.join(group)}: not of one length")
    for name, (found, least, most) in within.items():
        if not np.all((np.asarray(found) >= least) & (np.asarray(found) <= most)):
            raise ValueError(f"{name}: outside of {least} to {most}")


def _expect(name: str, found: NDArray[Any], like: NDArray[Any], *, rows: bool) -> None:
    """Refuse an array that is not like one of the run's, but for the number of its rows."""
    shape = (len(found), *like.shape[1:]) if rows and found.ndim else like.shape
    fitting = np.can_cast(found.dtype, like.dtype, "safe")
    if like.dtype.fields:  # the log, whose texts may be of any length
        fitting = _kinds(found.dtype) == _kinds(like.dtype)
    if found.shape != shape or not fitting:
        raise ValueError(f"{name}: {found.dtype} {found.shape} is not {like.dtype} {shape}")


def _kinds(record: np.dtype[Any]) -> list[tuple[str, str]]:
    return [(name, field[0].kind) for name, field in (record.fields or {}).items()]
