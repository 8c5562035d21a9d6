"""Sweeps of a scenario: runs over a grid of parameters, written as files and a table."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm.app.scenario import Loaded
from gms_fsm.charts.parameters import FloatArray, Parameter
from gms_fsm.errors import ParameterError, cut
from gms_fsm.foundation.arguments import unknown
from gms_fsm.foundation.files import csv_text, output_folder, refuse_input, write_text
from gms_fsm.foundation.quantities import in_si
from gms_fsm.foundation.text import plain, table_lines
from gms_fsm.gradients.directions import INITIAL
from gms_fsm.run.repeated.beginnings import periods_of
from gms_fsm.run.sweep import Sweep, sweep
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.numbers import known_in
from gms_fsm.traces.system_scope import units_of

__all__ = ["Axis", "axis", "sweep_scenario", "sweep_summary", "swept"]

MOST_RUNS = 1_000_000
LONGEST_TABLE = 100  # runs in a summary; all are in runs.csv


@dataclass(frozen=True, eq=False)
class Axis:
    """A parameter to vary, and its values.

    Parameters
    ----------
    name : str
        Name of the parameter.
    values : ndarray, shape (count,)
        Values, in the unit of the parameter.
    spacing : {"linear", "logarithmic"}
        Spacing of the values.
    """

    name: str
    values: FloatArray
    spacing: str


def axis(text: str) -> Axis:
    """Parse the value of ``--over``.

    Parameters
    ----------
    text : str
        ``"name=from:to:count"``; append ``",log"`` for logarithmic spacing.

    Returns
    -------
    Axis
        The parameter and its values, including both ends.

    Raises
    ------
    ParameterError
        If the text does not have this form.

    Examples
    --------
    >>> axis("F_s=1:2:3").values.tolist()
    [1.0, 1.5, 2.0]
    >>> axis("v_s=1e-3:0.1:3,log").values.round(6).tolist()
    [0.001, 0.01, 0.1]
    """
    here = f"--over {cut(text)}"
    name, equals, form = (part.strip() for part in text.partition("="))
    found = re.fullmatch(r"([^:]*):([^:]*):([^:,]*)(,\s*log)?", form)
    if not (name and equals and found):
        raise ParameterError(
            "give it as name=from:to:count, for example F_s=1:2:11, and append "
            ",log for logarithmic spacing",
            place=here,
        )
    *ends, number, logarithmic = found.groups()
    try:
        start, stop, count = *map(float, ends), int(number)
    except ValueError:
        meant = [in_si(each) for each in ends]
        advice = f"write --over {name}={':'.join(meant)}:{number}{logarithmic or ''}"
        raise ParameterError(
            "from and to must be numbers in SI units, and count an integer",
            place=here,
            advice=advice if all(meant) and number.isdecimal() else "",
        ) from None
    if not (math.isfinite(start) and math.isfinite(stop)):
        raise ParameterError("from and to must be finite", place=here)
    if not 2 <= count <= MOST_RUNS:
        raise ParameterError(
            f"count is {count}", place=here, advice=f"it must be between 2 and {MOST_RUNS}"
        )
    if not logarithmic:
        return Axis(name, np.linspace(start, stop, count), "linear")
    if not (start > 0.0 and stop > 0.0):
        raise ParameterError("with log, both from and to must be > 0", place=here)
    return Axis(name, np.geomspace(start, stop, count), "logarithmic")


def sweep_scenario(
    loaded: Loaded, axes: Sequence[Axis], folder: str | Path, *, engine: str = "compiled"
) -> tuple[Sweep, list[Path]]:
    """Run a scenario over a grid of parameters and write the results.

    Parameters
    ----------
    loaded : Loaded
        From `gms_fsm.app.scenario.load_scenario`.
    axes : sequence of Axis
        At least one; every combination of values is run, the last axis varying fastest.
    folder : str or Path
        Output folder; created before the runs if it does not exist.
    engine : {"compiled", "machines", "ifelse"}
        As in `gms_fsm.sweep`.

    Returns
    -------
    (Sweep, list of Path)
        The results, and the files, ``summary.md`` first.

    Raises
    ------
    ParameterError
        If a name is unknown, or there are too many runs.
    OutputError
        If the folder is not writable, or a file would replace one that was not written by gms-fsm
        or that is an input.
    """
    _check(axes, _known(loaded, axes))
    names = ["summary.md", "runs.csv", "sweep.npz"]
    folder = output_folder(folder, names)
    for name in names:
        refuse_input(folder / name, *loaded.inputs)
    result = swept(loaded, axes, engine=engine)
    saved = result.save(folder / "sweep.npz")  # first, so that no later failure can lose the runs
    return result, [
        write_text(folder / "summary.md", sweep_summary(loaded, axes, result, engine)),
        write_text(folder / "runs.csv", _csv(result)),
        saved,
    ]


def swept(
    loaded: Loaded, axes: Sequence[Axis], *, engine: str = "compiled", coverage: bool = False
) -> Sweep:
    """Run a scenario over a grid of parameters.

    Parameters
    ----------
    loaded, axes, engine
        As in `sweep_scenario`.
    coverage : bool
        As in `gms_fsm.sweep`.

    Returns
    -------
    Sweep
        One run for every combination of values, the last axis varying fastest.

    Raises
    ------
    ParameterError
        If a name is unknown, or there are too many runs.
    """
    _check(axes, _known(loaded, axes))
    grid = np.meshgrid(*(each.values for each in axes), indexing="ij")
    parameters = {each.name: values.ravel() for each, values in zip(axes, grid, strict=True)}
    options: dict[str, Any] = dict(loaded.arguments)
    for name in ("engine", "monitors"):  # a sweep keeps no rows for monitors
        options.pop(name, None)
    if loaded.scenario.output.every is None or coverage:
        options.pop("t_eval", None)
    else:
        options["output"] = "t_eval"
    options.pop("t_end")
    with loaded.blaming():
        return sweep(*(*loaded.subject, parameters), engine=engine, coverage=coverage, **options)


def _known(loaded: Loaded, axes: Sequence[Axis]) -> tuple[Parameter, ...]:
    """Return the parameters that can be varied; of initial values those that are."""
    what = mounted(loaded.system or loaded.model, loaded.rig)
    begun = [each.name for each in axes if each.name.startswith(INITIAL)]
    units = units_of(what, [name.removeprefix(INITIAL) for name in begun])
    known = {**known_in(what), **periods_of(what)}
    return (
        *(replace(each, name=name) for name, (each, _) in known.items()),
        *(Parameter(name, units.get(name.removeprefix(INITIAL), "")) for name in begun),
    )


def _check(axes: Sequence[Axis], known: Sequence[Parameter]) -> None:
    if not axes:
        raise ParameterError(
            "nothing to vary", advice="give --over name=from:to:count at least once"
        )
    names = [each.name for each in axes]
    for name in names:
        if name not in [each.name for each in known]:
            raise unknown("parameter", name, (each.name for each in known), place="--over")
        if names.count(name) > 1:
            raise ParameterError(f"--over {name}: it is given twice", advice="give it once")
    runs = math.prod(each.values.size for each in axes)
    if runs > MOST_RUNS:
        raise ParameterError(f"--over gives {runs} runs", advice=f"at most {MOST_RUNS} are allowed")


# --------------------------------------------------------------------------- what is written
def _csv(result: Sweep) -> str:
    columns = {"run": np.arange(len(result)), **result.columns()}
    return csv_text([columns, *zip(*(each.tolist() for each in columns.values()), strict=True)])


def sweep_summary(loaded: Loaded, axes: Sequence[Axis], result: Sweep, engine: str) -> str:
    """Write the summary of a sweep.

    Parameters
    ----------
    loaded : Loaded
        The scenario.
    axes : sequence of Axis
        The parameters varied.
    result : Sweep
        The results.
    engine : str
        The engine used.

    Returns
    -------
    str
        Markdown: the parameters varied, the outcomes of the runs, a table of the first runs.
    """
    units = {each.name: each.unit for each in _known(loaded, axes)}
    bad = int((result.outcome != "ok").sum())
    heads = [f"{each.name} [{units[each.name]}]".removesuffix(" []") for each in axes]
    numbers = [result.parameters[each.name] for each in axes]
    if loaded.system is None:
        ends = {"x [m]": result.x, "v [m/s]": result.v, "F [N]": result.F}
    else:
        ends = {
            f"{each.name}.x [{each.unit}]": result.ends[f"{each.name}.x"]
            for each in loaded.system.bodies
        }
        for each in loaded.system.contacts:
            ends[f"{each.name}.F [{each.chart.force}]"] = result.contact(each.name).F
    heads += ["outcome", "transitions", "t [s]", *ends]
    rows = [
        [
            *(f"{values[run]:.6g}" for values in numbers),
            str(result.outcome[run]),
            str(count),
            *(f"{values[run]:.6g}" for values in (result.t, *ends.values())),
        ]
        for run, count in enumerate(result.transition_count[:LONGEST_TABLE].tolist())
    ]
    lines = [
        f"# {plain(' '.join(loaded.title.split()))}, swept",
        "",
        *_subject(loaded),
        *(f"- {_varied(each, units[each.name])}" for each in axes),
        f"- runs: {len(result)}, to t = {loaded.arguments['t_end']:g} s, engine {engine}",
        f"- result: {len(result.transitions)} transitions, {bad} runs failed",
        *(f"- run {run}: {plain(message)}" for run, message in failures(result)),
        "",
        *table_lines(heads, rows),
    ]
    if len(result) > LONGEST_TABLE:
        lines += ["", f"The first {LONGEST_TABLE} runs; `runs.csv` has all {len(result)}."]
    return "\n".join(lines) + "\n"


def _subject(loaded: Loaded) -> list[str]:
    if loaded.system is not None:
        return [f"- system: {plain(loaded.system.name)}"]
    return [f"- model: {plain(loaded.model.title)}", f"- rig: {plain(loaded.rig.title)}"]


def _varied(one: Axis, unit: str) -> str:
    first, last = one.values[0], one.values[-1]
    return (
        f"{one.name}: {one.values.size} values from {first:.6g} to {last:.6g}"
        f"{f' {unit}' if unit else ''}, {one.spacing}"
    )


def failures(result: Sweep, most: int = 5) -> list[tuple[int, str]]:
    """Return the first runs that failed, with their messages."""
    runs = np.flatnonzero(result.outcome != "ok")[:most].tolist()
    return [(run, f"{result.outcome[run]}: {result.message[run]}") for run in runs]
