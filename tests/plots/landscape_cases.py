"""Runs whose guards are drawn in a plane: of v and z, of v and F, and with named expressions."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gms_fsm import Trace
from gms_fsm.inspection.explain import values_at
from gms_fsm.language import evaluate
from plots.replay import write_replay
from tests.plots.browser import Open, fig4
from tests.zoo.zoo_cases import CASES

if TYPE_CHECKING:
    from playwright.sync_api import Page

NAMES = ("gms", "karnopp", "elasto-plastic")


@cache
def run(name: str) -> tuple[Trace, Trace]:
    """Return a run, and the same as its contact sees it."""
    if name == "gms":
        return fig4("signed"), fig4("signed")
    trace = CASES[name](1.0).run()
    return trace, trace.contact(trace.contacts[0])


def opened(open_page: Open, folder: Path, name: str, size: str = "laptop", **options: Any) -> Page:
    """Open the landscape of a run."""
    page = open_page(write_replay(folder / f"{name}.html", run(name)[0]), size, **options)
    page.keyboard.press("f")  # the selected element stays selected
    page.get_by_role("tab", name="Landscape", exact=True).click()
    return page


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
