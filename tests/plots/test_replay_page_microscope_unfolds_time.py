"""The microscope of the replay page has a column for every firing, with the log's F on both sides.

Columns are in the order of the log whatever the time between them, and no text covers another.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from plots.replay import write_replay
from tests.helpers import SINE, bank, matrix, open_loop, stick_slip
from tests.plots.browser import (
    Axe,
    Open,
    browser,
    events,
    frame,
    in_view,
    mass,
    open_page,
    open_tab,
    pages,
)
from tests.plots.systems_to_draw import BLOCKS, run

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow

PREFIXES = {"": 1.0, "k": 1e3, "m": 1e-3, "µ": 1e-6, "n": 1e-9, "p": 1e-12}
PANE = "#run1-microscope"


@cache
def ramp() -> Trace:
    """All four break away at one time."""
    return simulate(stick_slip("signed"), Prescribed("0.2*min(t, 5)"), 6.0)


@cache
def cascade() -> Trace:
    """Four break-aways within 8 ms."""
    return simulate(stick_slip("signed"), open_loop(), 20.0)


@cache
def many() -> Trace:
    return simulate(bank(20), Prescribed(SINE), 20.0)


RUNS = {"mass": mass, "ramp": ramp, "cascade": cascade, "many": many}


def opened(open_page: Open, folder: Path, name: str, size: str = "laptop", **options: Any) -> Any:
    page = open_page(write_replay(folder / "page.html", RUNS[name]()), size, **options)
    open_tab(page, "Microscope")
    return page


def go(page: Any, k: int) -> None:
    """Show a row after a transition, and wait for the picture."""
    page.evaluate(f"new Promise((done) => {{ go({k}); requestAnimationFrame(() => done()); }})")


# Columns in view in their order: element, edge, row and micro-step, left edge.
COLUMNS = """() => {
    const of = (node) => node.getBoundingClientRect();
    const box = of(document.querySelector(".micro .strip"));
    return [...document.querySelectorAll(".micro .column")]
        .filter((node) => of(node).left >= box.left && of(node).right <= box.right + 1)
        .sort((a, b) => of(a).left - of(b).left)
        .map((node) => {
            const cells = [...node.children], fires = cells.findIndex((c) => c.matches(".fires"));
            const foot = [...document.querySelectorAll(".micro .foot button")]
                .find((each) => Math.abs(of(each).left - of(node).left) < 1);
            return [fires, cells[fires].textContent.replace("\\n", ""), foot.textContent,
                    of(node).left, of(node).width, foot.getAttribute("aria-label")];
        });
}"""
# Texts in view, with their boxes: [text, kind, left, top, right, bottom], without what is scrolled
# away, which the box of the strip and its labels cover.
TEXTS = """() => {
    const of = (node) => node.getBoundingClientRect();
    const box = of(document.querySelector(".micro .strip"));
    const labels = of(document.querySelector(".micro .names")).right;
    const top = of(document.querySelector(".micro .top")).bottom;
    const foot = of(document.querySelector(".micro .foot")).top;
    const pane = document.querySelector(".micro");
    const walker = document.createTreeWalker(pane, NodeFilter.SHOW_TEXT);
    const found = [];
    while (walker.nextNode()) {
        const node = walker.currentNode, parent = node.parentElement;
        const range = document.createRange(), kind = parent.getAttribute("class") ?? "";
        if (!node.textContent.trim()) continue;
        range.selectNodeContents(node);
        const fixed = parent.closest(".names, .corner, .title"), inside = parent.closest(".rows");
        const rects = [...range.getClientRects()];
        const dotted = rects.length === 2 && rects[0].top === rects[1].top;  // with an ellipsis
        for (const one of dotted ? rects.slice(0, 1) : rects) {
            const seen = of(parent);  // a text that is too long is cut off by its box
            const left = Math.max(one.left, seen.left, fixed ? box.left : labels);
            const right = Math.min(one.right, seen.right, box.right);
            const upper = Math.max(one.top, inside ? top : box.top);
            const lower = Math.min(one.bottom, inside ? foot : box.bottom);
            if (right - left < 1 || lower - upper < 1) continue;
            found.push([node.textContent, kind, left, upper, right, lower]);
        }
    }
    return found;
}"""


def overlapping(page: Any) -> list[tuple[str, str]]:
    texts = page.evaluate(TEXTS)
    assert len(texts) > 20
    return [
        (a[0], b[0])
        for i, a in enumerate(texts)
        for b in texts[:i]
        if min(a[4], b[4]) - max(a[2], b[2]) > 0.5 and min(a[5], b[5]) - max(a[3], b[3]) > 2.5
    ]


def value(text: str) -> tuple[float, float]:
    """Return a value in engineering units, and half a unit of its last digit."""
    number, unit = text.replace("−", "-").split()
    factor = PREFIXES[unit.removesuffix("N")]
    return float(number) * factor, 0.5 * 10.0 ** -len(number.partition(".")[2]) * factor


def close(text: str, expected: float) -> bool:
    found, half = value(text)
    return abs(found - expected) <= half + 1e-6 * abs(expected)


def four(page: Any, trace: Trace, first: int) -> list[Any]:
    """Show the second of four firings; return their columns, checked against the log."""
    log = trace.transitions[first : first + 4]
    row = page.evaluate(f"runs[0].log[{first + 1}].row")
    go(page, row)
    columns = page.evaluate(COLUMNS)
    numbers = [
        int(page.evaluate(f"runs[0].number[runs[0].log[{first + k}].row]")) for k in range(4)
    ]
    at = [int(column[2].split("\n")[0]) for column in columns]
    columns = columns[at.index(numbers[0]) :][:4]
    assert [int(column[2].split("\n")[0]) for column in columns] == numbers
    assert [column[0] for column in columns] == log.element.tolist()
    assert [column[1] for column in columns] == log.edge.tolist()
    assert len({round(column[4]) for column in columns}) == 1  # equal widths
    for column, fired in zip(columns, log, strict=True):
        before, after = re.findall(r"F ([^,]+) before, (.+) after", column[5])[0]
        assert close(before, fired.F_before)
        assert close(after, fired.F_after)
    return columns


@pytest.mark.parametrize("name", ["mass", "ramp", "cascade"])
def test_every_firing_is_a_column_in_the_order_of_the_log(
    open_page: Open, tmp_path: Path, name: str
) -> None:
    page = opened(open_page, tmp_path, name)
    trace = RUNS[name]()
    count = len(trace.transitions)
    for first in range(0, count - 3, 4):
        four(page, trace, first)


def test_a_cascade_of_milliseconds_has_gaps_with_their_times(
    open_page: Open, tmp_path: Path
) -> None:
    page = opened(open_page, tmp_path, "cascade")
    log = cascade().transitions
    first = int(np.flatnonzero(log.t > 15.0)[0])
    assert 0.0 < np.ptp(log.t[first : first + 4]) < 0.01
    columns = four(page, cascade(), first)
    steps = np.diff([column[3] for column in columns]) - columns[0][4]
    assert (steps > 40).all()
    times = [text[0] for text in page.evaluate(TEXTS) if text[1] == "time"]
    gaps = np.diff(log.t[first : first + 4])
    for gap in gaps:
        assert f"+{1e3 * gap:.3g}".ljust(5, "0") + " ms" in times


def test_a_set_at_one_time_has_no_gaps(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "ramp")
    columns = four(page, ramp(), 0)
    assert np.diff([column[3] for column in columns]) == pytest.approx(columns[0][4], abs=0.1)
    texts = page.evaluate(TEXTS)
    assert [text[0] for text in texts if text[1] == "time"].count("+0") == 3
    assert [text[0] for text in texts if text[1] == "time first"] == ["2.000000 s"]
    # F is written once between two firings, and its stairs go down with it.
    written = [text for text in texts if text[1] == "value"]
    log = ramp().transitions
    for text, expected in zip(written, [log.F_before[0], *log.F_after], strict=True):
        assert close(text[0], expected)
    assert (np.diff([text[3] for text in written]) > 0).all()


@pytest.mark.parametrize("name", ["mass", "ramp", "cascade", "many"])
def test_no_text_covers_another(open_page: Open, tmp_path: Path, name: str) -> None:
    page = opened(open_page, tmp_path, name)
    for k in events(page)[:: 1 if name == "ramp" else 5]:
        for row in (k - 1, k, k + 1):
            go(page, row)
            assert overlapping(page) == []


def test_a_text_that_would_be_cut_off_is_left_out(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "mass")
    for k in events(page)[::7]:
        go(page, k)
        box = page.locator(".micro .strip").bounding_box()
        widths = page.evaluate(
            """() => views[0].open.right.texts.filter((node) => node.textContent)
                .map((node) => node.getBoundingClientRect()).map((box) => [box.left, box.right])"""
        )
        assert len(widths) > 5
        labels = page.locator(".micro .names").bounding_box()["width"]
        for left, right in widths:
            assert box["x"] + labels <= left + 2  # a halo
            assert right - 2 <= box["x"] + box["width"]


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_the_line_of_the_element_that_fires_is_in_view(
    open_page: Open, tmp_path: Path, size: str
) -> None:
    page = opened(open_page, tmp_path, "many", size)
    seen = set()
    for k in events(page)[:60]:
        go(page, k)
        element = page.evaluate("views[0].element")
        seen.add(element)
        inside = page.evaluate(
            """() => {
                const of = (q) => document.querySelector(q).getBoundingClientRect();
                const name = of(".micro .names .chosen");
                return name.top >= of(".micro .top").bottom - 1
                    && name.bottom <= of(".micro .foot").top + 1;
            }"""
        )
        assert inside, element
        assert page.locator(".micro .names .chosen").inner_text() == f"E{element + 1}"
    assert len(seen) == 20
    assert size == "phone" or in_view(page, ".micro .names .chosen")


def test_the_column_of_the_row_stays_in_the_middle(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "mass")
    middles = []
    for k in events(page)[12:40]:
        go(page, k)
        assert page.locator(".micro .foot .now").count() == 1
        box = page.locator(".micro .foot .now").bounding_box()
        middles.append(box["x"] + box["width"] / 2)
    assert np.ptp(middles) <= 1.0
    strip = page.locator(".micro .strip").bounding_box()
    labels = page.locator(".micro .names").bounding_box()["width"]
    middle = strip["x"] + (labels + strip["width"]) / 2
    assert middles[0] == pytest.approx(middle, abs=8)  # a bar to scroll


def test_a_click_on_a_column_goes_to_its_row(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "mass")
    go(page, events(page)[8])
    log = page.evaluate("runs[0].log.map((entry) => entry.row)")
    columns = page.evaluate(COLUMNS)
    numbers = [int(column[2].split("\n")[0]) for column in columns]
    wanted = columns[-1]
    y = page.locator(".micro .rows").bounding_box()["y"] + 10
    page.mouse.click(wanted[3] + wanted[4] / 2, y)
    assert page.evaluate("runs[0].number[views[0].row]") == numbers[-1]
    assert frame(page) in log
    # In a gap: the last row before the next firing.
    gap, after = page.evaluate(
        """() => {
            const { strip, nodes } = views[0].open.right, here = strip.place(views[0].row);
            const k = [...nodes.keys()].find((k) => nodes.get(k).gap && here < strip.gaps[k]);
            const box = nodes.get(k).gap.getBoundingClientRect();
            return [[box.left + box.width / 2, box.right], strip.rows[k]];
        }"""
    )
    assert gap[1] < 1366
    page.mouse.click(gap[0], y)
    assert frame(page) == after - 1


def test_the_button_below_a_column_goes_to_its_row(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "mass")
    go(page, events(page)[8])
    button = page.locator(".micro .foot button:not(.now)").last
    number = int(re.match(r"\d+", button.inner_text())[0])
    button = page.locator(".micro .foot button", has_text=re.compile(rf"^{number}\b"))
    button.click()
    assert page.evaluate("runs[0].number[views[0].row]") == number
    assert "now" in (button.get_attribute("class") or "")


def test_rows_between_firings_are_in_the_gap(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "mass")
    a, b = events(page)[7:9]
    places = []
    for row in range(a + 1, b):
        go(page, row)
        assert page.locator(".micro .foot .now").count() == 0
        assert page.locator(".micro .line").is_visible()
        places.append(page.evaluate(f"views[0].open.right.strip.place({row})"))
    assert (np.diff(places) >= 0).all()
    assert places[-1] > places[0]


def test_states_are_those_of_the_run(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "mass")
    trace = mass()
    for k in events(page)[10:20]:
        go(page, k)
        row = page.evaluate("runs[0].number[views[0].row]")
        classes = page.evaluate(
            """() => {
                const at = views[0].open.right, k = at.strip.at(at.strip.place(views[0].row));
                return [...at.nodes.get(k).column.children]
                    .map((cell) => (cell.matches(".fires") ? cell.children[1] : cell).className);
            }"""
        )
        assert classes == [f"state{int(state == 'slip')}" for state in trace.states[row]]


def test_a_run_without_transitions_says_so(open_page: Open, tmp_path: Path) -> None:
    still = simulate(stick_slip("signed"), Prescribed("1e-3*sin(t)"), 2.0)
    assert len(still.transitions) == 0
    page = open_page(write_replay(tmp_path / "page.html", still), "laptop")
    open_tab(page, "Microscope")
    assert "no transitions" in page.locator(PANE).inner_text()


def test_all_contacts_of_a_system_have_lines(open_page: Open, tmp_path: Path) -> None:
    trace = run(BLOCKS)
    page = open_page(write_replay(tmp_path / "page.html", trace), "laptop")
    open_tab(page, "Microscope")
    names = page.locator(".micro .names b").all_inner_texts()
    assert {name.split()[0] for name in names} == set(trace.contacts)
    for k in events(page)[:10]:
        go(page, k)
        name, contact = page.evaluate(
            "[document.querySelector('.micro .names .chosen').textContent, views[0].contact.name]"
        )
        assert name.startswith(contact)


EVERY = [(n, scheme) for n in ("mass", "many") for scheme in ("light", "dark")]


@pytest.mark.parametrize(("name", "scheme"), matrix(EVERY, [("mass", "light"), ("many", "dark")]))
def test_axe_finds_no_accessibility_problem(
    open_page: Open, tmp_path: Path, name: str, scheme: str
) -> None:
    page = opened(open_page, tmp_path, name, color_scheme=scheme)
    open_tab(page, "Bristles")
    for k in events(page)[4:6]:
        go(page, k)
        found = Axe().run(page).response["violations"]
        assert [(v["id"], [n["target"] for n in v["nodes"]][:3]) for v in found] == []


def test_a_picture_takes_less_than_10_ms(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, "many")
    times = page.evaluate(
        """async () => {
            const times = [], pane = views[0].open.right;
            for (const k of events.concat(events.map((k) => k - 1))) {
                await new Promise(requestAnimationFrame);
                views[0].row = k;
                const begin = performance.now();
                pane.show();
                times.push(performance.now() - begin);
            }
            return times;
        }"""
    )
    # The median, because other programs may interrupt some.
    assert float(np.median(times)) < 10.0
