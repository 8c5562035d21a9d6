"""Write a chart as PlantUML text, which many editors and sites can draw.

The result is a state diagram: the actions and forces of a state are its description; an edge
carries its priority, guard and action; named expressions are a note. Every character that PlantUML
could read as syntax or as markup is written as ``&#code;``, which it displays as the character.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.arguments import checked_kind
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
from plots.output.drawings import PlantUMLText

PLAIN = " .,=+()"  # allowed besides letters and digits of any script


def plantuml(chart: Chart) -> str:
    """Write a chart as a PlantUML state diagram.

    Examples
    --------
    >>> from gms_fsm.charts import LUGRE
    >>> print(plantuml(LUGRE))
    @startuml
    title LuGre bristle
    hide empty description
    [*] --> s1_bristle
    state "bristle" as s1_bristle
    s1_bristle : during&#58; dz = v &#45; sigma&#95;0 &#42; &#124;v&#124; &#42; z &#47; s&#59;
    s1_bristle : force&#58; F = sigma&#95;0 &#42; z + sigma&#95;1 &#42; dz&#59;
    @enduml
    <BLANKLINE>
    """
    checked_kind("chart", chart, Chart, "a Chart, of a model its .chart")
    ids, write = ids_of(chart), ChartWriter(chart, "stateflow")
    first = ids[chart.nesting.states[0].name]
    lines = ["@startuml", f"title {_escape(chart.name)}", "hide empty description"]
    lines += state_lines(write, ids, _escape)
    for priority, edge in written_edges(chart):
        label = _escape(edge_text(write, priority, edge))
        lines.append(f"{ids[edge.source]} --> {ids[edge.target]} : {label}")
    if shared := lines_of(chart_texts(write)):
        lines += [f"note right of {first}", *map(_escape, shared), "end note"]
    return PlantUMLText("\n".join([*lines, "@enduml", ""]))


def _escape(text: str) -> str:
    return "".join(c if c.isalnum() or c in PLAIN else _code(c) for c in visible(text))


def _code(character: str) -> str:
    # Older PlantUML breaks down on the codes of a backslash and a dollar sign in the first form.
    return f"<U+{ord(character):04X}>" if character in "\\$" else f"&#{ord(character)};"
