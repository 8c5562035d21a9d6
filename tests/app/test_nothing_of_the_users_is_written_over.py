"""No command overwrites its own input, a device or pipe, or a file that gms-fsm did not write.

It is rejected with one message and exit code 2, and the existing file is kept. In an output folder,
a file is ours if gms-fsm wrote it and it has not been changed since. Temporary files
have random names, follow no link, and are removed if their process is gone, and only then.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.app.cli import main
from gms_fsm.errors import GMSError, OutputError
from gms_fsm.foundation.files import LIST, output_folder, remove_leftovers, write_whole
from tests.helpers import ROOT, same_bits, stick_slip
from tests.scenario_files import MEASURED, OPEN_LOOP

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes and locks")
MARK = f"{7:016x}"


@pytest.fixture
def refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """Run a command that must be rejected; return its message."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "2000")  # a message on one line

    def run(*arguments: str) -> str:
        capsys.readouterr()
        assert command(*arguments) == 2
        out, err = capsys.readouterr()
        assert out == ""
        (said,) = err.strip().splitlines()
        assert said.startswith("error: ")
        return said

    return run


def command(*arguments: str) -> int:
    with mock.patch.object(sys, "argv", ["gms-fsm", *arguments]), pytest.raises(SystemExit) as end:
        main()
    assert isinstance(end.value.code, int)
    return end.value.code


@pytest.fixture
def scenario(tmp_path: Path) -> str:
    path = tmp_path / "mine.toml"
    path.write_text(OPEN_LOOP.replace("figures = []", "figures = []\ncsv = true"))
    return str(path)


@pytest.fixture
def trace(tmp_path: Path) -> Trace:
    made = simulate(stick_slip("signed"), Prescribed("0.2"), 3.0)
    made.save(tmp_path / "t.npz")
    made.save(tmp_path / "t.csv")
    return made


# --------------------------------------------------------------------------- an input
@pytest.mark.slow
def test_no_input_can_be_the_output(refused: Callable[..., str], trace: Trace) -> None:
    Path("link").symlink_to("t.npz")
    os.link("t.npz", "hard")
    said = "is an input here and would be overwritten"
    for output in ("t.npz", "./t.npz", "link", "hard", "t.csv", "t.transitions.csv"):
        assert said in refused("replay", "t.npz", "t.csv", "-o", output)
    pytest.importorskip("matplotlib", reason="needs the extra plots")
    assert said in refused("animate", "t.npz", "-o", "hard")
    same_bits(Trace.load("t.csv"), trace)
    same_bits(Trace.load("t.npz"), trace)


def test_the_record_of_a_run_cannot_be_the_output(
    refused: Callable[..., str], tmp_path: Path
) -> None:
    """Even if gms-fsm has written it."""
    rows = [f"{t:.3f},{np.sin(t):.6f},{np.cos(t):.6f}\n" for t in np.arange(0, 3, 0.01)]
    record = "t,x,F\n" + "".join(rows)
    out = output_folder("out")
    write_whole(out / "trace.csv", lambda file: file.write(record.encode()))
    text = MEASURED.replace('"own.csv"', '"out/trace.csv"')
    Path("mine.toml").write_text(text.replace("figures = []", "figures = []\ncsv = true"))
    assert "trace.csv: is an input here" in refused("run", "mine.toml", "-o", "out")
    assert Path("out/trace.csv").read_text() == record
    Path("mine.toml").write_text(text)
    assert command("run", "mine.toml", "-o", "out") == 0, "where it is not written it may stay"


# --------------------------------------------------------------------------- a file of the user's
RUN = ("summary.md", "trace.npz", "transitions.csv", "trace.csv", "trace.transitions.csv")
OTHERS = {
    **{name: ["run", "mine.toml"] for name in (*RUN, "partial.npz", "overview.svg")},
    "ribbons.svg": ["plot", "t.npz"],
    "lesson_1.txt": ["lesson", "1"],
    "lesson_1_live.html": ["lesson", "1", "--page"],
    "slides.html": ["class"],
    "phenomena.csv": ["phenomena"],
    "fig4_laws.svg": ["paper"],
    "traces/fig4_chart.npz": ["paper"],
    "report.txt": ["check", "lugre"],
}


@pytest.mark.slow
def test_no_command_overwrites_a_users_file(
    refused: Callable[..., str], scenario: str, trace: Trace, capsys: pytest.CaptureFixture[str]
) -> None:
    for module in ("matplotlib", "z3"):
        pytest.importorskip(module, reason="needs the extras plots and check")
    for name, (verb, *arguments) in OTHERS.items():
        place = Path(verb, name)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text("years of work")
        figures = ("--set", 'output.figures=["svg"]') if verb == "run" else ()
        assert command(verb, *arguments, "-o", verb, *figures) == 2, name
        said = capsys.readouterr().err
        assert f"{place}: already exists and was not written by gms-fsm" in said
        assert place.read_text() == "years of work"
        assert [path for path in Path(verb).rglob("*") if path.is_file()] == [place]
        place.unlink()


@pytest.mark.slow
def test_its_own_files_are_rewritten_but_changed_ones_are_not(
    refused: Callable[..., str], scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for end in ("t_end=1.0", "t_end=1.5", "t_end=1.0"):
        assert command("run", scenario, "-o", "out", "--set", f"run.{end}") == 0
    capsys.readouterr()
    summary = Path("out/summary.md")
    summary.write_text(summary.read_text() + "\nMy own conclusions.\n")
    assert "summary.md: already exists" in refused("run", scenario, "-o", "out")
    assert "My own conclusions" in summary.read_text()
    summary.unlink()
    assert command("run", scenario, "-o", "out") == 0


def test_a_kill_between_list_and_file_does_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = output_folder(tmp_path / "out", ["a"])
    write_whole(folder / "a", lambda file: file.write(b"first"))
    replace = os.replace

    class Killed(BaseException):
        """Stands for SIGKILL."""

    def dies_at_the_file(source: Path, target: Path) -> None:
        if Path(target).name == "a":
            raise Killed
        replace(source, target)

    for content in (b"second", b"third"):
        monkeypatch.setattr(os, "replace", dies_at_the_file)
        with pytest.raises(Killed):
            write_whole(folder / "a", lambda file, content=content: file.write(content))
        monkeypatch.setattr(os, "replace", replace)
        assert output_folder(folder, ["a"]) == folder
        assert (folder / "a").read_bytes() == b"first"


@pytest.mark.parametrize("text", ["", "[]", "{", '{"a": 3}', '{"a": null}'])
def test_a_damaged_list_makes_every_file_the_users(text: str, tmp_path: Path) -> None:
    folder = output_folder(tmp_path / "out")
    write_whole(folder / "a", lambda file: file.write(b"ours"))
    (folder / LIST).write_text(text)
    with pytest.raises(OutputError, match="was not written by gms-fsm"):
        output_folder(folder, ["a"])
    assert output_folder(folder, ["b"]) == folder


# --------------------------------------------------------------------------- no file
MADE: dict[str, Callable[[Path], object]] = {
    "pipe": os.mkfifo,
    "device": lambda path: path.symlink_to(os.devnull),
    "standard output": lambda path: path.symlink_to("/proc/self/fd/1"),
    "folder": Path.mkdir,
}


@pytest.mark.slow
@pytest.mark.parametrize("make", MADE)
def test_only_a_file_is_replaced_by_a_file(
    make: str, refused: Callable[..., str], trace: Trace
) -> None:
    pytest.importorskip("uplot", reason="needs the extra replay")
    for arguments, name in (
        (("chart", "lugre"), "x.mmd"),
        (("blocks",), "x.dot"),
        (("replay", "t.npz"), "x.html"),
    ):
        MADE[make](Path(name))
        before = os.lstat(name)
        said = refused(*arguments, "-o", name)
        assert "is there, not a file; give another name" in said
        after = os.lstat(name)
        assert (after.st_mode, after.st_ino) == (before.st_mode, before.st_ino)


def test_a_pipe_in_a_folder_is_seen_before_the_run(
    refused: Callable[..., str], scenario: str
) -> None:
    Path("out").mkdir()
    os.mkfifo("out/summary.md")
    assert "a pipe is there" in refused("run", scenario, "-o", "out")
    assert [path.name for path in Path("out").iterdir()] == ["summary.md"]


# --------------------------------------------------------------------------- temporary files
def test_temporary_names_are_random_and_no_link_is_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[str] = []
    for _ in range(2):
        write_whole(
            tmp_path / "a", lambda _: seen.extend(path.name for path in tmp_path.glob(".a.*"))
        )
    assert len(set(seen)) == len(seen) == 2
    victim = tmp_path / "victim"
    victim.write_text("precious")
    monkeypatch.setattr("secrets.token_hex", lambda _: MARK)
    (tmp_path / f".a.{MARK}.gms-fsm-part").symlink_to(victim)
    with pytest.raises(OutputError):
        write_whole(tmp_path / "a", lambda file: file.write(b"new"))
    assert victim.read_text() == "precious"


@pytest.mark.parametrize("start", [output_folder, lambda folder: write_whole(folder / "a.npz", id)])
def test_files_of_killed_processes_are_removed_at_the_next_start(
    start: Callable[[Path], object], tmp_path: Path
) -> None:
    ours = tmp_path / f".a.npz.{MARK}.gms-fsm-part"
    others = [tmp_path / name for name in (".a.npz.12.part", ".a.npz", f".a.npz.{MARK}", "notes")]
    for path in (ours, *others):
        path.write_text("half of")
    start(tmp_path)
    assert not ours.exists()
    assert all(path.read_text() == "half of" for path in others)


def test_files_of_a_live_process_are_kept(tmp_path: Path) -> None:
    code = """
import sys, time
from pathlib import Path
from gms_fsm.foundation.files import write_whole
def write(file):
    file.write(b"whole")
    print("begun", flush=True)
    sys.stdin.readline()
write_whole(Path(sys.argv[1]), write)
"""
    child = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path / "a")],
        cwd=ROOT,
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "begun\n"
    remove_leftovers(tmp_path)
    output_folder(tmp_path)
    write_whole(tmp_path / "a", lambda file: file.write(b"another"))
    assert len(list(tmp_path.glob(".a.*"))) == 1
    child.communicate("\n")
    assert child.returncode == 0
    assert (tmp_path / "a").read_bytes() == b"whole"
    assert list(tmp_path.glob(".a.*")) == []


def test_other_things_with_such_a_name_are_left_alone(tmp_path: Path) -> None:
    """Opening a pipe would block, and a link leads elsewhere."""
    victim = tmp_path / "victim"
    victim.write_text("precious")
    os.mkfifo(tmp_path / f".a.{MARK}.gms-fsm-part")
    (tmp_path / f".b.{MARK}.gms-fsm-part").symlink_to(victim)
    (tmp_path / f".c.{MARK}.gms-fsm-part").mkdir()
    remove_leftovers(tmp_path)
    assert len(list(tmp_path.iterdir())) == 4
    assert victim.read_text() == "precious"


# --------------------------------------------------------------------------- at once
@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("ending", [".npz", ".csv"])
def test_three_threads_that_save_to_one_path_never_show_a_damaged_file(
    ending: str, tmp_path: Path
) -> None:
    model = stick_slip("signed")
    traces = [simulate(model, Prescribed(f"0.{i}"), 3.0) for i in (2, 3, 4)]
    path = tmp_path / f"run{ending}"
    traces[0].save(path)
    known = {trace.F.tobytes() + trace.transitions.t.tobytes() for trace in traces}
    wrong: list[object] = []
    end = time.monotonic() + 0.7

    def write(trace: Trace) -> None:
        while time.monotonic() < end and not wrong:
            try:
                trace.save(path)
            except GMSError as error:
                wrong.append(error)

    def read() -> None:
        while time.monotonic() < end and not wrong:
            try:
                found = Trace.load(path)
            except GMSError as error:
                wrong.append(error)
            else:
                if found.F.tobytes() + found.transitions.t.tobytes() not in known:
                    wrong.append("a mixture")

    threads = [threading.Thread(target=write, args=(trace,)) for trace in traces]
    threads += [threading.Thread(target=read) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
    assert not list(tmp_path.glob(".*"))
    np.testing.assert_equal(Trace.load(path).n, 4)


def test_a_folder_that_takes_no_file_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("gms_fsm.foundation.files._part", full)
    with pytest.raises(OutputError, match=r"cannot write into .*: No space left on device; choose"):
        output_folder(tmp_path / "out", ["a.md"])
