"""Claim: exported transitions files run by themselves and take the switches of `simulate`."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gms_fsm import Prescribed, export, simulate
from tests.exporters.charts_to_export import MODELS, SLOW, imported, model, rebuilt

ASK = f"""
import json, math, sys
import own
def record(t):
    return {{"v": {SLOW.replace("sin", "math.sin").replace("pi", "math.pi")}}}
rows = own.run(record, 7.5, 1e-3)
log = [(t.hex(), i, edge) for t, _, _, _, edges in rows for i, edge in enumerate(edges) if edge]
print(json.dumps(log))
print(sorted({{name.partition(".")[0] for name in sys.modules}} & {{"numpy", "gms_fsm"}}))
"""


def test_in_a_process_of_their_own(ran: Callable[..., None], tmp_path: Path) -> None:
    count = 0
    how: Any = {"method": "euler", "step": 1e-3, "events": "step", "engine": "ifelse"}
    for name in MODELS:
        folder = tmp_path / name
        path, *_ = export(model(name), "transitions", folder, name="own")
        command = [sys.executable, "-c", ASK]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
        assert done.returncode == 0, done.stderr
        log, modules = done.stdout.splitlines()
        assert modules == "[]"
        trace = simulate(model(name), Prescribed(SLOW), 7.5, **how)
        its = [[float(e.t).hex(), int(e.element), str(e.edge)] for e in trace.transitions]
        assert json.loads(log) == its
        file = imported(path)
        assert rebuilt(file, file.machine_of([])) == model(name).chart
        count += len(its)
    ran(
        "transitions",
        f"transitions {version('transitions')}",
        f"{len(MODELS)} included charts run by themselves, and imported",
        f"{count} switches equal to the bit; the charts imported are equal",
    )
