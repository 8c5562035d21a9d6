"""What the formats of one chart have in common: what they refuse, and a record to try them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.reader import called
from gms_fsm.coupling.steppable import other_inputs
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.language import Condition, Value, names_in, spell
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import simulate
from gms_fsm.systems.system import Body, Contact, System

PERIOD, STEP = 25.0, 1e-3  # s: of a demonstration, as in the paper's first experiment
AMPLITUDES = (0.15, 0.015, 1.5e-3, 1.5e-4, 1.5e-5)  # m/s; the first is the paper's
AGREEMENT = 0.01


def check_moved_from_outside(chart: Chart, known: Iterable[str], title: str) -> None:
    """Refuse a chart that needs more than a velocity that another program computes.

    Examples
    --------
    >>> from gms_fsm.charts.zoo.sliding.karnopp import KARNOPP
    >>> check_moved_from_outside(KARNOPP, (), "SCXML")
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: chart "Karnopp's model", state 'stuck': it locks the contact...
    """
    here = f"chart {chart.name!r}"
    for state in chart.states:
        if state.locked:
            raise ParameterError(
                "it locks the contact, and what holds it depends on the masses, which "
                f"{title} does not have",
                place=f"{here}, state {state.name!r}",
                advice="export a chart without locks, such as GMS, or a whole system as c99",
            )
    for time in called(chart.durations).values():
        raise ParameterError(
            f"it reads {spell(time)}, which {title} does not have",
            place=here,
            advice="give the condition a state of its own, and after(...)",
        )
    late = {*chart.force_names, *chart.rate_names} - {
        *chart.inputs,
        *chart.variables,
        *chart.parameter_names,
        *chart.let,
    }
    texts: list[tuple[str, Condition | Value, set[str]]] = [
        (f"edge {edge!r}: guard", guard, {*known}) for edge, guard in chart.guards.items()
    ]
    for (kind, owner), assignments in chart.assignments.items():
        for name, tree in assignments.items():
            place = f"{'edge' if kind == 'action' else 'state'} {owner!r}: {kind} {name!r}"
            if name in chart.velocities:
                raise ParameterError(
                    f"it sets the velocity, which in {title} comes from outside",
                    place=f"{here}, {place}",
                    advice="export a whole system, for example as c99",
                )
            texts.append((place, tree, set()))
    for place, text, allowed in texts:
        for name in sorted((names_in(text) & late) - allowed):
            what = "an acceleration" if name in chart.rate_names else "a force of the contact"
            raise ParameterError(
                f"it reads {name!r}, {what}, which {title} does not have",
                place=f"{here}, {place}",
                advice="write it with variables and inputs, or export a whole system as c99",
            )


def fields_of(parameter: Parameter) -> dict[str, Any]:
    """Return the fields of a parameter that differ from their defaults, besides its name."""
    plain = vars(Parameter(parameter.name))
    return {key: value for key, value in vars(parameter).items() if value != plain[key]}


def element_numbers(contact: Contact) -> list[dict[str, float]]:
    """Return the numbers of each element, by name."""
    rows = {name: np.broadcast_to(given, contact.n) for name, given in contact.values.items()}
    return [{name: float(row[i]) for name, row in rows.items()} for i in range(contact.n)]


def slow_velocity(contact: Contact) -> str:
    """Return a velocity with which Euler's method in steps of 1 ms shows what a contact does.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> slow_velocity(Contact("friction", GMS(GMSParameters.paper("stick-slip"), law="signed")))
    '0.15 * sin(2 * pi * t / 25)'
    """
    texts = [f"{each!r} * sin(2 * pi * t / {PERIOD:g})" for each in AMPLITUDES]
    if other_inputs(contact):  # what else comes from outside is not known here
        return texts[0]
    return next((text for text in texts if _is_slow(contact, text)), texts[-1])


def _is_slow(contact: Contact, velocity: str) -> bool:
    body = Body("body", velocity="v", rotary=contact.chart.rotary)
    system = System(
        "prescribed velocity", bodies=(body,), contacts=(contact,), signals={"v": velocity}
    )
    times = np.linspace(0.0, PERIOD / 4.0, 500)
    forces = []
    for step in (STEP, STEP / 2.0):
        settings = Settings(method="euler", step=step, events="step", engine="ifelse", t_eval=times)
        try:
            forces.append(simulate(system, PERIOD / 4.0, settings=settings).F)
        except GMSError:  # not finite, or switching without end
            return False
    if not np.isfinite(forces).all():
        return False
    coarse, fine = forces
    # Not the largest: a force that jumps does so a step earlier or later.
    return bool(np.quantile(np.abs(coarse - fine), 0.98) <= AGREEMENT * np.abs(fine).max())
