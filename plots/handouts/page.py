"""A model on one A4 page: its chart, equations, parameters and a hysteresis loop.

The page is a matplotlib figure, so that it is written in any format of figures; in PDF and SVG all
of it is vectors and text. Lengths are points, from the lower left corner.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from textwrap import wrap
from typing import Any
from xml.etree import ElementTree

import numpy as np

import gms_fsm
from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import SIGMA_2, STRIBECK, WEIGHTS, Parameter, adapted
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.foundation.text import visible
from gms_fsm.language import parse_value
from gms_fsm.systems.models import Model, is_model
from gms_fsm.systems.system import loaded
from gms_fsm.traces.trace import Trace
from plots import panels
from plots.charts.live_chart import plain_tree
from plots.charts.statechart import statechart
from plots.handouts.excitation import Excited, excited, of_rig
from plots.output import formats
from plots.output.graphviz import picture
from plots.output.svg_artists import EXACT, drawn, smallest
from plots.style import INK, MONO_FONT, PALE_GREY, SANS_FONT, TEXT_GREY, presets
from plots.style.mathtext import Formulas, formula
from plots.style.matplotlib import Axes, Figure, FigureCanvasAgg, RendererBase, rc_context
from plots.views.traces import check_trace

PAGE = (595.276, 841.89)  # A4
MARGIN, GAP = 40.0, 14.0
INNER = PAGE[0] - 2 * MARGIN
SMALLEST, TEXT, HEAD, TITLE = 7.0, 8.0, 9.5, 16.0
EQUATION = 10.0  # points; a fraction in it has 7
LEAD = 1.35  # height of a line, in sizes of its text
LETTER = 0.56  # width of a letter, in sizes of its text; of most letters, so that lines fit
LOOP = (236.0, 178.0)  # the loop with its labels; it fills what is left
LOWEST, HIGHEST = 124.0, 250.0  # of its heights, the first for a chart that needs the room
SHORT = 26  # letters: a table with longer values has the whole width
LARGEST = 1.2  # the largest scale of a chart
SIZES = presets.Preset("handout", None, None, TEXT, SMALLEST, 1.0, 150.0)


@refusing()
def handout(model: Model | Trace, path: str | Path) -> Path:
    """Write a model on one A4 page: chart, equations, parameters, and a hysteresis loop.

    Parameters
    ----------
    model : Model or Trace
        For example `GMS`, or a `ChartModel` of a chart of the zoo: then x(t) of the loop is a sine
        with an amplitude at which the model slips; a model that locks is pulled through a spring.
        Of a run the model, the rig, the loop, and the title of its scenario.
    path : str or Path
        Its ending selects the format, for example ``.pdf``. An existing file is replaced.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ParameterError
        If the chart does not fit on the page, or no suitable amplitude is found.
    MissingExtraError
        If matplotlib or Graphviz is not installed.

    Examples
    --------
    >>> import tempfile
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     handout(model, Path(folder, "gms.pdf")).name
    'gms.pdf'
    """
    formats.chosen(path, "figure")
    figure = handout_figure(model)
    with rc_context(EXACT):
        return formats.save(figure, path, "figure")


def handout_figure(model: Model | Trace) -> Figure:
    """Return the page of `handout` as a figure; its parameters and errors are the same."""
    run, heading = None, ""
    if isinstance(model, Trace):
        check_trace(model)
        run, heading, model = of_rig(model), model.heading, model.model
    if not is_model(model):
        raise ParameterError(
            f"model is {model!r:.60}",
            advice="give a model, such as GMS(parameters, law='signed'), or a run",
        )
    charts = _charts(model.chart)
    run = excited(model) if run is None else run
    with presets.preset(SIZES), rc_context(presets.settings()):
        figure = Figure(figsize=(PAGE[0] / 72, PAGE[1] / 72), dpi=SIZES.dpi)
        page = _Page(figure)
        top = _head(page, model, heading)
        foot = _foot(page, model)
        equations = _equations(model)
        rows = _rows(model)
        high = _equations_height(page, equations)
        beside = max(len(row[1]) for row in [*rows, HEADS]) <= SHORT
        wide = INNER - LOOP[0] - GAP if beside else INNER
        table = _table_height(rows, wide)
        for loop in (LOOP[1], LOWEST):
            lower = max(table, loop) if beside else table + GAP + loop
            root, size, scale = _chart(charts, top - foot - high - lower - 3 * GAP)
            letters = scale * smallest(root)
            if letters >= SMALLEST:
                break
        else:
            raise ParameterError(
                f"{model.title} does not fit on one A4 page: its chart would have letters of "
                f"{max(0.0, letters):.2g} pt, less than {SMALLEST:g} pt",
                advice="write the chart with plots.render, and the loop with plots.phase",
            )
        used = scale * size[1]
        _draw_chart(page, root, (PAGE[0] / 2 - scale * size[0] / 2, top - used), size, scale)
        _write_equations(page, equations, top - used - GAP)
        top -= used + high + 2 * GAP
        _table(page, rows, top, wide)
        if not beside:
            top -= table + GAP
        tall = min(HIGHEST, top - foot - GAP)
        _loop(page, run, (PAGE[0] - MARGIN - LOOP[0] if beside else MARGIN, top - tall), tall)
    return figure


# --------------------------------------------------------------------------- the page
@dataclass(frozen=True, eq=False)
class _Page:
    """A figure that is written on in points."""

    figure: Figure

    @cached_property
    def _renderer(self) -> RendererBase:
        canvas: Any = FigureCanvasAgg(self.figure)  # half of its methods are untyped
        found: RendererBase = canvas.get_renderer()
        return found

    def text(self, x: float, y: float, text: str, size: float = TEXT, **look: Any) -> None:
        """Write a line; y is its upper end."""
        look = {"va": "top", "color": INK, **look}
        self.figure.text(x / PAGE[0], y / PAGE[1], text, fontsize=size, **look)

    def axes(self, x: float, y: float, wide: float, tall: float) -> Axes:
        """Return axes."""
        box = (x / PAGE[0], y / PAGE[1], wide / PAGE[0], tall / PAGE[1])
        return self.figure.add_axes(box)

    def rule(self, y: float, wide: float) -> None:
        """Draw a thin line."""
        ax = self.axes(MARGIN, y, wide, 1.0)
        ax.set_axis_off()
        ax.axhline(0.5, color=PALE_GREY, linewidth=0.6)

    def size(self, text: str, size: float) -> tuple[float, float]:
        """Return width and height of a text."""
        artist = self.figure.text(0, 0, text, fontsize=size)
        box = artist.get_window_extent(self._renderer)
        artist.remove()
        return box.width * 72 / self.figure.dpi, box.height * 72 / self.figure.dpi


def _lines(text: str, size: float, wide: float) -> list[str]:
    return wrap(visible(text), max(8, int(wide / (LETTER * size)))) or [""]


def _head(page: _Page, model: Model, heading: str) -> float:
    """Write title, law and reference; return where the page goes on."""
    y = PAGE[1] - MARGIN
    for line in _lines(heading or model.title, TITLE, INNER):
        page.text(MARGIN, y, line, TITLE, fontweight="bold")
        y -= TITLE * LEAD
    count = "one element" if model.n == 1 else f"{model.n} elements, each with this chart"
    about = [model.title] * bool(heading) + [f"chart: {model.chart.name}", count]
    if model.chart.reference:
        about.append(f"equations: {model.chart.reference}")
    text = "; ".join(about)
    for line in _lines(f"{text[0].upper()}{text[1:]}.", TEXT, INNER):
        page.text(MARGIN, y, line, color=TEXT_GREY)
        y -= TEXT * LEAD
    return y - GAP / 2


def _foot(page: _Page, model: Model) -> float:
    """Write version and model; return where the page may end."""
    page.rule(MARGIN - 6, INNER)
    page.text(MARGIN, MARGIN - 8, visible(model.title), SMALLEST, color=TEXT_GREY)
    version = f"gms-fsm {gms_fsm.__version__}"
    page.text(PAGE[0] - MARGIN, MARGIN - 8, version, SMALLEST, ha="right", color=TEXT_GREY)
    return MARGIN


# --------------------------------------------------------------------------- the chart
Drawn = tuple[ElementTree.Element, tuple[float, float]]


def _charts(chart: Chart) -> list[Drawn]:
    """Return the chart as SVG, with its size: in both directions, and as a matrix."""
    found = []
    for direction, form in (("TB", "auto"), ("LR", "auto"), ("TB", "matrix")):
        graph = statechart(chart, notation="math", direction=direction, form=form)
        root = plain_tree(picture(graph, "svg"))
        wide, tall = (float(n) for n in root.get("viewBox", "").split()[2:])
        found.append((root, (wide, tall)))
    return found


def _chart(
    charts: Sequence[Drawn], room: float
) -> tuple[ElementTree.Element, tuple[float, float], float]:
    """Return the chart that fits best into the width of the page and a height, and its scale."""

    def scale(each: Drawn) -> float:
        return min(LARGEST, INNER / each[1][0], room / each[1][1])

    def letters(each: Drawn) -> float:
        return scale(each) * smallest(each[0])

    # A page is narrow: width counts first, then height.
    best = min(charts[:2], key=lambda each: (max(1.0, each[1][0] / INNER), each[1][1]))
    if letters(best) < SMALLEST:
        best = max(charts, key=letters)
    return (*best, scale(best))


def _draw_chart(
    page: _Page,
    root: ElementTree.Element,
    at: tuple[float, float],
    size: tuple[float, float],
    scale: float,
) -> None:
    x, y = (float(n) for n in root.get("viewBox", "").split()[:2])
    ax = page.axes(*at, scale * size[0], scale * size[1])
    ax.set(xlim=(x, x + size[0]), ylim=(y + size[1], y))
    ax.set_axis_off()
    for _ in drawn(ax, root, scale=scale):
        pass


# --------------------------------------------------------------------------- equations
def _equations(model: Model) -> list[tuple[str, str]]:
    """Return equations as formulas, each with the states in which it holds."""
    chart, many = model.chart, model.n > 1
    indexed = set[str]()
    if many:
        own = [name for name, value in model.values.items() if np.ndim(value)]
        indexed = {*chart.variables, *chart.force_names, *own, *({"s"} & {*chart.inputs})}
    write = Formulas(chart, sorted(indexed))
    found = [("", each) for each in write.named()]
    found += [(", ".join(states), each) for states, each in write.of_states()]
    if model.stribeck is not None:
        found += _curve(model, many)
    plain = Formulas(chart)
    for force in chart.force_names:
        total = rf"\sum_i {write.left(force)}" if many else plain.left(force)
        if force in chart.totals:
            found.append(("contact", f"{plain.left(force)} = {_total(chart, force, total)}"))
        elif model.sigma_2 or many:
            viscous = r" + \sigma_{2} \, v" if model.sigma_2 else ""
            found.append(("contact", f"{plain.left(force)} = {total}{viscous}"))
    return found


def _curve(model: Model, many: bool) -> list[tuple[str, str]]:
    assert model.stribeck is not None
    text = model.stribeck.text
    tree = parse_value(text, ["v", *model.stribeck.numbers])
    curve = formula(tree)
    if loaded(model):
        return [("", rf"s{'_{i} = w_{i}' if many else ' = w'} \left({curve}\right) N")]
    if not many and (model.weights == 1.0).all():
        return [("", f"s = {curve}")]
    left = "s_{i} = w_{i}" if many else "s = w"
    return [("", rf"{left} \left({curve}\right)")]


def _total(chart: Chart, force: str, total: str) -> str:
    return formula(chart.totals[force], {force: total})


def _columns(page: _Page, equations: Sequence[tuple[str, str]]) -> tuple[int, list[float]]:
    """Return in how many columns equations are written, and how high each one is."""
    sizes = [page.size(f"${each}$", EQUATION) for _, each in equations]
    labels = max((page.size(label, SMALLEST)[0] for label, _ in equations if label), default=0.0)
    widest = labels + 12 + max(wide for wide, _ in sizes)
    if widest > INNER:
        raise ParameterError("an equation is wider than an A4 page", advice="name parts of it: let")
    heights = [max(tall, EQUATION) + 4.5 for _, tall in sizes]
    return (2 if 2 * widest + GAP < INNER and len(equations) > 3 else 1), heights


def _equations_height(page: _Page, equations: Sequence[tuple[str, str]]) -> float:
    columns, heights = _columns(page, equations)
    half = -(-len(heights) // columns)
    return HEAD * LEAD + 4 + max(sum(heights[:half]), sum(heights[half:]))


def _write_equations(page: _Page, equations: Sequence[tuple[str, str]], top: float) -> None:
    page.text(MARGIN, top, "Equations", HEAD, fontweight="bold")
    columns, heights = _columns(page, equations)
    half = -(-len(heights) // columns)
    for number in range(columns):
        part = slice(number * half, (number + 1) * half)
        x, y = MARGIN + number * (INNER + GAP) / 2, top - HEAD * LEAD - 4
        labels = [page.size(label, SMALLEST)[0] for label, _ in equations[part] if label]
        inset = max(labels) + 12 if labels else 0.0
        for (label, each), tall in zip(equations[part], heights[part], strict=True):
            look: Any = {"va": "center"}
            if label:
                page.text(x, y - tall / 2, label, SMALLEST, color=TEXT_GREY, **look)
            page.text(x + inset, y - tall / 2, f"${each}$", EQUATION, **look)
            y -= tall


# --------------------------------------------------------------------------- parameters
def _rows(model: Model) -> list[tuple[str, str, str, str]]:
    """Return name, values, unit and meaning of every parameter."""
    given: list[tuple[Parameter, Any]] = [
        (each, model.values[each.name]) for each in model.chart.parameters
    ]
    names = {each.name for each, _ in given}
    shared: dict[str, Any] = {}
    if isinstance(model.stribeck, Stribeck):
        shared = {**asdict(model.stribeck), "weights": model.weights}
    if "sigma_2" not in names:
        shared["sigma_2"] = model.sigma_2
    for each in (WEIGHTS, *STRIBECK, SIGMA_2):
        if each.name in shared:
            given.append((each, shared[each.name]))
    rows = [
        (each.name, _written(value), adapted(each, model.chart).unit or "–", each.meaning)
        for each, value in given
    ]
    inputs: Mapping[str, Any] = getattr(model, "inputs", {})
    return rows + [(name, str(text), "–", "input") for name, text in inputs.items()]


def _written(value: Any) -> str:
    values = np.unique(value) if np.ptp(value) == 0 else np.ravel(value)
    return ", ".join(f"{each:.4g}" for each in values).replace("-", "−")


def _table_lines(
    rows: Iterable[tuple[str, str, str, str]], wide: float
) -> tuple[list[float], list[list[list[str]]]]:
    """Return where the columns begin, and the lines of every cell."""
    rows = list(rows)
    name, unit = (max(len(row[k]) for row in [*rows, HEADS]) * 0.62 * TEXT + 10 for k in (0, 2))
    rest = wide - name - unit
    value = min(0.55 * rest, max(len(row[1]) for row in [*rows, HEADS]) * LETTER * TEXT + 10)
    widths = (name, value, unit, rest - value)
    starts = [MARGIN + sum(widths[:k]) for k in range(4)]
    cells = [
        [_lines(cell, TEXT, w - 8) for cell, w in zip(row, widths, strict=True)] for row in rows
    ]
    return starts, cells


HEADS = ("name", "value", "unit", "meaning")


def _table_height(rows: Sequence[tuple[str, str, str, str]], wide: float) -> float:
    _, cells = _table_lines(rows, wide)
    count = sum(max(map(len, row)) for row in cells)
    return HEAD * LEAD + 6 + TEXT * LEAD * (1 + count) + 6


def _table(page: _Page, rows: Sequence[tuple[str, str, str, str]], top: float, wide: float) -> None:
    page.text(MARGIN, top, "Parameters", HEAD, fontweight="bold")
    starts, cells = _table_lines(rows, wide)
    y = top - HEAD * LEAD - 4
    for x, head in zip(starts, HEADS, strict=True):
        page.text(x, y, head, SMALLEST, color=TEXT_GREY)
    y -= TEXT * LEAD
    page.rule(y, wide)
    y -= 3
    for row in cells:
        for k, (x, lines) in enumerate(zip(starts, row, strict=True)):
            for number, line in enumerate(lines):
                family = MONO_FONT if k == 0 else SANS_FONT
                page.text(x, y - number * TEXT * LEAD, line, family=family, parse_math=False)
        y -= TEXT * LEAD * max(map(len, row))


# --------------------------------------------------------------------------- the loop
def _loop(page: _Page, run: Excited, at: tuple[float, float], tall: float) -> None:
    """Draw F over x, and say what moves the contact."""
    (x, y), wide = at, LOOP[0]
    page.text(x, y + tall, "Hysteresis", HEAD, fontweight="bold")
    lines = [part for line in run.about.split("\n") for part in _lines(line, SMALLEST, wide)]
    top = tall - HEAD * LEAD - 2
    for line in lines:
        page.text(x, y + top, line, SMALLEST, color=TEXT_GREY)
        top -= SMALLEST * LEAD
    ax = page.axes(x + 38, y + 28, wide - 44, top - 28 - 14)
    panels.hysteresis(ax, run.trace)
    ax.tick_params(labelsize=SMALLEST)
    ax.locator_params(axis="x", nbins=4)
    ax.locator_params(axis="y", nbins=5)
