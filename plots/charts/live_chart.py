"""The chart of a run at one of its rows: the active state, the edges that could fire, or just did.

The layout is drawn once, with room for every mark. A frame only changes colours, widths, classes
and texts of known parts of that SVG, so hundreds of frames take seconds.

The active state has a thick border and a dot. Only the edges that leave it have marks: their
clauses carry ✓ or ✗. The edge that the element has just taken is thick and orange; on the row of
that firing it carries the marks with which it was taken. Everything else is grey.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from xml.etree import ElementTree

import numpy as np

from gms_fsm.errors import OutputError, ParameterError, shown
from gms_fsm.foundation.arguments import checked_integer, refusing
from gms_fsm.foundation.quantities import Scale, scale_of, trimmed
from gms_fsm.language import Condition, clauses, evaluate, names_in
from gms_fsm.session.explain import values_at
from gms_fsm.traces.scope import guard_columns, unit_of
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import steps_of
from plots.charts.labels import FALSE, TRUE, UNKNOWN, Piece, Row, edge_id, element_id, part_id
from plots.charts.statechart import ChartSheet, chosen
from plots.output.drawings import Svg, image
from plots.output.graphviz import picture
from plots.views.traces import check_trace

SVG = "http://www.w3.org/2000/svg"
THIN, THICK, BORDER = "1.1", "2.6", "3"
VALUES_PER_LINE = 3
SAID = 8  # elements in a repr
TITLE = 2  # texts of a region before its values
WIDEST = "-0.0001234"  # a number is never longer than this

Marks = tuple[bool | None, ...]


@dataclass(frozen=True)
class ElementLook:
    """The appearance of one element in a live chart.

    Parameters
    ----------
    element : int
        Counted from 0.
    active : str
        The active state.
    marks : mapping of str to tuple of bool or None
        For each edge with marks, the truth values of its clauses; None where the numbers of the row
        do not determine them (the last row of a failed run).
    leaving : tuple of str
        The edges that leave the active state, highest priority first.
    fired : str
        The edge taken at the time of this row, or since the row before; empty if there was none.
    source : str
        The state that this edge left; empty if there was none.
    """

    element: int
    active: str
    marks: Mapping[str, Marks]
    leaving: tuple[str, ...]
    fired: str
    source: str


class LiveChart:
    """A chart that shows the rows of a run, one after the other.

    Parameters
    ----------
    trace : Trace
        The run.
    elements : int or sequence of int, optional
        How many elements, or which ones, counted from 0; by default all.
    notation : {"stateflow", "math"}
        See `plots.charts.statechart.statechart`.
    theme : {"light", "dark"}
        Colours.
    values : bool
        Also write time, variables, inputs, and the forces and accelerations that guards read.
    direction : {"TB", "LR"}
        States from top to bottom, or from left to right.

    Attributes
    ----------
    trace : Trace
        The run.
    elements : tuple of int
        The elements shown, counted from 0.

    Raises
    ------
    ParameterError
        If an option is not allowed, or the run has no such element.
    MissingExtraError
        If there is no Graphviz, neither program nor package.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> chart = LiveChart(trace, [0])
    >>> chart.look(-1)[0].active
    'slip'
    """

    def __init__(
        self,
        trace: Trace,
        elements: int | Sequence[int] | None = None,
        *,
        notation: str = "stateflow",
        theme: str = "light",
        values: bool = False,
        direction: str = "TB",
    ) -> None:
        check_trace(trace)
        self.trace = trace
        self.elements = chosen(trace.n if elements is None else elements, trace.n)
        self.values = values
        chart = trace.model.chart
        self._sheet = ChartSheet(chart, notation, direction, theme, live=True).fitted()
        read = frozenset[str]().union(*map(names_in, chart.guards.values()))
        late = [name for name in (*chart.force_names, *chart.rate_names) if name in read]
        names = dict.fromkeys([*chart.variables, *chart.inputs, *chart.velocities, *late])
        self._names = [name for name in names if name != "t"]
        self._steps = steps_of(trace)
        self._log_count, self._since = _log_counts(trace), _times_before(trace)
        self._scales = _scales(trace, self._names)
        log = trace.transitions
        self._own = {i: np.flatnonzero(log.element == i) for i in self.elements}
        bare = trace.n == 1 and len(self.elements) == 1 and not isinstance(elements, Sequence)
        graph = self._sheet.graph(
            self.elements,
            bare=bare,
            values=self._value_rows(None),
            foot=f"t = {WIDEST}0 s" if values else "",
        )
        self.root = plain_tree(picture(graph, "svg"))
        self.root.set("style", f"background:{self._sheet.colours.paper}")
        groups = {group.get("id", ""): group for group in self.root.iter("g")}
        self.parts = {i: ElementParts(self._sheet, i, groups) for i in self.elements}
        # Below the picture: definitions, then the values, and last the time.
        defined = sum(map(len, self._sheet.definitions()))
        texts = groups["graph0"].findall("text")[defined:]
        self._value_texts = {
            i: texts[:-1] if bare else groups[element_id(i)].findall("text")[TITLE:]
            for i in self.elements
        }
        self._time_text = texts[-1:]

    # ------------------------------------------------------------------ what is shown
    def at(self, t: float) -> int:
        """Return the last row at or before a time.

        Parameters
        ----------
        t : float
            s, within the run.

        Returns
        -------
        int
            The row, for `look` and `frame`; if several rows have this time, the last.

        Raises
        ------
        ParameterError
            If the time lies outside the run.
        """
        times = self.trace.t
        if not isinstance(t, float | int | np.number) or not times.min() <= t <= times.max():
            raise ParameterError(
                f"t is {shown(t)} s",
                advice=f"it must lie within the run, {times.min():g} to {times.max():g} s",
            )
        # Not a bisection: the rows of Trace.sample are in the requested order.
        before = np.flatnonzero(times <= t)
        return int(before[np.flatnonzero(times[before] == times[before].max())[-1]])

    def look(self, row: int) -> tuple[ElementLook, ...]:
        """Return the appearance of a row, without drawing it.

        Parameters
        ----------
        row : int
            Row index; negative indices count from the end.

        Returns
        -------
        tuple of ElementLook
            One per element shown.

        Raises
        ------
        IndexError
            If there is no such row.
        """
        row = self._row(row)
        return tuple(self._look(row, element) for element in self.elements)

    def _row(self, row: int) -> int:
        rows = len(self.trace)
        row = checked_integer("row", row)
        if not -rows <= row < rows:
            raise IndexError(f"row {row}: the trace has {rows} rows")
        return row % rows

    def _look(self, row: int, element: int) -> ElementLook:
        trace, chart = self.trace, self.trace.model.chart
        state = chart.states[int(trace.modes[row, element])].name
        leaving = tuple(edge.name for _, edge in chart.leaving(state))
        values = values_at(trace, row, element)
        marks = {edge: marks_of(chart.guards[edge], values) for edge in leaving}
        own, count = self._own[element], int(self._log_count[row])
        past = int(np.searchsorted(own, count))  # firings of this element up to here
        if not past:
            return ElementLook(element, state, marks, leaving, "", "")
        last = int(own[past - 1])
        record = trace.transitions[last]
        if not self._since[row] < record.t:  # long ago
            return ElementLook(element, state, marks, leaving, "", "")
        fired, source = str(record.edge), str(record.source)
        if (record.t, self._steps[last]) == (trace.t[row], trace.microstep[row]):
            # This row is that firing; its marks are those of the row before.
            marks[fired] = marks_of(chart.guards[fired], values_at(trace, row - 1, element))
        return ElementLook(element, state, marks, leaving, fired, source)

    # ------------------------------------------------------------------ drawing
    def frame(self, row: int) -> str:
        """Return the chart at a row as SVG.

        Parameters
        ----------
        row : int
            Row index; negative indices count from the end. `at` finds the row for a time.

        Returns
        -------
        str
            A whole SVG document, ready for a file or a page; a notebook shows the picture.

        Raises
        ------
        IndexError
            If there is no such row.
        """
        self.paint(row)
        return Svg(ElementTree.tostring(self.root, encoding="unicode"))

    def __repr__(self) -> str:
        numbers = ", ".join(str(i + 1) for i in self.elements[:SAID])
        more = ", ..." if len(self.elements) > SAID else ""
        return f"<LiveChart: elements {numbers}{more}; {self.trace!r}>"

    def _repr_svg_(self) -> str:
        """Return the last row, for a notebook."""
        return self.frame(-1)

    def _repr_html_(self) -> str:
        row = len(self.trace) - 1
        said = (f"element {look.element + 1} is in {look.active}" for look in self.look(row))
        return image(self.frame(row), f"t = {self.trace.t[row]:.6g} s: {', '.join(said)}")

    def paint(self, row: int) -> None:
        """Paint the tree `root` as a row; `frame` does this and writes the tree.

        Parameters
        ----------
        row : int
            Row index.
        """
        row = self._row(row)
        for look in self.look(row):
            self.parts[look.element].paint(look)
            if self.values:
                for piece, node in _paired(
                    self._value_rows((row, look.element)), self._value_texts[look.element]
                ):
                    node.text = piece.text.replace(" ", "\xa0")
        for node in self._time_text:
            node.text = f"t = {self.trace.t[row]:.6g} s"

    def _value_rows(self, at: tuple[int, int] | None) -> list[Row]:
        """Return the values of an element at a row as lines; without a row, at maximum width."""
        if not self.values:
            return []
        numbers = {} if at is None else values_at(self.trace, *at)
        cells = []
        for name, scale in self._scales.items():
            widest = f"{WIDEST} {scale.unit}".rstrip()
            text = widest
            if at:
                value = numbers[name]
                text = trimmed(scale.near(value).text(value)).replace("-", "−")
            cells.append(f"{name} = {text.ljust(len(widest))}")
        return [
            [Piece("  ".join(cells[i : i + VALUES_PER_LINE]), "value")]
            for i in range(0, len(cells), VALUES_PER_LINE)
        ]


@refusing()
def live_statechart(
    trace: Trace,
    *,
    row: int | None = None,
    t: float | None = None,
    elements: int | Sequence[int] | None = None,
    notation: str = "stateflow",
    theme: str = "light",
    values: bool = False,
    direction: str = "TB",
) -> str:
    """Draw the chart of a run at a row or a time; for many frames keep one `LiveChart`.

    Parameters
    ----------
    trace : Trace
        The run.
    row : int, optional
        Row index; negative indices count from the end.
    t : float, optional
        Time in s; the last row at or before it is shown.
    elements, notation, theme, values, direction
        See `LiveChart`.

    Returns
    -------
    str
        An SVG document; a notebook shows the picture.

    Raises
    ------
    ParameterError
        If not exactly one of `row` and `t` is given, or an option is not allowed.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> live_statechart(trace, t=2.5)[:4]
    '<svg'
    """
    if (row is None) == (t is None):
        raise ParameterError(
            "give exactly one of them", place=f"row is {shown(row)} and t", value=t
        )
    chart = LiveChart(
        trace, elements, notation=notation, theme=theme, values=values, direction=direction
    )
    chart.frame(row if row is not None else chart.at(t if t is not None else math.nan))
    _close_gaps(chart.root)
    return Svg(ElementTree.tostring(chart.root, encoding="unicode"))


def _close_gaps(root: ElementTree.Element) -> None:
    """Take the room of marks that are not shown: a picture that stays as it is needs none."""
    for group in root.iter("g"):
        texts = [each for each in group.findall("text") if each.get("x")]
        for line in {each.get("y") for each in texts}:
            shift, after = 0.0, [each for each in texts if each.get("y") == line]
            for text, following in zip_longest(after, after[1:]):
                x = float(text.get("x", 0.0))
                if text.get("visibility") == "hidden" and following is not None:
                    shift += float(following.get("x", 0.0)) - x
                text.set("x", f"{x - shift:g}" if shift else text.get("x", ""))


# --------------------------------------------------------------------------- reading the run
def _scales(trace: Trace, names: Sequence[str]) -> dict[str, Scale]:
    """Return how values are written: each in one unit for the run, a threshold in that of z."""
    chart, columns = trace.model.chart, guard_columns(trace, names)
    units = {name: unit_of(chart, name) for name in names}
    if chart.variables and "s" in units:
        units["s"] = units[chart.variables[0]]
    sizes = {name: np.abs(np.ravel(columns[name])) for name in names}
    if chart.variables and "s" in sizes:
        sizes["s"] = sizes[chart.variables[0]]
    return {name: scale_of(sizes[name].tolist(), units[name]) for name in names}


def _times_before(trace: Trace) -> list[float]:
    """Return for each row the time after which a firing belongs to it."""
    found: list[float] = []
    for row, t in enumerate(trace.t.tolist()):
        before = float(trace.t[row - 1]) if row else t
        if row and before == t:
            found.append(found[-1])
        else:  # at the first row, and after a later one, only firings at its own time
            found.append(before if before < t else math.nextafter(t, -math.inf))
    return found


def _log_counts(trace: Trace) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return for each row the number of log entries up to it.

    m firings at one time give m + 1 rows, the first one before them; a row of a requested time is
    a single row after all of them.
    """
    entries = list(zip(trace.transitions.t.tolist(), steps_of(trace).tolist(), strict=True))
    in_steps = np.isin(trace.t, trace.t[trace.microstep > 0])
    steps = np.where(in_steps, trace.microstep, np.iinfo(np.int64).max)
    rows = zip(trace.t.tolist(), steps.tolist(), strict=True)
    return np.array([bisect_right(entries, row) for row in rows], dtype=np.int64)


def marks_of(guard: Condition, values: Mapping[str, float]) -> Marks:
    """Return whether each clause of a guard holds; None where the values do not say."""
    return tuple(_truth(part, values) for part in clauses(guard))


def _truth(part: Condition, values: Mapping[str, float]) -> bool | None:
    try:
        return bool(evaluate(part, values))
    except (ArithmeticError, ValueError):
        return None


# --------------------------------------------------------------------------- reading the SVG
def plain_tree(picture: bytes) -> ElementTree.Element:
    """Return an SVG as a tree; its namespace becomes an attribute, so that tags stay short."""
    root = ElementTree.fromstring(picture)
    for node in root.iter():
        node.tag = node.tag.removeprefix(f"{{{SVG}}}")
        if node.tag == "text":
            node.set("xml:space", "preserve")  # some readers drop leading spaces
            node.attrib.pop("{http://www.w3.org/XML/1998/namespace}space", None)
    root.set("xmlns", SVG)
    # Graphviz rounds the size up; the exact size avoids a light border around a dark picture.
    width, height = root.get("viewBox", "").split()[2:]
    root.set("width", f"{width}pt")
    root.set("height", f"{height}pt")
    return root


Texts = list[tuple[Piece, ElementTree.Element]]


def _paired(rows: Sequence[Row], nodes: Sequence[ElementTree.Element]) -> Texts:
    """Return each piece of a label with its text, found by their order."""
    pieces = [piece for row in rows for piece in row]
    if len(pieces) != len(nodes):
        raise OutputError(
            f"Graphviz wrote {len(nodes)} texts for {len(pieces)}",
            advice="this version of Graphviz cannot be used for live charts, install another",
        )
    return list(zip(pieces, nodes, strict=True))


class ElementParts:
    """The parts of one element in the SVG, and how they are painted."""

    def __init__(
        self, sheet: ChartSheet, number: int, groups: Mapping[str, ElementTree.Element]
    ) -> None:
        chart, element = sheet.chart, element_id(number)
        self.colours = sheet.colours
        self.states, self.edges = {}, {}
        for state in chart.states:
            group = groups[part_id(element, "state", state.name)]
            texts = _paired(sheet.state_rows(state, number), group.findall("text"))
            self.states[state.name] = (group, texts)
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                line = groups[edge_id(element, "edge", edge)]
                guard = groups[edge_id(element, "guard", edge)]
                texts = _paired(sheet.guard_rows(edge, priority, number), guard.findall("text"))
                self.edges[edge.name, edge.source] = guard, texts, line

    def paint(self, look: ElementLook) -> None:
        """Paint the element."""
        for state in self.states:
            self.paint_state(state, state == look.active)
        for edge, source in self.edges:
            leaving, fired = source == look.active, (edge, source) == (look.fired, look.source)
            marks = look.marks.get(edge) if leaving or fired else None
            self.paint_edge((edge, source), leaving, marks, self.colours.fired if fired else "")

    def paint_edge(
        self, key: tuple[str, str], leaving: bool, marks: Marks | None, fired: str = ""
    ) -> None:
        """Paint an edge, given its name and source."""
        guard, texts, line = self.edges[key]
        colour = fired or (self.colours.ink if leaving else self.colours.line)
        classes = ["leaving" if leaving else "pale"] + ["fired"] * bool(fired)
        _classify(line, "edge", classes)
        for shape in _shapes(line):
            shape.set("stroke", colour)
            shape.set("stroke-width", THICK if fired else THIN)
            if shape.get("fill") != "none":
                shape.set("fill", colour)
        _classify(guard, "node guard", classes)
        plain = self.colours.soft if classes == ["pale"] else self.colours.ink
        for piece, node in texts:
            self._paint_text(piece, node, marks, plain, fired or plain)

    def write_count(self, state: str, count: str) -> None:
        """Write how many elements are in a state (`ChartSheet.among`)."""
        for piece, node in self.states[state][1]:
            if piece.role == "among":
                node.text = count

    def paint_state(self, state: str, active: bool) -> None:
        """Paint a state, given its name."""
        group, texts = self.states[state]
        colours = self.colours
        _classify(group, "node state", ["active"] if active else [])
        line = colours.active if active else colours.ink
        for shape in _shapes(group):
            if shape.get("fill") == "none":  # the border
                shape.set("stroke", line)
                shape.set("stroke-width", BORDER if active else "1")
            elif shape.get("stroke") in ("none", "transparent"):  # the background
                shape.set("fill", colours.active_fill if active else colours.paper)
            else:  # the line under the title
                shape.set("stroke", line)
                shape.set("fill", line)
        for piece, node in texts:
            if piece.role == "dot":
                node.set("fill", colours.active)
                node.set("visibility", "visible" if active else "hidden")

    def _paint_text(
        self,
        piece: Piece,
        node: ElementTree.Element,
        marks: Marks | None,
        plain: str,
        colour: str,
    ) -> None:
        if piece.clause < 0:
            node.set("fill", colour if piece.role == "priority" else plain)
            return
        holds = None if marks is None else marks[piece.clause]
        if marks is None:
            node.set("fill", plain)
            node.set("class", piece.role)
        else:
            node.set("fill", self.colours.holds if holds else self.colours.fails)
            word = {True: "true", False: "false", None: "unknown"}[holds]
            node.set("class", f"{piece.role} {word}")
        if piece.role == "mark":
            node.text = {True: TRUE, False: FALSE, None: UNKNOWN}[holds]
            node.set("visibility", "hidden" if marks is None else "visible")


def _classify(group: ElementTree.Element, kind: str, more: Sequence[str]) -> None:
    group.set("class", " ".join([kind, *more]))


def _shapes(group: ElementTree.Element) -> Iterator[ElementTree.Element]:
    return (node for node in group.iter() if node.tag in ("path", "polygon", "polyline"))
