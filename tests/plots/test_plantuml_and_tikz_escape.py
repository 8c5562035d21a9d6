"""PlantUML and TikZ texts contain every guard, and no character that is syntax there.

That the tools draw them is checked by ``make foreign`` (`tests/foreign/check_pictures.py`).
"""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest

import plots
from gms_fsm import Chart, State
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ParameterError
from plots.output.plantuml import plantuml
from plots.output.tikz import CODES, tikz
from tests.plots.charts_to_draw import HOSTILE
from tests.plots.test_mermaid_reads_back import WORDS

ALL = {**CHARTS, "words": WORDS, "hostile": HOSTILE}


def shown_by_plantuml(text: str) -> str:
    codes = re.sub(r"<U\+([0-9A-F]{4})>", lambda found: f"&#x{found[1]};", text)
    return html.unescape(codes)


@pytest.mark.parametrize("name", ALL)
def test_plantuml_texts_are_there_and_escaped(name: str) -> None:
    chart = ALL[name]
    lines = plantuml(chart).splitlines()
    assert (lines[0], lines[-1]) == ("@startuml", "@enduml")
    texts = [line.partition(" : ")[2] for line in lines if " : " in line]
    for text in texts:
        assert not re.search(r"[^\w .,=+()]|_", re.sub(r"&#\d+;|<U\+\w{4}>", "", text))
    shown = [shown_by_plantuml(text) for text in texts]
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            label = f"{priority} [{chart.guard_text(edge.name)}]"
            assert any(text.startswith(label) for text in shown)


@pytest.mark.parametrize("name", ALL)
def test_tikz_texts_are_there_and_escaped(name: str) -> None:
    chart = ALL[name]
    text = tikz(chart)
    assert text.count("{") - text.count(r"\{") == text.count("}") - text.count(r"\}")
    plain = text
    for character, code in sorted(CODES.items(), key=lambda item: -len(item[1])):
        plain = plain.replace(code, character)
    for edge in chart.guards:
        assert f"[{chart.guard_text(edge)}]" in plain
    assert text.count(r"\node[state]") == len(chart.states)


def test_titles_cannot_end_the_text() -> None:
    chart = Chart("a\n@enduml\n\\end{tikzpicture}", states=(State("a"),), outputs={"F": "v"})
    assert plantuml(chart).count("@enduml") == 1
    assert tikz(chart).splitlines()[0] == r"% a @enduml \end{tikzpicture}"


def test_the_command_line_writes_both(tmp_path: Path) -> None:
    for ending in ("puml", "tikz"):
        path = plots.render(plots.statechart(CHARTS["lugre"]), tmp_path / f"chart.{ending}")
        assert "bristle" in path.read_text(encoding="utf-8")


def test_what_is_no_chart_is_refused() -> None:
    for write in (plantuml, tikz):
        with pytest.raises(ParameterError, match="chart is 3"):
            write(3)  # type: ignore[arg-type]
