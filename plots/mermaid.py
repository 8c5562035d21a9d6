"""Write a chart as Mermaid text, which many sites and editors draw.

A ``stateDiagram-v2``: what a state does is its description, an edge carries its priority, guard
and action. Everything that Mermaid could take for its own syntax is written as ``#code;``, which it
shows as the character.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

from gms_fsm._arguments import checked_kind
from gms_fsm.charts.chart import Chart, State
from gms_fsm.language import MATLAB_LIKE, spell

__all__ = ["mermaid"]

# Besides letters and digits of any script; among the others, ; and : end a text, # begins a code,
# < and & are markup, %% a comment, {} and " have meanings of their own.
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
        state "Bristle" as s1_bristle
        s1_bristle : during#58; dz = v - sigma_0 * |v| * z / s#59;
    <BLANKLINE>
    """
    checked_kind("chart", chart, Chart, "a Chart, of a model its .chart")
    ids = {state.name: _id(i, state.name) for i, state in enumerate(chart.states, start=1)}
    title = json.dumps(_printable(chart.name), ensure_ascii=False)
    lines = [f"[*] --> {ids[chart.default_state.name]}"]
    for state in chart.states:
        name, own = state.name[:1].upper() + state.name[1:], ids[state.name]
        lines.append(f'state "{_escape(name)}" as {own}')
        # The blank after the colon is needed: Mermaid would take ":#58;" for a style.
        lines += [f"{own} : {_escape(line)}" for line in _doings(chart, state)]
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            label = f"{priority} [{chart.guard_text(edge.name)}]"
            actions = chart.assignments["action", edge.name]
            if actions:
                texts = (f"{name} = {spell(tree, MATLAB_LIKE)};" for name, tree in actions.items())
                label += " {" + " ".join(texts) + "}"
            lines.append(f"{ids[edge.source]} --> {ids[edge.target]} : {_escape(label)}")
    head = f"---\ntitle: {title}\n---\nstateDiagram-v2\n"
    return head + "".join(f"    {line}\n" for line in lines)


def _doings(chart: Chart, state: State) -> Iterator[str]:
    flow = {f"d{variable}": chart.flows[state.name, variable] for variable in chart.variables}
    for kind, trees in (
        ("entry", chart.assignments["entry", state.name]),
        ("during", flow),
        ("exit", chart.assignments["exit", state.name]),
    ):
        for name, tree in trees.items():
            yield f"{kind}: {name} = {spell(tree, MATLAB_LIKE)};"


def _id(place: int, name: str) -> str:
    # A name alone could be a word of Mermaid, such as end or note.
    return f"s{place}_" + re.sub(r"[^A-Za-z0-9_]", "_", name)


def _escape(text: str) -> str:
    return "".join(c if c.isalnum() or c in PLAIN else f"#{ord(c)};" for c in _printable(text))


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)
