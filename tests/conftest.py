"""Fixtures shared by several folders."""

from __future__ import annotations

import functools
import gc
import importlib.util
from collections import Counter
from pathlib import Path

import pytest

from tests.scenario_files import CommandLine, command_line

gc.disable()  # while tests are collected: it finds nothing there, and takes a third of the time

# Typer makes all its commands anew in every call of a program; hundreds of tests call it.
if importlib.util.find_spec("typer"):
    import typer.main

    typer.main.get_command = functools.cache(typer.main.get_command)

# Their examples fit, write a film or a page, or run a lesson.
SLOW_EXAMPLES = (
    "gms_fsm/app/lessons/",
    "gms_fsm/identification/choose.py",
    "gms_fsm/identification/fit.py",
    "gms_fsm/generation/generate.py",
    "plots/handouts/page.py",
    "plots/style/presets.py",
    "gms_fsm/exporters/alone.py",
    "gms_fsm/exporters/_registry.py",
)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark examples that take long as slow; leave cases between every n-th to `make foreign`."""
    seen = Counter[str]()
    for item in items:
        if item.nodeid.startswith(SLOW_EXAMPLES):
            item.add_marker(pytest.mark.slow)
        every = item.get_closest_marker("every")
        if every and not item.get_closest_marker("matrix"):
            of = item.nodeid.partition("[")[0]
            if seen[of] % every.args[0]:
                item.add_marker(pytest.mark.matrix)
            seen[of] += 1


def pytest_collection_finish(session: pytest.Session) -> None:
    """Let the collector of garbage leave alone what lives to the end: ten thousand tests."""
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.fixture
def gms_fsm(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> CommandLine:
    """Return ``gms-fsm`` as a function of its arguments, run in this process in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return command_line(monkeypatch, capsys)
