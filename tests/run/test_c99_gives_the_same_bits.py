"""The C99 text of a run, compiled by a C compiler without contraction, gives the engine's bits."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.lowering import _compiled as compiled
from gms_fsm.run import _compiled_run
from integrators import compiled as machine
from integrators.machine_code import objects
from integrators.machine_code.c99 import c99_text
from tests.corpus import FALLING, relay
from tests.helpers import open_loop, pulled_mass, same_bits, stick_slip
from tests.systems_cases import CASES

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler"),
]
pytest.importorskip("llvmlite", reason="needs the extra fast")

FLAGS = [
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-Wall",
    "-Wno-unused",
    "-Werror",
    "-fPIC",
    "-shared",
]


@pytest.fixture
def by_c(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Make engine="compiled" run what a C compiler makes of the C99 text; return the texts."""
    texts: list[str] = []

    def built(text: str) -> bytes:
        texts.append(text)
        (tmp_path / "text.c").write_text(text)
        command = ["cc", *FLAGS, "text.c", "-o", "text.so", "-lm"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return (tmp_path / "text.so").read_bytes()

    class Library:
        def __init__(self, content: bytes) -> None:
            path = tmp_path / f"{len(texts)}.so"
            path.write_bytes(content)
            self.library = ctypes.CDLL(str(path))

        def address(self, name: str) -> int:
            return ctypes.cast(getattr(self.library, name), ctypes.c_void_p).value or 0

        def variable(self, name: str) -> int:
            return ctypes.addressof(ctypes.c_void_p.in_dll(self.library, name))

    monkeypatch.setattr(compiled, "store", lambda: None)
    monkeypatch.setattr(_compiled_run, "_known", {})
    monkeypatch.setattr(machine, "llvm_text", c99_text)
    monkeypatch.setattr(machine, "Library", Library)
    monkeypatch.setattr(objects, "compiled", built)
    return texts


def _runs(*arguments: Any, **options: Any) -> list[Trace]:
    return [simulate(*arguments, engine=engine, **options) for engine in ("compiled", "machines")]


@pytest.mark.parametrize(
    "options",
    [{}, {"t_eval": [0.5 * i for i in range(40)]}, {"method": "rk4", "step": 9.03e-3}],
    ids=["all", "t_eval", "rk4"],
)
@pytest.mark.parametrize("case", ["open loop", "pulled mass"])
def test_the_bank(case: str, options: dict[str, Any], by_c: list[str]) -> None:
    model, rig = (stick_slip("signed"), open_loop()) if case == "open loop" else pulled_mass()
    ours, theirs = _runs(model, rig, 20.0, **options)
    same_bits(ours, theirs)
    assert len(ours.transitions) > 2
    assert by_c


@pytest.mark.parametrize("name", ["servo", "puck"])
def test_systems(name: str, by_c: list[str]) -> None:
    same_bits(CASES[name]().run("compiled"), CASES[name]().run("machines"))
    assert by_c


def test_a_python_function_is_called(by_c: list[str]) -> None:
    rig = Prescribed(lambda t: 0.2 * math.sin(0.3 * t))
    ours, theirs = _runs(stick_slip("signed"), rig, 15.0)
    same_bits(ours, theirs)
    assert "callbacks[0](" in by_c[0]


def test_sliding_between_states(by_c: list[str]) -> None:
    ours, theirs = _runs(relay(FALLING), Prescribed("0"), 5.0, initial={"p": [-0.1], "q": [0.0]})
    same_bits(ours, theirs)
    assert len(ours.sliding) == 1
    assert by_c
