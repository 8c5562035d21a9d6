"""The verb that compares: two charts, scenarios or systems, or two runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gms_fsm.app.verbs.console import put, say
from gms_fsm.app.verbs.options import ContactName
from gms_fsm.errors import GMSError, ParameterError

if TYPE_CHECKING:
    from gms_fsm import Chart, Diff
    from gms_fsm.app._own_files import OwnFile

DIFFERENT, UNDECIDED = 1, 2  # exit codes
TRACES = (".npz", ".csv")
Compared = Annotated[
    str,
    typer.Argument(
        help="A chart file, system file or scenario file (.toml), a trace (.npz, .csv), or the "
        "name of an included chart or scenario; one with laws as gms:signed.",
        show_default=False,
    ),
]


def diff_command(
    first: Compared,
    second: Compared,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Picture of the second chart with the changes, ending in {chart}.",
        ),
    ] = None,
    contact: ContactName = "",
    run: Annotated[
        bool,
        typer.Option(
            "--run/--no-run", help="Whether two scenarios that differ are run until they differ."
        ),
    ] = True,
) -> None:
    """Compare two charts, scenarios or runs: what differs, and whether it makes a difference.

    The exit code is 0 if they are equal or equivalent, 1 if they are different,
    2 if that is undecided.
    """
    kinds = [Path(each).suffix.lower() in TRACES for each in (first, second)]
    if all(kinds):
        found = _runs(first, second, output, contact)
    elif any(kinds):
        raise ParameterError(
            "one of them is a trace", place="diff", advice="give two traces, or two other files"
        )
    else:
        found = _files(first, second, output, contact, run)
    say(found.text)
    if output is not None:
        put(str(output))
    if not found.equivalent:
        raise typer.Exit(DIFFERENT if found.verdict == "different" else UNDECIDED)


def _runs(first: str, second: str, output: Path | None, contact: str) -> Diff:
    """Compare two traces."""
    from gms_fsm import Trace, diff

    for option, given in (("--output", output), ("--contact", contact)):
        if given:
            raise ParameterError("it is for charts", place=option, advice="leave it out")
    return diff(Trace.load(first), Trace.load(second), names=(first, second))


def _files(first: str, second: str, output: Path | None, contact: str, run: bool) -> Diff:
    """Compare two files, or charts of the package."""
    from gms_fsm import diff
    from gms_fsm.app._own_files import own_file
    from gms_fsm.difference.scenarios import with_settings

    names = (first, second)
    own = [own_file(each) for each in names]
    one, other = own
    systems = [each.system for each in own if each is not None and each.system is not None]
    if output is not None or contact or len(systems) < len(own):
        charts = [_chart(name, each, contact) for name, each in zip(names, own, strict=True)]
        if output is not None:
            import plots

            plots.render(plots.chart_diff(*charts), output)
    if contact or len(systems) < len(own):
        return diff(charts[0], charts[1], names=names)
    assert one is not None
    assert other is not None
    found = diff(systems[0], systems[1], names=names)
    found = with_settings(found, one.run, other.run, systems[1])
    if found.equivalent or not run or not one.run or not other.run:
        return found
    return _run(found, one, other)


def _run(found: Diff, one: OwnFile, other: OwnFile) -> Diff:
    """Run two scenarios, and return where their runs first differ."""
    from gms_fsm.app.scenario import load_scenario
    from gms_fsm.difference.diff import with_runs

    try:
        traces = [load_scenario(each.path).simulate() for each in (one, other)]
    except GMSError as error:
        raise error.inside(f"{one.path} or {other.path}") from None
    return with_runs(found, traces[0], traces[1])


def _chart(name: str, own: OwnFile | None, contact: str) -> Chart:
    """Return the chart of a file, or one of the package: ``lugre``, ``gms:signed``."""
    from gms_fsm.app.verbs.catalogue import chosen
    from gms_fsm.app.verbs.charts import no_contact
    from gms_fsm.charts.registry import registered

    no_contact(contact, own)
    if own is not None:
        return own.only_chart(contact)
    start, _, law = name.rpartition(":")
    named = start if start in registered() else name
    law = law if named == start else ""
    laws = registered()[named].laws if named in registered() else ()
    if laws and law not in laws:
        raise ParameterError(
            f"{named} has no law {law!r}" if law else f"{named} has several laws",
            place="diff",
            advice=f"write {' or '.join(f'{named}:{each}' for each in laws)}",
        )
    return chosen("diff", named, law)[1]
