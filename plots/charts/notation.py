"""Notations for the texts of a chart: as in Stateflow, or as mathematical formulas."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.language import (
    EVENT,
    MATHEMATICS,
    MATLAB_LIKE,
    Both,
    Condition,
    Either,
    Name,
    Value,
    renamed,
    spell,
)

NOTATIONS = ("stateflow", "math")

_LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_GREEK = {
    unicodedata.name(c).removeprefix("GREEK SMALL LETTER ").lower(): c
    for c in "αβγδεζηθκμνξρστφχψω"
}


@dataclass(frozen=True)
class ChartWriter:
    """Writes the texts of a chart in one notation, from the checked trees.

    Parameters
    ----------
    chart : Chart
        The chart whose names are written.
    notation : {"stateflow", "math"}
        The notation.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> chart = GMS_ELEMENT["signed"]
    >>> ChartWriter(chart, "math").text(chart.guards["arrest"])
    '|v| ≤ v_c ∧ |z| < s(v)'
    """

    chart: Chart
    notation: str

    @property
    def math(self) -> bool:
        """Whether the notation is mathematical."""
        return self.notation == "math"

    def text(self, tree: Value | Condition) -> str:
        """Write a tree."""
        if not self.math:
            return spell(tree, MATLAB_LIKE)
        chart = self.chart
        known = (*chart.inputs, *chart.velocities, *chart.variables, *chart.parameter_names)
        own = (*chart.let, *chart.force_names, *chart.rate_names)
        names = {name: _symbol(name) for name in (*known, *own)}
        names |= {f"d{name}": self.rate(name) for name in chart.variables}
        if "s" in chart.inputs:
            names["s"] = "s(v)"  # the threshold that the model supplies depends on the velocity
        return spell(tree, MATHEMATICS, names)

    def rate(self, variable: str) -> str:
        """Write the time derivative of a variable."""
        if not self.math:
            return f"d{variable}"
        dotted = unicodedata.normalize("NFC", variable + "\u0307")
        return dotted if len(dotted) == 1 else f"d{_symbol(variable)}/dt"

    def flow(self, variable: str, tree: Value) -> str:
        """Write a flow."""
        return f"{self.rate(variable)} = {self.text(tree)}{'' if self.math else ';'}"

    def equation(self, name: str, tree: Value) -> str:
        """Write what a force or a named expression is."""
        left = _symbol(name) if self.math else name
        return f"{left} = {self.text(tree)}{'' if self.math else ';'}"

    def total(self, force: str, tree: Value) -> str:
        """Write the force of a contact over the sum of its elements' forces."""
        elements = Name(f"Σ{force}" if self.math else f"sum({force})")
        return self.equation(force, renamed(tree, {force: elements}))

    def held(self) -> str:
        """Write what a locked state does."""
        write = _symbol if self.math else str
        zeros = ", ".join(f"{write(each)} = 0" for each in self.chart.velocities)
        forces = [write(each) for each in self.chart.force_names]
        return f"{zeros}, {' and '.join(forces)} {'hold them' if forces[1:] else 'holds it'}"

    def assignment(self, variable: str, tree: Value) -> str:
        """Write an assignment."""
        if self.math:
            return f"{_symbol(variable)} := {self.text(tree)}"
        return f"{variable} = {self.text(tree)};"

    @property
    def words(self) -> Mapping[type, str]:
        """Words between the parts of a conjunction or a disjunction."""
        written = (MATHEMATICS if self.math else MATLAB_LIKE).operators
        return {Both: str(written["and"].write).strip(), Either: str(written["or"].write).strip()}

    def actions(self, edge: Transition) -> str:
        """Write what an edge assigns on one line; empty if there is nothing.

        What the states at its ends assign stands in these, and what no text declares nowhere.
        """
        chart = self.chart
        done = edge.performs[1:-1] or (("action", edge.name),)
        pairs = [pair for key in done for pair in chart.assignments[key].items()]
        texts = [
            f"send({name.removeprefix(EVENT)})" + ";" * (not self.math)
            if name.startswith(EVENT)
            else self.assignment(name, tree)
            for name, tree in pairs
            if name not in chart.hidden
        ]
        if not texts:
            return ""
        return "/ " + ", ".join(texts) if self.math else "{" + " ".join(texts) + "}"


def _symbol(name: str) -> str:
    """Write a name as in formulas: sigma_0 as σ₀."""
    head, _, index = name.partition("_")
    head = _GREEK.get(head, head)
    if not index:
        return head if name == name.rstrip("_") else name
    return head + index.translate(_LOWERED) if index.isdecimal() else f"{head}_{index}"
