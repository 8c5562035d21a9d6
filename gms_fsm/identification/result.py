"""The result of a fit: parameters with honest intervals, and what to ask of it next."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.errors import ParameterError, RecordError
from gms_fsm.foundation.arguments import (
    checked_integer,
    checked_kind,
    checked_path,
    listed,
    refusing,
    unknown,
)
from gms_fsm.foundation.display import asked, displayed
from gms_fsm.foundation.extras import missing
from gms_fsm.foundation.text import visible
from gms_fsm.identification.certainty.assess import Assessed, Estimate
from gms_fsm.identification.certainty.compared import (
    Choice,
    ChoiceRow,
    FitComparison,
    compared,
    lines_of,
    score_of,
)
from gms_fsm.identification.certainty.intervals import Bootstrap, bootstrapped, profiled
from gms_fsm.identification.certainty.profile import Profile
from gms_fsm.identification.certainty.residuals import Residuals, floor_of, residuals_of
from gms_fsm.identification.problem.arguments import column_of
from gms_fsm.identification.problem.experiment import Point
from gms_fsm.identification.problem.runs import BEGINS, MOVING
from gms_fsm.identification.problem.task import Task
from gms_fsm.identification.reach import Reach, outside, predicted, reach_of, without_change
from gms_fsm.records.record import Record
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import System

__all__ = ["Choice", "ChoiceRow", "Estimate", "Fit", "FitComparison", "Residuals", "score_of"]


@refusing()
@displayed("html")
@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """A model with parameters found from records, their intervals, and what the data cannot tell.

    Made by `fit` and `choose`.

    Attributes
    ----------
    task : Task
        What was fitted to what; its model has the values found.
    point : Point
        These values, evaluated on all training rows.
    assessed : Assessed
        The table and the covariance.
    notes : tuple of str
        What was done, for the user.
    runs : int
        Number of runs made.
    seconds : float
        Time taken.
    stopped : str
        Empty, or why the search ended early.
    choice : Choice or None
        How the model was chosen.
    """

    task: Task
    point: Point
    assessed: Assessed
    notes: tuple[str, ...] = ()
    runs: int = 0
    seconds: float = 0.0
    stopped: str = ""
    choice: Choice | None = field(default=None)

    # ------------------------------------------------------------------ what was found
    @property
    def model(self) -> Model | System:
        """The model, or the system, with the values found."""
        return self.task.subject.made_of

    @property
    def title(self) -> str:
        """The title of the model, or the name of the system."""
        return self.task.subject.title

    @property
    def table(self) -> tuple[Estimate, ...]:
        """One row per parameter: value, 95 % interval, unit, and whether it can be told."""
        return self.assessed.table

    def __getitem__(self, name: str) -> Estimate:
        for each in self.table:
            if each.name == name:
                return each
        raise unknown("parameter", name, (each.name for each in self.table), place="fit")

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the values, shape (p, p), in the order of `table`."""
        return self.assessed.covariance

    @property
    def correlation_time(self) -> float:
        """Correlation time of the noise in rows, if it is AR(1): ``(1 + rho) / (1 - rho)``."""
        return self.assessed.certainty.tau

    @property
    def effective_rows(self) -> float:
        """The number of training rows over their correlation time."""
        return self.assessed.certainty.effective

    @property
    def open(self) -> tuple[str, ...]:
        """Names of the parameters that cannot be told from these records."""
        return tuple(each.name for each in self.table if not each.told)

    @property
    def weakest(self) -> str:
        """What is determined, what is not, and the weakest direction, in words."""
        return self.assessed.weakest

    @property
    def open_profiles(self) -> tuple[Profile, ...]:
        """Of each parameter that cannot be told and has an influence: how little it matters.

        Values that fit nearly as well, met on a walk; `profile` searches all others again.
        """
        return self.assessed.open_profiles

    @cached_property
    def never_slipped(self) -> tuple[int, ...]:
        """Elements, from 1, that keep their initial state from the first training row to the last.

        Whatever a record does before these rows, in them such an element acts as a spring.
        """
        return without_change(self.task.fine, self.task.subject)

    # ------------------------------------------------------------------ how it was found
    @property
    def records(self) -> tuple[Record, ...]:
        """The records."""
        return self.task.records

    @property
    def train(self) -> tuple[float, float] | None:
        """The times that were trained on, s; None for all."""
        return self.task.options.train

    @property
    def test(self) -> tuple[float, float] | None:
        """The times that were held out, s."""
        return self.task.options.test

    @property
    def cycles(self) -> float | None:
        """The period of the records, s."""
        return self.task.options.cycles

    @property
    def smoothing(self) -> float | None:
        """Time constant of the motion's smoothing spline, s."""
        return self.task.options.smoothing

    @property
    def begin(self) -> str:
        """What is before the first row of a record: ``"relaxed"`` or ``"run in"``."""
        return BEGINS[1] if self.task.begin == MOVING else self.task.begin

    @property
    def measured(self) -> str:
        """What of the model was compared with the record."""
        return self.task.options.measured

    @property
    def nuisance(self) -> tuple[str, ...]:
        """The terms of the measurement that are no part of the model."""
        return self.task.options.nuisance

    # ------------------------------------------------------------------ scores
    @cached_property
    def training(self) -> dict[str, float]:
        """Score on the training rows: ``rmse``, ``r2``, ``rows``."""
        fine = self.task.fine
        target = fine.unweighted(fine.target)
        return score_of(target, target + fine.unweighted(self.point.residual))

    @cached_property
    def held_out(self) -> dict[str, float] | None:
        """Score on the rows of `test`; None without any."""
        if self.test is None:
            return None
        parts = [(each.measured[each.held], each.modelled[each.held]) for each in self.residuals()]
        measured, modelled = (np.concatenate(each) for each in zip(*parts, strict=True))
        return score_of(measured, modelled) if measured.size else None

    @cached_property
    def floor(self) -> float | None:
        """Repeatability: distance of cycles from their mean; None if `cycles` was not given."""
        if self.cycles is None:
            return None
        return floor_of(self.task, self.cycles)

    def bic(self, effective: float | None = None) -> float:
        """Return the Bayesian information criterion on effective rows; lower is better.

        Parameters
        ----------
        effective : float, optional
            Number of rows; by default `effective_rows`. Fits are only comparable on the same one.

        Returns
        -------
        float
            ``n * log(mean square) + p * log(n)``.
        """
        rows = self.effective_rows if effective is None else effective
        rows = max(checked_scalar("effective", rows, "> 0"), 2.0)
        mean = self.point.cost / self.point.residual.size
        return rows * math.log(max(mean, 1e-300)) + len(self.table) * math.log(rows)

    def residuals(self, which: int | None = None) -> list[Residuals]:
        """Return measurement and model at all rows.

        Parameters
        ----------
        which : int, optional
            Number of one record, from 0; all of them by default.

        Returns
        -------
        list of Residuals
            One per record.
        """
        if which is None:
            return list(self._residuals)
        checked_integer("which", which, 0)
        if which >= len(self.records):
            raise ParameterError(
                f"there are {len(self.records)} records, counted from 0",
                place="which",
                value=which,
            )
        return [self._residuals[which]]

    @cached_property
    def _residuals(self) -> tuple[Residuals, ...]:
        return tuple(residuals_of(self.task, self.point))

    def predict(
        self,
        record: Record,
        initial: Literal["estimate"] | Mapping[str, Any] | None = None,
        lead: float = 1.0,
    ) -> FloatArray:
        """Return what the fitted model gives for the motion of a record.

        Parameters
        ----------
        record : Record
            With a position or a velocity, and the inputs that the model reads. Its force is not
            read but for ``initial="estimate"``.
        initial : {"estimate"} or mapping, optional
            The state at the first row: found from the force of the first seconds, near the default
            or a state of the training; or given as in `gms_fsm.simulate`. By default that of the
            fit: relaxed, or after a run-in.
        lead : float
            From how many seconds a state is estimated.

        Returns
        -------
        ndarray, shape (rows,)
            The force, N, with the nuisance terms (or what else was measured).

        Raises
        ------
        RecordError
            If it has no motion, or no force to estimate a state from.
        SimulationError
            If the run fails.

        Warns
        -----
        UserWarning
            Of what lies outside of the training; see `outside`.
        """
        checked_kind("record", record, Record, "a Record, from Record.from_csv or from_dataframe")
        found = predicted(self, record, initial, checked_scalar("lead", lead, "> 0"))
        if doubts := self.outside(record):
            told = "; ".join(doubts)
            warnings.warn(f"{record.place}: outside of what was trained on: {told}", stacklevel=2)
        return found

    def outside(self, record: Record) -> tuple[str, ...]:
        """Return what of a record lies outside of what was trained on, in words.

        Parameters
        ----------
        record : Record
            With a position or a velocity.

        Returns
        -------
        tuple of str
            About amplitude, speed at changes of state, force at rest, and the share of time in each
            state; empty if all of them were met in training.
        """
        checked_kind("record", record, Record, "a Record, from Record.from_csv or from_dataframe")
        found = dict[str, None]()
        for course in self.task.along(record, None):
            own = reach_of(self.task.fine, self.task.subject, course)
            found |= dict.fromkeys(outside(own, self.reach, self.task.measured))
        return tuple(found)

    @cached_property
    def reach(self) -> tuple[Reach, ...]:
        """What each training record made of the model: amplitude, speeds, force at rest, states."""
        fine, subject = self.task.fine, self.task.subject
        return tuple(reach_of(fine, subject, course) for course in self.task.courses)

    def score(
        self,
        record: Record,
        initial: Literal["estimate"] | Mapping[str, Any] | None = None,
        lead: float = 1.0,
    ) -> dict[str, float]:
        """Return how well the fitted model predicts a record.

        Parameters
        ----------
        record : Record
            With motion and force.
        initial, lead
            As in `predict`; the rows from which a state was estimated do not count.

        Returns
        -------
        dict
            ``rmse``, N, ``r2`` and ``rows``, over the selected rows of the record.

        Raises
        ------
        RecordError
            If it has no force.
        """
        checked_kind("record", record, Record, "a Record, from Record.from_csv or from_dataframe")
        measured = column_of(record, self.task.measured.column)
        modelled = self.predict(record, initial, lead)
        chosen = record.chosen & np.isfinite(modelled)
        if initial == "estimate":
            time = record.columns["time"]
            chosen = chosen & (time > time[0] + lead)
            if not chosen.any():
                raise RecordError(
                    f"nothing is left of it after its first {lead:g} s",
                    place=record.place,
                    advice="give a shorter lead",
                )
        return score_of(measured[chosen], modelled[chosen])

    # ------------------------------------------------------------------ how sure it is
    def profile(self, name: str, *, restarts: bool = True, seed: int = 0) -> Profile:
        """Return the profile of one parameter: how the fit suffers as it is moved away.

        At each value all others are searched again, with hops unless `restarts` is False: a profile
        that is searched locally looks far too sure.

        Parameters
        ----------
        name : str
            Of a parameter in `table` that was searched or solved for, not of a nuisance term.
        restarts : bool
            Whether to hop at each value.
        seed : int
            Of the hops.

        Returns
        -------
        Profile
            Values, costs and the 95 % interval; an end that was not found is open.

        Raises
        ------
        ParameterError
            If there is no such parameter.
        """
        names = [each.name for each in self.table if each.name not in self.nuisance]
        if name not in names:
            raise unknown("profile of", name, names)
        return profiled(
            self.task, self.point, self[name], self.effective_rows, restarts=restarts, seed=seed
        )

    def bootstrap(
        self,
        block: float | None = None,
        *,
        draws: int = 40,
        restarts: bool = True,
        seed: int = 0,
    ) -> Bootstrap:
        """Return the spread of the parameters over resampled residuals.

        Blocks of residuals are drawn and added to the model; each such record is fitted anew, with
        hops unless `restarts` is False: a bootstrap that only refines looks far too sure.

        Parameters
        ----------
        block : float, optional
            Length of a block, s; by default `cycles`, or ten correlation times.
        draws : int
            Number of refits, at least 2.
        restarts : bool
            Whether to hop in each.
        seed : int
            Of draws and hops.

        Returns
        -------
        Bootstrap
            The values of each draw, and intervals.

        Raises
        ------
        ParameterError
            If an argument breaks its rule.
        """
        checked_integer("draws", draws, 2)
        checked_integer("seed", seed, 0)
        return bootstrapped(
            self.task,
            self.point,
            [each.name for each in self.table],
            block if block is not None else self.cycles,
            self.correlation_time,
            draws=draws,
            restarts=restarts,
            seed=seed,
        )

    def compare(self, others: Fit | Sequence[Fit] | Mapping[str, Fit]) -> FitComparison:
        """Return this fit beside others, the best on held-out rows first.

        Parameters
        ----------
        others : Fit, sequence of Fit, or mapping of str to Fit
            Fits to the same rows; a mapping names them.

        Returns
        -------
        Comparison
            Held-out RMSE first, BIC on effective rows beside.

        Raises
        ------
        ParameterError
            If one is no fit, or was made from other rows.
        """
        if isinstance(others, Mapping):
            fits, names = list(others.values()), [str(name) for name in others]
        else:
            fits = [others] if isinstance(others, Fit) else listed("others", others, "fits")
            names = []
        for each in fits:
            checked_kind("others", each, Fit, "fits, from fit(...)")
        names = names or [f"{i}: {each.title}" for i, each in enumerate(fits, start=2)]
        every = dict(zip([f"1: {self.title}", *names], [self, *fits], strict=True))
        return compared(every, self)

    # ------------------------------------------------------------------ files
    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the fitted model, driven by the motion of the first record, as a scenario.

        Parameters
        ----------
        path : str or Path
            File name ending in ``.toml``; or in ``.json`` for the fit itself, with its records.

        Returns
        -------
        Path
            The file; ``gms-fsm run`` takes a scenario, `load` a fit.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        from gms_fsm.identification._saved import save, save_whole

        place = checked_path("path", path)
        return (save_whole if place.suffix == ".json" else save)(self, place)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Fit:
        """Read a fit that `save` wrote to a file ending in ``.json``.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Fit
            Evaluated anew; without its choice and profiles.

        Raises
        ------
        RecordError
            If there is no such file, or it is not a fit.
        """
        from gms_fsm.identification._saved import loaded

        return loaded(cls, checked_path("path", path))

    def report(self, folder: str | os.PathLike[str]) -> Path:
        """Write a report: figures, tables, what the record cannot tell, and the fitted scenario.

        Parameters
        ----------
        folder : str or Path
            Created if it does not exist.

        Returns
        -------
        Path
            ``report.md`` in it.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        report = asked("report")
        if report is None:
            raise missing("an entry point of gms-fsm", "plots")
        page: Path = report(self, checked_path("folder", folder))
        return page

    # ------------------------------------------------------------------ texts
    @property
    def scores_text(self) -> str:
        """Its scores in one line: training, held out, repeatability."""
        unit = self.task.measured.unit
        parts = [
            f"{name} RMSE {one['rmse']:.4g} {unit}, R² {one['r2']:.4f} ({one['rows']:.0f} rows)"
            for name, one in (("training", self.training), ("held out", self.held_out))
            if one is not None
        ]
        parts += [f"repeatability {self.floor:.4g} {unit}"] if self.floor is not None else []
        return "; ".join(parts)

    def with_choice(self, choice: Choice, seconds: float) -> Fit:
        """Return the same fit with how it was chosen."""
        return replace(self, choice=choice, seconds=seconds)

    def __repr__(self) -> str:
        opened = f"; {len(self.open)} cannot be told" if self.open else ""
        return (
            f"<Fit: {visible(self.title)}, {len(self.table)} parameters, training RMSE "
            f"{self.training['rmse']:.4g} {self.task.measured.unit}{opened}>"
        )

    def __str__(self) -> str:
        return "\n".join(lines_of(self))
