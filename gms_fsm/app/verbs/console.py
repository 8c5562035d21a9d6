"""Messages, progress bars and notes on standard error; results that fit the terminal."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import typer

from gms_fsm.foundation.quantities import WIDTH, wrapped
from gms_fsm.foundation.text import visible_lines

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

CLEARED = "\r\x1b[2K"  # the line


def messages(**options: Any) -> Console:
    """Return the console for messages and progress, separate from the results."""
    from rich.console import Console

    return Console(stderr=True, **options)


@contextlib.contextmanager
def progress_bars(*columns: Any) -> Iterator[Progress]:
    """Provide progress bars, started by the caller so that none appears before an error."""
    from rich.progress import Progress

    bars = Progress(*columns or Progress.get_default_columns(), console=messages())
    try:
        yield bars
    finally:
        if bars.live.is_started:
            bars.stop()


@contextlib.contextmanager
def named_bar() -> Iterator[Callable[[str, float], None]]:
    """Provide a function that is told what is being done, and how much of everything is done."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn

    columns = (BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with progress_bars(*columns) as bars:
        task = bars.add_task("", total=1.0)

        def show(name: str, done: float) -> None:
            bars.start()
            bars.update(task, description=name, completed=done)

        yield show


def error_line(text: str) -> None:
    """Print the message of an error."""
    _line("error:", "bold red", text)


def note(message: Warning | str, *_: object, **__: object) -> None:
    """Print a note; a replacement for `warnings.showwarning`."""
    _line("note:", "bold", str(message))


def say(text: str) -> None:
    """Print a result, in lines that fit the terminal; names of files stay whole."""
    for part in _parts(text):
        put(part)


def put(text: str = "", *, nl: bool = True) -> None:
    """Print a text whose lines stay as they are, such as code or a path."""
    typer.echo(visible_lines(text), nl=nl)


def _line(label: str, style: str, text: str) -> None:
    from rich.text import Text

    said = Text("\n".join(_parts(f"{label} {text}")))
    said.stylize(style, 0, len(label))
    messages(soft_wrap=True).print(said, highlight=False)


def _parts(text: str) -> Iterator[str]:
    width = shutil.get_terminal_size((WIDTH, 24)).columns
    for line in visible_lines(text).split("\n"):
        yield from wrapped(line, width, whole=True)


@contextlib.contextmanager
def opening(what: str) -> Iterator[None]:
    """Say that something opens on the whole terminal, and do not echo what is typed meanwhile."""
    terminal = all(file is not None and file.isatty() for file in (sys.stdin, sys.stdout))
    if not terminal or os.environ.get("TERM") == "dumb":
        yield
        return
    with _without_echo():
        sys.stdout.write(f"opening {what} ...\r")  # under the screen that will be drawn
        sys.stdout.flush()
        try:
            yield
        finally:
            sys.stdout.write(CLEARED)
            sys.stdout.flush()


@contextlib.contextmanager
def _without_echo() -> Iterator[None]:
    if sys.platform == "win32":  # has no termios, and echoes nothing
        yield
        return
    import termios

    try:
        before = termios.tcgetattr(sys.stdin)
    except (OSError, termios.error):
        yield
        return
    without = [*before[:3], before[3] & ~termios.ECHO, *before[4:]]
    termios.tcsetattr(sys.stdin, termios.TCSADRAIN, without)
    try:
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
