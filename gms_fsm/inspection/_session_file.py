"""Session files: the system, the pokes, cursors, breakpoints and watches, without rows."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gms_fsm._files import write_whole
from gms_fsm.errors import SessionError, TraceFileError, why
from gms_fsm.inspection import _walker
from gms_fsm.inspection._branch import Branch
from gms_fsm.inspection._breakpoints import Breakpoint
from gms_fsm.inspection._poking import Edits
from gms_fsm.run.settings import Settings
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Function
from gms_fsm.systems.system import System
from gms_fsm.traces._header import Header

if TYPE_CHECKING:
    from gms_fsm.inspection.session import Session

__all__ = ["BranchRecord", "SessionRecord", "blamed", "read", "record_of", "restore", "write"]

FORMAT = "gms-fsm session 1"


@dataclass(frozen=True)
class BranchRecord:
    """How a branch was made, and the position of its cursor.

    Parameters
    ----------
    parent, fork
        As in `Branch`.
    edits : Edits or None
        The changed values; None for the original run.
    cursor : int
        The row under the cursor.
    begin, between : float or None
        Times of the poke and of the cursor, s, if they are between two rows.
    """

    parent: int | None
    fork: int
    edits: Edits | None
    cursor: int
    begin: float | None
    between: float | None

    @classmethod
    def of(cls, branch: Branch) -> BranchRecord:
        """Describe a branch."""
        begin, between = (
            None if place is None else place.t for place in (branch.begin, branch.between)
        )
        return cls(branch.parent, branch.fork, branch.edits, branch.cursor, begin, between)


@dataclass(frozen=True)
class SessionRecord:
    """Everything needed to restore a session.

    Parameters
    ----------
    model, rig, t_end, options
        As for `Session`; of a system the rig is None.
    branches : sequence of BranchRecord
        The first is the original run.
    current : int
        Number of the current branch.
    breakpoints : sequence of Breakpoint
        The breakpoints, with their hits so far.
    watches : sequence of str
        The watch expressions.
    """

    model: Model | System
    rig: Rig | None
    t_end: float
    options: Mapping[str, Any]
    branches: Sequence[BranchRecord]
    current: int
    breakpoints: Sequence[Breakpoint]
    watches: Sequence[str]

    @property
    def arguments(self) -> tuple[Any, ...]:
        """The positional arguments of `Session`."""
        rig = () if self.rig is None else (self.rig,)
        return self.model, *rig, self.t_end


def options_of(
    settings: Settings, t_start: float, initial: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Return the arguments of a session that differ from their defaults."""
    usual = Settings()
    chosen = {
        each.name: getattr(settings, each.name)
        for each in fields(Settings)
        if getattr(settings, each.name) != getattr(usual, each.name)
    }
    if t_start != 0.0:
        chosen["t_start"] = t_start
    return chosen if initial is None else chosen | {"initial": dict(initial)}


def record_of(session: Session) -> SessionRecord:
    """Describe a session."""
    return SessionRecord(
        *session.made_of,
        options_of(session.settings, session.t_start, session.initial),
        [BranchRecord.of(branch) for branch in session.branches],
        session.current,
        session.breakpoints,
        session.watches,
    )


def restore(session: Session, record: SessionRecord) -> None:
    """Restore a session by moving to each of its cursors again."""
    for branch in record.branches:
        if branch.edits is not None:
            assert branch.parent is not None
            session.switch(branch.parent)
            _walker.walk_to(session.branch, branch.fork, branch.begin)
            session.poke(branch.edits.variables, branch.edits.v, branch.edits.state)
    for number, branch in enumerate(record.branches):
        session.switch(number)
        _walker.walk_to(session.branch, branch.cursor, branch.between)
    session.switch(record.current)
    for point in record.breakpoints:
        where: int | str | None = point.element
        if point.contact:
            element = "" if point.element is None else f" {point.element + 1}"
            where = f"{point.contact}{element}"
        found = session.break_on(point.kind, point.name, where, point.condition, point.hits)
        found.seen = point.seen
    session.watches = list(record.watches)


def write(path: Path, record: SessionRecord) -> Path:
    """Write a session; raise `SessionError` for anything a file cannot store."""
    what = mounted(record.model, record.rig)
    if any(isinstance(signal, Function) for signal in what.system.signals.values()):
        raise SessionError("a signal is a Python function, which a file cannot store")
    for name, value in record.options.items():
        if not isinstance(value, str | int | float | dict | type(None)):
            raise SessionError(f"the option {name} = {value!r} cannot be written to a file")
    data = {
        "format": FORMAT,
        "header": json.loads(Header.of(what, {}).model_dump_json()),
        "t_end": record.t_end,
        "options": {name: _plain(value) for name, value in record.options.items()},
        "branches": [
            {
                "parent": branch.parent,
                "fork": branch.fork,
                "edits": {} if branch.edits is None else asdict(branch.edits),
                "cursor": branch.cursor,
                "from": branch.begin,
                "between": branch.between,
            }
            for branch in record.branches
        ],
        "current": record.current,
        "breakpoints": [asdict(point) for point in record.breakpoints],
        "watches": record.watches,
    }
    text = json.dumps(data, indent=1).encode()
    return write_whole(path, lambda file: file.write(text))


def read(path: Path) -> SessionRecord:
    """Read a session; a faulty file raises any kind of error."""
    data = json.loads(path.read_text(encoding="utf-8"))
    if data["format"] != FORMAT:
        raise ValueError(f"format is {data['format']!r}")
    header = Header.model_validate(data["header"])
    what = header.to_mounted()
    return SessionRecord(
        what.given or what.model,
        None if what.named else what.rig,
        data["t_end"],
        data["options"],
        [_branch(record) for record in data["branches"]],
        int(data["current"]),
        [Breakpoint(**record) for record in data["breakpoints"]],
        [str(text) for text in data["watches"]],
    )


def _branch(record: Mapping[str, Any]) -> BranchRecord:
    edits, given = None, record["edits"]
    if given:
        own = {
            name: _by_number(values) if isinstance(values, Mapping) else float(values)
            for name, values in given["variables"].items()
        }
        edits = Edits(own, given["v"], _by_number(given["state"]))
    return BranchRecord(
        record["parent"],
        int(record["fork"]),
        edits,
        int(record["cursor"]),
        record["from"],
        record["between"],
    )


def _by_number(values: Mapping[str, Any]) -> dict[Any, Any]:
    """Return values by element, with keys that JSON made strings of converted to integers."""
    return {int(key) if key.isdecimal() else key: value for key, value in values.items()}


def _plain(value: Any) -> Any:
    """Return an option with its arrays as lists."""
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


@contextmanager
def blamed(path: Path) -> Iterator[None]:
    """Raise every error of the block as an error of the file."""
    try:
        yield
    except FileNotFoundError:
        raise TraceFileError(
            "no such file", place=str(path), advice="check the name and the folder"
        ) from None
    except Exception as error:  # any error is the fault of the damaged file
        raise TraceFileError(
            f"not a session file, or damaged ({why(error)})", place=str(path)
        ) from None
