"""Two runs are shown side by side on one time axis, with their first difference pinned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from plots.replay import write_replay
from tests.helpers import FIG4_SINE, stick_slip
from tests.plots.browser import Open, browser, fig4, frame, open_page, pages, said

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


def test_two_runs_are_shown_at_the_same_time(open_page: Open) -> None:
    page = open_page("two")
    assert page.locator(".run").count() == 2
    boxes = [page.locator(".run").nth(i).bounding_box() for i in (0, 1)]
    assert boxes[0] is not None
    assert boxes[1] is not None
    assert boxes[0]["y"] == boxes[1]["y"]
    assert boxes[0]["x"] < boxes[1]["x"]
    for _ in range(12):
        page.keyboard.press("Shift+ArrowRight")
    t = page.evaluate("frames.t[frame]")
    for place, law in enumerate(("published", "signed")):
        trace = fig4(law)
        row = int(np.searchsorted(trace.t, t, side="right")) - 1
        assert page.evaluate(f"runs[{place}].t(views[{place}].row)") <= t
        for i, state in enumerate(trace.states[row]):
            name = f"element{i + 1}-state-{state}"
            ident = name if place == 0 else f"run2-{name}"
            micro = trace.microstep[row] > 0  # within an instant the states still change
            assert micro or page.locator(f"#{ident}.active").count() == 1
    page.locator("#run2-element1-guard-arrest").click()
    assert page.locator(".guard.break").count() == 1
    page.keyboard.press("c")
    assert "breakpoint: element 1, arrest" in said(page)
    page.fill("#until", "F > 1.2")
    page.press("#until", "Enter")
    assert frame(page) > 0


def test_a_shorter_run_is_said_to_have_ended(open_page: Open, tmp_path: Path) -> None:
    short = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 30.0)
    page = open_page(write_replay(tmp_path / "page.html", fig4("signed"), short))
    values = page.locator(".values").nth(1)
    for k, ended in (
        (np.searchsorted(fig4("signed").t, 29.0), False),
        (page.evaluate("last"), True),
    ):
        page.evaluate(f"go({k})")
        assert ("ended at 30.000 s" in values.inner_text()) == ended
        assert said(page).endswith("run 2: ended") == ended
    assert "run 1: element 1 is in" in said(page)


def test_margins_and_the_time_axis_of_both_runs_are_in_view(open_page: Open) -> None:
    page = open_page("two", "laptop")
    for place in (1, 2):
        for inner, outer in (("thead th:nth-child(4)", ".why"), (".time-unit", ".pane.time")):
            of = [
                page.locator(f".run:nth-child({place}) {q}").bounding_box() for q in (inner, outer)
            ]
            assert of[0] is not None
            assert of[1] is not None
            right, bottom = (
                [box[at] + box[size] for box in of]
                for at, size in (("x", "width"), ("y", "height"))
            )
            assert right[0] <= right[1] + 1
            assert bottom[0] <= bottom[1] + 1


def test_lines_of_the_other_run_are_drawn_where_both_are_compared(open_page: Open) -> None:
    page = open_page("two")
    counts = page.evaluate(
        "views.map((view) => view.open.right.plots.map(({ plot }) => plot.series.length - 1))"
    )
    assert counts == [[2, 6, 2, 2], [2, 6, 2, 2]]


def test_the_first_difference_is_pinned(open_page: Open, tmp_path: Path) -> None:
    page = open_page("two")
    logs = [
        [(int(r.element), str(r.edge)) for r in fig4(law).transitions]
        for law in ("published", "signed")
    ]
    k = next(k for k, (a, b) in enumerate(zip(*logs, strict=False)) if a != b)
    page.click("#difference")
    assert f"first difference, transition {k + 1}: " in said(page)
    for place, law in enumerate(("published", "signed")):
        record = fig4(law).transitions[k]
        assert f"run {place + 1}: element {record.element + 1} {record.source} → " in said(page)
    t = min(fig4(law).transitions.t[k] for law in ("published", "signed"))
    assert page.evaluate("frames.t[frame]") == t
    assert page.locator(".pin").count() == 2
    pin, plot = (page.locator(q).first.bounding_box() for q in (".pin", ".u-over"))
    assert pin is not None
    assert plot is not None
    assert pin["x"] == pytest.approx(plot["x"] + plot["width"] * t / 100.0, abs=3)
    page.keyboard.press("Home")
    page.keyboard.press("d")
    assert page.evaluate("frames.t[frame]") == t
    same = open_page(write_replay(tmp_path / "same.html", fig4("signed"), fig4("signed")))
    same.keyboard.press("d")
    assert "same transitions in the same order" in said(same)
    assert frame(same) == 0
    assert same.locator(".pin").first.is_hidden()
