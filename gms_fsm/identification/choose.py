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
from gms_fsm.foundation.arguments import checked_kind, listed, one_of, refusing
from gms_fsm.identification.candidates import CANDIDATES, Candidate, FitStart
from gms_fsm.identification.certainty.statistics import correlation_time
from gms_fsm.identification.fit import checked_records, fitted, options_of, task_of, window_of
from gms_fsm.identification.problem.experiment import Point
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
from gms_fsm.records.parts import only, thinned
from gms_fsm.records.record import Record
from gms_fsm.systems.mounted import mounted_alone

__all__ = ["choose", "period_of"]

FOLDS = ("record", "cycles")
BLOCKS = 4  # of time, where a record is folded by its cycles
ROWS, FEWEST_ROWS = 4000, 300  # of all records together, and of each, for comparing candidates
STEP, EVALUATIONS = 1e-3, 10  # of the refinement in a fold
REPEATS = 0.5  # least autocorrelation of a motion that repeats
NEARLY = 0.1  # of a cycle may be missing at the end
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
    fold: Literal["record", "cycles"] | None = None,
    cycles: float | None = None,
    train: tuple[float, float] | None = None,
    test: tuple[float, float] | None = None,
    smoothing: float | None = None,
    seed: int = 0,
    most_steps: int | None = None,
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
        `gms_fsm.identification.candidates.CANDIDATES`.
    fold : {"record", "cycles"}, optional
        What is left out: one record at a time, or one of four stretches of each record, which begin
        where the motion repeats. By default records if there are several.
    cycles : float, optional
        Period of the motion, s; by default that of its autocorrelation.
    train, test, smoothing, seed, most_steps, progress
        As in `fit`.

    Returns
    -------
    Fit
        With ``choice``: a row for each candidate, with its error on what was left out.

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
    every = _checked_records(records)
    common = options_of(
        free=("k",),  # each candidate has its own
        train=window_of("train", train),
        test=window_of("test", test),
        cycles=cycles,
        smoothing=smoothing,
        seed=seed,
        most_steps=most_steps,
        search="hops",
        begin=None,
        nuisance=("offset",),
        bounds={},
    )
    tried = _checked_candidates(candidates)
    seen = [_training_rows(record, common) for record in every]
    enough = max(FEWEST_ROWS, ROWS // len(seen))
    folds = _folds([thinned(each, enough) for each in seen], fold, common)
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
    rows += [each.row(effective) for each in results]
    order = {each.name: i for i, each in enumerate(tried)}
    rows.sort(key=lambda row: order[row.name])
    fit = _final(best, every, common)
    choice = Choice(tuple(rows), best.name)
    fit = fit.with_choice(choice, time.perf_counter() - began)
    return replace(fit, stopped=stopped) if stopped else fit


# --------------------------------------------------------------------------- arguments
def _checked_records(records: Any) -> list[Record]:
    given = checked_records(records)
    for each in given:
        if "force" not in each.columns:
            raise RecordError(
                "it has no force, with which to compare",
                place=each.place,
                advice="give force=(name, unit) when reading it",
            )
    return given


def _checked_candidates(given: Any) -> list[Candidate]:
    """Return candidates; those of the user start from their own model."""
    if given is None:
        return list(CANDIDATES)
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


@dataclass(frozen=True, eq=False)
class _Folds:
    """What is fitted to and what is left out, in few rows.

    Parameters
    ----------
    all : tuple of Record
        Everything.
    parts : tuple of (tuple of Record, tuple of Record)
        Fitted to, and left out.
    """

    all: tuple[Record, ...]
    parts: tuple[tuple[tuple[Record, ...], tuple[Record, ...]], ...]


def _folds(records: Sequence[Record], fold: Any, options: FitOptions) -> _Folds:
    if fold is None:
        fold = FOLDS[0] if len(records) > 1 else FOLDS[1]
    one_of("fold", fold, FOLDS)
    every = tuple(records)
    if fold == "record":
        if len(every) < 2:
            raise ParameterError(
                "there is only one record",
                place="fold",
                value=fold,
                advice="give several, or fold='cycles'",
            )
        parts = [(every[:i] + every[i + 1 :], (every[i],)) for i in range(len(every))]
        return _Folds(every, tuple(parts))
    blocks = [_blocks(record, options.cycles) for record in every]
    count = min(int(block.max()) + 1 for block in blocks)
    return _Folds(
        every,
        tuple(
            (
                tuple(
                    only(record, block % count != i)
                    for record, block in zip(every, blocks, strict=True)
                ),
                tuple(
                    only(record, block % count == i)
                    for record, block in zip(every, blocks, strict=True)
                ),
            )
            for i in range(count)
        ),
    )


def _blocks(record: Record, cycles: float | None) -> Any:
    """Return for each row the number of its block, from 0; blocks begin where cycles do."""
    t = record.columns["time"]
    period = cycles or period_of(t[record.chosen], record.columns["position"][record.chosen])
    if period is None:
        raise RecordError(
            "its motion does not repeat",
            place=record.place,
            advice="give cycles=period (s), or several records and fold='record'",
        )
    first, last = t[record.chosen][[0, -1]]
    whole = int((last - first) / period + NEARLY)
    if whole < 2:
        raise RecordError(
            f"its training rows last {last - first:.4g} s, less than two cycles of {period:.4g} s",
            place=record.place,
            advice="give a longer record or train, a shorter cycles=..., or several records and "
            "fold='record'",
        )
    count = min(BLOCKS, whole)
    borders = first + period * np.round(np.arange(1, count) * whole / count)
    return np.searchsorted(borders, t, side="right")


def period_of(t: FloatArray, x: FloatArray) -> float | None:
    """Return the period of a motion, from the autocorrelation of its position.

    Parameters
    ----------
    t : ndarray, shape (rows,)
        Times, s.
    x : ndarray, shape (rows,)
        Positions, m.

    Returns
    -------
    float or None
        s; None if it does not repeat within the record.

    Examples
    --------
    >>> t = np.arange(0.0, 30.0, 0.01)
    >>> round(period_of(t, np.sin(2 * np.pi * t / 4.0)), 3)
    4.0
    """
    even = np.linspace(t[0], t[-1], t.size)
    values = np.interp(even, t, x)
    values = values - values.mean()
    size = 1 << (2 * values.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(values, size)) ** 2
    lags = np.arange(values.size // 2 + 1)
    similar = np.fft.irfft(spectrum, size)[lags] / (values.size - lags)
    if similar[0] <= 0.0:
        return None
    similar /= similar[0]
    below = np.flatnonzero(similar < 0.0)
    if not below.size:
        return None
    after = similar[below[0] :]
    best = int(np.argmax(after))
    if after[best] < REPEATS:
        return None
    # The first of the peaks that are as high: later ones are multiples of the period.
    high = int(np.argmax(after > after[best] - 0.5 * (1.0 - REPEATS)))
    falls = np.flatnonzero(np.diff(after[high:]) < 0.0)
    peak = float(below[0] + high + (int(falls[0]) if falls.size else 0))
    # The ends of a short record shift the peak; a distance of many cycles does not depend on them.
    many = 1
    while many * peak < 0.5 * values.size:
        reach = max(2.0, 0.1 * peak)
        near = np.arange(round(many * peak - reach), round(many * peak + reach) + 1)
        near = near[(near > 0) & (near < values.size)]
        apart = [float(np.mean((values[lag:] - values[:-lag]) ** 2)) for lag in near]
        peak, many = float(near[int(np.argmin(apart))]) / many, 2 * many
    return float(peak * (even[1] - even[0]))


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

    def row(self, effective: float) -> ChoiceRow:
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
        )


def _try(
    candidate: Candidate,
    records: Sequence[Record],
    folds: _Folds,
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
        scored = [_scored(task, point, kept, left, pool) for kept, left in folds.parts]
    except GMSError as error:
        seconds = time.perf_counter() - began
        nothing = math.nan
        return ChoiceRow(
            candidate.name, candidate.reason, 0, nothing, nothing, nothing, seconds, str(error)
        )
    parts = stretches(task.coarse.courses, point.residual)
    force = np.concatenate([each.columns["force"][each.chosen] for each in folds.all])
    return _Tried(
        candidate,
        start,
        task,
        point,
        np.array([squares for squares, _ in scored]),
        np.array([count for _, count in scored]),
        float(np.var(force)),
        max(point.residual.size / correlation_time(parts), 2.0),
        time.perf_counter() - began,
    )


def _scored(
    task: Task, point: Point, kept: tuple[Record, ...], left: tuple[Record, ...], pool: ThreadPool
) -> tuple[float, float]:
    """Return the sum of squares and the number of rows on what was left out."""
    own = replace(task, records=kept)
    refined = refine(own.coarse, point.u, STEP, EVALUATIONS, pool)
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
    rows = best.counts.sum()

    def is_as_good(other: _Tried) -> bool:
        worse = other.squares - best.squares
        excess = worse.sum() / rows
        scatter = worse - excess * best.counts
        folds = worse.size
        error = math.sqrt(folds / (folds - 1) * float(scatter @ scatter)) / rows
        return bool(excess <= error)

    good = [each for each in results if is_as_good(each)]
    return min(good, key=lambda each: (each.free, each.mean))


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
    model = best.task.coarse.fitted(best.point).made_of
    return fitted(task_of(records, model, {}, own))
