"""Messages, progress bars and notes on standard error; results that fit the terminal."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import typer

from gms_fsm.foundation.quantities import WIDTH, wrapped

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress


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
        typer.echo(part)


def _line(label: str, style: str, text: str) -> None:
    from rich.text import Text

    printable = (c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)
    said = Text("\n".join(_parts(f"{label} {''.join(printable)}")))
    said.stylize(style, 0, len(label))
    messages(soft_wrap=True).print(said, highlight=False)


def _parts(text: str) -> Iterator[str]:
    width = shutil.get_terminal_size((WIDTH, 24)).columns
    for line in text.split("\n"):
        yield from wrapped(line, width, whole=True)
