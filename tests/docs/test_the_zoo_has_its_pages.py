"""The pages in docs/zoo and the table of phenomena are what the scripts make from the charts."""

from __future__ import annotations

import re
import runpy
from collections.abc import Iterator
from typing import Any

import pytest

from gms_fsm import measure_phenomena
from gms_fsm.charts import CHARTS
from tests.helpers import ROOT

PAGES = ROOT / "docs" / "zoo"


def test_each_chart_has_a_page_and_pictures() -> None:
    """A missing page is made by ``make gallery``, or by ``python docs/make_zoo.py`` alone."""
    assert {path.stem for path in PAGES.glob("*.md")} == {*CHARTS, "index"}
    pictures = {path.stem for path in (ROOT / "docs/images/zoo").glob("*.png")}
    assert pictures == {*CHARTS} | {f"{name}_run" for name in CHARTS}


def test_a_page_says_what_the_model_shows_and_where_it_is_published() -> None:
    heads = ["What it shows", "Equations", "Parameters", "Run it", "Proofs", "References"]
    for name in CHARTS:
        text = (PAGES / f"{name}.md").read_text(encoding="utf-8")
        parts = re.findall(r"^## (.+)\n\n(.+)", text, re.MULTILINE)
        assert [head for head, _ in parts] == heads, name
        assert dict(parts)["References"].startswith("- "), name


@pytest.mark.slow
def test_the_pages_are_what_the_script_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The runs are those of test_docs_are_true.py, which runs each page; here one is run."""
    for module in ("matplotlib", "pygraphviz", "z3"):
        pytest.importorskip(module, reason="the pages have pictures and proofs")
    script = runpy.run_path(str(ROOT / "docs" / "make_zoo.py"))
    pages = script["pages"]

    def example(item: Any) -> Iterator[str]:
        text = (PAGES / f"{item.name}.md").read_text(encoding="utf-8")
        part = text.partition("## Run it\n\n")[2].partition("\n\n## Proofs")[0]
        driven = re.search(r'^velocity = "(.+)"', part, re.MULTILINE)
        file = script["system_file"](item, driven[1] if driven else "")
        assert f"```toml\n{file}```" in part, item.name
        yield from script["example"](item) if item.name == "lugre" else [part]

    monkeypatch.setitem(pages.__globals__, "example", example)
    for name, text in pages().items():
        assert (PAGES / name).read_text(encoding="utf-8") == text, f"{name}: run make gallery"


def test_less_than_a_tenth_of_all_findings_is_undecided() -> None:
    """The committed reports; the test above holds them to the charts."""
    total = undecided = 0
    for name in CHARTS:
        text = (PAGES / f"{name}.md").read_text(encoding="utf-8")
        counts = re.search(
            r"(\d+) proved, (\d+) settled by order, (\d+) refuted, (\d+) undecided", text
        )
        assert counts, name
        total += sum(map(int, counts.groups()))
        undecided += int(counts[4])
        reasons = text.count("- **undecided**")
        assert reasons == int(counts[4]), f"{name}: each undecided finding gives its reason"
    assert undecided < 0.1 * total


# --------------------------------------------------------------------------- phenomena
TABLE = (ROOT / "docs" / "howto" / "phenomena_table.txt").read_text(encoding="utf-8")
AGAIN = "run docs/make_phenomena.py (make gallery)"


def test_every_chart_is_in_it() -> None:
    missing = [
        name for name in CHARTS if f"| {name} |" not in TABLE and f"- {name} does not" not in TABLE
    ]
    assert missing == [], AGAIN


@pytest.mark.matrix
@pytest.mark.slow
def test_three_models_measured_again() -> None:
    fresh = measure_phenomena(["lugre", "gms-signed", "stiction"]).markdown().splitlines()
    assert [line for line in fresh if line not in TABLE.splitlines()] == [], AGAIN
