"""An interrupted run of a system continues from its checkpoint, bit for bit."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import simulate
from gms_fsm.errors import CheckpointError, ParameterError
from tests.traces.test_traces_of_systems_round_trip import belt, same_rows

ENGINES = ["machines", "ifelse", "compiled"]
T_END = 12.0


@pytest.fixture(autouse=True)
def _short_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a compiled run return often enough to be interrupted."""
    monkeypatch.setattr("gms_fsm.run._compiled_run.STEPS_AT_ONCE", 30)


def begun(path: Path, engine: str, after: float) -> None:
    def stop(moment: Any) -> None:
        if moment.t > after:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        goes_on(path, engine, checkpoint_every=0.0, progress=stop)


def goes_on(path: Path | None, engine: str, speed: Any = "0.1", **options: Any) -> Any:
    return simulate(
        belt(speed), T_END, initial={"q2": 0.2}, engine=engine, checkpoint=path, **options
    )


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("after", [0.5, 7.0])
def test_it_goes_on(engine: str, after: float, tmp_path: Path) -> None:
    if engine == "compiled" and not importlib.util.find_spec("llvmlite"):
        pytest.skip("needs the extra fast")
    path = tmp_path / "run.checkpoint"
    begun(path, engine, after)
    same_rows(goes_on(None, engine), goes_on(path, engine))
    assert not path.exists()


def test_another_system_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path, "ifelse", 7.0)
    with pytest.raises(CheckpointError, match="another model, rig, signal"):
        goes_on(path, "ifelse", "0.2")


def test_a_function_that_cannot_be_identified_is_refused_before_the_run(tmp_path: Path) -> None:
    told: list[object] = []
    with pytest.raises(ParameterError, match="signal 'r' cannot be resumed"):
        goes_on(tmp_path / "run.checkpoint", "ifelse", abs, progress=told.append)
    assert told == []


@pytest.mark.parametrize(
    ("name", "value"), [("loop_mode", 3), ("loop_edges", 3), ("kept_log", "none")]
)
def test_values_that_no_run_can_have_are_refused(name: str, value: Any, tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path, "ifelse", 7.0)
    with np.load(path) as file:
        arrays = dict(file)
    if name == "kept_log":
        arrays[name]["contact"][0] = value
    else:  # those of the second machine: it has two states and three edges
        arrays[name][1] = value
    with path.open("wb") as file:
        np.savez(file, **arrays)
    with pytest.raises(CheckpointError, match="damaged"):
        goes_on(path, "ifelse")
