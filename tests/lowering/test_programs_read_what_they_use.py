"""A generated function reads exactly the names that it uses: the plan agrees with the printed text.

The plan derives them from the trees, the printer writes the text; this test compares both using the
text's own syntax tree.
"""

from __future__ import annotations

import ast

import pytest

from gms_fsm import Chart, ChartModel, Prescribed, PulledSlider, Slider, State, Stribeck
from gms_fsm.language import NAMESPACE
from gms_fsm.lowering.program import lower
from tests.helpers import stick_slip


def own(flow: str, force: str) -> ChartModel:
    """Return a model with names from the rig and from the text, two variables and one state."""
    chart = Chart(
        "own",
        ("t", "x", "v", "s"),
        ("z", "mass"),
        ("k", "F_c", "C"),
        (State("only", flow={"z": flow, "mass": "-mass"}),),
        (),
        {"F": force},
    )
    values = {"k": [1.0, 2.0], "F_c": 3.0, "C": 1.0}
    return ChartModel(chart, values, n=2, stribeck=Stribeck(1, 2, 0.1), weights=[1.0, 1.0])


MODELS = {
    "published": stick_slip("published"),
    "signed": stick_slip("signed"),
    "corners": own("v - abs(z - F_c * t) / s", "k * z + max(dz, x)"),
    "held signs alone": own("sgn(mass)", "C * mass"),
    "the power zero": own("v**0 + k * s**0", "z * x**0"),
}
RIGS = {
    "formula": Prescribed("0.1 * abs(sin(t))"),
    "table": Prescribed([(0, 0), (1, 1)]),
    "function": Prescribed(lambda t: t),
    "pushed": Slider(1.0, [(0, 0), (1, 1)]),
    "pulled": PulledSlider(1.0, 2.0, 0.1),
}
TOGETHER = {"shared", "own", "tables"}  # unpacked from one tuple, whichever is needed
SUPPLIED = {*NAMESPACE, "len", "range", "nan", "piecewise_linear", "piecewise_slope", "v_signal"}


def assigned_and_used(node: ast.AST) -> tuple[set[str], set[str]]:
    """Return the names that code assigns or takes as arguments, and those that it uses."""
    assigned = {each.arg for each in ast.walk(node) if isinstance(each, ast.arg)}
    used = set()
    for each in ast.walk(node):
        if isinstance(each, ast.Name):
            (used if isinstance(each.ctx, ast.Load) else assigned).add(each.id)
    return assigned, used


def disagreements(source: str) -> list[tuple[str, set[str]]]:
    """Return for each function the names read but not used, or used without being read."""
    module = ast.parse(source)
    known = set(SUPPLIED)
    for each in module.body:
        if isinstance(each, ast.Assign):
            known |= assigned_and_used(each)[0]  # states and edges
    found = []
    for each in module.body:
        if isinstance(each, ast.FunctionDef):
            assigned, used = assigned_and_used(each)
            arguments = {argument.arg for argument in each.args.args}
            found.append(
                (
                    each.name,
                    (assigned - arguments - TOGETHER) ^ (used - arguments - known - TOGETHER),
                )
            )
    return [(name, names) for name, names in found if names]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("rig", RIGS)
def test_names_are_read_exactly_if_used(model: str, rig: str) -> None:
    assert disagreements(lower(MODELS[model], RIGS[rig]).source) == []


def test_disagreements_are_found() -> None:
    source = lower(MODELS["corners"], RIGS["pulled"]).source
    assert disagreements(source.replace("        s = weight[i] * S\n", "", 1)) != []
    assert disagreements(source.replace("    n = len(own[0])", "    n = x = len(own[0])", 1)) != []
