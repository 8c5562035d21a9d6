"""Claim: two tools step exported SCXML documents through the states of `simulate`.

python-statemachine (Python) and SCION (node) evaluate the conditions and the assignments; the host
only integrates the flows. SCION is installed into ``.foreign/node`` (110 MB) where there is npm;
``GMS_FSM_NODE`` names another folder.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import Prescribed, export, simulate
from tests.exporters.charts_to_export import MODELS, model
from tests.exporters.nested_charts import made, run_of, seen_by
from tests.exporters.scxml_host import PythonStateMachine, moved_by, run, switches_of
from tests.helpers import ROOT

Ran = Callable[..., None]
PACKAGE = "@scion-scxml/scxml@4.3.27"
NAMES = [name for name in MODELS if name != "backlash"]  # its guards read F
SWITCHING = {
    "gms-signed",
    "gms-published",
    "maxwell-slip",
    "elasto-plastic",
    "reset-integrator",
    "seven-parameter",
}
GENTLE = "0.0015 * sin(2 * pi * t / 5)"  # m/s: Euler's method is stable for all


def motion(name: str) -> tuple[str, float, float]:
    """Return velocity, end and step with which Euler's method shows the switches."""
    if name.startswith("gms"):
        return "0.15 * sin(2 * pi * t / 25)", 25.0, 0.05
    return GENTLE, 7.5, 5e-3


DRIVER = """
const scxml = require('@scion-scxml/scxml');
const text = require('fs').readFileSync(process.argv[2], 'utf8');
const fail = (error) => { if (error) { console.error(error); process.exit(1); } };
scxml.documentStringToModel('', text, (error, model) => {
  fail(error);
  model.prepare((failed, ready) => {
    fail(failed);
    const chart = new scxml.core.Statechart(ready);
    chart.start();
    // Not earlier: lines that come before somebody listens are lost.
    const lines = require('readline').createInterface({ input: process.stdin });
    lines.on('line', (line) => {
      chart.gen({ name: 'values', data: JSON.parse(line) });
      chart.gen({ name: 'step' });
      const [states, , , data] = chart.getSnapshot();
      console.log(JSON.stringify([states, data]));
    });
  });
});
"""


class Scion:
    """The package SCION in node, in a process of its own."""

    def __init__(self, path: Path, folder: Path) -> None:
        driver = folder / "drive.js"
        driver.write_text(DRIVER, encoding="utf-8")
        self.process = subprocess.Popen(
            ["node", str(driver), str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )

    def step(self, values: Mapping[str, float]) -> tuple[str, Mapping[str, Any]]:
        """Send ``values`` and ``step``; return the state, and the data model."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(dict(values)) + "\n")
        self.process.stdin.flush()
        (state,), data = json.loads(self.process.stdout.readline())
        return state, data

    def close(self) -> None:
        """End the process."""
        self.process.communicate(timeout=20)


def stepped(name: str, folder: Path, start: Callable[[Path], PythonStateMachine | Scion]) -> int:
    """Step the documents of a chart with a tool, and compare with `simulate`."""
    velocity, t_end, step = motion(name)
    how: Any = {"method": "euler", "step": step, "events": "step", "engine": "ifelse"}
    trace = simulate(model(name), Prescribed(velocity), t_end, **how)
    count = 0
    for element, path in enumerate(export(model(name), "scxml", folder, name="own")[:-1]):
        tool = start(path)
        try:
            mine = run(tool, model(name), element, moved_by(velocity), t_end, step)
        finally:
            tool.close()
        assert mine == switches_of(trace, element)
        assert len(mine) > 2 or name not in SWITCHING
        count += len(mine)
    return count


@pytest.fixture(scope="module")
def scion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with SCION."""
    folder = Path(os.environ.get("GMS_FSM_NODE", ROOT / ".foreign" / "node"))
    if shutil.which("node") is None or shutil.which("npm") is None:
        pytest.skip("SCION needs node and npm on PATH")
    if not (folder / "node_modules/@scion-scxml/scxml").is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        command = ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(folder), PACKAGE]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
        if done.returncode != 0:
            pytest.skip(f"npm could not install SCION: {done.stderr.strip()[-300:]}")
    return folder


def kept(tool: str, ran: Ran, folder: Path, start: Callable[[Path], Any]) -> None:
    """Step all charts with a tool, and keep its row."""
    count = sum(stepped(name, folder / name, start) for name in NAMES)
    what = f"{len(NAMES)} included charts stepped, all elements"
    ran("scxml", tool, what, f"{count} switches, all as in simulate with Euler's method")


def nested(
    tool: str, ran: Ran, folder: Path, start: Callable[[Path], PythonStateMachine | Scion], n: int
) -> None:
    """Step random charts with states in states, and keep the tool's row."""
    count = 0
    for seed in range(n):
        path, *_ = export(made(seed), "scxml", folder / str(seed), name="own")
        seen, trace = run_of(made(seed))
        machine = start(path)
        try:
            assert seen_by(machine, made(seed)) == seen, seed
        finally:
            machine.close()
        count += len(trace.transitions)
    what = f"{n} random charts of states in states stepped"
    ran("scxml", tool, what, f"{count} switches, all as in simulate, and every entry and exit")


def test_nested_states_in_python_statemachine(ran: Ran, tmp_path: Path) -> None:
    tool = f"python-statemachine {version('python-statemachine')}"
    nested(tool, ran, tmp_path, PythonStateMachine, 200)


def test_nested_states_in_scion(ran: Ran, scion: Path, tmp_path: Path) -> None:
    package = json.loads((scion / "node_modules/@scion-scxml/scxml/package.json").read_text())
    tool = f"SCION {package['version']} (node)"
    nested(tool, ran, tmp_path, lambda path: Scion(path, scion), 40)


def test_python_statemachine(ran: Ran, tmp_path: Path) -> None:
    tool = f"python-statemachine {version('python-statemachine')}"
    kept(tool, ran, tmp_path, PythonStateMachine)


def test_scion(ran: Ran, scion: Path, tmp_path: Path) -> None:
    package = json.loads((scion / "node_modules/@scion-scxml/scxml/package.json").read_text())
    tool = f"SCION {package['version']} (node)"
    kept(tool, ran, tmp_path, lambda path: Scion(path, scion))
