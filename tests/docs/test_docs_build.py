"""The site is built without warnings, and its pages load nothing from other sites."""

from __future__ import annotations

import re
import runpy
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote, urldefrag

import pytest

from gms_fsm.app.lessons import LESSONS
from tests.docs.conftest import Built
from tests.helpers import ROOT, needs

pytestmark = pytest.mark.slow

NEEDED = ("furo", "ipykernel", "ipywidgets", "latex2mathml", "myst_parser", "nbclient", "sphinx")
needs(*NEEDED, reason="building the site needs the extra 'docs'")


def fetched(tag: str, name: str) -> bool:
    """Return whether a browser fetches an attribute by itself."""
    return name in ("src", "srcset", "data") or (name == "href" and tag in ("link", "image", "use"))


class Links(HTMLParser):
    """Collects what a page loads, where its links lead, and its anchors."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        for name, value in attrs:
            if fetched(tag, name.removeprefix("xlink:")):
                self.loads.append(value)
            elif tag == "a" and name == "href":
                self.links.append(value)
            elif name == "id":
                self.anchors.add(value)


def outside(address: str) -> bool:
    """Return whether an address leaves the site."""
    return re.match(r"(?:[a-z]+:)?//", address) is not None


@pytest.mark.matrix
def test_the_strict_build_passes_and_pages_load_nothing_external(built: Built) -> None:
    assert built.code == 0, built.said
    assert "WARNING" not in built.said
    site = built.site
    pages = {path: Links(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    assert len(pages) > 45
    for number in LESSONS:
        lesson = (site / f"lessons/lesson_{number}.html").read_text(encoding="utf-8")
        assert f"lesson_{number}.ipynb" in lesson
    for page, found in pages.items():
        for address in found.loads:
            assert not outside(address), f"{page.relative_to(site)} loads {address[:200]}"
        for link in found.links:
            if not outside(link) and not link.startswith(("mailto:", "javascript:")):
                _leads_somewhere(page, link, pages)
    for style in site.rglob("*.css"):
        text = style.read_text(encoding="utf-8")
        loaded = re.findall(r"(?:url\(|@import\s+)[\"']?([^\"')\s;]+)", text)
        assert not [address for address in loaded if outside(address)], style.name


@pytest.mark.matrix
def test_a_lesson_is_run_and_its_predictions_are_answered(built: Built) -> None:
    """The first; `make docs` runs them all."""
    assert built.code == 0, built.said
    folder = ROOT / "docs" / "lessons"  # made by the build
    text = (folder / "lesson_1.ipynb").read_text(encoding="utf-8")
    page = (folder / "lesson_1.md").read_text(encoding="utf-8")
    asked = text.count(" = None  # ")
    assert asked >= 2
    assert page.count("You predicted nothing. Measured: ") == asked
    assert "Traceback" not in page
    pictures = {path.name for path in folder.glob("lesson_1_*.png")}
    assert len(pictures) == 1 + text.count('"vary(')
    lesson = (built.site / "lessons/lesson_1.html").read_text(encoding="utf-8")
    assert pictures == set(re.findall(r"\blesson_1_\d\.png", lesson))
    assert (built.site / "lessons/lesson_1_replay.html").is_file()


def test_ways_back_from_a_source_page_lead_to_the_documented_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The tests' site has no pages of sources, which take a third of the time."""
    monkeypatch.setattr(sys, "path", [*sys.path])  # the configuration adds its folder
    tags = SimpleNamespace(has=lambda _: True)
    conf = runpy.run_path(str(ROOT / "docs" / "conf.py"), {"tags": tags})
    domain = SimpleNamespace(objects={"gms_fsm.Trace": SimpleNamespace(docname="api/run")})
    app = SimpleNamespace(env=SimpleNamespace(get_domain=lambda _: domain))
    back = '<a class="viewcode-back" href="../../../api/run.html#{}">'
    page = {"body": back.format("gms_fsm.traces.trace.Trace") + back.format("a.b")}
    conf["mend_ways_back"](app, "_modules/gms_fsm/traces/trace", "", page, None)
    assert page["body"] == back.format("gms_fsm.Trace") + back.format("a.b")


def _leads_somewhere(page: Path, link: str, pages: dict[Path, Links]) -> None:
    file, anchor = urldefrag(link)
    target = (page.parent / unquote(file.partition("?")[0])).resolve() if file else page
    assert target.is_file(), f"{page.name} links to {link}"
    if anchor and target in pages:
        assert unquote(anchor) in pages[target].anchors, f"{page.name} links to {link}"
