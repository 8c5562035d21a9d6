"""Machine code is kept on disk, found again and shared; a broken cache only costs time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("numba", reason="needs the extra fast")

from integrators import compiled

ROOT = Path(__file__).parents[1]
RUN = """
from gms_fsm import GMS, GMSParameters, Prescribed, simulate
model = GMS(GMSParameters.paper("stick-slip"), law="signed")
rigs = [Prescribed("0.2*sin(2*pi*t/20)"), Prescribed("0.2*cos(2*pi*t/20)")]
runs = [simulate(model, rig, 25.0, engine="compiled") for rig in rigs]
print([(len(run), float(run.z[-1, 0]).hex()) for run in runs])
"""
NOTE = "compiling the engine"


def child(folder: Path, text: str = RUN) -> subprocess.Popen[str]:
    """Start a process whose cache lies in a folder."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", text], env=environment, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def finished(process: subprocess.Popen[str]) -> tuple[str, str]:
    """Return what a process printed and noted."""
    out, err = process.communicate()
    assert process.returncode == 0, err
    return out, err


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder that two processes filled at the same time, and what they computed."""
    folder = tmp_path_factory.mktemp("cache")
    together = [finished(process) for process in [child(folder), child(folder)]]
    assert all(NOTE in err and "compiled in" in err for _, err in together)
    assert together[0][0] == together[1][0]
    return folder, together[0][0]


def test_two_processes_fill_it_together_and_a_third_finds_it(warm: tuple[Path, str]) -> None:
    folder, right = warm
    out, err = finished(child(folder))
    assert out == right
    assert err == ""


def test_what_it_holds_computes_what_the_machines_do(warm: tuple[Path, str]) -> None:
    """Two programs loaded from disk into one process do not take each other's functions."""
    folder, right = warm
    assert finished(child(folder, RUN.replace("compiled", "machines")))[0] == right


def test_damaged_files_are_compiled_again(warm: tuple[Path, str], tmp_path: Path) -> None:
    folder, right = warm
    kept = [path for path in folder.rglob("*") if path.suffix in (".nbi", ".nbc")]
    assert len(kept) > 10
    whole = {path: path.read_bytes() for path in kept}
    for number, path in enumerate(kept):
        data = whole[path]
        path.write_bytes([b"", data[: len(data) // 2], b"\x00garbage" * 50][number % 3])
    try:
        assert finished(child(folder))[0] == right
    finally:
        for path, data in whole.items():
            path.write_bytes(data)


def test_a_folder_that_cannot_be_made_only_costs_time(
    warm: tuple[Path, str], tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("in the way")
    out, err = finished(child(tmp_path / "file" / "cache"))
    assert out == warm[1]
    assert NOTE in err
    assert (tmp_path / "file").read_text() == "in the way"


def test_the_folder_is_named_after_what_the_code_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = compiled.cache_folder(tmp_path)
    assert first is not None
    assert first.is_dir()
    assert compiled.cache_folder(tmp_path) == first
    monkeypatch.setattr("integrators.advance.REDO", 0.8)
    second = compiled.cache_folder(tmp_path)
    assert second not in (None, first)
    monkeypatch.undo()
    monkeypatch.setattr("integrators.compiled._OPTIONS", {"error_model": "python"})
    assert compiled.cache_folder(tmp_path) not in (None, first, second)


def test_a_digest_sees_inner_functions() -> None:
    def one() -> list[int]:
        return [u + 1 for u in range(3)]

    def two() -> list[int]:
        return [u + 2 for u in range(3)]

    assert compiled.digest(one) != compiled.digest(two)
    assert compiled.digest(one) == compiled.digest(one)
    assert compiled.digest(one, text="a") != compiled.digest(one)


WITHOUT = """
import sys
class NoNumba:
    def find_spec(self, name, path=None, target=None):
        if name == "numba":
            raise ModuleNotFoundError("No module named 'numba'", name="numba")
sys.meta_path.insert(0, NoNumba())
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "numba" else found(name, *rest)
from gms_fsm import GMS, GMSParameters, Prescribed, simulate, sweep
from gms_fsm.errors import MissingExtraError
model = GMS(GMSParameters.paper("stick-slip"), law="signed")
print(len(simulate(model, Prescribed("0.2"), 3.0).transitions))
for call in (lambda: simulate(model, Prescribed("0.2"), 3.0, engine="compiled"),
             lambda: sweep(model, Prescribed("0.2"), 3.0, {"F_s": [1.5]})):
    try:
        call()
    except MissingExtraError as error:
        print(error)
"""


def test_without_numba_it_says_what_to_install(tmp_path: Path) -> None:
    out, _ = finished(child(tmp_path, WITHOUT))
    first, *messages = out.splitlines()
    assert first == "4"
    assert len(messages) == 2
    for message in messages:
        for words in ("needs numba", "gms-fsm[fast]", "engine='machines'"):
            assert words in message
