"""A copy of the packages with one additional chart file, and a process that runs its commands."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.helpers import ROOT

ANSWER = """
import contextlib, io, json, sys
import gms_fsm
from gms_fsm.app.cli import main
print(json.dumps(gms_fsm.__file__), flush=True)
for line in sys.stdin:
    sys.argv[1:], said = json.loads(line)
    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        sys.stdin = io.StringIO(said)
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    print(json.dumps([code, out.getvalue(), err.getvalue()]), flush=True)
"""


@dataclass(frozen=True)
class Copy:
    """A copy of the packages with one additional file, and a process that runs it."""

    folder: Path
    process: subprocess.Popen[str]

    def read(self) -> Any:
        assert self.process.stdout is not None
        return json.loads(self.process.stdout.readline())

    def gms_fsm(self, *arguments: str, said: str = "", code: int = 0) -> str:
        """Run a command and return its output; `said` is its standard input."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([arguments, said]) + "\n")
        self.process.stdin.flush()
        ended, out, err = self.read()
        assert ended == code, out + err
        return out if code == 0 else err

    def python(self, program: str) -> str:
        """Run a program in another process, and return its output."""
        done = subprocess.run(
            [sys.executable, "-c", program],
            cwd=self.folder,
            env=_environment(self.folder),
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout


@contextlib.contextmanager
def packages_with(text: str, name: str, folder: Path) -> Iterator[Copy]:
    """Copy the packages and the script of the zoo to a folder, with one additional chart file."""
    skip = shutil.ignore_patterns("__pycache__")
    for package in ("gms_fsm", "integrators", "plots"):
        shutil.copytree(ROOT / package, folder / package, ignore=skip)
    (folder / "docs").mkdir()
    shutil.copy(ROOT / "docs" / "make_zoo.py", folder / "docs")
    (folder / "gms_fsm" / "charts" / name).write_text(text, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, "-c", ANSWER],
        cwd=folder,
        env=_environment(folder),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        made = Copy(folder, process)
        assert Path(made.read()).parent == folder / "gms_fsm", "the copy is what runs"
        yield made
        assert process.stdin is not None
        process.stdin.close()


def _environment(folder: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200"}
