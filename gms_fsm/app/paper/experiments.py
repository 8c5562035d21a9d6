"""The runs of the paper's two experiments: systems and settings."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from gms_fsm.app.paper import (
    FIG3_END,
    FIG4_END,
    FIG4_HELD_END,
    FORCE,
    HELD_STEPS,
    PAPER_RTOL,
    PAPER_STEP,
    VELOCITY,
)
from gms_fsm.charts.zoo.bristles.lugre import BENCHMARK
from gms_fsm.phenomena.measure import Progress
from gms_fsm.run.simulate import Moment, simulate
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.models import GMS, LuGre, Model
from gms_fsm.systems.rigs import Prescribed, Rig, Slider
from gms_fsm.traces.trace import Trace

__all__ = ["PaperExperiment", "Progress", "experiments", "lugre_like", "run", "run_one"]

# For runs that no other engine repeats: the same bits, forty times faster.
FASTEST = "compiled" if find_spec("llvmlite") else "ifelse"


@dataclass(frozen=True)
class PaperExperiment:
    """One run of the reproduction: name, system and settings.

    Parameters
    ----------
    name : str
        File name of its trace.
    model, rig
        The simulated system.
    t_end : float
        End time, s.
    engine : str
        The engine.
    paper_settings : bool
        Guards evaluated once per step, steps of at most 1e-3 s and rtol 1e-4, instead of located
        switches.
    held : float, optional
        Sample time of the chart, s: its outputs are held between the ticks. The rows are the ticks
        and the end.
    """

    name: str
    model: Model
    rig: Rig
    t_end: float
    engine: str = "machines"
    paper_settings: bool = False
    held: float | None = None


def experiments(force: str = FORCE, velocity: str = VELOCITY) -> tuple[PaperExperiment, ...]:
    """Return every run of the reproduction.

    Parameters
    ----------
    force : str
        F_a(t) of Fig. 3, N, in the expression language.
    velocity : str
        v(t) of Fig. 4, m/s.

    Returns
    -------
    tuple of PaperExperiment
        The runs, those of Fig. 3 first, and those with held outputs last.

    Examples
    --------
    >>> [e.name for e in experiments()][:3]
    ['fig3_chart', 'fig3_ifelse', 'fig3_lugre']
    """
    slow, slip = GMSParameters.paper("non-drifting"), GMSParameters.paper("stick-slip")
    earned = slow.with_weights(0.25 / slow.k)
    push, move = Slider(1.0, force), Prescribed(velocity)
    fig3, fig4 = GMS(slow, law="published"), GMS(slip, law="published")
    signed3, signed4 = GMS(earned, law="signed"), GMS(slip, law="signed")
    return (
        PaperExperiment("fig3_chart", fig3, push, FIG3_END),
        PaperExperiment("fig3_ifelse", fig3, push, FIG3_END, engine="ifelse"),
        PaperExperiment("fig3_lugre", lugre_like(slow), push, FIG3_END, engine=FASTEST),
        PaperExperiment("fig3_slipping_chart", signed3, push, FIG3_END),
        PaperExperiment("fig3_slipping_ifelse", signed3, push, FIG3_END, engine="ifelse"),
        PaperExperiment("fig3_step", fig3, push, FIG3_END, engine=FASTEST, paper_settings=True),
        PaperExperiment("fig4_chart", fig4, move, FIG4_END),
        PaperExperiment("fig4_ifelse", fig4, move, FIG4_END, engine="ifelse"),
        PaperExperiment("fig4_lugre", lugre_like(slip), move, FIG4_END, engine=FASTEST),
        PaperExperiment("fig4_signed_chart", signed4, move, FIG4_END),
        PaperExperiment("fig4_signed_ifelse", signed4, move, FIG4_END, engine="ifelse"),
        PaperExperiment("fig4_step", fig4, move, FIG4_END, engine=FASTEST, paper_settings=True),
        *(
            PaperExperiment(
                f"fig3_held_chart_{1e6 * h:g}us",
                fig3,
                push,
                FIG3_END,
                engine="machines" if h == PAPER_STEP else FASTEST,
                held=h,
            )
            for h in HELD_STEPS
        ),
        PaperExperiment("fig3_held_ifelse", fig3, push, FIG3_END, engine="ifelse", held=PAPER_STEP),
        PaperExperiment("fig4_held_chart", fig4, move, FIG4_HELD_END, held=PAPER_STEP),
        PaperExperiment(
            "fig4_held_ifelse", fig4, move, FIG4_HELD_END, engine="ifelse", held=PAPER_STEP
        ),
    )


def lugre_like(parameters: GMSParameters) -> LuGre:
    """Return the LuGre model with which a column is compared."""
    own: Any = BENCHMARK.values
    return LuGre(**own, sigma_2=parameters.sigma_2, stribeck=parameters.stribeck)


def run(
    force: str = FORCE, velocity: str = VELOCITY, progress: Progress | None = None
) -> dict[str, Trace]:
    """Run both experiments in all their variants.

    Parameters
    ----------
    force, velocity : str
        The signals that the paper does not print.
    progress : callable, optional
        ``progress(name, done)`` with done from 0 to 1.

    Returns
    -------
    dict of str to Trace
        Traces by the names of the experiments.

    Raises
    ------
    SimulationError
        If a run cannot continue, for example because a signal is not finite.
    """
    return {e.name: run_one(e, progress) for e in experiments(force, velocity)}


def run_one(experiment: PaperExperiment, progress: Progress | None = None) -> Trace:
    """Run one experiment.

    Parameters
    ----------
    experiment : PaperExperiment
        The experiment.
    progress : callable, optional
        ``progress(name, done)`` with done from 0 to 1.

    Returns
    -------
    Trace
        The run.
    """

    def reached(moment: Moment) -> None:
        if progress is not None:
            progress(experiment.name, moment.t / experiment.t_end)

    options: dict[str, Any] = {"engine": experiment.engine, "progress": reached}
    if experiment.paper_settings:
        options |= {"events": "step", "max_step": PAPER_STEP, "rtol": PAPER_RTOL}
    elif (h := experiment.held) is not None:
        ticks = h * np.arange(round(experiment.t_end / h))
        options |= {"events": "held", "step": h, "t_eval": np.append(ticks, experiment.t_end)}
    return simulate(experiment.model, experiment.rig, experiment.t_end, **options)
