"""The chart in a film: of one element, or one for all with their number in each state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gms_fsm.session.explain import values_at
from plots.charts.live_chart import ElementParts, LiveChart, Marks, marks_of, plain_tree
from plots.charts.statechart import ChartSheet, chosen
from plots.film._pace import Frame, Pace
from plots.output.graphviz import picture as rendered
from plots.style import CHART_THEMES
from plots.style.matplotlib import to_hex, to_rgb


def blend(ground: str, colour: str, share: float) -> str:
    """Return a mixture of two colours; a share of 0 is the ground."""
    start, end = np.array(to_rgb(ground)), np.array(to_rgb(colour))
    red, green, blue = start + share * (end - start)
    return to_hex((red, green, blue))


class FilmChart:
    """The painted chart of a film.

    A single element has its live chart (`plots.charts.live_chart`). Several have one chart: a state
    is active if at least one of them is in it, and says how many are.

    Parameters
    ----------
    pace : Pace
        The frames.
    elements : int or sequence of int, optional
        How many elements, or which ones, counted from 0; by default all.
    notation : {"stateflow", "math"}
        See `plots.charts.statechart.statechart`.
    theme : {"light", "dark"}
        Colours.

    Attributes
    ----------
    root : Element
        The SVG; `paint` changes it.
    elements : tuple of int
        The elements shown, counted from 0.
    """

    def __init__(
        self, pace: Pace, elements: int | Sequence[int] | None, notation: str, theme: str
    ) -> None:
        self.pace, self.trace = pace, pace.trace
        self.chart, self.colours = self.trace.model.chart, CHART_THEMES[theme]
        self.elements = chosen(self.trace.n if elements is None else elements, self.trace.n)
        self.live: LiveChart | None = None
        if len(self.elements) == 1:
            self.live = LiveChart(self.trace, elements, notation=notation, theme=theme)
            self.root, self.parts = self.live.root, self.live.parts[self.elements[0]]
            return
        sheet = ChartSheet(self.chart, notation, "TB", theme, live=True, among=len(self.elements))
        sheet = sheet.fitted()
        self.root = plain_tree(rendered(sheet.graph([0], bare=True), "svg"))
        self.root.set("style", f"background:{self.colours.paper}")
        groups = {group.get("id", ""): group for group in self.root.iter("g")}
        self.parts = ElementParts(sheet, 0, groups)

    def look(self, frame: Frame) -> tuple[Any, ...]:
        """Return what the chart shows in a frame; equal looks are painted alike."""
        own = [(k, b) for k, b in frame.fired if self.trace.transitions.element[k] in self.elements]
        if self.live is not None:
            (seen,) = self.live.look(frame.row)
            return seen.active, tuple(sorted(seen.marks.items())), tuple(own), frame.entry
        modes = self.trace.modes[frame.row, list(self.elements)]
        counts = tuple(int((modes == k).sum()) for k in range(len(self.chart.states)))
        return counts, tuple(own), frame.entry

    def paint(self, frame: Frame) -> None:
        """Paint the tree as a frame shows it."""
        if self.live is not None:
            (seen,) = self.live.look(frame.row)
            self.parts.paint(replace(seen, fired="", source=""))
        else:
            self._paint_counts(frame)
        log = self.trace.transitions
        for entry, brightness in frame.fired:
            if log.element[entry] in self.elements:
                colour = blend(self.colours.ink, self.colours.fired, brightness)
                marked = self.live is not None and entry == frame.entry
                marks = self._taken_with(entry) if marked else None
                edge = str(log.edge[entry]), str(log.source[entry])
                self.parts.paint_edge(edge, True, marks, colour)

    def _paint_counts(self, frame: Frame) -> None:
        modes = self.trace.modes[frame.row, list(self.elements)]
        for number, state in enumerate(self.chart.states):
            count = int((modes == number).sum())
            self.parts.paint_state(state.name, count > 0)
            self.parts.write_count(state.name, f"{count} of {len(self.elements)}")
        for edge, source in self.parts.edges:
            leaves = bool((modes == self.chart.state_index(source)).any())
            self.parts.paint_edge((edge, source), leaves, None)

    def _taken_with(self, entry: int) -> Marks:
        """Return the truth values of the clauses when an edge was taken."""
        log, rows = self.trace.transitions, self.trace
        before = (rows.t == log.t[entry]) & (rows.microstep == self.pace.steps[entry] - 1)
        guard = self.chart.guards[str(log.edge[entry])]
        values = values_at(rows, int(np.flatnonzero(before)[0]), int(log.element[entry]))
        return marks_of(guard, values)
