"""Charts as Mermaid, PlantUML and TikZ have every text, and no character that is syntax there.

The Mermaid text is read back by the Mermaid parser as the same chart. That the other tools draw
theirs is checked by ``make foreign`` (`tests/foreign/check_pictures.py`).

Mermaid runs in node. ``GMS_FSM_MERMAID`` names a folder where it is installed, or will be by the
first run: 180 MB are not downloaded without being requested.
"""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import gms_fsm.charts.chart
import plots
from gms_fsm.charts import CHARTS as REGISTERED
from gms_fsm.charts import GMS_ELEMENT, LUGRE
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ParameterError
from plots.output.mermaid import mermaid
from plots.output.plantuml import plantuml
from plots.output.tikz import CODES, tikz
from tests.plots.charts_to_draw import HOSTILE, THREE_STATES, label_of, texts_of

WORDS = Chart(
    name="---\nwords of Mermaid: %% {} <br/>",
    inputs=("v", "s"),
    variables=("style", "classDef"),
    parameters=("note", "direction"),
    states=tuple(
        State(name, flow={"style": "v * note", "classDef": "-v"}, entry={"style": "0"})
        for name in ("end", "note_", "stateDiagram", "click", "linkStyle", "choice")
    ),
    transitions=(
        Transition("fork", "end", "note_", guard="style > s and v < -direction"),
        Transition("join", "note_", "note_", guard="v < 0 or v > 0", actions={"style": "-style"}),
    ),
    outputs={"F": "style"},
)
CHARTS = [*GMS_ELEMENT.values(), LUGRE, THREE_STATES, HOSTILE, WORDS]
PACKAGES = ("mermaid@11", "jsdom@26")  # a DOM sanitizes texts, and node has none

READER = """
import { JSDOM } from 'jsdom';
const { window } = new JSDOM('');
globalThis.window = window;
globalThis.document = window.document;
const { default: mermaid } = await import('mermaid');
let text = '';
for await (const part of process.stdin) text += part;
const found = [];
for (const source of JSON.parse(text)) {
  const { diagramType } = await mermaid.parse(source);
  const diagram = await mermaid.mermaidAPI.getDiagramFromText(source);
  const states = {};
  for (const [id, state] of diagram.db.getStates()) states[id] = state.descriptions;
  const edges = diagram.db.getRelations().map((e) => [e.id1, e.id2, e.relationTitle ?? '']);
  found.push({ diagramType, states, edges });
}
console.log(JSON.stringify(found));
"""


def parsed(texts: list[str]) -> list[dict[str, Any]]:
    """Parse texts with Mermaid."""
    folder, node, npm = os.environ.get("GMS_FSM_MERMAID"), shutil.which("node"), shutil.which("npm")
    if not folder or node is None:
        pytest.skip("Mermaid's own parser needs a folder GMS_FSM_MERMAID, and node on PATH")
    modules = Path(folder, "node_modules")
    if not (modules / "mermaid").is_dir() or not (modules / "jsdom").is_dir():
        if npm is None:
            pytest.skip(f"{folder} has no mermaid and jsdom, and there is no npm to install them")
        Path(folder).mkdir(parents=True, exist_ok=True)
        command = [npm, "install", "--no-audit", "--no-fund", "--prefix", folder, *PACKAGES]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            pytest.skip(f"npm could not install mermaid: {done.stderr.strip()[-300:]}")
    reader = Path(folder, "reader.mjs")
    reader.write_text(READER, encoding="utf-8")
    done = subprocess.run(
        [node, str(reader)],
        input=json.dumps(texts),
        capture_output=True,
        text=True,
        check=False,
        encoding="utf-8",
    )
    assert done.returncode == 0, done.stderr
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


def shown(text: str) -> str:
    """Decode a text as Mermaid does when it draws it."""
    return html.unescape(text.replace("ﬂ°°", "&#").replace("ﬂ°", "&").replace("¶ß", ";")).strip()


def printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


def expected(chart: Chart) -> tuple[list[list[str]], list[tuple[int, int, str]]]:
    states, edges = [], []
    for state in chart.states:
        texts = texts_of(chart, state.name).items()
        lines = [state.name, *(f"{kind}: {text}" for kind, each in texts for text in each)]
        states.append([printable(line) for line in lines])
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            ends = (chart.state_index(edge.source), chart.state_index(edge.target))
            edges.append((*ends, printable(label_of(chart, edge.name, f"{priority} [%s]"))))
    return states, edges


@pytest.fixture
def hostile(monkeypatch: pytest.MonkeyPatch) -> Chart:
    """Return a chart with invalid names."""
    monkeypatch.setattr(gms_fsm.charts.chart, "check_name", lambda *_: None)
    bad = 'a"\n[*] --> evil: <b>&#x41;; %%{init}%% \u2028 --'
    return Chart(
        name=bad,
        inputs=("v",),
        variables=("v" + bad,),
        parameters=(),
        states=(State(bad, flow={"v" + bad: "v"}),),
        transitions=(Transition("e" + bad, bad, bad, guard="v > 0"),),
        outputs={"F": "v"},
    )


@pytest.mark.matrix
@pytest.mark.slow
def test_mermaid_itself_reads_the_same_chart(hostile: Chart) -> None:
    """One call for all charts: starting node takes longer than reading them."""
    charts = [*CHARTS, hostile]
    for chart, found in zip(charts, parsed([mermaid(c) for c in charts]), strict=True):
        assert found["diagramType"] == "stateDiagram"
        states, edges = expected(chart)
        ids = [
            f"s{i}_{re.sub('[^A-Za-z0-9_]', '_', s.name)}" for i, s in enumerate(chart.states, 1)
        ]
        assert set(found["states"]) == {*ids, "root_start"}
        for own, state in zip(ids, states, strict=True):
            assert [shown(line) for line in found["states"][own]] == state
        first, *rest = found["edges"]
        assert first == ["root_start", ids[0], ""]
        assert [(ids.index(a), ids.index(b), shown(text)) for a, b, text in rest] == edges


def test_characters_that_mermaid_could_misread_are_escaped(hostile: Chart) -> None:
    for chart in CHARTS:
        head, body = mermaid(chart).split("stateDiagram-v2\n")
        assert head.startswith('---\ntitle: "')
        assert head.count("\n") == 3
        for line in body.splitlines():
            text = line.partition(" : ")[2]
            assert not re.search(r'[:;#<>&%{}"\\]', re.sub(r"#\d+;", "", text))
            assert line.isprintable()
        texts = html.unescape(re.sub(r"#(\d+);", r"&#\1;", body))
        states, edges = expected(chart)
        for text in [line for state in states for line in state] + [e[2] for e in edges]:
            assert text in texts
    lines = mermaid(hostile).splitlines()
    assert len(lines) == 9
    assert not [line for line in lines[4:] if "evil:" in line or "%%" in line]


# --------------------------------------------------------------------------- PlantUML and TikZ
def test_plantuml_and_tikz_texts_are_there_and_escaped(tmp_path: Path) -> None:
    for chart in (*CHARTS, *REGISTERED.values()):
        lines = plantuml(chart).splitlines()
        assert (lines[0], lines[-1]) == ("@startuml", "@enduml")
        texts = [line.partition(" : ")[2] for line in lines if " : " in line]
        for text in texts:
            assert not re.search(r"[^\w .,=+()]|_", re.sub(r"&#\d+;|<U\+\w{4}>", "", text))
        codes = [re.sub(r"<U\+([0-9A-F]{4})>", r"&#x\1;", text) for text in texts]
        texts = [html.unescape(text) for text in codes]
        text = plain = tikz(chart)
        assert text.count("{") - text.count(r"\{") == text.count("}") - text.count(r"\}")
        for character, code in sorted(CODES.items(), key=lambda item: -len(item[1])):
            plain = plain.replace(code, character)
        for state in chart.states:
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                label = f"{priority} [{chart.guard_text(edge.name)}]"
                assert any(text.startswith(label) for text in texts)
                assert f"[{chart.guard_text(edge.name)}]" in plain
        assert text.count(r"\node[state]") == len(chart.states)
    for ending in ("puml", "tikz"):
        path = plots.render(plots.statechart(LUGRE), tmp_path / f"chart.{ending}")
        assert "bristle" in path.read_text(encoding="utf-8")
    for write in (plantuml, tikz):
        with pytest.raises(ParameterError, match="chart is 3"):
            write(3)  # type: ignore[arg-type]


def test_titles_cannot_end_the_text() -> None:
    chart = Chart("a\n@enduml\n\\end{tikzpicture}", states=(State("a"),), outputs={"F": "v"})
    assert plantuml(chart).count("@enduml") == 1
    assert tikz(chart).splitlines()[0] == r"% a @enduml \end{tikzpicture}"


def test_tikz_keeps_the_layout_of_a_chart() -> None:
    moved = THREE_STATES.placed({"stick": (0, 0), "creep": (720, 0), "slip": (0, 72)})
    places = re.findall(r"\(s\d\) at \((\S+), (\S+)\)", tikz(moved))
    assert [(float(x), float(y)) for x, y in places] == [(0.0, 0.0), (25.4, 0.0), (0.0, -2.54)]
