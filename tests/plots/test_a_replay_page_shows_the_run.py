"""A replay page explains every row as `explain` does, and all of its panes move with the row.

Chart, table, plots and two runs side by side; bristles, whose contacts are where z puts them;
the microscope, where every firing is a column with the log's F on both sides; landscapes, whose
regions have the truths of the run; phase portraits; systems.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from gms_fsm import Trace
from gms_fsm.foundation.quantities import scale_of
from gms_fsm.language import evaluate
from gms_fsm.session.explain import explain, values_at
from tests.plots.browser import (
    Open,
    Page,
    at_rows,
    box_of,
    browser,
    events,
    faults,
    frame,
    in_view,
    open_page,
    open_tab,
    own_rows,
    press,
    run,
    said,
    some_rows,
    until,
)

__all__ = ["browser", "open_page"]

pytestmark = pytest.mark.slow

# What the page computes from stored values and trees at rows of the run, for each element.
EXPLAINED = """([place, rows]) => rows.map((row) => {
    const contact = runs[0].contacts[place];
    return contact.modes.map((mode, element) => {
        const asked = contact.asked(element, row), scope = contact.scope(element, asked.row);
        return [
            asked.fired < 0 ? "" : contact.edges[asked.fired].name,
            contact.leaving(mode[asked.row]).map((k) => [
                contact.edges[k].name, truthOf(contact.edges[k].guard, scope),
                contact.clauses(k, scope).map(({ text, truth, left, right, margin, unit }) =>
                    [text, truth, left, right, margin, unit]),
            ]),
        ];
    });
})"""


@pytest.mark.parametrize(
    "name", ["signed", "ball", "blocks", "timed", "shared", "hunting", "crossing"]
)
def test_every_row_has_the_truths_and_margins_of_the_run_bit_for_bit(
    open_page: Open, name: str
) -> None:
    """Also for guards that read forces, clocks, events, named expressions; by contact."""
    page, whole = open_page(name), run(name)
    own = own_rows(page)
    assert {number for _, number in own} >= set(np.flatnonzero(whole.microstep).tolist())
    # About 50 rows, and all micro-steps.
    some = range(0, len(own), max(1, len(own) // 50))
    own = [each for k, each in enumerate(own) if k in some or whole.microstep[each[1]]]
    held = 0
    for place, each in enumerate(whole.what.machines or whole.contacts):
        trace = whole.contact(each)
        found = page.evaluate(EXPLAINED, [place, [row for row, _ in own]])
        for (_, number), elements in zip(own, found, strict=True):
            for i, (fired, edges) in enumerate(elements):
                why = explain(trace, number, i)
                assert fired == next((e.edge.name for e in why if e.fired), "")
                assert [(edge, truth == 1) for edge, truth, _ in edges] == [
                    (e.edge.name, e.holds) for e in why
                ]
                for e, (_, _, clauses) in zip(why, edges, strict=True):
                    assert len(clauses) == len(e.clauses)
                    for clause, shown in zip(e.clauses, clauses, strict=True):
                        same_clause(shown, clause, strict=name == "signed")
                    held += e.holds
    assert held > 0


def same_clause(shown: list[Any], clause: Any, *, strict: bool) -> None:
    """Compare a clause; one of several comparisons has no margin."""
    text, truth, left, right, margin, unit = shown
    assert (truth == 1) == clause.holds
    assert margin is None or margin == clause.margin or math.isnan(clause.margin)
    if strict:
        wanted = (clause.text, clause.left, clause.right, clause.margin, clause.unit)
        assert (text, left, right, margin, unit) == wanted


def test_chart_table_and_crosshair_follow_every_firing(open_page: Open) -> None:
    page, trace = open_page("published"), run("published")
    press(page, "Shift+ArrowRight")  # element 1 breaks away and is selected
    lines = page.locator("tbody tr.asked")
    assert lines.count() == 4
    cells = lines.nth(0).locator("td").all_inner_texts()
    assert cells == ["z >= s", "✓ true", "0", "400.0 mm", "400.0 mm"]
    assert lines.nth(2).locator("td").all_inner_texts()[:2] == ["z <= -s", "✗ false"]
    assert lines.nth(0).locator("em").inner_text() == "FIRED"
    press(page, "f", "3")  # still sticks: its guard is true and not yet taken
    assert page.locator("tbody em").all_inner_texts() == ["", "", "not checked"]
    assert page.locator("tbody tr").nth(0).locator("td").nth(1).inner_text() == "✓ true"
    assert "break_away_forward fires next" in said(page)
    press(page, "f", "Home")
    for record in trace.transitions[:25]:
        press(page, "Shift+ArrowRight")
        element = f"element{record.element + 1}"
        counted = {
            f"#{element}-state-{record.target}.active": 1,
            f"#{element}-state-{record.source}.active": 0,
            ".guard.fired": 1,
            f"#{element}-guard-{record.edge}.fired": 1,
            f"#{element}-edge-{record.edge}.fired": 1,
        }
        texts = "(each) => [...document.querySelectorAll(each)].map((node) => node.textContent)"
        *found, marks = page.evaluate(
            f"(asked) => asked.map({texts})", [*counted, f"#{element}-guard-{record.edge} .mark"]
        )
        assert [len(each) for each in found] == [*counted.values()]
        assert marks == ["✓", "✓"]

    page, trace = open_page("mass", "laptop"), run("mass")
    box = page.locator(".u-over").nth(1).bounding_box()
    assert box is not None
    hair = page.locator(".hair").first
    assert hair.is_hidden()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 10)
    assert hair.is_visible()
    row, t = page.evaluate("[frames.rows[0][pointed], frames.t[pointed]]")
    assert t == pytest.approx(0.6 * 60.0, abs=0.2)
    force = float(trace.sample([t]).F[0])
    assert page.evaluate(f"runs[0].contacts[0].value('F', 0, {row})") == pytest.approx(
        force, rel=1e-3
    )
    assert page.locator(".plots output").first.inner_text() == page.evaluate(
        f"eng(runs[0].contacts[0].value('F', 0, {row}), 'N', 5)"
    )


def test_guards_without_marks_keep_no_room_for_them(open_page: Open) -> None:
    page = open_page("published")
    pieces = """[...document.querySelectorAll(".guard")].map((guard) => [
        guard.matches(".pale"), [...guard.querySelectorAll("text:not(.priority)")].map((text) =>
            [text.textContent, Number(text.getAttribute("x")), text.getAttribute("y")])])"""
    for _ in range(3):
        press(page, "Shift+ArrowRight")
        guards = page.evaluate(pieces)
        assert {pale for pale, _ in guards} == {True, False}
        for pale, texts in guards:
            assert pale != any("✓" in text or "✗" in text for text, *_ in texts)
            for (text, x, y), (_, following, line) in pairwise(texts):
                assert y != line or following - x == pytest.approx(6 * len(text), abs=0.5)


@pytest.mark.parametrize(("size", "scheme"), [("laptop", "light"), ("phone", "dark")])
def test_what_fired_its_guard_and_the_cursor_are_in_view(
    open_page: Open, size: str, scheme: str
) -> None:
    page, trace = open_page("mass", size, color_scheme=scheme), run("mass")
    for record in trace.transitions[:6]:
        press(page, "Shift+ArrowRight")
        element = f"element{record.element + 1}"
        assert page.evaluate("views[0].element") == record.element
        for seen in (
            f"#{element}-guard-{record.edge}.fired",
            f"#{element}-state-{record.target}.active",
            "tbody tr.fired",
            ".token.fired",
            ".plot",  # the cursor crosses all plots
        ):
            assert in_view(page, seen), seen
        caption = box_of(page, "caption")
        assert box_of(page, "tr.fired")["y"] >= caption["y"] + caption["height"] - 1
        cursor, plot = box_of(page, ".cursor"), box_of(page, ".plot")
        assert plot["x"] < cursor["x"] <= plot["x"] + plot["width"]
        assert f"element {record.element + 1} " in said(page)
        assert page.evaluate("scrollY") == 0


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_of_many_elements_the_one_that_fires_is_in_view(open_page: Open, size: str) -> None:
    page, n = open_page("many", size, "Bristles"), 20
    open_tab(page, "Microscope")
    assert page.locator(".bristles .element").count() == n
    assert page.locator(".bristles").is_visible()
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
        assert fired, element
        assert named, element
        assert name == f"E{element + 1}"
        assert height >= 26
    assert len(seen) == n
    if size == "phone":
        return
    assert in_view(page, ".micro .names .chosen")
    assert page.locator("svg .state").count() == 2  # one chart, and a token each
    assert page.locator(".token").count() == n
    press(page, "f")
    page.locator(".token").nth(n - 1).click()
    press(page, "]")
    assert page.locator(".who").inner_text() == "Guards of element 1"
    press(page, "[")
    assert page.locator(".who").inner_text() == f"Guards of element {n}"


OVERLAPS = """([one, other]) => {
    const of = (q) => $$(q).map((node) => node.getBoundingClientRect());
    const meet = (a, b) => a.bottom > b.top && b.bottom > a.top
        && a.right > b.left && b.right > a.left;
    return of(one).flatMap((a) => of(other).filter((b) => meet(a, b)));
}"""
BELOW_ITS_BOX = """(all) => $$(all).map((node) => Math.max(0,
    node.getBoundingClientRect().bottom - node.parentNode.getBoundingClientRect().bottom))"""
# What is wider than its box.
CUT_OFF = """([box, all]) => $$(box).flatMap((outer) => {
    const { left, right } = outer.getBoundingClientRect();
    return $$(all, outer).map((node) => node.getBoundingClientRect())
        .filter((inner) => inner.left < left - 1 || inner.right > right + 1);
})"""
# Of texts of a chart that are seen, the height of the smallest.
SMALLEST = """() => Math.min(...$$(".chart text").map((text) => {
    const { a } = text.getScreenCTM();
    return a * Number(text.getAttribute("font-size"));
}))"""


def test_the_cursor_begins_below_the_titles_and_covers_no_reading(open_page: Open) -> None:
    page = open_page("mass", "laptop")
    for row in events(page)[:6]:
        page.evaluate(f"go({row})")
        for reading in (".plots h3", ".time-unit", ".ribbon b"):
            assert page.evaluate(OVERLAPS, [".cursor", reading]) == [], reading
    below = page.evaluate(BELOW_ITS_BOX, ".plot .cursor")  # where the numbers of the axis are
    assert below == [0] * 4
    front, line = (
        page.locator(q).last.evaluate("node => Number(getComputedStyle(node).zIndex)")
        for q in (".ribbon i span", ".cursor")
    )
    assert front > line


def test_two_runs_are_drawn_in_the_same_plots(open_page: Open) -> None:
    page = open_page("two", "laptop")
    assert page.locator(".plots h3").count() == 4
    assert box_of(page, ".u-over")["height"] > 60
    press(page, *["Shift+ArrowRight"] * 12)
    force = "runs[{0}].contacts[0].value('F', 0, views[{0}].row)"
    wanted = [f"{k + 1}: {page.evaluate(f'eng({force.format(k)}, `N`, 5)')}" for k in range(2)]
    assert page.locator(".plots output").first.inner_text().startswith("  ".join(wanted))
    inner = "views[0].open.right.inner.series.filter((each) => each.show).length"
    for element in ("1", "3"):  # time, two bounds, and the chosen element of each run
        press(page, element)
        assert page.evaluate(inner) == 1 + 2 + 2
    open_tab(page, "Landscape")
    one, other = (box_of(page, f".run:nth-child({k}) .pane.landscape") for k in (1, 2))
    assert one["y"] + one["height"] <= other["y"]
    names = page.locator(".right .of")
    assert names.all_inner_texts() == ["Run 1", "Run 2"]
    open_tab(page, "Time")
    assert names.first.is_hidden()
    page.set_viewport_size({"width": 1100, "height": 700})  # no room for three columns
    page.wait_for_function("innerWidth === 1100")  # on a busy machine it comes later
    first, second = (box_of(page, f".run:nth-child({k}) .left") for k in (1, 2))
    assert first["y"] + first["height"] <= second["y"]
    assert page.evaluate(CUT_OFF, [".chart.pane", "svg"]) == []


def test_on_a_phone_chart_texts_are_11_px_high_and_guards_are_cards(open_page: Open) -> None:
    page = open_page("published", "phone")
    for _ in range(4):
        press(page, "Shift+ArrowRight")
        assert page.evaluate(SMALLEST) >= 11.0
        assert page.evaluate(CUT_OFF, [".why", "th:not(thead th), td"]) == []
    cells = page.locator("tr.fired").first.locator("td")
    names = cells.nth(2).evaluate("node => getComputedStyle(node, '::before').content")
    assert names == '"margin "'


@pytest.mark.parametrize("name", ["published", "two", "dahl"])
def test_zooming_a_browser_enlarges_the_text_of_charts(open_page: Open, name: str) -> None:
    page = open_page(name, "laptop")
    for width, height in ((1366, 657), (1920, 950)):
        sizes = []
        for factor in (1.0, 1.5):  # a browser that zooms has a smaller window of larger pixels
            page.set_viewport_size({"width": int(width / factor), "height": int(height / factor)})
            page.wait_for_timeout(50)
            sizes.append(factor * page.evaluate(SMALLEST))
        assert sizes[1] > 1.05 * sizes[0], (width, sizes)


# --------------------------------------------------------------------------- two runs, systems
@pytest.mark.matrix
def test_two_runs_are_shown_at_the_same_time_with_their_first_difference(open_page: Open) -> None:
    page, laws = open_page("two", "laptop"), ("published", "signed")
    first, second = (box_of(page, f".run:nth-child({place}) .left") for place in (1, 2))
    assert first["y"] == second["y"]
    assert first["x"] < second["x"]
    assert page.evaluate(CUT_OFF, [".why", "td, th:not(thead th)"]) == []
    assert page.evaluate(CUT_OFF, [".pane.time", ".time-unit"]) == []
    press(page, *["Shift+ArrowRight"] * 12)
    t = page.evaluate("frames.t[frame]")
    for place, law in enumerate(laws):
        trace = run(law)
        row = int(np.searchsorted(trace.t, t, side="right")) - 1
        assert page.evaluate(f"runs[{place}].t(views[{place}].row)") <= t
        for i, state in enumerate(trace.states[row]):
            name = f"element{i + 1}-state-{state}"
            ident = name if place == 0 else f"run2-{name}"
            micro = trace.microstep[row] > 0  # within an instant the states still change
            assert micro or page.locator(f"#{ident}.active").count() == 1
    logs = [[(int(r.element), str(r.edge)) for r in run(law).transitions] for law in laws]
    k = next(k for k, (a, b) in enumerate(zip(*logs, strict=False)) if a != b)
    page.click("#difference")
    assert f"first difference, transition {k + 1}: " in said(page)
    for place, law in enumerate(laws):
        record = run(law).transitions[k]
        assert f"run {place + 1}: element {record.element + 1} {record.source} → " in said(page)
    t = min(run(law).transitions.t[k] for law in laws)
    assert page.evaluate("frames.t[frame]") == t
    assert page.locator(".pin").count() == 5  # in four plots, and over the ribbons
    pin, plot = box_of(page, ".pin"), box_of(page, ".u-over")
    assert pin["x"] == pytest.approx(plot["x"] + plot["width"] * t / 100.0, abs=3)
    press(page, "Home", "d")
    assert page.evaluate("frames.t[frame]") == t
    press(page, "Home")
    page.locator("#run2-element1-guard-arrest").click()
    press(page, "c")
    assert "breakpoint: element 1, arrest" in said(page)
    until(page, "F > 1.2")
    assert frame(page) > 0

    page = open_page("ended")
    values = page.locator(".values").nth(1)
    before = int(np.searchsorted(run("signed").t, 29.0))
    for k, ended in ((before, False), (page.evaluate("last"), True)):
        page.evaluate(f"go({k})")
        assert ("ended at 30.000 s" in values.inner_text()) == ended
        assert said(page).endswith("run 2: ended") == ended
    page = open_page("same")
    press(page, "d")
    assert "same transitions in the same order" in said(page)
    assert frame(page) == 0
    assert page.locator(".pin").first.is_hidden()


def test_a_system_has_its_contacts_bodies_signals_and_samples(open_page: Open) -> None:
    trace, page = run("blocks"), open_page("blocks")
    assert page.locator("select.contact option").all_inner_texts() == ["pad1", "pad2"]
    press(page, "f")
    page.locator("select.contact").select_option("pad2")
    assert page.locator(".who").inner_text() == "Guards of pad2 1"
    press(page, "End")
    wanted, value = trace.contact("pad2"), "views[0].contact.value('{}', 0, views[0].row)"
    assert page.evaluate(value.format("F")) == pytest.approx(float(wanted.F[-1]), rel=1e-6)
    assert page.evaluate(value.format("v")) == wanted.v[-1]
    press(page, "f")  # what fires is selected, whatever its contact
    for record in trace.transitions[-6:][::-1]:
        press(page, "Shift+ArrowLeft")
        assert page.evaluate("views[0].contact.name") == record.contact
        assert f"{record.contact} 1 {record.source} → " in said(page)
    page = open_page("pad2")
    assert page.locator("select.contact").is_hidden()
    assert page.get_by_role("tab", name="System").count() == 0
    press(page, "Shift+ArrowRight")
    assert f"pad2 1 {wanted.transitions.source[0]} → " in said(page)

    trace, page = run("servo"), open_page("servo", "laptop", "System")
    heads = page.locator(".system h3 > span").all_inner_texts()
    for name in ("motor: x", "load: v", "r, signal", "i, state", "u, sampled by pid", "gear: F"):
        assert any(head.startswith(name) for head in heads), name
    press(page, "End")
    row = page.evaluate("views[0].row")
    values = page.evaluate(
        "(row) => Object.fromEntries(runs[0].system.values.map(({ name, column }) =>"
        "[name, runs[0].column(column)(row)]))",
        row,
    )
    for name in ("u", "I", "i"):
        assert values[name] == trace.value(name)[-1]
    assert values["r"] == pytest.approx(0.5 * np.sin(2.0 * trace.t[-1]), rel=1e-12)
    until(page, "gear.F > 0 and bearing.state(1) == stuck")
    assert page.locator("#until").get_attribute("aria-invalid") == "false"


# --------------------------------------------------------------------------- supervisors
def texts_of(page: Page, selector: str) -> list[str]:
    return page.locator(selector).all_inner_texts()


def test_a_supervisor_is_shown_and_chosen_as_a_contact_is(open_page: Open) -> None:
    page = open_page("hunting", "laptop")
    assert texts_of(page, "select.contact option") == ["pad", "calm"]
    page.locator("select.contact").select_option("calm")
    assert texts_of(page, ".plots h3 > span:first-child") == ["k", "e", "rests"]
    assert "freeze does not fire: " in said(page)
    until(page, "calm.state(1) == hold")
    assert page.locator("#element1-state-hold.active").count() == 1
    assert page.locator("#element1-edge-freeze.fired").count() == 1
    assert texts_of(page, "tbody tr.fired em") == ["FIRED"]
    open_tab(page, "System")
    assert texts_of(page, ".system .ribbon b") == ["pad", "calm"]
    assert "calm: k" in texts_of(page, ".system h3 > span:first-child")


@pytest.mark.matrix
def test_a_page_of_supervisors_alone_has_no_empty_panel_and_names_events(open_page: Open) -> None:
    for size in ("laptop", "phone"):
        page = open_page("crossing", size)
        tabs = ["Chart", "Transitions", "Time", "System", "Microscope"]
        assert texts_of(page, "[role=tab]") == tabs
        press(page, *["Shift+ArrowRight"] * 5)
        assert said(page).startswith("main 1 amber → red (halt, sends red)")
        assert "sends red" in page.locator("tbody tr.fired th").inner_text()
        press(page, *["Shift+ArrowRight"] * 2)  # side goes, and the cycle is counted
        assert page.locator("tbody td").first.inner_text() == "event red"
        assert texts_of(page, "td.number") == ["", "", ""]
        press(page, "ArrowRight")
        assert said(page).endswith("count_one does not fire: it waits for the event red")
        for tab in ("Time", "System", "Microscope"):
            open_tab(page, tab)
            assert page.evaluate(CUT_OFF, ["main", "h2, h3, th, .ribbon, .values, .which"]) == []
        assert "NaN" not in page.locator("body").inner_text()
        assert faults(page) == []


# --------------------------------------------------------------------------- bristles
# At a row: of each element x of its contact, peg, arrow and its direction, springs, texts; where
# the ground is; the texts of the motion.
DRAWN = """() => [
    [...document.querySelectorAll(".bristles .element")].map((element) => {
        const seen = (query) => {
            const node = element.querySelector(query);
            return node !== null && getComputedStyle(node).visibility === "visible";
        };
        return {
            x: element.querySelector(".foot").getCTM().e, peg: seen(".peg"), arrow: seen(".way"),
            way: element.querySelector(".way").getAttribute("transform") ? -1 : 1,
            springs: element.querySelectorAll(".link path").length,
            ground: element.querySelector(".block").style.fill,
            end: element.querySelector(".link").getBoundingClientRect().right,
            texts: [...element.querySelectorAll("text")].map((node) => node.textContent),
        };
    }),
    document.querySelector(".bristles pattern").patternTransform.baseVal.consolidate().matrix.e,
    [...document.querySelectorAll(".bristles .motion text")].map((node) => node.textContent),
]"""


def test_bristles_are_where_z_puts_them_and_move_with_the_ground_while_they_stick(
    open_page: Open,
) -> None:
    page, trace = open_page("mass", "laptop", "Bristles"), run("mass")
    places, z, texts, ends, counts = [], [], [], set(), {True: 0, False: 0}
    rows = some_rows(page, 40)
    drawn = at_rows(page, [row for row, _ in rows], DRAWN)
    wanted: list[str] = []
    # One unit for all rows of a quantity, as Python chooses it.
    speed, force, place = (
        scale_of(np.ravel(values).tolist(), unit)
        for values, unit in ((trace.v, "m/s"), (trace.F, "N"), (trace.z, "m"))
    )
    for (_, number), (elements, _, motion) in zip(rows, drawn, strict=True):
        places.append([element["x"] for element in elements])
        ends |= {round(element["end"]) for element in elements}
        z.append(trace.z[number])
        v, F = float(trace.v[number]), float(np.float32(trace.F[number]))
        texts += [*motion, *(element["texts"][1] for element in elements)]
        wanted += [f"v = {speed.text(v)}", f"F = {force.text(F)}"]
        wanted += [f"z {place.text(float(each))}" for each in trace.z[number]]
        for element, state in zip(elements, trace.states[number], strict=True):
            held = bool(state == "stick")
            counts[held] += 1
            assert element["peg"] == held
            assert f"-state{int(not held)}" in element["ground"]  # plain and pale, or hatched
            assert element["arrow"] == (not held and v != 0)
            assert element["texts"][0].split()[1] == state
            assert not element["arrow"] or element["way"] == np.sign(v)
    assert texts == [each.replace("-", "−") for each in wanted]
    slope, rest = np.polyfit(np.ravel(z), np.ravel(places), 1)
    np.testing.assert_allclose(np.ravel(places), rest + slope * np.ravel(z), atol=0.05)
    assert slope < 0  # the slider moves to the right, away from its contacts
    largest = float(np.abs(trace.z).max())
    assert -slope * largest == pytest.approx(page.evaluate("views[0].open.left.swing"), rel=1e-3)
    assert len(ends) <= 2  # springs end at the slider, which stands still
    assert min(counts.values()) > 10
    page.locator(".bristles .element .label").nth(2).click()
    assert page.evaluate("views[0].element") == 2

    checked = slid = 0
    first, before = events(page)[0], None
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


@pytest.mark.matrix
def test_bristles_of_every_kind_of_chart(open_page: Open) -> None:
    """A peg is a default state, or without bristles a locked one."""
    pegged = ("wear", "ball", "pad1")
    for name in (*pegged, "dahl", "puck"):
        page, trace = open_page(name, "laptop", "Bristles"), run(name)
        trace, chart = trace.contact(trace.contacts[0]), trace.model.chart
        held = {state.name for state in chart.states if state.locked}
        held = {chart.default_state.name} if name == "wear" else held
        rows = some_rows(page, 40 if name in pegged else 5)
        seen, drawn = set(), at_rows(page, [row for row, _ in rows], DRAWN)
        for (_, number), (elements, _, motion) in zip(rows, drawn, strict=True):
            springs = 3 if name in ("dahl", "wear") else 1
            assert motion[1].startswith("F = ")
            assert {element["springs"] for element in elements} == {springs}
            for element, state in zip(elements, trace.states[number], strict=True):
                assert element["peg"] == (state in held) or name not in pegged
                seen.add(str(state))
        assert len(seen) > 1 or name not in ("wear", "pad1")
        notes = page.locator(".bristles .motion p").all_inner_texts()
        note = "v is the first of the velocities v, w; the others are not drawn."
        assert notes == [note] * (name == "puck")
    page, labels = open_page("blocks", "laptop", "Bristles"), []
    for contact in run("blocks").contacts:  # contacts are drawn when chosen
        page.locator(".contact").select_option(contact)
        labels.append(page.locator(".bristles .elements").get_attribute("aria-label") or "")
        assert contact in labels[-1]
    assert len(set(labels)) == 2
    open_tab(page, "Microscope")  # where all of them have lines
    names = page.locator(".micro .names b").all_inner_texts()
    assert {each.split()[0] for each in names} == set(run("blocks").contacts)
    shown = "[document.querySelector('.micro .names .chosen').textContent, views[0].contact.name]"
    for chosen, contact in at_rows(page, events(page)[:10], f"() => {shown}"):
        assert chosen.startswith(contact)


# --------------------------------------------------------------------------- microscope
PREFIXES = {"": 1.0, "k": 1e3, "m": 1e-3, "µ": 1e-6, "n": 1e-9, "p": 1e-12}
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


WIDTHS = """() => views[0].open.right.texts.filter((node) => node.textContent)
    .map((node) => node.getBoundingClientRect()).map((box) => [box.left, box.right])"""


def overlapping(texts: list[Any]) -> list[tuple[str, str]]:
    assert len(texts) > 20
    return [
        (a[0], b[0])
        for i, a in enumerate(texts)
        for b in texts[:i]
        if min(a[4], b[4]) - max(a[2], b[2]) > 0.5 and min(a[5], b[5]) - max(a[3], b[3]) > 2.5
    ]


def close(text: str, expected: float) -> bool:
    """Return whether a value in engineering units is the expected one, to its last digit."""
    number, unit = text.replace("−", "-").split()
    factor = PREFIXES[unit.removesuffix("N")]
    half = 0.5 * 10.0 ** -len(number.partition(".")[2]) * factor
    return abs(float(number) * factor - expected) <= half + 1e-6 * abs(expected)


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


def test_every_firing_is_a_column_in_the_order_of_the_log(open_page: Open) -> None:
    page, log = open_page("mass", "laptop", "Microscope"), run("mass").transitions
    box, labels = box_of(page, ".micro .strip"), box_of(page, ".micro .names")["width"]
    for first in range(0, len(log) // 2, 4):
        four(page, run("mass"), first)
        assert overlapping(page.evaluate(TEXTS)) == []
        for left, right in page.evaluate(WIDTHS):  # none is cut off, but for a halo
            assert box["x"] + labels <= left + 2
            assert right - 2 <= box["x"] + box["width"]

    page, log = open_page("cascade", "laptop", "Microscope"), run("cascade").transitions
    first = int(np.flatnonzero(log.t > 15.0)[0])
    columns, gaps = four(page, run("cascade"), first), np.diff(log.t[first : first + 4])
    texts = page.evaluate(TEXTS)
    assert overlapping(texts) == []
    assert 0.0 < gaps.sum() < 0.01  # four break-aways have gaps with their times
    assert (np.diff([column[3] for column in columns]) - columns[0][4] > 40).all()
    times = {text[0] for text in texts if text[1] == "time"}
    assert {f"+{1e3 * gap:.3g}".ljust(5, "0") + " ms" for gap in gaps} <= times

    page, log = open_page("ramp", "laptop", "Microscope"), run("ramp").transitions
    columns, texts = four(page, run("ramp"), 0), page.evaluate(TEXTS)
    assert overlapping(texts) == []
    places = np.diff([column[3] for column in columns])  # a set at one time has no gaps
    assert places == pytest.approx(columns[0][4], abs=0.1)
    assert [text[0] for text in texts if text[1] == "time"].count("+0") == 3
    assert [text[0] for text in texts if text[1] == "time first"] == ["2.000000 s"]
    # F is written once between two firings, and its stairs go down with it.
    written = [text for text in texts if text[1] == "value"]
    for text, expected in zip(written, [log.F_before[0], *log.F_after[:4]], strict=True):
        assert close(text[0], expected)
    assert (np.diff([text[3] for text in written]) > 0).all()

    assert len(run("still").transitions) == 0
    page = open_page("still", "laptop", "Microscope")
    assert "no transitions" in page.locator("#run1-microscope").inner_text()


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
    assert np.ptp(middles[2:]) <= 1.0
    strip, labels = box_of(page, ".micro .strip"), box_of(page, ".micro .names")["width"]
    middle = strip["x"] + (labels + strip["width"]) / 2
    assert middles[2] == pytest.approx(middle, abs=8)  # a bar to scroll
    page.evaluate("go(events[8])")  # the button below a column, and the column
    button = page.locator(".micro .foot button:not(.now)").last
    number = int(re.findall(r"^\d+", button.inner_text())[0])
    button = page.locator(".micro .foot button", has_text=re.compile(rf"^{number}\b"))
    button.click()
    assert page.evaluate("runs[0].number[views[0].row]") == number
    assert "now" in (button.get_attribute("class") or "")
    page.evaluate("go(events[8])")
    wanted = page.evaluate(COLUMNS)[-1]
    page.mouse.click(wanted[3] + wanted[4] / 2, box_of(page, ".micro .rows")["y"] + 10)
    assert page.evaluate("runs[0].number[views[0].row]") == int(wanted[2].split("\n")[0])


# --------------------------------------------------------------------------- landscapes
PLACE = "views[0].open.right.placeOfDot()"
# The lanes of the race, and whether all their clauses are marked as true.
LANES = """() => $$(".lane", views[0].root).map((lane) => [
    $("h3 span", lane).textContent.split(" ")[1],
    $$(".mark", lane).every((mark) => mark.textContent === "✓"),
])"""
POINT = """() => {
    const pane = views[0].open.right;
    const [x, y] = pane.placeOfDot(), { edges } = views[0].contact;
    const inside = (region) => [-0.6, 0, 0.6].flatMap((dx) => [-0.6, 0, 0.6].map((dy) =>
        region.isPointInFill(new DOMPoint(x + dx, y + dy))));
    const regions = $$(".guarded", pane.regions);
    return {
        row: pane.asked.row, state: views[0].contact.states[pane.state], point: pane.moved,
        regions: Object.fromEntries(
            regions.map((each) => [edges[each.dataset.edge].name, inside(each)])),
    };
}"""
WORST = """() => {
    const { contact, row } = views[0], scope = contact.scope(0, row);
    return contact.leaving(contact.modes[0][row])
        .map((k) => worstClause(contact.clauses(k, scope))?.text ?? "");
}"""


def first_to_fire(trace: Trace, row: int, element: int, state: str, v: float, z: float) -> str:
    """Return the edge that Python finds to fire at a point of the plane; empty for none."""
    model, chart = trace.model, trace.model.chart
    second = chart.variables[0] if chart.variables else "F"
    values = values_at(trace, row, element) | {chart.velocities[0]: v, second: z}
    if model.stribeck is not None:
        values["s"] = float(model.weights[element] * model.stribeck(v))
    for name, tree in chart.lets.items():
        values[name] = evaluate(tree, values)
    for _, edge in chart.leaving(state):
        if evaluate(chart.guards[edge.name], values):
            return edge.name
    return ""


# A plane of v and z, of v and F, and with named expressions.
@pytest.mark.every(3)
@pytest.mark.parametrize("name", ["signed", "karnopp", "elasto-plastic"])
def test_regions_have_the_truths_of_the_run_and_a_dragged_dot_says_what_would_fire(
    open_page: Open, name: str
) -> None:
    page, whole = open_page(name, "laptop", "Landscape"), run(name)
    trace = whole.contact(whole.contacts[0])
    press(page, "f")  # the selected element stays selected
    numbers, rng, fired = dict(own_rows(page)), np.random.default_rng(18), list[str]()
    answer, box = page.locator(".answer").first, box_of(page, ".plane .ground")
    for _ in range(12):
        row = int(rng.choice([*numbers]))
        page.evaluate("(row) => show(row)", row)
        why = explain(trace, numbers[row], 0)
        assert page.evaluate(LANES) == [[each.edge.name, each.holds] for each in why]
        around, holding = page.evaluate(POINT)["regions"], {e.edge.name for e in why if e.holds}
        assert holding <= {name for name, inside in around.items() if any(inside)}
        assert holding >= {name for name, inside in around.items() if all(inside)}
        here = box_of(page, ".probe .here")
        page.mouse.move(here["x"] + here["width"] / 2, here["y"] + here["height"] / 2)
        page.mouse.down()
        x, y = rng.uniform(size=2)
        page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"], steps=2)
        page.mouse.up()
        found = page.evaluate(POINT)
        row, state, (v, z) = found["row"], found["state"], found["point"]
        if row not in numbers:
            continue
        edge, text = first_to_fire(trace, numbers[row], 0, state, v, z), answer.inner_text()
        drawn = [name for name, inside in found["regions"].items() if all(inside)]
        near = [name for name, inside in found["regions"].items() if any(inside)]
        assert edge in near if edge else not drawn
        if edge:
            assert text == f"{edge} would fire"
        else:
            assert text.startswith(("nothing would fire: ", "no edge leaves "))
        fired.append(edge)
    assert 1 < sum(map(bool, fired)) < len(fired) - 1


def test_the_clause_that_holds_an_edge_back_is_that_of_the_printed_race(open_page: Open) -> None:
    from plots.panels.guards.racing import held_back_by  # needs matplotlib

    page, trace = open_page("ball"), run("ball")  # its guards have compound clauses
    checked, contact, rows = 0, trace.contact(trace.contacts[0]), own_rows(page)[::3]
    for (_, number), shown in zip(rows, at_rows(page, [k for k, _ in rows], WORST), strict=True):
        why = explain(contact, number, 0)
        if why.left:
            continue
        wanted = [held_back_by(each) for each in why]
        assert shown == [each.text if each else "" for each in wanted]
        checked += sum(each is not None for each in wanted)
    assert checked > 15


def test_keys_and_a_finger_move_the_dot_and_another_row_puts_it_back(open_page: Open) -> None:
    page = open_page("signed", "phone", "Landscape")
    press(page, "f", *["Shift+ArrowRight"] * 3)
    here = frame(page)
    dot, answer = page.locator(".probe"), page.locator(".answer").first
    text = dot.get_attribute("aria-valuetext")
    x, y = page.evaluate(PLACE)
    dot.focus()
    assert answer.is_hidden()
    for key, moved in {
        "ArrowLeft": (-5, 0),
        "ArrowUp": (-5, -5),
        "Shift+ArrowDown": (-5, 25),
    }.items():
        press(page, key)
        assert page.evaluate(PLACE) == pytest.approx([x + moved[0], y + moved[1]], abs=0.01)
        assert answer.is_visible()
        page.wait_for_timeout(50)  # the page may have another height now
        assert dot.get_attribute("aria-valuetext") != text
    assert frame(page) == here
    press(page, "Escape")
    assert page.evaluate(PLACE) == [x, y]
    assert dot.get_attribute("aria-valuetext") == text
    assert answer.is_hidden()
    press(page, "ArrowUp")
    assert page.locator(".probe.moved").count() == 1
    press(page, "End")
    assert page.locator(".probe.moved").count() == 0
    at_row = """() => {
        const { contact, element, row, open } = views[0], { plane } = open.right;
        const value = (name) => contact.value(name, element, row);
        return [plane.x(value("v")), plane.y(value("z"))];
    }"""
    assert page.evaluate(PLACE) == page.evaluate(at_row)

    page = open_page("signed", "phone", "Landscape", has_touch=True, is_mobile=True)
    page.evaluate("document.querySelector('.right').scrollIntoView()")
    scrolled = page.evaluate("scrollY")

    def place() -> tuple[float, float]:
        box = box_of(page, ".probe .here")
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    finger = page.context.new_cdp_session(page)
    x, y = place()
    way = [("touchStart", (x, y)), *(("touchMove", (x + 8 * k, y - 5 * k)) for k in range(1, 9))]
    for kind, (right, down) in way:
        points = [{"x": right, "y": down}]
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    assert place() == pytest.approx((x + 64, y - 40), abs=0.5)
    assert page.evaluate("scrollY") == scrolled
    assert "would fire" in page.locator(".answer").first.inner_text()


# --------------------------------------------------------------------------- phase portraits
# Values at the two dots, and those at the row.
DOTS = """() => views[0].open.right.plots.map(({ dot, plane, name }) => [
    plane.acrossAt(Number(dot.getAttribute("cx"))), plane.upAt(Number(dot.getAttribute("cy"))),
    views[0].contact.value(name, 0, views[0].row), views[0].contact.value("F", 0, views[0].row),
])"""


def test_phase_dots_are_at_the_row_and_a_click_goes_to_the_nearest_row(open_page: Open) -> None:
    page, trace = open_page("mass", "laptop", "Phase"), run("mass")
    for _ in range(10):
        press(page, "Shift+ArrowRight")
        for across, up, value, force in page.evaluate(DOTS):
            assert across == pytest.approx(value, abs=0.01)
            assert up == pytest.approx(force, abs=0.01)
    box = page.locator(".phase .plane .ground").nth(1).bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] - 5, box["y"] + box["height"] / 2)  # fastest
    v = page.evaluate("views[0].contact.value('v', 0, views[0].row)")
    assert v == pytest.approx(float(trace.v.max()), rel=0.2)
    looks = page.evaluate(  # of each number of slipping elements
        """() => views[0].open.right.plots[0].paths.filter((path) => path.getAttribute("d"))
            .map((path) => getComputedStyle(path))
            .map((look) => [look.stroke, look.strokeWidth, look.strokeDasharray])"""
    )
    assert len(looks) == 5
    for look in zip(*looks, strict=True):
        assert len(set(look)) >= 4  # by colour, by width and by dash
