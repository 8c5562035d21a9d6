"""The replay page explains every row as `explain` does, compares runs, and shows systems."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gms_fsm.session.explain import explain
from tests.helpers import matrix
from tests.plots.browser import (
    SIZES,
    Open,
    box_of,
    browser,
    frame,
    in_view,
    open_page,
    open_tab,
    own_rows,
    press,
    run,
    said,
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


EXPLAINING = ["published", "signed", "pulled", "ball", "blocks", "servo", "timed", "shared"]


@pytest.mark.parametrize("name", matrix(EXPLAINING, {*EXPLAINING} - {"pulled"}))
def test_every_row_has_the_truths_and_margins_of_the_run_bit_for_bit(
    open_page: Open, name: str
) -> None:
    """Also for guards that read forces, accelerations, clocks, named expressions; by contact."""
    page, whole = open_page(name), run(name)
    own = own_rows(page)
    assert {number for _, number in own} >= set(np.flatnonzero(whole.microstep).tolist())
    # About 150 rows, and all micro-steps.
    some = range(0, len(own), max(1, len(own) // 150))
    own = [each for k, each in enumerate(own) if k in some or whole.microstep[each[1]]]
    held = 0
    for place, each in enumerate(whole.contacts):
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
                        same_clause(shown, clause, strict=name in ("published", "signed"))
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


def test_the_chart_shows_every_firing_and_the_table_explains_the_chosen_element(
    open_page: Open,
) -> None:
    page, trace = open_page("published"), run("published")
    press(page, "Shift+ArrowRight")  # element 1 breaks away and is selected
    lines = page.locator("tbody tr.asked")
    assert lines.count() == 4
    assert lines.nth(0).locator("td").all_inner_texts() == [
        "z >= s",
        "✓ true",
        "0",
        "400.0 mm",
        "400.0 mm",
    ]
    assert lines.nth(2).locator("td").first.inner_text() == "z <= -s"
    assert lines.nth(2).locator("td").nth(1).inner_text() == "✗ false"
    assert lines.nth(0).locator("em").inner_text() == "FIRED"
    press(page, "f", "3")  # still sticks: its guard is true and not yet taken
    assert page.locator(".who").inner_text() == "Guards of element 3"
    assert page.locator("tbody em").all_inner_texts() == ["", "", "not checked"]
    assert page.locator("tbody tr").nth(0).locator("td").nth(1).inner_text() == "✓ true"
    assert "break_away_forward fires next" in said(page)
    press(page, "f", "Home")
    for record in trace.transitions:
        press(page, "Shift+ArrowRight")
        element = f"element{record.element + 1}"
        counted = {
            f"#{element}-state-{record.target}.active": 1,
            f"#{element}-state-{record.source}.active": 0,
            ".guard.fired": 1,
            f"#{element}-guard-{record.edge}.fired": 1,
            f"#{element}-edge-{record.edge}-2.fired": 1,
        }
        texts = "(each) => [...document.querySelectorAll(each)].map((node) => node.textContent)"
        *found, marks = page.evaluate(
            f"(asked) => asked.map({texts})", [*counted, f"#{element}-guard-{record.edge} .mark"]
        )
        assert [len(each) for each in found] == [*counted.values()]
        assert marks == ["✓", "✓"]


VIEWS = [(size, scheme) for size in SIZES for scheme in ("light", "dark")]


@pytest.mark.parametrize(
    ("size", "scheme"), matrix(VIEWS, [("laptop", "light"), ("phone", "dark")])
)
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


def test_the_crosshair_tells_the_values_of_all_plots(open_page: Open) -> None:
    page, trace = open_page("mass", "laptop"), run("mass")
    box = page.locator(".u-over").nth(1).bounding_box()
    assert box is not None
    assert page.locator(".hair").is_hidden()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 10)
    assert page.locator(".hair").is_visible()
    row, t = page.evaluate("[frames.rows[0][pointed], frames.t[pointed]]")
    assert t == pytest.approx(0.6 * 60.0, abs=0.2)
    shown = page.locator(".plots output").all_inner_texts()
    wanted = page.evaluate(
        "(row) => ['F', 'v', 'x'].map((name) => eng(runs[0].contacts[0].value(name, 0, row), "
        "{F: 'N', v: 'm/s', x: 'm'}[name], 5))",
        row,
    )
    assert [shown[0], *shown[2:]] == wanted
    force = float(trace.sample([t]).F[0])
    assert page.evaluate(f"runs[0].contacts[0].value('F', 0, {row})") == pytest.approx(
        force, rel=1e-3
    )
    page.mouse.move(box["x"] + 10, box["y"] - 200)
    assert page.locator(".hair").is_hidden()
    assert page.locator(".plots output").first.inner_text() != shown[0]


def test_many_elements_are_one_chart_and_a_token_each(open_page: Open) -> None:
    page, trace, n = open_page("many", "laptop"), run("many"), 20
    assert page.locator("svg .state").count() == 2
    assert page.locator(".token").count() == n
    for record in trace.transitions[:n]:
        press(page, "Shift+ArrowRight")
        while page.evaluate("runs[0].fired.get(views[0].row)?.element") != record.element:
            press(page, "ArrowRight")
        token = page.locator(".token").nth(int(record.element))
        assert "fired" in (token.get_attribute("class") or "")
        assert token.locator(".state").inner_text() == record.target
        assert in_view(page, ".token.fired")
        assert page.locator(f"#element1-guard-{record.edge}.fired").count() == 1
    press(page, "f")
    who = page.locator(".who")
    for i in (0, 1, 11, n - 1):
        page.locator(".token").nth(i).click()
        assert who.inner_text() == f"Guards of element {i + 1}"
    press(page, "]")
    assert who.inner_text() == "Guards of element 1"
    press(page, "[")
    assert who.inner_text() == f"Guards of element {n}"


# --------------------------------------------------------------------------- two runs
def test_two_runs_are_shown_at_the_same_time_with_their_first_difference(open_page: Open) -> None:
    page, laws = open_page("two", "laptop"), ("published", "signed")
    boxes = [page.locator(".run").nth(i).bounding_box() for i in (0, 1)]
    assert boxes[0] is not None
    assert boxes[1] is not None
    assert boxes[0]["y"] == boxes[1]["y"]
    assert boxes[0]["x"] < boxes[1]["x"]
    for place in (1, 2):  # margins and the time axis are in view
        for inner, outer in (("thead th:nth-child(4)", ".why"), (".time-unit", ".pane.time")):
            a, b = (box_of(page, f".run:nth-child({place}) {q}") for q in (inner, outer))
            assert a["x"] + a["width"] <= b["x"] + b["width"] + 1
            assert a["y"] + a["height"] <= b["y"] + b["height"] + 1
    counts = page.evaluate(
        "views.map((view) => view.open.right.plots.map(({ plot }) => plot.series.length - 1))"
    )
    assert counts == [[2, 6, 2, 2], [2, 6, 2, 2]]  # of both where both are compared
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
    assert page.locator(".pin").count() == 2
    pin, plot = box_of(page, ".pin"), box_of(page, ".u-over")
    assert pin["x"] == pytest.approx(plot["x"] + plot["width"] * t / 100.0, abs=3)
    press(page, "Home", "d")
    assert page.evaluate("frames.t[frame]") == t
    press(page, "Home")
    page.locator("#run2-element1-guard-arrest").click()
    assert page.locator(".guard.break").count() == 1
    press(page, "c")
    assert "breakpoint: element 1, arrest" in said(page)
    until(page, "F > 1.2")
    assert frame(page) > 0


def test_a_shorter_run_has_ended_and_equal_runs_have_no_difference(open_page: Open) -> None:
    page = open_page("ended")
    values = page.locator(".values").nth(1)
    before = int(np.searchsorted(run("signed").t, 29.0))
    for k, ended in ((before, False), (page.evaluate("last"), True)):
        page.evaluate(f"go({k})")
        assert ("ended at 30.000 s" in values.inner_text()) == ended
        assert said(page).endswith("run 2: ended") == ended
    assert "run 1: element 1 is in" in said(page)
    same = open_page("same")
    press(same, "d")
    assert "same transitions in the same order" in said(same)
    assert frame(same) == 0
    assert same.locator(".pin").first.is_hidden()


# --------------------------------------------------------------------------- systems
def test_a_contact_is_chosen_by_name_or_has_a_page_of_its_own(open_page: Open) -> None:
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


def test_bodies_signals_and_sampled_values_have_plots(open_page: Open) -> None:
    trace, page = run("servo"), open_page("servo", "laptop")
    open_tab(page, "System")
    heads = page.locator(".system h3 > span").all_inner_texts()
    for name in (
        *("motor: x", "motor: v", "load: x", "load: v", "r, signal", "i, state"),
        *("u, sampled by pid", "I, sampled by pid", "bearing: F", "gear: F"),
    ):
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
    speed = page.evaluate(f"runs[0].column(runs[0].system.bodies[1].v)({row})")
    assert speed == trace.body("load").v[-1]
    assert len(page.locator(".system .ribbon").all()) == 2
    until(page, "gear.F > 0 and bearing.state(1) == stuck")
    assert page.locator("#until").get_attribute("aria-invalid") == "false"
