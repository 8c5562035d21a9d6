"""Changing values at a point of a run: the permitted edits, and the resulting initial values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gms_fsm.errors import SessionError
from gms_fsm.inspection._arguments import check_element
from gms_fsm.systems.models import Model, parameter_names
from gms_fsm.traces.scope import Scope

__all__ = ["Edits", "initial_with"]


@dataclass(frozen=True)
class Edits:
    """The changes made by a poke.

    Parameters
    ----------
    variables : mapping of str to mapping of int to float
        New values of the variables of the chart, by element.
    v : float or None
        New velocity, m/s.
    state : mapping of int to str
        New states by element.
    """

    variables: Mapping[str, Mapping[int, float]]
    v: float | None
    state: Mapping[int, str]

    @classmethod
    def of(
        cls,
        model: Model,
        variables: Mapping[str, Mapping[int, float]] | None,
        v: float | None,
        state: Mapping[int, str] | None,
    ) -> Edits:
        """Return checked edits; raise `SessionError` for names that the model does not have."""
        for what, given in (("variables", variables), ("state", state)):
            if given is not None and not isinstance(given, Mapping):
                raise SessionError(
                    "give a mapping, for example variables={'z': {0: 0.1}} or state={0: 'slip'}",
                    place=what,
                    value=given,
                )
        for name, values in (variables or {}).items():
            if name in parameter_names(model):
                raise SessionError(
                    f"{name} is a parameter",
                    advice="to change it, make another model and session",
                )
            if name not in model.chart.variables:
                known = ", ".join(model.chart.variables)
                raise SessionError(f"no variable {name!r}", advice=f"there are {known}")
            if not isinstance(values, Mapping):
                raise SessionError(
                    f"give its values by element, for example {{{name!r}: {{0: 0.1}}}}",
                    place=name,
                    value=values,
                )
        own = {name: dict(values) for name, values in (variables or {}).items()}
        edits = cls(own, v, dict(state or {}))
        if not (any(edits.variables.values()) or edits.state or v is not None):
            raise SessionError("nothing to poke", advice="give variables, v or state")
        for element in (*(i for values in own.values() for i in values), *edits.state):
            check_element(element, model)
        return edits

    def __str__(self) -> str:
        """Text such as ``z1 = 0.2, state 2 = slip``, with elements numbered from 1."""
        parts = [
            f"{name}{i + 1} = {value:.6g}"
            for name, values in self.variables.items()
            for i, value in values.items()
        ]
        if self.v is not None:
            parts.append(f"v = {self.v:.6g}")
        parts += [f"state {i + 1} = {name}" for i, name in self.state.items()]
        return ", ".join(parts)


def initial_with(edits: Edits, here: Scope, *, prescribed: bool) -> dict[str, Any]:
    """Return the ``initial`` of a run that continues from a point with edits.

    Parameters
    ----------
    edits : Edits
        The changes.
    here : Scope
        The values at the point.
    prescribed : bool
        Whether the rig prescribes the velocity.

    Returns
    -------
    dict
        In the form accepted by `gms_fsm.simulate`.
    """
    initial: dict[str, Any] = {"x": here.x}
    for name in here.layout.y.own:
        values = edits.variables.get(name, {})
        initial[name] = [values.get(i, old) for i, old in enumerate(here.each(name))]
    initial["states"] = [edits.state.get(i, name) for i, name in enumerate(here.states)]
    if edits.v is not None or not prescribed:
        initial["v"] = here.v if edits.v is None else edits.v
    return initial
