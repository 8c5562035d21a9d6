"""Changing values at a point of a run: the permitted edits, and the resulting initial values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gms_fsm.errors import SessionError, shown
from gms_fsm.foundation.arguments import there_are, unknown
from gms_fsm.run.problem import Problem
from gms_fsm.session.elements import element_name, machine_of
from gms_fsm.systems.models import parameter_names

if TYPE_CHECKING:
    from gms_fsm.session.tree.branch import BranchRow


@dataclass(frozen=True)
class Edits:
    """The changes made by a poke.

    Parameters
    ----------
    variables : mapping of str to float or mapping of int to float
        New values by name; those of a chart's variables by element, from 0. In a system the names
        are those of the state vector, such as ``x_l`` or ``gear.z``.
    v : float or None
        New velocity of a model on a rig, m/s.
    state : mapping of int or str to str
        New states by element: by index for a model on a rig, in a system by text (``gear 1``).
    """

    variables: Mapping[str, float | Mapping[int, float]]
    v: float | None
    state: Mapping[int | str, str]

    @classmethod
    def of(
        cls,
        start: Problem,
        variables: Mapping[str, Any] | None,
        v: float | None,
        state: Mapping[int | str, str] | None,
    ) -> Edits:
        """Return checked edits; raise `SessionError` for names that the run does not have."""
        for what, given in (("variables", variables), ("state", state)):
            if given is not None and not isinstance(given, Mapping):
                raise SessionError(
                    "give a mapping, for example variables={'z': {0: 0.1}} or state={0: 'slip'}",
                    place=what,
                    value=given,
                )
        if start.what.named:
            whole = {**(variables or {}), **({} if v is None else {"v": v})}
            own, v = _of_system(start, whole), None
        else:
            own = _of_model(start, variables or {})
            if v is not None:
                _check_free(start, "v")
        machines = {machine_of(element, start): name for element, name in (state or {}).items()}
        states: dict[int | str, str] = {
            element_name(start, machine) if start.what.named else machine: name
            for machine, name in machines.items()
        }
        edits = cls(own, v, states)
        if not (any(each != {} for each in own.values()) or states or v is not None):
            raise SessionError("nothing to poke", advice="give variables, v or state")
        return edits

    def __str__(self) -> str:
        """Text such as ``z1 = 0.2, state 2 = slip``, with elements numbered from 1."""
        parts = []
        for name, values in self.variables.items():
            if isinstance(values, Mapping):
                parts += [f"{name}{i + 1} = {value:.6g}" for i, value in values.items()]
            else:
                parts.append(f"{name} = {values:.6g}")
        if self.v is not None:
            parts.append(f"v = {self.v:.6g}")
        for i, name in self.state.items():
            who = f"state {i + 1}" if isinstance(i, int) else f"state of {i}"
            parts.append(f"{who} = {name}")
        return ", ".join(parts)


def pokeable(start: Problem) -> list[str]:
    """Return the names in the state vector of a system that a poke can change."""
    layout, system = start.program.layout, start.system
    updated = (name for each in system.sampled for name in each.updates)
    moved = (name for body in system.bodies for name in (body.x, body.v))
    shared = [name for name in (*moved, *system.flow, *updated) if name in layout.y.shared]
    shared += layout.events
    own = [
        bank.of(name)
        for bank in layout.banks
        for name in bank.variables
        if name not in system.contact(bank.name).chart.hidden
    ]
    return [*shared, *own]


def _of_model(start: Problem, given: Mapping[str, Any]) -> dict[str, float | Mapping[int, float]]:
    """Return the new values of the variables of a model on a rig, checked."""
    chart = start.model.chart
    known = [name for name in chart.variables if name not in chart.hidden]
    found: dict[str, float | Mapping[int, float]] = {}
    for name, values in given.items():
        if name in parameter_names(start.model):
            raise _constant(name, "parameter", "model")
        if name in chart.hidden:
            raise _made(name)
        if name not in known:
            raise unknown("variable", name, known, SessionError)
        if not isinstance(values, Mapping):
            raise SessionError(
                f"give its values by element, for example {{{name!r}: {{0: 0.1}}}}",
                place=name,
                value=values,
            )
        found[name] = {machine_of(i, start): value for i, value in values.items()}
    return found


def _of_system(start: Problem, given: Mapping[str, Any]) -> dict[str, float | Mapping[int, float]]:
    """Return the new values of the state vector of a system, checked."""
    found: dict[str, float | Mapping[int, float]] = {}
    for key, value in given.items():
        name, i = _resolved(start, key)
        if name in start.program.layout.y.shared:
            found[name] = value
            continue
        block = start.program.layout.y.all_of(name)
        several = {i: value} if i is not None else _by_element(key, value, len(block))
        before = found.get(name, {})
        found[name] = {**(before if isinstance(before, Mapping) else {}), **several}
    return found


def _resolved(start: Problem, key: object) -> tuple[str, int | None]:
    """Return the name in the state vector that a key means, and the element if it has a number."""
    layout, known = start.program.layout, pokeable(start)
    keys = {each: name for each, name in layout.keys.items() if name in known}
    if isinstance(key, str):
        if key in keys:
            return keys[key], None
        form = re.fullmatch(r"(.*?\D)(\d{1,9})", key)
        name = keys.get(form[1], "") if form else ""
        if form and name in layout.y.own and 1 <= int(form[2]) <= len(layout.y.all_of(name)):
            return name, int(form[2]) - 1
        if key in start.system.numbers:
            raise _constant(key, "number", "system")
        if key in start.system.signals:
            raise _constant(key, "signal", "system")
        for contact in start.system.machines:
            plain = key.removeprefix(f"{contact.name}.")
            if plain in contact.chart.parameter_names:
                raise _constant(key, "parameter", "system")
            if {plain, plain.rstrip("0123456789")} & {*contact.chart.hidden}:
                raise _made(key)
        _check_free(start, key)
    raise SessionError(f"{shown(key)} cannot be poked", advice=there_are(key, known))


def _check_free(start: Problem, key: str) -> None:
    """Refuse the velocity of a body that is moved."""
    for body in start.system.bodies:
        if body.driven and key in (body.v, f"{body.name}.v"):
            whose = f"velocity of {body.name}" if start.what.named else "velocity v"
            raise SessionError(f"the {whose} is given", advice="it cannot be poked")


def _made(name: str) -> SessionError:
    return SessionError(f"{name} is made by the chart", advice="it cannot be poked")


def _constant(name: str, kind: str, whole: str) -> SessionError:
    return SessionError(
        f"{name} is a {kind}", advice=f"to change it, make another {whole} and session"
    )


def _by_element(key: object, value: Any, n: int) -> dict[int, float]:
    """Return values by element: from a mapping, from one value each, or from that of the only."""
    if isinstance(value, Mapping):
        for i in value:
            if not isinstance(i, int) or not 0 <= i < n:
                raise SessionError(
                    f"{key} of no element {shown(i)}", advice=f"there are 0 to {n - 1}"
                )
        return dict(value)
    if isinstance(value, Iterable) and not isinstance(value, str):
        several: Sequence[float] = list(value)
        if len(several) == n:
            return dict(enumerate(several))
    elif n == 1:
        return {0: value}
    raise SessionError(
        f"give {n} values, or some by element, for example {{{key!r}: {{0: 0.1}}}}",
        place=str(key),
        value=value,
    )


def initial_with(edits: Edits, start: Problem, here: BranchRow) -> dict[str, Any]:
    """Return the ``initial`` of a run that continues from a point with edits."""
    initial = initial_values(start, here)
    layout = start.program.layout
    poked = {machine_of(element, start): name for element, name in edits.state.items()}
    for bank in layout.banks:
        key, chart = f"{bank.name}.states", start.system.contact(bank.name).chart
        states = dict(enumerate(initial[key], start=bank.first))
        moved = {i: (states[i], name) for i, name in poked.items() if i in states}
        initial[key] = [*(states | {i: new for i, (_, new) in moved.items()}).values()]
        for name in chart.hidden:
            kept = dict(enumerate(initial[bank.of(name)], start=bank.first))
            kept |= {i: chart.nesting.moved(name, kept[i], *ends) for i, ends in moved.items()}
            initial[bank.of(name)] = [*kept.values()]
    for name, values in edits.variables.items():
        if isinstance(values, Mapping):
            own = name if start.what.named else layout.contact().of(name)
            initial[own] = [values.get(i, old) for i, old in enumerate(initial[own])]
        else:
            initial[name] = values
    return initial if edits.v is None else initial | {"v": edits.v}


def initial_values(start: Problem, here: BranchRow) -> dict[str, Any]:
    """Return the whole state at a point of a run as the ``initial`` of another."""
    layout = start.program.layout
    initial: dict[str, Any] = layout.y.named(here.y)
    modes = list(here.mode[layout.elements])
    for bank in layout.banks:
        names = [state.name for state in start.system.contact(bank.name).chart.states]
        initial[f"{bank.name}.states"] = [names[mode] for mode in modes[bank.elements]]
    return initial
