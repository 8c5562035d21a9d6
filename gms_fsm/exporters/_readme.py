"""What the README of every text format says about a friction."""

from __future__ import annotations

from gms_fsm.exporters.plain.element import NamedFriction
from gms_fsm.exporters.plain.parts import Constant
from gms_fsm.foundation.text import visible


def about_friction(element: NamedFriction) -> str:
    """Return the model, its inputs, its numbers and its states, as Markdown.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> from gms_fsm.exporters._subject import Subject
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> made = NamedFriction.of(Subject.of(model, "st"), ())
    >>> print(about_friction(made).splitlines()[0])
    GMS element, signed law, 4 elements (arXiv 2512.03049 (2025)).
    """
    count = f"{element.n} element{'s' if element.n > 1 else ''}"
    source = f" ({visible(element.reference)})" if element.reference else ""
    lines = [f"{visible(element.title)}, {count}{source}."]
    lines += ["", "Inputs:", ""]
    lines += [f"- {name}{_described(about)}" for name, about in element.inputs]
    lines += ["", "Numbers:", ""]
    lines += [
        f"- {each.name} = {_shown(each)}{_described(each.about)}" for each in element.constants
    ]
    if len(element.states) > 1:
        lines += ["", f"States: {', '.join(each.name for each in element.states)}."]
    return "\n".join(lines) + "\n"


def _shown(constant: Constant) -> str:
    value = constant.value
    return ", ".join(map(repr, value)) if isinstance(value, tuple) else repr(value)


def _described(about: str) -> str:
    return f" ({visible(about)})" if about else ""
