"""All links, anchors and pictures of README, docs and CONTRIBUTING exist."""

from __future__ import annotations

import re
from fnmatch import fnmatch
from pathlib import Path

import pytest

from gms_fsm.language import CONSTANTS, FUNCTIONS, SHORT
from tests.helpers import ROOT

TEXTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted(path for path in (ROOT / "docs").rglob("*.md") if not path.name.startswith("lesson_")),
    *sorted((ROOT / ".github").rglob("*.md")),
]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
# Generated from gms_fsm/app/lessons/lN_name.py.
MADE = re.compile(r"docs/lessons/(lesson_\d+)\.md$")
OUTSIDE = (
    "https://arxiv.org/",
    "https://github.com/pytransitions/",
    "https://github.com/Z3Prover/",
)


def prose(path: Path) -> str:
    """Return a page without its code blocks."""
    return CODE.sub("", path.read_text(encoding="utf-8"))


def anchors(path: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and MyST make them."""
    heads = re.findall(r"^#+ (.+)$", prose(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in heads}


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links(path: Path) -> None:
    for link in LINK.findall(prose(path)):
        if link.startswith("http"):
            assert link.startswith(OUTSIDE), f"{link}: name it in OUTSIDE if it is to stay"
            continue
        file, _, anchor = link.partition("#")
        target = (path.parent / file).resolve() if file else path
        if made := MADE.search(target.as_posix()):
            target = target.with_name(f"{made[1]}.ipynb")
        assert target.is_file(), link
        assert target.stat().st_size > 0, link
        if anchor:
            assert anchor in anchors(target), link


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_named_files_and_modules_exist(path: Path) -> None:
    names = r"`((?:benchmarks|docs|gms_fsm|integrators|plots|tests)/[\w./-]+\.\w+)`"
    for name in re.findall(names, prose(path)):
        if not re.search(r"lN_name|lesson_N", name):
            assert (ROOT / name).is_file(), name
    for name in re.findall(r"`((?:gms_fsm|integrators|plots)(?:\.\w+)+)`", prose(path)):
        place = ROOT.joinpath(*name.split("."))
        last = name.rpartition(".")[2]
        owner = place.parent.with_suffix(".py")
        owner = owner if owner.is_file() else place.parent / "__init__.py"
        known = place.is_dir() or place.with_suffix(".py").is_file()
        assert known or re.search(rf"\b{last}\b", owner.read_text(encoding="utf-8")), name


def test_every_page_is_in_the_contents() -> None:
    docs = ROOT / "docs"
    made = {f"lessons/{path.stem}" for path in (docs / "lessons").glob("lesson_*.ipynb")}
    listed = {"index"}
    for page in (docs / f"{name}index.md" for name in ("", "api/", "lessons/", "zoo/")):
        for tree in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text(), re.DOTALL):
            entries = [line for line in tree.splitlines() if line and not line.startswith(":")]
            folder = page.parent.relative_to(docs)
            names = [(folder / entry).as_posix() for entry in entries if "<" not in entry]
            listed |= {name for name in names if "?" not in name}
            listed |= {page for page in made if any(fnmatch(page, name) for name in names)}
    pages = {
        path.relative_to(docs).with_suffix("").as_posix()
        for path in [*docs.rglob("*.md"), *docs.rglob("*.rst")]
    }
    assert listed == pages | made, listed ^ (pages | made)


def test_the_citation_names_this_version() -> None:
    version = re.search(r'__version__ = "(.+)"', (ROOT / "gms_fsm/_version.py").read_text())
    assert version
    assert f"\nversion: {version[1]}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"(version {version[1]}, unreleased)" in (ROOT / "docs/cite.md").read_text(
        encoding="utf-8"
    )


def test_the_language_page_has_every_function() -> None:
    page = (ROOT / "docs/concepts/chart.md").read_text(encoding="utf-8")
    assert f"`{' '.join([*FUNCTIONS, *SHORT, *CONSTANTS])}`" in page
