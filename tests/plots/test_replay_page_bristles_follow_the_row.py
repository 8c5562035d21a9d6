"""The bristles of the replay page move with the row.

Contacts are where z puts them, pegs show where contacts do not move, the ground moves with x.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.charts.registry import entry
from gms_fsm.systems.models import demonstration
from plots.replay import write_replay
from tests.helpers import SINE, bank, wear
from tests.plots.browser import Open, browser, events, mass, open_page, open_tab, pages
from tests.plots.systems_to_draw import BALL, BLOCKS, run
from tests.systems_cases import puck

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow

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


@cache
def many() -> Trace:
    return simulate(bank(20), Prescribed(SINE), 20.0)


def opened(
    open_page: Open, folder: Path, trace: Trace, size: str = "laptop", **options: Any
) -> Any:
    page = open_page(write_replay(folder / "page.html", trace), size, **options)
    open_tab(page, "Bristles")
    return page


def own_rows(page: Any, count: int, seed: int = 18) -> list[tuple[int, int]]:
    """Return random rows of the page that are rows of the run, with their numbers there."""
    numbers, between = page.evaluate("[[...runs[0].number], [...runs[0].between]]")
    own = [(row, number) for row, number in enumerate(numbers) if not between[row]]
    chosen = np.random.default_rng(seed).choice(len(own), min(count, len(own)), replace=False)
    return [own[k] for k in chosen]


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_contacts_are_where_z_puts_them(open_page: Open, tmp_path: Path, size: str) -> None:
    trace = mass()
    page = opened(open_page, tmp_path, trace, size)
    places, z, ends = [], [], set()
    for row, number in own_rows(page, 50):
        page.evaluate(f"go({row})")
        elements = page.evaluate(ELEMENTS)
        places.append([element["x"] for element in elements])
        ends |= {round(element["end"]) for element in elements}
        z.append(trace.z[number])
    slope, rest = np.polyfit(np.ravel(z), np.ravel(places), 1)
    np.testing.assert_allclose(np.ravel(places), rest + slope * np.ravel(z), atol=0.05)
    assert slope < 0  # the slider moves to the right, away from its contacts
    largest = float(np.abs(trace.z).max())
    assert -slope * largest == pytest.approx(page.evaluate("views[0].open.left.swing"), rel=1e-3)
    assert len(ends) <= 2  # springs end at the slider, which stands still


@pytest.mark.parametrize("name", ["mass", "wear"])
def test_a_peg_is_a_default_state(open_page: Open, tmp_path: Path, name: str) -> None:
    trace = mass() if name == "mass" else simulate(wear(), Prescribed("0.2 * sin(t)"), 20.0)
    page = opened(open_page, tmp_path, trace)
    default = trace.model.chart.default_state.name
    counts = {True: 0, False: 0}
    for row, number in own_rows(page, 50):
        page.evaluate(f"go({row})")
        v = trace.v[number]
        for element, state in zip(page.evaluate(ELEMENTS), trace.states[number], strict=True):
            held = bool(state == default)
            counts[held] += 1
            assert element["peg"] == held
            assert element["arrow"] == (not held and v != 0)
            assert element["texts"][0].split()[1] == state
            if element["arrow"]:
                assert element["way"] == np.sign(v)
    assert min(counts.values()) > 10


@pytest.mark.parametrize("name", ["end-stop", "stiction"])
def test_without_bristles_a_peg_is_a_locked_state(
    open_page: Open, tmp_path: Path, name: str
) -> None:
    trace = run(BALL if name == "end-stop" else BLOCKS)
    trace = trace.contact(trace.contacts[0])
    page = opened(open_page, tmp_path, trace)
    locked = [state.name for state in trace.model.chart.states if state.locked]
    seen = set()
    for row, number in own_rows(page, 50):
        page.evaluate(f"go({row})")
        state = trace.states[number, 0]
        assert page.evaluate(ELEMENTS)[0]["peg"] == (state in locked)
        seen.add(str(state))
    assert len(seen) > 1 or name == "end-stop"  # a ball that bounces is free


def test_a_contact_that_sticks_moves_with_the_ground(open_page: Open, tmp_path: Path) -> None:
    trace = mass()
    page = opened(open_page, tmp_path, trace)
    checked = slid = 0
    first = events(page)[0]
    before = None
    for row in range(first + 1, first + 120):
        page.evaluate(f"go({row})")
        elements, ground = page.evaluate(ELEMENTS), page.evaluate(GROUND)
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


def test_values_are_those_of_the_run(open_page: Open, tmp_path: Path) -> None:
    trace = mass()
    page = opened(open_page, tmp_path, trace)
    for row, number in own_rows(page, 20):
        page.evaluate(f"go({row})")
        speed, push = page.locator(".bristles .motion text").all_text_contents()
        assert speed == page.evaluate(f"'v = ' + eng({float(trace.v[number])!r}, 'm/s', 4)")
        assert push == page.evaluate(
            f"'F = ' + eng({float(np.float32(trace.F[number]))!r}, 'N', 4)"
        )
        for i, element in enumerate(page.evaluate(ELEMENTS)):
            z = float(trace.z[number, i])
            assert element["texts"][1] == page.evaluate(f"'z ' + eng({z!r}, 'm', 4)")


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_the_element_that_fires_is_in_view(open_page: Open, tmp_path: Path, size: str) -> None:
    page = opened(open_page, tmp_path, many(), size)
    assert page.locator(".bristles .element").count() == 20
    seen = set()
    for k in events(page)[:60]:
        page.evaluate(f"go({k})")
        element, inside, height = page.evaluate(
            """() => {
                const of = (q) => document.querySelector(q).getBoundingClientRect();
                const fired = of(".bristles .element.fired .back"), box = of("#run1-bristles");
                return [views[0].element, fired.top >= of(".bristles .motion").bottom - 1
                    && fired.bottom <= box.bottom + 1, views[0].open.left.height];
            }"""
        )
        seen.add(element)
        assert inside, element
        assert height >= 26
    assert len(seen) == 20


def test_a_click_chooses_the_element(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, mass())
    page.locator(".bristles .element .label").nth(2).click()
    assert page.evaluate("views[0].element") == 2
    assert page.locator(".bristles .chosen .label").text_content().startswith("E3")


@pytest.mark.parametrize("name", ["backlash", "dahl", "planar", "blocks", "rate-state-ageing"])
def test_charts_of_every_kind_are_drawn(open_page: Open, tmp_path: Path, name: str) -> None:
    if name == "planar":
        trace = puck().run()
    elif name == "blocks":
        trace = run(BLOCKS)
    else:
        trace = simulate(demonstration(entry(name)), Prescribed("1e-3 * sin(6 * t)"), 3.0)
    page = opened(open_page, tmp_path, trace)
    for row, _ in own_rows(page, 10):
        page.evaluate(f"go({row})")
        elements = page.evaluate(ELEMENTS)
        assert [element["springs"] for element in elements] == [3 if name == "dahl" else 1]
        assert len(elements[0]["texts"]) == (2 if name == "dahl" else 1)
        assert page.locator(".bristles .motion text").nth(1).text_content().startswith("F = ")
    notes = page.locator(".bristles .motion p").all_inner_texts()
    assert notes == (
        ["v is the first of the velocities v, w; the others are not drawn."] * (name == "planar")
    )


def test_contacts_of_a_system_are_drawn_when_chosen(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, run(BLOCKS))
    labels = []
    for name in page.evaluate("runs[0].contacts.map(({ name }) => name)"):
        page.locator(".contact").select_option(name)
        labels.append(page.locator(".bristles .elements").get_attribute("aria-label"))
        assert name in labels[-1]
    assert len(set(labels)) == 2


def test_a_row_is_drawn_in_less_than_10_ms(open_page: Open, tmp_path: Path) -> None:
    page = opened(open_page, tmp_path, many())
    times = page.evaluate(
        """async () => {
            const times = [], pane = views[0].open.left;
            for (let k = 0; k < runs[0].rows; k += 3) {
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
