"""Verbs for charts: draw, check, print as code."""

from __future__ import annotations

import enum
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gms_fsm._files import output_folder, write_whole
from gms_fsm.app._options import ChartName, Law
from gms_fsm.app.paper import FORCE, VELOCITY

if TYPE_CHECKING:
    from gms_fsm import Report, Rig

__all__ = ["blocks_command", "chart_command", "check_command", "code_command"]


class RigName(enum.StrEnum):
    """Rig that the friction acts on."""

    prescribed = "prescribed"
    slider = "slider"
    pulled = "pulled"


class Notation(enum.StrEnum):
    """Notation of guards."""

    stateflow = "stateflow"
    math = "math"


class Direction(enum.StrEnum):
    """Layout direction of a chart."""

    TB = "TB"
    LR = "LR"


class Theme(enum.StrEnum):
    """Colour theme of a chart."""

    light = "light"
    dark = "dark"


def chart_command(
    name: ChartName = "",
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Output file, ending in {chart}.")
    ] = Path("chart.svg"),
    law: Law = "",
    elements: Annotated[
        int, typer.Option(help="Number of elements, drawn as parallel states.")
    ] = 1,
    notation: Annotated[Notation, typer.Option(help="Notation of guards.")] = Notation.stateflow,
    direction: Annotated[Direction, typer.Option(help="Layout direction.")] = Direction.TB,
    theme: Annotated[Theme, typer.Option(help="Colour theme.")] = Theme.light,
    names: Annotated[
        bool, typer.Option("--names", help="Show the names of the edges too.")
    ] = False,
    listed: Annotated[
        bool, typer.Option("--list", help="List the charts and their parameters.")
    ] = False,
) -> None:
    """Draw a state chart, or list the charts that are included."""
    from gms_fsm.app._catalogue import catalogue, chosen

    if listed:
        typer.echo(catalogue())
        return
    import plots

    _, chart = chosen("chart", name, law)
    graph = plots.statechart(
        chart,
        elements,
        notation=notation.value,
        direction=direction.value,
        theme=theme.value,
        names=names,
    )
    typer.echo(str(plots.render(graph, output)))


def check_command(
    name: ChartName = "",
    law: Law = "",
    domain: Annotated[
        list[str] | None,
        typer.Option(
            help="Condition to assume instead of the default domain, for example 's >= 0'; may be "
            "repeated."
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for the report and the marked charts."),
    ] = None,
    names: Annotated[
        bool, typer.Option("--list", help="List the charts that can be checked.")
    ] = False,
) -> None:
    """Prove that a chart is free of contradictions, or refute it by a counterexample.

    The exit code is 1 if a statement is refuted. What the order of the edges
    settles is reported, but does not count as refuted.
    """
    from gms_fsm import prove
    from gms_fsm.app._catalogue import checkable, chosen

    if names:
        typer.echo(checkable())
        return
    found, chart = chosen("check", name, law)
    folder = None if output is None else output_folder(output)
    report = prove(chart, domain or found.domain)
    typer.echo(str(report))
    for path in [] if folder is None else _write_report(report, folder):
        typer.echo(str(path))
    if report.refuted:
        raise typer.Exit(1)


def _write_report(report: Report, folder: Path) -> list[Path]:
    """Write a report, and a marked chart for each finding refuted or settled by order."""
    import plots
    from plots import formats

    text = f"{report}\n".encode()
    found = [*report.refuted, *report.settled]
    stems = [f"{number}-{finding.check}" for number, finding in enumerate(found, start=1)]
    pictures = [name for stem in stems for name in formats.files(stem, "graph")]
    output_folder(folder, ["report.txt", *pictures])
    written = [write_whole(folder / "report.txt", lambda file: file.write(text))]
    edges = report.chart.guards
    for stem, finding in zip(stems, found, strict=True):
        marked = [part for part in finding.where if part in edges] or finding.where
        settled = finding.status if finding in report.settled else ""
        heading = ", ".join(part for part in (finding.check, finding.case, settled) if part)
        note = textwrap.wrap(f"{heading}: {finding.text}", 50)
        note += textwrap.wrap(finding.example, 50)
        graph = plots.statechart(report.chart, marked=marked, note="\n".join(note))
        for ending in formats.endings("graph", usual=True):
            written.append(plots.render(graph, folder / f"{stem}{ending}"))
    return list(dict.fromkeys(written))


def blocks_command(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Output file, ending in {graph}.")
    ] = Path("blocks.svg"),
    elements: Annotated[int, typer.Option(help="Number of elements.")] = 4,
) -> None:
    """Draw the block diagram of the whole model (the paper's Fig. 2a)."""
    import plots

    typer.echo(str(plots.render(plots.block_diagram(elements), output)))


def code_command(
    name: Annotated[str, typer.Argument(help="Name of the chart.")] = "gms",
    law: Law = "",
    rig: Annotated[RigName, typer.Option(help="Rig that the friction acts on.")] = (
        RigName.prescribed
    ),
) -> None:
    """Print the stand-alone if-else program of a chart (the paper's Fig. 2c)."""
    from gms_fsm import Prescribed, PulledSlider, Slider
    from gms_fsm.app._catalogue import chosen
    from gms_fsm.lowering._generated import standalone
    from gms_fsm.lowering.program import lower
    from gms_fsm.systems.models import demonstration

    found, _ = chosen("code", name, law)
    rigs: dict[RigName, Rig] = {
        RigName.prescribed: Prescribed(VELOCITY),
        RigName.slider: Slider(1.0, FORCE),
        RigName.pulled: PulledSlider(1.0, 2.0, 0.1),
    }
    model = demonstration(found, law)
    typer.echo(standalone(lower(model, rigs[rig]).source), nl=False)
