"""Checked trees as formulas that matplotlib and LaTeX typeset."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple

from gms_fsm.charts.chart import Chart
from gms_fsm.language import Binary, Call, Negative, Value, fold
from gms_fsm.language._print import LEVELS

__all__ = ["Formulas", "formula", "symbol"]

ATOM = 9  # binds tighter than every operator
SIGNS = {"+": "+", "-": "-", "*": r"\,", "/": "/"}
FUNCTIONS = ("exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "min", "max")
OTHERS = {"atan": "arctan", "asinh": "arsinh", "sign": "sgn", "log": "ln"}
GREEK = frozenset(
    unicodedata.name(each).rpartition(" ")[2].lower().replace("lamda", "lambda")
    for each in "αβγδεζηθκλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ"
)


class _Part(NamedTuple):
    """A formula and how tightly it binds."""

    text: str
    level: int

    def at(self, level: int) -> str:
        return self.text if self.level >= level else rf"\left({self.text}\right)"


class _Formula:
    """The algebra of formulas."""

    def __init__(self, names: Mapping[str, str]) -> None:
        self.names = names

    def number(self, value: float) -> _Part:
        if value == math.pi:
            return _Part(r"\pi", ATOM)
        digits, _, exponent = f"{value:.12g}".partition("e")
        if not exponent:
            return _Part(digits, ATOM if value >= 0 else LEVELS["neg"])
        power = rf"10^{{{int(exponent)}}}"
        text = power if digits == "1" else rf"{digits} \cdot {power}"
        return _Part(text, LEVELS["*"])

    def name(self, name: str) -> _Part:
        return _Part(self.names.get(name) or symbol(name), ATOM)

    def negative(self, _: Negative, parts: Iterator[_Part]) -> _Part:
        return _Part("-" + next(parts).at(LEVELS["neg"]), LEVELS["neg"])

    def binary(self, node: Binary, parts: Iterator[_Part]) -> _Part:
        left, right = parts
        if node.op == "/":
            return _Part(rf"\frac{{{left.text}}}{{{right.text}}}", LEVELS["*"])
        level = LEVELS[node.op]
        # Sums and products of real numbers need no parentheses on the right.
        after = level + 1 if node.op == "-" else level
        sign = rf" {SIGNS[node.op]} "
        if node.op == "*" and right.text[:1].isdigit():
            sign = r" \cdot "
        return _Part(left.at(level) + sign + right.at(after), level)

    def power(self, _: Binary, parts: Iterator[_Part]) -> _Part:
        base, exponent = parts
        return _Part(rf"{base.at(ATOM)}^{{{exponent.text}}}", LEVELS["**"])

    def call(self, node: Call, parts: Iterator[_Part]) -> _Part:
        texts = [part.text for part in parts]
        if node.function == "abs":
            return _Part(rf"\left|{texts[0]}\right|", ATOM)
        if node.function == "sqrt":
            return _Part(rf"\sqrt{{{texts[0]}}}", ATOM)
        name = OTHERS.get(node.function, node.function)
        written = "\\" + name if name in FUNCTIONS else rf"\mathrm{{{name}}}"
        arguments = r",\,".join(texts)
        return _Part(rf"{written}\left({arguments}\right)", ATOM)


def symbol(name: str) -> str:
    r"""Return a name as in formulas.

    Examples
    --------
    >>> print(symbol("sigma_0"), symbol("v_s"), symbol("load"))
    \sigma_{0} v_{s} \mathrm{load}
    """
    head, _, index = name.partition("_")
    if head.lower() in GREEK and len(head) > 1:
        head = "\\" + head
    elif head[1:].isdigit():
        head, index = head[:1], head[1:] + (f",{index}" if index else "")
    elif len(head) > 1:
        head = rf"\mathrm{{{head}}}"
    if not index:
        return head
    index = index.replace("_", ",")
    if len(index) > 1:
        index = rf"\mathrm{{{index}}}"
    return rf"{head}_{{{index}}}"


def formula(tree: Value, names: Mapping[str, str] | None = None) -> str:
    r"""Return a value as a formula, without dollar signs.

    Parameters
    ----------
    tree : Value
        A checked tree.
    names : mapping of str to str, optional
        Formulas for names, instead of `symbol`.

    Returns
    -------
    str
        In the language of TeX, as far as matplotlib knows it.

    Examples
    --------
    >>> from gms_fsm.language import parse_value
    >>> print(formula(parse_value("(F_s - F_c) * exp(-(v / v_s)**2)", ["F_s", "F_c", "v", "v_s"])))
    \left(F_{s} - F_{c}\right) \, \exp\left(-\left(\frac{v}{v_{s}}\right)^{2}\right)
    """
    return fold(tree, _Formula(names or {})).text


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
        self.names = {name: _indexed(symbol(name)) for name in indexed}
        for name in chart.variables:
            dotted = rf"\dot{{{symbol(name)}}}"
            self.names[f"d{name}"] = _indexed(dotted) if name in indexed else dotted

    def __call__(self, tree: Value) -> str:
        """Return a value of the chart as a formula."""
        return formula(tree, self.names)

    def left(self, name: str) -> str:
        """Return the left side of an equation."""
        return self.names.get(name) or symbol(name)

    def named(self) -> list[str]:
        """Return the named expressions, as equations."""
        return [f"{self.left(name)} = {self(tree)}" for name, tree in self.chart.lets.items()]

    def of_states(self) -> list[tuple[tuple[str, ...], str]]:
        """Return flows and forces as equations, each with the states in which it holds.

        Returns
        -------
        list of (tuple of str, str)
            No states if it holds in all of them.
        """
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
                held = ",\\ ".join(f"{symbol(each)} = 0" for each in chart.velocities)
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
