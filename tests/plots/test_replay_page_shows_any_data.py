"""The page shows any text and any number as text, and works in the sandbox of a notebook."""

from __future__ import annotations

import html
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.systems.models import ChartModel
from plots.replay import replay, write_replay
from tests.plots.browser import Open, browser, expect, fig4, frame, open_page, pages

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


def test_a_hostile_name_is_shown_and_not_run(open_page: Open, tmp_path: Path) -> None:
    evil = "</script><script>document.title='owned'</script><img src=x onerror=alert(1)>"
    chart = Chart(
        name=evil,
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("only", flow={"z": "v"}),),
        transitions=(),
        outputs={"F": "k * z"},
    )
    model = ChartModel(chart, {"k": 1.0}, n=2, stribeck=Stribeck(1, 1.5, 0.1))
    trace = simulate(model, Prescribed("0.1"), 1.0)
    page = open_page(write_replay(tmp_path / "evil.html", trace, title=evil))
    assert page.title() == evil
    assert page.locator("h1").inner_text() == evil
    assert evil in page.locator(".head h2").inner_text()
    assert page.locator("img").count() == 0


def test_values_that_are_not_numbers_are_shown_as_words(open_page: Open, tmp_path: Path) -> None:
    trace = fig4("signed")
    stored = {name: np.array(values) for name, values in trace.seen.items()}
    stored["friction.F"][:3] = math.nan, math.inf, -math.inf
    stored["friction.v"][0] = math.nan
    page = open_page(write_replay(tmp_path / "nan.html", replace(trace, stored=stored)))
    texts = []
    for _ in range(3):
        texts.append(page.locator(".values").inner_text())
        if not texts[1:]:
            cells = page.locator("tbody tr").nth(1).locator("td").all_inner_texts()
            assert cells[1:4] == ["✗ false", "not a number m/s", "not a number m/s"]
        page.keyboard.press("ArrowRight")
    assert [text.split(" N  ")[0] for text in texts] == [
        "F = not a number",
        "F = infinite",
        "F = −infinite",
    ]
    page.fill("#until", "F < 0")
    page.press("#until", "Enter")
    assert frame(page) > 2


def test_the_sandboxed_frame_of_a_notebook_works(open_page: Open, tmp_path: Path) -> None:
    path = tmp_path / "notebook.html"
    path.write_text(f"<!DOCTYPE html><title>n</title>{replay(fig4('signed'))._repr_html_()}")
    page = open_page(path)
    inside = page.frame_locator("iframe")
    inside.locator("#transition").click()
    expect(inside.locator(".guard.fired")).to_have_count(1)
    assert html.escape("sandbox") in page.content()
