"""The file of docs/howto/add-a-model.md, put into the folder of charts, is known everywhere.

Tested in a copy of the packages; the page itself is run by ``tests/docs/test_docs_are_true.py``.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from gms_fsm import Trace
from gms_fsm.charts import CHARTS
from tests.helpers import ROOT
from tests.package_copy import Copy, packages_with
from tests.page_blocks import blocks_of

pytestmark = pytest.mark.slow

PAGE = ROOT / "docs" / "howto" / "add-a-model.md"
FILES = {block.file: block.body for block in blocks_of(PAGE.read_text(encoding="utf-8"))}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Copy]:
    folder = tmp_path_factory.mktemp("copy")
    with packages_with(FILES["bilinear.py"], "bilinear.py", folder) as made:
        yield made


def test_the_mapping_of_charts_has_it(copy: Copy) -> None:
    assert "bilinear" not in CHARTS
    program = "from gms_fsm.charts import CHARTS; print(*CHARTS)"
    assert set(copy.python(program).split()) == {*CHARTS, "bilinear"}


def test_the_command_line_lists_draws_and_prints_it(copy: Copy) -> None:
    assert "bilinear: Bilinear hysteresis\n" in copy.gms_fsm("chart", "--list")
    copy.gms_fsm("chart", "bilinear", "-o", "bilinear.mmd")
    drawn = (copy.folder / "bilinear.mmd").read_text(encoding="utf-8")
    assert 'title: "Bilinear hysteresis"' in drawn
    assert copy.gms_fsm("code", "bilinear").startswith("# Bilinear hysteresis, prescribed")


def test_check_proves_it(copy: Copy) -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    assert "0 refuted, 0 undecided" in copy.gms_fsm("check", "bilinear")


def test_a_system_file_names_it(copy: Copy) -> None:
    text = FILES["pulled.toml"].replace('"bilinear.toml"', '"bilinear"')
    (copy.folder / "pulled.toml").write_text(text, encoding="utf-8")
    copy.gms_fsm("run", "pulled.toml", "-o", "out")
    (record,) = Trace.load(copy.folder / "out" / "trace.npz").transitions
    assert record.edge == "yield_forward"
    assert record.F_after == pytest.approx(1.0, rel=1e-6)


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
