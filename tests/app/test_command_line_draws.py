"""The drawing verbs of the command line write the files they name, and reject unreadable ones."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from gms_fsm import Prescribed, simulate
from tests.helpers import stick_slip
from tests.scenario_files import Answer, CommandLine, one_message

pytestmark = pytest.mark.slow
SERVO = Path(__file__).parents[2] / "scenarios" / "servo.toml"

pytest.importorskip("matplotlib", reason="figures and films need the extra 'plots'")
pytest.importorskip("pygraphviz", reason="charts need Graphviz, extra 'render'")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("draw")
    simulate(stick_slip("signed"), Prescribed("0.2*sin(2*pi*t/20)"), 21.0).save(place / "t.npz")
    (place / "bad.npz").write_bytes((place / "t.npz").read_bytes()[:3000])
    return place


@pytest.fixture
def draw(gms_fsm: CommandLine, files: Path, monkeypatch: pytest.MonkeyPatch) -> CommandLine:
    """``gms-fsm`` in the folder of these files."""
    monkeypatch.chdir(files)
    return gms_fsm


def said(done: Answer) -> str:
    assert done.code == 0, done.err
    return done.out


def test_chart_and_blocks(draw: CommandLine, files: Path) -> None:
    said(draw("chart", "gms", "--law", "signed", "--elements", "4", "-o", "bank.svg"))
    regions = [
        node
        for node in ElementTree.parse(files / "bank.svg").iter()
        if "region" in node.get("class", "").split()
    ]
    assert len(regions) == 4
    said(draw("blocks", "--elements", "3", "-o", "blocks.svg"))
    blocks = ElementTree.parse(files / "blocks.svg")
    assert sum("integrator" in node.get("class", "").split() for node in blocks.iter()) == 3
    said(draw("blocks", str(SERVO), "-o", "servo.svg"))
    texts = [each.text for each in ElementTree.parse(files / "servo.svg").iter()]
    assert {"pid", "motor", "bearing"} <= set(texts)
    said(draw("blocks", str(SERVO), "--schematic", "-o", "servo.svg"))
    ids = {node.get("id", "") for node in ElementTree.parse(files / "servo.svg").iter()}
    assert {"body motor", "contact bearing", "spring k_s", "damper d_s", "force motor"} <= ids
    said(draw("chart", "lugre", "-o", "lugre.mmd"))
    assert "stateDiagram-v2" in (files / "lugre.mmd").read_text()
    look = ("--notation", "math", "--theme", "dark", "--direction", "LR")
    said(draw("chart", "gms", "--law", "published", *look, "-o", "dark.png"))
    assert (files / "dark.png").read_bytes().startswith(b"\x89PNG")


def test_plot_animate_and_replay(draw: CommandLine, files: Path) -> None:
    lines = said(draw("plot", "t.npz", "-o", "figures")).split()
    assert {Path(line).name for line in lines} == {
        "overview.png",
        "overview.svg",
        "ribbons.png",
        "ribbons.svg",
    }
    said(draw("animate", "t.npz", "-o", "film.gif", "--frames", "5"))
    assert (files / "film.gif").read_bytes().startswith(b"GIF8")
    pytest.importorskip("uplot", reason="the page needs the extra 'replay'")
    said(draw("plot", "t.npz", "-o", "part", "--start", "1", "--end", "2"))
    assert (files / "part" / "ribbons.svg").is_file()
    said(draw("replay", "t.npz", "t.npz", "-o", "page.html", "--title", "<b>two</b>"))
    page = (files / "page.html").read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    assert "<b>two</b>" not in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["animate", "t.npz", "-o", "film.avi"], ".gif, .mp4 or .webm"),
        (["animate", "bad.npz"], "damaged or incomplete"),
        (["replay", "t.npz", "bad.npz"], "damaged or incomplete"),
        (["replay", "t.npz", "-o", "nowhere/page.html"], "choose another folder"),
    ],
)
def test_a_mistake_is_one_message(draw: CommandLine, arguments: list[str], words: str) -> None:
    one_message(draw(*arguments), words)
