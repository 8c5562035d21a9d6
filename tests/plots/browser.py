"""Replay pages in a browser, for tests: each is opened from disk.

A request to anywhere else, a message on the console or an error in a script fails the test that
caused it.
"""

from __future__ import annotations

import importlib.util
import math
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Chart, Contact, Prescribed, State, Stribeck, System, Trace, simulate
from gms_fsm.charts.registry import entry
from gms_fsm.systems.models import ChartModel, demonstration
from tests.helpers import FIG4_SINE, SINE, bank, open_loop, pulled_mass, stick_slip, wear
from tests.plots.systems_to_draw import BALL, BLOCKS, SERVO, SHARED, TIMED
from tests.plots.systems_to_draw import run as system_run
from tests.supervisor_cases import crossing, hunting
from tests.systems_cases import puck
from tests.zoo.zoo_cases import CASES

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
from playwright.sync_api import Browser, Page, expect, sync_playwright  # noqa: E402, F401

from plots.page.replay import write_replay  # noqa: E402

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


LINEAR = Chart(
    "spring",
    inputs=("v",),
    variables=("z",),
    parameters=("k",),
    states=(State("only", flow={"z": "v"}),),
    outputs={"F": "k * z"},
)


def pushed(contact: Contact, force: str = "4 * sin(3 * t)", t_end: float = 6.0) -> Trace:
    """Return a run of a mass that is pushed to and fro over a contact."""
    mass = Body("mass", inertia=1.0, force=force)
    return simulate(System("pushed", bodies=(mass,), contacts=(contact,)), t_end)


def shown(name: str) -> Trace:
    """Return a run of a chart of the zoo that is moved to and fro."""
    return simulate(demonstration(entry(name)), Prescribed("1e-3 * sin(6 * t)"), 3.0)


def in_units(scale: float) -> Trace:
    rig = Prescribed(f"{1e-3 / scale!r} * sin(t / {scale!r})")
    return simulate(ChartModel(LINEAR, {"k": 1.0}), rig, scale)


def named(name: str) -> Trace:
    chart = replace(LINEAR, name=name)
    model = ChartModel(chart, {"k": 1.0}, n=2, stribeck=Stribeck(1, 1.5, 0.1))
    return simulate(model, Prescribed("0.1"), 1.0)


def without_numbers() -> Trace:
    """Return a run with values that are not numbers."""
    trace = run("signed")
    stored = {name: np.array(values) for name, values in trace.seen.items()}
    stored["friction.F"][:3] = math.nan, math.inf, -math.inf
    stored["friction.v"][0] = math.nan
    stored["friction.F"][20:40] = math.inf
    stored["friction.v"][50:60] = math.nan
    return replace(trace, stored=stored)


EVIL = "</script><script>document.title='owned'</script><img src=x onerror=alert(1)>"
# What the pages show, each simulated once.
RUNS: dict[str, Callable[[], Trace]] = {
    "published": lambda: simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0),
    "signed": lambda: simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 100.0),
    "short": lambda: simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 30.0),
    "late": lambda: simulate(
        stick_slip("signed"), Prescribed(FIG4_SINE), 60.0, t_eval=[50.0, 55.0]
    ),
    "mass": lambda: simulate(*pulled_mass(), 60.0),
    "ramp": lambda: simulate(stick_slip("signed"), Prescribed("0.2*min(t, 5)"), 6.0),
    "cascade": lambda: simulate(stick_slip("signed"), open_loop(), 20.0),
    "still": lambda: simulate(stick_slip("signed"), Prescribed("1e-3*sin(t)"), 2.0),
    "many": lambda: simulate(bank(20), Prescribed(SINE), 20.0),
    "wear": lambda: simulate(wear(), Prescribed("0.2 * sin(t)"), 20.0),
    "ball": lambda: system_run(BALL),
    "blocks": lambda: system_run(BLOCKS),
    "pad1": lambda: system_run(BLOCKS).contact("pad1"),
    "pad2": lambda: system_run(BLOCKS).contact("pad2"),
    "servo": lambda: simulate(replace(SERVO, numbers={**SERVO.numbers, "k_p": 8.0}), 1.0),
    "timed": lambda: pushed(Contact("pad", TIMED, {"T_d": 0.3, "F_c": 1.0, "F_s": 1.5})),
    "shared": lambda: pushed(Contact("pad", SHARED, {"k": 10.0, "F_c": 1.0, "b": 0.2})),
    "puck": lambda: puck().run(),
    "hunting": lambda: hunting().run(),
    "crossing": lambda: crossing().run(),
    "dahl": partial(shown, "dahl"),
    "karnopp": lambda: CASES["karnopp"](1.0).run(),
    "elasto-plastic": lambda: CASES["elasto-plastic"](1.0).run(),
    "microseconds": lambda: in_units(1e-6),
    "megaseconds": lambda: in_units(1e6),
    "evil": lambda: named(EVIL),
    "no numbers": without_numbers,
}
# Pages that compare two runs; every other page has the run of its name.
PAIRS = {"two": ("published", "signed"), "ended": ("signed", "short"), "same": ("short",) * 2}
TITLES = {"evil": EVIL}
_PAGES: dict[str, Path] = {}


@cache
def run(name: str) -> Trace:
    return RUNS[name]()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium; not longer than a module, because its event loop is in the way of others'."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Open]:
    """Open a page; at the end there must be no requests and no console messages.

    All are opened in one tab of the module, one after the other, but for a page with options of
    its own: a new tab takes three times as long.
    """
    asked, wrong, tabs, contexts = set(), [], list[Page](), []
    hear: dict[Any, Any] = {
        "console": lambda message: wrong.append(message.text),
        "pageerror": lambda error: wrong.append(str(error)),
        "request": lambda r: (
            r.url.startswith(("blob:", "data:"))
            or r.url.split("#")[0] in asked
            or wrong.append(f"asked for {r.url}")
        ),
    }

    def is_own(url: str) -> bool:  # a page's worker is a blob of its own
        return url.startswith("blob:") or url.partition("#")[0] in asked

    def tab_of(options: dict[str, Any]) -> Page:
        if options:
            contexts.append(browser.new_context(**options))
            return contexts[-1].new_page()
        context = browser.contexts[0] if browser.contexts else browser.new_context()
        return context.pages[0] if context.pages else context.new_page()

    def opened(
        page: str | Path,
        size: str = "desk",
        tab: str = "",
        color_scheme: Any = "light",
        reduced_motion: Any = "no-preference",
        **options: Any,
    ) -> Page:
        if isinstance(page, str) and page not in _PAGES:  # each is written once
            runs = [run(name) for name in PAIRS.get(page, (page,))]
            folder = tmp_path_factory.mktemp("replay")
            _PAGES[page] = write_replay(folder / "page.html", *runs, title=TITLES.get(page, page))
        path = _PAGES[page] if isinstance(page, str) else page
        shown = tab_of(options)
        width, height = SIZES[size]
        shown.set_viewport_size({"width": width, "height": height})
        shown.emulate_media(color_scheme=color_scheme, reduced_motion=reduced_motion)
        shown.mouse.move(0, 0)
        if shown not in tabs:
            tabs.append(shown)
            for event, call in hear.items():
                shown.on(event, call)
        asked.add(path.as_uri())
        shown.goto(path.as_uri())
        if tab:
            open_tab(shown, tab)
        return shown

    yield opened
    for shown in tabs:
        for event, call in hear.items():
            shown.remove_listener(event, call)
    for context in contexts:
        context.close()
    assert wrong == []


def box_of(page: Page, selector: str) -> dict[str, float]:
    """Return the box of the first such node that is seen."""
    found = page.locator(selector).first.bounding_box()
    assert found is not None, selector
    return dict(found)


def press(page: Page, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)


def own_rows(page: Page) -> list[tuple[int, int]]:
    """Return the rows of the page that are rows of the run, with their numbers there."""
    numbers, between = page.evaluate("[[...runs[0].number], [...runs[0].between]]")
    return [(row, number) for row, number in enumerate(numbers) if not between[row]]


def some_rows(page: Page, count: int, seed: int = 18) -> list[tuple[int, int]]:
    """Return random ones of them."""
    own = own_rows(page)
    chosen = np.random.default_rng(seed).choice(len(own), min(count, len(own)), replace=False)
    return [own[k] for k in chosen]


def at_rows(page: Page, rows: Sequence[int], function: str) -> list[Any]:
    """Show rows one after the other, and return what a function returns at each."""
    asked = f"(rows) => rows.map((row) => {{ go(row); return ({function})(); }})"
    return list(page.evaluate(asked, list(rows)))


def faults(page: Page, **options: Any) -> list[Any]:
    """Return what axe finds: the rules that are broken, and where."""
    if page.evaluate("!window.axe"):
        page.evaluate(Axe().axe_script)
    found = page.evaluate(
        """async ({ context, options }) => (
            await axe.run(context ?? document, { resultTypes: ["violations"], ...options })
        ).violations""",
        options,
    )
    return [(each["id"], [node["target"] for node in each["nodes"]][:3]) for each in found]


def until(page: Page, text: str) -> None:
    """Search for the row where a condition becomes true."""
    page.fill("#until", text)
    page.press("#until", "Enter")


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
