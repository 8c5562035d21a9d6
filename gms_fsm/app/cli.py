"""The command line: one verb an experiment. A user's mistake is one message and exit code 2.

A verb imports what it needs when it runs, so that help, completion and mistakes answer at once.
"""

from __future__ import annotations

import contextlib
import enum
import json
import sys
import textwrap
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

import gms_fsm
from gms_fsm._files import output_folder, refuse_input, write_whole
from gms_fsm.app.paper import FORCE, VELOCITY
from gms_fsm.errors import GMSError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, TaskID

    from gms_fsm import Report, Rig

__all__ = ["app", "main"]

LAW = "Law of a chart that has several, such as gms; there is no default, they differ."
INTERRUPTED = 130  # the exit code of what Ctrl-C has ended, by custom


@dataclass
class Wishes:
    """What the options before the verb ask for."""

    debug: bool = False


class _Verbs(TyperGroup):
    """The verbs; ``--debug`` may stand before or behind one."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        options = args[: args.index("--")] if "--" in args else args
        if "--debug" in options:
            args = ["--debug", *(a for a in options if a != "--debug"), *args[len(options) :]]
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:  # pydantic's words, as newer versions of typer pass on
            error.message = error.message.removeprefix("Value error, ")
            raise


class _Drawing(TyperCommand):
    """A verb whose help names endings: ``{chart}`` stands for those of charts, and so on."""

    def get_params(self, ctx: Any) -> Any:
        from plots import formats

        params = super().get_params(ctx)
        listed: dict[str, str] = {each: formats.listed(each) for each in get_args(formats.Subject)}
        listed["chart"] = formats.listed("graph", "chart")
        for param in params:
            if isinstance(param, TyperOption) and param.help:
                param.help = param.help.format(**listed)
        return params


app = typer.Typer(
    name="gms-fsm",
    cls=_Verbs,
    help="Friction as an explicit state machine: the Generalized Maxwell Slip model.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)


class RigName(enum.StrEnum):
    """What the friction is mounted on."""

    prescribed = "prescribed"
    slider = "slider"
    pulled = "pulled"


class EngineName(enum.StrEnum):
    """What runs the chart."""

    compiled = "compiled"
    machines = "machines"
    ifelse = "ifelse"


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"gms-fsm {gms_fsm.__version__}")
        raise typer.Exit


@app.callback()
def root(
    context: typer.Context,
    _asked: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Answer a mistake with the traceback and its causes.")
    ] = False,
) -> None:
    """Friction as an explicit state machine: the Generalized Maxwell Slip model."""
    context.ensure_object(Wishes).debug = debug


def _messages(**options: Any) -> Console:
    """Return where messages and progress go, beside the results."""
    from rich.console import Console

    return Console(stderr=True, **options)


@contextlib.contextmanager
def _progress(*columns: Any) -> Iterator[Progress]:
    """Give progress bars that whoever has something to show starts: none before an error."""
    from rich.progress import Progress

    bars = Progress(*columns or Progress.get_default_columns(), console=_messages())
    try:
        yield bars
    finally:
        if bars.live.is_started:
            bars.stop()


@app.command("paper")
def paper_command(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for everything that is written.")
    ] = Path("paper"),
    force: Annotated[
        str, typer.Option(help="Applied force of Fig. 3 (N), an expression of t (s).")
    ] = FORCE,
    velocity: Annotated[
        str, typer.Option(help="Velocity of Fig. 4 (m/s), an expression of t (s).")
    ] = VELOCITY,
) -> None:
    """Run the paper's two experiments; write figures, traces, logs and claims.md."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn

    from gms_fsm.app.paper import writing

    columns = (TextColumn("{task.description:<22}"), BarColumn(), TimeElapsedColumn())
    with _progress(*columns) as bars:
        tasks: dict[str, TaskID] = {}

        def show(name: str, done: float) -> None:
            if name not in tasks:
                bars.start()
                tasks[name] = bars.add_task(name, total=1.0)
            bars.update(tasks[name], completed=done)

        files = writing.write(output, force, velocity, show)
    typer.echo(f"{len(files)} files in {output}; start with {files[0]}")


@app.command("run")
def run_command(
    scenario: Annotated[
        Path,
        typer.Argument(
            help="A scenario file, such as scenarios/pulled_mass.toml.", show_default=False
        ),
    ],
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
    checkpoint: Annotated[
        bool,
        typer.Option(
            "--checkpoint",
            help="Keep the state in the folder once a minute; the same command goes on from it.",
        ),
    ] = False,
) -> None:
    """Run a scenario; write trace, transition log, overview figure and summary."""
    from gms_fsm.app.live import LiveView
    from gms_fsm.app.report import monitor_lines, run_scenario, velocity_note
    from gms_fsm.app.scenario import load_scenario
    from gms_fsm.inspection.notes import notes_on

    loaded = load_scenario(scenario, overrides or [])
    folder = Path("out") / scenario.stem if output is None else output
    start, end = loaded.arguments["t_start"], loaded.arguments["t_end"]
    try:
        with LiveView(_messages(), start, end, detail=live) as view:
            trace, files = run_scenario(loaded, folder, view, checkpoint=checkpoint)
    except KeyboardInterrupt as error:
        _plain_warning(str(error) or "interrupted")
        raise typer.Exit(INTERRUPTED) from None
    if loaded.motion is not None and (note := velocity_note(trace, loaded.motion)):
        _plain_warning(note)
    typer.echo(f"{len(trace.transitions)} transitions; {len(files)} files in {folder}")
    for line in monitor_lines(trace):
        typer.echo(line)
    for note in notes_on(trace):
        typer.echo(f"note: {note}")
    typer.echo(f"start with {files[0]}")


@app.command("sweep")
def sweep_command(
    scenario: Annotated[
        Path,
        typer.Argument(
            help="A scenario file, such as scenarios/pulled_mass.toml.", show_default=False
        ),
    ],
    over: Annotated[
        list[str],
        typer.Option(
            help="What to vary: name=from:to:count, with ,log behind it for even steps of the "
            "logarithm; given again, every combination is run.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Folder for what is written; out/<name>-sweep if left out."
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", help="Change a key, for example --set model.law=published."),
    ] = None,
    engine: Annotated[
        EngineName, typer.Option(help="All give the same numbers; compiled is the fast one.")
    ] = EngineName.compiled,
) -> None:
    """Run a scenario over a grid of parameters; write all results and a summary table."""
    from gms_fsm.app.scenario import load_scenario
    from gms_fsm.app.sweeps import axis, failures, sweep_scenario

    axes = [axis(text) for text in over]
    loaded = load_scenario(scenario, overrides or [])
    folder = Path("out") / f"{scenario.stem}-sweep" if output is None else output
    if "monitors" in loaded.arguments:
        _plain_warning("a sweep watches nothing: run.monitors is left out")
    try:
        result, files = sweep_scenario(loaded, axes, folder, engine=engine.value)
    except KeyboardInterrupt:
        _plain_warning("interrupted; nothing is written")
        raise typer.Exit(INTERRUPTED) from None
    bad = int((result.outcome != "ok").sum())
    typer.echo(
        f"{len(result)} runs, {bad} failed, {len(result.transitions)} transitions; "
        f"{len(files)} files in {folder}"
    )
    for run, message in failures(result, most=1):
        typer.echo(f"first failure: run {run}: {message}")
    typer.echo(f"start with {files[0]}")


@app.command("schema")
def schema_command() -> None:
    """Print the JSON schema of scenario files, for editors."""
    from gms_fsm.app.scenario import Scenario

    typer.echo(json.dumps(Scenario.model_json_schema(), indent=2))


class Notation(enum.StrEnum):
    """How guards are written."""

    stateflow = "stateflow"
    math = "math"


class Direction(enum.StrEnum):
    """Where a chart grows."""

    TB = "TB"
    LR = "LR"


class Theme(enum.StrEnum):
    """Colours of a chart."""

    light = "light"
    dark = "dark"


@app.command("chart", cls=_Drawing)
def chart_command(
    name: Annotated[
        str, typer.Argument(help="Which chart; --list names all.", show_default=False)
    ] = "",
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Ends in {chart}."),
    ] = Path("chart.svg"),
    law: Annotated[str, typer.Option(help=LAW, show_default=False)] = "",
    elements: Annotated[int, typer.Option(help="How many elements, as parallel states.")] = 1,
    notation: Annotated[Notation, typer.Option(help="Spelling.")] = Notation.stateflow,
    direction: Annotated[Direction, typer.Option(help="Layout.")] = Direction.TB,
    theme: Annotated[Theme, typer.Option(help="Colours.")] = Theme.light,
    names: Annotated[bool, typer.Option("--names", help="Write the edges' names too.")] = False,
    listed: Annotated[
        bool, typer.Option("--list", help="List the charts, with their parameters.")
    ] = False,
) -> None:
    """Draw a state chart, or list those that ship."""
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


@app.command("check")
def check_command(
    name: Annotated[
        str, typer.Argument(help="Which chart; --list names all.", show_default=False)
    ] = "",
    law: Annotated[str, typer.Option(help=LAW, show_default=False)] = "",
    domain: Annotated[
        list[str] | None,
        typer.Option(help="Assume this instead, for example 's >= 0'; may be given again."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for the report and the charts, marked."),
    ] = None,
    names: Annotated[bool, typer.Option("--list", help="Say what can be checked.")] = False,
) -> None:
    """Prove a chart free of contradictions, or refute it by an example; then exit with 1.

    What the order of the edges settles is said, and is no refutation.
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
    """Write a report, and a chart with the place marked for what is refuted or settled by order."""
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
        what = ", ".join(part for part in (finding.check, finding.case, settled) if part)
        note = textwrap.wrap(f"{what}: {finding.text}", 50)
        note += textwrap.wrap(finding.example, 50)
        graph = plots.statechart(report.chart, marked=marked, note="\n".join(note))
        for ending in formats.endings("graph", usual=True):
            written.append(plots.render(graph, folder / f"{stem}{ending}"))
    return list(dict.fromkeys(written))


@app.command("blocks", cls=_Drawing)
def blocks_command(
    output: Annotated[Path, typer.Option("--output", "-o", help="Ends in {graph}.")] = Path(
        "blocks.svg"
    ),
    elements: Annotated[int, typer.Option(help="How many elements.")] = 4,
) -> None:
    """Draw the block diagram of the whole model (the paper's Fig. 2a)."""
    import plots

    typer.echo(str(plots.render(plots.block_diagram(elements), output)))


@app.command("plot")
def plot_command(
    trace: Annotated[Path, typer.Argument(help="A trace, .npz or .csv.", show_default=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder.")] = Path("figures"),
    start: Annotated[float | None, typer.Option(help="From t (s).")] = None,
    end: Annotated[float | None, typer.Option(help="To t (s).")] = None,
) -> None:
    """Draw a run: overview, and the story of its break-aways."""
    from gms_fsm import Trace
    from plots import figures, formats

    run = Trace.load(trace)
    files = [formats.files(name, "figure") for name in ("overview", "ribbons")]
    folder = output_folder(output, chain(*files))
    window = None
    if start is not None or end is not None:
        window = (
            float(run.t[0]) if start is None else start,
            float(run.t[-1]) if end is None else end,
        )
    pictures = (figures.overview(run, window=window), figures.ribbons_figure(run, window=window))
    for figure, names in zip(pictures, files, strict=True):
        for name in names:
            typer.echo(str(figures.save(figure, folder / name)))


@app.command("animate", cls=_Drawing)
def animate_command(
    trace: Annotated[Path, typer.Argument(help="A trace, .npz or .csv.", show_default=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="Ends in {animation}.")] = Path(
        "film.gif"
    ),
    frames: Annotated[int, typer.Option(help="How many pictures.")] = 200,
    start: Annotated[float | None, typer.Option(help="From t (s).")] = None,
    end: Annotated[float | None, typer.Option(help="To t (s).")] = None,
) -> None:
    """Make a film of the chart at work, beside the force."""
    from gms_fsm.traces.trace import Trace, files_of
    from plots.animation import animate

    refuse_input(output, *files_of(trace))
    run = Trace.load(trace)
    with _progress() as bar:
        task = bar.add_task("frames", total=frames)

        def show(done: int, _: int) -> None:
            bar.start()
            bar.update(task, completed=done)

        film = animate(run, output, frames=frames, t_start=start, t_end=end, progress=show)
    typer.echo(str(film))


@app.command("replay", cls=_Drawing)
def replay_command(
    trace: Annotated[Path, typer.Argument(help="A trace, .npz or .csv.", show_default=False)],
    other: Annotated[Path | None, typer.Argument(help="A second one, shown beside it.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="The page, {page}.")] = Path(
        "replay.html"
    ),
    title: Annotated[str, typer.Option(help="Of the page.")] = "",
) -> None:
    """Write a run as one web page that is stepped, scrubbed and explained."""
    from gms_fsm.traces.trace import Trace, files_of
    from plots import write_replay

    refuse_input(output, *files_of(trace), *([] if other is None else files_of(other)))
    second = None if other is None else Trace.load(other)
    names = [] if other is None else [trace.stem, other.stem]
    page = write_replay(output, Trace.load(trace), second, title=title, names=names)
    typer.echo(str(page))


@app.command("debug")
def debug_command(
    scenario: Annotated[
        Path,
        typer.Argument(
            help="A scenario file, such as scenarios/pulled_mass.toml.", show_default=False
        ),
    ],
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", help="Change a key, for example --set model.law=published."),
    ] = None,
) -> None:
    """Step through a scenario at the terminal: break, why, back, poke, compare."""
    from gms_fsm.app.debugger import run_debugger, scenario_to_debug

    raise typer.Exit(run_debugger(scenario_to_debug(scenario, overrides or [])))


@app.command("lesson")
def lesson_command(
    number: Annotated[
        str, typer.Argument(help="Which one; left out, all are listed.", show_default=False)
    ] = "",
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder.")] = Path("lessons"),
) -> None:
    """Run a lesson: a picture, a replay page, and five lines with the measured figures."""
    from gms_fsm.app.lessons import listed, numbered, teach

    if not number:
        typer.echo(listed())
        return
    chosen = numbered(number)
    with _messages().status(f"running lesson {chosen}"):
        taught = teach(chosen, output)
    for line in taught.lines:
        typer.echo(line)
    typer.echo()
    for path in taught.files:
        typer.echo(str(path))


@app.command("code")
def code_command(
    name: Annotated[str, typer.Argument(help="Which chart.")] = "gms",
    law: Annotated[str, typer.Option(help=LAW, show_default=False)] = "",
    rig: Annotated[RigName, typer.Option(help="What the friction is mounted on.")] = (
        RigName.prescribed
    ),
) -> None:
    """Print the if-else program made from a chart (the paper's Fig. 2c); it runs alone."""
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


def main() -> None:
    """Run the command line; print a user's mistake as one message and exit with code 2."""
    warnings.showwarning = _plain_warning
    wishes = Wishes()
    try:
        app(obj=wishes)
    except GMSError as error:
        if wishes.debug:
            _with_causes(error)
            raise
        told = "\n".join([str(error), *getattr(error, "__notes__", ())])
        _messages(soft_wrap=True).print(
            f"[bold red]error:[/] {_escaped(told)}", highlight=False, emoji=False
        )
        sys.exit(2)


def _with_causes(error: BaseException | None) -> None:
    """Have a traceback show what an error was made from; to a user that says nothing."""
    while error is not None:
        error.__suppress_context__ = False
        error = error.__context__


def _escaped(text: str) -> str:
    """Return a text as it is, neither markup nor a terminal's control codes."""
    from rich.markup import escape

    printable = (c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)
    return escape("".join(printable))


def _plain_warning(message: Warning | str, *_: object, **__: object) -> None:
    _messages(soft_wrap=True).print(
        f"[bold yellow]note:[/] {_escaped(str(message))}", highlight=False, emoji=False
    )
