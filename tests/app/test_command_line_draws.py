"""The drawing verbs of the command line write what they say, and refuse what they cannot read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gms_fsm import Prescribed, simulate
from tests.app.test_command_line import run
from tests.helpers import stick_slip

pytest.importorskip("matplotlib", reason="figures and films need the extra 'plots'")
pytest.importorskip("pygraphviz", reason="charts need Graphviz, extra 'render'")

Done = Callable[..., str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("draw")
    simulate(stick_slip("signed"), Prescribed("0.2*sin(2*pi*t/20)"), 21.0).save(place / "t.npz")
    (place / "bad.npz").write_bytes((place / "t.npz").read_bytes()[:3000])
    return place


def said(folder: Path, *arguments: str) -> str:
    done = run(*arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_chart_and_blocks(folder: Path) -> None:
    said(folder, "chart", "gms", "--law", "signed", "--elements", "4", "-o", "bank.svg")
    regions = [
        node
        for node in ElementTree.parse(folder / "bank.svg").iter()
        if "region" in node.get("class", "").split()
    ]
    assert len(regions) == 4
    said(folder, "blocks", "--elements", "3", "-o", "blocks.svg")
    blocks = ElementTree.parse(folder / "blocks.svg")
    assert sum("integrator" in node.get("class", "").split() for node in blocks.iter()) == 3
    said(folder, "chart", "lugre", "-o", "lugre.mmd")
    assert "stateDiagram-v2" in (folder / "lugre.mmd").read_text()
    look = ("--notation", "math", "--theme", "dark", "--direction", "LR")
    said(folder, "chart", "gms", "--law", "published", *look, "-o", "dark.png")
    assert (folder / "dark.png").read_bytes().startswith(b"\x89PNG")


def test_plot_animate_and_replay(folder: Path) -> None:
    lines = said(folder, "plot", "t.npz", "-o", "figures").split()
    assert {Path(line).name for line in lines} == {
        "overview.png",
        "overview.svg",
        "ribbons.png",
        "ribbons.svg",
    }
    said(folder, "animate", "t.npz", "-o", "film.gif", "--frames", "5")
    assert (folder / "film.gif").read_bytes().startswith(b"GIF8")
    pytest.importorskip("uplot", reason="the page needs the extra 'replay'")
    said(folder, "plot", "t.npz", "-o", "part", "--start", "1", "--end", "2")
    assert (folder / "part" / "ribbons.svg").is_file()
    said(folder, "replay", "t.npz", "t.npz", "-o", "page.html", "--title", "<b>two</b>")
    page = (folder / "page.html").read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    assert "<b>two</b>" not in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["chart", "gms"], "--law signed or --law published"),
        (["chart", "gms", "--law", "signed", "-o", "c.jpg"], ".svg, .png, .pdf"),
        (["chart", "gms", "--law", "signed", "--elements", "0"], "elements is 0"),
        (["blocks", "--elements", "-1"], "elements is -1"),
        (["plot", "bad.npz"], "damaged or incomplete"),
        (["plot", "none.npz"], "no such file"),
        (["animate", "t.npz", "-o", "film.mp4"], ".gif"),
        (["animate", "bad.npz"], "damaged or incomplete"),
        (["replay", "bad.npz"], "damaged or incomplete"),
        (["replay", "t.npz", "bad.npz"], "damaged or incomplete"),
        (["replay", "t.npz", "-o", "nowhere/page.html"], "choose another folder"),
        (["debug", "none.toml"], "no such file"),
    ],
)
def test_a_mistake_is_one_message_and_exit_code_2(
    folder: Path, arguments: list[str], words: str
) -> None:
    done = run(*arguments, cwd=folder)
    assert done.returncode == 2, done.stderr
    assert words in done.stderr
    assert "Traceback" not in done.stderr + done.stdout
