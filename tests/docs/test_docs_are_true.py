"""Every code block of the documentation runs and shows its actual output.

A page is run from top to bottom: Python in one namespace, sessions with ``gms-fsm``, files that the
page names, all in a temporary folder. CONTRIBUTING.md explains the notation.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gms_fsm.app.scenario import Scenario
from gms_fsm.exporters import FORMATS, formats
from tests.helpers import ROOT, matrix, needs
from tests.page_blocks import Page, agrees, blocks_of

pytestmark = pytest.mark.slow

EXTRA = "anywidget control llvmlite matplotlib pandas pathsim pygraphviz pyarrow uplot xarray z3"
needs(*EXTRA.split(), reason="the pages use all extras")

PAGES = [
    path
    for path in [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "CONTRIBUTING.md"]
    if not path.name.startswith("lesson_")  # made from the lessons and run as notebooks
    and path.name != "paper.md"  # run in tests/app/test_paper_reproduction.py
]
# Long runs: `make foreign` runs these pages, `make test` all others.
LONG = (
    *("bouc-wen.md", "elasto-plastic.md", "lugre-sigma1.md", "seven-parameter.md"),
    *("add-a-model.md", "choose.md", "compensation.md", "coverage.md", "exporting-figures.md"),
    *("exports.md", "gradients.md", "known-systems.md", "measured-record.md", "own-loops.md"),
    *("own-loops-mujoco.md", "own-loops-scipy.md", "own-rig.md", "playing.md", "robot-joint.md"),
    *("servo.md", "sweeps.md"),
)
FIGURES = "exporting-figures.md"  # draws each format; tests/plots draws each figure
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
EXTRAS = set(
    tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
)


def _saving(every: bool) -> Callable[..., None]:
    """Return a `savefig` that draws the first figure of each format, or none."""
    from matplotlib.figure import Figure

    draw, drawn = Figure.savefig, set[str]()

    def savefig(figure: Figure, target: Any, **options: Any) -> None:
        kind = str(options.get("format") or Path(str(target)).suffix)
        if every and kind not in drawn:
            draw(figure, target, **options)
        elif hasattr(target, "write"):
            target.write(b"drawn in tests/plots")
        else:
            Path(target).write_bytes(b"drawn in tests/plots")
        drawn.add(kind)

    return savefig


@pytest.mark.parametrize(
    "path",
    matrix(PAGES, [path for path in PAGES if path.name not in LONG]),
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_page(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("GMS_FSM_DATA", raising=False)
    monkeypatch.setattr("warnings.showwarning", None)  # the command line sets its own
    assert formats()  # all are in the table
    monkeypatch.setattr("gms_fsm.formats.FORMATS", list(FORMATS))  # a page adds one
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", _saving(path.name == FIGURES))
    page = Page(str(path.relative_to(ROOT)))
    printed: str | None = None
    for block in blocks_of(path.read_text(encoding="utf-8")):
        where = f"{page.name}, line {block.line}"
        if block.kind == "python":
            assert printed in (None, ""), f"{where}: the block before prints what is not shown"
            printed = page.python(block)
        elif block.kind == "text":
            assert printed, f"{where}: nothing was printed before"
            assert agrees(block.body, printed), f"{where}: {printed}"
            printed = None
        elif block.kind == "console":
            for command, shown, said, went_well in page.console(block):
                assert went_well or shown, f"{where}: {command} fails: {said}"
                assert not shown or agrees(shown, said), f"{where}: {command}: {said}"
        elif block.file:
            (tmp_path / block.file).write_text(block.body, encoding="utf-8")
        elif block.kind == "toml":
            _part_of_a_scenario(block.body)
        else:
            assert block.kind == "sh", f"{where}: nobody runs a block of the kind {block.kind!r}"
            for line in block.body.strip().splitlines():
                _shell(line, where)
    assert printed in (None, ""), f"{page.name}: the last block prints what is not shown"


def _part_of_a_scenario(text: str) -> None:
    """Check that a part of a scenario fits into an included one."""
    whole = tomllib.loads((ROOT / "gms_fsm/scenarios/pulled_mass.toml").read_text(encoding="utf-8"))
    for name, table in tomllib.loads(text).items():
        whole[name] = whole.get(name, {}) | table if isinstance(table, dict) else table
    Scenario.model_validate(whole)


def _shell(line: str, where: str) -> None:
    """Check that the extras and make targets in a shell line exist, without running it."""
    command = line.partition("#")[0].split()
    while "=" in command[0]:  # PYTHON=python3.12 make test
        del command[0]
    if command[0] == "make":
        assert set(command[1:]) <= TARGETS, f"{where}: {line}"
        return
    if command[0] == "python":
        assert (ROOT / command[1]).is_file(), f"{where}: {line}"
        return
    assert re.match(r"git clone |python3 -m venv |(\.venv/bin/)?pip install ", line), (where, line)
    for names in re.findall(r"\[([\w,]+)\]", line):
        assert set(names.split(",")) <= EXTRAS, f"{where}: {line}"


def test_there_are_pages_and_they_have_blocks() -> None:
    count = {path.name: len(blocks_of(path.read_text(encoding="utf-8"))) for path in PAGES}
    assert len(PAGES) > 20
    assert sum(count.values()) > 60
    for name in ("element", "chart", "guard", "micro-step", "located-crossing"):
        assert count[f"{name}.md"] >= 2, name


@pytest.mark.parametrize(
    ("shown", "said", "right"),
    [
        ("a\nb\n", "a\nb\n", True),
        ("a\n", "a\nb\n", False),
        ("a\n...\nd\n", "a\nb\nc\nd\n", True),
        ("...\nd\n", "a\nd\n", True),
        ("a\n...\n", "a\nb\n", True),
        ("a\n...\n", "b\n", False),
        ("a  \n", "a\n", True),
        ("a.c\n", "abc\n", False),
    ],
)
def test_what_agrees(shown: str, said: str, right: bool) -> None:
    assert agrees(shown, said) == right


def test_a_fence_is_read_with_its_file() -> None:
    text = "# A page\n\n<!-- file: a.toml -->\n```toml\nx = 1\n```\n\n```{toctree}\nb\n```\n"
    (block,) = blocks_of(text)
    assert (block.kind, block.body, block.file, block.line) == ("toml", "x = 1\n", "a.toml", 3)
