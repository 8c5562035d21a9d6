"""Messages, progress bars and notes on the terminal, all on standard error."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

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
    _line("[bold red]error:[/]", text)


def note(message: Warning | str, *_: object, **__: object) -> None:
    """Print a note; a replacement for `warnings.showwarning`."""
    _line("[bold yellow]note:[/]", str(message))


def _line(label: str, text: str) -> None:
    messages(soft_wrap=True).print(f"{label} {_escaped(text)}", highlight=False, emoji=False)


def _escaped(text: str) -> str:
    """Return a text without markup and without terminal control codes."""
    from rich.markup import escape

    printable = (c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)
    return escape("".join(printable))
