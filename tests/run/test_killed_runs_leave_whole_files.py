"""A process killed at any moment leaves the old file or a complete new one, and no obstacles.

Writers write two known contents alternately, again and again, and are killed with SIGKILL at a
random moment; then every file is the one or the other, to the last bit. Other leftovers of a kill
are named ``.<file>.<random>.gms-fsm-part`` and are gone after the next run. Six kills here, 200 in
tests/soak.
"""

from __future__ import annotations

import contextlib
import functools
import io
import itertools
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from gms_fsm import Prescribed, Sweep, Trace, simulate, sweep
from gms_fsm.app.cli import main
from gms_fsm.errors import OutputError
from gms_fsm.foundation.files import LIST, leftovers, write_together, write_whole
from gms_fsm.session.session import Session
from tests.helpers import ROOT, pulled_mass, same_bits, stick_slip
from tests.scenario_files import OPEN_LOOP

PARTS = re.compile(r"\..+\.[0-9a-f]{16}\.gms-fsm-(part|rest)")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL"),
]


# --------------------------------------------------------------------------- writers
@functools.cache
def _traces() -> tuple[Trace, Trace]:
    """Return two runs that differ in every row and in the number of transitions."""
    return (
        simulate(stick_slip("signed"), Prescribed("0.15*sin(2*pi*t/25)"), 40.0, engine="ifelse"),
        simulate(stick_slip("published"), Prescribed("0.2*sin(2*pi*t/20)"), 61.0, engine="ifelse"),
    )


@functools.cache
def _sweeps() -> tuple[Sweep, Sweep]:
    model, rig = stick_slip("signed"), Prescribed("0.2")
    first, second = (
        sweep(model, rig, 3.0, {"F_s": np.linspace(1.5, top, 40)}, engine="ifelse")
        for top in (1.6, 1.9)
    )
    return first, second


SCENARIOS = {
    law: OPEN_LOOP.replace('"signed"', f'"{law}"')
    .replace("F_c = 1.0, F_s = 1.5", "F_c = 0.01, F_s = 0.015")
    .replace("t_end = 1.0", "t_end = 10.0")
    .replace("figures = []", 'figures = ["svg"]\ncsv = true')
    for law in ("signed", "published")
}


def _gms_fsm(*arguments: str) -> None:
    with mock.patch.object(sys, "argv", ["gms-fsm", *arguments]), pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0


def _write_trace(ending: str, folder: Path, turn: int) -> None:
    _traces()[turn].save(folder / f"run{ending}")


def _look_trace(ending: str, folder: Path) -> None:
    found = Trace.load(folder / f"run{ending}")
    (known,) = [t for t in _traces() if len(t) == len(found)]
    same_bits(found, known)


def _write_run(folder: Path, turn: int) -> None:
    law = list(SCENARIOS)[turn]
    (folder / "work").mkdir(exist_ok=True)
    scenario = folder / "work" / f"{law}.toml"
    scenario.write_text(SCENARIOS[law])
    _gms_fsm("run", str(scenario), "-o", str(folder / "out"))


@functools.cache
def _expected_logs() -> tuple[bytes, ...]:
    with tempfile.TemporaryDirectory() as name:
        found = []
        for turn in range(2):
            _write_run(Path(name), turn)
            found.append((Path(name) / "out" / "transitions.csv").read_bytes())
    return tuple(found)


def _look_run(folder: Path) -> None:
    out = folder / "out"
    assert len(Trace.load(out / "trace.npz").transitions) > 4
    assert Trace.load(out / "trace.csv").n == 2
    assert (out / "transitions.csv").read_bytes() in _expected_logs()
    *_, trust, end = (out / "summary.md").read_text().split("\n")
    assert trust.startswith("- ")  # the last finding, whole
    assert end == ""
    assert (out / "overview.svg").read_text().endswith("</svg>\n")


def _write_sweep(folder: Path, turn: int) -> None:
    _sweeps()[turn].save(folder / "runs.npz")


def _look_sweep(folder: Path) -> None:
    found = Sweep.load(folder / "runs.npz")
    top = float(found.parameters["F_s"][-1])
    known = next(s for s in _sweeps() if float(s.parameters["F_s"][-1]) == top)
    for name in ("t", "x", "v", "F", "z", "states", "outcome", "transitions"):
        np.testing.assert_array_equal(getattr(found, name), getattr(known, name), err_msg=name)


def _write_session(folder: Path, turn: int) -> None:
    session = Session(stick_slip("signed"), Prescribed("0.2"), 3.0)
    session.step(2 + turn)
    for _ in range(50):
        session.save(folder / "walk.json")


def _look_session(folder: Path) -> None:
    assert Session.load(folder / "walk.json").branch.cursor in (2, 3)


CLOSED = {"t_end": 12.0, "rtol": 1e-5}


@functools.cache
def _whole() -> Trace:
    return simulate(*pulled_mass(), **CLOSED)


def _write_checkpoint(folder: Path, turn: int) -> None:
    trace = simulate(
        *pulled_mass(), **CLOSED, checkpoint=folder / "run.checkpoint", checkpoint_every=0.0
    )
    trace.save(folder / "run.npz")


def _look_checkpoint(folder: Path) -> None:
    """The interrupted run continues to exactly the same end."""
    same_bits(Trace.load(folder / "run.npz"), _whole())
    left = folder / "run.checkpoint"
    same_bits(simulate(*pulled_mass(), **CLOSED, checkpoint=left), _whole())
    assert not left.exists()


@dataclass(frozen=True)
class Writer:
    """Writes one of two known contents; checks that one of them is there.

    Parameters
    ----------
    write : callable
        ``write(folder, turn)`` with turn 0 or 1.
    look : callable
        ``look(folder)`` fails unless every file is complete.
    span : float
        Time in s within which the kill occurs.
    """

    write: Callable[[Path, int], None]
    look: Callable[[Path], None]
    span: float


WRITERS = {
    "npz": Writer(
        functools.partial(_write_trace, ".npz"), functools.partial(_look_trace, ".npz"), 0.1
    ),
    "csv": Writer(
        functools.partial(_write_trace, ".csv"), functools.partial(_look_trace, ".csv"), 0.2
    ),
    "run": Writer(_write_run, _look_run, 1.5),
    "sweep": Writer(_write_sweep, _look_sweep, 0.1),
    "session": Writer(_write_session, _look_session, 0.1),
    "checkpoint": Writer(_write_checkpoint, _look_checkpoint, 0.5),
}


SHARES = 0.03, 0.47, 0.21, 0.83  # of a writer's span, for one writer and the next


# --------------------------------------------------------------------------- child processes
# Forking the test process, which has threads, would be unsafe; so one process is started for it,
# which loads everything and then forks a writer for each line it reads.
def nursery() -> None:
    """Fork a writer for each line ``name<TAB>folder``, print its number, wait until it ends."""
    with contextlib.redirect_stdout(io.StringIO()):
        _expected_logs()
    _traces(), _sweeps()
    for line in sys.stdin:
        name, folder = line.rstrip("\n").split("\t")
        child = os.fork()
        if child == 0:
            sys.stdout = sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115
            for turn in itertools.count():
                WRITERS[name].write(Path(folder), turn % 2)
        print(child, flush=True)
        os.waitpid(child, 0)
        print("gone", flush=True)


@functools.cache
def _nursery() -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", f"from {__name__} import nursery; nursery()"],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def end_nursery() -> None:
    """End the process that forks writers, if it exists."""
    if _nursery.cache_info().currsize:
        process = _nursery()
        process.communicate()
        assert process.returncode == 0
        _nursery.cache_clear()


def kill_and_look(name: str, share: float, folder: Path) -> list[str]:
    """Let a writer overwrite existing files, kill it, and check the files.

    Parameters
    ----------
    name : str
        The name of a writer.
    share : float
        The time of the kill, as a fraction of the writer's span.
    folder : Path
        An empty folder.

    Returns
    -------
    list of str
        Names of the files that the kill left behind.
    """
    writer, process = WRITERS[name], _nursery()
    writer.write(folder, 0)
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(f"{name}\t{folder}\n")
    process.stdin.flush()
    child = int(process.stdout.readline())
    time.sleep(share * writer.span)
    os.kill(child, signal.SIGKILL)
    assert process.stdout.readline() == "gone\n"
    known = {path.name for path in folder.rglob("*")}
    writer.look(folder)
    left = sorted(name for name in known if name.startswith(".") and name != LIST)
    assert [name for name in left if not PARTS.fullmatch(name)] == []
    writer.write(folder, 1)  # the next run works as if nothing had happened
    writer.look(folder)
    assert {path.name for path in folder.rglob(".*")} <= {LIST}
    return left


@pytest.fixture(scope="module", autouse=True)
def _one_nursery() -> Iterator[None]:
    yield
    end_nursery()


@pytest.mark.every(2)
@pytest.mark.parametrize(("name", "share"), [*zip(WRITERS, itertools.cycle(SHARES), strict=False)])
def test_killed_at_some_moment(name: str, share: float, tmp_path: Path) -> None:
    if name == "run":
        pytest.importorskip("matplotlib", reason="a run draws figures: needs the extra plots")
    kill_and_look(name, share, tmp_path)


# --------------------------------------------------------------------------- between two renames
def test_rows_and_log_of_a_csv_belong_together_even_if_killed_between_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The worst moment for two files: one has been renamed, the other has not."""
    first, second = _traces()
    path = first.save(tmp_path / "run.csv")

    class Killed(BaseException):
        """Represents SIGKILL: nothing is cleaned up."""

    replace, unlink = os.replace, Path.unlink
    count = itertools.count(1)

    def dies_after_one(source: Path, target: Path) -> None:
        if next(count) == 2:
            raise Killed
        replace(source, target)

    monkeypatch.setattr(os, "replace", dies_after_one)
    monkeypatch.setattr(Path, "unlink", lambda *_, **__: None)
    with pytest.raises(Killed):
        second.save(path)
    monkeypatch.setattr(os, "replace", replace)
    monkeypatch.setattr(Path, "unlink", unlink)
    assert len(leftovers(tmp_path / "run.transitions.csv")) == 1
    same_bits(Trace.load(path), second)
    first.save(path)  # and the next one is not confused by the leftovers
    same_bits(Trace.load(path), first)


def test_a_log_of_another_run_is_refused(tmp_path: Path) -> None:
    first, second = _traces()
    first.save(tmp_path / "run.csv")
    second.save(tmp_path / "other.csv")
    (tmp_path / "other.transitions.csv").rename(tmp_path / "run.transitions.csv")
    with pytest.raises(Exception, match=r"run\.transitions\.csv: it belongs to a different run"):
        Trace.load(tmp_path / "run.csv")


def test_line_ends_do_not_part_rows_and_log(tmp_path: Path) -> None:
    """Some tools write CRLF; the numbers are the same."""
    path = _traces()[0].save(tmp_path / "run.csv")
    for each in tmp_path.iterdir():
        each.write_bytes(each.read_bytes().replace(b"\n", b"\r\n"))
    same_bits(Trace.load(path), _traces()[0])


def test_leftovers_are_those_of_the_file_alone(tmp_path: Path) -> None:
    mark = f"{7:016x}"
    names = [
        f".a.csv.{mark}.gms-fsm-rest",
        f".a.csv.{mark}.gms-fsm-part",
        ".a.csv.7.gms-fsm-rest",
        f".b.csv.{mark}.gms-fsm-rest",
        f"a.csv.{mark}.gms-fsm-rest",
        ".a.csv",
    ]
    for name in names:
        (tmp_path / name).touch()
    assert [path.name for path in leftovers(tmp_path / "a.csv")] == names[:1]


def test_if_one_of_several_files_cannot_be_written_all_keep_the_old_content(tmp_path: Path) -> None:
    paths = [tmp_path / "one", tmp_path / "two"]
    for path in paths:
        write_whole(path, lambda file: file.write(b"old"))

    def fails(_: object) -> None:
        raise OSError("disk full")

    with pytest.raises(OutputError, match="disk full"):
        write_together({paths[0]: lambda file: file.write(b"new"), paths[1]: fails})
    assert [path.read_bytes() for path in paths] == [b"old", b"old"]
    assert len(list(tmp_path.iterdir())) == 2
