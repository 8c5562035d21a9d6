"""What a fit predicts, and how far it reaches: what of a motion lies outside of its training."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.foundation.quantities import in_words, per_second
from gms_fsm.identification.certainty.statistics import correlation_time
from gms_fsm.identification.problem.beginning import estimated
from gms_fsm.identification.problem.experiment import Experiment
from gms_fsm.identification.problem.runs import AT_REST, ComparedColumn, Course
from gms_fsm.identification.problem.task import at_all_rows, stretches
from gms_fsm.records.record import Record
from gms_fsm.systems.mounted import Mounted

if TYPE_CHECKING:
    from gms_fsm.identification.result import Fit

SLACK = 1.1  # how much further than in training still counts as inside
SHARE = 0.1  # more or less of the time in a state than in any training record


@dataclass(frozen=True)
class Reach:
    """What a motion makes of a model.

    Parameters
    ----------
    amplitude : float
        Half of the travel, m.
    speed : float
        The highest speed at which an element changes its state, m/s.
    rest : float
        The largest force at rest.
    shares : mapping of str to float
        The share of time in each state, over all elements.
    """

    amplitude: float
    speed: float
    rest: float
    shares: Mapping[str, float]


def reach_of(experiment: Experiment, subject: Mounted, course: Course) -> Reach:
    """Return the reach of one course."""
    trace = experiment.driver.run(subject, course)
    layout = trace.program.layout
    force = np.abs(experiment.measured.values(trace))
    speed = np.abs(course.v)
    times = trace.firings.t
    changes = np.interp(times[times >= course.t[0]], course.t, speed)
    still = force[speed <= AT_REST * speed.max(initial=0.0)]
    shares: dict[str, float] = {}
    for contact in subject.system.contacts:
        modes = trace.rows.mode[:, layout.contact(contact.name).elements]
        for i, state in enumerate(contact.chart.states):
            shares[subject.of(contact.name, state.name)] = float(np.mean(modes == i))
    return Reach(
        0.5 * float(np.ptp(course.x)),
        float(np.quantile(changes, 0.95)) if changes.size else 0.0,
        float(still.max(initial=0.0)),
        shares,
    )


def measures(compared: ComparedColumn) -> dict[str, tuple[str, str]]:
    """Return what a reach measures, by the names of its fields: words and units."""
    return {
        "amplitude": ("amplitude", compared.length),
        "speed": ("speed at changes of state", per_second(compared.length)),
        "rest": ("force at rest", compared.unit),
    }


def outside(own: Reach, training: Sequence[Reach], compared: ComparedColumn) -> Iterator[str]:
    """Yield what of a motion lies outside of the training, in words."""
    for name, (what, of) in measures(compared).items():
        here, most = getattr(own, name), max(getattr(each, name) for each in training)
        if here > SLACK * most:
            told = f"the {what} is {in_words(here, of, 3)}"
            yield f"{told}, in training at most {in_words(most, of, 3)}"
    for state, share in own.shares.items():
        known: FloatArray = np.array([each.shares.get(state, 0.0) for each in training])
        if share > known.max() + SHARE or share < known.min() - SHARE:
            yield (
                f"{share:.0%} of the time is spent in {state}, in training "
                f"{known.min():.0%} to {known.max():.0%}"
            )


def predicted(fit: Fit, record: Record, initial: Any, lead: float) -> FloatArray:
    """Return what a fit gives for a record; see `gms_fsm.Fit.predict`."""
    along, fine = fit.task.along(record, None), fit.task.fine
    if initial == "estimate":
        tau = correlation_time(stretches(fit.task.courses, fit.point.residual))
        along = [each.begun(estimated(fit.task, fit.point, each, lead, tau)) for each in along]
    elif initial is not None:
        checked_kind("initial", initial, Mapping, "'estimate', or a mapping such as {'z': 0}")
        along = [along[0].begun(initial), *along[1:]]
    return at_all_rows(fine, fit.point, along)


def without_change(experiment: Experiment, subject: Mounted) -> tuple[int, ...]:
    """Return the elements, from 1, that keep their initial state in all training rows."""
    if not any(contact.chart.transitions for contact in subject.system.contacts):
        return ()
    kept: NDArray[np.bool_] = np.array(True)
    for course in experiment.courses:
        trace = experiment.driver.run(subject, course)
        elements = trace.program.layout.elements
        initial = experiment.driver.start(subject, course).mode[elements]
        same = (trace.rows.mode[course.rows, elements] == initial).all(axis=0)
        first, last = course.t[course.rows][[0, -1]]
        t = trace.firings.t
        same[trace.firings.machine[(t > first) & (t <= last)]] = False
        kept = kept & same
    return tuple(int(i) + 1 for i in np.flatnonzero(kept))
