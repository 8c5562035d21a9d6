"""The landscape shows the truths of `explain` at the rows of a run: in the race and as regions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm.inspection.explain import explain
from tests.plots.browser import Open, browser, open_page, pages
from tests.plots.landscape_cases import NAMES, opened, run

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow

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


@pytest.mark.parametrize(("size", "rows"), [("laptop", 400), ("phone", 200)])
@pytest.mark.parametrize("name", NAMES)
def test_truths_at_random_rows(
    open_page: Open, tmp_path: Path, name: str, size: str, rows: int
) -> None:
    page, (_, trace) = opened(open_page, tmp_path, name, size), run(name)
    numbers, between = page.evaluate("[[...runs[0].number], [...runs[0].between]]")
    own = [row for row, sample in enumerate(between) if not sample]
    rng = np.random.default_rng(18)
    asked = [(int(rng.choice(own)), int(rng.integers(trace.n))) for _ in range(rows)]
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
