"""The verb cover: what runs have tried of their charts, and what not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gms_fsm.app.verbs.console import note, put, say
from gms_fsm.app.verbs.options import INTERRUPTED, ContactName, Overrides
from gms_fsm.errors import GMSError, OutputError, ParameterError
from gms_fsm.foundation.files import refuse_input

if TYPE_CHECKING:
    from gms_fsm import Coverage
    from gms_fsm.app.sweeps import Axis
    from gms_fsm.traces.coverage.counts import ChartCoverage


def cover_command(
    scenarios: Annotated[
        list[Path],
        typer.Argument(
            help="Scenario files, names of scenarios of the package, or saved traces (.npz, .csv); "
            "all of the same charts.",
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
            "edge was taken, and dashed if never.",
            show_default=False,
        ),
    ] = None,
    contact: ContactName = "",
) -> None:
    """Run scenarios and say what of their charts was never taken, and why not.

    Counts states, edges from each of their sources, clauses of guards, true
    and false, and MC/DC: clauses that decided a guard alone. With --merge
    the counts of several calls add up. With --contact only this one is
    judged and told; the file of counts has all.
    """
    from gms_fsm import Coverage
    from gms_fsm.app.sweeps import axis
    from plots.output import formats

    axes = [axis(text) for text in over or []]
    for path in filter(None, (merge, output)):  # before anything runs
        refuse_input(path, *scenarios)
        if not path.parent.is_dir():
            raise OutputError(
                f"there is no folder {path.parent}", place=str(path), advice="create it first"
            )
    if output is not None:
        formats.chosen(output, "graph", "chart")
    before = Coverage.load(merge) if merge is not None and merge.exists() else None
    found: Coverage | None = None
    try:
        for path in scenarios:
            found = _sum(found, _counted(path, overrides or [], axes), path)
    except KeyboardInterrupt:
        note("interrupted; nothing was written")
        raise typer.Exit(INTERRUPTED) from None
    assert found is not None  # there is at least one
    if before is not None and merge is not None:
        found = _sum(found, before, merge)
    part = _part(found, contact) if output is not None or contact else None
    told = found if part is None or not contact else Coverage({contact: part})
    put(str(told))
    if merge is not None:
        put(str(found.save(merge)))
    if output is not None and part is not None:
        import plots

        put(str(plots.render(plots.statechart(part.chart, counts=part), output)))
    name, percent = told.lowest
    if fail_under is not None and percent < fail_under:
        say(f"the lowest is {name}: {percent:.1f} %, below {fail_under:g} %")
        raise typer.Exit(1)


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
