"""What two charts, models, systems or runs differ in, and whether it makes a difference."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, TypeAlias

from gms_fsm.charts.chart import Chart
from gms_fsm.difference.charts import chart_diff
from gms_fsm.difference.made import made_diff
from gms_fsm.difference.result import Diff, PartChange, RunsDiff
from gms_fsm.difference.runs import runs_diff, settings_changes
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.lowering.scales import scales_of
from gms_fsm.run.simulate import simulate
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, mounted_alone
from gms_fsm.systems.rigs import Prescribed
from gms_fsm.systems.system import System
from gms_fsm.traces.trace import Trace
from gms_fsm.verification.sameness.same import Verdict

FILES = "Chart.load and Trace.load read files; gms-fsm diff takes their names"

__all__ = ["Diff", "PartChange", "RunsDiff", "diff"]


@refusing()
def diff(
    a: Chart | Model | System | Trace,
    b: Chart | Model | System | Trace,
    *,
    names: tuple[str, str] = ("first", "second"),
) -> Diff:
    """Compare two charts, models, systems or runs.

    Parameters
    ----------
    a, b : Chart, Model, System or Trace
        Two of a kind. A chart and a model are compared by their charts.
    names : tuple of str
        What they are called.

    Returns
    -------
    Diff
        What was added, removed, renamed or changed, and a verdict: *equal*; *equivalent*, if all
        that differs makes no difference for any values that the rules of the parameters allow;
        *different*, with values at which they differ; else *undecided*, with the reason. Models
        that are not equivalent are also moved in a few ways, until their runs differ. Runs are
        compared up to the first transition that differs by more than their tolerances explain.

    Raises
    ------
    ParameterError
        If they are not of a kind.

    Notes
    -----
    *Equivalent* is proved with z3 (extra ``check``), over the reals; without it texts are compared
    only. It is about charts: bodies, springs and signals of systems are compared by their texts.
    Another order of parts is *undecided*, unless runs show a difference.

    Examples
    --------
    >>> from gms_fsm import Chart, State, Transition
    >>> def window(guard):
    ...     edge = Transition("leave", "inside", "outside", guard=guard)
    ...     return Chart("window", states=(State("inside"), State("outside")), transitions=(edge,),
    ...                  variables=("z",), parameters=("c",), outputs={"F": "z"})
    >>> print(diff(window("z > c"), window("not c >= z")))
    first -> second
      ~ guard of edge leave: z > c -> !(c >= z)
    equivalent: only names, order and spelling differ
    """
    given = _read(a, "a"), _read(b, "b")
    match given:
        case Trace() as one, Trace() as other:
            return _of_runs(one, other, names)
        case Mounted() as one, Mounted() as other if one.named == other.named:
            return _of_made(one, other, names)
        case (Chart() | Mounted(named=False)) as one, (Chart() | Mounted(named=False)) as other:
            return chart_diff(_chart(one), _chart(other), names)[0]
    kinds = " and ".join(map(_kind, given))
    raise ParameterError(f"they are {kinds}", place="b", advice="give two of a kind")


Readable: TypeAlias = Chart | Mounted | Trace


def _read(given: Any, place: str) -> Readable:
    """Return what is compared: a chart, a run, or what can run."""
    if isinstance(given, (Chart, Trace)):
        return given
    try:
        return mounted_alone(given)
    except ParameterError:
        raise ParameterError(
            "it must be a chart, a model, a system or a run",
            place=place,
            value=given,
            advice=FILES if isinstance(given, (str, os.PathLike)) else "",
        ) from None


def _kind(given: Readable) -> str:
    if isinstance(given, Mounted):
        return "a system" if given.named else "a model"
    return "a chart" if isinstance(given, Chart) else "a run"


def _chart(given: Chart | Mounted) -> Chart:
    return given if isinstance(given, Chart) else given.model.chart


# --------------------------------------------------------------------------- runs
def _of_runs(a: Trace, b: Trace, names: tuple[str, str]) -> Diff:
    """Compare two runs, and what ran."""
    made = made_diff(a.what, b.what, names)
    same = made.diff.verdict == "equal"
    settings = settings_changes(a, b, same)
    about = f"{made.about}{', other settings' * bool(settings)}"
    runs = runs_diff(a, b, about, same=same, names=made.names)
    changes = (*made.diff.changes, *settings)
    if runs.apart:
        return replace(
            made.diff, changes=changes, verdict="different", reason=runs.headline, runs=runs
        )
    verdict: Verdict = "equivalent"
    until = f" until t = {runs.t_end:.9g} s" if a.t[-1] != b.t[-1] else ""
    reason = f"the runs agree{until} as well as their tolerances tell"
    if not runs.compared:
        verdict, reason = "undecided", "the runs have no quantity, or no time, in common"
    elif not (changes or until or any(runs.largest.values())):
        verdict, reason = "equal", ""
    return replace(made.diff, changes=changes, verdict=verdict, reason=reason, point={}, runs=runs)


def with_runs(found: Diff, a: Trace, b: Trace, motion: str = "") -> Diff:
    """Return a comparison with the first difference of two runs, if they show one."""
    runs = _of_runs(a, b, found.names)
    if runs.verdict != "different" or runs.runs is None:
        return found
    reason = found.reason if found.verdict == "different" else runs.reason
    shown = replace(runs.runs, motion=motion)
    return replace(found, verdict="different", reason=reason, runs=shown)


# --------------------------------------------------------------------------- what can run
def _of_made(a: Mounted, b: Mounted, names: tuple[str, str]) -> Diff:
    """Compare models or systems; models that are not equivalent are moved until they differ."""
    found = made_diff(a, b, names).diff
    if found.equal and a.named and a.system != b.system:
        reason = "they are not equal, but no part is found that differs"
        found = replace(found, verdict="undecided", reason=reason)
    if found.equivalent or a.named or b.named:
        return found
    for velocity, t_end in motions(a.model):
        rig: Any = Prescribed(velocity)
        try:
            one, other = (simulate(each.model, rig, t_end, engine="ifelse") for each in (a, b))
        except GMSError:  # it locks the contact, needs other inputs, or its numbers are extreme
            continue
        moved = with_runs(found, one, other, velocity)
        if moved.runs is not None:
            return moved
    return found


def motions(model: Model) -> Iterator[tuple[str, float]]:
    """Yield velocities that move a model through its states, each with a duration.

    Examples
    --------
    >>> from gms_fsm import LuGre, Stribeck
    >>> next(motions(LuGre(sigma_0=1e5, sigma_1=300, sigma_2=0.4, stribeck=Stribeck(1, 1.5, 1e-3))))
    ('3e-05*sin(t)', 12.566370614359172)
    """
    scales = scales_of(model)
    z = max((u for each in scales.variables.values() for u in each), default=0.0)
    reach = 3.0 * (z or scales.x or 1.0)
    rates = dict.fromkeys((1.0, 10.0 * (scales.v or scales.speed) / reach))
    for rate in rates:
        if rate > 0.0 and math.isfinite(rate):
            yield (
                f"{reach * rate:.6g}*sin({rate:.6g}*t)".replace("*sin(1*t)", "*sin(t)"),
                (4.0 * math.pi / rate),
            )
