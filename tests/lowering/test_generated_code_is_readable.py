"""The generated program is text that a person can read, search, and step through with a debugger.

It contains the guards as the chart writes them and no values chosen by the user; a traceback
through it shows its lines; `inspect` finds its source.
"""

from __future__ import annotations

import dataclasses
import inspect
import io
import linecache
import math
import sys
import textwrap
import tokenize
import traceback
from types import FrameType
from typing import Any

import numpy as np
import pytest

from gms_fsm import GMS, ChartModel, GMSParameters, LuGre, Prescribed, Slider, Stribeck
from gms_fsm.charts import LAWS, gms_element
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.language import spell
from gms_fsm.lowering.program import Program, lower
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from tests.helpers import open_loop, pulled_mass, stick_slip

LUGRE = LuGre(sigma_0=1234.5, sigma_1=31.625, sigma_2=4.125, stribeck=Stribeck(1, 1.5, 1e-3))


def odd_numbers(n: int, seed: int) -> GMS:
    """A bank whose parameters differ from every number that a program contains."""
    random = np.random.default_rng(seed)
    parameters = GMSParameters(
        *random.uniform(0.1, 0.9, (3, n)),
        sigma_2=random.uniform(0.1, 0.9),
        stribeck=Stribeck(*np.sort(random.uniform(0.1, 0.9, 2)), random.uniform(1e-3, 9e-3)),
        v_c=random.uniform(1e-6, 9e-6),
        weights=random.uniform(0.1, 0.9, n),
    )
    return GMS(parameters, law="signed")


CASES: list[tuple[Model, Rig]] = [
    (stick_slip("published"), open_loop()),
    (stick_slip("signed"), Prescribed([(0, 0), (1, 0.2)])),
    pulled_mass(),
    (LUGRE, Slider(1.5, "0.1*t")),
    (LUGRE, Prescribed(math.sin)),
]


def _numbers(source: str) -> set[float]:
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    return {float(t.string) for t in tokens if t.type == tokenize.NUMBER}


@pytest.mark.parametrize(("model", "rig"), CASES)
def test_guards_appear_as_in_the_chart(model: Model, rig: Rig) -> None:
    source = lower(model, rig).source
    for edge in model.chart.transitions:
        assert spell(model.chart.guards[edge.name]) == edge.guard
        assert f"if {edge.guard}:" in source
        assert f"{edge.name.upper()}  # {edge.source} -> {edge.target}" in source
    for state in model.chart.states:
        assert len(model.chart.states) == 1 or state.name.upper() in source


@pytest.mark.parametrize("law", LAWS)
def test_flows_appear_as_in_the_chart(law: str) -> None:
    source = lower(stick_slip(law), open_loop()).source
    rate = {
        "published": "dz = sgn_v * C[i] * (1.0 - z / s)",
        "signed": "dz = C[i] * (sgn_v - z / s)",
    }[law]
    assert rate in source
    assert "dz = v\n" in source
    curve = """\
found = False
for i in range(n):
    found = found or mode[i] == SLIP
if found:
    if abs(v) > v_flat:
        S = F_c
    else:
        S = F_c + (F_s - F_c) * exp(-(v * (1.0 / v_s) * (v * (1.0 / v_s))))  # (2)
"""
    assert "\n    S = nan  # computed if it is read\n" in source
    assert textwrap.indent(curve, 4 * " ") in source
    assert "F_i = k[i] * z + sigma[i] * dz  # (3)" in source
    assert "+ sigma_2 * v  # (4)" in source


def test_no_user_value_is_in_the_text() -> None:
    model, rig = odd_numbers(4, seed=3), Slider(0.7351, [(0.123, 0.456), (0.789, 0.987)])
    p = model.parameters
    theirs = {
        *p.k, *p.sigma, *p.C, *p.weights, p.sigma_2, p.v_c, 0.7351, 0.123, 0.456, 0.789, 0.987,
        p.stribeck.F_c, p.stribeck.F_s, p.stribeck.v_s, p.stribeck.dip,
    }  # fmt: skip
    found = _numbers(lower(model, rig).source)
    assert found & {float(number) for number in theirs} == set()
    assert all(number == int(number) and number < 20 for number in found)
    # So one text serves every parameter set and every number of elements.
    texts = {lower(odd_numbers(n, seed), rig).source for n in (1, 2, 5) for seed in (1, 2)}
    assert len(texts) == 1


@pytest.mark.parametrize(("model", "rig"), CASES)
def test_lines_are_short_and_inspect_finds_every_function(model: Model, rig: Rig) -> None:
    program = lower(model, rig)
    assert max(len(line) for line in program.source.splitlines()) <= 100
    assert "\t" not in program.source
    for name, function in program.functions.items():
        assert function.__doc__
        text = inspect.getsource(function)
        assert text.startswith(f"def {name}(")
        assert text in program.source
        lines, first = inspect.getsourcelines(function)
        assert program.source.splitlines(keepends=True)[first - 1 : first - 1 + len(lines)] == lines


def test_the_source_outlives_a_check_of_the_cache() -> None:
    program = lower(*pulled_mass())
    filename = program.functions["flow"].__code__.co_filename
    linecache.checkcache()
    assert "".join(linecache.getlines(filename)) == program.source
    assert "GMS element, signed law" in filename


def test_a_traceback_shows_the_line_that_failed() -> None:
    program = lower(stick_slip("signed"), Prescribed("1/t"))
    out = [0.0] * 100
    with pytest.raises(ZeroDivisionError) as caught:
        program.functions["observe"](0.0, [0.0] * 5, [0] * 4, program.live, program.p, out)
    shown = "".join(traceback.format_exception(caught.value))
    assert "v = 1.0 / t" in shown
    assert "in observe" in shown


def _stepped(program: Program, name: str, *arguments: Any) -> list[str]:
    """Run a function under a tracer, as a debugger does, and return the lines visited."""
    filename, seen = program.functions[name].__code__.co_filename, []

    def tracer(frame: FrameType, event: str, _: Any) -> Any:
        if event == "line" and frame.f_code.co_filename == filename:
            seen.append(linecache.getline(filename, frame.f_lineno).strip())
        return tracer

    before = sys.gettrace()
    sys.settrace(tracer)
    try:
        program.functions[name](*arguments)
    finally:
        sys.settrace(before)
    return seen


def test_a_debugger_steps_through_a_decision() -> None:
    program = lower(stick_slip("signed"), Prescribed("0.2"))
    out = [-1] * 4
    y, mode = [0.0, 0.5, 0.1, 0.1, 0.1], [0] * 4
    seen = _stepped(program, "switch", 0.0, y, mode, program.p, program.calm, out)
    assert out[0] == 0
    assert seen.count("if z >= s and v > v_c:") == 4
    assert seen.count("edge = BREAK_AWAY_FORWARD  # stick -> slip") == 1
    assert seen.count("elif z <= -s and v < -v_c:") == 3
    assert "" not in seen


def test_names_cannot_end_a_comment_or_a_string() -> None:
    chart = gms_element("signed")
    hostile = 'x\nimport os  # """ \\ \r\u2028raise SystemExit'
    renamed = dataclasses.replace(chart, name=hostile)
    model = ChartModel(renamed, stick_slip("signed").values, n=4, stribeck=Stribeck(1, 1.5, 1e-3))
    source = lower(model, open_loop()).source
    assert (
        source.splitlines()[1:] == lower(stick_slip("signed"), open_loop()).source.splitlines()[1:]
    )
    assert source.splitlines()[0].startswith("# x import os")


def test_powers_are_products_and_fractions_are_not_integers() -> None:
    chart = Chart(
        "cubic",
        ("v",),
        ("z",),
        ("k",),
        (State("a", {"z": "v**3 * (1/2)"}), State("b", {"z": "0"})),
        (Transition("e", "a", "b", "z**2 > 1/4"),),
        {"F": "k * z**3"},
    )
    source = lower(
        ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1, 1.5, 1e-3)), Prescribed("t**2")
    ).source
    assert "**" not in source
    assert "if z * z > 1.0 / 4.0:" in source
    assert "dz = v * v * v * (1.0 / 2.0)" in source
