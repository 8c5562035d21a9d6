"""Every Python block of the README runs, its transcript is true, its pictures are there.

The pictures of terminals show what they are said to show, and need no network.
"""

from __future__ import annotations

import importlib.util
import io
import re
from html import unescape
from pathlib import Path

import pytest

from gms_fsm.app.scenario import load_scenario, run_debugger
from tests.helpers import ROOT

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.slow
def test_the_blocks_run_in_their_order_and_print_what_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those whose output is shown need no extra."""
    monkeypatch.chdir(tmp_path)
    shown = dict(re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", TEXT, re.DOTALL))
    assert len(shown) == 4
    names = {"__name__": "readme"}
    every = all(importlib.util.find_spec(each) for each in ("matplotlib", "pygraphviz", "z3"))
    for block in BLOCKS if every else shown:
        exec(compile(block, "README.md", "exec"), names)
        printed = capsys.readouterr().out
        assert printed
        assert printed == shown.get(block, printed)
    assert not every or "break_away" in (tmp_path / "chart.svg").read_text(encoding="utf-8")


def test_the_transcript_is_true() -> None:
    found = re.search(r"^```\w*\n\$ gms-fsm debug (\S+)\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)
    assert found, "README.md has no fenced block that begins with '$ gms-fsm debug'"
    scenario, transcript = found.groups()
    commands = re.findall(r"^\(t=[^)]*\) (.+)$", transcript, re.MULTILINE)
    assert commands[-1] in ("q", "quit")
    assert 3 <= len(commands) <= 12
    out = io.StringIO()
    script = io.StringIO("".join(f"{command}\n" for command in commands))
    assert run_debugger(load_scenario(scenario), script, out) == 0
    assert out.getvalue() == transcript


def test_make_targets_of_the_readme_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"make ([a-z-]+)", TEXT))
    assert {"paper", "test"} <= named <= targets


def test_every_picture_that_is_kept_is_shown() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    shown = {
        name for page in pages for name in re.findall(r"images/([\w.]+)", page.read_text("utf-8"))
    }
    kept = list((ROOT / "docs/images").iterdir())
    assert shown == {path.name for path in kept}
    assert [path.name for path in kept if path.is_file() and path.stat().st_size < 1000] == []


# --------------------------------------------------------------------------- terminals
SHOWN = {
    "debugger_why": ["24.9999735 s", "-0.7762 m", "false by 0.776 m", "◉ ACTIVE", "2 [z <= -s"],
    "debugger_small": ["FIRED", "element 1 is in stick at t = 87.4999735 s", "arrest fired"],
    "debugger_branches": ["≠≠≠", "branch 1", "first different transition at t =", "FIRED"],
    "debugger_brake": [
        "pad 1: friction under a varying load",
        "locked: v = 0",
        "0.3594 kN",
        "x = -8.579 µm",
    ],
    "live": [
        "t = 0.29000 s",
        "last transitions (",
        "over the last 0.2900 s",
        "simulated seconds per",
    ],
}


@pytest.mark.parametrize("name", SHOWN)
def test_a_picture_shows_its_text_and_loads_nothing(name: str) -> None:
    svg = (ROOT / "docs" / "images" / f"{name}.svg").read_text(encoding="utf-8")
    text = unescape(re.sub(r"<[^>]+>", " ", svg)).replace("\xa0", " ")
    for part in SHOWN[name]:
        assert part in text, part
    links = set(re.findall(r"https?://[^\s\"')]+", svg))
    assert links <= {"http://www.w3.org/2000/svg", "https://www.textualize.io"}
    assert "url(" not in re.sub(r"url\(#[\w-]+\)", "", svg)
