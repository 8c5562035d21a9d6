"""Runs a scenario and writes its report."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm.app.scenario import Loaded
from gms_fsm.charts.parameters import SIGMA_2, STRIBECK, WEIGHTS, FloatArray, adapted
from gms_fsm.errors import MissingExtraError
from gms_fsm.foundation.files import output_folder, refuse_input, write_text
from gms_fsm.foundation.quantities import named_numbers, per_second
from gms_fsm.foundation.text import plain, table_lines
from gms_fsm.lowering.scales import Setting
from gms_fsm.records.motion import Motion
from gms_fsm.records.record import Record
from gms_fsm.run.simulate import Moment
from gms_fsm.systems.models import GMS
from gms_fsm.systems.system import Contact, System, loaded
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.trace import Trace, dwell_times
from gms_fsm.traces.verdicts import Trust
from gms_fsm.traces.views import range_of_force

__all__ = [
    "ForceComparison",
    "compare",
    "dwell_times",
    "monitor_lines",
    "run_scenario",
    "summary_text",
    "trust_lines",
]


ONE_SPEED = 2.0  # speeds of a plateau are within this factor; those of a sine spread over 2.7


@dataclass(frozen=True)
class ForceComparison:
    """Comparison of the simulated and the measured friction force.

    Parameters
    ----------
    rows : int
        Number of selected rows.
    rmse : float
        Root mean square of the difference, N.
    r2 : float
        Coefficient of determination: 1 - sum of squared differences / that about the mean; NaN
        for a constant measurement.
    """

    rows: int
    rmse: float
    r2: float


def compare(trace: Trace, record: Record) -> ForceComparison | None:
    """Compare a run with its record at the selected rows.

    Parameters
    ----------
    trace : Trace
        A run with the motion of the record.
    record : Record
        A record with a column ``force``.

    Returns
    -------
    ForceComparison or None
        None if the record has no force.
    """
    times, measured = measured_force(record)
    if not times.size:
        return None
    inside = (times >= trace.t[0]) & (times <= trace.t[-1])
    times, measured = times[inside], measured[inside]
    same = times.size == len(trace) and bool((times == trace.t).all())
    difference = measured - (trace.F if same else trace.sample(times).F)
    spread = measured - measured.mean()
    total = float(spread @ spread)
    r2 = 1.0 - float(difference @ difference) / total if total > 0.0 else math.nan
    return ForceComparison(times.size, float(np.sqrt(np.mean(difference**2))), r2)


def measured_force(record: Record) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and forces [N] of the selected rows; empty without a force column."""
    if "force" not in record.columns:
        return np.empty(0), np.empty(0)
    return record.columns["time"][record.chosen], record.columns["force"][record.chosen]


def run_scenario(
    loaded: Loaded,
    folder: str | Path,
    progress: Callable[[Moment], object] | None = None,
    *,
    checkpoint: bool = False,
    again: bool = False,
) -> tuple[Trace, list[Path]]:
    """Run a scenario and write the trace, log, figure and summary.

    Parameters
    ----------
    loaded : Loaded
        From `gms_fsm.app.scenario.load_scenario`.
    folder : str or Path
        Output folder; created before the run if it does not exist.
    progress : callable, optional
        Passed to `simulate`.
    checkpoint : bool
        Save the state of the run in ``run.checkpoint``, from which an interrupted run resumes.
    again : bool
        Repeat the run with finer tolerances for its section on trust (`Trace.trust`).

    Returns
    -------
    (Trace, list of Path)
        The run, and the files, ``summary.md`` first.

    Raises
    ------
    OutputError
        If the folder is not writable, or a file would replace one that was not written by gms-fsm
        or that is an input.
    SimulationError
        If the run cannot continue; the run so far is written to ``partial.npz``.
    KeyboardInterrupt
        On Ctrl-C; the run so far is written to ``partial.npz``, as the message says.
    ScenarioError
        If `simulate` rejects an argument.
    """
    output = loaded.scenario.output
    names = ["summary.md", "trace.npz", "transitions.csv", "partial.npz"]
    names += _figure_files(loaded)
    names += ["trace.csv", "trace.transitions.csv"] if output.csv else []
    folder = output_folder(folder, names)
    for name in names:
        refuse_input(folder / name, *loaded.inputs)
    try:
        trace = loaded.simulate(
            progress=progress, checkpoint=folder / "run.checkpoint" if checkpoint else None
        )
    except SimulationError as error:
        kept = error.trace.save(folder / "partial.npz")
        failed = error.replaced(kept=kept).inside(loaded.path)
        lines = zip(monitor_lines(error.trace), error.trace.monitors.values(), strict=True)
        for line, verdict in lines:
            if not getattr(verdict, "livelock", False):  # that is the error just reported
                failed.add_note(line)
        raise failed from error.__cause__
    except KeyboardInterrupt as error:
        part: Any = getattr(error, "trace", ())  # empty if the run has not started
        error.args = ("interrupted before the first row; nothing was written",)
        if len(part):
            kept = part.save(folder / "partial.npz")
            error.args = (f"interrupted at t = {part.t[-1]:.6g} s; the run so far is in {kept}",)
        raise
    saved = trace.save(folder / "trace.npz")  # first, so that no later failure can lose the run
    try:
        return trace, _reported(loaded, trace, folder, saved, again=again)
    except KeyboardInterrupt as error:
        error.args = (f"interrupted; the run is in {saved}",)
        raise


def _reported(
    loaded: Loaded, trace: Trace, folder: Path, saved: Path, *, again: bool
) -> list[Path]:
    """Write the report of a run and return all files."""
    files = [
        write_text(folder / "summary.md", summary_text(loaded, trace, trace.trust(again=again))),
        saved,
        write_text(folder / "transitions.csv", trace.transitions_csv()),
    ]
    if loaded.scenario.output.csv:
        files.append(trace.save(folder / "trace.csv"))
    try:
        files += _draw(loaded, trace, folder)
    except MissingExtraError as error:
        warnings.warn(f"no figure was drawn: {error}", stacklevel=3)
    return files


def _figure_files(loaded: Loaded, contact: str = "") -> list[str]:
    """Return the file names of the overview figures, of all contacts or of one of several."""
    if loaded.system is not None and not loaded.system.contacts:
        return []  # a supervisor has no force to draw
    if loaded.contacts and not contact:
        return [name for each in loaded.contacts for name in _figure_files(loaded, each)]
    stem = f"overview-{contact}".removesuffix("-")
    wanted = loaded.scenario.output.figures
    if wanted is not None:
        return [f"{stem}.{ending}" for ending in wanted]
    from plots.output import formats

    return formats.files(stem, "figure")


def _draw(loaded: Loaded, trace: Trace, folder: Path) -> list[Path]:
    if not _figure_files(loaded):
        return []
    from plots import figures

    if loaded.contacts:
        written = []
        for name in loaded.contacts:
            figure = figures.overview(trace.contact(name), title=loaded.title)
            files = _figure_files(loaded, name)
            written += [figures.save(figure, folder / file) for file in files]
        return written

    measured = None
    if loaded.record is not None and loaded.motion is not None and "force" in loaded.record.columns:
        times, force = measured_force(loaded.record)
        position = loaded.motion.position[loaded.record.chosen]
        measured = figures.Measured(times, position, force)
    figure = figures.overview(trace, measured, title=loaded.title)
    return [figures.save(figure, folder / name) for name in _figure_files(loaded)]


# --------------------------------------------------------------------------- the summary
def summary_text(loaded: Loaded, trace: Trace, trust: Trust) -> str:
    """Write the summary of a run.

    Parameters
    ----------
    loaded : Loaded
        The scenario.
    trace : Trace
        The run of the scenario.
    trust : Trust
        Its findings.

    Returns
    -------
    str
        Markdown: the system, the activity of each element, the findings, the comparison with the
        measurement, and the parameters that are not identifiable from it.
    """
    settings = ", ".join(
        f"{name} = {_setting(value)}" for name, value in trace.settings.items() if value is not None
    )
    result = f"- result: {len(trace)} rows, {len(trace.transitions)} transitions"
    lines = [
        f"# {plain(' '.join(loaded.title.split()))}",
        "",
        *([plain(loaded.scenario.notes.strip()), ""] if loaded.scenario.notes.strip() else []),
    ]
    if trace.system is None:
        lines += [
            f"- model: {plain(trace.model.title)}",
            f"- rig: {plain(trace.rig.title)}",
            f"- parameters: {_parameters(trace)}",
            f"- run: {settings}",
            f"{result}, {_range(trace)}",
            "",
            *_element_table(trace),
        ]
    else:
        lines += [
            f"- system: {plain(trace.system.name)}",
            *(
                [f"- numbers: {named_numbers(trace.system.numbers, trace.system.units)}"]
                if trace.system.numbers
                else []
            ),
            f"- run: {settings}",
            result,
            "",
            *_end_tables(trace, trace.system),
            *(line for name in trace.contacts for line in _contact_lines(trace.contact(name))),
        ]
    lines += ["", "## Trust", "", *(f"- {plain(str(each))}" for each in trust)]
    lines += ["- no findings"] * (not len(trust))
    if trace.monitors:
        lines += ["", "## Monitors", "", *(f"- {line}" for line in monitor_lines(trace))]
    if loaded.record is not None and loaded.motion is not None:
        lines += ["", *_measurement(loaded.record, loaded.motion, trace)]
    return "\n".join(lines) + "\n"


def _end_tables(trace: Trace, system: System) -> list[str]:
    """Return where the bodies and the further values are at the end of a run."""
    bodies = [(each.name, trace.body(each.name)) for each in system.bodies]
    rows = [
        [
            f"{name} ({each.x}, {each.v})",
            f"{body.x[-1]:.6g} {each.unit}",
            f"{body.v[-1]:.6g} {per_second(each.unit)}",
        ]
        for each, (name, body) in zip(system.bodies, bodies, strict=True)
    ]
    lines = [
        f"At t = {trace.t[-1]:.6g} s:",
        "",
        *table_lines(["body", "position", "velocity"], rows),
    ]
    names = [*system.flow, *(name for each in system.sampled for name in each.updates)]
    if names:
        rows = [[f"{trace.value(name)[-1]:.6g}" for name in names]]
        lines += ["", *table_lines(names, rows)]
    return lines


def _contact_lines(trace: Trace) -> list[str]:
    """Return the section of one contact."""
    velocities = trace.what.system.contact(trace.which).v
    return [
        "",
        f"## Contact {plain(trace.model.title)}",
        "",
        f"- on: {', '.join(map(plain, velocities))}",
        f"- parameters: {_parameters(trace)}",
        f"- result: {len(trace.transitions)} transitions, {_range(trace)}",
        "",
        *_element_table(trace),
    ]


def _range(trace: Trace) -> str:
    least, most = range_of_force(trace)
    return f"F from {least:.4g} to {most:.4g} {trace.model.chart.force}"


def _setting(value: Setting) -> str:
    """Return a setting as text, with the tolerance of each component by name."""
    if not isinstance(value, Mapping):
        return str(value)
    return "(" + ", ".join(f"{name} {_number(np.array(u))}" for name, u in value.items()) + ")"


def monitor_lines(trace: Trace) -> list[str]:
    """Return the verdicts of the monitors of a run, one line each.

    Parameters
    ----------
    trace : Trace
        The run.

    Returns
    -------
    list of str
        Lines for the user; `Trace.monitors` has the data.
    """
    return [
        f"monitor {name} ({'ok' if verdict.ok else 'not ok'}): {verdict.text}"
        for name, verdict in trace.monitors.items()
    ]


def trust_lines(trust: Trust, *, every: bool) -> list[str]:
    """Return the findings about a run that a terminal shows.

    Parameters
    ----------
    trust : Trust
        The findings.
    every : bool
        Whether to show all; otherwise warnings, and what was probably not meant.

    Returns
    -------
    list of str
        Lines for the user; the summary has all.
    """
    urgent = ("units", "unused")
    shown = [each for each in trust if every or each.severity == "warning" or each.kind in urgent]
    return [str(each) for each in shown]


def _parameters(trace: Trace) -> str:
    model = trace.model
    chart = model.chart
    numbers = [(each, model.values[each.name]) for each in chart.parameters]
    if model.stribeck is not None:
        own = model.stribeck.numbers
        numbers += [(each, own[each.name]) for each in STRIBECK if each.name in own]
    if not (isinstance(model, Contact) and model.model is None):
        numbers.append((SIGMA_2, model.sigma_2))
    if model.stribeck is not None:
        numbers.append((WEIGHTS, model.weights))
    per = {chart.force: f"{chart.force} per N of load"} if loaded(model) else {}
    shown = []
    for each, value in numbers:
        unit = adapted(each, chart).unit
        unit = "" if unit == "1" else unit
        unit = per.get(unit, unit) if each in STRIBECK else unit
        shown.append(f"{each.name} = {_number(value)} {unit}".rstrip())
    return ", ".join(shown)


def _number(value: float | FloatArray) -> str:
    if np.ndim(value) == 0:
        return f"{float(value):.6g}"
    return "[" + ", ".join(f"{float(v):.6g}" for v in np.asarray(value)) + "]"


def _element_table(trace: Trace) -> list[str]:
    chart = trace.model.chart
    edges = [edge.name for edge in chart.transitions]
    dwell, log = dwell_times(trace), trace.transitions
    head = ["element", *(f"{s.name} [s]" for s in chart.states), *edges]
    rows = [
        [
            str(i + 1),
            *(f"{seconds:.4g}" for seconds in dwell[i]),
            *(str(int(((log.element == i) & (log.edge == edge)).sum())) for edge in edges),
        ]
        for i in range(trace.n)
    ]
    return table_lines(head, rows)


def _measurement(record: Record, motion: Motion, trace: Trace) -> list[str]:
    lines = [f"## Comparison with the measurement ({plain(Path(record.place).name)})", ""]
    comparison = compare(trace, record)
    if comparison is None:
        lines.append("- the record has no measured force to compare with")
    else:
        lines.append(
            f"- **R² = {comparison.r2:.4f}, RMSE = {comparison.rmse:.4g} N** on {comparison.rows} "
            "rows (parameters as given; nothing was fitted)"
        )
    lines += [f"- {plain(note)}" for note in (*record.notes, *motion.notes)]
    doubts = what_it_cannot_tell(trace, motion)
    if doubts:
        lines += [
            "",
            "### Parameters not identifiable from this record",
            "",
            *(f"- {doubt}" for doubt in doubts),
        ]
    return lines


def velocity_note(trace: Trace, motion: Motion) -> str:
    """Return a warning if v_c is below the velocity noise of a record, else an empty text."""
    v_c = trace.model.values.get("v_c")
    if v_c is None or motion.standstill == 0.0 or float(np.min(v_c)) >= motion.standstill:
        return ""
    return (
        f"v_c = {float(np.min(v_c)):.3g} m/s is below the velocity noise at standstill, "
        f"{motion.standstill:.2g} m/s (standard deviation): arrests occur at random; "
        f"v_c = {motion.fitting_v_c():.2g} m/s would suit this record"
    )


def what_it_cannot_tell(trace: Trace, motion: Motion) -> list[str]:
    """Return the parameters that a record does not identify, each with the reason."""
    doubts = []
    speed = np.abs(motion.velocity)
    moving = speed[speed > 0.1 * np.quantile(speed, 0.99)]
    if not moving.size:
        return ["all parameters: there is no motion"]
    slow, fast = (float(q) for q in np.quantile(moving, [0.2, 0.95]))
    if fast < ONE_SPEED * slow:
        doubts.append(
            f"the Stribeck curve: there is only one speed ({1e3 * slow:.2g} to {1e3 * fast:.2g} "
            "mm/s during motion), so F_s, v_s and sigma_2 cannot be distinguished from F_c"
        )
        if isinstance(trace.model, GMS):
            doubts.append(
                "C: at constant speed an element in slip stays at z = w s(v) whatever C is; only "
                "changes of speed during slip would reveal it"
            )
    note = velocity_note(trace, motion)
    if note:
        doubts.append(note)
    sigma = trace.model.values.get("sigma")
    if sigma is not None:
        viscous = float(np.sum(sigma)) * fast
        if viscous < 0.01 * float(np.abs(trace.F).max()):
            doubts.append(
                f"sigma_i: at this speed the total bristle damping force is {1e3 * viscous:.2g} "
                f"mN, less than 1 % of the friction"
            )
    return doubts
