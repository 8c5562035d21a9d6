"""Every Python block of the README runs, its commands exist, its pictures are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS, ids=[f"block {i + 1}" for i in range(len(BLOCKS))])
def test_block_runs(
    block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "README.md", "exec"), {"__name__": "readme"})
    assert capsys.readouterr().out.count("\n") >= 4


def test_the_first_example_is_short() -> None:
    assert len(BLOCKS[0].strip().splitlines()) <= 15


def test_make_targets_of_the_readme_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"make ([a-z-]+)", TEXT))
    assert {"paper", "test"} <= named <= targets


@pytest.mark.parametrize("page", ["README.md", "docs/gallery.md"])
def test_pictures_and_links_lead_somewhere(page: str) -> None:
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
