"""The replay page is walked, zoomed, played and searched, by mouse and by keys alike."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gms_fsm.errors import ExpressionError
from gms_fsm.language import CONSTANTS, ELEMENTARY, FUNCTIONS, SEVERAL, evaluate, parse_condition
from gms_fsm.session.session import Session
from tests.plots.browser import (
    Open,
    box_of,
    browser,
    events,
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


def test_a_run_is_walked_by_buttons_keys_scrubber_and_list(open_page: Open) -> None:
    page = open_page("published")
    (first, second, *_), end = events(page), last(page)
    for button, expected in (
        ("step", 1),
        ("step", 2),
        ("back", 1),
        ("transition", first),
        ("transition", second),
        ("back-transition", first),
        ("start", 0),
        ("back", 0),
    ):
        page.click(f"#{button}")
        assert frame(page) == expected, button
    for key, expected in (
        ("ArrowRight", 1),
        ("ArrowRight", 2),
        ("ArrowLeft", 1),
        ("Shift+ArrowRight", first),
        ("Shift+ArrowRight", second),
        ("Shift+ArrowLeft", first),
        ("End", end),
        ("Shift+ArrowRight", end),
        ("Home", 0),
        ("Shift+ArrowLeft", 0),
    ):
        press(page, key)
        assert frame(page) == expected, key
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
    assert "row" in (scrubber.get_attribute("aria-valuetext") or "")
    path = page.locator("#ticks path").first.get_attribute("d") or ""
    marks = [float(x) for x in re.findall(r"M([\d.]+) 0V1", path)]
    assert marks == pytest.approx([1000 * k / end for k in events(page)], abs=0.06)
    open_tab(page, "Transitions")
    assert page.locator(".log option").count() == len(events(page)) == 50
    page.locator(".log select").select_option(index=7)
    assert frame(page) == page.evaluate("frames.of[0][runs[0].log[7].row]")
    assert page.locator(".log select").evaluate("node => node.selectedIndex") == 7
    assert "element 4 slip → stick (arrest)" in said(page)


def test_rows_and_elements_are_those_of_the_trace(open_page: Open) -> None:
    page, trace = open_page("published"), run("published")
    values = page.locator(".values")
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
    for _ in range(8):
        press(page, "Shift+ArrowRight")
        assert page.evaluate("views[0].element") == 1
    page.locator(".token").nth(3).click()
    assert page.locator(".region.chosen").get_attribute("id") == "element4"
    page.locator("#element3 .frame").click(position={"x": 20, "y": 40})
    assert page.locator(".who").inner_text() == "Guards of element 3"
    press(page, "9")  # the last there is
    assert page.locator(".who").inner_text() == "Guards of element 4"
    page.click("#follow")
    fired = page.evaluate("runs[0].fired.get(views[0].row).element")
    assert page.evaluate("views[0].element") == fired
    page = open_page("late")  # rows before the first requested time are before it
    for _ in range(4):
        press(page, "Shift+ArrowRight")
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
    press(page, "End")
    low, high = window(page)
    assert low < 100.0 <= high
    press(page, "-")
    assert window(page)[1] <= 100.0
    for show_all in (lambda: press(page, "0"), lambda: page.click("#zoom-all")):
        press(page, "+")
        show_all()
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
    pieces = page.locator(".ribbon").first.locator("i").count()
    area.dblclick(position={"x": box["width"] / 2, "y": 30})
    assert window(page) == (0.0, 100.0)
    assert page.locator(".ribbon").first.locator("i").count() > pieces
    press(page, "Home", "Shift+ArrowRight")  # into micro-steps
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


def test_playing_moves_silently_and_stops_on_demand_at_breakpoints_and_at_the_end(
    open_page: Open,
) -> None:
    page = open_page("published")
    press(page, "Space")
    wait(page, "frame > 3")
    assert page.locator("#say").get_attribute("aria-live") == "off"
    assert page.locator("#play").get_attribute("aria-pressed") == "true"
    press(page, "Space")
    here = frame(page)
    page.wait_for_timeout(100)
    assert frame(page) == here
    assert page.locator("#say").get_attribute("aria-live") == "polite"
    page.click("#play")
    wait(page, f"frame > {here}")
    page.click("#play")
    assert page.locator("#play").get_attribute("aria-pressed") == "false"
    page.evaluate("show(last - 6)")  # row by row, each for half a second
    rows = [k for _, k in page.evaluate(PLAYED, "rows")]
    assert sorted(set(rows)) == list(range(last(page) - 5, last(page) + 1))
    assert rows.count(last(page) - 3) == pytest.approx(30, abs=1)
    page.evaluate("play.on = false")
    page.locator("#speed").select_option("20")
    press(page, "End", "ArrowLeft")
    page.click("#play")
    wait(page, "!play.on")
    assert frame(page) == last(page)
    assert "end of the run" in said(page)
    page.locator("#element1-guard-break_away_forward").click()
    page.evaluate("show(events[0] - 4)")
    page.click("#play")
    wait(page, "!play.on")
    assert frame(page) == events(page)[0] - 1


def test_playing_stays_at_every_micro_step_and_is_uniform_between(open_page: Open) -> None:
    page = open_page("mass")
    assert page.locator("#speed").input_value() == "20"
    page.evaluate("show(frames.t.findIndex((t) => t > 40))")
    times, transitions, start = page.evaluate("[[...frames.t], [...eventFrames], frame]")
    transitions = [k for k in transitions if k > start]
    shown = page.evaluate(PLAYED, "20")
    first = {}
    for now, k in shown:
        first.setdefault(k, now)
    assert set(transitions) <= first.keys()  # none is passed over
    hold = min(400.0, 20_000.0 / page.evaluate("events.length"))
    stays = {k: sum(each == k for _, each in shown) * 1000 / 60 for k in transitions}
    assert min(stays.values()) >= hold - 1000 / 30
    # Away from transitions the clock takes 20 s for the whole run.
    end = last(page)
    moving = [
        (now, times[k], times[after])
        for (now, k), (_, after) in zip(shown, shown[60:], strict=False)
        if not any(k <= event <= after for event in transitions) and after < end
    ]
    assert len(moving) > 20
    for _, begin, finish in moving[::3]:
        assert finish - begin == pytest.approx(3.0, abs=0.4)  # 60 s / 20 s times one second
    page = open_page("mass", reduced_motion="reduce")
    assert page.locator("#speed").input_value() == "rows"


# --------------------------------------------------------------------------- searching
def test_breakpoints_are_set_by_click_and_keys_and_stop_where_the_guard_becomes_true(
    open_page: Open,
) -> None:
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
    assert button.get_attribute("aria-pressed") == "true"
    assert guard.get_attribute("aria-pressed") == "true"
    assert button.evaluate("node => node === document.activeElement")
    press(page, "c")
    assert frame(page) == events(page)[0] - 1
    guard.click()
    assert guard.get_attribute("aria-pressed") == "false"
    page.click("#start")
    guard = page.locator("#element2-guard-arrest")
    guard.click()
    assert guard.get_attribute("aria-pressed") == "true"
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
    assert guard.get_attribute("aria-pressed") == "false"
    press(page, "c")
    assert "end of the run: no breakpoint" in said(page)


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
    ("F > 1_000", 5, "cannot read"),  # formats that only Python has
    ("F > 0x10", 5, "cannot read"),
]


def test_until_stops_at_the_first_row_where_it_holds_and_says_what_it_cannot_read(
    open_page: Open,
) -> None:
    page = open_page("published")
    for text, column, reason in CANNOT_BE_READ:
        until(page, text)
        assert f"column {column}: " in said(page), text
        assert reason in said(page), text
        assert page.locator("#until").get_attribute("aria-invalid") == "true", text
        assert frame(page) == 0, text
    until(page, "F > 1")
    assert page.evaluate("runs[0].names.F(frame) > 1 && runs[0].names.F(frame - 1) <= 1")
    assert "F > 1 became true" in said(page)
    page.fill("#until", "state(2) == slip and not z1 < 0")
    page.click("#continue")
    assert page.evaluate("runs[0].contacts[0].modes[1][frame]") == 1
    until(page, "t > 1e9")
    assert "end of the run: nothing stopped it" in said(page)
    page.fill("#until", "c -")
    assert frame(page) == last(page)
    page.press("#until", "Escape")
    press(page, "Home")
    assert frame(page) == 0


TEXTS = [
    "F > 1", "-1 < F < 1", "not F > 1 or v < 0 and z1 > 0.2", "(F > 1 or v > 0) and x > 0.1",
    "abs(z1) >= s1", "2 * F1 + 3 > F2 ** 2 / 4 - 1", "-x ** 2 < -0.01", "2 ** -1 < x",
    "min(z1, z2, z3) < max(v, 0.1)", "sgn(v) <= 0", "sqrt(s) > 1.1", "sin(pi * t) > .5",
    "state(3) == slip", "state(3) != slip and t > 20", "((F)) > ((1))", "cos(t) * tanh(v) < 0",
    "exp(-t) < 1e-3", "t >= 3.5e1 or t < 2.", "+F > - -1", "not not v > 0", "1 / v > 20", "F >",
    "", "F = 1", "F > 1 and", "v", "not 3", "(v > 0) > 1", "abs v > 1", "abs(1, 2) > 1", "z9 > 1",
    "F > 1 &&  v > 0", "'a' > 1", "F[0] > 1", "F.x > 1", "state(0) == slip", "state(1) > 1",
    "v > 0 if 1 else 0", "1 < v == 2", "()", "min(1, 2) > 1, 2", "3x > 1", "lambda: 1", "a := 1",
    "not(v > 0)", "v > (0", "v > 0)", "__proto__ > 0", "toString > 1", "v <> 1",
    "1 > 2 > not v > 0", "**v > 1", "F neg 1 > 0", "F not > 1",
    *(f"{name}({'v, z1' if name in SEVERAL else 'v'}) > 0.1" for name in FUNCTIONS),
    *(f"{name} * v > 0.1" for name in CONSTANTS),
]  # fmt: skip


def test_functions_have_the_bits_of_python(open_page: Open) -> None:
    """Those of a browser, and its power, are rounded in another way."""
    page = open_page("published")
    pairs = np.random.default_rng(0).uniform(0.1, 9.0, (2000, 2)).tolist()
    for name, function in ELEMENTARY.items():
        own, given = ("**", pairs) if name == "pow" else (name, [pair[:1] for pair in pairs])
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
