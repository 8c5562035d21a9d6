"""Fixtures shared by several folders."""

from __future__ import annotations

import gc
from pathlib import Path

import pytest

from tests.scenario_files import CommandLine, command_line


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the examples of lessons as slow: each one runs its lesson."""
    for item in items:
        if item.nodeid.startswith("gms_fsm/app/lessons/"):
            item.add_marker(pytest.mark.slow)


def pytest_collection_finish(session: pytest.Session) -> None:
    """Let the collector of garbage leave alone what lives to the end: ten thousand tests."""
    gc.collect()
    gc.freeze()


@pytest.fixture
def gms_fsm(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> CommandLine:
    """Return ``gms-fsm`` as a function of its arguments, run in this process in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return command_line(monkeypatch, capsys)
