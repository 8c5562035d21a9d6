"""The verb that scores friction models on public records."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from gms_fsm.app.verbs.console import named_bar, note, say
from gms_fsm.app.verbs.options import INTERRUPTED, OutputFolder


def benchmark_command(
    data: Annotated[
        Path | None,
        typer.Option(
            help="Folder with the records; by default what GMS_FSM_DATA names.",
            show_default=False,
        ),
    ] = None,
    output: OutputFolder = Path("benchmark"),
    only: Annotated[
        list[str] | None,
        typer.Option("--only", help="Data set: tribometer or damper; repeat for several."),
    ] = None,
) -> None:
    """Score friction models on public records; write a page and a JSON file."""
    from gms_fsm.app.benchmark import make, write
    from gms_fsm.app.benchmark.datasets import data_set
    from gms_fsm.app.benchmark.pages import FILES
    from gms_fsm.foundation.files import output_folder

    folder = Path(os.environ.get("GMS_FSM_DATA", ".")) if data is None else data
    names = [data_set(name).name for name in only or ()]
    output_folder(output, FILES)
    with named_bar() as show:
        card = make(folder, only=names, progress=show)
    files = write(card, output)
    say(f"{len(files)} files in {output}; start with {files[0]}")
    if not card.complete:
        note("interrupted; what was complete is written")
        raise typer.Exit(INTERRUPTED)
