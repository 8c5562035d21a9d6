"""The page of exports has a section for each format, and the table of what tools have run."""

from __future__ import annotations

import importlib.util
import re
import sys
from types import ModuleType

import pytest

from gms_fsm.exporters import formats
from tests.helpers import ROOT
from tests.scenario_files import CommandLine

PAGE = (ROOT / "docs" / "howto" / "exports.md").read_text(encoding="utf-8")
PROGRAMS = [name for name, each in formats().items() if each.subject == "friction"]
COMMANDS = re.findall(r"^`gms-fsm (export .* --to (\w+))`$", PAGE, re.MULTILINE)


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """The module docs/make_exports.py."""
    found = importlib.util.spec_from_file_location("make_exports", ROOT / "docs/make_exports.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    sys.modules.setdefault("make_exports", module)
    found.loader.exec_module(module)
    return module


def test_page_and_file_agree(script: ModuleType) -> None:
    """If this fails, run: python docs/make_exports.py."""
    assert script.filled(PAGE, script.table(PROGRAMS, script.rows())) == PAGE


def test_rows_are_of_formats_and_complete(script: ModuleType) -> None:
    pictures = {each.kind for each in formats().values()}
    for form, tool, what, result in script.rows():
        assert form in {*PROGRAMS, *pictures}
        assert re.search(r"\d", tool), f"{tool}: its version is missing"
        assert what
        assert result


def test_a_format_without_a_row_is_not_called_supported(script: ModuleType) -> None:
    known = [["a", "tool 1.0", "x | y", "all bits equal"]]
    assert script.unrun(["a", "b"], known) == ["b"]
    assert script.table(["a", "b"], known).splitlines() == [
        "| format | tool | what was run | result |",
        "|---|---|---|---|",
        r"| `a` | tool 1.0 | x \| y | all bits equal |",
        "",
        "Not run by any tool, and therefore not supported: `b`.",
    ]
    assert "not supported" not in script.table(["a"], known)


def test_a_page_without_the_marks_is_refused(script: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"exports\.md has no"):
        script.filled("# A page\n", "")


@pytest.mark.matrix
@pytest.mark.every(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", PROGRAMS)
def test_each_format_has_a_section_whose_command_runs(name: str, gms_fsm: CommandLine) -> None:
    headings = [line for line in PAGE.splitlines() if line.startswith("### ")]
    assert [line for line in headings if re.search(rf"\b{name}\b", line)], f"{name}: no section"
    if name == "fmu3":  # shares the section and the command of fmu2
        return
    (command,) = (command for command, form in COMMANDS if form == name)
    done = gms_fsm(*command.split())
    assert done.code == 0, done.err
    assert f"gms-{name}/README-gms-{name}.md" in done.out.splitlines()
