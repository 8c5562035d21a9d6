"""Write a chart as Mermaid text, which many sites and editors can draw.

The result is a ``stateDiagram-v2``: the actions and forces of a state are its description; an edge
carries its priority, guard and action; named expressions are a note. Every character that Mermaid
could read as syntax is written as ``#code;``, which Mermaid displays as the character.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.arguments import checked_kind
from plots.charts.contents import Texts, chart_texts, state_texts
from plots.charts.notation import ChartWriter
from plots.output.drawings import MermaidText

__all__ = ["mermaid"]

# Allowed besides letters and digits of any script. Of the rest, ; and : end a text, # begins a
# code, < and & are markup, %% begins a comment, {} and " have special meanings.
PLAIN = " _.,=+*/|()[]-!^"


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
    ids = {state.name: _id(i, state.name) for i, state in enumerate(chart.states, start=1)}
    title = json.dumps(_printable(chart.name), ensure_ascii=False)
    write, lines = ChartWriter(chart, "stateflow"), [f"[*] --> {ids[chart.default_state.name]}"]
    for state in chart.states:
        own = ids[state.name]
        lines.append(f'state "{_escape(state.name)}" as {own}')
        # The space after the colon is needed: Mermaid would read ":#58;" as a style.
        lines += [f"{own} : {_escape(line)}" for line in _lines(state_texts(write, state))]
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            label = f"{priority} [{chart.guard_text(edge.name)}]"
            actions = write.actions(chart.assignments["action", edge.name])
            label += f" {actions}" if actions else ""
            lines.append(f"{ids[edge.source]} --> {ids[edge.target]} : {_escape(label)}")
    shared = list(_lines(chart_texts(write)))
    if shared:
        first = ids[chart.default_state.name]
        lines += [f"note right of {first}", *map(_escape, shared), "end note"]
    head = f"---\ntitle: {title}\n---\nstateDiagram-v2\n"
    return MermaidText(head + "".join(f"    {line}\n" for line in lines))


def _lines(texts: Texts) -> Iterator[str]:
    return (f"{kind}: {text}" for kind, own in texts for text in own)


def _id(place: int, name: str) -> str:
    # A bare name could be a Mermaid keyword, such as end or note.
    return f"s{place}_" + re.sub(r"[^A-Za-z0-9_]", "_", name)


def _escape(text: str) -> str:
    return "".join(c if c.isalnum() or c in PLAIN else f"#{ord(c)};" for c in _printable(text))


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)
