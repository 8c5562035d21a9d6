"""Builds a chart from states and edges that come from another program, and texts given beside."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, TypedDict

from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.parts import State, Transition, texts_of
from gms_fsm.errors import ChartError
from gms_fsm.foundation.arguments import unknown

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart


@dataclass(frozen=True)
class ImportedEdge:
    """An edge as another program has it.

    Parameters
    ----------
    name : str
        Of the edge.
    sources : tuple of str
        The states it leaves.
    target : str
        The state it enters.
    place : str
        Where it is written, for messages.
    """

    name: str
    sources: tuple[str, ...]
    target: str
    place: str


@dataclass(frozen=True, kw_only=True)
class Texts:
    """What is given beside states and edges; the fields are those of `Chart.from_transitions`."""

    name: str = "imported chart"
    reference: str = ""
    inputs: Iterable[str] = ("v",)
    velocities: Iterable[str] = ("v",)
    variables: Iterable[str] = ()
    parameters: Iterable[Parameter | str | Mapping[str, Any]] = ()
    let: Mapping[str, str] = field(default_factory=dict)
    flows: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    guards: Mapping[str, str] = field(default_factory=dict)
    entry: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    exit: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    actions: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)
    state_outputs: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    contact_outputs: Mapping[str, str] = field(default_factory=dict)
    locked: Iterable[str] = ()
    impulses: Iterable[str] = ()

    @classmethod
    def of(cls, given: Mapping[str, Any], here: str) -> Texts:
        """Refuse unknown names."""
        known = [each.name for each in fields(cls)]
        for name in given:
            if name not in known:
                raise unknown("argument", name, known, ChartError, place=here)
        return cls(**given)


class GivenTexts(TypedDict, total=False):
    """The same as keyword arguments."""

    name: str
    reference: str
    inputs: Iterable[str]
    velocities: Iterable[str]
    variables: Iterable[str]
    parameters: Iterable[Parameter | str | Mapping[str, Any]]
    let: Mapping[str, str]
    flows: Mapping[str, Mapping[str, str]]
    guards: Mapping[str, str]
    entry: Mapping[str, Mapping[str, str]]
    exit: Mapping[str, Mapping[str, str]]
    actions: Mapping[str, Mapping[str, str]]
    outputs: Mapping[str, str]
    state_outputs: Mapping[str, Mapping[str, str]]
    contact_outputs: Mapping[str, str]
    locked: Iterable[str]
    impulses: Iterable[str]


def built(
    kind: type[Chart], states: list[str], edges: list[ImportedEdge], given: Texts, here: str
) -> Chart:
    """Return the chart."""
    by_state = {
        name: _known(getattr(given, name), states, "state", f"{here}: {name}")
        for name in ("flows", "entry", "exit", "state_outputs")
    }
    names = [edge.name for edge in edges]
    actions = _known(given.actions, names, "edge", f"{here}: actions")
    guards = texts_of(given.guards, f"{here}: guards")
    _check_known(guards, names, "edge", f"{here}: guards")
    for edge in edges:
        if edge.name not in guards:
            raise ChartError(
                "no guard is given for it",
                place=edge.place,
                advice=f"give one as text, guards={{{edge.name!r}: 'z > s'}}; 'True' for always",
            )
    locked = dict.fromkeys(map(str, _several(given.locked, f"{here}: locked")))
    _check_known(locked, states, "state", f"{here}: locked")
    impulses = dict.fromkeys(map(str, _several(given.impulses, f"{here}: impulses")))
    _check_known(impulses, names, "edge", f"{here}: impulses")
    return kind(
        given.name,
        given.inputs,
        given.variables,
        tuple(_parameter(each, here) for each in _several(given.parameters, f"{here}: parameters")),
        tuple(
            State(
                name,
                flow=by_state["flows"].get(name, {}),
                entry=by_state["entry"].get(name, {}),
                exit=by_state["exit"].get(name, {}),
                outputs=by_state["state_outputs"].get(name, {}),
                locked=name in locked,
            )
            for name in states
        ),
        tuple(
            Transition(
                edge.name,
                edge.sources,
                edge.target,
                guards[edge.name],
                actions.get(edge.name),
                impulse=edge.name in impulses,
            )
            for edge in edges
        ),
        given.outputs,
        given.reference,
        let=given.let,
        velocities=given.velocities,
        contact_outputs=given.contact_outputs,
    )


def _known(
    given: Mapping[str, Mapping[str, str]], names: list[str], kind: str, place: str
) -> Mapping[str, Mapping[str, str]]:
    if not isinstance(given, Mapping):
        raise ChartError(
            f"it gives texts for each {kind}, for example {{'slip': {{'z': 'v'}}}}",
            place=place,
            value=given,
        )
    _check_known(given, names, kind, place)
    return given


def _check_known(given: Mapping[str, object], names: list[str], kind: str, place: str) -> None:
    for name in given:
        if name not in names:
            raise unknown(kind, name, names, ChartError, place=place)


def _several(given: object, place: str) -> Iterable[Any]:
    if isinstance(given, str | Mapping) or not isinstance(given, Iterable):
        raise ChartError("give a tuple", place=place, value=given)
    return given


def _parameter(given: object, here: str) -> Any:
    """Return a parameter; mappings are as an exported file has them."""
    if not isinstance(given, Mapping):
        return given  # the chart checks it
    known = [each.name for each in fields(Parameter)]
    if "name" not in given or (unknown := sorted({*map(str, given)} - {*known})):
        said = "no name" if "name" not in given else f"unknown fields {', '.join(unknown)}"
        raise ChartError(
            f"a parameter has {said}",
            place=f"{here}: parameters",
            value=dict(given),
            advice=f"a Parameter has {', '.join(known)}",
        )
    return Parameter(**given)
