"""Draw a friction chart in the style of Stateflow.

Everything in the picture is read from the chart: states with their actions, edges with priority,
guard and action. `plots.charts.layout` and `plots.charts.matrix` make the layout, and Graphviz only
draws, so every Graphviz gives the same picture. A guard is a node beside its edge. Ids and
classes are stable, so that the SVG can be restyled without a new layout: class ``state``,
``guard``, ``edge``, ``default`` and ``region``, and ids such as ``element1-state-slip``.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import graphviz

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.nesting import Level
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind, listed, one_of, refusing
from gms_fsm.foundation.text import visible
from gms_fsm.language import Both, Condition, Either, clauses
from gms_fsm.traces.coverage.counts import ChartCoverage
from gms_fsm.traces.trace import Trace
from plots.charts.arrange import arrange
from plots.charts.cells import CellWriter
from plots.charts.contents import (
    Texts,
    chart_in_words,
    chart_texts,
    edges_by_priority,
    guard_of,
    level_texts,
    state_texts,
    written_edges,
)
from plots.charts.drawing import Drawing
from plots.charts.graph import graph_drawing
from plots.charts.labels import (
    DOT,
    LONGEST_LINE,
    TRUE,
    CoverageTally,
    Piece,
    Row,
    Tally,
    warn_of_missing_glyphs,
    with_indices,
    wrapped,
)
from plots.charts.matrix import WIDEST, matrix_drawing
from plots.charts.notation import NOTATIONS, ChartWriter
from plots.output.drawings import DrawnGraph
from plots.style import CHART_THEMES, SANS, ChartTheme

DIRECTIONS = {"TB": "top to bottom", "LR": "left to right"}

FORMS = {
    "auto": "graph or matrix",
    "graph": "boxes and arrows",
    "matrix": "a table of sources and targets",
}

MOST_EDGES = 20  # of a graph; a chart with more is drawn as a matrix
MOST_LINES = 6  # of a guard on an edge; a longer one is written below the picture
LONGEST_LABEL = 34  # characters of a line on an edge
SMALLEST = 0.7  # smallest size of texts: 7 points instead of 10
# How a graph that is too wide becomes narrower: characters of a line on an edge, size of texts.
# Not 8 points: in pictures of pixels, Graphviz draws these much narrower than in others.
NARROWER = ((2 * LONGEST_LABEL, 1.0), (24, 1.0), (24, 0.9), (12, SMALLEST), (0, SMALLEST))


class ChartGraph(DrawnGraph):
    """A picture of a state chart that refers to it, so that other formats can be written."""

    chart: Chart


@refusing()
def statechart(
    chart: Chart,
    elements: int | Sequence[int] = 1,
    *,
    notation: str = "stateflow",
    direction: str = "TB",
    theme: str = "light",
    counts: Trace | ChartCoverage | None = None,
    marked: Iterable[str] = (),
    names: bool = False,
    note: str = "",
    form: str = "auto",
) -> DrawnGraph:
    """Draw a chart: one element, or a bank of elements as parallel states.

    Parameters
    ----------
    chart : Chart
        The chart.
    elements : int or sequence of int, optional
        How many elements, or which ones, counted from 0. Elements that are listed, or whose counts
        differ, are parallel (AND) regions in a grid, and the picture counts from 1; a number of
        elements that are all alike is one region. Only the number 1 gives a chart without a region.
    notation : {"stateflow", "math"}
        ``z >= s && v > v_c``, or ``z ≥ s(v) ∧ v > v_c``.
    direction : {"TB", "LR"}
        States from top to bottom, or from left to right.
    theme : {"light", "dark"}
        Colours; what they mean is also shown by shapes.
    counts : Trace or ChartCoverage, optional
        A run of this chart. The picture then shows how long each element was in each state and how
        often it took each edge; an edge never taken is dashed. Or what several runs have tried, of
        all elements together: ``coverage(runs).contact()``; edges are the wider the more often they
        were taken.
    marked : iterable of str, optional
        Names of states and edges to highlight: drawn thick, with a frame around the guard.
    names : bool, optional
        Whether each edge's name, which the log and the debugger use, is written above its guard.
    note : str, optional
        Text below the picture, line by line.
    form : {"auto", "graph", "matrix"}
        Boxes and arrows; or a matrix with a row for each source and a column for each target, whose
        cells have the priority and the number of the guard. ``"auto"`` is a matrix above 20 edges,
        or where a graph would be wider than two A4 pages; never if the chart has a layout, whose
        places a graph keeps. Long guards are numbered ``g1``, ``g2``, ... and written below the
        picture.

    Returns
    -------
    graphviz.Digraph
        The picture as a Graphviz graph; `plots.render` writes it to a file.

    Warns
    -----
    UserWarning
        If the chart has characters that the font of charts cannot show.

    Raises
    ------
    ParameterError
        If an option is not one of those above, `counts` is a run of another chart, or the chart
        has no such state or edge to mark.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT, LUGRE
    >>> sum("class=state" in line for line in statechart(LUGRE).body)
    1
    >>> "z ≥ s(v)" in statechart(GMS_ELEMENT["signed"], notation="math").source
    True
    """
    _check_chart(chart)
    checked_kind("note", note, str, "a text")
    tally, n = _tally(counts, chart, elements)
    pointed = tuple(listed("marked", marked, "names of states and edges"))
    parts = [*chart.nesting.levels, *(edge.name for edge in chart.transitions)]
    for name in pointed:
        one_of("marked", name, parts)
    sheet = ChartSheet(
        chart,
        notation,
        direction,
        theme,
        form,
        tally,
        marked=frozenset(pointed),
        names=names,
    )
    warn_of_missing_glyphs(sheet.write, note)
    numbers = chosen(elements, n)
    bare = elements == 1 and n in (None, 1)
    folded = counts is None and not isinstance(elements, Sequence)
    return sheet.graph(numbers, bare=bare, folded=folded, foot=note)


def _tally(
    counts: Trace | ChartCoverage | None, chart: Chart, elements: int | Sequence[int]
) -> tuple[Tally | CoverageTally | None, int | None]:
    """Return the counts to show, and of how many elements they tell."""
    if counts is None:
        return None, None
    said = "a Trace, a run of this chart; or a ChartCoverage"
    checked_kind("counts", counts, (Trace, ChartCoverage), said)
    its = counts.chart if isinstance(counts, ChartCoverage) else counts.model.chart
    if its != chart:
        raise ParameterError(
            f"counts is a run of the chart {its.name!r}",
            advice=f"it must be one of the chart that is drawn, {chart.name!r}",
        )
    if not isinstance(counts, ChartCoverage):
        return Tally(counts), counts.n
    if elements != 1:
        raise ParameterError(
            "coverage is drawn of all elements together", place="elements", advice="leave it out"
        )
    return CoverageTally(counts), 1


def _check_chart(chart: object) -> None:
    if not hasattr(chart, "guards"):
        raise ParameterError(
            f"chart is {chart!r:.60}", advice="give a Chart, of a model its .chart"
        )


@refusing()
def layout(chart: Chart, *, direction: str = "TB") -> dict[str, tuple[float, float]]:
    """Return where a chart's states are in its picture, to move them by hand.

    Parameters
    ----------
    chart : Chart
        The chart.
    direction : {"TB", "LR"}
        States from top to bottom, or from left to right.

    Returns
    -------
    dict of str to (float, float)
        Centres in points, to the right and down. `Chart.placed` gives a chart other ones, and
        `Chart.save` writes them into its file.

    Raises
    ------
    ParameterError
        If the chart is none, or the direction is not one of those above.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> places = layout(GMS_ELEMENT["signed"])
    >>> places["stick"][1] < places["slip"][1]
    True
    >>> moved = GMS_ELEMENT["signed"].placed(places | {"slip": (400, 60)})
    >>> statechart(moved).source.count("class=state")
    2
    """
    _check_chart(chart)
    sheet = ChartSheet(chart, direction=direction, form="graph").fitted()
    drawing = graph_drawing(sheet, 0, nested=False)
    places = [node.at for node in drawing.nodes if node.kind == "state"]
    return {state.name: at for state, at in zip(chart.states, places, strict=True)}


def chosen(elements: int | Sequence[int], n: int | None = None) -> tuple[int, ...]:
    """Return the elements to draw, counted from 0.

    Examples
    --------
    >>> chosen(3), chosen([2, 0])
    ((0, 1, 2), (2, 0))
    """
    limit = "" if n is None else f"; the run has {n}, counted from 0"
    if isinstance(elements, Sequence):
        numbers = tuple(_whole(number, "elements") for number in elements)
        if not numbers or min(numbers) < 0 or len(set(numbers)) < len(numbers):
            raise ParameterError(
                f"it must be element numbers counted from 0, at least one and none twice{limit}",
                place="elements",
                value=elements,
            )
    else:
        count = _whole(elements, "elements")
        if count < 1:
            raise ParameterError(
                "the number of elements must be an integer of at least 1",
                place="elements",
                value=elements,
            )
        numbers = tuple(range(count))
    if n is not None and max(numbers) >= n:
        raise ParameterError(f"there is no such element{limit}", place="elements", value=elements)
    return numbers


def _whole(number: object, name: str) -> int:
    try:
        return operator.index(number)  # type: ignore[arg-type]  # may fail
    except TypeError:
        raise ParameterError(
            "the number of elements must be an integer of at least 1", place=name, value=number
        ) from None


@dataclass(frozen=True)
class ChartSheet:
    """A chart and its drawing options.

    Parameters
    ----------
    chart : Chart
        The chart.
    notation, direction, theme, form : str
        See `statechart`.
    tally : Tally or CoverageTally, optional
        Counts to show.
    live : bool
        Leave room for the dot of the active state and, of one element, the marks of the clauses.
    marked : frozenset of str
        States and edges to highlight.
    names : bool
        Write each edge's name above its guard.
    numbered : mapping of str to int
        Edges whose guards are written below the picture, with their numbers.
    scale : float
        Size of the texts, 1 for the usual one.
    among : int
        Leave room in each state for "3 of 4": how many of so many elements are in it.
    removed : frozenset of str
        States and edges that another chart does not have any more: drawn dashed, without a text.
    was : mapping of str to sequence of str
        What another chart has on an edge, line by line, below its guard.
    """

    chart: Chart
    notation: str = "stateflow"
    direction: str = "TB"
    theme: str = "light"
    form: str = "auto"
    tally: Tally | CoverageTally | None = None
    live: bool = False
    marked: frozenset[str] = frozenset()
    names: bool = False
    numbered: Mapping[str, int] = field(default_factory=dict)
    scale: float = 1.0
    among: int = 0
    removed: frozenset[str] = frozenset()
    was: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        one_of("notation", self.notation, NOTATIONS)
        one_of("direction", self.direction, DIRECTIONS)
        one_of("theme", self.theme, CHART_THEMES)
        one_of("form", self.form, FORMS)

    @property
    def colours(self) -> ChartTheme:
        """The theme."""
        return CHART_THEMES[self.theme]

    @property
    def write(self) -> ChartWriter:
        """The notation."""
        return ChartWriter(self.chart, self.notation)

    @property
    def cells(self) -> CellWriter:
        """What sets the labels."""
        return CellWriter(self.colours, self.scale, joined=not self.live)

    def fitted(self) -> ChartSheet:
        """Return the sheet as it is drawn: a graph or a matrix, with guards or their numbers."""
        if self.scale < 1 or self.numbered:
            return self
        every = self._numbers(0)
        free = self.form == "auto" and not self.live and not self.chart.layout
        many = free and len([*self.edges()]) > MOST_EDGES
        if self.form == "matrix" or many:
            return replace(self, form="matrix", numbered=every)
        for longest, scale in NARROWER:
            numbered = self._numbers(longest)
            sheet = replace(self, form="graph", numbered=numbered, scale=scale)
            if self.chart.layout or sheet.drawing(0).width <= WIDEST:
                return sheet
        if not free:
            return sheet
        return replace(self, form="matrix", numbered=every)

    def _numbers(self, longest: int) -> dict[str, int]:
        """Return numbers for guards with longer lines; equal guards and actions share one."""
        texts: dict[str, int] = {}
        numbers: dict[str, int] = {}
        for _, edge in self.edges():
            lines = self._lines_of(edge)
            widest = max(sum(len(piece.text) for piece in row) for row in lines)
            long = len(lines) > MOST_LINES or widest > longest
            if long and edge.name not in self.removed:
                numbers[edge.name] = texts.setdefault(self.legend_text(edge), len(texts) + 1)
        return numbers

    @property
    def truths(self) -> bool:
        """Whether clauses have marks; those of several elements would contradict each other."""
        return self.live and not self.among

    @property
    def nested(self) -> bool:
        """Whether states are drawn in states; what a run has done is shown by the leaves alone."""
        bare = self.tally is None and not self.live and not self.chart.layout
        return bool(self.chart.nesting.composite) and bare and self.form != "matrix"

    def edges(self) -> Iterator[tuple[int, Transition]]:
        """Yield the edges that are drawn, each with its priority."""
        return (written_edges if self.nested else edges_by_priority)(self.chart)

    def drawing(self, number: int) -> Drawing:
        """Return an element as it is drawn."""
        if self.form == "matrix":
            return matrix_drawing(self, number)
        return graph_drawing(self, number, nested=self.nested)

    def _lines_of(self, edge: Transition) -> list[Row]:
        return replace(self, tally=None, names=False, numbered={}, was={}).guard_rows(edge, 1, 0)

    def graph(
        self,
        numbers: Sequence[int],
        *,
        bare: bool,
        folded: bool = False,
        values: Sequence[Row] = (),
        foot: str = "",
    ) -> DrawnGraph:
        """Draw elements (see `arrange`)."""
        sheet = self.fitted()
        graph = ChartGraph(
            name=graphviz.escape(visible(self.chart.name)),
            engine="neato",
            graph_attr={
                "fontname": SANS,
                "bgcolor": self.colours.paper,
                "pad": "0.1",
                "layout": "nop2",  # all positions are given, and the DOT text is self-contained
                "outputorder": "edgesfirst",
            },
            node_attr={"fontname": SANS, "shape": "plain"},
            edge_attr={"color": self.colours.ink, "arrowsize": "0.7", "penwidth": "1.1"},
        )
        graph.chart, graph.text = self.chart, chart_in_words(self.chart)
        below = self.definitions() + (list(values) if bare else [])
        below += [[Piece(line, "value")] for line in foot.splitlines()]
        shown = [] if bare else values
        arrange(graph, sheet, numbers, shown, below, bare=bare, folded=folded)
        return graph

    def legend(self) -> list[Row]:
        """Return the guards that stand below the picture: ``g1 = ...``, wrapped."""
        rows: list[Row] = []
        written = 0
        for _, edge in self.edges():
            number = self.numbered.get(edge.name, 0)
            if number > written:
                written, head = number, f"g{number} = "
                for line in wrapped(self.legend_text(edge)):
                    rows.append([Piece(head, "word"), *self._indexed([Piece(line)])])
                    head = " " * len(head)
        return rows

    def legend_text(self, edge: Transition) -> str:
        """Return an edge's guard and action as one text."""
        action = self.write.actions(edge)
        return f"{self.write.text(guard_of(self.chart, edge))} {action}".rstrip()

    def _indexed(self, row: Row) -> Row:
        return with_indices(row) if self.write.math else row

    # ----------------------------------------------------------------- labels
    def definitions(self) -> list[Row]:
        """Return what is written below the picture: what all states share."""
        return [self._indexed(row) for row in _rows(chart_texts(self.write))]

    def state_rows(self, state: State, number: int) -> list[Row]:
        """Return the text in a state's box."""
        title = [Piece(state.name, "title")]
        if state.name in self.removed:
            return [title, [Piece("removed", "never")]]
        if self.among:
            title += [Piece("  ", "note"), Piece(f"{self.among} of {self.among}", "among")]
        if self.live:  # last: a hidden dot leaves no gap
            title.append(Piece(f" {DOT}", "dot"))
        narrow = self.direction == "LR" or self.form == "matrix"
        limit = LONGEST_LABEL if narrow else LONGEST_LINE
        texts = _rows(state_texts(self.write, state), limit)
        rows = [title, *(self._indexed(row) for row in texts)]
        if self.tally is not None:
            rows.append([Piece(self.tally.of_state(number, state.name), "count")])
        return rows

    def level_rows(self, level: Level) -> list[Row]:
        """Return the text in the box of a state that may have states inside."""
        title = [Piece(level.state.name, "title")]
        if level.path in self.removed:
            return [title, [Piece("removed", "never")]]
        if level.state.history:
            title.append(Piece("  history", "note"))
        return [title, *map(self._indexed, _rows(level_texts(self.write, level)))]

    def guard_rows(self, edge: Transition, priority: int, number: int) -> list[Row]:
        """Return the text on an edge, clause by clause."""
        rows: list[Row] = [[Piece(edge.name, "word")]] if self.names else []
        head = "was "
        if edge.name in self.removed:
            head, rows = "", [*rows, [Piece("removed", "never")]]
        elif edge.name in self.numbered:
            rows += self._number_row(edge)
        else:
            rows += self._guard_lines(edge)
        for text in self.was.get(edge.name, ()):
            for line in wrapped(text, LONGEST_LABEL):
                rows.append(
                    [*([Piece(head, "word")] if head else []), *self._indexed([Piece(line)])]
                )
                head = " " * len(head)
        if self.tally is not None:
            taken = bool(self.tally.times(number, edge))
            rows.append([Piece(self.tally.of_edge(number, edge), "count" if taken else "never")])
        shown = edge.name not in self.removed
        return [
            [Piece(str(priority) if i == 0 and shown else " ", "priority"), *row]
            for i, row in enumerate(rows)
        ]

    def _number_row(self, edge: Transition) -> list[Row]:
        marks = range(len(clauses(self.chart.guards[edge.name]))) if self.truths else ()
        number = Piece(f"g{self.numbered[edge.name]}", "clause")
        each = [Piece(TRUE, "mark", c) for c in marks]
        return [[Piece("[", "bracket"), number, *each, Piece("]", "bracket")]]

    def _guard_lines(self, edge: Transition) -> list[Row]:
        guard = guard_of(self.chart, edge)
        lines = [
            (line, clause)
            for clause, part in enumerate(clauses(guard))
            for line in self._clause_lines(part, inside=isinstance(guard, Both))
        ] or [(self.write.text(guard), -1)]  # always true
        rows: list[Row] = []
        for i, (line, clause) in enumerate(lines):
            last = i + 1 == len(lines) or lines[i + 1][1] != clause
            row = [Piece("[" if i == 0 else " ", "bracket"), Piece(line, "clause", clause)]
            if last and self.truths and clause >= 0:
                row.append(Piece(TRUE, "mark", clause))
            if last and i + 1 < len(lines):
                # The space is a separate text: some SVG readers drop leading spaces.
                row += [Piece(" ", "bracket"), Piece(self.write.words[Both], "bracket")]
            if i + 1 == len(lines):
                row.append(Piece("]", "bracket"))
            rows.append(self._indexed(row))
        action = self.write.actions(edge)
        lines_of_action = wrapped(action, LONGEST_LABEL)
        return rows + [self._indexed([Piece(line, "action")]) for line in lines_of_action]

    def _clause_lines(self, part: Condition, inside: bool) -> list[str]:
        """Return a clause as lines: each alternative on a new line, long texts wrapped."""
        if not isinstance(part, Either):
            text = self.write.text(part)
            # The brackets around the guard when it is written as one text.
            return wrapped(
                f"({text})" if inside and isinstance(part, Both) else text, LONGEST_LABEL
            )
        texts = [self.write.text(operand) for operand in part.operands]
        texts = [
            f"({text})" if isinstance(operand, Either) else text
            for text, operand in zip(texts, part.operands, strict=True)
        ]
        texts[:-1] = [f"{text} {self.write.words[Either]}" for text in texts[:-1]]
        if inside:  # one of several clauses: && binds tighter than ||
            texts[0], texts[-1] = f"({texts[0]}", f"{texts[-1]})"
            if sum(map(len, texts)) < LONGEST_LABEL:
                texts = [" ".join(texts)]
        return [line for text in texts for line in wrapped(text, LONGEST_LABEL)]


def _rows(texts: Texts, limit: int = LONGEST_LINE) -> list[Row]:
    """Return texts as lines below one another, each kind before the first of its own."""
    rows: list[Row] = []
    for kind, own in texts:
        head = f"{kind}: "
        for line in (line for text in own for line in wrapped(text, limit)):
            rows.append([Piece(head, "word"), Piece(line)])
            head = " " * len(head)
    return rows
