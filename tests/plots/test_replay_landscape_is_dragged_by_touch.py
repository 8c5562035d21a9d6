"""On a phone a finger drags the dot of the landscape, and the page does not scroll."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plots.browser import Open, browser, open_page, pages
from tests.plots.landscape_cases import opened

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


def test_a_finger_drags_the_dot(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "gms", "phone", has_touch=True, is_mobile=True)
    page.evaluate("document.querySelector('.right').scrollIntoView()")
    scrolled = page.evaluate("scrollY")

    def place() -> tuple[float, float]:
        box = page.locator(".probe .here").bounding_box()
        assert box is not None
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    x, y = place()
    finger = page.context.new_cdp_session(page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        found = [{"x": x, "y": y} for x, y in points]
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": found})

    touch("touchStart", (x, y))
    for k in range(1, 9):
        touch("touchMove", (x + 8 * k, y - 5 * k))
    touch("touchEnd")
    assert place() == pytest.approx((x + 64, y - 40), abs=0.5)
    assert page.evaluate("scrollY") == scrolled
    assert "would fire" in page.locator(".answer").first.inner_text()
