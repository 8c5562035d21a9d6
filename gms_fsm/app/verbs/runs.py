"""Verbs that run something: the paper's experiments, scenarios, sweeps, lessons, the debugger."""

from __future__ import annotations

import collections
import contextlib
import enum
import json
import math
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from gms_fsm.app.paper import FORCE, VELOCITY
from gms_fsm.app.verbs.console import messages, named_bar, note, opening, put, say
from gms_fsm.app.verbs.options import (
    INTERRUPTED,
    ContactName,
    OutputFolder,
    Overrides,
    PresetName,
    ScenarioFile,
)
from gms_fsm.errors import OutputError, ParameterError, SessionError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.foundation.files import write_text
from gms_fsm.scenarios import shipped, titles

SHOWN = 6  # multipliers
CYCLE_RTOL = 1e-10  # of the runs that Newton's method compares, at most


class EngineName(enum.StrEnum):
    """Engine that executes the chart."""

    compiled = "compiled"
    machines = "machines"
    ifelse = "ifelse"


def paper_command(
    output: OutputFolder = Path("paper"),
    force: Annotated[
        str, typer.Option(help="Applied force of Fig. 3 in N, an expression of t (s).")
    ] = FORCE,
    velocity: Annotated[
        str, typer.Option(help="Velocity of Fig. 4 in m/s, an expression of t (s).")
    ] = VELOCITY,
    preset: PresetName = "screen",
) -> None:
    """Run the paper's two experiments; write figures, traces, logs and claims.md."""
    import plots
    from gms_fsm.app.paper import writing

    with plots.preset(preset), named_bar() as show:
        files = writing.write(output, force, velocity, show)
    say(f"{len(files)} files in {output}; start with {files[0]}")


def _list(wanted: bool) -> None:
    if wanted:
        say("\n".join(f"{name:<24} {title}" for name, title in titles().items()))
        raise typer.Exit


def run_command(
    scenario: ScenarioFile,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Output folder; out/<name> by default."),
    ] = None,
    overrides: Overrides = None,
    live: Annotated[
        bool,
        typer.Option("--live", help="Show states, curves and transitions during the run."),
    ] = False,
    pace: Annotated[
        float | None,
        typer.Option(
            help="With --live: simulated seconds per second of the clock, such as 0.1.",
            show_default=False,
        ),
    ] = None,
    checkpoint: Annotated[
        bool,
        typer.Option(
            "--checkpoint",
            help="Save the state in the output folder once a minute; the same command resumes it.",
        ),
    ] = False,
    trust: Annotated[
        bool,
        typer.Option(
            "--trust",
            help="Repeat the run with a hundredth of the tolerances, and show all findings.",
        ),
    ] = False,
    preset: PresetName = "screen",
    _listed: Annotated[
        bool,
        typer.Option(
            "--list", callback=_list, is_eager=True, help="List the scenarios of the package."
        ),
    ] = False,
) -> None:
    """Run a scenario; write the trace, transition log, overview figure and summary."""
    import plots
    from gms_fsm.app.live import LiveView
    from gms_fsm.app.report import monitor_lines, run_scenario, trust_lines, velocity_note
    from gms_fsm.app.scenario import load_scenario

    if pace is not None and not live:
        raise typer.BadParameter("it is an option of --live", param_hint="--pace")
    if pace is not None and not 0.0 < pace < math.inf:
        raise typer.BadParameter(f"{pace:g} is not a positive number", param_hint="--pace")
    loaded = load_scenario(scenario, overrides or [])
    folder = Path("out") / scenario.stem if output is None else output
    start, end = loaded.arguments["t_start"], loaded.arguments["t_end"]
    try:
        view = LiveView(messages(), start, end, detail=live, pace=pace)
        with plots.preset(preset), view:
            trace, files = run_scenario(loaded, folder, view, checkpoint=checkpoint, again=trust)
    except KeyboardInterrupt as error:
        note(str(error) or "interrupted")
        raise typer.Exit(INTERRUPTED) from None
    if loaded.motion is not None and (text := velocity_note(trace, loaded.motion)):
        note(text)
    say(f"{len(trace.transitions)} transitions; {len(files)} files in {folder}")
    for line in monitor_lines(trace):
        say(line)
    for line in trust_lines(trace.trust(again=trust), every=trust):
        say(line)
    say(f"start with {files[0]}")


def copy_command(
    name: Annotated[
        str,
        typer.Argument(
            help="Scenario of the package; `gms-fsm run --list` shows all.", show_default=False
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File to write; NAME.toml by default."),
    ] = None,
) -> None:
    """Copy a scenario of the package to a file of your own, to change it."""
    known = shipped()
    if name not in known:
        raise unknown("scenario", name, known, ParameterError)
    path = Path(f"{name}.toml") if output is None else output
    if path.exists():
        raise OutputError(
            "there is a file of this name", place=str(path), advice="give another with -o"
        )
    write_text(path, known[name].read_text(encoding="utf-8"))
    say(f"{path}; run it with: gms-fsm run {path}")


def cycle_command(
    scenario: ScenarioFile,
    period: Annotated[
        float | None,
        typer.Option(
            help="Period of what drives the system, s; else where to begin.", show_default=False
        ),
    ] = None,
    overrides: Overrides = None,
) -> None:
    """Find the periodic motion that a scenario ends near, and say whether it is stable."""
    from gms_fsm import limit_cycle
    from gms_fsm.app.scenario import load_scenario
    from gms_fsm.foundation.extras import has_machine_code

    loaded = load_scenario(scenario, overrides or [])
    how = loaded.scenario.run.options()
    if isinstance(how["method"], str) and has_machine_code():
        how["engine"] = "compiled"
    near = loaded.simulate(**how, output="all", t_eval=None, monitors=())
    how["rtol"] = min(how["rtol"], CYCLE_RTOL)
    with loaded.blaming():
        found = limit_cycle(*loaded.subject[:-1], near=near, period=period, **how)
    word = "stable" if found.stable else "unstable"
    say(f"period      {found.period:.12g} s, {word}")
    for each in found.multipliers[:SHOWN]:
        angle = f" at {math.degrees(math.atan2(each.imag, each.real)):.4g} deg" if each.imag else ""
        say(f"multiplier  {abs(each):.6g}{angle}" if angle else f"multiplier  {each.real:.6g}")
    if (more := len(found.multipliers) - SHOWN) > 0:
        say(f"            and {more} smaller ones")
    say(f"the state returns to {found.residual:.2g} of its size, after {found.iterations} runs")
    energy = found.energy
    say(f"put in      {energy.put_in:.6g} J")
    for name, taken in (energy.contacts | energy.dampers).items():
        say(f"taken       {taken:.6g} J by {name}")
    log, start = found.trace.transitions, float(found.trace.t[0])
    for t, edge in zip((log.t - start).tolist(), log.edge.tolist(), strict=True):
        say(f"{t:12.9g} s  {edge}")


def sweep_command(
    scenario: ScenarioFile,
    over: Annotated[
        list[str],
        typer.Option(
            help="Parameter to vary, as name=from:to:count; append ,log for logarithmic spacing. "
            "Repeat the option to run every combination.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Output folder; out/<name>-sweep by default."),
    ] = None,
    overrides: Overrides = None,
    engine: Annotated[
        EngineName, typer.Option(help="All give the same numbers; compiled is the fastest.")
    ] = EngineName.compiled,
) -> None:
    """Run a scenario over a grid of parameters; write all results and a summary table."""
    from gms_fsm.app.scenario import load_scenario
    from gms_fsm.app.sweeps import axis, failures, sweep_scenario

    axes = [axis(text) for text in over]
    loaded = load_scenario(scenario, overrides or [])
    folder = Path("out") / f"{scenario.stem}-sweep" if output is None else output
    if "monitors" in loaded.arguments:
        note("a sweep has no monitors: run.monitors is ignored")
    try:
        result, files = sweep_scenario(loaded, axes, folder, engine=engine.value)
    except KeyboardInterrupt:
        note("interrupted; nothing was written")
        raise typer.Exit(INTERRUPTED) from None
    bad = int((result.outcome != "ok").sum())
    say(
        f"{len(result)} runs, {bad} failed, {len(result.transitions)} transitions; "
        f"{len(files)} files in {folder}"
    )
    for run, message in failures(result, most=1):
        say(f"first failure: run {run}: {message}")
    say(f"start with {files[0]}")
    if bad == len(result):
        raise typer.Exit(1)


def phenomena_command(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            help="Files of your own: system files, scenario files, or chart files with --value.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        list[str] | None,
        typer.Option(
            "--model",
            help="Included model, such as lugre or gms-signed; repeat for several. All by default.",
        ),
    ] = None,
    phenomenon: Annotated[
        list[str] | None,
        typer.Option(
            "--phenomenon", help="Such as lag or drift; repeat for several. All by default."
        ),
    ] = None,
    output: OutputFolder = Path("phenomena"),
    bench: Annotated[
        list[str] | None,
        typer.Option(
            "--set", help="Number of the bench, such as F_s=0.4: the signals follow these scales."
        ),
    ] = None,
    value: Annotated[
        list[str] | None,
        typer.Option("--value", help="Parameter of a chart file, such as F_c=1.0."),
    ] = None,
    contact: ContactName = "",
) -> None:
    """Measure which phenomena friction models show; write a table and figures."""
    from gms_fsm.app import phenomena as room
    from gms_fsm.phenomena.measure import Bench
    from gms_fsm.phenomena.results import VERDICTS

    own = room.own_models(files or (), contact, room.numbers_given("--value", value or []))
    models: dict[str, Any] | None = {**{name: name for name in model or ()}, **own} or None
    with named_bar() as show:
        numbers = Bench.of(room.numbers_given("--set", bench or []))
        table, written = room.write(output, models, phenomenon, bench=numbers, progress=show)
    counts = collections.Counter(cell.measured.verdict for cell in table)
    said = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
    models_said = "1 model" if len(table.models) == 1 else f"{len(table.models)} models"
    measured = len(table.phenomena)
    phenomena_said = "1 phenomenon" if measured == 1 else f"{measured} phenomena"
    say(f"{models_said}, {phenomena_said}: {said}")
    say(f"{len(written)} files in {output}; start with {written[0]}")


def schema_command() -> None:
    """Print the JSON schema of scenario files, for editors."""
    from gms_fsm.app.scenario import schema

    put(json.dumps(schema(), indent=2))


def debug_command(
    scenario: ScenarioFile,
    overrides: Overrides = None,
    tui: Annotated[
        bool, typer.Option("--tui", help="Use the whole terminal: panels, keys and mouse.")
    ] = False,
    light: Annotated[
        bool, typer.Option("--light", help="With --tui: dark text on a light ground.")
    ] = False,
) -> None:
    """Step through a scenario in the terminal: break, why, back, poke, compare."""
    if light and not tui:
        raise typer.BadParameter("it is an option of --tui", param_hint="--light")
    with opening("the debugger on the whole terminal") if tui else contextlib.nullcontext():
        from gms_fsm.app.scenario import load_scenario, run_debugger, session_of
        from gms_fsm.debugger.tui import run_tui

        loaded = load_scenario(scenario, overrides or [])
        if tui:
            raise typer.Exit(run_tui(session_of(loaded), loaded.title, light=light))
    raise typer.Exit(run_debugger(loaded))


def dap_command() -> None:
    """Serve the debugger to an editor: the Debug Adapter Protocol on standard input and output."""
    from gms_fsm.app.scenario import launched
    from gms_fsm.debugger.dap import serve

    if sys.stdin.isatty():
        raise SessionError(
            "it answers an editor, and this is a terminal",
            advice="gms-fsm debug SCENARIO takes commands here",
        )
    raise typer.Exit(serve(launched, sys.stdin.buffer, sys.stdout.buffer))


def class_command(output: OutputFolder = Path("class")) -> None:
    """Write a teaching pack for 90 minutes: plan, slides, tasks, solutions, live lessons."""
    from gms_fsm.app.lessons.pack import write_class

    with messages().status("running the lessons") as status:
        files = write_class(output, lambda what: status.update(f"making {what}"))
    say(f"{len(files)} files in {output}; start with {files[0]}")


def lesson_command(
    number: Annotated[
        str,
        typer.Argument(help="Number of the lesson; omit it to list all.", show_default=False),
    ] = "",
    output: OutputFolder = Path("lessons"),
    notebook: Annotated[
        bool, typer.Option("--notebook", help="Write it as a notebook instead, without running it.")
    ] = False,
    page: Annotated[
        bool,
        typer.Option(
            "--page", help="Write it as one live page instead: predict, be judged, drag, read why."
        ),
    ] = False,
) -> None:
    """Run a lesson: a figure, a replay page, and five lines with the measured values."""
    from gms_fsm.app.lessons import LESSONS, listed, numbered, teach, write_page

    if not number and not notebook and not page:
        say(listed())
        return
    if notebook:
        from gms_fsm.app.lessons.engine.notebooks import write_notebook

        for each in [numbered(number)] if number else LESSONS:
            put(str(write_notebook(each, output)))
        return
    if page and not number:
        raise ParameterError("it writes one lesson", place="--page", advice="give its number, too")
    chosen = numbered(number)
    if page:
        with messages().status(f"running lesson {chosen}"):
            written = write_page(chosen, output)
        put(str(written))
        return
    with messages().status(f"running lesson {chosen}"):
        taught = teach(chosen, output)
    for line in taught.lines:
        say(line)
    put()
    for path in taught.files:
        put(str(path))
