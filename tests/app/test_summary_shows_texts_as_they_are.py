"""Titles and notes of a scenario, and file names, are displayed literally by summary.md.

They do not become HTML, links, pictures, headings, lists or tables, because a summary is read in a
browser, and a scenario may come from anyone.
"""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest

from gms_fsm.app.report import plain, run_scenario
from gms_fsm.app.scenario import load_scenario
from tests.scenario_files import OPEN_LOOP

NASTY = [
    "<script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "![track](http://a.example/x.png)",
    "[click](javascript:alert(1))",
    "<http://a.example>",
    "*em* **strong** _em_ __strong__ ~~no~~",
    "`code` ``more``",
    "# heading",
    "## two ##",
    "- item",
    "+ item",
    "* item",
    "1. one",
    "2) two",
    "> quote",
    "===",
    "---",
    "***",
    "```",
    "~~~",
    "    code",
    "| a | b |\n|---|---|\n| 1 | 2 |",
    "line\n===",
    "line\n---",
    "&lt;b&gt; &amp; &#60;",
    r"\*not escaped\*",
    "[a]: http://a.example",
    "$x^2$ $$y$$",
    "F_c, v_s and z_1 stay",
    "__init__ _",
    "a <!-- comment --> b",
    "<details>",
    "Stick-slip (paper, Fig. 4)",
    "-0.5 m, +3 %, 0.25 s",
    "a\tb  \nc",
    "C#",
    "trailing \\",
]


def _shown(markdown: str) -> tuple[str, set[str]]:
    """Return the text displayed by a browser, without spaces, and its tags."""
    reader = pytest.importorskip("markdown_it", reason="needs the extra docs")
    page = reader.MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"])
    rendered = page.render(markdown)
    text = html.unescape(re.sub(r"<[^>]*>", " ", rendered))
    return " ".join(text.split()), {tag.lower() for tag in re.findall(r"</?\s*(\w+)", rendered)}


@pytest.mark.parametrize("text", NASTY)
def test_a_text_is_shown_as_it_is_in_a_heading_and_an_item_too(text: str) -> None:
    line = " ".join(text.split())
    assert _shown(plain(text)) == (line, {"p"})
    assert _shown(f"# {plain(line)}") == (line, {"h1"})
    assert _shown(f"- {plain(line)}") == (line, {"ul", "li"})


def test_control_codes_and_bidirectional_marks_are_escapes() -> None:
    assert plain("a\x1b[31mb\u202ec\x00d") == r"a\\u001b\[31mb\\u202ec\\u0000d"


def test_a_summary_shows_title_and_notes(tmp_path: Path) -> None:
    nasty = "\n\n".join(NASTY)
    title, notes = "<img src=x onerror=alert(1)> *Run*\n# two", nasty.replace("\\", "\\\\")
    text = OPEN_LOOP.replace('title = "open loop"', f'title = """{title}"""\nnotes = """{notes}"""')
    path = tmp_path / "nasty.toml"
    path.write_text(text)
    run_scenario(load_scenario(path), tmp_path / "out")
    shown, tags = _shown((tmp_path / "out" / "summary.md").read_text())
    assert shown.startswith("<img src=x onerror=alert(1)> *Run* # two " + " ".join(nasty.split()))
    assert tags <= {"h1", "h2", "p", "ul", "li", "table", "thead", "tbody", "tr", "th", "td"}
