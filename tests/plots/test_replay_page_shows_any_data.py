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

LINEAR = ChartModel(
    Chart(
        "spring",
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("only", flow={"z": "v"}),),
        transitions=(),
        outputs={"F": "k * z"},
    ),
    {"k": 1.0},
)


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


def test_views_leave_out_values_that_are_not_numbers(open_page: Open, tmp_path: Path) -> None:
    trace = fig4("signed")
    stored = {name: np.array(values) for name, values in trace.seen.items()}
    stored["friction.F"][20:40] = math.inf
    stored["friction.v"][50:60] = math.nan
    page = open_page(write_replay(tmp_path / "gaps.html", replace(trace, stored=stored)))
    for key in ("phase", "landscape", "microscope"):  # a drawing with NaN is a console message
        page.evaluate(f"openPane('right', '{key}')")
        for row in (30, 55, 70):
            page.evaluate(f"go({row})")
            if key == "landscape":
                seen = page.locator(".probe").get_attribute("visibility") != "hidden"
                assert seen == (row != 55)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "s"), (1e-6, "µs"), (1e6, "Ms")])
def test_the_time_axis_has_its_unit(
    open_page: Open, tmp_path: Path, scale: float, unit: str
) -> None:
    rig = Prescribed(f"{1e-3 / scale!r} * sin(t / {scale!r})")
    trace = simulate(LINEAR, rig, scale)
    page = open_page(write_replay(tmp_path / "page.html", trace))
    assert page.locator(".time-unit").inner_text() == f"t [{unit}]"
    assert page.evaluate("10 ** TIME_POWER") == pytest.approx(scale)


def test_the_sandboxed_frame_of_a_notebook_works(open_page: Open, tmp_path: Path) -> None:
    path = tmp_path / "notebook.html"
    path.write_text(f"<!DOCTYPE html><title>n</title>{replay(fig4('signed'))._repr_html_()}")
    page = open_page(path)
    inside = page.frame_locator("iframe")
    inside.locator("#transition").click()
    expect(inside.locator(".guard.fired")).to_have_count(1)
    assert html.escape("sandbox") in page.content()
