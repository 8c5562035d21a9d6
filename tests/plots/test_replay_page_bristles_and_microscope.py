"""The bristles and the microscope of the replay page move with the row and show the run.

Contacts are where z puts them, pegs show where contacts do not move, the ground moves with x. Every
firing is a column, in the order of the log, with the log's F on both sides; no text covers another.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from gms_fsm import Trace
from tests.helpers import matrix
from tests.plots.browser import (
    Open,
    at_rows,
    box_of,
    browser,
    events,
    frame,
    in_view,
    open_page,
    open_tab,
    run,
    some_rows,
)

__all__ = ["browser", "open_page"]

pytestmark = pytest.mark.slow

PREFIXES = {"": 1.0, "k": 1e3, "m": 1e-3, "µ": 1e-6, "n": 1e-9, "p": 1e-12}

# Of each element: x of its contact, peg, arrow and its direction, springs, texts.
ELEMENTS = """() => [...document.querySelectorAll(".bristles .element")].map((element) => {
    const seen = (query) => {
        const node = element.querySelector(query);
        return node !== null && getComputedStyle(node).visibility === "visible";
    };
    const at = (query) => element.querySelector(query).getCTM().e;
    const way = element.querySelector(".way");
    return {
        x: at(".foot"), peg: seen(".peg"), arrow: seen(".way"),
        way: way.getAttribute("transform") ? -1 : 1,
        springs: element.querySelectorAll(".link path").length,
        end: element.querySelector(".link").getBoundingClientRect().right,
        texts: [...element.querySelectorAll("text")].map((node) => node.textContent),
    };
})"""
GROUND = """(() => {
    const pattern = document.querySelector(".bristles pattern");
    return pattern.patternTransform.baseVal.consolidate().matrix.e;
})()"""


# --------------------------------------------------------------------------- bristles
# At a row: the elements, the texts of the motion, and where the ground is.
DRAWN = f"""() => [
    ({ELEMENTS})(), {GROUND},
    [...document.querySelectorAll(".bristles .motion text")].map((node) => node.textContent),
]"""


@pytest.mark.parametrize("size", matrix(["laptop", "phone"], ["laptop"]))
def test_contacts_pegs_and_values_are_those_of_the_run(open_page: Open, size: str) -> None:
    page, trace = open_page("mass", size, "Bristles"), run("mass")
    places, z, said, ends, counts = [], [], [], set(), {True: 0, False: 0}
    rows = some_rows(page, 40)
    drawn = at_rows(page, [row for row, _ in rows], DRAWN)
    wanted: list[str] = []
    for (_, number), (elements, _, motion) in zip(rows, drawn, strict=True):
        places.append([element["x"] for element in elements])
        ends |= {round(element["end"]) for element in elements}
        z.append(trace.z[number])
        v, F = float(trace.v[number]), float(np.float32(trace.F[number]))
        said += [*motion, *(element["texts"][1] for element in elements)]
        wanted += [f"'v = ' + eng({v!r}, 'm/s', 4)", f"'F = ' + eng({F!r}, 'N', 4)"]
        wanted += [f"'z ' + eng({float(each)!r}, 'm', 4)" for each in trace.z[number]]
        for element, state in zip(elements, trace.states[number], strict=True):
            held = bool(state == "stick")
            counts[held] += 1
            assert element["peg"] == held
            assert element["arrow"] == (not held and v != 0)
            assert element["texts"][0].split()[1] == state
            assert not element["arrow"] or element["way"] == np.sign(v)
    assert said == page.evaluate(f"[{', '.join(wanted)}]")
    slope, rest = np.polyfit(np.ravel(z), np.ravel(places), 1)
    np.testing.assert_allclose(np.ravel(places), rest + slope * np.ravel(z), atol=0.05)
    assert slope < 0  # the slider moves to the right, away from its contacts
    largest = float(np.abs(trace.z).max())
    assert -slope * largest == pytest.approx(page.evaluate("views[0].open.left.swing"), rel=1e-3)
    assert len(ends) <= 2  # springs end at the slider, which stands still
    assert min(counts.values()) > 10
    page.locator(".bristles .element .label").nth(2).click()
    assert page.evaluate("views[0].element") == 2
    assert (page.locator(".bristles .chosen .label").text_content() or "").startswith("E3")


@pytest.mark.parametrize("name", ["wear", "ball", "pad1"])
def test_a_peg_is_a_default_state_or_without_bristles_a_locked_one(
    open_page: Open, name: str
) -> None:
    trace, page = run(name), open_page(name, "laptop", "Bristles")
    trace, chart = trace.contact(trace.contacts[0]), trace.model.chart
    held = {state.name for state in chart.states if state.locked}
    if name == "wear":
        held = {chart.default_state.name}
    seen = set()
    rows = some_rows(page, 40)
    drawn = at_rows(page, [row for row, _ in rows], ELEMENTS)
    for (_, number), elements in zip(rows, drawn, strict=True):
        for element, state in zip(elements, trace.states[number], strict=True):
            assert element["peg"] == (state in held)
            seen.add(str(state))
    assert len(seen) > 1 or name == "ball"  # a ball that bounces is free


def test_a_contact_that_sticks_moves_with_the_ground(open_page: Open) -> None:
    page = open_page("mass", "laptop", "Bristles")
    checked = slid = 0
    first = events(page)[0]
    before = None
    for elements, ground, _ in at_rows(page, range(first + 1, first + 120), DRAWN):
        if before is not None:
            for now, then in zip(elements, before[0], strict=True):
                way = (now["x"] - then["x"] - (ground - before[1])) / 60  # a period of the ground
                off = abs(way - round(way)) * 60
                if now["peg"] and then["peg"]:
                    checked += 1
                    assert off < 0.1
                elif off > 0.5:
                    slid += 1
        before = elements, ground
    assert checked > 100
    assert slid > 50


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_the_element_that_fires_is_in_view_in_both(open_page: Open, size: str) -> None:
    page = open_page("many", size, "Bristles")
    open_tab(page, "Microscope")
    assert page.locator(".bristles .element").count() == 20
    both = page.locator(".bristles").is_visible()
    seen = set()
    drawn = at_rows(
        page,
        events(page)[:60],
        """() => {
            const of = (q) => document.querySelector(q).getBoundingClientRect();
            const back = of(".bristles .element.fired .back"), box = of("#run1-bristles");
            const name = of(".micro .names .chosen");
            return [views[0].element, views[0].open.left.height,
                back.top >= of(".bristles .motion").bottom - 1 && back.bottom <= box.bottom + 1,
                name.top >= of(".micro .top").bottom - 1
                    && name.bottom <= of(".micro .foot").top + 1,
                document.querySelector(".micro .names .chosen").innerText];
        }""",
    )
    for element, height, fired, named, name in drawn:
        seen.add(element)
        assert named, element
        assert name == f"E{element + 1}"
        assert fired, element
        assert height >= 26
    assert len(seen) == 20
    assert both
    assert size == "phone" or in_view(page, ".micro .names .chosen")


@pytest.mark.parametrize("name", ["backlash", "dahl", "puck", "blocks", "rate-state-ageing"])
def test_charts_of_every_kind_are_drawn(open_page: Open, name: str) -> None:
    page = open_page(name, "laptop", "Bristles")
    for elements, _, motion in at_rows(page, [row for row, _ in some_rows(page, 5)], DRAWN):
        assert [element["springs"] for element in elements] == [3 if name == "dahl" else 1]
        assert len(elements[0]["texts"]) == (2 if name == "dahl" else 1)
        assert motion[1].startswith("F = ")
    notes = page.locator(".bristles .motion p").all_inner_texts()
    said = "v is the first of the velocities v, w; the others are not drawn."
    assert notes == [said] * (name == "puck")
    if name != "blocks":
        return
    labels = []  # contacts are drawn when chosen, and all of them have lines in the microscope
    for contact in run("blocks").contacts:
        page.locator(".contact").select_option(contact)
        labels.append(page.locator(".bristles .elements").get_attribute("aria-label") or "")
        assert contact in labels[-1]
    assert len(set(labels)) == 2
    open_tab(page, "Microscope")
    names = page.locator(".micro .names b").all_inner_texts()
    assert {each.split()[0] for each in names} == set(run("blocks").contacts)
    shown = "[document.querySelector('.micro .names .chosen').textContent, views[0].contact.name]"
    for chosen, contact in at_rows(page, events(page)[:10], f"() => {shown}"):
        assert chosen.startswith(contact)


# --------------------------------------------------------------------------- microscope
def go(page: Any, k: int) -> None:
    """Show a row."""
    page.evaluate(f"go({k})")


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


def overlapping(texts: list[Any]) -> list[tuple[str, str]]:
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
    (columns,) = at_rows(page, [page.evaluate(f"runs[0].log[{first + 1}].row")], COLUMNS)
    numbers = page.evaluate(
        f"runs[0].log.slice({first}, {first + 4}).map(({{ row }}) => runs[0].number[row])"
    )
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
def test_every_firing_is_a_column_in_the_order_of_the_log(open_page: Open, name: str) -> None:
    page, log = open_page(name, "laptop", "Microscope"), run(name).transitions
    for first in range(0, len(log) - 3, 4):
        columns = four(page, run(name), first)
        if name == "mass":
            continue
        texts = page.evaluate(TEXTS)
        assert overlapping(texts) == []
        times = [text[0] for text in texts if text[1] == "time"]
        gaps = np.diff(log.t[first : first + 4])
        if name == "cascade" and first == np.flatnonzero(log.t > 15.0)[0]:
            assert 0.0 < gaps.sum() < 0.01  # four break-aways have gaps with their times
            assert (np.diff([column[3] for column in columns]) - columns[0][4] > 40).all()
            assert {f"+{1e3 * gap:.3g}".ljust(5, "0") + " ms" for gap in gaps} <= set(times)
            return
        if name == "ramp":  # a set at one time has no gaps
            assert first == 0
            places = np.diff([column[3] for column in columns])
            assert places == pytest.approx(columns[0][4], abs=0.1)
            assert times.count("+0") == 3
            assert [text[0] for text in texts if text[1] == "time first"] == ["2.000000 s"]
            # F is written once between two firings, and its stairs go down with it.
            written = [text for text in texts if text[1] == "value"]
            for text, expected in zip(written, [log.F_before[0], *log.F_after], strict=True):
                assert close(text[0], expected)
            assert (np.diff([text[3] for text in written]) > 0).all()
            return
    assert name == "mass"


RUNS = ["mass", "ramp", "cascade", "many"]


@pytest.mark.parametrize("name", matrix(RUNS, ["mass", "many"]))
def test_no_text_covers_another_or_is_cut_off(open_page: Open, name: str) -> None:
    page = open_page(name, "laptop", "Microscope")
    for k in events(page)[:: 1 if name == "ramp" else 12]:
        for texts in at_rows(page, (k - 1, k, k + 1), TEXTS):
            assert overlapping(texts) == []
        box, labels = box_of(page, ".micro .strip"), box_of(page, ".micro .names")["width"]
        widths = page.evaluate(
            """() => views[0].open.right.texts.filter((node) => node.textContent)
                .map((node) => node.getBoundingClientRect()).map((box) => [box.left, box.right])"""
        )
        assert len(widths) > 5 or name != "mass"
        for left, right in widths:
            assert box["x"] + labels <= left + 2  # a halo
            assert right - 2 <= box["x"] + box["width"]


def test_columns_show_the_states_stay_in_the_middle_and_lead_to_their_rows(
    open_page: Open,
) -> None:
    page, trace = open_page("mass", "laptop", "Microscope"), run("mass")
    middles = []
    drawn = at_rows(
        page,
        events(page)[10:40],
        """() => {
            const at = views[0].open.right, k = at.strip.at(at.strip.place(views[0].row));
            const classes = [...at.nodes.get(k).column.children]
                .map((cell) => (cell.matches(".fires") ? cell.children[1] : cell).className);
            const now = [...document.querySelectorAll(".micro .foot .now")]
                .map((node) => node.getBoundingClientRect()).map((box) => box.x + box.width / 2);
            return [runs[0].number[views[0].row], classes, now];
        }""",
    )
    for row, classes, now in drawn:
        assert classes == [f"state{int(state == 'slip')}" for state in trace.states[row]]
        assert len(now) == 1
        middles += now
    middles = middles[2:]
    assert np.ptp(middles) <= 1.0
    strip, labels = box_of(page, ".micro .strip"), box_of(page, ".micro .names")["width"]
    middle = strip["x"] + (labels + strip["width"]) / 2
    assert middles[0] == pytest.approx(middle, abs=8)  # a bar to scroll
    a, b = events(page)[7:9]  # rows between firings are in the gap
    drawn = at_rows(
        page,
        range(a + 1, b),
        """() => [
            document.querySelectorAll(".micro .foot .now").length,
            document.querySelector(".micro .line").checkVisibility(),
            views[0].open.right.strip.place(views[0].row),
        ]""",
    )
    assert all(now == 0 and line for now, line, _ in drawn)
    places = [place for *_, place in drawn]
    assert (np.diff(places) >= 0).all()
    assert places[-1] > places[0]
    go(page, events(page)[8])  # the button below a column, the column, and a gap
    button = page.locator(".micro .foot button:not(.now)").last
    number = int(re.findall(r"^\d+", button.inner_text())[0])
    button = page.locator(".micro .foot button", has_text=re.compile(rf"^{number}\b"))
    button.click()
    assert page.evaluate("runs[0].number[views[0].row]") == number
    assert "now" in (button.get_attribute("class") or "")
    go(page, events(page)[8])
    wanted = page.evaluate(COLUMNS)[-1]
    y = box_of(page, ".micro .rows")["y"] + 10
    page.mouse.click(wanted[3] + wanted[4] / 2, y)
    number = int(wanted[2].split("\n")[0])
    assert page.evaluate("runs[0].number[views[0].row]") == number
    assert frame(page) in page.evaluate("runs[0].log.map((entry) => entry.row)")
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
    assert frame(page) == after - 1  # the last row before the next firing


def test_a_run_without_transitions_says_so(open_page: Open) -> None:
    assert len(run("still").transitions) == 0
    page = open_page("still", "laptop", "Microscope")
    assert "no transitions" in page.locator("#run1-microscope").inner_text()
