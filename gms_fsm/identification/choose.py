"""choose(): which kind of model predicts what was left out, and that model fitted to all rows.

Every candidate is searched on the training rows, then refined on all but one fold at a time and
scored on the fold left out. The motion of a left-out part may be run through, its force is not
read; but the start of a refinement has seen all training rows, so that the scores compare
candidates and do not replace a test. The rows of `test` are read by `Fit.held_out` alone.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import GMSError, ParameterError, RecordError, shown
from gms_fsm.foundation.arguments import checked_kind, listed, refusing
from gms_fsm.identification.candidates import CANDIDATES, Candidate, FitStart
from gms_fsm.identification.certainty.assess import AT_BOUND, Estimate
from gms_fsm.identification.certainty.statistics import correlation_time
from gms_fsm.identification.fit import fitted, options_of, task_of
from gms_fsm.identification.folds import Folds, Parts, folds_of
from gms_fsm.identification.joints import joint_candidates
from gms_fsm.identification.problem.arguments import checked_records, column_of, window_of
from gms_fsm.identification.problem.experiment import Point, value_of
from gms_fsm.identification.problem.runs import ThreadPool
from gms_fsm.identification.problem.search import Best, refine
from gms_fsm.identification.problem.task import (
    FitOptions,
    Task,
    at_all_rows,
    bar,
    stretches,
    training_rows,
)
from gms_fsm.identification.problem.unknowns import unknowns_of
from gms_fsm.identification.result import Choice, ChoiceRow, Fit
from gms_fsm.records.parts import thinned
from gms_fsm.records.record import Record
from gms_fsm.systems.mounted import mounted_alone

__all__ = ["choose", "simplest"]

ROWS, FEWEST_ROWS = 4000, 300  # of all records together, and of each, for comparing candidates
RISE = 0.01  # of the error, for which a term is given up
STEP, EVALUATIONS = 1e-3, 10  # of the refinement in a fold
INTERRUPTED = "The choice was interrupted: {done} of {all} candidates were compared."


@refusing(
    ParameterError,
    'models are candidates=[(name, model, free)], for example ("one element", model, ["k", "C"])',
    instead={"models": "candidates", "model": "candidates"},
)
def choose(
    records: Record | Sequence[Record],
    *,
    candidates: Any = None,
    fold: Literal["record", "cycles", "amplitude", "speed"] | None = None,
    cycles: float | None = None,
    train: tuple[float, float] | None = None,
    test: tuple[float, float] | None = None,
    smoothing: float | None = None,
    seed: int = 0,
    most_steps: int | None = None,
    weight: Literal["rows", "records"] | None = None,
    progress: bool | None = None,
) -> Fit:
    """Compare kinds of models on what each has not seen; return the best, fitted to all rows.

    Of all candidates whose squared error on the folds left out exceeds the lowest by no more than
    its standard error (of the differences between folds), the one with the fewest unknowns is
    chosen. Candidates are compared on some thousand rows. Ctrl-C chooses among those compared so
    far.

    Parameters
    ----------
    records : Record or sequence of Record
        With a force; several are one experiment.
    candidates : sequence of Candidate or of (name, model, free), or mapping, optional
        What to try; of a mapping the values are ``(model, free)``. By default
        `gms_fsm.identification.candidates.CANDIDATES`, or for records that give inputs those of
        `gms_fsm.identification.joints.JOINTS` that read no others.
    fold : {"record", "cycles", "amplitude", "speed"}, optional
        What is left out: one record at a time; one of four stretches of each record, which begin
        where the motion repeats; or all records of one amplitude, or of one speed. By default
        records if there are several. The scores by amplitude and by speed are in the rows of the
        choice in any case: they tell how a model fares beyond what it has seen.
    cycles : float, optional
        Period of the motion, s; by default that of its autocorrelation.
    train, test, smoothing, seed, most_steps, weight, progress
        As in `fit`.

    Returns
    -------
    Fit
        With ``choice``: a row for each candidate, with its error on what was left out, and why it
        was not chosen. Terms that the records cannot tell are left out of the chosen model if the
        error rises by less than 1 %, see `simplest`.

    Raises
    ------
    ParameterError
        If an argument breaks its rule, or no candidate could be fitted.
    RecordError
        If a record has no force, or cannot be folded.

    Examples
    --------
    >>> from gms_fsm.identification.bank import stop_operators
    >>> from gms_fsm.identification.candidates import stiffer_one_way
    >>> t = np.linspace(0.0, 20.0, 801)
    >>> x = 1e-3 * np.sin(2 * np.pi * t / 2.5 + 1.0)
    >>> noise = 0.02 * np.random.default_rng(0).standard_normal(t.size)
    >>> force = stop_operators(x, [1e-4]) @ [1e4] + noise
    >>> record = Record.from_arrays(time=t, position=x, force=force)
    >>> banks = {n: stiffer_one_way([record], None, n=n).model for n in (1, 2)}
    >>> kinds = {f"{n} springs": (bank, ["k", "z_c"]) for n, bank in banks.items()}
    >>> found = choose(record, candidates=kinds, cycles=2.5)
    >>> found.choice.chosen
    '1 springs'
    """
    every = checked_records(records)
    for each in every:
        column_of(each, "force")
    common = options_of(
        free=("k",),  # each candidate has its own
        train=window_of("train", train),
        test=window_of("test", test),
        cycles=cycles,
        smoothing=smoothing,
        seed=seed,
        most_steps=most_steps,
        weight=weight,
    )
    tried = _checked_candidates(candidates, every)
    seen = [_training_rows(record, common) for record in every]
    enough = max(FEWEST_ROWS, ROWS // len(seen))
    folds = folds_of([thinned(each, enough) for each in seen], fold, common)
    began = time.perf_counter()
    results: list[_Tried] = []
    rows: list[ChoiceRow] = []
    stopped = ""
    with ThreadPool() as pool, bar("choose", progress) as told:
        try:
            for done, candidate in enumerate(tried):
                told(done / (len(tried) + 1))
                found = _try(candidate, seen, folds, common, pool)
                if isinstance(found, ChoiceRow):
                    rows.append(found)
                else:
                    results.append(found)
        except KeyboardInterrupt:
            if not results:
                raise
            stopped = INTERRUPTED.format(done=len(results) + len(rows), all=len(tried))
        if not results:
            raise ParameterError(
                f"no candidate could be fitted ({rows[0].name}: {rows[0].note})",
                place="candidates",
                advice="look at the records, or give other candidates",
            )
        told(len(tried) / (len(tried) + 1))
    best = _chosen(results)
    effective = min(results, key=lambda each: each.mean).effective
    rows += [each.row(effective, _why(each, best)) for each in results]
    order = {each.name: i for i, each in enumerate(tried)}
    rows.sort(key=lambda row: order[row.name])
    fit = _final(best, every, common)
    choice = Choice(tuple(rows), best.name)
    fit = fit.with_choice(choice, time.perf_counter() - began)
    return replace(fit, stopped=stopped) if stopped else fit


# --------------------------------------------------------------------------- arguments
def _checked_candidates(given: Any, records: Sequence[Record]) -> list[Candidate]:
    """Return candidates; those of the user start from their own model."""
    if given is None:  # loads and temperatures tell of a joint
        joint = all(each.inputs for each in records)
        return list(joint_candidates(records) if joint else CANDIDATES)
    wanted = "candidates: Candidate(...), or (name, model, free)"
    if isinstance(given, Mapping):
        given = [(name, *_parts(name, value, 2)) for name, value in given.items()]
    found = []
    for i, each in enumerate(listed("candidates", given, wanted)):
        if isinstance(each, Candidate):
            found.append(each)
            continue
        name, model, free = _parts(f"candidates[{i}]", each, 3)
        checked_kind(f"name of candidates[{i}]", name, str, "a text")
        names = (free,) if isinstance(free, str) else tuple(listed("free", free, "names"))
        what = mounted_alone(model, f"model of candidate {shown(name)}")
        try:
            unknowns_of(what, names, (), {})
        except GMSError as error:
            raise error.inside(f"candidate {shown(name)}") from None
        found.append(Candidate(name, "given", _given(FitStart(model, names))))
    if not found:
        raise ParameterError("there is none", place="candidates", advice="give at least one")
    called = [each.name for each in found]
    for name in called:
        if called.count(name) > 1:
            raise ParameterError(f"two are called {shown(name)}", place="candidates")
    return found


def _parts(name: object, given: Any, count: int) -> tuple[Any, ...]:
    if not isinstance(given, tuple | list) or len(given) != count:
        raise ParameterError(
            f"it must be {'(name, model, free)' if count == 3 else '(model, free)'}",
            place=f"candidate {shown(name)}",
            value=given,
        )
    return tuple(given)


def _given(start: FitStart) -> Any:
    return lambda _records, _smoothing: start


# --------------------------------------------------------------------------- rows and folds
def _training_rows(record: Record, options: FitOptions) -> Record:
    """Return a record up to its last training row, of which only training rows are selected.

    Its motion is that of the whole record, smoothed.
    """
    chosen = record.chosen & training_rows(record, options)
    if not chosen.any():
        raise RecordError(
            "no selected row is in train", place=record.place, advice="change train=(from, to)"
        )
    last = int(np.flatnonzero(chosen)[-1]) + 1
    motion = record.motion(options.smoothing)
    columns = {
        "time": motion.time[:last],
        "position": motion.position[:last],
        "velocity": motion.velocity[:last],
        "force": record.columns["force"][:last],
    } | {name: value[:last] for name, value in record.inputs.items()}
    return replace(record, columns=columns, chosen=chosen[:last], rows=record.rows[:last])


# --------------------------------------------------------------------------- candidates
@dataclass(frozen=True, eq=False)
class _Tried:
    """A candidate, searched and scored."""

    candidate: Candidate
    start: FitStart
    task: Task
    point: Point
    squares: FloatArray  # of the errors on each fold left out, N^2, shape (folds,)
    counts: FloatArray  # rows of each fold
    variance: float  # of the force on what was left out, N^2
    effective: float
    seconds: float
    others: Mapping[str, float]  # RMSE of folds by amplitude and by speed

    @property
    def name(self) -> str:
        return self.candidate.name

    @property
    def free(self) -> int:
        return len(self.task.unknowns) + len(self.task.options.nuisance)

    @property
    def mean(self) -> float:
        """Mean squared error on what was left out."""
        return float(self.squares.sum() / self.counts.sum())

    def row(self, effective: float, why: str) -> ChoiceRow:
        residual = self.point.residual
        cost = max(float(residual @ residual) / residual.size, 1e-300)
        bic = effective * math.log(cost) + self.free * math.log(max(effective, 2.0))
        return ChoiceRow(
            self.name,
            self.candidate.reason,
            self.free,
            math.sqrt(self.mean),
            1.0 - self.mean / self.variance if self.variance else math.nan,
            bic,
            self.seconds,
            "",
            why,
            self.others.get("amplitude", math.nan),
            self.others.get("speed", math.nan),
        )


def _try(
    candidate: Candidate,
    records: Sequence[Record],
    folds: Folds,
    options: FitOptions,
    pool: ThreadPool,
) -> _Tried | ChoiceRow:
    """Search a candidate on all training rows, then refine and score it fold by fold."""
    began = time.perf_counter()
    try:
        start = candidate.build(records, None)  # their motion is smoothed already
        # In few rows: their velocity is that of the motion, smoothed already.
        here = replace(
            options,
            free=start.free,
            tied=start.tied,
            bounds=start.bounds,
            train=None,
            test=None,
            smoothing=None,
        )
        task = task_of(folds.all, start.model, {}, here)
        best = Best()
        task = task.coarse_search(best, pool)
        if best.point is None:
            lost = task.coarse.start_point().lost
            raise lost if lost is not None else ParameterError("no proposal could be run")
        point = best.point

        def scored(parts: Parts) -> tuple[FloatArray, FloatArray]:
            found = np.array([_scored(task, point, candidate, *part, pool) for part in parts])
            return found[:, 0], found[:, 1]

        squares, counts = scored(folds.parts)
        others = {}
        for name, parts in folds.others.items():
            sums, rows = scored(parts)
            others[name] = math.sqrt(float(sums.sum() / rows.sum()))
    except GMSError as error:
        seconds, nothing = time.perf_counter() - began, math.nan
        name, reason, note = candidate.name, candidate.reason, str(error)
        return ChoiceRow(name, reason, 0, nothing, nothing, nothing, seconds, note, "failed")
    tau = correlation_time(stretches(task.coarse.courses, point.residual))
    force = np.concatenate([each.columns["force"][each.chosen] for each in folds.all])
    return _Tried(
        candidate,
        start,
        task,
        point,
        squares,
        counts,
        float(np.var(force)),
        max(point.residual.size / tau, 2.0),
        time.perf_counter() - began,
        others,
    )


def _scored(
    task: Task,
    point: Point,
    candidate: Candidate,
    kept: tuple[Record, ...],
    left: tuple[Record, ...],
    pool: ThreadPool,
) -> tuple[float, float]:
    """Return the sum of squares and the number of rows on what was left out.

    A candidate without a search is built anew from the rest.
    """
    own = replace(task, records=kept)
    if task.coarse.searched:
        refined = refine(own.coarse, point.u, STEP, EVALUATIONS, pool)
    else:
        start = candidate.build(kept, None)
        options = replace(task.options, free=start.free, tied=start.tied, bounds=start.bounds)
        own = replace(task_of(kept, start.model, {}, options), begin=task.begin)
        refined = own.coarse.start_point()
    if refined.lost is not None:
        raise refined.lost
    squares, count = 0.0, 0
    for record in left:
        modelled = at_all_rows(own.coarse, refined, own.along(record, None))
        error = (modelled - record.columns["force"])[record.chosen]
        error = error[np.isfinite(error)]
        squares, count = squares + float(error @ error), count + error.size
    return squares, float(count)


def _chosen(results: Sequence[_Tried]) -> _Tried:
    """Return the candidate with the fewest unknowns within one standard error of the best."""
    best = min(results, key=lambda each: each.mean)
    good = [each for each in results if _is_as_good(each, best)]
    return min(good, key=lambda each: (each.free, each.mean))


def _is_as_good(other: _Tried, best: _Tried) -> bool:
    """Return whether it is within one standard error of another, of the differences of folds."""
    rows, folds = best.counts.sum(), best.counts.size
    worse = other.squares - best.squares
    excess = worse.sum() / rows
    scatter = worse - excess * best.counts
    error = math.sqrt(folds / (folds - 1) * float(scatter @ scatter)) / rows
    return bool(excess <= error)


def _why(each: _Tried, chosen: _Tried) -> str:
    """Say why a candidate was not chosen."""
    if each is chosen:
        return "chosen"
    share = math.sqrt(each.mean / chosen.mean) - 1.0
    means = each.squares / each.counts > chosen.squares / chosen.counts
    worse = f"in {int(means.sum())} of {means.size} folds"
    if share > 0.0 and each.free >= chosen.free:
        return f"{share:.0%} worse on what was left out, {worse}"
    if share > 0.0:
        return f"{share:.0%} worse on what was left out, {worse}, though with fewer unknowns"
    return (
        f"{-share:.0%} better on what was left out, which is within the scatter of folds, with "
        f"{each.free - chosen.free} more unknowns"
    )


def _final(best: _Tried, records: Sequence[Record], options: FitOptions) -> Fit:
    """Return the chosen model, refined on all training rows."""
    own = replace(
        options,
        free=best.start.free,
        tied=best.start.tied,
        bounds=best.start.bounds,
        search="local",
        begin=best.task.begin,
    )
    if best.task.coarse.searched:
        model = best.task.coarse.fitted(best.point).made_of
    else:  # all rows tell more terms than a few
        start = best.candidate.build(records, options.smoothing)
        model, own = start.model, replace(own, free=start.free)
    return simplest(fitted(task_of(records, model, {}, own)))


# --------------------------------------------------------------------------- simpler
def simplest(fit: Fit) -> Fit:
    """Return a fit without terms that cannot be told or stand at a bound.

    One after the other is left out, that which is missed least first, and the rest fitted anew, as
    long as the error rises by less than 1 %; what is left is then judged again. What the force is
    linear in becomes 0, any other number keeps its value and is no longer found.

    Parameters
    ----------
    fit : Fit
        From `gms_fsm.fit`.

    Returns
    -------
    Fit
        With fewer unknowns, and a note on each that is gone; the same fit if there are none.

    Raises
    ------
    ParameterError
        If it is not a fit.

    Examples
    --------
    >>> from gms_fsm import LuGre, Stribeck, fit
    >>> t = np.linspace(0.0, 4.0, 201)
    >>> v = 0.02 * np.sin(t)
    >>> record = Record.from_arrays(time=t, velocity=v, force=np.tanh(500.0 * v))
    >>> curve = Stribeck(1.0, 1.05, 1e-2)
    >>> bristle = LuGre(sigma_0=5e3, sigma_1=0.0, sigma_2=0.0, stribeck=curve)
    >>> found = fit(record, bristle, free=["sigma_0", "sigma_2"], search="local")
    >>> len(simplest(found).table) < len(found.table)
    True
    """
    checked_kind("fit", fit, Fit, "a Fit, from gms_fsm.fit")
    gone = list[str]()
    with ThreadPool() as pool:
        while weak := [each for each in fit.table if not each.told or each.note == AT_BOUND]:
            task, without = _lighter(fit, weak, pool)
            if not without:
                break
            smaller = fitted(replace(task, options=replace(task.options, search="local")))
            if smaller.point.cost > _most(fit.point):
                break
            fit, gone = replace(smaller, choice=fit.choice), [*gone, *without]
    if not gone:
        return fit
    told = f"left out, as the records cannot tell them: {', '.join(gone)}"
    return replace(fit, notes=(*fit.notes, told))


def _most(point: Point) -> float:
    """Return the cost up to which a smaller model is as good."""
    return point.cost * (1.0 + RISE) ** 2


def _lighter(fit: Fit, weak: Sequence[Estimate], pool: ThreadPool) -> tuple[Task, list[str]]:
    """Return the task without as many weak terms as may go on few rows, and which went."""
    task, gone = fit.task, list[str]()
    most = _most(task.coarse.start_point())
    tries = list[tuple[float, int]]()
    for i, each in enumerate(weak):
        try:
            tries.append((_without(task, each)[0].coarse.start_point().cost, i))
        except GMSError:  # nothing would be left
            continue
    for _, i in sorted(tries):
        try:
            other, what = _without(task, weak[i])
        except GMSError:
            continue
        start = other.coarse.coordinates.start
        point = refine(other.coarse, start, STEP, EVALUATIONS, pool)
        if point.lost is None and point.cost <= most:
            task = replace(other, subject=other.coarse.fitted(point))
            gone.append(what)
    return task, gone


def _without(task: Task, each: Estimate) -> tuple[Task, str]:
    """Return the task without a term, and what became of it."""
    if each.name in task.options.nuisance:
        kept = tuple(name for name in task.options.nuisance if name != each.name)
        return replace(task, options=replace(task.options, nuisance=kept)), each.name
    unknown = next(one for one in task.unknowns if one.name == each.name)
    linear = any(one.name == each.name for one in task.fine.solved)
    zero = linear and not unknown.parameter.rule.startswith("> 0")
    value = 0.0 if zero else value_of(task.subject, unknown)
    if len(task.unknowns) < 2:
        raise ParameterError("nothing would be left", place="free")
    other = task.without(each.name, value)
    return other, each.name if zero else f"{each.name} (held at {value:.4g} {each.unit})".rstrip()
