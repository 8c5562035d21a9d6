"""Help needs none of the libraries that compute, read scenario files or draw.

Checked by module names and not by time: `gms-fsm --help` takes as long as its imports.
"""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.helpers import ROOT

HEAVY = {"numpy", "scipy", "transitions", "matplotlib", "pydantic", "graphviz", "llvmlite", "plots"}
CODE = """
import contextlib, io, json, sys
sys.argv[1:] = json.loads(sys.argv[1])
from gms_fsm.app.cli import main
said = io.StringIO()
with contextlib.suppress(SystemExit), contextlib.redirect_stdout(said):
    main()
print(json.dumps([said.getvalue(), sorted({name.partition(".")[0] for name in sys.modules})]))
"""


def loaded(*arguments: str) -> tuple[str, set[str]]:
    """Return the output of a command, and the packages that it has imported."""
    done = subprocess.run(
        [sys.executable, "-c", CODE, json.dumps(arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    said, names = json.loads(done.stdout)
    return said, set(names)


def test_help_lists_every_verb_and_imports_nothing_heavy() -> None:
    said, names = loaded("--help")
    for verb in ("paper", "run", "phenomena", "chart", "check", "animate", "replay", "debug"):
        assert f" {verb} " in said
    assert names & HEAVY == set()


@pytest.mark.slow
def test_imports_of_a_verb_are_detected() -> None:
    _, names = loaded("code", "--law", "signed")
    assert "numpy" in names
