"""Scenario files for the tests, matching records, and the command line run in this process."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Record
from gms_fsm.app.cli import main
from gms_fsm.records.record import Column
from tests.helpers import ROOT

PUBLIC_RECORD = "reciprocating_friction.tsv"

STAGE = """\
title = "stage"

[model]
kind = "GMS"
law = "signed"
k = [8000.0, 4000.0]
shares = [0.6, 0.4]
C = 20.0
v_c = 1e-6
stribeck = { F_c = 2.0, F_s = 2.1, v_s = 1e-3 }

[rig]
kind = "record"

[record]
file = "rig.csv"
time = { column = "t", unit = "s" }
position = { column = "x", unit = "mm" }
force = { column = "F", unit = "N" }

[fit]
free = ["k"]
train = [0.0, 8.0]
test = [8.0, 12.0]
cycles = 2.0
search = "local"
"""

OPEN_LOOP = """\
title = "open loop"

[model]
kind = "GMS"
law = "signed"
k = [100.0, 50.0]
C = [0.1, 0.1]
v_c = 1e-6
stribeck = { F_c = 1.0, F_s = 1.5, v_s = 1e-3 }

[rig]
kind = "prescribed"
velocity = "0.1*sin(t)"

[run]
t_end = 1.0

[output]
figures = []
"""

MEASURED = """\
title = "measured"

[model]
kind = "GMS"
law = "signed"
k = [10000.0, 5000.0]
shares = [0.6, 0.4]
C = 20.0
v_c = 1e-4
stribeck = { F_c = 1.0, F_s = 1.5, v_s = 1e-3 }

[rig]
kind = "record"

[record]
file = "own.csv"
time = { column = "t", unit = "s" }
position = { column = "x", unit = "mm" }
force = { column = "F", unit = "N" }

[output]
figures = []
"""


def data_folder(file: str = PUBLIC_RECORD) -> Path:
    """Return the folder of the public records, or skip."""
    named = os.environ.get("GMS_FSM_DATA")
    for folder in ([Path(named)] if named else []) + [ROOT.parent / "shared" / "data"]:
        if (folder / file).is_file():
            return folder
    pytest.skip(f"{file} is neither in GMS_FSM_DATA nor in ../shared/data")


def table(columns: Iterable[str], *values: np.ndarray) -> str:
    """Return a CSV table."""
    rows = (",".join(repr(float(cell)) for cell in row) for row in zip(*values, strict=True))
    return "\n".join([",".join(columns), *rows]) + "\n"


def sine_table(rows: int = 60) -> str:
    """Return a valid record for MEASURED: time in s, position in mm, force in N."""
    t = np.round(np.arange(rows) * 0.01, 2)
    return table(["t", "x", "F"], t, np.sin(6 * t).round(6), np.cos(6 * t).round(4))


def read_table(path: Path, columns: Mapping[str, Column], where: str = "") -> Record:
    """Read the columns of a table, and no others."""
    none: dict[str, Any] = {"position": None, "force": None}
    return Record.from_csv(path, **none | dict(columns), where=where)


@dataclass(frozen=True)
class Answer:
    """The outcome of a command."""

    code: int
    out: str
    err: str

    @property
    def message(self) -> str:
        """The text after ``error:``."""
        return self.err.partition("error: ")[2]


CommandLine = Callable[..., Answer]


def command_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> CommandLine:
    """Return ``gms-fsm`` as a function of its arguments, run in this process."""
    monkeypatch.setenv("COLUMNS", "2000")  # a message on one line
    monkeypatch.delenv("GMS_FSM_DATA", raising=False)

    def call(*arguments: str | Path) -> Answer:
        monkeypatch.setattr(sys, "argv", ["gms-fsm", *map(str, arguments)])
        monkeypatch.setattr("warnings.showwarning", None)  # main() sets its own; restored later
        capsys.readouterr()
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        said = capsys.readouterr()
        return Answer(code, said.out, said.err)

    return call


def changed(text: str, old: str, new: str) -> str:
    """Return the text with `old` replaced; `old` must occur exactly once."""
    assert text.count(old) == 1, (text.count(old), old)
    return text.replace(old, new)


def one_message(answer: Answer, *said: str) -> None:
    """Assert a single message with exit code 2 that contains all the given texts."""
    assert answer.code == 2, (answer.code, answer.err)
    assert "Traceback" not in answer.out + answer.err
    assert answer.out == ""
    assert answer.err.count("error:") == 1, answer.err[:2000]
    for part in said:
        assert part in answer.message, f"{part!r} is not said in: {answer.message[:2000]}"
    assert "np.float64" not in answer.message, answer.message
    assert len(answer.message) < 2000, f"{len(answer.message)} characters are not one message"


def nothing_written(folder: Path, given: set[str]) -> None:
    """Assert that a folder contains only the given files, and at most an empty folder ``out``."""
    found = set(folder.rglob("*"))
    found -= {path for path in found if path.name == "out" and not list(path.iterdir())}
    assert {str(path.relative_to(folder)) for path in found} == given
