"""Compiling the plain form in C, and running it."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.c import plain_c
from tests.exporters.text_cases import case

STEP = 1e-3
COMPILERS = [each for each in ("gcc", "clang") if shutil.which(each)]
STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off")
needs_c = pytest.mark.skipif(not COMPILERS, reason="no C compiler")


def compiled(folder: Path, subject: Subject, compiler: str = "") -> Callable[..., float]:
    """Return the step of a friction that has begun, as a function of its inputs and dt."""
    files = plain_c(subject)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    source, library = folder / f"{subject.name}_plain.c", folder / f"{subject.name}.so"
    command = [compiler or COMPILERS[0], *STRICT, "-shared", "-fPIC", str(source), "-lm"]
    done = subprocess.run(
        [*command, "-o", str(library)], capture_output=True, text=True, check=False
    )
    assert not done.returncode, done.stderr
    loaded = ctypes.CDLL(str(library))
    step, memory = loaded[f"{subject.name}_plain_step"], ctypes.create_string_buffer(65536)
    step.restype = ctypes.c_double
    loaded[f"{subject.name}_plain_start"](memory)
    return lambda *inputs: float(step(memory, *map(ctypes.c_double, inputs)))


def compared(name: str, seed: int, compiler: str, folder: Path) -> tuple[int, int]:
    """Compare the bits with those of the engine; return the switches and the steps."""
    given = case(name, seed)
    trace = given.simulated(method="euler", step=STEP, events="step")
    last = np.append(np.diff(trace.t) > 0.0, True)  # of the rows at one time: after switching
    t, v, F = trace.t[last], trace.v[last], trace.F[last]
    step = compiled(folder, Subject.of(given.model, "c99", name=f"f{seed}{compiler}"), compiler)
    found = [step(v[k], t[k + 1] - t[k]) for k in range(len(t) - 1)]
    assert found == F[:-1].tolist(), f"repeat with case({name!r}, {seed})"
    return len(trace.transitions), len(found)
