"""Fixtures shared by several folders."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.scenario_files import CommandLine, command_line


@pytest.fixture
def gms_fsm(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> CommandLine:
    """Return ``gms-fsm`` as a function of its arguments, run in this process in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return command_line(monkeypatch, capsys)
