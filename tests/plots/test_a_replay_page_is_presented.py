"""A replay page is presented: one view in large type, chosen and stepped by keys, with notes.

On projectors of 1366 by 768 and 1920 by 1080 px, light and dark, of one run and of two.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from plots.page.replay import write_replay
from tests.plots.browser import (
    Open,
    Page,
    box_of,
    browser,
    events,
    faults,
    frame,
    open_page,
    press,
    run,
    said,
    wait,
)

__all__ = ["browser", "open_page"]

pytestmark = pytest.mark.slow

NOTES: dict[float | str, str] = {
    0.0: "Nothing slips yet.",
    "break_away_forward": "It breaks away.",
    40.0: "Far into the run.",
}
PROJECTORS = [(1366, 768), (1920, 1080)]
# The height of the smallest text that is seen in the header and in the view, px on the screen.
SMALLEST = """() => {
    const shown = (node) => node.getBoundingClientRect().width > 0;
    const own = ({ childNodes }) => [...childNodes].some((each) => each.nodeValue?.trim());
    const size = (node) => {
        const svg = node.closest("svg"), px = parseFloat(getComputedStyle(node).fontSize);
        if (!svg) return px * large;
        const units = svg.viewBox.baseVal?.width || svg.clientWidth;
        return (px * svg.getBoundingClientRect().width) / units;
    };
    const drawn = (views[0].open.right.plots ?? []).filter(({ plot }) => plot && shown(plot.root));
    const fonts = drawn.flatMap(({ plot }) => plot.axes.map(({ font }) => font[0]));
    const axes = fonts.map((font) => parseFloat(font.match(/[\\d.]+px/)) / devicePixelRatio);
    const texts = $$("header *, main *").filter((node) => own(node) && shown(node));
    return [Math.min(...texts.map(size)), Math.min(...axes), texts.length];
}"""


def presented(page: Page, size: tuple[int, int] = PROJECTORS[0]) -> int:
    """Begin a presentation; return the number of views."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    press(page, "p")
    return page.locator("#slides button").count()


def with_notes(folder: Path, *names: str) -> Path:
    return write_replay(folder / "notes.html", *map(run, names), title="noted", notes=NOTES)


def told(page: Any) -> str:
    return str(page.locator("#notes").inner_text())


@pytest.mark.every(2)
@pytest.mark.parametrize(
    ("name", "scheme", "size"),
    [("mass", "light", PROJECTORS[0]), ("blocks", "dark", PROJECTORS[1])],
    ids=["mass", "blocks"],
)
def test_each_view_fills_the_screen_in_type_of_24_px_and_axe_finds_nothing(
    open_page: Open, name: str, scheme: str, size: tuple[int, int]
) -> None:
    page = open_page(name, color_scheme=scheme)
    press(page, *["Shift+ArrowRight"] * 2)
    width, height = size
    for k in range(presented(page, size)):
        press(page, str(k + 1))
        button = page.locator("#slides button").nth(k)
        assert button.get_attribute("aria-pressed") == "true"
        assert page.locator("#slides [aria-pressed=true]").count() == 1
        assert f"view {button.inner_text().replace(' ', ', ')}" in said(page)
        (view,) = [
            box
            for each in page.locator(".pane, .why").all()
            if (box := each.bounding_box()) is not None
        ]
        assert view["width"] > 0.95 * width
        assert view["height"] > 0.75 * height
        texts, axes, count = page.evaluate(SMALLEST)
        assert count > 0
        assert min(texts, axes) >= 24 * width / 1366 - 0.01, button.inner_text()
        assert page.evaluate(
            "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
        ) == [width, height]
        if name == "blocks":
            assert faults(page) == [], button.inner_text()


def test_keys_step_play_choose_and_leave_and_the_focus_is_kept(open_page: Open) -> None:
    page = open_page("mass")
    page.click("#present")
    assert page.locator("#present").get_attribute("aria-pressed") == "true"
    assert page.evaluate("document.activeElement.id") == "run1-time"
    press(page, "ArrowRight", "ArrowRight", "ArrowLeft")
    assert frame(page) == 1
    press(page, "Shift+ArrowRight", "7")
    first = events(page)[0]
    assert frame(page) == first
    assert page.locator(".micro .here").is_visible()
    press(page, "v")
    assert page.locator(".why").is_visible()  # the table of guards, the last view
    press(page, "v")
    assert page.locator(".chart.pane").is_visible()
    assert page.locator(".token").first.is_hidden()
    press(page, "V", "9")  # the last there is
    assert "view 8, Guards" in said(page)
    page.locator("#slides button").nth(3).click()  # the keys stay with the view
    press(page, "Space")
    wait(page, f"frame > {first + 2}")
    press(page, "Space")
    here = frame(page)
    press(page, "?")
    assert "1–9 choose the view" in page.locator("dialog").inner_text()
    press(page, "Escape")  # of the dialog
    assert page.locator("#slides").is_visible()
    press(page, "Escape")
    assert page.locator("#slides").is_hidden()
    assert page.evaluate("document.activeElement.id") == "present"
    assert (frame(page), page.evaluate("large")) == (here, 1)
    assert page.locator(".chart.pane").is_visible()
    assert page.locator(".pane.time").is_visible()
    press(page, "f", "2")  # elements again
    assert page.evaluate("views[0].element") == 1


def test_a_click_goes_to_what_is_under_the_mouse(open_page: Open) -> None:
    page = open_page("mass")
    presented(page)
    press(page, "4")
    box = box_of(page, ".u-over")
    x, y = box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.click(x, y)
    assert page.evaluate("frames.t[frame]") == pytest.approx(36.0, abs=0.3)
    assert box_of(page, ".cursor")["x"] == pytest.approx(x, abs=4)
    assert page.evaluate("frames.t[pointed]") == pytest.approx(36.0, abs=0.3)
    press(page, "5")
    ground = page.locator(".phase .plane .ground").nth(1).bounding_box()
    assert ground is not None
    page.mouse.click(ground["x"] + ground["width"] - 5, ground["y"] + ground["height"] / 2)
    fastest = float(run("mass").v.max())
    assert page.evaluate("views[0].contact.value('v', 0, views[0].row)") == pytest.approx(
        fastest, rel=0.2
    )
    press(page, "7")
    press(page, "Home", "Shift+ArrowRight")
    column = page.locator(".micro .column").nth(1).bounding_box()
    assert column is not None
    page.mouse.click(column["x"] + column["width"] / 2, column["y"] + 5)
    assert frame(page) == events(page)[1]


def test_two_runs_are_overlaid(open_page: Open) -> None:
    page = open_page("two", color_scheme="dark")
    press(page, *["Shift+ArrowRight"] * 12)
    presented(page)
    press(page, "4")
    assert page.locator(".pane.time").count() == 1
    lines = "views[0].open.right.plots.map(({ plot }) => plot.series.filter((s) => s.show).length)"
    assert page.evaluate(lines) == [1 + 2, 1 + 2 + 2, 1 + 2]
    seen = [each.inner_text() for each in page.locator(".ribbon b").all() if each.is_visible()]
    element = page.evaluate("views[0].element + 1")
    assert seen == [f"1: E{element}", f"2: E{element}"]
    press(page, "5")
    assert [each.is_visible() for each in page.locator(".pane.phase").all()] == [True, False]
    assert page.locator(".phase .other").first.get_attribute("d")
    press(page, "1")  # what cannot be overlaid stands side by side
    left, right = (each.bounding_box() for each in page.locator(".chart.pane").all())
    assert left is not None
    assert right is not None
    assert left["x"] + left["width"] <= right["x"]
    for each in page.locator(".chart svg").all():
        outer, inner = each.locator("..").bounding_box(), each.bounding_box()
        assert outer is not None
        assert inner is not None
        assert inner["width"] <= outer["width"] + 1
    assert faults(page) == []


def test_notes_beside_the_view_say_what_why_and_what_is_next(
    open_page: Open, tmp_path: Path
) -> None:
    page, trace = open_page(with_notes(tmp_path, "mass")), run("mass")
    whole = presented(page) and box_of(page, "main")["width"]
    press(page, "n", "Home")
    assert page.locator("#notes-button").get_attribute("aria-pressed") == "true"
    assert box_of(page, "main")["width"] < 0.65 * whole
    one, two = trace.transitions[:2]
    assert "Nothing slips yet." in told(page)
    begins = page.evaluate(f"timeText({float(one.t)!r}, 5)")
    assert f"then, at t = {begins}: It breaks away." in told(page)
    assert "element 1 is in stick; break_away_forward does not fire: " in told(page)
    assert f"element {one.element + 1} stick → slip (break_away_forward) at t = " in told(page)
    press(page, "Shift+ArrowRight")
    assert "It breaks away." in told(page)
    assert "Nothing slips yet." not in told(page)
    assert "break_away_forward fired" in told(page)
    assert "✓ z >= s, margin 0" in told(page)
    assert f"element {two.element + 1} {two.source} → {two.target}" in told(page)
    page.evaluate("go(frames.t.findIndex((t) => t >= 40) - 1)")
    assert "then, at t = 40.000 s: Far into the run." in told(page)
    press(page, "ArrowRight")
    assert page.locator("#notes .note").all_inner_texts() == ["Far into the run."]
    assert faults(page) == []
    press(page, "End")
    assert "Next transition\n\nnone\n" in told(page)
    press(page, "n")
    assert page.locator("#notes").is_hidden()
    assert box_of(page, "main")["width"] == whole
    press(page, "Escape", "n")  # begins a presentation, too
    assert page.locator("#notes").is_visible()
    assert page.locator("#slides").is_visible()


@pytest.mark.matrix
def test_notes_in_a_window_of_their_own_follow_and_drive_the_page(
    open_page: Open, tmp_path: Path
) -> None:
    page, wrong = open_page(with_notes(tmp_path, "published", "signed")), list[str]()
    with page.expect_popup() as opened:
        press(page, "N")
    notes = opened.value
    notes.on("console", lambda message: wrong.append(message.text))
    assert notes.title() == "Notes: noted"
    assert "Nothing slips yet." in told(notes)
    ground = notes.evaluate("getComputedStyle(document.body).backgroundColor")
    assert ground == page.evaluate("getComputedStyle(document.body).backgroundColor")
    press(notes, "Shift+ArrowRight", "5")
    assert frame(page) == events(page)[0]
    assert page.locator(".pane.phase").first.is_visible()
    for run_name in ("run 1: element 1 stick → slip", "run 2: element 1 stick → slip"):
        assert run_name in told(notes)
    assert faults(notes) == []
    notes.close()
    wait(page, "presenting.notes === null")
    assert page.locator("#notes").is_hidden()
    with page.expect_popup() as opened:
        press(page, "N")
    with opened.value.expect_event("close"):
        press(page, "Escape")
    page.evaluate("open = () => null")  # a browser that opens no windows
    press(page, "N")
    assert page.locator("#notes").is_visible()
    assert wrong == []
