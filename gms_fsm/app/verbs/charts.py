"""Verbs for charts: draw, check, print as code."""

from __future__ import annotations

import enum
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gms_fsm.app.paper import FORCE, VELOCITY
from gms_fsm.app.verbs.console import put, say
from gms_fsm.app.verbs.options import ChartName, ContactName, Law
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.files import output_folder, write_text

if TYPE_CHECKING:
    from gms_fsm import Model, Report, Rig, Trace
    from gms_fsm.app._own_files import OwnFile
    from gms_fsm.run.problem import Problem

SECONDS = 10.0  # of a demonstration of a system, whose file has no [run]


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
        int, typer.Option(help="Number of elements; they are alike and drawn once.")
    ] = 1,
    notation: Annotated[Notation, typer.Option(help="Notation of guards.")] = Notation.stateflow,
    direction: Annotated[Direction, typer.Option(help="Layout direction.")] = Direction.TB,
    theme: Annotated[Theme, typer.Option(help="Colour theme.")] = Theme.light,
    names: Annotated[
        bool, typer.Option("--names", help="Show the names of the edges too.")
    ] = False,
    contact: ContactName = "",
    listed: Annotated[
        bool, typer.Option("--list", help="List the charts and their parameters.")
    ] = False,
) -> None:
    """Draw a state chart, or list the charts that are included."""
    from gms_fsm.app._own_files import own_file
    from gms_fsm.app.verbs.catalogue import catalogue, chosen

    if listed:
        put(catalogue())
        return
    import plots

    own = own_file(name, law)
    no_contact(contact, own)
    chart = chosen("chart", name, law)[1] if own is None else own.only_chart(contact)
    graph = plots.statechart(
        chart,
        elements,
        notation=notation.value,
        direction=direction.value,
        theme=theme.value,
        names=names,
    )
    put(str(plots.render(graph, output)))


def handout_command(
    name: ChartName,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Output file, ending in {figure}.")
    ] = Path("handout.pdf"),
    law: Law = "",
    contact: ContactName = "",
) -> None:
    """Print a model on one A4 page: chart, equations, parameters, a hysteresis loop.

    An included chart has the numbers of its demonstration; of a scenario
    its numbers and its run.
    """
    import plots
    from gms_fsm.app._own_files import own_file
    from gms_fsm.app.scenario import load_scenario
    from gms_fsm.app.verbs.catalogue import chosen
    from gms_fsm.systems.models import demonstration

    own = own_file(name, law)
    no_contact(contact, own)
    if own is None:
        model: Model | Trace = demonstration(chosen("handout", name, law)[0], law)
    else:
        model = own.only_model(contact)
        if own.run:
            trace = load_scenario(own.path).simulate()
            model = trace.contact(contact or trace.contacts[0])
    put(str(plots.handout(model, output)))


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
    contact: ContactName = "",
) -> None:
    """Prove that a chart is free of contradictions, or refute it by a counterexample.

    The exit code is 1 if a statement is refuted. What the order of the edges
    settles is reported, but does not count as refuted. Of a system, the
    charts of all contacts are checked.
    """
    from gms_fsm.app._own_files import own_file
    from gms_fsm.app.verbs.catalogue import checkable, chosen
    from gms_fsm.charts.registry import domain_of
    from gms_fsm.verification.facts import facts_of
    from gms_fsm.verification.prove import prove_facts

    if names:
        say(checkable())
        return
    own = own_file(name, law)
    no_contact(contact, own)
    charts = {"": facts_of(chosen("check", name, law)[1])} if own is None else own.facts(contact)
    folder = None if output is None else output_folder(output)
    reports = {
        names: prove_facts(facts, domain or domain_of(facts.chart))
        for names, facts in charts.items()
    }
    texts = [str(report) for report in reports.values()]
    if own is not None and own.system is not None:
        texts = [f"contact {each}:\n{text}" for each, text in zip(reports, texts, strict=True)]
    text = "\n\n".join(texts)
    say(text)
    for path in [] if folder is None else _write_reports(text, [*reports.values()], folder):
        put(str(path))
    if any(report.refuted for report in reports.values()):
        raise typer.Exit(1)


def no_contact(contact: str, own: object) -> None:
    """Refuse a contact of an included chart."""
    if contact and own is None:
        raise ParameterError(
            "an included chart has no contacts",
            place=f"--contact {contact}",
            advice="it is for a system file",
        )


def _write_reports(text: str, reports: list[Report], folder: Path) -> list[Path]:
    """Write reports, and a marked chart for each finding refuted or settled by order."""
    import plots
    from plots.output import formats

    found = [(each, finding) for each in reports for finding in (*each.refuted, *each.settled)]
    stems = [f"{number}-{finding.check}" for number, (_, finding) in enumerate(found, start=1)]
    pictures = [name for stem in stems for name in formats.files(stem, "graph")]
    output_folder(folder, ["report.txt", *pictures])
    written = [write_text(folder / "report.txt", f"{text}\n")]
    for stem, (report, finding) in zip(stems, found, strict=True):
        edges = report.chart.guards
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
    file: Annotated[
        str,
        typer.Argument(
            help="System file or scenario file (.toml); without it, the paper's model.",
            show_default=False,
        ),
    ] = "",
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Output file, ending in {graph}.")
    ] = Path("blocks.svg"),
    elements: Annotated[
        int | None,
        typer.Option(help="Number of elements of the paper's model; 4 by default."),
    ] = None,
    schematic: Annotated[
        bool,
        typer.Option(
            "--schematic",
            help="Draw masses, springs, dampers, contacts instead, to a file ending in {figure}.",
        ),
    ] = False,
) -> None:
    """Draw the block diagram of a system, or of the paper's model (its Fig. 2a)."""
    import plots

    if not file:
        if schematic:
            raise ParameterError(
                "no system is given", place="--schematic", advice="name a system or scenario file"
            )
        picture = plots.block_diagram(4 if elements is None else elements)
        put(str(plots.render(picture, output)))
        return
    from gms_fsm.app._own_files import own_file

    own = own_file(file)
    if own is None or own.system is None:
        raise ParameterError(
            "it is a chart file" if own is not None else "it is not a file",
            place=file,
            advice="give a system file or a scenario file (.toml)",
        )
    if elements is not None:
        raise ParameterError(
            f"the number of elements is in {file}", place="--elements", advice="leave it out"
        )
    if schematic:
        from plots import figures

        put(str(figures.save(plots.schematic(own.system), output)))
        return
    put(str(plots.render(plots.block_diagram(own.system), output)))


def code_command(
    name: Annotated[
        str,
        typer.Argument(
            help="Name of an included chart, or a chart file, a system file or a scenario file "
            "(.toml)."
        ),
    ] = "gms",
    law: Law = "",
    rig: Annotated[
        RigName | None,
        typer.Option(
            help="Rig that the friction of a chart acts on; prescribed by default.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Print the stand-alone if-else program of a chart (the paper's Fig. 2c) or a system.

    The program runs by itself: it takes steps of the rig's motion, or of the
    scenario's, and prints the switches.
    """
    from gms_fsm import Contact, Prescribed, PulledSlider, Slider
    from gms_fsm.app._own_files import own_file
    from gms_fsm.app.verbs.catalogue import chosen
    from gms_fsm.exporters.alone import PERIOD, slow_velocity
    from gms_fsm.run.printed import printed
    from gms_fsm.run.problem import Problem
    from gms_fsm.systems.any_model import any_model
    from gms_fsm.systems.models import demonstration

    own = own_file(name, law)
    if own is not None and own.system is not None:
        if rig is not None:
            raise ParameterError(
                f"{name} says what the friction acts on", place="--rig", advice="leave it out"
            )
        put(printed(_start_of_file(own)), nl=False)
        return
    rigs: dict[RigName, Rig] = {
        RigName.prescribed: Prescribed(VELOCITY),
        RigName.slider: Slider(1.0, FORCE),
        RigName.pulled: PulledSlider(1.0, 2.0, 0.1),
    }
    if own is None:
        found, chart = chosen("code", name, law)
    else:
        chart = own.only_chart()
    try:
        model = demonstration(found, law) if own is None else any_model(chart)
        start = Problem.of(model, rigs[rig or RigName.prescribed], PERIOD)
        if rig in (None, RigName.prescribed):  # slower, if the model is stiff
            slow = Prescribed(slow_velocity(Contact("friction", model)))
            start = Problem.of(model, slow, PERIOD)
    except ParameterError as error:
        if rig is not None:
            raise
        other = "a system file instead of a chart"
        if len(chart.velocities) == 1:
            other = f"--rig slider, or {other}"
        advice = f"{error.advice}; here, give {other}"
        raise error.replaced(advice=advice).inside(name) from None
    put(printed(start), nl=False)


def _start_of_file(own: OwnFile) -> Problem:
    """Return the run of a scenario file, or ten seconds of a system."""
    from gms_fsm.run.problem import Problem

    assert own.system is not None
    given = own.run or {"t_start": 0.0, "t_end": SECONDS}
    t_start, initial = given["t_start"], given.get("initial")
    return Problem.of(own.system, None, given["t_end"], t_start=t_start, initial=initial)
