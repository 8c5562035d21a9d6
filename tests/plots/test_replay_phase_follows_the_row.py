"""The dots of the phase views are at the values of the row, and a click goes to the nearest row."""

from __future__ import annotations

import pytest

from tests.plots.browser import Open, browser, mass, open_page, open_tab, pages

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow

# Values at the two dots, and those at the row.
DOTS = """() => views[0].open.right.plots.map(({ dot, plane, name }) => [
    plane.acrossAt(Number(dot.getAttribute("cx"))), plane.upAt(Number(dot.getAttribute("cy"))),
    views[0].contact.value(name, 0, views[0].row), views[0].contact.value("F", 0, views[0].row),
])"""


def test_the_dots_are_at_the_values_of_the_row(open_page: Open) -> None:
    page = open_page("mass", "laptop")
    open_tab(page, "Phase")
    for _ in range(10):
        page.keyboard.press("Shift+ArrowRight")
        for across, up, value, force in page.evaluate(DOTS):
            assert across == pytest.approx(value, abs=0.01)
            assert up == pytest.approx(force, abs=0.01)


def test_a_click_goes_to_the_nearest_row(open_page: Open) -> None:
    page, trace = open_page("mass", "laptop"), mass()
    open_tab(page, "Phase")
    box = page.locator(".phase .plane .ground").nth(1).bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] - 5, box["y"] + box["height"] / 2)  # fastest
    v = page.evaluate("views[0].contact.value('v', 0, views[0].row)")
    assert v == pytest.approx(float(trace.v.max()), rel=0.2)


def test_each_number_of_slipping_elements_has_its_own_look(open_page: Open) -> None:
    page, trace = open_page("mass", "laptop"), mass()
    open_tab(page, "Phase")
    assert set((trace.modes != 0).sum(axis=1).tolist()) == {0, 1, 2, 3, 4}
    looks = page.evaluate(
        """() => views[0].open.right.plots[0].paths.filter((path) => path.getAttribute("d"))
            .map((path) => getComputedStyle(path))
            .map((look) => [look.stroke, look.strokeWidth, look.strokeDasharray])"""
    )
    assert len(looks) == 5
    for look in zip(*looks, strict=True):
        assert len(set(look)) >= 4  # by colour, by width and by dash
