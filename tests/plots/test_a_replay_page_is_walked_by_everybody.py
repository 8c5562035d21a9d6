"""A replay page is walked, zoomed, played and searched by everybody, whatever its data.

By mouse and by keys alike, on every screen; axe finds nothing; hostile texts and NaN are texts.
"""

from __future__ import annotations

import html
import re
from pathlib import Path

import numpy as np
import pytest

from gms_fsm.errors import ExpressionError
from gms_fsm.language import (
    ARGUMENTS,
    CONSTANTS,
    ELEMENTARY,
    FUNCTIONS,
    SEVERAL,
    evaluate,
    parse_condition,
)
from gms_fsm.session.session import Session
from plots.page.replay import replay
from tests.plots.browser import (
    EVIL,
    SIZES,
    Open,
    box_of,
    browser,
    events,
    faults,
    frame,
    last,
    open_page,
    open_tab,
    press,
    run,
    said,
    until,
    wait,
    window,
)

__all__ = ["browser", "open_page"]

pytestmark = pytest.mark.slow

KEYS = {
    "step": "ArrowRight",
    "back": "ArrowLeft",
    "transition": "Shift+ArrowRight",
    "back-transition": "Shift+ArrowLeft",
    "start": "Home",
}


def test_a_run_is_walked_by_buttons_keys_scrubber_and_list(open_page: Open) -> None:
    page = open_page("published")
    (first, second, *_), end = events(page), last(page)
    way = ("step", "transition", "transition", "back-transition", "back", "start", "back")
    places = (1, first, second, first, first - 1, 0, 0)
    for button, expected in zip(way, places, strict=True):
        page.click(f"#{button}")
        assert frame(page) == expected, button
    for button, expected in zip(way, places, strict=True):
        press(page, KEYS[button])
        assert frame(page) == expected, button
    press(page, "End", "Shift+ArrowRight")
    assert frame(page) == end
    scrubber, box = page.locator("#scrubber"), box_of(page, "#scrubber")
    y = box["y"] + box["height"] / 2
    page.mouse.click(box["x"] + box["width"] / 2, y)
    assert page.evaluate("frames.t[frame]") == pytest.approx(50.0, abs=1.0)
    page.locator("#scale").select_option("rows")
    page.mouse.click(box["x"] + 0.75 * box["width"], y)
    assert frame(page) == pytest.approx(0.75 * end, abs=12)
    scrubber.focus()
    here = frame(page)
    press(page, "ArrowUp")
    assert frame(page) == here + 1
    press(page, "Shift+ArrowRight")
    assert frame(page) == min(k for k in events(page) if k > here + 1)
    open_tab(page, "Transitions")
    assert page.locator(".log option").count() == len(events(page)) == 50
    page.locator(".log select").select_option(index=7)
    assert frame(page) == page.evaluate("frames.of[0][runs[0].log[7].row]")
    assert "element 4 slip → stick (arrest)" in said(page)


def test_rows_and_elements_are_those_of_the_trace(open_page: Open) -> None:
    page, trace = open_page("published"), run("published")
    values, who = page.locator(".values"), page.locator(".who")
    for _ in range(12):
        press(page, "Shift+ArrowRight")
        found = re.search(r"row (\d+) of (\d+)", values.inner_text())
        assert found is not None
        row = int(found[1])
        assert int(found[2]) == len(trace)
        assert trace.t[row] == page.evaluate("frames.t[frame]")
        assert trace.microstep[row] == page.evaluate("runs[0].microstep[views[0].row]")
    sample = page.evaluate("runs[0].between.indexOf(1)")
    page.evaluate(f"show({sample})")
    before = int(np.searchsorted(trace.t, page.evaluate("frames.t[frame]"))) - 1
    assert f"after row {before} " in values.inner_text() + " "
    heard = page.locator("#scrubber").get_attribute("aria-valuetext")
    assert (heard or "").endswith(f" s, after row {before}")
    press(page, "f", "2")  # a pinned element stays selected
    assert page.locator("#follow").get_attribute("aria-pressed") == "false"
    assert page.locator(".region.chosen").get_attribute("id") == "element2"
    press(page, *["Shift+ArrowRight"] * 8)
    assert page.evaluate("views[0].element") == 1
    page.locator(".token").nth(3).click()
    assert page.locator(".region.chosen").get_attribute("id") == "element4"
    page.locator("#element3 .frame").click(position={"x": 20, "y": 40})
    assert who.inner_text() == "Guards of element 3"
    press(page, "9")  # the last there is
    assert who.inner_text() == "Guards of element 4"
    page.click("#follow")
    assert page.evaluate("runs[0].fired.get(views[0].row).element === views[0].element")
    page = open_page("late")  # rows before the first requested time are before it
    press(page, *["Shift+ArrowRight"] * 4)
    assert page.evaluate("frames.t[frame]") < 50.0
    assert "before row 0" in page.locator(".values").inner_text()
    page.evaluate("show(frames.t.findIndex((t) => t > 50.0))")
    assert "after row 0" in page.locator(".values").inner_text()


def test_time_is_zoomed_by_buttons_keys_and_dragging(open_page: Open) -> None:
    page = open_page("published")
    page.evaluate("go(events[19])")
    page.click("#zoom-in")
    press(page, "+")
    low, high = window(page)
    assert (low + high) / 2 == pytest.approx(page.evaluate("frames.t[frame]"))
    assert high - low == pytest.approx(25.0)
    scales = page.evaluate(
        "views[0].open.right.plots.map(({plot}) => [plot.scales.x.min, plot.scales.x.max])"
    )
    assert scales == [[low, high]] * 4
    press(page, "End", "-")
    assert window(page)[1] == 100.0
    page.click("#zoom-all")
    assert window(page) == (0.0, 100.0)
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
    low, high = window(page)
    assert (low, high) == pytest.approx((40.0, 60.0), abs=0.5)
    assert frame(page) == here
    part = (page.evaluate("frames.t[frame]") - low) / (high - low)
    assert box_of(page, ".cursor")["x"] == pytest.approx(box["x"] + box["width"] * part, abs=2)
    area.dblclick(position={"x": box["width"] / 2, "y": 30})
    assert window(page) == (0.0, 100.0)
    press(page, "+", "0", "Home", "Shift+ArrowRight")  # into micro-steps
    assert window(page) == (0.0, 100.0)
    page.evaluate("for (let k = 0; k < 28; k++) document.querySelector('#zoom-in').click()")
    press(page, *["ArrowRight"] * 6)
    low, high = window(page)
    assert 0.0 < high - low < 1e-6


# --------------------------------------------------------------------------- playing
# Every frame shown while the clock of the page is moved by hand, in steps of 1/60 s.
PLAYED = """(speed) => {
    document.querySelector("#speed").value = speed;
    Object.assign(play, { on: true, t: frames.t[frame], held: 0, at: 0 });
    const shown = [];
    let now = 0;
    while (play.on && now < 90000) {
        now += 1000 / 60;
        play.held -= 1000 / 60;
        if (play.held <= 0) move(1000 / 60, speed);
        shown.push([now, frame]);
    }
    return shown;
}"""


def test_playing_is_silent_stops_on_demand_and_stays_at_every_micro_step(open_page: Open) -> None:
    page = open_page("mass")
    play, say = page.locator("#play"), page.locator("#say")
    press(page, "Space")
    wait(page, "frame > 3")
    assert say.get_attribute("aria-live") == "off"
    assert play.get_attribute("aria-pressed") == "true"
    press(page, "Space")
    here = frame(page)
    page.wait_for_timeout(100)
    assert frame(page) == here
    assert say.get_attribute("aria-live") == "polite"
    page.evaluate("show(last - 6)")  # row by row, each for half a second
    rows = [k for _, k in page.evaluate(PLAYED, "rows")]
    assert sorted(set(rows)) == list(range(last(page) - 5, last(page) + 1))
    assert rows.count(last(page) - 3) == pytest.approx(30, abs=1)
    page.evaluate("play.on = false")
    page.locator("#speed").select_option("20")
    press(page, "End", "ArrowLeft")
    play.click()
    wait(page, "!play.on")
    assert frame(page) == last(page)
    assert "end of the run" in said(page)
    page.locator("#element1-guard-break_away_forward").click()
    page.evaluate("show(events[0] - 4)")
    play.click()
    wait(page, "!play.on")
    assert frame(page) == events(page)[0] - 1
    page = open_page("mass")
    page.evaluate("show(frames.t.findIndex((t) => t > 40))")
    times, transitions, start = page.evaluate("[[...frames.t], [...eventFrames], frame]")
    transitions = [k for k in transitions if k > start]
    shown = page.evaluate(PLAYED, "20")
    assert set(transitions) <= {k for _, k in shown}  # none is passed over
    hold = min(400.0, 20_000.0 / page.evaluate("events.length"))
    stays = {k: sum(each == k for _, each in shown) * 1000 / 60 for k in transitions}
    assert min(stays.values()) >= hold - 1000 / 30
    # Away from transitions the clock takes 20 s for the whole run.
    moving = [
        times[after] - times[k]
        for (_, k), (_, after) in zip(shown, shown[60:], strict=False)
        if not any(k <= event <= after for event in transitions) and after < last(page)
    ]
    assert len(moving) > 20
    assert moving[::3] == pytest.approx([3.0] * len(moving[::3]), abs=0.4)  # 60 s / 20
    page = open_page("mass", reduced_motion="reduce")
    assert page.locator("#speed").input_value() == "rows"


# --------------------------------------------------------------------------- searching
CANNOT_BE_READ = [
    ("F >", 4, "the text ends too early"),
    ("F == 1", 3, "only < <= > >="),
    ("alert(1) > 0", 1, 'unknown "alert"'),
    ("(F > 1) + 1 > 0", 1, "a number is needed"),
    ("state(9) == slip", 7, "an element, 1 to 4"),
    ("state(1) == melt", 13, "a state: stick, slip"),
    ("min(F) > 1", 1, "min got 1 arguments"),
    ("F > 1_000", 5, "cannot read"),  # formats that only Python has
    ("F > 0x10", 5, "cannot read"),
    ("v > 3 mm", 5, "3 mm is not in m/s"),
    ("F > 1 N and z1 > 3 mm/s", 18, "3 mm/s is not in m"),
]


def test_breakpoints_and_conditions_stop_where_they_become_true(open_page: Open) -> None:
    page = open_page("published")
    guard = page.locator("#element1-guard-break_away_forward")
    guard.focus()
    press(page, "Enter")
    assert guard.get_attribute("aria-pressed") == "true"
    press(page, "Space")
    assert guard.get_attribute("aria-pressed") == "false"
    assert frame(page) == 0  # the space was the guard's
    button = page.locator("tbody button").first
    button.focus()
    press(page, "Space")
    assert button.get_attribute("aria-pressed") == guard.get_attribute("aria-pressed") == "true"
    assert button.evaluate("node => node === document.activeElement")
    press(page, "c")
    assert frame(page) == events(page)[0] - 1
    guard.click()
    page.click("#start")
    guard = page.locator("#element2-guard-arrest")
    guard.click()
    page.click("#continue")
    assert "breakpoint: element 2, arrest" in said(page)
    here = frame(page)
    assert page.evaluate(
        "views[0].contact.clauses(2, views[0].contact.scope(1, frame)).map((c) => c.truth)"
    ) == [1, 1]
    press(page, "Shift+ArrowRight", "Shift+ArrowRight")
    assert "element 2 slip → stick (arrest)" in said(page)
    press(page, "c")
    assert frame(page) > here + 2
    guard.click()
    press(page, "c")
    assert "end of the run: no breakpoint" in said(page)

    press(page, "Home")
    for text, column, reason in CANNOT_BE_READ:
        until(page, text)
        assert f"column {column}: " in said(page), text
        assert reason in said(page), text
        assert page.locator("#until").get_attribute("aria-invalid") == "true", text
        assert frame(page) == 0, text
    until(page, "F > 1")
    assert page.evaluate("runs[0].names.F(frame) > 1 && runs[0].names.F(frame - 1) <= 1")
    assert "F > 1 became true" in said(page)
    here = frame(page)
    page.click("#start")
    until(page, "F > 1000 mN")
    assert frame(page) == here
    page.fill("#until", "state(2) == slip and not z1 < 0")
    page.click("#continue")
    assert page.evaluate("runs[0].contacts[0].modes[1][frame]") == 1
    until(page, "t > 1e9")
    assert "end of the run: nothing stopped it" in said(page)
    page.fill("#until", "c -")  # letters in the box are no keys
    assert frame(page) == last(page)
    page.press("#until", "Escape")
    press(page, "Home")
    assert frame(page) == 0


TEXTS = [
    "F > 1", "-1 < F < 1", "not F > 1 or v < 0 and z1 > 0.2", "(F > 1 or v > 0) and x > 0.1",
    "abs(z1) >= s1", "2 * F1 + 3 > F2 ** 2 / 4 - 1", "-x ** 2 < -0.01", "2 ** -1 < x",
    "min(z1, z2, z3) < max(v, 0.1)", "state(3) == slip", "state(3) != slip and t > 20",
    "((F)) > ((1))", "t >= 3.5e1 or t < 2.", "+F > - -1", "not not v > 0", "1 / v > 20", "F >",
    "", "F = 1", "F > 1 and", "v", "not 3", "(v > 0) > 1", "abs v > 1", "abs(1, 2) > 1", "z9 > 1",
    "F > 1 &&  v > 0", "'a' > 1", "F[0] > 1", "F.x > 1", "state(0) == slip", "state(1) > 1",
    "v > 0 if 1 else 0", "1 < v == 2", "()", "min(1, 2) > 1, 2", "3x > 1", "lambda: 1", "a := 1",
    "not(v > 0)", "v > (0", "v > 0)", "__proto__ > 0", "toString > 1", "constructor > 0", "v <> 1",
    "1 > 2 > not v > 0", "**v > 1", "F neg 1 > 0", "F not > 1", "F > 1; x",
    *(f"{name}({'v, z1' if name in SEVERAL else 'v'}) > 0.1" for name in FUNCTIONS),
    *(f"{name} * v > 0.1" for name in CONSTANTS),
    "mod(t, 2) < 1", "quantise(F, 2) > 2", "saturate(v, 0, 0.1) > 0.05", "if(v > 0, F, 1 / 0) > 1",
    "if(not v > 0 and F < 1, 1, 2) == 2", "floor(t) == 3 or round(t) != 4", "t == 3",
    "if(v, 1, 2) > 1", "mod(t) > 1", "round(t) == 1.5", "floor(t) < 3 == 1", "min(v) > 1",
    "if(v > 0, 1) > 0", "noise(10 * t, 3) > 0.2", "noise(t) > 0",
]  # fmt: skip


def test_functions_have_the_bits_of_python(open_page: Open) -> None:
    """Those of a browser, and its power, are rounded in another way."""
    page = open_page("published")
    pairs = np.random.default_rng(0).uniform(0.1, 9.0, (2000, 2)).tolist()
    for name, function in ELEMENTARY.items():
        own = "**" if name == "pow" else name
        given = [pair[: ARGUMENTS[name]] for pair in pairs]
        found = page.evaluate(
            "([name, all]) => all.map((u) => FUNCTIONS[name](...u))", [own, given]
        )
        assert found == [function(*each) for each in given], name


def test_until_reads_what_the_expression_language_reads(open_page: Open) -> None:
    """Same texts accepted, same texts rejected, same truths, up to rounding."""
    page, trace = open_page("published"), run("published")
    session = Session(trace.model, trace.rig, 1.0)
    rows = page.evaluate(
        """() => [...frames.t].map((_, row) => Object.fromEntries([
            ...Object.entries(runs[0].names).map(([name, f]) => [name, f(row)]),
            ...runs[0].contacts[0].modes.map((mode, i) =>
                [`state(${i + 1})`, runs[0].contacts[0].states[mode[row]]]),
        ]))"""
    )
    accepted = 0
    for text in TEXTS:
        got = page.evaluate(
            """(text) => {
                try {
                    const f = condition(text, runs[0]);
                    return [...frames.t].map((_, row) => f(row));
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


# --------------------------------------------------------------------------- everybody
SCREENS = [("two", "laptop", "light"), ("published", "phone", "dark"), ("many", "tablet", "dark")]


@pytest.mark.every(3)
@pytest.mark.parametrize(("name", "size", "scheme"), SCREENS)
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
    if size == "phone":  # the chosen element is large enough to be read
        page = open_page(name, size)
        page.locator(".token").nth(2).click()
        chart = box_of(page, ".chart.pane")
        assert box_of(page, "#element3 .frame")["height"] > 0.9 * chart["height"]
    if size == "laptop":  # the controls are one row
        middles = page.evaluate(
            """() => [...document.querySelectorAll("#controls :is(button, select, input)")]
                .map((node) => node.getBoundingClientRect()).filter(({ width }) => width > 0)
                .map(({ top, bottom }) => (top + bottom) / 2)"""
        )
        assert len(middles) > 15
        assert max(middles) - min(middles) < 8


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
    for _ in range(80):
        press(page, "Tab")
        name, line, ground = page.evaluate(FOCUSED)
        seen.add(name)
        assert name == "BODY" or line == "solid" or ground == "3px", name
    assert set(CONTROLS.split()) <= seen


def test_hostile_names_nan_and_any_unit_are_shown_also_in_the_frame_of_a_notebook(
    open_page: Open, tmp_path: Path
) -> None:
    page = open_page("evil")
    assert page.title() == EVIL
    assert page.locator("h1").inner_text() == EVIL
    assert EVIL in page.locator(".head h2").inner_text()
    assert page.locator("img").count() == 0

    page, texts = open_page("no numbers"), []
    cells = page.locator("tbody tr").nth(1).locator("td").all_inner_texts()
    assert cells[1:4] == ["✗ false", "not a number m/s", "not a number m/s"]
    for _ in range(3):
        texts.append(page.locator(".values").inner_text())
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

    for name, scale, unit in (("microseconds", 1e-6, "µs"), ("megaseconds", 1e6, "Ms")):
        page = open_page(name)
        assert page.locator(".time-unit").inner_text() == f"t [{unit}]"
        assert page.evaluate("10 ** TIME_POWER") == pytest.approx(scale)

    path = tmp_path / "notebook.html"
    path.write_text(f"<!DOCTYPE html><title>n</title>{replay(run('signed'))._repr_html_()}")
    page = open_page(path)
    inside = page.frame_locator("iframe")
    inside.locator("#transition").click()
    inside.locator(".guard.fired").wait_for()
    assert inside.locator(".guard.fired").count() == 1
    assert html.escape("sandbox") in page.content()
