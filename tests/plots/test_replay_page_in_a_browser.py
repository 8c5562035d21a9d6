"""The replay page works in a browser: all controls by mouse and keyboard, no outside requests.

Each page is opened from disk. A request to anywhere else, a message on the console or an error in a
script fails the test that caused it.
"""

from __future__ import annotations

import html
import importlib.util
import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ExpressionError
from gms_fsm.inspection.explain import explain
from gms_fsm.inspection.session import Session
from gms_fsm.language import CONSTANTS, FUNCTIONS, SEVERAL, evaluate, parse_condition
from gms_fsm.systems.models import ChartModel
from plots.replay import replay, write_replay
from tests.helpers import FIG4_SINE, stick_slip

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

pytestmark = pytest.mark.slow

ARGUMENTS = [
    "--no-sandbox",
    "--headless",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
SIZES = {"desk": (1400, 900), "tablet": (800, 1000), "phone": (400, 850)}

Open = Callable[..., Page]


@cache
def fig4(law: str) -> Trace:
    return simulate(stick_slip(law), Prescribed(FIG4_SINE), 100.0)


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
    return int(page.locator("#scrubber").input_value())


def events(page: Page) -> list[int]:
    return list(page.evaluate("data.events"))


def window(page: Page) -> tuple[float, float]:
    low, high = page.evaluate("[view.min, view.max]")
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


# --------------------------------------------------------------------------- walking
def test_the_buttons_walk(open_page: Open) -> None:
    page = open_page()
    for button, expected in (
        ("step", 1),
        ("step", 2),
        ("back", 1),
        ("transition", events(page)[0]),
        ("transition", events(page)[1]),
        ("back-transition", events(page)[0]),
        ("start", 0),
        ("back", 0),
    ):
        page.click(f"#{button}")
        assert frame(page) == expected, button


def test_the_keys_walk(open_page: Open) -> None:
    page = open_page()
    last = int(page.locator("#scrubber").get_attribute("max") or 0)
    for key, expected in (
        ("ArrowRight", 1),
        ("ArrowRight", 2),
        ("ArrowLeft", 1),
        ("Shift+ArrowRight", events(page)[0]),
        ("Shift+ArrowRight", events(page)[1]),
        ("Shift+ArrowLeft", events(page)[0]),
        ("End", last),
        ("Shift+ArrowRight", last),
        ("Home", 0),
        ("Shift+ArrowLeft", 0),
    ):
        page.keyboard.press(key)
        assert frame(page) == expected, key


def test_the_scrubber_moves_by_mouse_and_keys(open_page: Open) -> None:
    page = open_page()
    scrubber = page.locator("#scrubber")
    box = scrubber.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert frame(page) == pytest.approx(400, abs=8)
    scrubber.focus()
    here = frame(page)
    page.keyboard.press("ArrowUp")
    assert frame(page) == here + 1
    page.keyboard.press("Shift+ArrowRight")
    assert frame(page) == min(k for k in events(page) if k > here + 1)
    assert "row" in (scrubber.get_attribute("aria-valuetext") or "")


def test_there_is_a_tick_for_every_instant_of_the_list(open_page: Open) -> None:
    page = open_page()
    path = page.locator("#ticks path").get_attribute("d") or ""
    assert path.count("M") == len(events(page)) == 50
    assert page.locator(".log option").count() == 50


def test_the_transition_list_goes_there(open_page: Open) -> None:
    page = open_page()
    page.locator(".log select").select_option(index=7)
    assert frame(page) == page.evaluate("data.runs[0].log[7].frame")
    assert page.locator(".log select").evaluate("node => node.selectedIndex") == 7
    assert "element 4 slip → stick (arrest)" in said(page)


def test_playing_moves_silently_and_space_stops_it(open_page: Open) -> None:
    page = open_page()
    page.locator("#speed").select_option("60")
    page.locator("body").click(position={"x": 5, "y": 5})
    page.keyboard.press("Space")
    wait(page, "frame > 3")
    assert page.locator("#say").get_attribute("aria-live") == "off"
    assert page.locator("#play").get_attribute("aria-pressed") == "true"
    page.keyboard.press("Space")
    here = frame(page)
    page.wait_for_timeout(100)
    assert frame(page) == here
    assert page.locator("#say").get_attribute("aria-live") == "polite"
    page.click("#play")
    wait(page, f"frame > {here}")
    page.click("#play")
    assert page.locator("#play").get_attribute("aria-pressed") == "false"


def test_playing_stops_at_the_end(open_page: Open) -> None:
    page = open_page()
    page.locator("#speed").select_option("60")
    page.keyboard.press("End")
    page.keyboard.press("ArrowLeft")
    page.click("#play")
    wait(page, "timer === 0")
    assert "end of the run" in said(page)


def test_reduced_motion_plays_slowly(open_page: Open) -> None:
    assert open_page(reduced_motion="reduce").locator("#speed").input_value() == "2"
    assert open_page().locator("#speed").input_value() == "20"


# --------------------------------------------------------------------------- what is shown
def test_the_chart_shows_state_and_firing_of_every_row_of_a_transition(open_page: Open) -> None:
    page, trace = open_page(), fig4("published")
    for record in trace.transitions:
        page.keyboard.press("Shift+ArrowRight")
        element = f"element{record.element + 1}"
        assert page.locator(f"#{element}-state-{record.target}.active").count() == 1
        assert page.locator(f"#{element}-state-{record.source}.active").count() == 0
        assert page.locator(".guard.fired").count() == 1
        assert page.locator(f"#{element}-guard-{record.edge}.fired").count() == 1
        assert page.locator(f"#{element}-edge-{record.edge}-2.fired").count() == 1
        marks = page.locator(f"#{element}-guard-{record.edge} .mark").all_text_contents()
        assert marks == ["✓", "✓"]


def test_the_table_explains_the_chosen_element(open_page: Open) -> None:
    page = open_page()
    page.keyboard.press("Shift+ArrowRight")  # element 1 breaks away
    lines = page.locator("tbody tr.asked")
    assert lines.count() == 4
    trace = fig4("published")
    margin = explain(trace, int(np.flatnonzero(trace.microstep)[0]), 0)[0].clauses[0].margin
    assert lines.nth(0).locator("td").all_inner_texts() == [
        "z >= s",
        "0.40000",
        "0.40000",
        f"{margin:.3e}".replace("-", "−"),
        "✓ true",
    ]
    assert lines.nth(2).locator("td").first.inner_text() == "z <= -s"
    assert lines.nth(2).locator("td").last.inner_text() == "✗ false"
    assert lines.nth(0).locator("em").inner_text() == "FIRED"
    page.keyboard.press("3")  # still sticks: its guard is true and not yet taken
    assert page.locator(".element").input_value() == "3"
    assert page.locator("tbody em").all_inner_texts() == ["", "", "not checked"]
    assert page.locator("tbody tr").nth(0).locator("td").last.inner_text() == "✓ true"


def test_elements_are_chosen_by_digit_list_and_click(open_page: Open) -> None:
    page = open_page()
    page.keyboard.press("2")
    assert page.locator(".region.chosen").get_attribute("id") == "element2"
    page.locator(".element").select_option("4")
    assert page.locator(".region.chosen").get_attribute("id") == "element4"
    page.locator("#element3 .frame").click(position={"x": 20, "y": 40})
    assert page.locator(".element").input_value() == "3"
    page.keyboard.press("9")
    assert page.locator(".element").input_value() == "4"


# --------------------------------------------------------------------------- breakpoints
def test_a_breakpoint_by_click_stops_where_its_guard_becomes_true(open_page: Open) -> None:
    page = open_page()
    guard = page.locator("#element2-guard-arrest")
    guard.click()
    assert guard.get_attribute("aria-pressed") == "true"
    page.click("#continue")
    assert "breakpoint: element 2, arrest" in said(page)
    here = frame(page)
    assert page.evaluate("data.runs[0].truth[1][2].map(clause => clause[frame])") == ["1", "1"]
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    assert "element 2 slip → stick (arrest)" in said(page)
    page.keyboard.press("c")
    assert frame(page) > here + 2
    guard.click()
    assert guard.get_attribute("aria-pressed") == "false"
    page.keyboard.press("c")
    assert "end of the run: no breakpoint" in said(page)


def test_breakpoints_by_keyboard_on_the_guard_and_in_the_table(open_page: Open) -> None:
    page = open_page()
    guard = page.locator("#element1-guard-break_away_forward")
    guard.focus()
    page.keyboard.press("Enter")
    assert guard.get_attribute("aria-pressed") == "true"
    page.keyboard.press("Space")
    assert guard.get_attribute("aria-pressed") == "false"
    assert frame(page) == 0  # the space was the guard's
    button = page.locator("tbody button").first
    button.focus()
    page.keyboard.press("Space")
    assert button.get_attribute("aria-pressed") == "true"
    assert guard.get_attribute("aria-pressed") == "true"
    assert button.evaluate("node => node === document.activeElement")
    page.keyboard.press("c")
    assert frame(page) == events(page)[0] - 1


def test_playing_stops_at_a_breakpoint(open_page: Open) -> None:
    page = open_page()
    page.locator("#element1-guard-break_away_forward").click()
    page.locator("#scrubber").fill(str(events(page)[0] - 4))
    page.locator("#speed").select_option("60")
    page.click("#play")
    wait(page, "timer === 0")
    assert frame(page) == events(page)[0] - 1


# --------------------------------------------------------------------------- until
def test_until_stops_on_the_first_row_where_it_holds(open_page: Open) -> None:
    page = open_page()
    page.fill("#until", "F > 1")
    page.press("#until", "Enter")
    assert page.evaluate("runs[0].columns.F(frame) > 1 && runs[0].columns.F(frame - 1) <= 1")
    assert "F > 1 became true" in said(page)
    page.fill("#until", "state(2) == slip and not z1 < 0")
    page.click("#continue")
    assert page.evaluate("runs[0].mode[1][frame]") == 1
    page.fill("#until", "t > 1e9")
    page.press("#until", "Enter")
    assert "end of the run: nothing stopped it" in said(page)
    page.fill("#until", "c -")
    assert frame(page) == int(page.locator("#scrubber").get_attribute("max") or 0)
    page.press("#until", "Escape")
    page.keyboard.press("Home")
    assert frame(page) == 0


CANNOT_BE_READ = [
    ("F >", 4, "the text ends too early"),
    ("F == 1", 3, "only < <= > >="),
    ("alert(1) > 0", 1, 'unknown "alert"'),
    ("constructor > 0", 1, 'unknown "constructor"'),
    ("F", 1, "a comparison is needed"),
    ("(F > 1) + 1 > 0", 1, "a number is needed"),
    ("F > 1; x", 6, "cannot read"),
    ("state(9) == slip", 7, "an element, 1 to 4"),
    ("state(1) == melt", 13, "a state: stick, slip"),
    ("F > 1 F", 7, "cannot be read from"),
    ("min(F) > 1", 1, "min got 1 arguments"),
    ("(F > 1", 7, "a closing bracket"),
]


def test_until_reports_a_syntax_error_with_its_column(open_page: Open) -> None:
    page = open_page()
    for text, column, reason in CANNOT_BE_READ:
        page.fill("#until", text)
        page.press("#until", "Enter")
        assert f"column {column}: " in said(page), text
        assert reason in said(page), text
        assert page.locator("#until").get_attribute("aria-invalid") == "true", text
        assert frame(page) == 0, text


def test_until_reads_what_the_expression_language_reads(open_page: Open) -> None:
    """Same texts accepted, same texts rejected, same truths, up to rounding."""
    page, trace = open_page(), fig4("published")
    session = Session(trace.model, trace.rig, 1.0)
    texts = [
        "F > 1",
        "-1 < F < 1",
        "not F > 1 or v < 0 and z1 > 0.2",
        "(F > 1 or v > 0) and x > 0.1",
        "abs(z1) >= s1",
        "2 * F1 + 3 > F2 ** 2 / 4 - 1",
        "-x ** 2 < -0.01",
        "2 ** -1 < x",
        "min(z1, z2, z3) < max(v, 0.1)",
        "sgn(v) <= 0",
        "sqrt(s) > 1.1",
        "sin(pi * t) > .5",
        "state(3) == slip",
        "state(3) != slip and t > 20",
        "((F)) > ((1))",
        "cos(t) * tanh(v) < 0",
        "exp(-t) < 1e-3",
        "t >= 3.5e1 or t < 2.",
        "+F > - -1",
        "not not v > 0",
        "1 / v > 20",
        "F >",
        "",
        "F = 1",
        "F > 1 and",
        "v",
        "not 3",
        "(v > 0) > 1",
        "abs v > 1",
        "abs(1, 2) > 1",
        "z9 > 1",
        "F > 1 &&  v > 0",
        "'a' > 1",
        "F[0] > 1",
        "F.x > 1",
        "state(0) == slip",
        "state(1) > 1",
        "v > 0 if 1 else 0",
        "1 < v == 2",
        "()",
        "min(1, 2) > 1, 2",
        "3x > 1",
        "lambda: 1",
        "a := 1",
        "not(v > 0)",
        "v > (0",
        "v > 0)",
        "__proto__ > 0",
        "toString > 1",
        "v <> 1",
        "1 > 2 > not v > 0",
        "**v > 1",
        "F neg 1 > 0",
        "F not > 1",
        *(f"{name}({'v, z1' if name in SEVERAL else 'v'}) > 0.1" for name in FUNCTIONS),
        *(f"{name} * v > 0.1" for name in CONSTANTS),
    ]
    rows = page.evaluate(
        """() => data.frames.t.map((_, row) => Object.fromEntries([
            ...Object.entries(runs[0].columns).map(([name, f]) => [name, f(row)]),
            ...runs[0].mode.map((mode, i) => [`state(${i + 1})`, runs[0].states[mode[row]]]),
        ]))"""
    )
    accepted = 0
    for text in texts:
        got = page.evaluate(
            """(text) => {
                try {
                    const { columns, states, mode } = runs[0];
                    const f = parse(text, data.language, columns, states, mode);
                    return data.frames.t.map((_, row) => Boolean(f(row)));
                } catch (error) { return error.message; }
            }""",
            text,
        )
        try:
            tree = parse_condition(text, session.names, ("stick", "slip"), 4)
        except ExpressionError:
            assert isinstance(got, str), text
            assert got.startswith("until, column"), (text, got)
            continue
        accepted += 1
        assert isinstance(got, list), (text, got)
        for values, truth in zip(rows, got, strict=True):
            try:
                expected = bool(evaluate(tree, values))
            except (ArithmeticError, ValueError):  # not computable is not true
                expected = False
            assert truth == expected, (text, values)
    assert accepted > 20


def test_until_rejects_number_formats_that_only_python_has(open_page: Open) -> None:
    page = open_page()
    for text in ("F > 1_000", "F > 0x10"):
        page.fill("#until", text)
        page.press("#until", "Enter")
        assert "column 5: cannot read" in said(page)


# --------------------------------------------------------------------------- zoom
def test_zoom_by_buttons_and_keys_keeps_the_row_in_view(open_page: Open) -> None:
    page = open_page()
    for _ in range(20):
        page.keyboard.press("Shift+ArrowRight")
    page.click("#zoom-in")
    page.keyboard.press("+")
    low, high = window(page)
    t = page.evaluate("data.frames.t[frame]")
    assert (low + high) / 2 == pytest.approx(t)
    assert high - low == pytest.approx(25.0)
    scales = page.evaluate("runs[0].plots.map(u => [u.scales.x.min, u.scales.x.max])")
    assert scales == [[low, high]] * 4
    page.keyboard.press("End")
    low, high = window(page)
    assert low < 100.0 <= high
    page.keyboard.press("-")
    assert window(page)[1] <= 100.0
    page.click("#zoom-out")
    page.keyboard.press("0")
    assert window(page) == (0.0, 100.0)
    page.keyboard.press("+")
    page.click("#zoom-all")
    assert window(page) == (0.0, 100.0)


def test_dragging_zooms_clicking_goes_and_double_clicking_shows_all(open_page: Open) -> None:
    page = open_page()
    area = page.locator(".u-over").nth(2)
    box = area.bounding_box()
    assert box is not None
    y = box["y"] + 30
    page.mouse.click(box["x"] + box["width"] * 0.5, y)
    assert page.evaluate("data.frames.t[frame]") == pytest.approx(50.0, abs=0.5)
    here = frame(page)
    page.mouse.move(box["x"] + box["width"] * 0.4, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.6, y, steps=5)
    page.mouse.up()
    assert window(page) == pytest.approx((40.0, 60.0), abs=0.5)
    assert frame(page) == here
    cursor = page.locator(".cursor").bounding_box()
    assert cursor is not None
    assert cursor["x"] == pytest.approx(box["x"] + box["width"] * 0.5, abs=4)
    pieces = page.locator(".ribbon").first.locator("i").count()
    area.dblclick(position={"x": box["width"] / 2, "y": 30})
    assert window(page) == (0.0, 100.0)
    assert page.locator(".ribbon").first.locator("i").count() > pieces


def test_deep_zoom_into_micro_steps_stays_alive(open_page: Open) -> None:
    page = open_page()
    page.keyboard.press("Shift+ArrowRight")
    for _ in range(60):
        page.keyboard.press("+")
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    low, high = window(page)
    assert 0.0 < high - low < 1e-6


# --------------------------------------------------------------------------- two runs
def test_two_runs_are_shown_at_the_same_time(open_page: Open) -> None:
    page = open_page("two")
    assert page.locator(".run").count() == 2
    boxes = [page.locator(".run").nth(i).bounding_box() for i in (0, 1)]
    assert boxes[0] is not None
    assert boxes[1] is not None
    assert boxes[0]["y"] == boxes[1]["y"]
    assert boxes[0]["x"] < boxes[1]["x"]
    for _ in range(12):
        page.keyboard.press("Shift+ArrowRight")
    t = page.evaluate("data.frames.t[frame]")
    for place, law in enumerate(("published", "signed")):
        trace = fig4(law)
        row = int(np.searchsorted(trace.t, t, side="right")) - 1
        assert page.evaluate(f"runs[{place}].columns.t(runs[{place}].row)") <= t
        for i, state in enumerate(trace.states[row]):
            name = f"element{i + 1}-state-{state}"
            ident = name if place == 0 else f"run2-{name}"
            micro = trace.microstep[row] > 0  # within an instant the states still change
            assert micro or page.locator(f"#{ident}.active").count() == 1
    page.locator("#run2-element1-guard-arrest").click()
    assert page.locator(".guard.break").count() == 1
    page.keyboard.press("c")
    assert "breakpoint: element 1, arrest" in said(page)
    page.fill("#until", "F > 1.2")
    page.press("#until", "Enter")
    assert frame(page) > 0


def test_lines_of_the_other_run_are_drawn_where_both_are_compared(open_page: Open) -> None:
    page = open_page("two")
    counts = page.evaluate("runs.map(run => run.plots.map(u => u.series.length - 1))")
    assert counts == [[2, 6, 2, 2], [2, 6, 2, 2]]


# --------------------------------------------------------------------------- broken data
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
    assert evil in page.locator("h2").inner_text()
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
            assert cells[1::2] == ["not a number", "not a number"]
            assert cells[4] == "✗ false"
        page.keyboard.press("ArrowRight")
    assert [text.split(" N ")[0] for text in texts] == [
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


# --------------------------------------------------------------------------- for everybody
@pytest.mark.parametrize(
    ("name", "size", "scheme"),
    [
        ("one", "desk", "light"),
        ("one", "tablet", "dark"),
        ("one", "phone", "light"),
        ("two", "desk", "dark"),
        ("two", "tablet", "light"),
        ("two", "phone", "dark"),
    ],
)
def test_axe_finds_no_accessibility_problem(
    open_page: Open, name: str, size: str, scheme: str
) -> None:
    page = open_page(name, size, color_scheme=scheme)
    page.locator(".guard").first.click()
    page.locator("details summary").click()
    for _ in range(5):
        page.keyboard.press("Shift+ArrowRight")
    found = Axe().run(page).response["violations"]
    assert [(v["id"], [n["target"] for n in v["nodes"]][:3]) for v in found] == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ["one", "two"])
def test_nothing_is_wider_than_the_screen(open_page: Open, name: str, size: str) -> None:
    page = open_page(name, size)
    assert page.evaluate("document.documentElement.scrollWidth") <= SIZES[size][0]
    plot = page.locator(".u-over").first.bounding_box()
    assert plot is not None
    assert plot["width"] > 0.3 * min(SIZES[size][0], 700)


def test_a_phone_shows_the_chosen_element_large_enough_to_be_read(open_page: Open) -> None:
    page = open_page(size="phone")
    page.locator(".element").select_option("3")
    region, chart = (page.locator(q).bounding_box() for q in ("#element3 .frame", ".chart"))
    assert region is not None
    assert chart is not None
    assert region["width"] > 0.9 * chart["width"]


def test_every_control_is_reached_by_tab_and_shows_its_focus(open_page: Open) -> None:
    page = open_page()
    seen = set()
    for _ in range(60):
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
        "element",
        "SUMMARY",
        "element4-guard-arrest",
        "ribbons",
        "why",
    }
    assert controls <= seen


# --------------------------------------------------------------------------- speed
def test_a_frame_of_the_fig_4_run_takes_less_than_50_ms(open_page: Open) -> None:
    page = open_page()
    page.keyboard.press("+")
    times = page.evaluate(
        """async () => {
            const times = [], painted = () => new Promise(requestAnimationFrame);
            for (let k = 0; k < data.frames.t.length; k += 8) {
                await painted();
                const begin = performance.now();
                show(k);
                document.body.getBoundingClientRect();  // the layout belongs to the frame
                times.push(performance.now() - begin);
            }
            return times;
        }"""
    )
    # The median, because other programs may interrupt some frames.
    assert len(times) >= 100
    assert float(np.median(times)) < 50.0
