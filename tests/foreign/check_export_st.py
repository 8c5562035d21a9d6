"""Claim: other tools read structured text, and what a compiler makes of it has the engine's bits.

matiec (``iec2c``) is not in package registries. ``GMS_FSM_MATIEC`` names a folder where it is, or
will be, built; by this test, which needs git, autoconf, automake, flex, bison, make and g++.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import blark
import numpy as np
import pytest

from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.targets.st import structured_text
from tests.exporters.frictions import NAMES, case

STEP = 1e-3
SOURCE = "https://github.com/beremiz/matiec"
MAIN = """\
#include <stdio.h>
#include "POUS.h"
#include "POUS.c"
TIME __CURRENT_TIME;
BOOL __DEBUG;
int main(void)
{
    static FRICTION friction;
    double line[2];
    FRICTION_init__(&friction, 0);
    while (fread(line, sizeof(double), 2, stdin) == 2) {
        __SET_VAR(friction., V, , line[0]);
        __SET_VAR(friction., CYCLE, , line[1]);
        FRICTION_body__(&friction);
        double F = __GET_VAR(friction.FORCE);
        fwrite(&F, sizeof F, 1, stdout);
    }
    return 0;
}
"""


@pytest.fixture(scope="module")
def matiec() -> Path:
    """Return the folder of matiec, built if it is not."""
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    folder = Path(os.environ.get("GMS_FSM_MATIEC", cache / "gms-fsm-matiec"))
    if not (folder / "iec2c").exists():
        if not folder.exists():
            done = subprocess.run(
                ["git", "clone", "--depth", "1", SOURCE, str(folder)], check=False
            )
            if done.returncode:
                pytest.skip(f"matiec is not in {folder}, and cannot be fetched from {SOURCE}")
        for command in (["autoreconf", "-i"], ["./configure"], ["make"]):
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder


def test_blark_parses_it(ran: Callable[..., None]) -> None:
    for name in NAMES:
        files = structured_text(Subject.of(case(name, 0).model, "st", name="friction"))
        blark.parse_source_code(files["friction.st"])  # raises an error of lark's if it cannot
    ran("st", f"blark {version('blark')}", f"parsed {len(NAMES)} frictions", "no error")


def test_matiec_gives_the_bits_of_the_engine(
    matiec: Path, ran: Callable[..., None], tmp_path: Path
) -> None:
    steps = sum(
        compared(name, seed, matiec, tmp_path / f"{name}{seed}")
        for name in NAMES
        for seed in range(3)
    )
    told = subprocess.run(
        [str(matiec / "iec2c"), "-v"], capture_output=True, text=True, check=False
    )
    (number,) = re.findall(r"version (\S+)", told.stdout)
    what = f"compiled and ran {len(NAMES)} frictions on 3 random records each"
    ran("st", f"matiec {number}", what, f"bits of the engine in all {steps:,} steps")


def compared(name: str, seed: int, matiec: Path, folder: Path) -> int:
    """Compare a run with that of the engine; return the number of steps."""
    folder.mkdir()
    given = case(name, seed)
    files = structured_text(Subject.of(given.model, "st", name="friction"))
    (folder / "friction.st").write_text(files["friction.st"], encoding="utf-8")
    (folder / "main.c").write_text(MAIN, encoding="utf-8")
    read = [str(matiec / "iec2c"), "-I", str(matiec / "lib"), "-T", ".", "friction.st"]
    done = subprocess.run(read, cwd=folder, capture_output=True, text=True, check=False)
    assert not re.search("error|warning", done.stderr), done.stderr
    build = ["gcc", "-O2", "-ffp-contract=off", f"-I{matiec / 'lib' / 'C'}", "main.c", "-lm"]
    subprocess.run([*build, "-o", "run"], cwd=folder, check=True, capture_output=True)
    trace = given.simulated(method="euler", step=STEP, events="step")
    last = np.append(np.diff(trace.t) > 0.0, True)  # of the rows at one time: after switching
    t, v, F = trace.t[last], trace.v[last], trace.F[last]
    lines = np.column_stack([v[:-1], np.diff(t)]).tobytes()
    run = subprocess.run([str(folder / "run")], input=lines, capture_output=True, check=True)
    found = np.frombuffer(run.stdout)
    assert found.tolist() == F[:-1].tolist(), f"repeat with case({name!r}, {seed})"
    return found.size
