"""Everybody can use the page: on every screen, by keyboard, without faults that axe finds."""

from __future__ import annotations

import pytest

from tests.helpers import matrix
from tests.plots.browser import SIZES, Axe, Open, browser, open_page, pages

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


EVERY = [(n, s, c) for n in ("one", "two") for s in SIZES for c in ("light", "dark")]
EACH_ONCE = [  # every size, and both pages and schemes twice
    ("two", "laptop", "light"),
    ("one", "phone", "dark"),
    ("two", "tablet", "dark"),
    ("one", "desk", "light"),
]


@pytest.mark.parametrize(("name", "size", "scheme"), matrix(EVERY, EACH_ONCE))
def test_axe_finds_no_accessibility_problem(
    open_page: Open, name: str, size: str, scheme: str
) -> None:
    page = open_page(name, size, color_scheme=scheme)
    page.locator(".guard").first.click()
    if size == "phone":
        page.click("#more")
    for _ in range(5):
        page.keyboard.press("Shift+ArrowRight")
    tabs = page.locator(".run").first.get_by_role("tab")
    for tab in tabs.all() if size in ("laptop", "phone") else [tabs.first]:
        tab.click()
        found = Axe().run(page).response["violations"]
        assert [(v["id"], [n["target"] for n in v["nodes"]][:3]) for v in found] == []
    page.keyboard.press("?")
    found = Axe().run(page).response["violations"]
    assert [(v["id"], [n["target"] for n in v["nodes"]][:3]) for v in found] == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ["one", "two"])
def test_nothing_is_wider_than_the_screen(open_page: Open, name: str, size: str) -> None:
    page = open_page(name, size)
    for tab in range(page.locator(".run").first.get_by_role("tab").count()):
        page.locator(".run").first.get_by_role("tab").nth(tab).click()
        assert page.evaluate("document.documentElement.scrollWidth") <= SIZES[size][0]
        if size in ("laptop", "desk"):  # everything on one screen
            assert page.evaluate("document.documentElement.scrollHeight") <= SIZES[size][1]


def test_the_controls_are_one_row_on_a_laptop(open_page: Open) -> None:
    page = open_page("two", "laptop")
    middles = page.evaluate(
        """() => [...document.querySelectorAll("#controls :is(button, select, input)")]
            .map((node) => node.getBoundingClientRect()).filter(({ width }) => width > 0)
            .map(({ top, bottom }) => (top + bottom) / 2)"""
    )
    assert len(middles) > 15
    assert max(middles) - min(middles) < 8


def test_a_phone_shows_the_chosen_element_large_enough_to_be_read(open_page: Open) -> None:
    page = open_page(size="phone")
    page.locator(".token").nth(2).click()
    region, chart = (page.locator(q).bounding_box() for q in ("#element3 .frame", ".chart.pane"))
    assert region is not None
    assert chart is not None
    assert region["height"] > 0.9 * chart["height"]


def test_every_control_is_reached_by_tab_and_shows_its_focus(open_page: Open) -> None:
    page = open_page()
    seen = set()
    for _ in range(80):
        page.keyboard.press("Tab")
        name, line, ground = page.evaluate(
            """() => {
                const node = document.activeElement, ground = node.querySelector?.(".ground");
                return [
                    node.id || node.className || node.tagName,
                    getComputedStyle(node).outlineStyle,
                    ground ? getComputedStyle(ground).strokeWidth : "",
                ];
            }"""
        )
        name = name if isinstance(name, str) else name["baseVal"]
        seen.add(name)
        if name != "BODY":
            assert line == "solid" or ground == "3px", name
    controls = {
        "start",
        "back-transition",
        "back",
        "play",
        "step",
        "transition",
        "continue",
        "until",
        "speed",
        "zoom-out",
        "zoom-in",
        "zoom-all",
        "scrubber",
        "scale",
        "follow",
        "help",
        "token",
        "run1-chart-tab",
        "run1-time-tab",
        "element4-guard-arrest",
        "ribbons",
        "why",
    }
    assert controls <= seen
