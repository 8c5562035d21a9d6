"""Draw a friction chart in the style of Stateflow.

Everything in the picture is read from the chart: states with their actions, edges with priority,
guard and action. A guard is a node on its edge's path, because Graphviz places nodes without
overlaps but places edge labels badly. Ids and classes are stable, so that the SVG can be restyled
without a new layout: class ``state``, ``guard``, ``edge``, ``default`` and ``region``, and ids such
as ``element1-state-slip``.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import graphviz

from gms_fsm._arguments import checked_kind, listed
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ParameterError
from gms_fsm.language import Both, Condition, Either, clauses
from gms_fsm.traces.trace import Trace
from plots._contents import Texts, chart_in_words, chart_texts, state_texts
from plots._labels import (
    DOT,
    LONGEST_LINE,
    TRUE,
    Piece,
    Row,
    Tally,
    edge_id,
    element_id,
    escape,
    part_id,
    printable,
    wrapped,
)
from plots._notation import NOTATIONS, Writer
from plots.drawings import DrawnGraph
from plots.style import CHART_THEMES, MONO, SANS, ChartTheme

__all__ = ["ChartGraph", "statechart"]

DIRECTIONS = {"TB": "top to bottom", "LR": "left to right"}

# Length in points of a state's side for every edge that begins or ends there. On a shorter side
# the edges would leave around the corners and overlap.
ROOM_PER_EDGE = {"TB": 45, "LR": 16}
MARKED = "2.6"  # points; width of highlighted lines


class ChartGraph(DrawnGraph):
    """A picture of a state chart that refers to it, so that other formats can be written."""

    chart: Chart


def statechart(
    chart: Chart,
    elements: int | Sequence[int] = 1,
    *,
    notation: str = "stateflow",
    direction: str = "TB",
    theme: str = "light",
    counts: Trace | None = None,
    marked: Iterable[str] = (),
    names: bool = False,
    note: str = "",
) -> DrawnGraph:
    """Draw a chart: one element, or a bank of elements as parallel states.

    Parameters
    ----------
    chart : Chart
        The chart.
    elements : int or sequence of int, optional
        How many elements, or which ones, counted from 0. They are drawn as parallel (AND) regions
        in a grid, and the picture counts from 1; only the number 1 gives a chart without a region.
    notation : {"stateflow", "math"}
        ``z >= s && v > v_c``, or ``z ≥ s(v) ∧ v > v_c``.
    direction : {"TB", "LR"}
        States from top to bottom, or from left to right.
    theme : {"light", "dark"}
        Colours; what they mean is also shown by shapes.
    counts : Trace, optional
        A run of this chart. The picture then shows how long each element was in each state and how
        often it took each edge; an edge never taken is dashed.
    marked : iterable of str, optional
        Names of states and edges to highlight: drawn thick, with a frame around the guard.
    names : bool, optional
        Whether each edge's name, which the log and the debugger use, is written above its guard.
    note : str, optional
        Text below the picture, line by line.

    Returns
    -------
    graphviz.Digraph
        The picture as a Graphviz graph; `plots.render` writes it to a file.

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
    if not hasattr(chart, "guards"):
        raise ParameterError(
            f"chart is {chart!r:.60}", advice="give a Chart, of a model its .chart"
        )
    checked_kind("note", note, str, "a text")
    if counts is not None:
        checked_kind("counts", counts, Trace, "a Trace, a run of this chart")
    if counts is not None and counts.model.chart != chart:
        raise ParameterError(
            f"counts is a run of the chart {counts.model.chart.name!r}",
            advice=f"it must be one of the chart that is drawn, {chart.name!r}",
        )
    pointed = tuple(listed("marked", marked, "names of states and edges"))
    parts = [*(state.name for state in chart.states), *(edge.name for edge in chart.transitions)]
    for name in pointed:
        one_of("marked", name, parts)
    tally = Tally(counts) if counts else None
    sheet = Sheet(chart, notation, direction, theme, tally, marked=frozenset(pointed), names=names)
    numbers = chosen(elements, None if counts is None else counts.n)
    bare = elements == 1 and (counts is None or counts.n == 1)
    return sheet.graph(numbers, bare=bare, foot=note)


def chosen(elements: int | Sequence[int], n: int | None = None) -> tuple[int, ...]:
    """Return the elements to draw, counted from 0.

    Parameters
    ----------
    elements : int or sequence of int
        How many, or which.
    n : int, optional
        How many exist.

    Returns
    -------
    tuple of int
        Their numbers, without repetition.

    Raises
    ------
    ParameterError
        If there are no such elements.

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


def one_of(name: str, value: str, allowed: Iterable[str]) -> str:
    """Return a value if it is allowed.

    Parameters
    ----------
    name : str
        Name of the option.
    value : str
        The given value.
    allowed : iterable of str
        The allowed values.

    Returns
    -------
    str
        The value.

    Raises
    ------
    ParameterError
        If it is not allowed.
    """
    words = tuple(allowed)
    if value not in words:
        listed = " or ".join(repr(word) for word in words)
        raise ParameterError(f"it must be {listed}", place=name, value=value)
    return value


@dataclass(frozen=True)
class Sheet:
    """A chart and its drawing options.

    Parameters
    ----------
    chart : Chart
        The chart.
    notation, direction, theme : str
        See `statechart`.
    tally : Tally, optional
        Counts to show.
    live : bool
        Leave room for the dot of the active state and the marks of the clauses.
    marked : frozenset of str
        States and edges to highlight.
    names : bool
        Write each edge's name above its guard.
    among : int
        Leave room in each state for "3 of 4": how many of so many elements are in it.
    """

    chart: Chart
    notation: str = "stateflow"
    direction: str = "TB"
    theme: str = "light"
    tally: Tally | None = None
    live: bool = False
    marked: frozenset[str] = frozenset()
    names: bool = False
    among: int = 0

    def __post_init__(self) -> None:
        one_of("notation", self.notation, NOTATIONS)
        one_of("direction", self.direction, DIRECTIONS)
        one_of("theme", self.theme, CHART_THEMES)

    @property
    def colours(self) -> ChartTheme:
        """The theme."""
        return CHART_THEMES[self.theme]

    @property
    def write(self) -> Writer:
        """The notation."""
        return Writer(self.chart, self.notation)

    def graph(
        self, numbers: Sequence[int], *, bare: bool, values: Sequence[Row] = (), foot: str = ""
    ) -> DrawnGraph:
        """Draw elements.

        Parameters
        ----------
        numbers : sequence of int
            Numbers of the elements, from 0.
        bare : bool
            Draw the only element without its region.
        values : sequence of Row
            Written below the title of each element.
        foot : str
            Written below the picture, line by line.

        Returns
        -------
        graphviz.Digraph
            The picture.
        """
        ink = self.colours.ink
        graph = ChartGraph(
            name=graphviz.escape(printable(self.chart.name)),
            graph_attr={
                "fontname": SANS,
                "bgcolor": self.colours.paper,
                "pad": "0.15",
                "nodesep": "0.16",
                "ranksep": "0.3",
                "rankdir": self.direction,
                "outputorder": "edgesfirst",
            },
            node_attr={"fontname": SANS, "shape": "plain"},
            edge_attr={"color": ink, "arrowsize": "0.7", "penwidth": "1.1"},
        )
        graph.chart, graph.text = self.chart, chart_in_words(self.chart)
        below = self.definitions() + (list(values) if bare else [])
        below += [[Piece(line, "value")] for line in foot.splitlines()]
        if below:
            graph.attr(label=f"<{self._lines(below)}>", labeljust="l", labelloc="b")
        if bare:
            self._draw_element(graph, numbers[0])
            return graph
        # Regions are independent: each is laid out alone, so that all look the same, and placed in
        # a grid.
        columns = ceil(sqrt(len(numbers)))
        order: list[int | None] = list(numbers)
        if self.direction == "TB":
            graph.attr(pack="12", packmode=f"array_i{columns}")
        else:  # Graphviz turns the grid with the layout: its first row comes out at the bottom
            graph.attr(pack="12", packmode=f"array_ic{columns}")
            order += [None] * (-len(order) % columns)
            lines = [order[i : i + columns] for i in range(0, len(order), columns)]
            order = [number for line in reversed(lines) for number in line]
        for place, number in enumerate(order, start=1):
            with graph.subgraph(name=f"cluster_{place}") as region:
                if number is None:
                    region.attr(style="invis")
                    region.node(f"blank{place}", "", style="invis")
                    continue
                name = element_id(number)
                title = [
                    Piece(f"Element{number + 1}  ", "region"),
                    Piece(f"AND {number + 1}", "note"),
                ]
                region.attr(
                    id=name,
                    **{"class": "region"},
                    label=f"<{self._lines([title, *values]) if values else self._line(title)}>",
                    labeljust="l",
                    labelloc="t",
                    style="dashed,rounded",
                    color=self.colours.line,
                    margin="12",
                )
                self._draw_element(region, number)
        return graph

    def _draw_element(self, graph: graphviz.Digraph, number: int) -> None:
        chart, element, ink = self.chart, element_id(number), self.colours.ink
        dot = f"{element}-default"
        graph.node(
            dot,
            "",
            id=dot,
            **{"class": "default"},
            shape="circle",
            style="filled",
            fillcolor=ink,
            color=ink,
            width="0.11",
            fixedsize="true",
        )
        for state in chart.states:
            name = part_id(element, "state", state.name)
            kind = "state marked" if state.name in self.marked else "state"
            graph.node(name, f"<{self._state_box(state, number)}>", id=name, **{"class": kind})
        graph.edge(
            dot,
            part_id(element, "state", chart.default_state.name),
            id=f"{element}-default-edge",
            **{"class": "default"},
        )
        for state in chart.states:
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                self._draw_edge(graph, number, edge, priority)

    def _draw_edge(
        self, graph: graphviz.Digraph, number: int, edge: Transition, priority: int
    ) -> None:
        element = element_id(number)
        source = part_id(element, "state", edge.source)
        target = part_id(element, "state", edge.target)
        guard = edge_id(self.chart, element, "guard", edge)
        name = edge_id(self.chart, element, "edge", edge)
        box = self._guard_box(edge, priority, number)
        kind = "guard marked" if edge.name in self.marked else "guard"
        graph.node(guard, f"<{box}>", id=guard, **{"class": kind})
        before, after, left, right = "nswe" if self.direction == "TB" else "wens"
        look = {}
        if self.tally is not None and not self.tally.times(number, edge):
            look = {"style": "dashed"}
        if edge.name in self.marked:
            look |= {"class": "marked", "color": self.colours.fired, "penwidth": MARKED}
        into = {"id": f"{name}-1", "dir": "none", **look}
        out = {"id": f"{name}-2", **look}
        if edge.source == edge.target:
            graph.edge(source, f"{guard}:{left}", **into)
            graph.edge(source, f"{guard}:{right}", dir="back", **out)
        elif self.chart.state_index(edge.source) < self.chart.state_index(edge.target):
            graph.edge(source, f"{guard}:{before}", **into)
            graph.edge(f"{guard}:{after}", target, **out)
        else:  # against the layout's direction: drawn from target to source, arrow at the tail
            graph.edge(target, f"{guard}:{before}", dir="back", **out)
            graph.edge(f"{guard}:{after}", source, **into)

    # ----------------------------------------------------------------- labels
    def definitions(self) -> list[Row]:
        """Return what is written below the picture: what all states share.

        Returns
        -------
        list of Row
            Named expressions and the force of the contact (see `plots._contents.chart_texts`).
        """
        return _rows(chart_texts(self.write))

    def state_rows(self, state: State, number: int) -> list[Row]:
        """Return the text in a state's box.

        Parameters
        ----------
        state : State
            The state.
        number : int
            The element, from 0.

        Returns
        -------
        list of Row
            The title first.
        """
        title = [Piece(state.name[:1].upper() + state.name[1:], "title")]
        if self.live:
            title.append(Piece(f" {DOT}", "dot"))
        if self.among:
            title += [Piece("  ", "note"), Piece(f"{self.among} of {self.among}", "among")]
        rows = [title, *_rows(state_texts(self.write, state))]
        if self.tally is not None:
            rows.append([Piece(self.tally.of_state(number, state.name), "count")])
        return rows

    def guard_rows(self, edge: Transition, priority: int, number: int) -> list[Row]:
        """Return the text on an edge, clause by clause.

        Parameters
        ----------
        edge : Transition
            The edge.
        priority : int
            1 is checked first.
        number : int
            The element, from 0.

        Returns
        -------
        list of Row
            The first piece of each is the priority, or a blank.
        """
        guard = self.chart.guards[edge.name]
        lines = [
            (line, clause)
            for clause, part in enumerate(clauses(guard))
            for line in self._clause_lines(part, inside=isinstance(guard, Both))
        ] or [(self.write.text(guard), -1)]  # always true
        rows: list[Row] = [[Piece(edge.name, "word")]] if self.names else []
        for i, (line, clause) in enumerate(lines):
            last = i + 1 == len(lines) or lines[i + 1][1] != clause
            row = [Piece("[" if i == 0 else " ", "bracket"), Piece(line, "clause", clause)]
            if last and self.live and clause >= 0:
                row.append(Piece(TRUE, "mark", clause))
            if last and i + 1 < len(lines):
                # The space is a separate text: some SVG readers drop leading spaces.
                row += [Piece(" ", "bracket"), Piece(self.write.words[Both], "bracket")]
            if i + 1 == len(lines):
                row.append(Piece("]", "bracket"))
            rows.append(row)
        action = self.write.actions(self.chart.assignments["action", edge.name])
        rows += [[Piece(line, "action")] for line in wrapped(action)]
        if self.tally is not None:
            taken = bool(self.tally.times(number, edge))
            rows.append([Piece(self.tally.of_edge(number, edge), "count" if taken else "never")])
        return [
            [Piece(str(priority) if i == 0 else " ", "priority"), *row]
            for i, row in enumerate(rows)
        ]

    def _clause_lines(self, part: Condition, inside: bool) -> list[str]:
        """Return a clause as lines: each alternative on a new line, long texts wrapped."""
        if not isinstance(part, Either):
            text = self.write.text(part)
            # The brackets around the guard when it is written as one text.
            return wrapped(f"({text})" if inside and isinstance(part, Both) else text)
        texts = [self.write.text(operand) for operand in part.operands]
        texts = [
            f"({text})" if isinstance(operand, Either) else text
            for text, operand in zip(texts, part.operands, strict=True)
        ]
        texts[:-1] = [f"{text} {self.write.words[Either]}" for text in texts[:-1]]
        if inside:  # one of several clauses: && binds tighter than ||
            texts[0], texts[-1] = f"({texts[0]}", f"{texts[-1]})"
            if sum(map(len, texts)) < LONGEST_LINE:
                texts = [" ".join(texts)]
        return [line for text in texts for line in wrapped(text)]

    def _state_box(self, state: State, number: int) -> str:
        ends = sum((edge.source, edge.target).count(state.name) for edge in self.chart.transitions)
        room = ends * ROOM_PER_EDGE[self.direction]
        title, *rows = (self._line(row) for row in self.state_rows(state, number))
        size = f'WIDTH="{room}"' if self.direction == "TB" else ""
        height = 18 * (1 + len(rows))
        blank = ""
        if self.direction == "LR" and room > height:
            blank = f'<TR><TD HEIGHT="{room - height}"></TD></TR>'
        ink, paper, border = self.colours.ink, self.colours.paper, 1
        if state.name in self.marked:
            ink, border = self.colours.fired, 3
        return (
            f'<TABLE BORDER="{border}" COLOR="{ink}" BGCOLOR="{paper}" STYLE="ROUNDED" '
            'CELLBORDER="0" CELLSPACING="0" CELLPADDING="3">'
            f'<TR><TD ALIGN="LEFT" {size}>{title}</TD></TR><HR/>'
            + "".join(f'<TR><TD ALIGN="LEFT">{row}</TD></TR>' for row in rows)
            + f"{blank}</TABLE>"
        )

    def _guard_box(self, edge: Transition, priority: int, number: int) -> str:
        rows = "".join(
            f'<TR><TD ALIGN="LEFT">{self._line(row[:1])}</TD>'
            f'<TD ALIGN="LEFT">{self._line(row[1:])}</TD></TR>'
            for row in self.guard_rows(edge, priority, number)
        )
        frame = 'BORDER="0"'
        if edge.name in self.marked:
            frame = f'BORDER="1" COLOR="{self.colours.fired}"'
        return (
            f'<TABLE {frame} CELLBORDER="0" CELLSPACING="0" CELLPADDING="1" '
            f'BGCOLOR="{self.colours.paper}">{rows}</TABLE>'
        )

    def _lines(self, rows: Iterable[Row]) -> str:
        cells = "".join(f'<TR><TD ALIGN="LEFT">{self._line(row)}</TD></TR>' for row in rows)
        return (
            '<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="1">' + cells + "</TABLE>"
        )

    def _line(self, row: Iterable[Piece]) -> str:
        return "".join(self._text(piece) for piece in row)

    def _text(self, piece: Piece) -> str:
        size, face, bold = {
            "title": (12, SANS, True),
            "dot": (12, SANS, False),
            "region": (13, SANS, True),
            "note": (10, SANS, False),
            "among": (12, SANS, True),
            "count": (9, SANS, False),
            "never": (9, SANS, True),
            "priority": (10, MONO, True),
        }.get(piece.role, (10, MONO, False))
        soft = piece.role in ("word", "note", "count")
        colour = self.colours.soft if soft else self.colours.ink
        words = escape(piece.text)
        words = f"<B>{words}</B>" if bold else words
        return f'<FONT FACE="{face}" POINT-SIZE="{size}" COLOR="{colour}">{words}</FONT>'


def _rows(texts: Texts) -> list[Row]:
    """Return texts as lines below one another, each kind before the first of its own."""
    rows: list[Row] = []
    for kind, own in texts:
        head = f"{kind}: "
        for line in (line for text in own for line in wrapped(text)):
            rows.append([Piece(head, "word"), Piece(line)])
            head = " " * len(head)
    return rows
