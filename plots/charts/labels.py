"""Texts of a drawn chart: pieces of labels, counts, and ids of parts."""

from __future__ import annotations

import html
import math
import re
import warnings
from collections import Counter
from dataclasses import dataclass, replace

from gms_fsm.charts.chart import Transition
from gms_fsm.charts.nesting import spelled
from gms_fsm.foundation.text import visible
from gms_fsm.traces.coverage.counts import ChartCoverage
from gms_fsm.traces.trace import Trace, dwell_times
from plots.charts.contents import chart_texts, state_texts
from plots.charts.notation import ChartWriter
from plots.style import MONO_FONT
from plots.style.fonts import missing_glyphs

THIN, THICK = 1.1, 3.5  # points, of the lines of edges taken once, and most often
SAID = 5  # missing characters in a warning
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
    lowered : bool
        Whether this is the index of a name.
    """

    text: str
    role: str = "code"
    clause: int = -1
    lowered: bool = False


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
        return times_said("taken", self.times(element, edge))

    def width(self, element: int, edge: Transition) -> float | None:
        """Return None: the lines of one run have the usual width."""


class CoverageTally:
    """How often states were entered and edges taken, by all elements of all runs together.

    Parameters
    ----------
    coverage : ChartCoverage
        The counts.
    """

    def __init__(self, coverage: ChartCoverage) -> None:
        self.entries = {each.name: sum(each.entries) for each in coverage.states}
        self.seen = {each.name for each in coverage.states if any(each.seen)}
        self.taken = {(each.edge, each.source): sum(each.taken) for each in coverage.edges}

    def of_state(self, _: int, state: str) -> str:
        """Write how often a state was entered."""
        return times_said("entered", self.entries[state] or int(state in self.seen))

    def times(self, _: int, edge: Transition) -> int:
        """Return how often an edge was taken from its source."""
        return self.taken[edge.name, edge.source]

    def of_edge(self, element: int, edge: Transition) -> str:
        """Write how often an edge was taken."""
        return times_said("taken", self.times(element, edge))

    def width(self, element: int, edge: Transition) -> float | None:
        """Return the width of an edge's line, points: it grows with the logarithm of the count."""
        times, most = self.times(element, edge), max(self.taken.values())
        if times < 2:
            return None
        return THIN + (THICK - THIN) * math.log(times) / math.log(most)


def times_said(verb: str, times: int) -> str:
    """Return how often something happened.

    >>> times_said("taken", 0), times_said("taken", 1), times_said("entered", 2)
    ('never taken', 'taken once', 'entered 2 times')
    """
    if not times:
        return f"never {verb}"
    return f"{verb} once" if times == 1 else f"{verb} {times} times"


# The index of a name; what stands before the first underscore is its symbol. Raised digits, which
# are a power, belong to neither.
_INDEX = re.compile(r"(?<!\w)([^\W_]+)_(\w*?[^\W_⁰¹²³⁴⁵⁶⁷⁸⁹])(?![^\W⁰¹²³⁴⁵⁶⁷⁸⁹])")


def with_indices(row: Row) -> Row:
    """Return a row in which the indices of names, such as the c of v_c, are pieces of their own.

    Examples
    --------
    >>> [(piece.text, piece.lowered) for piece in with_indices([Piece("v > v_c")])]
    [('v > v', False), ('c', True)]
    """
    pieces: Row = []
    for piece in row:
        start = 0
        for found in _INDEX.finditer(piece.text):
            pieces.append(replace(piece, text=piece.text[start : found.end(1)]))
            pieces.append(replace(piece, text=found[2], lowered=True))
            start = found.end()
        if start < len(piece.text):
            pieces.append(replace(piece, text=piece.text[start:]))
    return pieces


def wrapped(text: str, limit: int = LONGEST_LINE) -> list[str]:
    """Return a text as lines of limited length, broken at operators.

    A line ends after ``&&``, ``||`` or a comma, or before a comparison or another operator; outside
    of brackets if possible, and never inside a name or a number. Further lines are indented.

    Examples
    --------
    >>> wrapped("max(z - w, 0) >= s && v > v_c", 20)
    ['max(z - w, 0)', '  >= s && v > v_c']
    """
    lines, indent = [], ""
    while len(indent + text) > limit:
        at = _best_break(text, limit - len(indent))
        if at < 0:
            break
        lines.append(indent + text[:at])
        text, indent = text[at + 1 :], "  "
    return [*lines, indent + text] if text.strip() else lines


# After which words a line ends best, the best first; before others it never ends so well.
_AFTER = (("||", "∨"), ("&&", "∧"), (",", ";"))
_BEFORE = ((">=", "<=", ">", "<", "≥", "≤", "==", "=", ":="), ("+", "-", "−"), ("*", "/", "·"))


def _best_break(text: str, limit: int) -> int:
    """Return the best space to break a line at; -1 if there is none."""
    depth, found = 0, []
    words, at = text.split(" "), -1
    for i, word in enumerate(words[:-1]):
        at += len(word) + 1
        depth += sum(map(word.count, "([{")) - sum(map(word.count, ")]}"))
        if word not in ("||", "|") and word.replace("||", "").count("|") % 2:
            depth += 1 if word.startswith(("|", "-|", "(|", "−|", "¬|")) else -1
        after = (rank for rank, marks in enumerate(_AFTER) if word.endswith(marks))
        before = (rank for rank, marks in enumerate(_BEFORE, 2) if words[i + 1] in marks)
        rank = min([*after, *before, len(_BEFORE) + 2])
        # A line that is nearly empty is worse than a break at a weaker operator.
        short = at < min(limit / 4, len(text) / 6)
        found.append((max(at - limit, 0), short, depth, rank, -at, at))
    return min(found)[-1] if found else -1


def escape(text: str) -> str:
    """Escape a text for an HTML label; indentation is kept."""
    core = text.strip(" ")
    words = html.escape(visible(core))
    # Graphviz 2.43 refuses a bare ] in a label; one backslash would begin an escape sequence.
    words = words.replace("[", "&#91;").replace("]", "&#93;").replace("\\", "&#92;" * 2)
    start = len(text) - len(text.lstrip(" ")) if core else len(text)
    return "&#160;" * start + words + "&#160;" * (len(text) - start - len(core))


def warn_of_missing_glyphs(write: ChartWriter, note: str = "") -> None:
    """Warn of characters that the font of charts cannot show, and say where they stand."""
    chart = write.chart
    places = {"the note": note}
    for state in chart.states:
        own = (text for _, texts in state_texts(write, state) for text in texts)
        places[f"state {state.name!r}"] = " ".join([state.name, *own])
    for edge in chart.transitions:
        action = write.actions(edge)
        places[f"edge {edge.name!r}"] = f"{write.text(chart.guards[edge.name])} {action}"
    places["the texts of the whole chart"] = " ".join(
        text for _, texts in chart_texts(write) for text in texts
    )
    found: dict[str, str] = {}
    for place, text in places.items():
        for character in missing_glyphs(visible(text)):
            found.setdefault(character, place)
    if found:
        listed = ", ".join(
            f"{c!r} (U+{ord(c):04X}) in {place}" for c, place in list(found.items())[:SAID]
        )
        more = f" and {len(found) - SAID} more" if len(found) > SAID else ""
        warnings.warn(
            f"the font of charts, {MONO_FONT}, has no {listed}{more}: the picture shows a box "
            "or another font there",
            stacklevel=4,
        )


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
    return f"{element}-{kind}-" + re.sub(r"\W", "_", spelled(name))


def edge_id(element: str, kind: str, edge: Transition) -> str:
    """Return the id of an edge or its guard; one that leaves several states has one per source."""
    name = part_id(element, kind, edge.name)
    return name if len(edge.sources) == 1 else part_id(name, "from", edge.source)
