"""The page explains every row as `gms_fsm.inspection.explain` does, and shows what fired."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.inspection.explain import explain
from plots.replay import write_replay
from tests.helpers import bank, matrix
from tests.plots.browser import SIZES, Open, browser, fig4, in_view, mass, open_page, pages

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


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
    page.keyboard.press("Shift+ArrowRight")  # element 1 breaks away and is selected
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
    page.keyboard.press("f")
    page.keyboard.press("3")  # still sticks: its guard is true and not yet taken
    assert page.locator(".who").inner_text() == "Guards of element 3"
    assert page.locator("tbody em").all_inner_texts() == ["", "", "not checked"]
    assert page.locator("tbody tr").nth(0).locator("td").nth(1).inner_text() == "✓ true"
    assert "break_away_forward fires next" in page.locator("#say").inner_text()


# What the page computes from stored values and trees, for all rows of instants and some others.
EXPLAINED = """(rows) => rows.map((row) => runs[0].contacts[0].modes.map((mode, element) => {
    const contact = runs[0].contacts[0], asked = contact.asked(element, row);
    const scope = contact.scope(element, asked.row);
    return {
        fired: asked.fired < 0 ? "" : contact.edges[asked.fired].name,
        edges: contact.leaving(mode[asked.row]).map((k) => ({
            name: contact.edges[k].name, holds: truthOf(contact.edges[k].guard, scope),
            clauses: contact.clauses(k, scope).map(({ text, truth, left, right, margin, unit }) =>
                [text, truth, left, right, margin, unit]),
        })),
    };
}))"""


@pytest.mark.parametrize("law", ["published", "signed"])
def test_every_row_has_the_truths_and_margins_of_the_run_bit_for_bit(
    open_page: Open, tmp_path: Path, law: str
) -> None:
    trace = fig4(law)
    page = open_page(write_replay(tmp_path / "page.html", trace))
    numbers, between = page.evaluate("[[...runs[0].number], [...runs[0].between]]")
    own = [row for row, sample in enumerate(between) if not sample]
    assert {numbers[row] for row in own} >= set(np.flatnonzero(trace.microstep).tolist())
    for row, elements in zip(own, page.evaluate(EXPLAINED, own), strict=True):
        for i, found in enumerate(elements):
            why = explain(trace, numbers[row], i)
            assert found["fired"] == next((each.edge.name for each in why if each.fired), "")
            assert found["edges"] == [
                {
                    "name": each.edge.name,
                    "holds": int(each.holds),
                    "clauses": [
                        [c.text, int(c.holds), c.left, c.right, c.margin, c.unit]
                        for c in each.clauses
                    ],
                }
                for each in why
            ]


VIEWS = list(itertools.product(SIZES, ["light", "dark"]))


@pytest.mark.parametrize(("size", "scheme"), matrix(VIEWS, VIEWS[::3]))
def test_what_fired_its_guard_and_the_cursor_are_in_view(
    open_page: Open, size: str, scheme: str
) -> None:
    page, trace = open_page("mass", size, color_scheme=scheme), mass()
    for record in trace.transitions[:12]:
        page.keyboard.press("Shift+ArrowRight")
        element = f"element{record.element + 1}"
        assert page.evaluate("views[0].element") == record.element
        assert in_view(page, f"#{element}-guard-{record.edge}.fired")
        assert in_view(page, f"#{element}-state-{record.target}.active")
        assert in_view(page, "tbody tr.fired")
        line, caption = (page.locator(q).bounding_box() for q in ("tr.fired >> nth=0", "caption"))
        assert line is not None
        assert caption is not None
        assert line["y"] >= caption["y"] + caption["height"] - 1
        assert in_view(page, ".token.fired")
        assert in_view(page, ".plot")  # the cursor crosses all plots
        cursor, plot = (page.locator(q).first.bounding_box() for q in (".cursor", ".plot"))
        assert cursor is not None
        assert plot is not None
        assert plot["x"] < cursor["x"] <= plot["x"] + plot["width"]
        assert f"element {record.element + 1} " in page.locator("#say").inner_text()
        assert page.evaluate("scrollY") == 0


def test_the_crosshair_tells_the_values_of_all_plots(open_page: Open) -> None:
    page, trace = open_page("mass", "laptop"), mass()
    box = page.locator(".u-over").nth(1).bounding_box()
    assert box is not None
    assert page.locator(".hair").is_hidden()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 10)
    assert page.locator(".hair").is_visible()
    row = page.evaluate("frames.rows[0][pointed]")
    t = page.evaluate("frames.t[pointed]")
    assert t == pytest.approx(0.6 * 60.0, abs=0.2)
    at = trace.sample([t])
    shown = page.locator(".plots output").all_inner_texts()
    wanted = page.evaluate(
        "(row) => ['F', 'v', 'x'].map((name) => eng(runs[0].contacts[0].value(name, 0, row), "
        "{F: 'N', v: 'm/s', x: 'm'}[name], 5))",
        row,
    )
    assert [shown[0], *shown[2:]] == wanted
    assert page.evaluate(f"runs[0].contacts[0].value('F', 0, {row})") == pytest.approx(
        float(at.F[0]), rel=1e-3
    )
    page.mouse.move(box["x"] + 10, box["y"] - 200)
    assert page.locator(".hair").is_hidden()
    assert page.locator(".plots output").first.inner_text() != shown[0]


def test_many_elements_are_one_chart_and_a_token_each(open_page: Open, tmp_path: Path) -> None:
    for n in (12, 20):
        trace = simulate(bank(n), Prescribed("0.15*sin(2*pi*t/5)"), 12.0)
        page = open_page(write_replay(tmp_path / f"{n}.html", trace), "laptop")
        assert page.locator("svg .state").count() == 2
        assert page.locator(".token").count() == n
        for record in trace.transitions[: 2 * n]:
            page.keyboard.press("Shift+ArrowRight")
            while page.evaluate("runs[0].fired.get(views[0].row)?.element") != record.element:
                page.keyboard.press("ArrowRight")
            token = page.locator(".token").nth(int(record.element))
            assert "fired" in (token.get_attribute("class") or "")
            assert token.locator(".state").inner_text() == record.target
            assert in_view(page, ".token.fired")
            assert page.locator(f"#element1-guard-{record.edge}.fired").count() == 1
        page.keyboard.press("f")
        for i in range(n):
            page.locator(".token").nth(i).click()
            assert page.locator(".who").inner_text() == f"Guards of element {i + 1}"
        page.keyboard.press("]")
        assert page.locator(".who").inner_text() == "Guards of element 1"
        page.keyboard.press("[")
        assert page.locator(".who").inner_text() == f"Guards of element {n}"


def test_elements_are_chosen_by_digit_list_and_click(open_page: Open) -> None:
    page = open_page()
    page.keyboard.press("2")
    assert page.locator(".region.chosen").get_attribute("id") == "element2"
    page.locator(".token").nth(3).click()
    assert page.locator(".region.chosen").get_attribute("id") == "element4"
    page.locator("#element3 .frame").click(position={"x": 20, "y": 40})
    assert page.locator(".who").inner_text() == "Guards of element 3"
    page.keyboard.press("9")
    assert page.locator(".who").inner_text() == "Guards of element 4"
