"""The verb cover: what runs have tried of their charts, and what not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gms_fsm.app.verbs.console import note, put, say
from gms_fsm.app.verbs.options import INTERRUPTED, ContactName, Overrides
from gms_fsm.errors import GMSError, OutputError, ParameterError
from gms_fsm.foundation.files import file_lock, refuse_input

if TYPE_CHECKING:
    from gms_fsm import Coverage
    from gms_fsm.app.sweeps import Axis
    from gms_fsm.traces.coverage.counts import ChartCoverage


def cover_command(
    scenarios: Annotated[
        list[Path],
        typer.Argument(
            help="Scenario files, names of scenarios of the package, or saved traces (.npz, .csv); "
            "all of the same charts. With --generate one of these, a system file, a chart file, or "
            "an included chart.",
            show_default=False,
        ),
    ],
    merge: Annotated[
        Path | None,
        typer.Option(
            help="File of counts (.json): those in it are added, and the sum is written to it."
        ),
    ] = None,
    fail_under: Annotated[
        float | None,
        typer.Option(
            "--fail-under",
            min=0.0,
            max=100.0,
            help="Exit with 1 if states, edges, clauses or MC/DC are below so many percent.",
            show_default=False,
        ),
    ] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            help="Parameter to vary in all scenarios, as name=from:to:count, as for `sweep`.",
            show_default=False,
        ),
    ] = None,
    overrides: Overrides = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Picture of the chart, ending in {chart}: lines are the wider the more often an "
            "edge was taken, and dashed if never. With --generate the folder for the motions.",
            show_default=False,
        ),
    ] = None,
    contact: ContactName = "",
    generate: Annotated[
        bool,
        typer.Option(
            "--generate",
            help="Find motions that take every edge and every pair of edges that can be taken.",
        ),
    ] = False,
    seed: Annotated[
        int | None,
        typer.Option(help="Of the search, for --generate; by default 0.", show_default=False),
    ] = None,
    bounds: Annotated[
        list[str] | None,
        typer.Option(
            help="For --generate, as v=-0.1..0.1; may be repeated. By default from the chart.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Run scenarios and say what of their charts was never taken, and why not.

    Counts states, edges from each of their sources, clauses of guards, true
    and false, and MC/DC: clauses that decided a guard alone. With --merge
    the counts of several calls add up. With --contact only this one is
    judged and told; the file of counts has all. --generate makes the
    scenarios: few short motions that try all that can be tried.
    """
    if generate:
        _refuse({"--merge": merge, "--over": over, "--set": overrides}, "makes its own runs")
        told = _generated(scenarios, contact, seed or 0, bounds or [], output)
    else:
        _refuse({"--seed": seed, "--bounds": bounds}, "is for --generate", own=True)
        told = _told(scenarios, overrides or [], over or [], merge, output, contact)
    name, percent = told.lowest
    if fail_under is not None and percent < fail_under:
        say(f"the lowest is {name}: {percent:.1f} %, below {fail_under:g} %")
        raise typer.Exit(1)


def _told(
    scenarios: Sequence[Path],
    overrides: Sequence[str],
    over: Sequence[str],
    merge: Path | None,
    output: Path | None,
    contact: str,
) -> Coverage:
    """Run scenarios, tell what they tried, and return it."""
    from gms_fsm import Coverage
    from gms_fsm.app.sweeps import axis
    from plots.output import formats

    axes = [axis(text) for text in over]
    for path in filter(None, (merge, output)):  # before anything runs
        refuse_input(path, *scenarios)
        if not path.parent.is_dir():
            raise OutputError(
                f"there is no folder {path.parent}", place=str(path), advice="create it first"
            )
    if output is not None:
        formats.chosen(output, "graph", "chart")
    if merge is not None and merge.exists():
        Coverage.load(merge)  # a damaged one is refused
    total: Coverage | None = None
    try:
        for path in scenarios:
            total = _sum(total, _counted(path, overrides, axes), path)
    except KeyboardInterrupt:
        note("interrupted; nothing was written")
        raise typer.Exit(INTERRUPTED) from None
    assert total is not None  # there is at least one
    if merge is not None:
        total = added(total, merge)
    part = _part(total, contact) if output is not None or contact else None
    told = total if part is None or not contact else Coverage({contact: part})
    put(str(told))
    if merge is not None:
        put(str(merge))
    if output is not None and part is not None:
        import plots

        put(str(plots.render(plots.statechart(part.chart, counts=part), output)))
    return told


def added(found: Coverage, path: Path) -> Coverage:
    """Add counts to those in a file, and return the sum; several of these at once lose none."""
    from gms_fsm import Coverage

    with file_lock(path) as there:
        total = _sum(found, Coverage.load(path), path) if there else found
        total.save(path)
    return total


def _refuse(given: Mapping[str, object], why: str, own: bool = False) -> None:
    """Refuse options that are for other calls."""
    for option, value in given.items():
        if value is not None:
            said = f"it {why}" if own else f"--generate {why}"
            raise ParameterError(said, place=option, advice=f"leave {option} out")


def _generated(
    given: Sequence[Path], contact: str, seed: int, bounds: Sequence[str], folder: Path | None
) -> Coverage:
    """Make motions, tell what they reach, and save them."""
    from gms_fsm import generate
    from gms_fsm.app._own_files import contacts_error, own_file
    from gms_fsm.charts.registry import chart_named

    if len(given) > 1:
        raise ParameterError(
            "--generate takes one chart", place=str(given[1]), advice="call it for each"
        )
    name, limits = str(given[0]), dict(map(_bound, bounds))
    own = own_file(name)
    what: Any = chart_named(name) if own is None else own.chart or own.system
    if own is None and contact:
        raise ParameterError(
            "an included chart has no contacts",
            place=f"--contact {contact}",
            advice="leave --contact out",
        )
    if own is not None and own.system is not None and len(own.system.machines) > 1 and not contact:
        raise contacts_error(own.path, [each.name for each in own.system.machines], "give")
    found = generate(what, contact, seed=seed, bounds=limits)
    put(str(found))
    for path in [] if folder is None else found.save(folder):
        put(str(path))
    return found.coverage


def _bound(text: str) -> tuple[str, tuple[float, float]]:
    """Return the bounds that an option gives."""
    name, _, pair = text.partition("=")
    try:
        low, high = map(float, pair.split(".."))
    except ValueError:
        raise ParameterError(
            "give it as name=low..high, for example v=-0.1..0.1", place=f"--bounds {text}"
        ) from None
    return name.strip(), (low, high)


def _counted(path: Path, overrides: Sequence[str], axes: Sequence[Axis]) -> Coverage:
    """Return what the run, or the runs, of one file have tried."""
    from gms_fsm import Trace, coverage
    from gms_fsm.app.scenario import load_scenario
    from gms_fsm.app.sweeps import swept
    from gms_fsm.scenarios import scenario_path
    from gms_fsm.traces.failures import SimulationError

    if scenario_path(path).suffix in (".npz", ".csv"):
        if overrides or axes:
            raise ParameterError(
                "it is a trace, whose run cannot be changed",
                place=str(path),
                advice="give its scenario, or leave --set and --over out",
            )
        return coverage(Trace.load(path))
    loaded = load_scenario(path, overrides)
    if axes:
        return coverage(swept(loaded, axes, coverage=True))
    try:
        return coverage(loaded.simulate(monitors=(), t_eval=None))
    except SimulationError as error:
        failed = error.replaced(kept="").inside(path)
        note(f"{failed}; it counts as far as it came")
        return coverage(error.trace)


def _sum(found: Coverage | None, other: Coverage, path: Path) -> Coverage:
    """Return the sum; an error names the file that does not fit."""
    try:
        return other if found is None else found + other
    except GMSError as error:
        raise error.inside(path) from None


def _part(found: Coverage, contact: str) -> ChartCoverage:
    """Return the counts of one chart: the one chosen, or the only one."""
    if not contact and len(found.parts) > 1:
        names = [*found.parts]
        raise ParameterError(
            f"there are the charts of {', '.join(names)}",
            place="-o",
            advice=f"say which one to draw: --contact {names[0]}",
        )
    try:
        return found.contact(contact)
    except GMSError as error:
        raise error.inside(f"--contact {contact}") from None
