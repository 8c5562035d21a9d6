"""Checkpoints survive a killed process; those of other runs, and damaged ones, are refused.

That runs go on bit for bit is in tests/laws.
"""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import ElementMachines, Prescribed, Trace, simulate
from gms_fsm.app.report import run_scenario
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import CheckpointError, ParameterError
from gms_fsm.run._checkpoint import Checkpointer
from tests.corpus import belt
from tests.helpers import ROOT, open_loop, pulled_mass, same_bits, stick_slip


class Interrupted(Exception):
    """Represents a lost machine."""


def interrupted(path: Path, after: int, *arguments: Any, **options: Any) -> Trace | None:
    """Run until `progress` has been called `after` times; None if interrupted there."""
    told = itertools.count(1)

    def stop(_: object) -> None:
        if next(told) == after:
            raise Interrupted

    try:
        return simulate(*arguments, **options, checkpoint=path, checkpoint_every=0.0, progress=stop)
    except Interrupted:
        return None


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["machines", "compiled"])
def test_user_machines_continue_in_their_states(engine: str, tmp_path: Path) -> None:
    if engine == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    model = stick_slip("signed")
    fired: list[str] = []

    def machines() -> ElementMachines:
        made = ElementMachines(model)
        made.machine.on_enter_slip(lambda event: fired.append(event.transition.dest))
        made.machine.on_enter_stick(lambda event: fired.append(event.transition.dest))
        return made

    arguments = model, open_loop(), 25.0
    path = tmp_path / "run.checkpoint"
    while interrupted(path, 9, *arguments, engine=engine, machines=machines()) is None:
        pass
    made = machines()
    whole = simulate(*arguments)
    assert fired == whole.transitions.target.tolist()
    assert made.elements[0].state == "stick"


@pytest.mark.slow
def test_a_killed_process_can_be_resumed(tmp_path: Path) -> None:
    """SIGKILL at some moment; the next process ends with the bits of an undisturbed run."""
    script = tmp_path / "long.py"
    script.write_text(
        textwrap.dedent(
            """
            import sys, time
            from gms_fsm import simulate
            from tests.helpers import pulled_mass
            trace = simulate(*pulled_mass(), 40.0, checkpoint="long.checkpoint",
                             checkpoint_every=0.0, progress=lambda _: time.sleep(1e-3))
            trace.save("long.npz")
            """
        )
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(script)]
    child = subprocess.Popen(command, cwd=tmp_path, env=environment)
    while not (tmp_path / "long.checkpoint").exists():
        time.sleep(0.01)
    time.sleep(0.3)
    child.send_signal(signal.SIGKILL)
    child.wait()
    assert (tmp_path / "long.checkpoint").exists()
    assert not (tmp_path / "long.npz").exists()
    subprocess.run(command, cwd=tmp_path, env=environment, check=True)
    same_bits(Trace.load(tmp_path / "long.npz"), simulate(*pulled_mass(), 40.0))
    assert not (tmp_path / "long.checkpoint").exists()


def begun(path: Path) -> None:
    assert interrupted(path, 5, stick_slip("signed"), open_loop(), 25.0) is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rtol": 1e-7}, "another"),
        ({"t_end": 26.0}, "another"),
        ({"output": "end"}, "another"),
        ({"model": stick_slip("published")}, "another"),
        ({"rig": Prescribed("0.2")}, "another"),
        ({"initial": {"x": 1.0}}, "another"),
    ],
)
def test_a_checkpoint_of_another_run_is_refused(
    change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path)
    before = path.read_bytes()
    arguments = {"model": stick_slip("signed"), "rig": open_loop(), "t_end": 25.0} | change
    with pytest.raises(CheckpointError, match=words) as caught:
        simulate(**arguments, checkpoint=path)
    assert "remove it" in str(caught.value)
    assert path.read_bytes() == before


@pytest.mark.parametrize("damage", ["cut", "text", "empty", "npz"])
def test_a_damaged_checkpoint_is_refused(damage: str, tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path)
    if damage == "npz":
        with path.open("wb") as file:
            np.savez(file, a=np.zeros(3))
    else:
        data = {"cut": path.read_bytes()[:500], "text": b"hello", "empty": b""}[damage]
        path.write_bytes(data)
    with pytest.raises(CheckpointError, match="damaged"):
        simulate(stick_slip("signed"), open_loop(), 25.0, checkpoint=path)


def test_checkpoints_are_written_at_the_requested_interval(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved = []
    save = Checkpointer.save
    monkeypatch.setattr(Checkpointer, "save", lambda keeper: (saved.append(0), save(keeper))[1])
    path = tmp_path / "run.checkpoint"
    simulate(stick_slip("signed"), open_loop(), 25.0, checkpoint=path, checkpoint_every=1e6)
    assert len(saved) == 1  # at the start


@pytest.mark.slow
def test_the_command_line_resumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`gms-fsm run --checkpoint`, interrupted, then the same command again."""
    loaded = load_scenario(ROOT / "scenarios" / "pulled_mass.toml", [])
    told = itertools.count(1)

    def stop(_: object) -> None:
        if next(told) == 30:
            raise Interrupted

    with pytest.raises(Interrupted):
        run_scenario(loaded, tmp_path, stop, checkpoint=True)
    assert (tmp_path / "run.checkpoint").exists()
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "from gms_fsm.app.cli import main; main()",
            "run",
            str(loaded.path),
            "-o",
            str(tmp_path),
            "--checkpoint",
            "--set",
            "output.figures=[]",
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "run.checkpoint").exists()
    whole = simulate(loaded.model, loaded.rig, **loaded.arguments)
    same_bits(Trace.load(tmp_path / "trace.npz"), whole)


# --------------------------------------------------------------------------- systems
def belted(path: Path, speed: Any = "0.1", **options: Any) -> Trace:
    initial = {"q2": 0.2, "pad.states": ["backward"]}
    return simulate(belt(speed), 12.0, initial=initial, engine="ifelse", checkpoint=path, **options)


def begun_system(path: Path) -> None:
    def stop(moment: Any) -> None:
        if moment.t > 7.0:
            raise Interrupted

    with pytest.raises(Interrupted):
        belted(path, checkpoint_every=0.0, progress=stop)


def test_another_system_is_refused(tmp_path: Path) -> None:
    begun_system(tmp_path / "run.checkpoint")
    with pytest.raises(CheckpointError, match="another model, rig, signal"):
        belted(tmp_path / "run.checkpoint", "0.2")


def test_a_function_that_cannot_be_identified_is_refused_before_the_run(tmp_path: Path) -> None:
    told: list[object] = []
    with pytest.raises(ParameterError, match="signal 'r' cannot be resumed"):
        belted(tmp_path / "run.checkpoint", abs, progress=told.append)
    assert told == []


@pytest.mark.parametrize(
    ("name", "value"), [("loop_mode", 3), ("loop_edges", 9), ("kept_log", "none")]
)
def test_values_that_no_run_can_have_are_refused(name: str, value: Any, tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun_system(path)
    with np.load(path) as file:
        arrays = dict(file)
    if name == "kept_log":
        arrays[name]["contact"][0] = value
    else:  # those of the second machine: it has two states and three edges
        arrays[name][1] = value
    with path.open("wb") as file:
        np.savez(file, **arrays)
    with pytest.raises(CheckpointError, match="damaged"):
        belted(path)
