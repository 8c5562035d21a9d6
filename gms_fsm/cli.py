"""The command line: one verb an experiment. A user's mistake is one message and exit code 2."""

from __future__ import annotations

import enum
import json
import sys
import warnings
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

import gms_fsm
from gms_fsm import paper
from gms_fsm.errors import GMSError
from gms_fsm.live import LiveView
from gms_fsm.models import GMS, Model
from gms_fsm.parameters import GMSParameters
from gms_fsm.program import lower
from gms_fsm.report import run_scenario, velocity_note
from gms_fsm.rigs import Prescribed, PulledSlider, Rig, Slider
from gms_fsm.scenario import Scenario, load_scenario

__all__ = ["app", "main"]

app = typer.Typer(
    name="gms-fsm",
    help="Friction as an explicit state machine: the Generalized Maxwell Slip model.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)


class LawName(enum.StrEnum):
    """Slip laws."""

    published = "published"
    signed = "signed"


class RigName(enum.StrEnum):
    """What the friction is mounted on."""

    prescribed = "prescribed"
    slider = "slider"
    pulled = "pulled"


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"gms-fsm {gms_fsm.__version__}")
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Friction as an explicit state machine: the Generalized Maxwell Slip model."""


@app.command("paper")
def paper_command(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for everything that is written.")
    ] = Path("paper"),
    force: Annotated[
        str, typer.Option(help="Applied force of Fig. 3 [N] as an expression of t [s].")
    ] = paper.FORCE,
    velocity: Annotated[
        str, typer.Option(help="Velocity of Fig. 4 [m/s] as an expression of t [s].")
    ] = paper.VELOCITY,
) -> None:
    """Run the paper's two experiments; write figures, traces, logs and claims.md."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description:<22}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bars:
        tasks: dict[str, TaskID] = {}

        def show(name: str, done: float) -> None:
            if name not in tasks:
                tasks[name] = bars.add_task(name, total=1.0)
            bars.update(tasks[name], completed=done)

        files = paper.write(output, force, velocity, show)
    typer.echo(f"{len(files)} files in {output}; start with {files[0]}")


@app.command("run")
def run_command(
    scenario: Annotated[Path, typer.Argument(help="A scenario file, TOML.", show_default=False)],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for what is written; out/<name> if left out."),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", help="Change a key, for example --set model.law=published."),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Show every element's state while it runs.")
    ] = False,
) -> None:
    """Run a scenario; write trace, transition log, overview figure and summary."""
    loaded = load_scenario(scenario, overrides or [])
    folder = Path("out") / scenario.stem if output is None else output
    start, end = loaded.arguments["t_start"], loaded.arguments["t_end"]
    with LiveView(Console(stderr=True), start, end, detail=live) as view:
        trace, files = run_scenario(loaded, folder, view)
    if loaded.motion is not None and (note := velocity_note(trace, loaded.motion)):
        _plain_warning(note)
    typer.echo(f"{len(trace.transitions)} transitions; {len(files)} files in {folder}")
    typer.echo(f"start with {files[0]}")


@app.command("schema")
def schema_command() -> None:
    """Print the JSON schema of scenario files, for editors."""
    typer.echo(json.dumps(Scenario.model_json_schema(), indent=2))


@app.command("code")
def code_command(
    law: Annotated[LawName, typer.Option(help="Slip law; there is no default, they differ.")],
    rig: Annotated[RigName, typer.Option(help="What the friction is mounted on.")] = (
        RigName.prescribed
    ),
) -> None:
    """Print the if-else program generated from the GMS chart (the paper's Fig. 2c)."""
    rigs: dict[RigName, Rig] = {
        RigName.prescribed: Prescribed(paper.VELOCITY),
        RigName.slider: Slider(1.0, paper.FORCE),
        RigName.pulled: PulledSlider(1.0, 2.0, 0.1),
    }
    model: Model = GMS(GMSParameters.paper("stick-slip"), law=law.value)
    typer.echo(lower(model, rigs[rig]).source, nl=False)


def main() -> None:
    """Run the command line; print a user's mistake as one message and exit with code 2."""
    warnings.showwarning = _plain_warning
    try:
        app()
    except GMSError as error:
        Console(stderr=True, soft_wrap=True).print(
            f"[bold red]error:[/] {_escaped(str(error))}", highlight=False, emoji=False
        )
        sys.exit(2)


def _escaped(text: str) -> str:
    from rich.markup import escape

    return escape(text)


def _plain_warning(message: Warning | str, *_: object, **__: object) -> None:
    Console(stderr=True, soft_wrap=True).print(
        f"[bold yellow]note:[/] {_escaped(str(message))}", highlight=False, emoji=False
    )
