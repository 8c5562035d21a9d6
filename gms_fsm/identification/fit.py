"""fit(): parameters from measured records, with intervals, and what the records cannot tell.

Parameters that the force is linear in are solved for at every proposal (variable projection); the
others are searched by hops, first on few rows, then on all of them. Every proposal has a budget of
steps, so that none can hang a fit.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import GMSError, ParameterError, RecordError
from gms_fsm.foundation.arguments import (
    checked_integer,
    checked_kind,
    listed,
    one_of,
    refusing,
    unknown,
)
from gms_fsm.identification.certainty.assess import (
    NO_INFLUENCE,
    Assessed,
    assessed,
    sorted_elements,
    unassessed,
)
from gms_fsm.identification.certainty.statistics import correlation_time
from gms_fsm.identification.problem.arguments import checked_records, column_of, window_of
from gms_fsm.identification.problem.beginning import ROUNDS, with_states
from gms_fsm.identification.problem.experiment import MASS, NUISANCE, Point, value_of
from gms_fsm.identification.problem.linear import linear_names
from gms_fsm.identification.problem.runs import BEGINS, MOVING, ThreadPool
from gms_fsm.identification.problem.search import SEARCHES, Best
from gms_fsm.identification.problem.task import (
    WEIGHTS,
    FitOptions,
    Task,
    bar,
    inside,
    stretches,
    training_rows,
)
from gms_fsm.identification.problem.unknowns import values_by_key
from gms_fsm.identification.result import Fit
from gms_fsm.records.record import Record
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, mounted_alone
from gms_fsm.systems.numbers import known_in, varied
from gms_fsm.systems.system import System

__all__ = ["fit", "fitted", "options_of", "task_of"]

STOPPED = "The search was interrupted: this is the best so far."
STOPPED_LATE = "Interrupted before the intervals were known: this is the best so far."
FEWEST_ROWS = 20
AGAIN = 3  # searches from a better point met while looking for the ends of intervals
FOLLOWS, IGNORES = 0.75, 0.3  # mean products of signs
LOAD_DIFFERS = 0.05  # relative
STILL = 1e-9  # of its size: a column that varies less is constant


@refusing()
def fit(
    records: Record | Sequence[Record],
    model: Model | System,
    *,
    free: Sequence[str],
    fixed: Mapping[str, ArrayLike] | None = None,
    tied: Sequence[str] = (),
    nuisance: Sequence[str] = ("offset",),
    linear: Sequence[str] = (),
    measured: str = "F",
    drive: str | None = None,
    train: tuple[float, float] | None = None,
    test: tuple[float, float] | None = None,
    cycles: float | None = None,
    search: Literal["hops", "local"] = "hops",
    bounds: Mapping[str, tuple[float, float]] | None = None,
    seed: int = 0,
    most_steps: int | None = None,
    smoothing: float | None = None,
    begin: Literal["relaxed", "run in"] | None = None,
    weight: Literal["rows", "records"] | None = None,
    progress: bool | None = None,
) -> Fit:
    """Find parameters of a model, or of a system, from measured records.

    The motion of each record drives the model, and its force is compared with the measured one.
    Ctrl-C ends the search; the best so far is returned, and says so.

    Parameters
    ----------
    records : Record or sequence of Record
        Several are one experiment: they share all parameters and nuisance terms.
    model : GMS, LuGre, ChartModel or System
        With start values. A system is driven by the record through the signal of its driven body;
        without one it moves by itself, and the record gives only times and measurements.
    free : sequence of str
        What to find: ``k`` for all elements, ``k2`` for one; in a system ``gear.k``, ``numbers.m``.
    fixed : mapping of str to float or array_like, optional
        Values that replace those of the model.
    tied : sequence of str
        Free parameters of which all elements get one value.
    nuisance : sequence of str
        Terms of the measurement besides the model: ``"offset"`` (N), ``"drift"`` (N/s) and
        ``"inertia"`` (kg, times acceleration).
    linear : sequence of str
        Parameters declared linear in the force; they are normally found from the chart.
    measured : str
        What is compared: ``"F"``; in a system ``"gear.F"``, ``"load.x"`` or ``"load.v"``, with the
        record's force, position or velocity.
    drive : str, optional
        The signal of a system that the record's velocity replaces.
    train, test : tuple of float, optional
        Times from, to (excluded), s. Without `train` all rows but those of `test`, which are looked
        at once, when `Fit.held_out` is asked for.
    cycles : float, optional
        Period of the record, s: for the repeatability floor and the blocks of a bootstrap.
    search : {"hops", "local"}
        Hops (perturb, refine, keep the best) find the global minimum most often; ``"local"``
        refines the start values.
    bounds : mapping of str to (float, float), optional
        Lowest and highest values. By default a positive number is searched from a thousandth to a
        thousand times its start.
    seed : int
        Of the perturbations; a fit with the same arguments gives the same result.
    most_steps : int, optional
        Steps that one run of the search may take, at least one; by default 60 per row, at least
        200,000. The runs at the end, with smaller tolerances, may take ten times as many.
    smoothing : float, optional
        Time constant of the motion's smoothing spline, s; see `Record.motion`.
    begin : {"relaxed", "run in"}, optional
        What is before the first row: all deflections zero, or a first pass of the record's own
        motion. By default whichever fits the training rows better; see `Fit.begin`. Where a record
        is cut and nothing leads to its state (behind a gap in time), the state is found, too.
    weight : {"rows", "records"}, optional
        Whether each row counts alike, or each record; by default records if the longest has more
        than three times the rows of the shortest.
    progress : bool, optional
        Show a progress bar on standard error; by default if that is a terminal.

    Returns
    -------
    Fit
        Parameters with 95 % intervals, scores, and what the records cannot tell.

    Raises
    ------
    ParameterError
        If an argument breaks its rule, or no proposal could be run.
    RecordError
        If a record has too few rows, no motion, or no force.

    Examples
    --------
    >>> import numpy as np
    >>> from gms_fsm import LuGre, Prescribed, Record, Stribeck, simulate
    >>> truth = LuGre(sigma_0=2e4, sigma_1=0.0, sigma_2=30.0, stribeck=Stribeck(2.0, 3.0, 1e-2))
    >>> t = np.linspace(0.0, 2.0, 401)
    >>> v = 0.02 * np.sin(2 * np.pi * t)
    >>> run = simulate(truth, Prescribed((t, v)), 2.0, t_eval=t)
    >>> record = Record.from_arrays(time=t, velocity=v, force=run.F)
    >>> start = LuGre(sigma_0=1e4, sigma_1=0.0, sigma_2=0.0, stribeck=Stribeck(2.0, 3.0, 1e-2))
    >>> found = fit(record, start, free=["sigma_0", "sigma_2"], search="local")
    >>> round(found["sigma_0"].value), round(found["sigma_2"].value, 3)
    (20000, 30.0)
    """
    options = options_of(
        free=_names("free", free),
        tied=_names("tied", tied),
        nuisance=_names("nuisance", nuisance),
        linear=_names("linear", linear),
        measured=measured,
        drive=drive,
        train=window_of("train", train),
        test=window_of("test", test),
        cycles=cycles,
        search=search,
        bounds={} if bounds is None else bounds,
        seed=seed,
        most_steps=most_steps,
        smoothing=smoothing,
        begin=begin,
        weight=weight,
    )
    task = task_of(records, model, {} if fixed is None else fixed, options)
    return fitted(task, progress=progress)


# --------------------------------------------------------------------------- arguments
def options_of(**given: Any) -> FitOptions:
    """Check the arguments that do not depend on model and records."""
    for name, rule in (("cycles", "> 0"), ("smoothing", ">= 0")):
        if given[name] is not None:
            given[name] = checked_scalar(name, given[name], rule)
    options = FitOptions(**given)
    checked_integer("seed", options.seed, 0)
    if options.most_steps is not None:
        checked_integer("most_steps", options.most_steps, 1)
    one_of("search", options.search, SEARCHES)
    for name, value, known in (
        ("begin", options.begin, BEGINS),
        ("weight", options.weight, WEIGHTS),
    ):
        if value is not None:
            one_of(name, value, known)
    for name in options.nuisance:
        one_of("nuisance", name, tuple(NUISANCE))
        if options.nuisance.count(name) > 1:
            raise ParameterError(f"{name!r} is given twice", place="nuisance")
    wanted = "a mapping, for example {'C': (1e-5, 1e-2)}"
    checked_kind("bounds", options.bounds, Mapping, wanted)
    if not options.free:
        raise ParameterError(
            "nothing is to be found", place="free", advice="name parameters, for example ['k']"
        )
    return options


def _names(name: str, given: Any) -> tuple[str, ...]:
    """Return names as a tuple; one name may be given as a text."""
    names = [given] if isinstance(given, str) else listed(name, given, "names of parameters")
    for each in names:
        checked_kind(name, each, str, "names of parameters, for example ['k', 'weights']")
    return tuple(names)


def task_of(
    records: Record | Sequence[Record],
    model: Model | System,
    fixed: Mapping[str, ArrayLike],
    options: FitOptions,
) -> Task:
    """Return what is fitted to what, checked."""
    every = checked_records(records)
    names = {name: None for record in every for name in record.inputs}
    subject = _with_fixed(mounted_alone(model, inputs=names), fixed, options.free)
    task = Task(subject, tuple(every), options, begin=options.begin or MOVING)
    _ = task.unknowns  # raises errors of names and bounds
    if MASS in options.nuisance and task.measured.column != "force":
        raise ParameterError(
            f"{MASS!r} makes a force, and what is measured is a {task.measured.column}",
            place="nuisance",
            advice="leave it out",
        )
    for name in options.linear:
        if name not in known_in(subject):
            raise unknown("parameter", name, known_in(subject), place="linear")
    _check_records(task)
    _check_linear(task)
    return task


def _with_fixed(subject: Mounted, fixed: Any, free: tuple[str, ...]) -> Mounted:
    checked_kind("fixed", fixed, Mapping, "a mapping, for example {'v_c': 1e-6}")
    for name in fixed:
        if name not in known_in(subject):
            raise unknown("parameter", name, known_in(subject), place="fixed")
        if name in free:
            raise ParameterError(
                f"{name!r} is free, too", place="fixed", advice="leave it out of one of them"
            )
    return varied(subject, dict(fixed))


def _check_records(task: Task) -> None:
    """Refuse records from which nothing can be found."""
    column = task.measured.column
    for record in task.records:
        column_of(record, column)
    _check_loads(task)
    train, test = task.options.train, task.options.test
    if train is not None and test is not None and train[0] < test[1] and test[0] < train[1]:
        raise ParameterError(
            f"it is from {test[0]:g} s to {test[1]:g} s, and train from {train[0]:g} s to "
            f"{train[1]:g} s",
            place="test",
            advice="held-out rows must not be trained on",
        )
    for record in task.records:
        if not (training_rows(record, task.options) & record.chosen).any():
            what = "outside test" if train is None else f"from {train[0]:g} s to {train[1]:g} s"
            raise RecordError(
                f"no selected row is {what}",
                place=record.place,
                advice="change train=(from, to), or leave the record out",
            )
    times = [record.columns["time"][record.chosen] for record in task.records]
    if test is not None and not any(inside(each, test).any() for each in times):
        raise RecordError(
            f"no selected row is from {test[0]:g} s to {test[1]:g} s",
            place=task.records[0].place,
            advice="change test=(from, to)",
        )
    rows = sum(int(course.rows.sum()) for course in task.courses)
    most = max(FEWEST_ROWS, 2 * (len(task.unknowns) + len(task.options.nuisance)))
    if rows < most:
        raise RecordError(
            f"{rows} rows to train on are too few for {len(task.unknowns)} parameters",
            place=task.records[0].place,
            advice=f"give at least {most} rows, or free fewer parameters",
        )
    moving = any(np.ptp(course.v) > 0.0 for course in task.courses)
    if not moving:
        raise RecordError(
            "nothing moves in the rows to train on",
            place=task.records[0].place,
            advice="check the position (or velocity) column and its unit",
        )
    values = np.concatenate([course.measured[course.rows] for course in task.courses])
    if np.ptp(values) <= STILL * max(np.abs(values).max(), 1e-300):
        raise RecordError(
            f"the {column} is constant ({values[0]:.6g}) in the rows to train on",
            place=task.records[0].place,
            advice=f"check the {column} column and its unit",
        )


def _follows_position(record: Record) -> bool:
    """Return whether a force has the sign of what was given as a position, not of its velocity."""
    if "position" not in record.columns or "velocity" in record.columns:
        return False
    motion, rows = record.motion(), record.chosen
    force = record.columns["force"][rows]
    sign = np.sign(force - np.median(force))
    x, v = motion.position[rows], motion.velocity[rows]
    alike = [abs(float(np.mean(sign * np.sign(each - np.median(each))))) for each in (x, v)]
    return alike[0] > FOLLOWS and alike[1] < IGNORES


def _check_loads(task: Task) -> None:
    """Refuse records with loads that differ, if the model reads a load and is not given theirs."""
    given = [each.columns["normal"] for each in task.records if "normal" in each.columns]
    mean = [float(np.nanmean(each)) for each in given]
    if "N" in task.bound or "N" not in task.subject.bindable or len(mean) < 2:
        return
    if np.ptp(mean) > LOAD_DIFFERS * np.abs(mean).max():
        raise RecordError(
            f"its normal force is {mean[0]:.4g} N, that of others up to "
            f"{max(mean, key=lambda each: abs(each - mean[0])):.4g} N, and the model reads one N "
            "for all",
            place=task.records[0].place,
            advice="give each record's own: inputs={'N': ...} when making it",
        )


def _check_linear(task: Task) -> None:
    """Refuse parameters declared linear if the force of a run does not follow them linearly."""
    experiment, course = task.coarse, task.coarse.courses[0]
    known = linear_names(task.subject)
    for each in (one for one in experiment.solved if one.key not in known):
        here = task.subject
        value = value_of(here, each)
        there = varied(here, values_by_key(here, [each], [1.5 * value or 1.0]))
        start, other = experiment.coordinates.start, replace(experiment, subject=there)
        change = other.modelled_once(start, course) - experiment.modelled_once(start, course)
        # Where only the force depends on a parameter, no other term of it changes.
        sizes = np.array([1.0, *(abs(value_of(here, one)) for one in experiment.solved)])
        moved = float(np.abs(change[:, : sizes.size] * sizes).max())
        if moved > 1e-6 * experiment.typical:
            raise ParameterError(
                f"the force is not linear in {each.name!r}: with another value the elements move "
                "in another way",
                place="linear",
                advice="leave it out, and it is searched",
            )


# --------------------------------------------------------------------------- the search
def fitted(task: Task, *, progress: bool | None = False, intervals: bool = True) -> Fit:
    """Return the fit of a task."""
    began, stopped = time.perf_counter(), ""
    coarse, fine = Best(), Best()
    with ThreadPool() as pool:
        try:
            with bar("fit", progress) as told:
                coarse.told = told
                task = task.coarse_search(coarse, pool)
                if coarse.point is not None:
                    fine.take([task.fine.at(coarse.point.u)])
                    task.polish(coarse.point.u, fine, pool)
                told(1.0)
        except KeyboardInterrupt:
            stopped = STOPPED
            if coarse.point is None:
                raise
        if coarse.point is None:
            raise _nothing_ran(task.coarse.start_point().lost, "no proposal could be run")
        if not stopped and fine.point is not None:
            task, fine = _with_states(task, fine, pool)
        point = task.fine.at(coarse.point.u) if fine.point is None else fine.point
        final, point = _settled(task, point)
        if point.lost is not None:
            raise _nothing_ran(
                point.lost, "the best proposal ran on few rows, and not on all of them"
            )
        try:
            if intervals:
                again = 0 if stopped else AGAIN
                final, point, table = _assessed(final, point, pool, again)
            else:
                table = unassessed(final, point)
        except KeyboardInterrupt:
            stopped, table = STOPPED_LATE, unassessed(final, point)
    silent = [each.name for each in table.table if each.note == NO_INFLUENCE]
    own = [each.name for each in final.unknowns]
    if silent and len(silent) == len(own):
        raise ParameterError(
            f"the force in these records does not depend on {', '.join(silent)}",
            place="free",
            advice="free parameters that act in this motion: an element that never slips shows "
            "only its stiffness",
        )
    notes = _notes(task, silent)
    seconds = time.perf_counter() - began
    return Fit(final, point, table, notes, task.ran[0], seconds, stopped)


def _with_states(task: Task, best: Best, pool: ThreadPool) -> tuple[Task, Best]:
    """Return a task with the states in which cut records begin, and its best point."""
    for _ in range(ROUNDS):
        assert best.point is not None
        tau = correlation_time(stretches(task.courses, best.point.residual))
        other = with_states(task, best.point, tau)
        if other is task:
            return task, best
        found = Best()
        found.take([other.fine.at(best.point.u)])
        other.polish(best.point.u, found, pool)
        if found.point is None or found.point.cost >= best.point.cost:
            return task, best
        task, best = other, found
    return task, best


def _assessed(
    task: Task, point: Point, pool: ThreadPool, again: int
) -> tuple[Task, Point, Assessed]:
    """Return the table of a fit; a better point met on the way is searched from, and assessed."""
    table = assessed(task, point, pool)
    for _ in range(again):
        if table.better is None:
            break
        nearer = Best()
        nearer.take([point])
        task.polish(table.better.u, nearer, pool)
        if nearer.point is None or nearer.point is point:
            break
        moved, there = _settled(task, nearer.point)
        if there.lost is not None:
            break
        task, point, table = moved, there, assessed(moved, there, pool)
    return task, point, table


def _settled(task: Task, point: Point) -> tuple[Task, Point]:
    """Return a task that starts from the numbers found, elements in order, and its start."""
    found = sorted_elements(task.fine.fitted(point), task.unknowns, task.options.bounds)
    final = replace(task, subject=found)
    return final, final.fine.at(final.fine.coordinates.start)


def _nothing_ran(lost: GMSError | None, what: str) -> GMSError:
    return ParameterError(
        what if lost is None else f"{what}: {lost}",
        place="model",
        advice="give start values nearer to the truth, bounds, or a larger most_steps",
    )


def _notes(task: Task, silent: Sequence[str]) -> tuple[str, ...]:
    """Return what was done, for the user."""
    notes = []
    for record in task.records:
        notes += [f"{record.name}: {note}" for note in record.notes]
        for note in record.motion(task.options.smoothing).notes:
            notes.append(f"{record.name}: {note}")
    said = "" if task.options.begin else ", which fits the training rows better"
    if any(course.lead[0].size for course in task.courses):
        notes.append(
            "before each record the model runs in: a first pass of the record's own motion" + said
        )
    else:
        notes.append("each record begins with the initial state of the chart")
    # One record of several may be a spring, which does not slip.
    if task.measured.column == "force" and all(_follows_position(each) for each in task.records):
        for record in task.records:
            told = (
                f"{record.place}: the force has the sign of the position, as friction has that of "
                "a velocity; if the column is a velocity, give velocity= in place of position="
            )
            notes.append(told)
            warnings.warn(told, stacklevel=3)
    if task.starts:
        notes.append(f"the states in which {len(task.starts)} stretch(es) begin were found, too")
    if task.fine.weights:
        notes.append("each record counts alike, however long it is (weight)")
    unread = {name for record in task.records for name in record.inputs} - {*task.bound}
    if unread:
        notes.append(f"inputs that the model does not read: {', '.join(sorted(unread))}")
    if silent:
        notes.append(f"without influence on the force of these records: {', '.join(silent)}")
    return tuple(notes)
