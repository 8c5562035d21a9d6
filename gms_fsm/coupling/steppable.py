"""A friction model, or a contact of a system, whose velocity a co-simulation prescribes."""

from __future__ import annotations

import dataclasses
import keyword
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError
from gms_fsm.language import CONSTANTS
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
from gms_fsm.run.stepped.beginning import begin, usable
from gms_fsm.systems.models import Model
from gms_fsm.systems.signals import Corners, Function
from gms_fsm.systems.system import Body, Contact, System

WORD = re.compile(r"(?<![\w.])[A-Za-z_]\w*\b(?!\s*\()")  # no function, no exponent of a number
GIVEN = ("t", "x", "v")  # what a contact knows by itself: x is the integral of v


def start_of(
    given: Model | Contact,
    t: float,
    initial: Mapping[str, Any] | None,
    rtol: float,
    values: Mapping[str, float] | None = None,
    settings: Settings | None = None,
) -> Problem:
    """Return a friction model or a contact, moved by a velocity that is a straight line."""
    contact = alone(given)
    t, end = begin(t)
    others = other_inputs(contact)
    now = {} if values is None else values
    signals = {
        name: Corners(np.array([t, end]), np.full(2, now.get(name, 0.0)), held=True)
        for name in ("v", *others)
    }
    system = System(
        "prescribed velocity",
        bodies=(Body("body", velocity="v", rotary=contact.chart.rotary),),
        contacts=(contact,),
        signals=signals,
    )
    chosen = Settings(rtol=rtol) if settings is None else settings
    return Problem.of(system, None, end, usable(chosen, "located"), t_start=t, initial=initial)


def start_of_system(
    system: System, t: float, initial: Mapping[str, Any] | None, settings: Settings
) -> Problem:
    """Return a system whose records are straight lines, which a co-simulation gives."""
    t, end = begin(t)
    signals = dict(system.signals)
    for name, signal in system.signals.items():
        if isinstance(signal, Function):
            raise ParameterError(
                "it is a Python function, which cannot be handed over",
                place=f"signal {name!r}",
                advice="give it as an expression in t, or as a record",
            )
        if isinstance(signal, Corners):
            value = float(np.interp(t, signal.times, signal.values))
            signals[name] = Corners(np.array([t, end]), np.full(2, value), held=True)
    moved = dataclasses.replace(system, signals=signals)
    chosen = usable(settings, "located", "held")  # held events are periods of contacts
    return Problem.of(moved, None, end, chosen, t_start=t, initial=initial)


def alone(given: Model | Contact) -> Contact:
    """Return a contact that needs no bodies but its own, or refuse."""
    if not isinstance(getattr(given, "chart", None), Chart):
        raise ParameterError(
            "it must be a model or a contact, for example GMS(parameters, law='signed')",
            place="model_or_contact",
            value=given,
        )
    chart = given.chart
    here = f"chart {chart.name!r}"
    if len(chart.velocities) != 1:
        raise ParameterError(
            f"it has the velocities {', '.join(chart.velocities)}",
            place=here,
            advice="only charts with one velocity can be stepped; put it into a System",
        )
    if chart.locks or chart.sets_velocity:
        why = (
            "it locks the contact, and the force of a lock depends on the masses that it holds"
            if chart.locks
            else "it sets the velocity, which your loop owns"
        )
        raise ParameterError(
            why,
            place=here,
            advice="put it into a System, or use a chart without locks, such as GMS or LuGre",
        )
    if not isinstance(given, Contact):
        return Contact("friction", given)
    if given.period is not None:
        raise ParameterError(
            f"it has a period of {given.period!r} s",
            place=f"contact {given.name!r}",
            advice="leave it out, and call the contact at the ticks of your loop",
        )
    # Its x is the integral of the velocity given; the bodies of its system are not here.
    inputs = {name: text for name, text in given.inputs.items() if name != "x"}
    return given.replaced(v=("v",), inputs=inputs)


def other_inputs(contact: Contact) -> list[str]:
    """Return what the texts of a contact name, except what it knows by itself."""
    named = dict.fromkeys([*contact.chart.inputs, *contact.inputs])
    texts = [contact.inputs.get(name, name) for name in named if name != "s"]
    found = dict.fromkeys(name for text in texts for name in WORD.findall(str(text)))
    known = {*GIVEN, *CONSTANTS, *keyword.kwlist}
    return [name for name in found if name not in known]
