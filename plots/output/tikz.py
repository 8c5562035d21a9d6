r"""Write a chart as a TikZ picture, which LaTeX sets in the fonts of a document.

The result is one ``tikzpicture`` for ``\input``; its first lines name the packages. Without a
layout of the chart the state with most edges is in the middle, and the others are around it. Edges
between the same two states in the same direction are one arrow, whose label has a line for each:
priority, guard and action.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.foundation.text import visible
from plots.charts.contents import (
    chart_texts,
    edge_text,
    edges_by_priority,
    lines_of,
    state_texts,
)
from plots.charts.notation import ChartWriter
from plots.output.drawings import TikzText

HEAD = r"""% {name}
% \usepackage[T1]{{fontenc}} \usepackage{{tikz}} \usetikzlibrary{{arrows.meta,shapes.multipart}}
\begin{{tikzpicture}}[
  >={{Stealth[round]}},
  state/.style={{draw, rounded corners, rectangle split, rectangle split parts=2,
    align=left, font=\ttfamily\scriptsize, inner sep=4pt}},
  guard/.style={{align=left, font=\ttfamily\scriptsize, inner sep=2pt}},
]
"""
CHARACTER, LINE = 0.165, 0.33  # cm: of the font above, rounded up
POINT = 2.54 / 72  # cm
# What TeX reads as syntax; and what looks different in some of its fonts.
CODES: Mapping[str, str] = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "-": "-{}",  # two in a row are no dash
    '"': r"\textquotedbl{}",
    "'": r"\textquotesingle{}",
    "`": r"\textasciigrave{}",
    ",": ",{}",
    "?": "?{}",
    "!": "!{}",
} | {c: f"\\{c}" for c in "#$%&_"}


def tikz(chart: Chart) -> str:
    r"""Write a chart as a TikZ picture.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> [line for line in tikz(GMS_ELEMENT["signed"]).splitlines() if "(s1) to" in line]
    ['  \\draw[->] (s1) to[bend left=20] node[guard, auto]']
    """
    checked_kind("chart", chart, Chart, "a Chart, of a model its .chart")
    write, names = ChartWriter(chart, "stateflow"), [state.name for state in chart.states]
    contents = {state.name: lines_of(state_texts(write, state)) for state in chart.states}
    labels: dict[tuple[str, str], list[str]] = {}
    for priority, edge in edges_by_priority(chart):
        text = edge_text(write, priority, edge)
        labels.setdefault((edge.source, edge.target), []).append(text)
    places = {name: (POINT * x, -POINT * y) for name, (x, y) in chart.layout.items()}
    places = places or _places(names, contents, labels)
    lines = []
    for i, name in enumerate(names, start=1):
        x, y = places[name]
        rows = _rows(contents[name]) or r"\strut"
        lines.append(
            f"\\node[state] (s{i}) at ({x:.2f}, {y:.2f}) "
            f"{{\\textbf{{{_escape(name)}}}\\nodepart{{second}}{rows}}};"
        )
    lines.append(r"\fill (s1.north west) ++(-0.7, 0.5) circle[radius=2pt] coordinate (start);")
    lines.append(r"\draw[->] (start) -- (s1.north west);")
    for (source, target), rows_of in labels.items():
        one, two = names.index(source) + 1, names.index(target) + 1
        outer = len(names) == 3 and (0.0, 0.0) not in (places[source], places[target])
        # An arrow between the two outer of three in a row passes below the middle one.
        bend = "loop below" if one == two else f"bend left={45 if outer else 20}"
        lines += [
            f"\\draw[->] (s{one}) to[{bend}] node[guard, auto]",
            f"  {{{_rows(rows_of)}}} (s{two});",
        ]
    if shared := lines_of(chart_texts(write)):
        lines.append(
            "\\node[guard, anchor=north] at ([yshift=-4mm]current bounding box.south) "
            f"{{{_rows(shared)}}};"
        )
    head = HEAD.format(name=visible(chart.name))
    return TikzText(head + "".join(f"  {line}\n" for line in lines) + "\\end{tikzpicture}\n")


def _places(
    names: list[str],
    contents: Mapping[str, list[str]],
    labels: Mapping[tuple[str, str], list[str]],
) -> dict[str, tuple[float, float]]:
    """Return where the states are, in cm."""
    wide = max(map(len, (*names, *(row for rows in contents.values() for row in rows))))
    high = max(len(rows) + 2 for rows in contents.values())
    label = max((len(row) for rows in labels.values() for row in rows), default=0)
    tall = max((len(rows) for rows in labels.values()), default=0)
    x, y = (wide + label) * CHARACTER + 1.0, (high + 2 * tall) * LINE + 2.0
    if len(names) == 2:
        return {names[0]: (0.0, 0.0), names[1]: (x, 0.0)}
    busy = {name: sum(name in ends for ends in labels) for name in names}
    middle = max(names, key=lambda name: busy[name])
    others = [name for name in names if name != middle]
    count = len(others)
    # Four are in the corners; more need a wider round.
    turn, grow = (math.pi / 4 if count == 4 else 0.0), max(1.0, count / 4)
    found = {middle: (0.0, 0.0)}
    for i, name in enumerate(others):
        angle = math.pi - turn - 2.0 * math.pi * i / count
        found[name] = (x * grow * math.cos(angle), y * grow * math.sin(angle))
    return found


def _rows(texts: list[str]) -> str:
    return r"\\".join(map(_escape, texts))


def _escape(text: str) -> str:
    return "".join(CODES.get(c, c) for c in visible(text))
