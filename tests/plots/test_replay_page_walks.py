"""The replay page is walked row by row and event by event, by mouse and by keyboard alike."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from plots.replay import write_replay
from tests.helpers import FIG4_SINE, stick_slip
from tests.plots.browser import (
    Open,
    browser,
    events,
    fig4,
    frame,
    last,
    open_page,
    open_tab,
    pages,
    said,
    window,
)

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


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
    end = last(page)
    for key, expected in (
        ("ArrowRight", 1),
        ("ArrowRight", 2),
        ("ArrowLeft", 1),
        ("Shift+ArrowRight", events(page)[0]),
        ("Shift+ArrowRight", events(page)[1]),
        ("Shift+ArrowLeft", events(page)[0]),
        ("End", end),
        ("Shift+ArrowRight", end),
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
    assert page.evaluate("frames.t[frame]") == pytest.approx(50.0, abs=1.0)
    page.locator("#scale").select_option("rows")
    page.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + box["height"] / 2)
    assert frame(page) == pytest.approx(0.75 * last(page), abs=12)
    scrubber.focus()
    here = frame(page)
    page.keyboard.press("ArrowUp")
    assert frame(page) == here + 1
    page.keyboard.press("Shift+ArrowRight")
    assert frame(page) == min(k for k in events(page) if k > here + 1)
    assert "row" in (scrubber.get_attribute("aria-valuetext") or "")


def test_there_is_a_tick_for_every_instant_of_the_list(open_page: Open) -> None:
    page = open_page()
    page.locator("#scale").select_option("rows")
    path = page.locator("#ticks path").first.get_attribute("d") or ""
    marks = [float(x) for x in re.findall(r"M([\d.]+) 0V1", path)]
    assert marks == pytest.approx([1000 * k / last(page) for k in events(page)], abs=0.06)
    open_tab(page, "Transitions")
    assert page.locator(".log option").count() == len(events(page)) == 50


def test_the_transition_list_goes_there(open_page: Open) -> None:
    page = open_page()
    open_tab(page, "Transitions")
    page.locator(".log select").select_option(index=7)
    assert frame(page) == page.evaluate("frames.of[0][runs[0].log[7].row]")
    assert page.locator(".log select").evaluate("node => node.selectedIndex") == 7
    assert "element 4 slip → stick (arrest)" in said(page)


# --------------------------------------------------------------------------- zoom
def test_zoom_by_buttons_and_keys_keeps_the_row_in_view(open_page: Open) -> None:
    page = open_page()
    for _ in range(20):
        page.keyboard.press("Shift+ArrowRight")
    page.click("#zoom-in")
    page.keyboard.press("+")
    low, high = window(page)
    t = page.evaluate("frames.t[frame]")
    assert (low + high) / 2 == pytest.approx(t)
    assert high - low == pytest.approx(25.0)
    scales = page.evaluate(
        "views[0].open.right.plots.map(({plot}) => [plot.scales.x.min, plot.scales.x.max])"
    )
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
    assert page.evaluate("frames.t[frame]") == pytest.approx(50.0, abs=0.5)
    here = frame(page)
    page.mouse.move(box["x"] + box["width"] * 0.4, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.6, y, steps=5)
    page.mouse.up()
    assert window(page) == pytest.approx((40.0, 60.0), abs=0.5)
    assert frame(page) == here
    cursor = page.locator(".cursor").bounding_box()
    assert cursor is not None
    low, high = window(page)
    part = (page.evaluate("frames.t[frame]") - low) / (high - low)
    assert cursor["x"] == pytest.approx(box["x"] + box["width"] * part, abs=2)
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


def test_numbers_of_rows_are_those_of_the_trace(open_page: Open) -> None:
    page, trace = open_page(), fig4("published")
    for _ in range(12):
        page.keyboard.press("Shift+ArrowRight")
        found = re.search(r"row (\d+) of (\d+)", page.locator(".values").inner_text())
        assert found is not None
        row = int(found[1])
        assert int(found[2]) == len(trace)
        assert trace.t[row] == page.evaluate("frames.t[frame]")
        assert trace.microstep[row] == page.evaluate("runs[0].microstep[views[0].row]")
    sample = page.evaluate("runs[0].between.indexOf(1)")
    page.evaluate(f"show({sample})")
    before = int(np.searchsorted(trace.t, page.evaluate("frames.t[frame]"))) - 1
    assert f"after row {before} " in page.locator(".values").inner_text() + " "
    heard = page.locator("#scrubber").get_attribute("aria-valuetext")
    assert (heard or "").endswith(f" s, after row {before}")


def test_a_pinned_element_stays_selected(open_page: Open) -> None:
    page = open_page()
    page.keyboard.press("f")
    assert page.locator("#follow").get_attribute("aria-pressed") == "false"
    page.keyboard.press("2")
    for _ in range(8):
        page.keyboard.press("Shift+ArrowRight")
        assert page.evaluate("views[0].element") == 1
    page.click("#follow")
    fired = page.evaluate("runs[0].fired.get(views[0].row).element")
    assert page.evaluate("views[0].element") == fired


def test_rows_before_the_first_requested_time_are_before_it(
    open_page: Open, tmp_path: Path
) -> None:
    trace = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 60.0, t_eval=[50.0, 55.0])
    page = open_page(write_replay(tmp_path / "late.html", trace))
    for _ in range(4):
        page.keyboard.press("Shift+ArrowRight")
        assert page.evaluate("frames.t[frame]") < 50.0
        assert "before row 0" in page.locator(".values").inner_text()
    page.evaluate("show(frames.t.findIndex((t) => t > 50.0))")
    assert "after row 0" in page.locator(".values").inner_text()
