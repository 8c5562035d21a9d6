"""Verbs that show a run: figures, an animation, a replay page, a live page."""

from __future__ import annotations

import math
import warnings
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gms_fsm.app.verbs.console import messages, progress_bars, put
from gms_fsm.app.verbs.options import (
    ContactName,
    End,
    OutputFolder,
    Overrides,
    PresetName,
    Start,
    TraceFile,
)
from gms_fsm.errors import GMSError, ParameterError, TraceFileError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.foundation.files import output_folder, refuse_input
from gms_fsm.scenarios import shipped

if TYPE_CHECKING:
    from gms_fsm import Chart, Trace


def _of_contact(path: Path, contact: str) -> Trace:
    """Return a saved run as one contact sees it: the one chosen, or the only one."""
    from gms_fsm.app._own_files import contacts_error

    run = _loaded(path)
    if not run.contacts:
        raise ParameterError(
            "it has supervisors and no contact, whose force is shown",
            place=str(path),
            advice=f"`gms-fsm replay {path}` steps through it, and `gms-fsm chart` with its "
            "system's file draws a chart",
        )
    if contact and contact not in run.contacts:
        raise unknown("contact", contact, run.contacts).inside(path)
    if not contact and len(run.contacts) > 1:
        raise contacts_error(path, run.contacts, "say which one to show:")
    return run.contact(contact or run.contacts[0])


def _loaded(path: Path) -> Trace:
    from gms_fsm import Trace
    from gms_fsm.scenarios import scenario_path

    if scenario_path(path).suffix == ".toml":
        raise TraceFileError(
            "it is not a trace",
            place=str(path),
            advice=f"run it first: `gms-fsm run {path}`, then give out/{path.stem}/trace.npz",
        )
    return Trace.load(path)


def _notes(path: Path) -> dict[float | str, str]:
    """Return notes from a file: its keys are times or names of edges, its values texts."""
    from gms_fsm.foundation.toml import data_of, text_of

    found: dict[float | str, str] = {}
    for key, value in data_of(text_of(path, ParameterError), path, ParameterError).items():
        # 2.5 without quotes is a table of TOML.
        parts = value if isinstance(value, dict) else {"": value}
        for part, text in parts.items():
            when = f"{key}.{part}" if part else key
            try:
                found[float(when)] = text
            except ValueError:
                found[when] = text
    return found


def _window(run: Trace, start: float | None, end: float | None) -> tuple[float, float] | None:
    """Return the part of a run to show; None for the whole run."""
    if start is None and end is None:
        return None
    return (
        float(run.t[0]) if start is None else start,
        float(run.t[-1]) if end is None else end,
    )


def plot_command(
    trace: TraceFile,
    output: OutputFolder = Path("figures"),
    start: Start = None,
    end: End = None,
    contact: ContactName = "",
    preset: PresetName = "screen",
) -> None:
    """Draw a run: an overview, and its break-aways in detail."""
    import plots
    from plots import figures
    from plots.output import formats

    run = _of_contact(trace, contact)
    files = [formats.files(name, "figure") for name in ("overview", "ribbons")]
    folder = output_folder(output, chain(*files))
    window = _window(run, start, end)
    with plots.preset(preset):
        overview = figures.overview(run, window=window)
        pictures = (overview, figures.ribbons_figure(run, window=window))
    for figure, names in zip(pictures, files, strict=True):
        for name in names:
            put(str(figures.save(figure, folder / name)))


def animate_command(
    trace: TraceFile,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Output file, ending in {animation}.")
    ] = Path("film.gif"),
    frames: Annotated[int | None, typer.Option(help="Number of frames; usually 200.")] = None,
    seconds: Annotated[
        float | None, typer.Option(help="Length of the film, instead of --frames.")
    ] = None,
    fps: Annotated[float, typer.Option(help="Frames per second, at most 50.")] = 20.0,
    start: Start = None,
    end: End = None,
    contact: ContactName = "",
) -> None:
    """Make a film of a run: chart, bristles, force and states, slowed at transitions."""
    from gms_fsm.traces.views import files_of
    from plots.film.animation import animate

    refuse_input(output, *files_of(trace))
    run = _of_contact(trace, contact)
    with progress_bars() as bar:
        task = bar.add_task("frames", total=frames)

        def show(done: int, count: int) -> None:
            bar.start()
            bar.update(task, completed=done, total=count)

        film = animate(
            run,
            output,
            frames=frames,
            seconds=seconds,
            fps=fps,
            t_start=start,
            t_end=end,
            progress=show,
        )
    put(str(film))


def replay_command(
    trace: TraceFile,
    other: Annotated[
        Path | None, typer.Argument(help="Second trace, shown alongside the first.")
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Output file, ending in {page}.")
    ] = Path("replay.html"),
    title: Annotated[str, typer.Option(help="Title of the page.")] = "",
    start: Start = None,
    end: End = None,
    contact: ContactName = "",
    check: Annotated[
        bool, typer.Option("--check", help="Pin the counterexamples of `gms-fsm check`.")
    ] = False,
    notes: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A lecturer's notes (.toml): a time in s, or an edge, and the text for it.",
        ),
    ] = None,
) -> None:
    """Write a run as a web page in which it can be stepped through and explained."""
    from gms_fsm import prove
    from gms_fsm.traces.views import files_of
    from plots import write_replay

    files = [trace] if other is None else [trace, other]
    given = [] if notes is None else [notes]
    refuse_input(output, *chain(*map(files_of, files)), *given)
    runs = [_of_contact(each, contact) if contact else _loaded(each) for each in files]
    names = [] if other is None else [each.stem for each in files]
    charts: list[Chart] = []
    for view in (run.contact(name) for run in runs for name in run.contacts):
        if view.model.chart not in charts:
            charts.append(view.model.chart)
    reports = [prove(chart) for chart in charts] if check else []
    window = _window(runs[0], start, end)
    told = {} if notes is None else _notes(notes)
    page = write_replay(
        output, *runs, title=title, names=names, window=window, checks=reports, notes=told
    )
    put(str(page))


def play_command(
    scenario: Annotated[
        Path | None,
        typer.Argument(
            help="Scenario file, or the name of one of the package (`gms-fsm run --list`).",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Output file, ending in {page}; NAME.html by default."),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help="A slider to show first, as name=lowest..highest, such as F_s=0.5..3, or by its "
            "name. Repeat the option for others.",
        ),
    ] = None,
    overrides: Overrides = None,
    title: Annotated[str, typer.Option(help="Title of the page.")] = "",
    every: Annotated[
        bool,
        typer.Option(
            "--all", help="All scenarios of the package; -o is a folder, play by default."
        ),
    ] = False,
) -> None:
    """Write a scenario as a live page: sliders compute the run again, in the browser."""
    if every != (scenario is None):
        raise typer.BadParameter("give a scenario, or --all", param_hint="SCENARIO")
    if scenario is not None:
        _write(
            scenario, output or Path(f"{scenario.stem}.html"), vary or [], overrides or [], title
        )
        return
    folder = output or Path("play")
    folder.mkdir(parents=True, exist_ok=True)
    for name in shipped():
        try:
            _write(Path(name), folder / f"{name}.html", [], [], "")
        except GMSError as error:  # its record is elsewhere, or its method is not one of ours
            warnings.warn(f"no page of {name}: {error}", stacklevel=2)


def _write(scenario: Path, output: Path, vary: list[str], overrides: list[str], title: str) -> None:
    from gms_fsm.app.scenario import load_scenario
    from plots import play
    from plots.output import formats

    formats.chosen(output, "page")  # before any work
    loaded = load_scenario(scenario, overrides)
    refuse_input(output, *loaded.inputs)
    given: dict[str, Any] = dict(loaded.arguments)
    for name in ("t_end", "t_eval", "engine", "monitors"):
        given.pop(name, None)
    ranges = dict(map(_range, vary))
    with messages().status(f"writing {output}"):
        page = play(*loaded.subject, vary=ranges, title=title or loaded.title, **given)
        page.save(output)
    put(str(output))


def _range(text: str) -> tuple[str, tuple[float, float] | None]:
    """Return a name and its range, of ``F_s=0.5..3`` or ``F_s``."""
    name, given, ends = text.partition("=")
    if not given:
        return name.strip(), None
    low, _, high = ends.partition("..")
    try:
        found = float(low), float(high)
    except ValueError:
        found = math.nan, math.nan
    if not all(map(math.isfinite, found)):
        raise ParameterError(
            "it must be a name and a range, such as F_s=0.5..3", place="--vary", value=text
        )
    return name.strip(), found
