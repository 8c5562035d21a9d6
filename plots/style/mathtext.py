"""Checked trees as formulas that matplotlib and LaTeX typeset."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from textwrap import wrap

from gms_fsm.charts.chart import Chart
from gms_fsm.language import LATEX, Value, latex_name, spell


def formula(tree: Value, names: Mapping[str, str] | None = None) -> str:
    r"""Return a value as a formula, without dollar signs.

    Examples
    --------
    >>> from gms_fsm.language import parse_value
    >>> print(formula(parse_value("(F_s - F_c) * exp(-(v / v_s)**2)", ["F_s", "F_c", "v", "v_s"])))
    \left(F_{s} - F_{c}\right) \, \exp\left(-\left(\frac{v}{v_{s}}\right)^{2}\right)
    """
    return spell(tree, LATEX, names)


def folded(text: str, letters: int) -> str:
    r"""Return a text in lines; what stands between dollar signs is as long as it is printed.

    Examples
    --------
    >>> print(folded(r"$\sigma_{1,i}$: damping of $z_i$, in Ns/m", 18))
    $\sigma_{1,i}$: damping of
    $z_i$, in Ns/m
    """
    formulas = re.findall(r"\$[^$]*\$", text)
    printed = [re.sub(r"\\[A-Za-z]+", "x", each) for each in formulas]
    printed = [re.sub(r"[${}_^\\\s]", "", each) for each in printed]
    widths = iter("\0" * max(1, len(each)) for each in printed)
    plain = re.sub(r"\$[^$]*\$", lambda _: next(widths), text)
    lines = wrap(plain, letters, break_long_words=False, break_on_hyphens=False)
    back = iter(formulas)
    return "\n".join(re.sub("\0+", lambda _: next(back), line) for line in lines)


class Formulas:
    r"""The equations of a chart.

    Parameters
    ----------
    chart : Chart
        The chart.
    indexed : collection of str
        Names that get the index of the element.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> print(*Formulas(GMS_ELEMENT["signed"], ("z", "s")).of_states()[0])
    ('stick',) \dot{z}_{i} = v
    """

    def __init__(self, chart: Chart, indexed: Collection[str] = ()) -> None:
        self.chart = chart
        self.names = {name: _indexed(latex_name(name)) for name in indexed}
        for name in chart.variables:
            dotted = rf"\dot{{{latex_name(name)}}}"
            self.names[f"d{name}"] = _indexed(dotted) if name in indexed else dotted

    def __call__(self, tree: Value) -> str:
        """Return a value of the chart as a formula."""
        return formula(tree, self.names)

    def left(self, name: str) -> str:
        """Return the left side of an equation."""
        return self.names.get(name) or latex_name(name)

    def named(self) -> list[str]:
        """Return the named expressions, as equations."""
        return [f"{self.left(name)} = {self(tree)}" for name, tree in self.chart.lets.items()]

    def of_states(self) -> list[tuple[tuple[str, ...], str]]:
        """Return flows and forces as equations, each with the states in which it holds."""
        chart, found = self.chart, dict[str, list[str]]()
        names = [state.name for state in chart.states]
        for variable in chart.variables:
            for state in names:
                if (state, variable) in chart.flows:
                    tree = chart.flows[state, variable]
                    text = f"{self.left(f'd{variable}')} = {self(tree)}"
                    found.setdefault(text, []).append(state)
        for force in chart.force_names:
            for state in names:
                force_tree = chart.forces[state, force]
                held = ",\\ ".join(f"{latex_name(each)} = 0" for each in chart.velocities)
                text = rf"{held},\ {self.left(force)}\ \mathrm{{holds\ it}}"
                if force_tree is not None:
                    text = f"{self.left(force)} = {self(force_tree)}"
                found.setdefault(text, []).append(state)
        return [
            (() if len(states) == len(names) else tuple(states), text)
            for text, states in found.items()
        ]


def _indexed(text: str) -> str:
    """Add the index of the element."""
    return f"{text[:-1]},i}}" if "_{" in text else f"{text}_{{i}}"
