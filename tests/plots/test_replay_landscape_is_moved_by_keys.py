"""The dot of the landscape is moved by keys; Escape or another row puts it back."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plots.browser import SIZES, Open, browser, open_page, pages
from tests.plots.landscape_cases import opened

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("size", SIZES)
def test_arrow_keys_move_the_dot_and_not_the_row(
    open_page: Open, tmp_path: Path, size: str
) -> None:
    page = opened(open_page, tmp_path, "gms", size)
    for _ in range(3):
        page.keyboard.press("Shift+ArrowRight")
    frame = page.evaluate("frame")
    dot, answer = page.locator(".probe"), page.locator(".answer").first
    place, text = "views[0].open.right.placeOfDot()", dot.get_attribute("aria-valuetext")
    x, y = page.evaluate(place)
    dot.focus()
    assert answer.is_hidden()
    for key, moved in {
        "ArrowLeft": (-5, 0),
        "ArrowUp": (-5, -5),
        "Shift+ArrowDown": (-5, 25),
        "ArrowDown": (-5, 30),
    }.items():
        page.keyboard.press(key)
        assert page.evaluate(place) == pytest.approx([x + moved[0], y + moved[1]], abs=0.01)
        assert answer.is_visible()
        page.wait_for_timeout(50)  # the page may have another height now
        assert dot.get_attribute("aria-valuetext") != text
    assert page.evaluate("frame") == frame
    page.keyboard.press("Escape")
    assert page.evaluate(place) == [x, y]
    assert dot.get_attribute("aria-valuetext") == text
    assert answer.is_hidden()


def test_another_row_puts_the_dot_back(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "gms")
    page.locator(".probe").focus()
    page.keyboard.press("ArrowUp")
    assert page.locator(".probe.moved").count() == 1
    page.keyboard.press("End")
    assert page.locator(".probe.moved").count() == 0
    at_row = """() => {
        const { contact, element, row, open } = views[0], { plane } = open.right;
        const value = (name) => contact.value(name, element, row);
        return [plane.x(value("v")), plane.y(value("z"))];
    }"""
    assert page.evaluate("views[0].open.right.placeOfDot()") == page.evaluate(at_row)
