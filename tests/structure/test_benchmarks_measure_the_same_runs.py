"""The C loops of the benchmarks compute what gms-fsm computes, and the tables have their places."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys

import pytest

from tests.helpers import FASTEST, ROOT, matrix

FOLDER = ROOT / "benchmarks"
AGREE = """
import json, sys, tempfile
from pathlib import Path
import numpy as np
from cases import PROBLEMS
from compare import c_loop, ours
engine = sys.argv[1]
for name in sys.argv[2:]:
    one = PROBLEMS[name]
    times = np.linspace(0.0, one.t_end, 101)
    with tempfile.TemporaryDirectory() as folder:
        loop = c_loop(one, Path(folder))
        rows, end = loop(times), loop(np.empty(0))
    exact = ours(one, t_eval=times, engine=engine, rtol=1e-12, atol=1e-15)
    coarse = ours(one, t_eval=times, engine=engine)
    def taken(outcome, i):
        mine = outcome.element == i
        return [outcome.edge[k] for k in np.flatnonzero(mine)], outcome.t[mine]
    late, same = 0.0, True
    for i in np.unique(exact.element):
        (edges, t), (true, t_true) = taken(rows, i), taken(exact, i)
        same = same and edges == true
        late = max(late, float(np.abs(t - t_true).max())) if edges == true else late
    def far(outcome, rows=slice(None)):
        return float(np.abs(outcome.z - exact.z[rows]).max())
    print(json.dumps([len(exact.t), one.transitions, same, late / one.t_end, far(rows), far(coarse),
                      far(end, slice(-1, None))]))
"""


@pytest.mark.slow
@pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="needs a C compiler on Linux"
)
@pytest.mark.parametrize("name", matrix(["pulled", "open", "servo", "stiction"], ["pulled"]))
def test_the_c_loops_agree(name: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", AGREE, FASTEST, name],
        cwd=FOLDER,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    count, told, same, late, error, ours, at_end = json.loads(done.stdout)
    assert count == told
    assert same  # for each element the same edges in the same order
    assert late < 1e-6
    assert max(error, at_end) < 3 * ours  # of gms-fsm at the same rtol


PLACE = "<!-- measured table: begin; made by `python benchmarks/{}.py --write` -->\n"


@pytest.mark.parametrize(
    ("page", "script", "row"),
    [
        ("docs/performance.md", "compare", "| C loop, hand-written for this model "),
        ("docs/numerics.md", "compare", "| C loop, hand-written for this model "),
        ("docs/howto/own-loops.md", "own_loops", "| MuJoCo, Euler  "),
    ],
)
def test_pages_have_a_place_for_the_tables(page: str, script: str, row: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    _, place, rest = text.partition(PLACE.format(script))
    between, end, _ = rest.partition("<!-- measured table: end -->")
    assert place
    assert end
    assert between.count(row) == 1


@pytest.mark.matrix
def test_the_page_of_loops_has_the_tables_measured() -> None:
    text = (ROOT / "docs/howto/own-loops.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (.*?) +\| +(\d+) \| +(\d+) \| .* mm \|", text, re.MULTILINE)
    code = (
        "import json; from own_loops import HOSTS, LOOPS; logs = {name: [] for name in LOOPS}; "
        "[loop(1e-3, logs[name]) for name, loop in LOOPS.items()]; "
        "logs['MuJoCo, Euler'] = HOSTS['MuJoCo, Euler'](1e-3)[1]; print(json.dumps(logs))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=FOLDER, capture_output=True, text=True, check=True
    )
    logs = json.loads(done.stdout.splitlines()[-1])
    shown = {name: int(count) for name, count, _ in rows}
    assert {name: shown[name] for name in logs} == {name: len(log) for name, log in logs.items()}
    assert [int(right) == 72 for _, _, right in rows] == [False, False, *[True] * 7]


@pytest.mark.slow
def test_the_regressions_are_those_of_all_cases() -> None:
    code = "import regressions.runs as r; print(len(r.Runs.params[0]))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=FOLDER, capture_output=True, text=True, check=True
    )
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert len(re.findall(r"^\| .* transitions \| `c_", readme, re.MULTILINE)) == int(done.stdout)
