"""Write a chart as PlantUML text, which many editors and sites can draw.

The result is a state diagram: the actions and forces of a state are its description; an edge
carries its priority, guard and action; named expressions are a note. Every character that PlantUML
could read as syntax or as markup is written as ``&#code;``, which it displays as the character.
"""

from __future__ import annotations

import re

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.arguments import checked_kind
from plots.charts.contents import chart_texts, state_texts
from plots.charts.notation import ChartWriter
from plots.output.drawings import PlantUMLText

__all__ = ["plantuml"]

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
    ids = {state.name: _id(i, state.name) for i, state in enumerate(chart.states, start=1)}
    write = ChartWriter(chart, "stateflow")
    lines = ["@startuml", f"title {_escape(chart.name)}"]
    lines += ["hide empty description", f"[*] --> {ids[chart.default_state.name]}"]
    for state in chart.states:
        own = ids[state.name]
        lines.append(f'state "{_escape(state.name)}" as {own}')
        for kind, texts in state_texts(write, state):
            lines += [f"{own} : {_escape(f'{kind}: {text}')}" for text in texts]
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            label = f"{priority} [{chart.guard_text(edge.name)}]"
            actions = write.actions(chart.assignments["action", edge.name])
            label += f" {actions}" if actions else ""
            lines.append(f"{ids[edge.source]} --> {ids[edge.target]} : {_escape(label)}")
    shared = [f"{kind}: {text}" for kind, texts in chart_texts(write) for text in texts]
    if shared:
        lines.append(f"note right of {ids[chart.default_state.name]}")
        lines += [*map(_escape, shared), "end note"]
    return PlantUMLText("\n".join([*lines, "@enduml", ""]))


def _id(place: int, name: str) -> str:
    # A bare name could be a word of PlantUML, such as end or note.
    return f"s{place}_" + re.sub(r"[^A-Za-z0-9_]", "_", name)


def _escape(text: str) -> str:
    said = "".join(c if c.isprintable() else " " for c in text)
    return "".join(c if c.isalnum() or c in PLAIN else _code(c) for c in said)


def _code(character: str) -> str:
    # Older PlantUML breaks down on the codes of a backslash and a dollar sign in the first form.
    return f"<U+{ord(character):04X}>" if character in "\\$" else f"&#{ord(character)};"
