"""Workflows, hooks, forms and policies name only what exists: targets, extras, versions, files.

Whether GitHub accepts them is checked by hand, with actionlint and the schema of the forms.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.helpers import ROOT

yaml = pytest.importorskip("yaml", reason="reading workflows needs PyYAML (extra: dev)")

GITHUB = ROOT / ".github"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.findall(r"^([a-z]+):", MAKEFILE, re.MULTILINE))
SUPPORTED = [
    name.rpartition(" ")[2] for name in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", name)
]


def read(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


WORKFLOWS = {path.stem: read(path) for path in sorted((GITHUB / "workflows").glob("*.yml"))}
JOBS = {
    f"{name}: {job}": given
    for name, workflow in WORKFLOWS.items()
    for job, given in workflow["jobs"].items()
}


def commands(job: dict[str, Any]) -> list[str]:
    """Return all commands of a job, once for each entry of its matrix that they use."""
    matrix = job.get("strategy", {}).get("matrix", {})
    found = [step["run"] for step in job["steps"] if "run" in step]
    for key, values in matrix.items():
        slot = f"${{{{ matrix.{key} }}}}"
        found = [c.replace(slot, v) for c in found for v in (values if slot in c else [""])]
    return found


def versions(job: dict[str, Any]) -> list[str]:
    """Return the Python versions of a job, except those that may fail."""
    given = [step["with"]["python-version"] for step in job["steps"] if "setup-python" in str(step)]
    assert len(given) == 1
    if given[0] != "${{ matrix.python }}":
        return given
    excused = re.findall(r"matrix\.python == '([\d.]+)'", str(job.get("continue-on-error", "")))
    return [v for v in job["strategy"]["matrix"]["python"] if v not in excused]


def test_there_are_three_workflows() -> None:
    assert set(WORKFLOWS) == {"test", "docs", "wheel"}
    said = [command for job in JOBS.values() for command in commands(job)]
    for wanted in ("make lint", "make core", "make lowest", "make docs", "make wheel"):
        assert wanted in said
    assert "python -m pytest -n auto" in said


@pytest.mark.parametrize("job", JOBS.values(), ids=JOBS)
def test_make_targets_extras_and_pythons_exist(job: dict[str, Any]) -> None:
    for command in commands(job):
        assert "${{" not in command, "the test must see what is run"
        assert set(re.findall(r"\bmake (\w+)", command)) <= TARGETS, command
        for names in re.findall(r"\[([\w,]+)\]\"", command):
            assert set(names.split(",")) <= set(PROJECT["optional-dependencies"]), command
    assert set(versions(job)) <= set(SUPPORTED)
    assert PROJECT["requires-python"] == f">={SUPPORTED[0]}"
    if "pytest" in str(commands(job)):
        assert versions(job) == SUPPORTED


def test_the_hooks_are_the_commands_of_make_lint() -> None:
    hooks = [h for repo in read(ROOT / ".pre-commit-config.yaml")["repos"] for h in repo["hooks"]]
    recipe = re.search(r"^lint:.*\n((?:\t.*\n)+)", MAKEFILE, re.MULTILINE)
    assert recipe is not None
    lines = [line.removeprefix("\t$(RUN)/") for line in recipe[1].splitlines()]
    assert [hook["entry"] for hook in hooks] == lines
    assert all(hook["language"] == "system" for hook in hooks)


def test_files_that_forms_and_policies_name_exist() -> None:
    forms = sorted((GITHUB / "ISSUE_TEMPLATE").glob("*.yml"))
    assert {form.stem for form in forms} == {"bug", "config", "new_chart", "question"}
    named = 0
    for path in [*forms, ROOT / "SECURITY.md", ROOT / "CODE_OF_CONDUCT.md"]:
        for name in re.findall(r"[\w/-]+\.md\b", path.read_text(encoding="utf-8")):
            assert (ROOT / name).is_file(), (path.name, name)
            named += 1
    assert named >= 3
    for form in forms:
        if form.stem != "config":
            fields = [each for each in read(form)["body"] if each["type"] != "markdown"]
            for names in ([each["id"] for each in fields],
                          [each["attributes"]["label"] for each in fields]):  # fmt: skip
                assert len(set(names)) == len(names) > 2, form
