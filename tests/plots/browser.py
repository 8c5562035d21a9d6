"""Replay pages in a browser, for tests: each is opened from disk.

A request to anywhere else, a message on the console or an error in a script fails the test that
caused it.
"""

from __future__ import annotations

import importlib.util
import shutil
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import Prescribed, Trace, simulate
from tests.helpers import FIG4_SINE, pulled_mass, stick_slip

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MISSING = [
    what
    for what, there in {
        "the program chromium": CHROMIUM is not None,
        "the package playwright": importlib.util.find_spec("playwright") is not None,
        "the package axe-playwright-python": importlib.util.find_spec("axe_playwright_python")
        is not None,
        "the package uplot-python": importlib.util.find_spec("uplot") is not None,
        "Graphviz (dot)": shutil.which("dot") is not None,
    }.items()
    if not there
]
if MISSING:
    pytest.skip(f"needs {', '.join(MISSING)}", allow_module_level=True)

from axe_playwright_python.sync_playwright import Axe  # noqa: E402  # after the skip
from playwright.sync_api import Browser, Page, expect, sync_playwright  # noqa: E402

from plots.replay import write_replay  # noqa: E402

__all__ = [
    "SIZES",
    "Axe",
    "Open",
    "browser",
    "events",
    "expect",
    "fig4",
    "frame",
    "in_view",
    "last",
    "mass",
    "open_page",
    "open_tab",
    "pages",
    "said",
    "wait",
    "window",
]

ARGUMENTS = [
    "--no-sandbox",
    "--headless",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
SIZES = {"laptop": (1366, 657), "desk": (1400, 900), "tablet": (800, 1000), "phone": (400, 850)}

Open = Callable[..., Page]


@cache
def fig4(law: str) -> Trace:
    return simulate(stick_slip(law), Prescribed(FIG4_SINE), 100.0)


@cache
def mass() -> Trace:
    return simulate(*pulled_mass(), 60.0)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("replay")
    one, two = fig4("published"), fig4("signed")
    return {
        "one": write_replay(folder / "one.html", one, title="Fig. 4"),
        "two": write_replay(folder / "two.html", one, two),
        "mass": write_replay(folder / "mass.html", mass()),
    }


@pytest.fixture
def open_page(browser: Browser, pages: dict[str, Path]) -> Iterator[Open]:
    """Open a page; at the end there must be no requests and no console messages."""
    contexts, wrong = [], []

    def opened(page: str | Path = "one", size: str = "desk", **options: Any) -> Page:
        path = pages[page] if isinstance(page, str) else page
        width, height = SIZES[size]
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        tab = context.new_page()
        tab.on("console", lambda message: wrong.append(message.text))
        tab.on("pageerror", lambda error: wrong.append(str(error)))
        tab.on("request", lambda r: r.url == path.as_uri() or wrong.append(f"asked for {r.url}"))
        tab.goto(path.as_uri())
        return tab

    yield opened
    for context in contexts:
        context.close()
    assert wrong == []


def frame(page: Page) -> int:
    """Return the row that is shown, from 0."""
    return int(page.evaluate("frame"))


def last(page: Page) -> int:
    return int(page.evaluate("last"))


def events(page: Page) -> list[int]:
    return list(page.evaluate("events"))


def window(page: Page) -> tuple[float, float]:
    low, high = page.evaluate("[span.min, span.max]")
    return low, high


def wait(page: Page, condition: str) -> None:
    """Wait until a condition holds; the wait function of Playwright needs `eval` in the page."""
    for _ in range(500):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(20)
    raise AssertionError(f"waited in vain for {condition}")


def said(page: Page) -> str:
    return page.locator("#say").inner_text()


def open_tab(page: Page, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).first.click()


def in_view(page: Page, selector: str) -> bool:
    """Return whether the first such node is seen whole: not clipped, not under the controls."""
    return bool(
        page.evaluate(
            """(selector) => {
                const node = document.querySelector(selector);
                if (!node) return false;
                const inner = node.getBoundingClientRect();
                const controls = document.querySelector("#controls").getBoundingClientRect();
                let box = { left: 0, top: 0, right: innerWidth, bottom: controls.top };
                for (let outer = node.parentElement; outer; outer = outer.parentElement) {
                    if (getComputedStyle(outer).overflow === "visible") continue;
                    if (outer === document.body || outer === document.documentElement) continue;
                    const of = outer.getBoundingClientRect();
                    box = {
                        left: Math.max(box.left, of.left), right: Math.min(box.right, of.right),
                        top: Math.max(box.top, of.top), bottom: Math.min(box.bottom, of.bottom),
                    };
                }
                return inner.width + inner.height > 0
                    && inner.top >= box.top - 1 && inner.bottom <= box.bottom + 1
                    && inner.left >= box.left - 1 && inner.left < box.right;
            }""",
            selector,
        )
    )
