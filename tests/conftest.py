"""Fixtures shared by several folders."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest

from gms_fsm.lowering import _compiled
from gms_fsm.run import _compiled_run, _stepper
from integrators import compiled
from integrators.machine_code import objects
from tests.scenario_files import CommandLine, command_line

# LLVM takes a second for each chart, and a fifth of that without optimisation; there are hundreds.
# Tests of the machine code itself compile it as users do: `optimised`. So does every subprocess.
FULL, objects.SPEED_LEVEL = objects.SPEED_LEVEL, 0


@pytest.fixture(scope="module")
def optimised() -> Iterator[None]:
    """Compile as users do, whatever has been compiled before."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(objects, "SPEED_LEVEL", FULL)
        for module in (_compiled_run, _stepper):
            patch.setattr(module, "_known", {})
        patch.setattr(_compiled, "_observers", {})
        compiled.edition.cache_clear()
        yield
    compiled.edition.cache_clear()


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
