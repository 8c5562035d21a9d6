"""Every file of the three packages goes into the wheel.

`make wheel` builds and tests one; this test is faster and names the missing file.
"""

from __future__ import annotations

import tomllib

from tests.helpers import ROOT

TOOL = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
PACKAGES = [name.removesuffix("*") for name in TOOL["packages"]["find"]["include"]]
FILES = [
    path
    for package in PACKAGES
    for path in sorted((ROOT / package).rglob("*"))
    if path.is_file() and "__pycache__" not in path.parts
]


def test_there_are_files_of_all_three() -> None:
    assert PACKAGES == ["gms_fsm", "integrators", "plots"]
    assert len(FILES) > 70
    assert {path.suffix for path in FILES} == {
        ".py",
        ".typed",
        ".c",
        ".css",
        ".h",
        ".tcss",
        ".html",
        ".js",
        ".m",
        ".md",
        ".mjs",
        ".mts",
    }


def test_each_folder_is_a_package() -> None:
    assert [f.parent for f in FILES if not (f.parent / "__init__.py").is_file()] == []


def test_each_file_that_is_not_a_module_is_package_data() -> None:
    assert set(TOOL["package-data"]) == {"*"}
    patterns = TOOL["package-data"]["*"]
    data = [path for path in FILES if path.suffix != ".py"]
    assert [path for path in data if not any(path.match(p) for p in patterns)] == []
