"""Texts of a drawn chart: pieces of labels, counts, and ids of parts."""

from __future__ import annotations

import html
import re
import textwrap
from collections import Counter
from dataclasses import dataclass

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.traces.trace import Trace, dwell_times

__all__ = [
    "Piece",
    "Row",
    "Tally",
    "edge_id",
    "element_id",
    "escape",
    "part_id",
    "printable",
    "wrapped",
]

LONGEST_LINE = 52  # characters; longer texts are wrapped
DOT, TRUE, FALSE, UNKNOWN = "●", "✓", "✗", "?"


@dataclass(frozen=True)
class Piece:
    """One text of a label; Graphviz writes each as one text element of the SVG, in this order.

    Parameters
    ----------
    text : str
        The text.
    role : str
        ``title``, ``dot``, ``word``, ``code``, ``priority``, ``clause``, ``mark``, ...
    clause : int
        For a clause and its mark, the number of the clause in the guard; otherwise -1.
    """

    text: str
    role: str = "code"
    clause: int = -1


Row = list[Piece]


class Tally:
    """How long each element was in each state, and how often it took each edge.

    Parameters
    ----------
    trace : Trace
        The run; its log is complete even if its rows are not.
    """

    def __init__(self, trace: Trace) -> None:
        log = trace.transitions
        self.states = [state.name for state in trace.model.chart.states]
        self.firings: Counter[tuple[int, str, str]] = Counter(
            zip(log.element.tolist(), log.edge.tolist(), log.source.tolist(), strict=True)
        )
        self.dwell = dwell_times(trace)

    def of_state(self, element: int, state: str) -> str:
        """Write how long a state was active."""
        seconds, whole = self.dwell[element, self.states.index(state)], self.dwell[element].sum()
        share = f" ({100 * seconds / whole:.0f} %)" if whole > 0 else ""
        return f"active {seconds:.4g} s{share}"

    def times(self, element: int, edge: Transition) -> int:
        """Return how often an edge was taken from its source."""
        return self.firings[element, edge.name, edge.source]

    def of_edge(self, element: int, edge: Transition) -> str:
        """Write how often an edge was taken."""
        times = self.times(element, edge)
        if not times:
            return "never taken"
        return "taken once" if times == 1 else f"taken {times} times"


def wrapped(text: str, limit: int = LONGEST_LINE) -> list[str]:
    """Return a text as lines of limited length."""
    if len(text) <= limit:
        return [text] if text else []
    # Continuation lines are indented; a word longer than a line is not broken.
    return textwrap.wrap(
        text,
        limit,
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def escape(text: str) -> str:
    """Escape a text for an HTML label; indentation is kept."""
    core = text.strip(" ")
    words = html.escape(printable(core))
    # Graphviz 2.43 refuses a bare ] in a label; one backslash would begin an escape sequence.
    words = words.replace("[", "&#91;").replace("]", "&#93;").replace("\\", "&#92;" * 2)
    start = len(text) - len(text.lstrip(" ")) if core else len(text)
    return "&#160;" * start + words + "&#160;" * (len(text) - start - len(core))


def printable(text: str) -> str:
    """Return a text without control characters."""
    return "".join(c if c.isprintable() else " " for c in text)


def element_id(number: int) -> str:
    """Return the id of an element, given its number from 0; ids count from 1, as pictures do.

    >>> element_id(0)
    'element1'
    """
    return f"element{number + 1}"


def part_id(element: str, kind: str, name: str) -> str:
    """Return the id of a state, guard or edge.

    >>> part_id("element1", "state", "slip")
    'element1-state-slip'
    """
    # Names in a chart are identifiers; other characters could be read as a port or as DOT syntax.
    return f"{element}-{kind}-" + re.sub(r"\W", "_", name)


def edge_id(chart: Chart, element: str, kind: str, edge: Transition) -> str:
    """Return the id of an edge or its guard; one that leaves several states has one per source.

    Parameters
    ----------
    chart : Chart
        The edge's chart.
    element : str
        Id of the element.
    kind : {"edge", "guard"}
        Which part.
    edge : Transition
        The edge, from one source.

    Returns
    -------
    str
        Such as ``element1-edge-arrest``, or ``element1-edge-arrest-from-slip``.
    """
    alone = sum(each.name == edge.name for each in chart.transitions) == 1
    name = part_id(element, kind, edge.name)
    return name if alone else part_id(name, "from", edge.source)
