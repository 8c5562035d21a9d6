"""The door: a system, or a model on a rig, becomes what runs. Behind it nobody asks which it was.

A model on a rig is a system with one contact and one body, which have no names for its user:
``z1``, not ``friction.z1``. What depends on that is asked of `Mounted`.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from gms_fsm.errors import ParameterError
from gms_fsm.language import spell
from gms_fsm.scenarios import shipped
from gms_fsm.systems.models import Model, is_model
from gms_fsm.systems.parts import Contact
from gms_fsm.systems.reading.assembly import Assembly
from gms_fsm.systems.rigs import Prescribed, Rig, TextRig
from gms_fsm.systems.signals import Signal, SignalLike
from gms_fsm.systems.system import System, system_of


@dataclass(frozen=True)
class Mounting:
    """What moves the contacts of a system, as a `Rig` for everything that reads rigs.

    Parameters
    ----------
    system : System
        The system.
    """

    system: System

    @property
    def title(self) -> str:
        """The system's name."""
        return self.system.name

    @property
    def signals(self) -> Mapping[str, Signal]:
        """The system's signals that are functions of time alone."""
        every = self.system.signals.items()
        return {name: signal for name, signal in every if not isinstance(signal, str)}

    @property
    def numbers(self) -> Mapping[str, float]:
        """The system's."""
        return self.system.numbers

    @property
    def acceleration(self) -> str | None:
        """The balance of the first free body; None if all bodies are driven."""
        read = self.system.assembly
        for body in read.free:
            return f"({spell(read.forces[body.name])} - F) / ({spell(read.inertias[body.name])})"
        return None


class Several:
    """Stands where a run has one model, in a system with several contacts.

    Parameters
    ----------
    system : System
        The system.
    """

    def __init__(self, system: System) -> None:
        self._system = system

    def __repr__(self) -> str:
        system = self._system
        others = f" and {len(system.supervisors)} supervisors" if system.supervisors else ""
        return f"<{len(system.contacts)} contacts{others} of {system!r}>"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        raise ParameterError(
            f"system {self._system.name!r} has {told_parts(self._system)}",
            advice=f"say which one: trace.contact({self._system.machines[0].name!r})",
        )


def told_parts(system: System) -> str:
    """Return the names of contacts and supervisors as text."""
    groups = {"contact": system.contacts, "supervisor": system.supervisors}
    return " and ".join(
        f"the {kind}{'s' * (len(parts) > 1)} {', '.join(repr(each.name) for each in parts)}"
        for kind, parts in groups.items()
        if parts
    )


@dataclass(frozen=True, eq=False)
class Mounted:
    """What runs: a system, and what its user calls its parts.

    Parameters
    ----------
    system : System
        What runs.
    model : Model
        The model; of a user's system its only contact, or `Several`.
    rig : Rig
        What moves it.
    named : bool
        Whether bodies and contacts have names that the user gave: not those of a model on a rig.
    """

    system: System
    model: Model
    rig: Rig
    named: bool

    @property
    def given(self) -> System | None:
        """The system, if it is the user's."""
        return self.system if self.named else None

    @property
    def several(self) -> bool:
        """Whether there are several contacts, of which a model must be named."""
        return self.named and len(self.system.machines) > 1

    @property
    def made_of(self) -> Model | System:
        """What the user gave, without a rig."""
        return self.system if self.named else self.model

    @property
    def title(self) -> str:
        """The model's title, or the system's name."""
        return self.system.name if self.named else self.model.title

    @property
    def machines(self) -> tuple[str, ...]:
        """The names of contacts and supervisors that the user can say."""
        return tuple(each.name for each in self.system.machines) if self.named else ()

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of bodies that the user can say."""
        return tuple(each.name for each in self.system.bodies) if self.named else ()

    @property
    def values(self) -> tuple[str, ...]:
        """What a user can ask for beside contacts: bodies, further states, sampled values."""
        moved = (f"{name}.{which}" for name in self.bodies for which in "xv")
        sampled = (name for each in self.system.sampled for name in each.updates)
        return *moved, *self.system.flow, *sampled

    def whose(self, contact: str) -> str:
        """Return the name of a contact; nothing if its user gave none."""
        return contact if self.named else ""

    def element(self, contact: str, i: int) -> str:
        """Return what an element is called in text: ``gear 2``, or ``element 2``."""
        return f"{self.whose(contact) or 'element'} {i + 1}"

    def of(self, contact: str, name: str) -> str:
        """Return what is called by a name in a contact: ``gear.k``, or ``k``."""
        return f"{contact}.{name}" if self.named else name

    def only(self, contact: str) -> Mounted:
        """Return what is seen of one contact: like a model, which has no names."""
        return replace(self, model=self.system.contact(contact), named=False)

    def driven(self, signals: Mapping[str, Signal]) -> Mounted:
        """Return the same with other signals, of a rig with all; with v the velocity is given."""
        if self.named:
            return mounted(replace(self.system, signals={**self.system.signals, **signals}))
        others, was = {name: each for name, each in signals.items() if name != "v"}, self.rig
        rig: Rig = TextRig(was.title, was.acceleration, others, was.numbers)
        if "v" in signals:
            rig = Prescribed(signals["v"], others)
        return mounted(self.model, rig, self.system.contacts[0].period)

    @property
    def bindable(self) -> tuple[str, ...]:
        """The names that inputs of a record can have: inputs of the model, signals of a system."""
        return (*self.system.signals,) if self.named else (*getattr(self.model, "inputs", {}),)


def mounted(model: Model | System, rig: Rig | None = None, period: float | None = None) -> Mounted:
    """Return what runs.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, PulledSlider
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> what = mounted(model, PulledSlider(1.0, 2.0, 0.1))
    >>> what.system.machines[0].name, what.whose("friction")
    ('friction', '')
    """
    if isinstance(model, System):
        single: Any = model.machines[0] if len(model.machines) == 1 else Several(model)
        return Mounted(model, single, Mounting(model), named=True)
    if hasattr(model, "signals") and hasattr(rig, "chart"):
        raise ParameterError(
            "it is a rig, and the rig is a model: the two are swapped",
            place="model",
            value=model,
            advice="give the model first, then the rig",
        )
    for what, given, mark, example in (
        ("model", model, "chart", "GMS(parameters, law='signed')"),
        ("rig", rig, "signals", "Prescribed('0.1*sin(t)')"),
    ):
        if isinstance(given, type) or not hasattr(given, mark):
            raise ParameterError(
                f"it must be a {what}, for example {example}",
                place=what,
                value=given,
                advice=misplaced(given),
            )
    assert rig is not None
    own: Any = model
    if bound := {*getattr(rig, "inputs", {})} & {*getattr(model, "inputs", {})}:
        own = replace(own, inputs={**own.inputs, **{name: name for name in bound}})
    return Mounted(system_of(own, rig, period), own, rig, named=False)


def with_inputs(model: Model | System, inputs: Mapping[str, SignalLike]) -> System:
    """Return a system with signals for its inputs."""
    if not isinstance(model, System):
        raise ParameterError("only a system has inputs", place="inputs", value=inputs)
    return model.with_inputs(inputs)


OF_ANOTHER_PLACE = {  # what is often given where it does not belong, by the name of its class
    "Record": "it is a record: fit(record, model, free=[...]) takes it first, and "
    "Prescribed((motion.time, motion.velocity)) of motion = record.motion() moves a model by it",
    "Motion": "it is a motion: Prescribed((motion.time, motion.velocity)) moves a model by it",
    "Chart": "it is a chart: ChartModel(chart, values) is a model of it",
    "GMSParameters": "they are parameters: GMS(parameters, law='signed') is a model with them",
    "Trace": "it is a run: its model is trace.model, its rig trace.rig",
    "Session": "it is a session: what runs in it is session.system",
}


def misplaced(given: object) -> str:
    """Return what to do with an object that stands where it does not belong; empty if unknown.

    >>> misplaced(Prescribed("0.1"))
    'it is a rig, simulate(model, rig, t_end) takes it second'
    """
    if isinstance(given, type):
        return f"it is a class: write {given.__name__}(...)"
    if is_model(given):
        return "it is a model, fit(records, model, free=[...]) takes it second"
    if hasattr(given, "signals"):
        return "it is a rig, simulate(model, rig, t_end) takes it second"
    table = (
        "it is a table: Record.from_dataframe(frame, time=..., position=..., force=...) reads it"
    )
    known = OF_ANOTHER_PLACE.get(type(given).__name__, "")
    return known or (table if hasattr(given, "columns") else "")


def mounted_alone(
    model: Model | System, place: str = "model", inputs: Iterable[str] = ()
) -> Mounted:
    """Return a system, or a model whose velocity is still to be given, as the signal v.

    So are the inputs with these names, if it has them.
    """
    if isinstance(model, System):
        return mounted(model)
    if not is_model(model):
        raise ParameterError(
            "it must be a model or a system, for example initial_bank(record, 4)",
            place=place,
            value=model,
            advice=misplaced(model),
        )
    own = getattr(model, "inputs", {})
    return mounted(model, Prescribed("0", {name: "1" for name in inputs if name in own}))


def contact_of(what: object, name: str) -> tuple[Contact, Assembly | None]:
    """Return a contact of a system, with the system read; or a model as a contact of its own."""
    if isinstance(what, System):
        known = [each.name for each in what.machines]
        if not name and len(known) > 1:
            raise ParameterError(
                f"system {what.name!r} has {told_parts(what)}",
                place="contact",
                advice=f"say which one: contact={known[0]!r}",
            )
        return what.contact(name or known[0]), what.assembly
    if name:
        raise ParameterError(
            "only a system has contacts", place="contact", value=name, advice="leave it out"
        )
    if isinstance(what, Contact):
        return what, None
    if not is_model(what):
        raise ParameterError(
            "it must be a chart, a model, a contact or a system",
            place="chart",
            value=what,
            advice="gms_fsm.charts.CHARTS[...] has those of the package"
            if isinstance(what, str)
            else "",
        )
    model: Any = what
    return Contact("friction", model), None


def shifted(call: str, model: Model | System, rig: Any, *rest: Any) -> tuple[Any, ...]:
    """Return the rig and the arguments behind it; of a system they begin one earlier."""
    if isinstance(model, str | os.PathLike) and (
        str(model) in shipped() or str(model).endswith(".toml")
    ):
        raise ParameterError(
            "it must be a model or a system",
            place="model",
            value=model,
            advice=f"gms_fsm.app.scenario.load_scenario({str(model)!r}).simulate() runs a scenario",
        )
    if not isinstance(model, System):
        return rig, *rest
    if rest[-1] is not None:
        raise ParameterError("a system has no rig", place="rig", value=rig, advice=f"write {call}")
    return None, rig, *rest[:-1]


def arguments_of(
    caller: str, model: Model | System, rig: Rig | float, t_end: float | None
) -> tuple[Rig | None, float]:
    """Return the rig, if there is one, and the end of the run."""
    if hasattr(t_end, "signals") or is_model(t_end):
        what = "rig" if hasattr(t_end, "signals") else "model"
        raise ParameterError(
            f"it is a {what}",
            place="t_end",
            value=t_end,
            advice=f"write {caller}(model, rig, t_end)",
        )
    on, end = shifted(f"{caller}(system, t_end)", model, rig, t_end)
    if end is None:
        raise ParameterError(
            "it must be a number",
            place="t_end",
            value=None,
            advice=f"write {caller}(model, rig, t_end), or {caller}(system, t_end)",
        )
    return on, end
