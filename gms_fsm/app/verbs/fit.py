"""The verb fit: parameters from the record of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gms_fsm.app.verbs.console import note, say
from gms_fsm.app.verbs.options import INTERRUPTED, Overrides, PresetName, ScenarioFile
from gms_fsm.foundation.text import visible

if TYPE_CHECKING:
    from gms_fsm.identification.result import Fit


NARROWEST = 80  # characters: numbers are not cut in a narrow terminal


def fit_command(
    scenario: ScenarioFile,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Output folder; out/<name>-fit by default."),
    ] = None,
    overrides: Overrides = None,
    preset: PresetName = "screen",
) -> None:
    """Fit the model of a scenario to its record; write a report and a scenario that runs."""
    import plots
    from gms_fsm.app.fit_report import report_folder, write_report
    from gms_fsm.app.fits import load_fit
    from gms_fsm.identification.fit import fitted

    loaded = load_fit(scenario, overrides or [])
    folder = Path("out") / f"{scenario.stem}-fit" if output is None else output
    for each in loaded.notes:
        note(each)
    with plots.preset(preset):
        report_folder(folder, loaded.inputs)  # before the search, which may take minutes
        try:
            found = fitted(loaded.task, progress=None)
        except KeyboardInterrupt:
            note("interrupted; nothing was written")
            raise typer.Exit(INTERRUPTED) from None
        _print(found)
        page = write_report(found, folder)
    say(f"{found.runs} runs in {found.seconds:.3g} s")
    say(f"start with {page}")
    if found.stopped:
        note(found.stopped)
        raise typer.Exit(INTERRUPTED)


def _print(found: Fit) -> None:
    """Print the parameters, what cannot be told, and the scores."""
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for head in ("parameter", "value", "95 % interval", "unit"):
        table.add_column(head, justify="right" if head == "value" else "left", no_wrap=True)
    table.add_column("note", overflow="fold")  # only this column gives way
    for each in found.table:
        texts = (each.name, *each.shown, each.unit, each.note)
        table.add_row(*(Text(visible(text)) for text in texts))
    Console(width=max(Console().width, NARROWEST)).print(table)
    if found.weakest:
        say(found.weakest)
    say(found.scores_text)
