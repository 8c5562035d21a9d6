"""The pictures of terminals show what they are said to show, and need no network."""

from __future__ import annotations

import re
from html import unescape

import pytest

from tests.helpers import ROOT

SHOWN = {
    "debugger_why": ["24.9999735 s", "-776.2 mm", "false by 0.776 m", "◉ ACTIVE", "2 [z <= -s"],
    "debugger_small": ["FIRED", "element 1 is in slip at t = 4.91276067 s", "states over time"],
    "debugger_branches": ["≠≠≠", "branch 1", "first different transition at t =", "FIRED"],
    "debugger_brake": ["pad 1: friction under a varying load", "locked: v = 0", "face: one-sided"],
    "live": [
        "t = 17.000 s",
        "last transitions (",
        "over the last 6.000 s",
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
