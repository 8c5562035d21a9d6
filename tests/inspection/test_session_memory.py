"""A session of 100,000 rows keeps the whole process under 200 MB."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.helpers import ROOT

LONG = """
import resource, sys
from pathlib import Path
from gms_fsm import GMS, GMSParameters, Prescribed
from gms_fsm.session.session import Session
session = Session(GMS(GMSParameters.paper("stick-slip"), law="signed"),
                  Prescribed("0.15*sin(2*pi*t/25)"), 100.0, method="rk4", step=1e-3,
                  engine="ifelse")
session.goto(100.0)
session.goto(50.0)
session.poke({"z": {0: 0.1}})
assert len(session.branches[0]) > 100_000, len(session.branches[0])
status = Path("/proc/self/status")
if status.exists():  # there ru_maxrss begins with the parent's memory
    print(next(int(line.split()[1]) for line in status.open() if "VmHWM" in line) / 1e3)
else:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(peak / (1e6 if sys.platform == "darwin" else 1e3))  # bytes there, kB elsewhere
"""


@pytest.mark.slow
def test_a_long_session_is_small() -> None:
    pytest.importorskip("resource")
    done = subprocess.run(
        [sys.executable, "-c", LONG],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert float(done.stdout) < 200.0
