"""The landscape says what would fire at its dot, and what holds an edge back, as Python does.

A dot dragged away from the row says "... would fire" exactly where Python finds a guard true.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm.inspection.explain import explain
from plots.replay import write_replay
from tests.plots.browser import Open, browser, open_page, pages
from tests.plots.landscape_cases import NAMES, first_to_fire, opened, run
from tests.plots.systems_to_draw import BALL
from tests.plots.systems_to_draw import run as run_of

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow

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
def test_dragging_to_random_points(open_page: Open, tmp_path: Path, name: str) -> None:
    page, (_, trace) = opened(open_page, tmp_path, name), run(name)
    numbers, between = page.evaluate("[[...runs[0].number], [...runs[0].between]]")
    own = [row for row, sample in enumerate(between) if not sample]
    plane, dot, answer = (page.locator(q) for q in (".plane .ground", ".probe", ".answer"))
    box = plane.bounding_box()
    assert box is not None
    rng, fired = np.random.default_rng(18), []
    for _ in range(60):
        page.evaluate("(row) => show(row)", int(rng.choice(own)))
        dot.hover(force=True)
        page.mouse.down()
        x, y = rng.uniform(size=2)
        page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"], steps=2)
        page.mouse.up()
        found = page.evaluate(POINT)
        row, state, (v, z) = found["row"], found["state"], found["point"]
        if between[row]:
            continue
        edge, text = first_to_fire(trace, numbers[row], 0, state, v, z), answer.first.inner_text()
        drawn = [name for name, inside in found["regions"].items() if all(inside)]
        near = [name for name, inside in found["regions"].items() if any(inside)]
        assert edge in near if edge else not drawn
        if edge:
            assert text == f"{edge} would fire"
        else:
            assert text.startswith(("nothing would fire: ", "no edge leaves "))
        fired.append(edge)
    assert 10 < sum(map(bool, fired)) < len(fired) - 10


WORST = """() => {
    const { contact, row } = views[0], scope = contact.scope(0, row);
    return contact.leaving(contact.modes[0][row])
        .map((k) => worstClause(contact.clauses(k, scope))?.text ?? "");
}"""


@pytest.mark.parametrize("name", ["gms", "ball"])  # the guards of the ball have compound clauses
def test_the_clause_that_holds_an_edge_back_is_that_of_the_printed_race(
    open_page: Open, tmp_path: Path, name: str
) -> None:
    from plots.panels._race import held_back_by  # needs matplotlib

    trace = run(name)[0] if name == "gms" else run_of(BALL)
    page = open_page(write_replay(tmp_path / "page.html", trace))
    numbers, between = page.evaluate("[[...runs[0].number], [...runs[0].between]]")
    checked = 0
    for k in [row for row, sample in enumerate(between) if not sample][::3]:
        why = explain(trace.contact(trace.contacts[0]), numbers[k], 0)
        if why.left:
            continue
        page.evaluate("(row) => show(row)", k)
        wanted = [held_back_by(each) for each in why]
        assert page.evaluate(WORST) == [each.text if each else "" for each in wanted]
        checked += sum(each is not None for each in wanted)
    assert checked > 15
