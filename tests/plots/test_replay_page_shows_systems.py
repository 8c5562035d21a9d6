"""The page shows systems: each contact by its name, bodies, signals, sampled values.

Its truths are those of the run, for charts that read forces, accelerations, named expressions and
clocks.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Body, Contact, System, Trace, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.inspection.explain import explain
from plots.replay import write_replay
from tests.plots.browser import Open, browser, open_page, open_tab, pages, said
from tests.plots.systems_to_draw import BALL, BLOCKS, PULLED, SERVO, SHARED, TIMED, run

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


STRONG = replace(SERVO, numbers={**SERVO.numbers, "k_p": 8.0})


def sled(chart: str, values: dict[str, float], **inputs: str) -> System:
    """Return a mass that is pulled to and fro over a contact."""
    pad = Contact("pad", CHARTS[chart], values, inputs=inputs)
    mass = Body("mass", inertia=1.0, force="3 * sin(2 * t) + 0.5 * t")
    return System("sled", bodies=(mass,), contacts=(pad,))


TRUTHS = """([place, rows]) => rows.map((row) => {
    const contact = runs[0].contacts[place];
    return contact.modes.map((mode, element) => {
        const asked = contact.asked(element, row), scope = contact.scope(element, asked.row);
        return contact.leaving(mode[asked.row]).map((k) => [
            contact.edges[k].name, truthOf(contact.edges[k].guard, scope),
            contact.clauses(k, scope).map(({ truth, margin }) => [truth, margin]),
        ]);
    });
})"""


def agree(page: object, place: int, trace: Trace) -> int:
    """Check the truths of a contact at the rows of the trace; return how many were true."""
    numbers, between = page.evaluate("[[...runs[0].number], [...runs[0].between]]")  # type: ignore[attr-defined]
    own = [row for row, sample in enumerate(between) if not sample]
    found = page.evaluate(TRUTHS, [place, own])  # type: ignore[attr-defined]
    count = 0
    for row, elements in zip(own, found, strict=True):
        for i, edges in enumerate(elements):
            why = explain(trace, numbers[row], i)
            assert [(name, truth == 1) for name, truth, _ in edges] == [
                (each.edge.name, each.holds) for each in why
            ]
            for each, (_, _, clauses) in zip(why, edges, strict=True):
                for clause, (truth, margin) in zip(each.clauses, clauses, strict=True):
                    assert (truth == 1) == clause.holds
                    assert margin is None or margin == clause.margin or np.isnan(clause.margin)
                count += each.holds
    return count


RUNS = {
    "pulled": lambda: run(PULLED),
    "ball": lambda: run(BALL),
    "blocks": lambda: run(BLOCKS),
    "servo": lambda: simulate(STRONG, 1.0),
    "timed": lambda: simulate(
        System(
            "timed",
            bodies=(Body("mass", inertia=1.0, force="4 * sin(3 * t)"),),
            contacts=(Contact("pad", TIMED, {"T_d": 0.3, "F_c": 1.0, "F_s": 1.5}),),
        ),
        6.0,
    ),
    "shared": lambda: simulate(
        System(
            "shared",
            bodies=(Body("mass", inertia=1.0, force="4 * sin(3 * t)"),),
            contacts=(Contact("pad", SHARED, {"k": 10.0, "F_c": 1.0, "b": 0.2}),),
        ),
        6.0,
    ),
    "karnopp": lambda: simulate(
        sled("karnopp", {"F_c": 1.0, "F_s": 1.5, "D": 1e-3, "sigma_2": 0.1}), 8.0
    ),
}


@pytest.mark.parametrize("name", RUNS)
def test_truths_of_every_contact_are_those_of_the_run(
    open_page: Open, tmp_path: Path, name: str
) -> None:
    trace = RUNS[name]()
    page = open_page(write_replay(tmp_path / "page.html", trace))
    true = sum(agree(page, k, trace.contact(each)) for k, each in enumerate(trace.contacts))
    assert true > 0


def test_a_contact_is_chosen_by_name(open_page: Open, tmp_path: Path) -> None:
    trace = run(BLOCKS)
    page = open_page(write_replay(tmp_path / "page.html", trace))
    assert page.locator("select.contact option").all_inner_texts() == ["pad1", "pad2"]
    page.keyboard.press("f")
    page.locator("select.contact").select_option("pad2")
    assert page.locator(".who").inner_text() == "Guards of pad2 1"
    page.keyboard.press("End")
    wanted = trace.contact("pad2")
    assert page.evaluate("views[0].contact.value('F', 0, views[0].row)") == pytest.approx(
        float(wanted.F[-1]), rel=1e-6
    )
    assert page.evaluate("views[0].contact.value('v', 0, views[0].row)") == wanted.v[-1]
    page.keyboard.press("f")  # what fires is selected, whatever its contact
    for record in trace.transitions[-6:][::-1]:
        page.keyboard.press("Shift+ArrowLeft")
        assert page.evaluate("views[0].contact.name") == record.contact
        assert f"{record.contact} 1 {record.source} → " in said(page)


def test_bodies_signals_and_sampled_values_have_plots(open_page: Open, tmp_path: Path) -> None:
    trace = simulate(STRONG, 1.0)
    page = open_page(write_replay(tmp_path / "page.html", trace), "laptop")
    open_tab(page, "System")
    heads = page.locator(".system h3 > span").all_inner_texts()
    for name in ("motor: x", "motor: v", "load: x", "load: v", "r, signal", "i, state"):
        assert any(head.startswith(name) for head in heads), name
    for name in ("u, sampled by pid", "I, sampled by pid", "bearing: F", "gear: F"):
        assert any(head.startswith(name) for head in heads), name
    page.keyboard.press("End")
    row = page.evaluate("views[0].row")
    values = page.evaluate(
        "(row) => Object.fromEntries(runs[0].system.values.map(({ name, column }) =>"
        "[name, runs[0].column(column)(row)]))",
        row,
    )
    for name in ("u", "I", "i"):
        assert values[name] == trace.value(name)[-1]
    assert values["r"] == pytest.approx(0.5 * np.sin(2.0 * trace.t[-1]), rel=1e-12)
    assert (
        page.evaluate(f"runs[0].column(runs[0].system.bodies[1].v)({row})")
        == (trace.body("load").v[-1])
    )
    assert len(page.locator(".system .ribbon").all()) == 2
    page.fill("#until", "gear.F > 0 and bearing.state(1) == stuck")
    page.press("#until", "Enter")
    assert page.locator("#until").get_attribute("aria-invalid") == "false"


def test_one_contact_of_a_run_has_a_page_of_its_own(open_page: Open, tmp_path: Path) -> None:
    trace = run(BLOCKS).contact("pad2")
    page = open_page(write_replay(tmp_path / "page.html", trace))
    assert page.locator("select.contact").is_hidden()
    assert page.get_by_role("tab", name="System").count() == 0
    page.keyboard.press("Shift+ArrowRight")
    assert f"pad2 1 {trace.transitions.source[0]} → " in said(page)
