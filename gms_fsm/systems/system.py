"""Systems: bodies that move, contacts between them, and what drives both.

Bodies and controllers are smooth. Whatever switches is a contact: machines of one chart on one
relative velocity, which is linear in the bodies' velocities.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from gms_fsm.charts.parameters import finite_numbers, is_list
from gms_fsm.errors import ExpressionError, GMSError, ParameterError, Part, cut, shown
from gms_fsm.foundation.arguments import checked_path, copied, refusing, unknown
from gms_fsm.foundation.display import displayed
from gms_fsm.foundation.equality import ByIdentity, by_value
from gms_fsm.language import (
    Binary,
    Name,
    Negative,
    Number,
    Value,
    derivative,
    names_in,
    parse_value,
    renamed,
    spell,
)
from gms_fsm.systems.given import check_name, mapping_of, several, texts_of
from gms_fsm.systems.models import Model
from gms_fsm.systems.parts import (
    COUNTS,
    LEAST_LOAD,
    LOAD,
    Body,
    Contact,
    Sampled,
    Supervisor,
    loaded,
)
from gms_fsm.systems.reading.kinds import checked_units, in_their_units
from gms_fsm.systems.reading.texts import texts_of_system
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Signal, SignalLike, as_signal
from gms_fsm.systems.springs import Spring, on_ground

if TYPE_CHECKING:
    from gms_fsm.systems.reading.assembly import Assembly

__all__ = [
    "LEAST_LOAD",
    "LOAD",
    "Body",
    "Contact",
    "Sampled",
    "Spring",
    "Supervisor",
    "System",
    "loaded",
    "system_of",
]


Key = tuple[str | int, ...]
PARTS = {
    **{"bodies": Body, "springs": Spring, "contacts": Contact, "supervisors": Supervisor},
    **{"sampled": Sampled, "controllers": Sampled},
}


@refusing(instead={"parameters": "numbers"})
@displayed("svg", "html")
@by_value()
@dataclass(frozen=True, eq=False)
class System:
    """Bodies, the contacts between them, and what drives both.

    Parameters
    ----------
    name : str
        What it is called in pictures and messages.
    bodies : sequence of Body, optional
        What moves.
    contacts : sequence of Contact, optional
        Whatever switches between bodies.
    supervisors : sequence of Supervisor, optional
        Machines that are no contacts; bodies, contacts and supervisors may not all be missing.
    springs : sequence of Spring, optional
        Springs and dampers; their forces are added to those of the bodies, in this order.
    signals : mapping of str to signal, optional
        Functions of time, as those of a rig; texts may use the numbers.
    numbers : mapping of str to float, optional
        Constants.
    inputs : sequence of str, optional
        What comes from outside: ``simulate(system, t_end, inputs={"u": signal})`` gives it for a
        run, `gms_fsm.SystemState` takes it sample by sample. All texts can use it as a signal.
    flow : mapping of str to str, optional
        Further smooth states, each with its time derivative: a current, an integrator.
    sampled : sequence of Sampled, optional
        Controllers with ticks; those that are Python functions are kept in `controllers`.
    let : mapping of str to str, optional
        Named expressions of the above, for all texts but those of signals and given velocities;
        later ones can use earlier ones.
    units : mapping of str to str, optional
        Units of SI of numbers, signals, further states, and of what a contact has: ``{"r":
        "m/rad", "rock.W": "N"}``. What is not declared adapts to the motion of the bodies.

    Raises
    ------
    ParameterError, ExpressionError
        If names clash, a text cannot be read, a velocity is not linear, an inertia is not
        positive, a spring has an end that is no body or pushes away, or a lock cannot hold.

    Notes
    -----
    Locked contacts may hold the same motion. The earlier ones, as listed, then carry the force, and
    those that would repeat them carry none; `Trace.shared` marks these.

    Systems are equal if all their parts are. So are models, rigs and signals; functions only if
    they are the same.

    Examples
    --------
    >>> from gms_fsm.charts.gms import gms_element
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> system = System("pulled mass", bodies=(Body("mass", inertia="m"),),
    ...                 springs=(Spring("pulled", "mass", k="K", rest="V * t"),),
    ...                 contacts=(Contact("pad", model),), numbers={"m": 1.0, "K": 2.0, "V": 0.1})
    >>> system.contact("pad").n
    4
    """

    name: str
    bodies: tuple[Body, ...] = field(default=(), kw_only=True)
    contacts: tuple[Contact, ...] = field(default=(), kw_only=True)
    supervisors: tuple[Supervisor, ...] = field(default=(), kw_only=True)
    springs: tuple[Spring, ...] = field(default=(), kw_only=True)
    signals: Mapping[str, Signal | str] = field(default_factory=dict, kw_only=True)
    numbers: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    flow: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    sampled: tuple[Sampled, ...] = field(default=(), kw_only=True)
    let: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    units: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    inputs: tuple[str, ...] = field(default=(), kw_only=True)
    controllers: tuple[Sampled, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise ParameterError("it must be a text", place="name", value=self.name)
        own, here = vars(self), f"system {shown(self.name)}"
        for each, kind in PARTS.items():
            own[each] = several(own[each], kind, f"{here}: {each}")
        if called := [each for each in self.sampled if each.outputs]:
            own["controllers"] += (*called,)
            own["sampled"] = tuple(each for each in self.sampled if not each.outputs)
        if self.contacts and not self.bodies:
            raise ParameterError(
                "it has contacts, but no bodies", place=here, advice="give the bodies that move"
            )
        if not self.machines:
            reason = "it has no contacts and no supervisors"
            raise ParameterError(reason, place=here, advice="give at least one")
        own["numbers"] = finite_numbers(mapping_of(self.numbers, f"{here}: numbers"), here)
        own["flow"] = texts_of(self.flow, f"{here}: flow")
        own["let"] = texts_of(self.let, f"{here}: let")
        own["signals"] = signals = mapping_of(self.signals, f"{here}: signals")
        own["inputs"] = several(self.inputs, str, f"{here}: inputs")
        try:
            for name, given in signals.items():
                signals[name] = self._signal(name, given, here)
            like = _read_before.get(key := texts_of_system(self))
        except (GMSError, TypeError):
            self._check_names(here)  # what is wrong with a name is said first
            raise
        if like is None:
            self._check_names(here)
        own["units"] = checked_units(self, here, like)
        for each in ("contacts", "supervisors"):
            own[each] = in_their_units(self, each, here, like)
        self._read(key, like)

    def __repr__(self) -> str:
        named = {each: getattr(self, each) for each in ("bodies", "contacts", "supervisors")}
        told = [f"{k} {cut(', '.join(u.name for u in us))}" for k, us in named.items() if us]
        return f"<System {cut(self.name)!r}: {'; '.join(told)}>"

    def _signal(self, name: str, given: Any, here: str) -> Signal | str:
        """Return a signal; one whose text names numbers stays a text."""
        if isinstance(given, str):
            try:
                tree = parse_value(given, ["t", *self.numbers])
            except ExpressionError as error:
                part = Part(f"{here}, signal {name!r}", ("signals", name))
                raise error.at(part) from None
            if names_in(tree) - {"t"}:
                return given
        return as_signal(given)

    def _check_names(self, here: str) -> None:
        # What has names, and the names, each with its key.
        groups: list[tuple[str, list[tuple[str, Key]]]] = [("time", [("t", ())])]
        if self.sampled:
            groups.append(("the period of sampled values", [("period", ())]))
        for i, body in enumerate(self.bodies):
            own: list[tuple[str, Key]] = [(body.x, ("bodies", i, "x"))]
            if not (body.velocity == body.v and body.v in self.given):
                own.append((body.v, ("bodies", i, "v")))
            groups.append((f"body {body.name!r}", own))
        named = {"signal": "signals", "number": "numbers", "flow": "flow", "let": "let"}
        for kind, attribute in named.items():
            groups.append((kind, [(name, (attribute, name)) for name in getattr(self, attribute)]))
        groups.append(("input", [(name, ("inputs", i)) for i, name in enumerate(self.open)]))
        for i, each in enumerate(self.sampled):
            values: list[tuple[str, Key]] = [
                (name, ("sampled", i, "updates", name)) for name in each.updates
            ]
            groups.append((f"sampled {each.name!r}", values))
        owner: dict[str, str] = {}
        for kind, names in groups:
            for name, key in names:
                check_name(name, f"{here}, {kind}", key)
                if name in owner:
                    raise ParameterError(
                        f"the name {name!r} is used twice ({owner[name]} and {kind})",
                        place=here,
                        advice="every name must be unique; a body's names are x=... and v=...",
                        key=key,
                    )
                owner[name] = kind
        seen: set[str] = set()
        for attribute in ("bodies", "springs", "contacts", "supervisors", "sampled", "controllers"):
            for i, part in enumerate(getattr(self, attribute)):
                key = (attribute, i, "name")
                check_name(part.name, f"{here}, {type(part).__name__.lower()}", key)
                if part.name in seen:
                    raise ParameterError(
                        f"the name {part.name!r} is used twice", place=here, key=key
                    )
                seen.add(part.name)

    def _read(self, key: Any, like: System | None) -> None:
        """Read the texts, unless another system with the same texts has been read."""
        # Imported here: the reader itself needs the classes of this module.
        from gms_fsm.systems.reading.renumbered import check_numbers

        if like is None:
            _ = self.assembly  # raises errors of the texts
            _kept(_read_before, key, self)
        else:
            check_numbers(like.assembly, self)
            object.__setattr__(self, "_like", like)

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: texts are read again."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @property
    def shape(self) -> System:
        """The system whose texts were read: this one, or one that differs in numbers only."""
        found: System = vars(self).get("_like", self)
        return found

    @functools.cached_property
    def assembly(self) -> Assembly:
        """Its texts, read."""
        from gms_fsm.systems.reading.assembly import assembled
        from gms_fsm.systems.reading.renumbered import renumbered

        return assembled(self) if self.shape is self else renumbered(self.shape.assembly, self)

    # ------------------------------------------------------------------ files
    @classmethod
    def load(cls, path: str | Path) -> System:
        """Read a system from a TOML file.

        Parameters
        ----------
        path : str or Path
            With the keys ``name``, ``[[body]]`` (name, inertia, force, velocity, x, v, rotary,
            motion), ``[[spring]]`` (name, first, second, k, d, ratio, rest), ``[[contact]]`` (name,
            v, n, inputs, period; ``chart``, a chart file next to this file, the name of an included
            chart, or a table as in a chart file, with ``values``; or ``model``, as in scenario
            files), ``[signals]``, ``[numbers]``, ``[flow]``, ``[let]``, ``[units]`` and
            ``[[sampled]]`` (name, period, updates, initial, offset).

        Returns
        -------
        System
            Checked, as any system.

        Raises
        ------
        ScenarioError, ParameterError, SignalError, ChartError, ExpressionError
            If the file is no system; the message names file, line, key and text.
        """
        from gms_fsm.systems.files.toml import load

        return load(checked_path("path", path), cls)

    def save(self, path: str | Path) -> Path:
        """Write the system to a TOML file, from which `load` returns an equal one.

        Charts that are included are written by name, others in full. A model of a class of one's
        own is read back as an equivalent `ChartModel`.

        Parameters
        ----------
        path : str or Path
            File name ending in ``.toml``.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        OutputError
            If a signal is a Python function, or the file cannot be written, has another ending, or
            exists and is not as gms-fsm wrote it.
        """
        from gms_fsm.systems.files.toml import save

        return save(self, checked_path("path", path))

    # ------------------------------------------------------------------ queries
    @property
    def open(self) -> tuple[str, ...]:
        """The inputs that no signal is given for, and what Python functions return."""
        returned = (name for each in self.controllers for name in each.outputs)
        return tuple(name for name in (*self.inputs, *returned) if name not in self.signals)

    @property
    def given(self) -> tuple[str, ...]:
        """The signals, and the inputs that wait for one."""
        return (*self.signals, *self.open)

    def with_inputs(self, inputs: Mapping[str, SignalLike]) -> System:
        """Return the same system with signals for inputs.

        Parameters
        ----------
        inputs : mapping of str to signal
            Names of `inputs`; any signal, as in `signals`.

        Returns
        -------
        System
            It runs once all of its inputs are given.

        Raises
        ------
        ParameterError, SignalError, ExpressionError
            If it has no such input, or it is no signal.
        """
        given = mapping_of(inputs, "inputs")
        for name in given:
            if name not in self.inputs:
                raise unknown("input", name, self.inputs, place="inputs")
        return replace(self, signals={**self.signals, **given})

    @property
    def names(self) -> tuple[str, ...]:
        """All names that its texts can use."""
        moved = (name for body in self.bodies for name in (body.x, body.v))
        updated = (name for each in self.sampled for name in each.updates)
        given = (
            f"{each.name}.{name}" for each in self.supervisors for name in each.chart.force_names
        )
        every = ("t", *moved, *self.flow, *updated, *self.given, *self.numbers, *self.let, *given)
        return tuple(dict.fromkeys(every))

    @property
    def readable(self) -> tuple[str, ...]:
        """All names that its texts can read: its own, and what they see of machines.

        That is ``is_in(pad.stuck)`` and ``count(pad.slip)``, and by ``pad.z`` the variables of
        single elements, the velocities and the forces.
        """
        found = [*self.names]
        for each in self.machines:
            chart, one = each.chart, each.n == 1
            paths = chart.nesting.levels
            found += [f"{word}({each.name}.{path})" for word in COUNTS[not one :] for path in paths]
            own = (*chart.variables[: len(chart.variables) * one], *chart.velocities)
            found += [f"{each.name}.{name}" for name in (*own, *chart.force_names)]
        return tuple(dict.fromkeys(found))

    @property
    def events(self) -> tuple[str, ...]:
        """The events that machines wait for or emit, as components of the state vector."""
        return tuple(dict.fromkeys(name for each in self.machines for name in each.chart.events))

    @property
    def machines(self) -> tuple[Contact, ...]:
        """Whatever switches: the contacts, then the supervisors."""
        return (*self.contacts, *self.supervisors)

    def body(self, name: str) -> Body:
        """Return a body by name.

        Parameters
        ----------
        name : str
            One of its bodies' names.

        Returns
        -------
        Body
            That one.

        Raises
        ------
        ParameterError
            If there is none.
        """
        return _found(self.bodies, name, "body")

    def contact(self, name: str) -> Contact:
        """Return a contact, or a supervisor, by name.

        Parameters
        ----------
        name : str
            One of its contacts' or supervisors' names.

        Returns
        -------
        Contact
            That one.

        Raises
        ------
        ParameterError
            If there is none.
        """
        return _found(self.machines, name, "contact")


MOST_READ = 64
_read_before: dict[Any, System] = {}  # by its texts
_mounted_before: dict[Any, System] = {}  # by what the texts of a model on a rig depend on


def _kept(known: dict[Any, System], key: Any, system: System) -> System:
    """Remember a system whose texts have been read."""
    if len(known) >= MOST_READ:
        known.clear()
    known[key] = system
    return system


Named = TypeVar("Named", "Body", "Contact")


def _found(parts: tuple[Named, ...], name: str, noun: str) -> Named:
    for each in parts:
        if each.name == name:
            return each
    raise unknown(noun, name, (each.name for each in parts))


def with_model(system: System, model: Model, rig: Rig) -> System:
    """Return a model on a rig as a system, given that of others of the same shape.

    No text is read again.
    """
    given = rig.numbers
    numbers = {name: float(given[name]) for name in system.numbers}
    numbers = finite_numbers(numbers, f"system {shown(system.name)}")
    new: System = copied(
        system,
        contacts=(system.contacts[0].with_model(model),),
        numbers=numbers,
        signals=dict(rig.signals),
        _like=system.shape,
    )
    return new


# --------------------------------------------------------------------------- from a model on a rig
def system_of(model: Model, rig: Rig, period: float | None = None) -> System:
    """Return a model on a rig as a system: one body, called body, and one contact, called friction.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, PulledSlider
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> system_of(model, PulledSlider(1.0, 2.0, 0.1)).springs[0].rest
    'speed * t'
    """
    signals = tuple(rig.signals.items())
    chart, values = model.chart, model.values
    key = (
        ByIdentity(chart),
        tuple(is_list(values[each.name]) for each in chart.parameters),
        None if model.stribeck is None else model.stribeck.text,
        tuple(getattr(model, "inputs", {}).items()),
        rig.title,
        rig.acceleration,
        getattr(rig, "springs", ()),
        tuple(rig.numbers),
        tuple((name, type(each), getattr(each, "text", None)) for name, each in signals),
        period,
    )
    if (like := _mounted_before.get(key)) is None:
        like = _kept(_mounted_before, key, _read_from(model, rig, period))
    return with_model(like, model, rig)


def _read_from(model: Model, rig: Rig, period: float | None) -> System:
    """Read the texts of a model on a rig."""
    springs: tuple[Spring, ...] = ()
    if rig.acceleration is None:
        body = Body("body", velocity="v")
    else:
        for name in ({*rig.signals} | {*rig.numbers}) & {"F"}:
            raise ParameterError(
                f"the name {name!r} is used twice, for the friction force too",
                place=f"rig {rig.title!r}",
            )
        names = ["t", "x", "v", "F", *rig.signals, *rig.numbers]
        force, inertia = _balance(parse_value(rig.acceleration, names), rig)
        body = Body("body", inertia=spell(inertia), force=spell(force))
        declared = getattr(rig, "springs", ())
        # A class derived from ours may have another acceleration.
        if declared and force == on_ground(declared, body, names):
            body, springs = replace(body, force="0"), declared
    return System(
        rig.title,
        bodies=(body,),
        springs=springs,
        contacts=(Contact("friction", model, period=period),),
        signals=dict(rig.signals),
        numbers=rig.numbers,
    )


def _balance(acceleration: Value, rig: Rig) -> tuple[Value, Value]:
    """Split an acceleration into (force - F) / inertia."""
    match acceleration:
        case Binary("/", numerator, inertia) if "F" not in names_in(inertia):
            force, sign = _without_force(numerator)
            if sign == -1:
                return force, inertia
    slope = derivative(acceleration, "F")
    if slope is None or "F" in names_in(slope) or slope == Number(0.0):
        raise ParameterError(
            f"the acceleration is {rig.acceleration!r}",
            place=f"rig {rig.title!r}",
            advice="it must be linear in F, for example '(F_a - F) / mass'",
        )
    if slope == Number(-1.0):
        force, sign = _without_force(acceleration)
        if sign == -1:
            return force, Number(1.0)
    inertia = Binary("/", Number(-1.0), slope)
    return Binary("*", renamed(acceleration, {"F": Number(0.0)}), inertia), inertia


def _without_force(tree: Value) -> tuple[Value, int]:
    """Return a sum without its term F, and the sign of that term; 0 if there is no such term."""
    match tree:
        case Name("F"):
            return Number(0.0), 1
        case Negative(operand):
            rest, sign = _without_force(operand)
            return rest if rest == Number(0.0) else Negative(rest), -sign
        case Binary("+" | "-" as op, left, right):
            inside, other = names_in(left), names_in(right)
            if "F" in inside and "F" not in other:
                rest, sign = _without_force(left)
                if rest == Number(0.0):
                    return right if op == "+" else Negative(right), sign
                return Binary(op, rest, right), sign
            if "F" in other and "F" not in inside:
                rest, sign = _without_force(right)
                if rest == Number(0.0):
                    return left, sign if op == "+" else -sign
                return Binary(op, left, rest), sign if op == "+" else -sign
    return tree, 0
