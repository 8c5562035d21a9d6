"""Session files: the system, what its branches change, cursors, breakpoints, without rows."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gms_fsm.errors import SessionError, TraceFileError
from gms_fsm.foundation.arguments import checked_integer, no_file
from gms_fsm.foundation.files import write_text
from gms_fsm.run.settings import Settings
from gms_fsm.session._breakpoints import Breakpoint
from gms_fsm.session.tree import walker
from gms_fsm.session.tree.branch import Branch
from gms_fsm.session.tree.branches import Fork
from gms_fsm.systems.signals import Function
from gms_fsm.traces.files.header import Header
from gms_fsm.traces.files.unreadable import part_of_a_file, unreadable

if TYPE_CHECKING:
    from gms_fsm.session.session import Session


FORMAT = "gms-fsm session 1"


def _options_of(
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


def write(path: Path, session: Session) -> Path:
    """Write a session; raise `SessionError` for anything a file cannot store."""
    what = session.tree.subject
    if any(isinstance(signal, Function) for signal in what.system.signals.values()):
        raise SessionError("a signal is a Python function, which a file cannot store")
    tree = session.tree
    options = _options_of(session.settings, tree.t_start, tree.initial)
    for name, value in options.items():
        if not isinstance(value, str | int | float | dict | type(None)):
            raise SessionError(f"the option {name} = {value!r} cannot be written to a file")
    places = {number: place for place, number in enumerate(tree.forks)}  # some may be deleted
    data = {
        "format": FORMAT,
        "header": json.loads(Header.of(what, {}).model_dump_json()),
        "t_end": session.t_end,
        "options": {name: _plain(value) for name, value in options.items()},
        "branches": [
            _written(
                fork, tree.branch(number), None if fork.parent is None else places[fork.parent]
            )
            for number, fork in tree.forks.items()
        ],
        "current": places[session.current],
        "breakpoints": [asdict(point) for point in session.breakpoints],
        "watches": session.watches,
    }
    return write_text(path, json.dumps(data, indent=1))


def _written(fork: Fork, branch: Branch, parent: int | None) -> dict[str, Any]:
    """Describe a branch: how it was made, and the position of its cursor."""
    begin, between = (
        None if place is None else place.t for place in (branch.begin, branch.between)
    )
    data: dict[str, Any] = {
        "parent": parent,
        "fork": -1 if fork.poke is None else branch.fork,
        "edits": {} if fork.poke is None else asdict(fork.poke.edits),
        "cursor": branch.cursor,
        "from": begin,
        "between": between,
    }
    if fork.name not in (fork.text, "original"):
        data["name"] = fork.name
    if fork.law is not None:
        data["law"] = fork.law
    if fork.values:
        data["values"] = dict(fork.values)
        if fork.poke is not None:  # made with other numbers: its row is not one of the parent
            data |= {"t": fork.poke.t, "microstep": fork.poke.microstep}
    return data


def read(path: Path, made: Callable[..., Session]) -> Session:
    """Read a session and make its branches again; a faulty file raises any kind of error."""
    data = json.loads(path.read_text(encoding="utf-8"))
    if data["format"] != FORMAT:
        raise ValueError(f"format is {data['format']!r}")
    with part_of_a_file("header"):
        what = Header.model_validate(data["header"]).to_mounted()
    given = (what.given,) if what.named else (what.model, what.rig)
    with part_of_a_file("t_end and options"):
        session = made(*given, data["t_end"], **data["options"])
    with part_of_a_file("branches"):
        for branch in data["branches"]:
            _make(session, branch)
        for number, branch in enumerate(data["branches"]):
            session.switch(number)
            walker.walk_to(session.branch, int(branch["cursor"]), branch["between"])
    with part_of_a_file("current"):
        session.switch(checked_integer("current", data["current"]))
    with part_of_a_file("breakpoints"):
        for each in data["breakpoints"]:
            _break(session, Breakpoint(**each))
    with part_of_a_file("watches"):
        session.watches = [str(text) for text in data["watches"]]
    return session


def _break(session: Session, point: Breakpoint) -> None:
    """Set a breakpoint with its count."""
    where: int | str | None = point.element
    if point.contact:
        element = "" if point.element is None else f" {point.element + 1}"
        where = f"{point.contact}{element}"
    found = session.break_on(point.kind, point.name, where, point.condition, point.hits)
    found.seen = point.seen


def _make(session: Session, data: Mapping[str, Any]) -> None:
    """Make a branch as it was made, from its parent."""
    name, values, edits = data.get("name", ""), data.get("values", {}), data["edits"]
    if data["parent"] is not None:
        session.switch(data["parent"])
        if not edits:
            session.fork(values=values, law=data.get("law"), name=name)
            return
        given = {
            key: _by_number(each) if isinstance(each, Mapping) else float(each)
            for key, each in edits["variables"].items()
        }
        when = {key: data[key] for key in ("t", "microstep") if key in data}
        if not when:
            walker.walk_to(session.branch, int(data["fork"]), data["from"])
        session.poke(given, edits["v"], _by_number(edits["state"]), **when, name=name)
    elif name:
        session.tree.rename(0, name)
    if values:
        session.tree.set(values)


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
        raise no_file(path, TraceFileError) from None
    except Exception as error:  # any error is the fault of the damaged file
        raise unreadable(path, "session", error, advice="save the session again") from None
