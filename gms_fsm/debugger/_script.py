"""The lines that a person types, or has in a file: a command, and the argument that it takes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from gms_fsm.debugger._elements import integer
from gms_fsm.debugger._help import ALIASES, COMMANDS
from gms_fsm.errors import SessionError, why
from gms_fsm.foundation.arguments import no_file
from gms_fsm.session.session import Breakpoint


class ScriptLine(NamedTuple):
    """A line with a command: its number in the file, its text, the command, and its argument."""

    number: int
    text: str
    name: str
    rest: str


def command_of(line: str) -> tuple[str, str]:
    """Return command and argument of a line; no command for a blank line or a comment.

    >>> command_of("b arrest if v > 0"), command_of("# to the first arrest")
    (('break', 'arrest if v > 0'), ('', ''))
    """
    name, rest = ([*line.split(None, 1), "", ""])[:2]
    return ("", "") if name.startswith("#") else (ALIASES.get(name, name), rest.strip())


def script_lines(path: Path) -> Iterator[ScriptLine]:
    """Yield the commands of a file; raise `SessionError` if it cannot be read."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise no_file(path, SessionError) from None
    except (OSError, ValueError) as error:
        raise SessionError(f"no file of commands ({why(error)})", place=str(path)) from None
    for number, line in enumerate(text.splitlines(), start=1):
        name, rest = command_of(line)
        if name:
            yield ScriptLine(number, line.strip(), name, rest)


_BACKWARD = {"step": "back", "back": "step"}


def count_of(name: str, text: str, default: int = 1) -> int:
    """Return the count that a command is given."""
    usage = f"{name} [N]"
    if name in _BACKWARD:
        usage += f"; {_BACKWARD[name]} [N] goes the other way"
    count = integer(text, usage) if text else default
    if count < 1:
        raise SessionError(
            f"{name} {count}: the count must be at least 1", advice=f"usage: {name} [N]"
        )
    return count


_REMOVED = {"clear": "breakpoint", "unwatch": "watch"}


def nothing(name: str, arg: str) -> None:
    """Refuse an argument of a command that takes none."""
    if arg:
        cure = f"goto {arg} goes to a time" if name == "run" else ""
        raise SessionError(f"{name} takes no argument, but got {arg!r}", advice=cure)


def remove(where: list[Breakpoint] | list[str], name: str, arg: str) -> None:
    """Remove what a number says, or all."""
    if arg == "all":
        where.clear()
        return
    number = integer(arg, COMMANDS[name].usage)
    if not 1 <= number <= len(where):
        there = f"there are 1 to {len(where)}" if where else "none is set"
        raise SessionError(f"there is no {_REMOVED[name]} {number}", advice=there)
    del where[number - 1]
