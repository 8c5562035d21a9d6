"""The planes of the replay page: dots at the values of the row, regions with the truths of the run.

A dot of the landscape that is dragged away from the row, by mouse, keys or a finger, says
"... would fire" exactly where Python finds a guard true.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace
from gms_fsm.language import evaluate
from gms_fsm.session.explain import explain, values_at
from tests.helpers import matrix
from tests.plots.browser import (
    Open,
    at_rows,
    box_of,
    browser,
    frame,
    open_page,
    open_tab,
    own_rows,
    press,
    run,
)

__all__ = ["browser", "open_page"]

pytestmark = pytest.mark.slow

# A plane of v and z, of v and F, and with named expressions.
NAMES = ("signed", "karnopp", "elasto-plastic")
PLACE = "views[0].open.right.placeOfDot()"

# For rows and elements: the lanes of the race, whether all their clauses are marked as true, and
# whether the region contains the dot or a point at most `far` px away from it.
SHOWN = """([asked, far]) => asked.map(([row, element]) => {
    const view = views[0], pane = view.open.right, steps = [-far, 0, far];
    view.choose(view.contact, element);
    show(frames.of[0][row]);
    const [x, y] = pane.placeOfDot();
    return $$(".lane", view.root).map((lane, i) => {
        const region = $$(".guarded", pane.regions)[i];
        const inside = new Set(steps.flatMap((dx) => steps.map((dy) =>
            region.isPointInFill(new DOMPoint(x + dx, y + dy)))));
        return {
            name: $("h3 span", lane).textContent.split(" ")[1],
            holds: $$(".mark", lane).every((mark) => mark.textContent === "✓"),
            inside: [...inside],
        };
    });
})"""


LAPTOP = [(name, "laptop") for name in NAMES]


@pytest.mark.parametrize(("name", "size"), matrix([*LAPTOP, ("signed", "phone")], LAPTOP))
def test_regions_and_the_race_have_the_truths_of_the_run(
    open_page: Open, name: str, size: str
) -> None:
    page, whole = open_page(name, size), run(name)
    trace = whole.contact(whole.contacts[0])
    press(page, "f")  # the selected element stays selected
    open_tab(page, "Landscape")
    numbers, own = dict(own_rows(page)), [row for row, _ in own_rows(page)]
    rng = np.random.default_rng(18)
    asked = [(int(rng.choice(own)), int(rng.integers(trace.n))) for _ in range(40)]
    seen = set()
    for (row, element), lanes in zip(asked, page.evaluate(SHOWN, [asked, 0.6]), strict=True):
        why = explain(trace, numbers[row], element)
        assert [lane["name"] for lane in lanes] == [each.edge.name for each in why]
        for lane, each in zip(lanes, why, strict=True):
            assert lane["holds"] == each.holds, (row, element, each)
            assert each.holds in lane["inside"], (row, element, each)
            seen.add((each.holds, tuple(lane["inside"])))
    assert {holds for holds, _ in seen} == {True, False}
    assert (False, (False,)) in seen  # not all dots are at a boundary


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


@pytest.mark.parametrize("name", NAMES)
def test_dragging_to_random_points_says_what_would_fire(open_page: Open, name: str) -> None:
    page, whole = open_page(name, "laptop"), run(name)
    trace = whole.contact(whole.contacts[0])
    press(page, "f")
    open_tab(page, "Landscape")
    numbers = dict(own_rows(page))
    answer = page.locator(".answer").first
    box = box_of(page, ".plane .ground")
    rng, fired = np.random.default_rng(18), []
    for _ in range(20):
        page.evaluate("(row) => show(row)", int(rng.choice([*numbers])))
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
    assert 2 < sum(map(bool, fired)) < len(fired) - 2


WORST = """() => {
    const { contact, row } = views[0], scope = contact.scope(0, row);
    return contact.leaving(contact.modes[0][row])
        .map((k) => worstClause(contact.clauses(k, scope))?.text ?? "");
}"""


@pytest.mark.parametrize("name", ["signed", "ball"])  # the ball's guards have compound clauses
def test_the_clause_that_holds_an_edge_back_is_that_of_the_printed_race(
    open_page: Open, name: str
) -> None:
    from plots.panels.guards.racing import held_back_by  # needs matplotlib

    page, trace = open_page(name), run(name)
    checked, contact, rows = 0, trace.contact(trace.contacts[0]), own_rows(page)[::3]
    for (_, number), shown in zip(rows, at_rows(page, [k for k, _ in rows], WORST), strict=True):
        why = explain(contact, number, 0)
        if why.left:
            continue
        wanted = [held_back_by(each) for each in why]
        assert shown == [each.text if each else "" for each in wanted]
        checked += sum(each is not None for each in wanted)
    assert checked > 15


@pytest.mark.parametrize("size", matrix(["laptop", "phone"], ["phone"]))
def test_keys_move_the_dot_and_escape_or_another_row_puts_it_back(
    open_page: Open, size: str
) -> None:
    page = open_page("signed", size)
    press(page, "f")
    open_tab(page, "Landscape")
    press(page, *["Shift+ArrowRight"] * 3)
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
        "ArrowDown": (-5, 30),
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


def test_a_finger_drags_the_dot_and_the_page_does_not_scroll(open_page: Open) -> None:
    page = open_page("signed", "phone", has_touch=True, is_mobile=True)
    open_tab(page, "Landscape")
    page.evaluate("document.querySelector('.right').scrollIntoView()")
    scrolled = page.evaluate("scrollY")

    def place() -> tuple[float, float]:
        box = box_of(page, ".probe .here")
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    x, y = place()
    finger = page.context.new_cdp_session(page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        found = [{"x": x, "y": y} for x, y in points]
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": found})

    touch("touchStart", (x, y))
    for k in range(1, 9):
        touch("touchMove", (x + 8 * k, y - 5 * k))
    touch("touchEnd")
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
    assert set((trace.modes != 0).sum(axis=1).tolist()) == {0, 1, 2, 3, 4}
    looks = page.evaluate(  # of each number of slipping elements
        """() => views[0].open.right.plots[0].paths.filter((path) => path.getAttribute("d"))
            .map((path) => getComputedStyle(path))
            .map((look) => [look.stroke, look.strokeWidth, look.strokeDasharray])"""
    )
    assert len(looks) == 5
    for look in zip(*looks, strict=True):
        assert len(set(look)) >= 4  # by colour, by width and by dash
