"""Every Python block of the README runs, its commands exist, its pictures are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.helpers import ROOT

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.slow
def test_the_blocks_run_in_their_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for extra in ("pygraphviz", "z3"):
        pytest.importorskip(extra, reason="drawing and proving need the extras render and check")
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "readme"}
    for block in BLOCKS:
        exec(compile(block, "README.md", "exec"), names)
        assert capsys.readouterr().out
    assert "break_away" in (tmp_path / "chart.svg").read_text(encoding="utf-8")


def test_the_output_is_the_one_shown_and_needs_no_extra(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", TEXT, re.DOTALL)
    assert len(shown) == 4
    names: dict[str, object] = {"__name__": "readme"}
    for block, text in shown:
        exec(compile(block, "README.md", "exec"), names)
        assert capsys.readouterr().out == text


def test_the_first_example_is_short() -> None:
    assert len(BLOCKS[0].strip().splitlines()) <= 15


def test_make_targets_of_the_readme_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"make ([a-z-]+)", TEXT))
    assert {"paper", "test"} <= named <= targets


@pytest.mark.parametrize("page", ["README.md", "docs/gallery.md"])
def test_pictures_and_links_exist(page: str) -> None:
    place = ROOT / page
    links = re.findall(r"\]\(([^)#]+)", place.read_text(encoding="utf-8"))
    assert links
    for link in links:
        least = 1000 if link.endswith((".png", ".svg", ".gif")) else 1
        assert (place.parent / link).stat().st_size >= least, link


def test_every_picture_that_is_kept_is_shown() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    shown = {
        name for page in pages for name in re.findall(r"images/([\w.]+)", page.read_text("utf-8"))
    }
    assert shown == {path.name for path in (ROOT / "docs/images").iterdir()}
