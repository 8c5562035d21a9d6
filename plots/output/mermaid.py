"""Write a chart as Mermaid text, which many sites and editors can draw.

The result is a ``stateDiagram-v2``: the actions and forces of a state are its description; an edge
carries its priority, guard and action; named expressions are a note. Every character that Mermaid
could read as syntax is written as ``#code;``, which Mermaid displays as the character.
"""

from __future__ import annotations

import json

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.arguments import checked_kind, refusing
from gms_fsm.foundation.text import visible
from plots.charts.contents import (
    chart_texts,
    edge_text,
    ids_of,
    lines_of,
    state_lines,
    written_edges,
)
from plots.charts.notation import ChartWriter
from plots.output.drawings import MermaidText

# Allowed besides letters and digits of any script. Of the rest, ; and : end a text, # begins a
# code, < and & are markup, %% begins a comment, {} and " have special meanings.
PLAIN = " _.,=+*/|()[]-!^"


@refusing()
def mermaid(chart: Chart) -> str:
    """Write a chart as a Mermaid state diagram.

    Parameters
    ----------
    chart : Chart
        The chart.

    Returns
    -------
    str
        The text; put it into a Markdown block ``mermaid``.

    Examples
    --------
    >>> from gms_fsm.charts import LUGRE
    >>> print(mermaid(LUGRE))
    ---
    title: "LuGre bristle"
    ---
    stateDiagram-v2
        [*] --> s1_bristle
        state "bristle" as s1_bristle
        s1_bristle : during#58; dz = v - sigma_0 * |v| * z / s#59;
        s1_bristle : force#58; F = sigma_0 * z + sigma_1 * dz#59;
    <BLANKLINE>
    """
    checked_kind("chart", chart, Chart, "a Chart, of a model its .chart")
    ids, title = ids_of(chart), json.dumps(visible(chart.name), ensure_ascii=False)
    write, first = ChartWriter(chart, "stateflow"), ids[chart.nesting.states[0].name]
    lines = [*state_lines(write, ids, _escape)]
    for priority, edge in written_edges(chart):
        label = _escape(edge_text(write, priority, edge))
        lines.append(f"{ids[edge.source]} --> {ids[edge.target]} : {label}")
    if shared := lines_of(chart_texts(write)):
        lines += [f"note right of {first}", *map(_escape, shared), "end note"]
    head = f"---\ntitle: {title}\n---\nstateDiagram-v2\n"
    return MermaidText(head + "".join(f"    {line}\n" for line in lines))


def _escape(text: str) -> str:
    return "".join(c if c.isalnum() or c in PLAIN else f"#{ord(c)};" for c in visible(text))
