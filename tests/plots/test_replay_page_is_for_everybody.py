"""Everybody can use the page, whatever the data: screens, keyboard, axe; hostile texts, NaN."""

from __future__ import annotations

import html
from pathlib import Path

import pytest

from plots.page.replay import replay
from tests.helpers import matrix
from tests.plots.browser import (
    EVIL,
    SIZES,
    Open,
    box_of,
    browser,
    faults,
    frame,
    open_page,
    press,
    run,
    until,
)

__all__ = ["browser", "open_page"]

pytestmark = pytest.mark.slow

EVERY = [(n, s, c) for n in ("published", "two", "many") for s in SIZES for c in ("light", "dark")]
EACH_ONCE = [
    ("two", "laptop", "light"),
    ("published", "phone", "dark"),
    ("many", "tablet", "dark"),
]


@pytest.mark.parametrize(("name", "size", "scheme"), matrix(EVERY, EACH_ONCE))
def test_axe_finds_nothing_and_nothing_is_wider_than_the_screen(
    open_page: Open, name: str, size: str, scheme: str
) -> None:
    page = open_page(name, size, color_scheme=scheme)
    page.locator(".guard").first.click()
    if size == "phone":
        page.click("#more")
    press(page, *["Shift+ArrowRight"] * 5)
    for tab in page.locator(".run").first.get_by_role("tab").all():
        tab.click()
        width, height = page.evaluate(
            "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
        )
        assert width <= SIZES[size][0]
        # Everything is on one screen.
        assert height <= SIZES[size][1] or size in ("tablet", "phone")
        if size == "laptop" or (name == "many" and tab.inner_text() in ("Bristles", "Microscope")):
            assert faults(page, context=f"#{tab.get_attribute('aria-controls')}") == []
    assert faults(page) == []
    press(page, "?")
    assert faults(page, context="dialog[open]") == []
    press(page, "Escape")
    if size == "laptop":  # the controls are one row
        middles = page.evaluate(
            """() => [...document.querySelectorAll("#controls :is(button, select, input)")]
                .map((node) => node.getBoundingClientRect()).filter(({ width }) => width > 0)
                .map(({ top, bottom }) => (top + bottom) / 2)"""
        )
        assert len(middles) > 15
        assert max(middles) - min(middles) < 8


def test_a_phone_shows_the_chosen_element_large_enough_to_be_read(open_page: Open) -> None:
    page = open_page("published", "phone")
    page.locator(".token").nth(2).click()
    chart = box_of(page, ".chart.pane")
    assert box_of(page, "#element3 .frame")["height"] > 0.9 * chart["height"]


FOCUSED = """() => {
    const node = document.activeElement, ground = node.querySelector?.(".ground");
    return [
        node.id || node.className?.baseVal || node.className || node.tagName,
        getComputedStyle(node).outlineStyle, ground ? getComputedStyle(ground).strokeWidth : "",
    ];
}"""
CONTROLS = """start back-transition back play step transition continue until speed zoom-out zoom-in
    zoom-all scrubber scale follow help token run1-chart-tab run1-time-tab element4-guard-arrest
    ribbons why"""


def test_every_control_is_reached_by_tab_and_shows_its_focus(open_page: Open) -> None:
    page, seen = open_page("published"), set()
    assert page.locator(".time-unit").inner_text() == "t [s]"
    for _ in range(80):
        press(page, "Tab")
        name, line, ground = page.evaluate(FOCUSED)
        seen.add(name)
        assert name == "BODY" or line == "solid" or ground == "3px", name
    assert set(CONTROLS.split()) <= seen


# --------------------------------------------------------------------------- any data
def test_a_hostile_name_is_shown_and_not_run(open_page: Open) -> None:
    page = open_page("evil")
    assert page.title() == EVIL
    assert page.locator("h1").inner_text() == EVIL
    assert EVIL in page.locator(".head h2").inner_text()
    assert page.locator("img").count() == 0


def test_values_that_are_not_numbers_are_words_and_left_out_of_views(open_page: Open) -> None:
    page, texts = open_page("no numbers"), []
    for _ in range(3):
        texts.append(page.locator(".values").inner_text())
        if not texts[1:]:
            cells = page.locator("tbody tr").nth(1).locator("td").all_inner_texts()
            assert cells[1:4] == ["✗ false", "not a number m/s", "not a number m/s"]
        press(page, "ArrowRight")
    words = ["not a number", "infinite", "−infinite"]
    assert [text.split(" N  ")[0] for text in texts] == [f"F = {word}" for word in words]
    until(page, "F < 0")
    assert frame(page) > 2
    for key in ("phase", "landscape", "microscope"):  # a drawing with NaN is a console message
        page.evaluate(f"openPane('right', '{key}')")
        for row in (30, 55, 70):
            page.evaluate(f"go({row})")
            if key == "landscape":
                seen = page.locator(".probe").get_attribute("visibility") != "hidden"
                assert seen == (row != 55)


@pytest.mark.parametrize(
    ("name", "scale", "unit"), [("microseconds", 1e-6, "µs"), ("megaseconds", 1e6, "Ms")]
)
def test_the_time_axis_has_its_unit(open_page: Open, name: str, scale: float, unit: str) -> None:
    page = open_page(name)
    assert page.locator(".time-unit").inner_text() == f"t [{unit}]"
    assert page.evaluate("10 ** TIME_POWER") == pytest.approx(scale)


def test_the_sandboxed_frame_of_a_notebook_works(open_page: Open, tmp_path: Path) -> None:
    path = tmp_path / "notebook.html"
    path.write_text(f"<!DOCTYPE html><title>n</title>{replay(run('signed'))._repr_html_()}")
    page = open_page(path)
    inside = page.frame_locator("iframe")
    inside.locator("#transition").click()
    inside.locator(".guard.fired").wait_for()
    assert inside.locator(".guard.fired").count() == 1
    assert html.escape("sandbox") in page.content()
