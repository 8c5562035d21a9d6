"""The file of docs/howto/add-a-model.md, put into the folder of charts, is known to every command.

Tested in a copy of the packages, in a separate process that answers one command after another; the
page itself is run by ``tests/docs/test_docs_are_true.py``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest

from gms_fsm import Sweep, Trace
from gms_fsm.charts import CHARTS
from tests.helpers import ROOT
from tests.package_copy import Copy, packages_with
from tests.page_blocks import blocks_of

pytestmark = pytest.mark.slow

PAGE = ROOT / "docs" / "howto" / "add-a-model.md"
FILES = {block.file: block.body for block in blocks_of(PAGE.read_text(encoding="utf-8"))}
SCENARIO = """
title = "yielding"

[model]
chart = "bilinear"
k = [100.0, 50.0]
H = 10.0
F_y = 1.0
sigma_2 = 0.5

[rig]
kind = "prescribed"
velocity = "0.1*sin(t)"

[run]
t_end = 10.0

[output]
figures = []
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Copy]:
    """A copy of the packages with one additional file, and a scenario next to it."""
    folder = tmp_path_factory.mktemp("copy")
    with packages_with(FILES["bilinear.py"], "bilinear.py", folder) as made:
        (made.folder / "x.toml").write_text(SCENARIO, encoding="utf-8")
        yield made


def test_the_mapping_of_charts_has_it(copy: Copy) -> None:
    assert "bilinear" not in CHARTS
    program = "from gms_fsm.charts import CHARTS; print(*CHARTS)"
    assert set(copy.python(program).split()) == {*CHARTS, "bilinear"}


def test_it_is_listed_drawn_printed_and_in_the_schema(copy: Copy) -> None:
    listed = copy.gms_fsm("chart", "--list")
    assert "bilinear: Bilinear hysteresis\n" in listed
    assert re.search(r"\n  F_y +yield force, N, > 0; one number per element\n", listed)
    copy.gms_fsm("chart", "bilinear", "-o", "bilinear.mmd")
    drawn = (copy.folder / "bilinear.mmd").read_text(encoding="utf-8")
    assert 'title: "Bilinear hysteresis"' in drawn
    assert copy.gms_fsm("code", "bilinear").startswith("# Bilinear hysteresis, prescribed")
    schema = json.loads(copy.gms_fsm("schema"))
    (table,) = (t for name, t in schema["$defs"].items() if name.endswith("bilinear"))
    assert table["properties"]["F_y"]["description"].startswith("yield force, N, > 0")


def test_check_proves_it_within_its_rules(copy: Copy) -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    report = copy.gms_fsm("check", "bilinear")
    assert "assumed: k > 0, H >= 0, F_y > 0\n" in report
    assert "0 refuted, 0 undecided" in report


def test_a_scenario_runs_it(copy: Copy) -> None:
    copy.gms_fsm("run", "x.toml", "-o", "out")
    trace = Trace.load(copy.folder / "out" / "trace.npz")
    edges = trace.transitions.edge.tolist()
    assert edges[:3] == ["yield_forward", "yield_forward", "unload_forward"]
    assert trace.model.chart.unit("F_y") == "N"
    summary = (copy.folder / "out" / "summary.md").read_text(encoding="utf-8")
    assert "k = [100, 50] N/m, H = 10 N/m, F_y = 1 N, sigma_2 = 0.5 Ns/m" in summary
    for setting, words in {
        "model.F_y=-1": "[model] F_y is -1.0; it must be > 0",
        "model.F_q=1": "unknown key; did you mean 'F_y'? valid here: chart, n, k, H, F_y, sigma_2",
    }.items():
        assert words in copy.gms_fsm("run", "x.toml", "-o", "none", "--set", setting, code=2)


def test_a_system_file_names_it(copy: Copy) -> None:
    text = FILES["pulled.toml"].replace('"bilinear.toml"', '"bilinear"')
    (copy.folder / "pulled.toml").write_text(text, encoding="utf-8")
    copy.gms_fsm("run", "pulled.toml", "-o", "pulled")
    (record,) = Trace.load(copy.folder / "pulled" / "trace.npz").transitions
    assert record.edge == "yield_forward"
    assert record.F_after == pytest.approx(1.0, rel=1e-6)


def test_sweep_varies_it(copy: Copy) -> None:
    wanted = ("--over", "F_y=0.5:2:3", "--over", "sigma_2=0:1:2", "--engine", "machines")
    copy.gms_fsm("sweep", "x.toml", *wanted, "-o", "swept")
    found = Sweep.load(copy.folder / "swept" / "sweep.npz")
    assert found.parameters["F_y"].tolist() == [0.5, 0.5, 1.25, 1.25, 2.0, 2.0]
    assert found.outcome.tolist() == ["ok"] * 6
    said = copy.gms_fsm("sweep", "x.toml", "--over", "F_c=1:2:2", code=2)
    assert "there are k, H, F_y, sigma_2\n" in said


def test_debug_steps_through_it(copy: Copy) -> None:
    told = copy.gms_fsm("debug", "x.toml", said="next\nstep\nwhy 1\nquit\n")
    assert "element 1: elastic -> forward by yield_forward" in told
    assert "unload_forward does not fire: v < 0 is false by 49.2 mm/s" in told


@pytest.mark.matrix
def test_the_zoo_makes_its_page(copy: Copy) -> None:
    pytest.importorskip("pygraphviz", reason="the pages have pictures")
    pytest.importorskip("z3", reason="the pages have proofs")
    page = copy.python(
        "import runpy; zoo = runpy.run_path('docs/make_zoo.py'); "
        "(item,) = [each for each in zoo['items']() if each.name == 'bilinear']; "
        "print(zoo['page'](item, zoo['prove'](item.chart)))"
    )
    assert page.startswith("# Bilinear hysteresis\n")
    assert "| `F_y` | N | `> 0` | yield force | 1 |" in page
    assert "33 proved, 0 settled by order, 0 refuted, 0 undecided" in page
    assert "- T. Kalmár-Nagy, A. Shekhawat" in page
