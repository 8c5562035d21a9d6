"""Claim: the plain form in C has the bits of the engine that looks at guards once a step."""

from __future__ import annotations

import itertools
import math
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    GMSParameters,
    Prescribed,
    State,
    System,
    Transition,
    export,
    simulate,
)
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.c import plain_c
from tests.corpus import JUMPING, LIGHT
from tests.exporters.c_programs import (
    COMPILERS,
    needs_c,
    plain_compared,
    plain_library,
    plain_step,
)
from tests.exporters.frictions import case, loaded
from tests.exporters.plain_samples import sampled


@needs_c
@pytest.mark.slow
def test_the_bits_of_the_engine(tmp_path: Path) -> None:
    switches, _ = plain_compared("gms-4-signed", 1, COMPILERS[0], tmp_path)
    assert switches


@needs_c
@pytest.mark.slow
def test_a_sample_finds_every_arrest(tmp_path: Path) -> None:
    counts = sampled("GMS 4", 30_000, tmp_path, COMPILERS[0])
    assert counts.found == counts.arrests > 50
    assert counts.error < 0.01


@needs_c
@pytest.mark.slow
def test_a_sample_is_steps_up_to_the_change_of_direction_and_from_there(tmp_path: Path) -> None:
    model = case("gms-4-signed", 1).model
    one, other = (plain_library(tmp_path, Subject.of(model, "c99", name=name)) for name in "ab")
    random = np.random.default_rng(2)
    for v0, v1 in random.normal(size=(200, 2)).tolist():
        before = 0.1 * (v0 / (v0 - v1)) if v0 * v1 < 0.0 else 0.0
        if before:
            other("step", 0.5 * v0, before)
            other("step", 0.0, 0.0)
        other("step", 0.5 * ((0.0 if before else v0) + v1), 0.1 - before)
        assert one("sample", v0, v1, 0.1) == other("step", v1, 0.0)


@needs_c
@pytest.mark.slow
def test_further_inputs_position_and_time(tmp_path: Path) -> None:
    """What a chart reads besides v becomes an argument; x is the integral of v."""
    step = plain_step(tmp_path, Subject.of(loaded(), "c99", name="loaded"))
    body = Body("body", velocity="cos(3 * t)")
    system = System("moved", bodies=(body,), contacts=(loaded("0.5"),))
    how: Any = {"method": "euler", "step": 2.0**-6, "events": "step", "engine": "ifelse"}
    trace = simulate(system, 6.0, **how)
    last = np.append(np.diff(trace.t) > 0.0, True)  # of the rows at one time: after switching
    t, F = trace.t[last].tolist(), trace.contact("contact").F[last].tolist()
    found = [step(math.cos(3 * one), 0.5, one, two - one) for one, two in itertools.pairwise(t)]
    assert found == pytest.approx(F[:-1], rel=1e-12)
    assert len(trace.transitions) > 2


@needs_c
@pytest.mark.slow
def test_functions_that_jump_have_the_bits_of_the_engine(tmp_path: Path) -> None:
    friction = ChartModel(JUMPING, {"k": 1.0, "T": [0.7, 1.1]}, n=2)
    step = plain_step(tmp_path, Subject.of(friction, "c99", name="jumps"))
    rig, how = Prescribed("0.6 * cos(1.3 * t)"), {"method": "euler", "step": 2.0**-6}
    trace = simulate(friction, rig, 9.0, events="step", engine="ifelse", **how)  # type: ignore[arg-type]
    last = np.append(np.diff(trace.t) > 0.0, True)  # of the rows at one time: after switching
    t, v, F = (row[last].tolist() for row in (trace.t, trace.v, trace.F))
    found = [
        step(w, one, two - one) for (one, two), w in zip(itertools.pairwise(t), v, strict=False)
    ]
    assert found == F[:-1]
    assert len(trace.transitions) > 10


@needs_c
@pytest.mark.slow
def test_states_in_states(tmp_path: Path) -> None:
    """Ages and histories are variables of the struct; exits and entries are those of the chart."""
    step = plain_step(tmp_path, Subject.of(LIGHT, "c99", name="light"))
    how: Any = {"method": "euler", "step": 2.0**-6, "events": "step", "engine": "ifelse"}
    trace = simulate(LIGHT, Prescribed("cos(3 * t)"), 12.0, **how)
    last = np.append(np.diff(trace.t) > 0.0, True)
    t, F = trace.t[last].tolist(), trace.F[last].tolist()
    found = [step(math.cos(3 * one), two - one) for one, two in itertools.pairwise(t)]
    assert found == pytest.approx(F[:-1], rel=1e-12)
    assert len(trace.transitions) > 30


def test_no_memory_but_the_struct() -> None:
    text = plain_c(Subject.of(case("gms-16-signed", 0).model, "c99", name="g"))["g_plain.c"]
    assert not re.search(r"malloc|^static (?!const)[^(]*[;=]", text, re.MULTILINE)
    assert text.count("static const") == text.count("static const double")


def test_names_of_the_printer_give_way() -> None:
    """A chart may use the names that the text would use: i, dt, F_i, friction, weight, stribeck."""
    names = ("i", "dt", "F_i", "friction", "weight", "stribeck", "F_c")
    chart = Chart(
        "names",
        inputs=("v", "s"),
        variables=("z",),
        parameters=names,
        states=(State("a", flow={"z": "v - s * (" + " + ".join(names) + ")"}),),
        outputs={"F": "z"},
    )
    stribeck = GMSParameters.paper("stick-slip").stribeck
    model = ChartModel(chart, dict.fromkeys(names, 1.0), n=2, stribeck=stribeck)
    text = plain_c(Subject.of(model, "c99", name="n"))["n_plain.c"]
    assert "for (int i2 = 0; i2 < 2; i2++)" in text
    assert "const double model_stribeck = model_F_c + (F_s - model_F_c)" in text


@needs_c
@pytest.mark.slow
def test_states_of_any_name_compile(tmp_path: Path) -> None:
    """h and H, stick and Stick, a parameter named as the guard of the header; also in C++."""
    states = ("h", "H", "stick", "Stick", "H_2")
    chart = Chart(
        "names",
        variables=("z",),
        parameters=("IT_PLAIN_H",),
        states=tuple(State(name, flow={"z": "v"}) for name in states),
        transitions=tuple(
            Transition(f"e{k}", one, two, guard=f"z > {k}")
            for k, (one, two) in enumerate(itertools.pairwise(states))
        ),
        outputs={"F": "IT_PLAIN_H * z"},
    )
    subject = Subject.of(ChartModel(chart, {"IT_PLAIN_H": 2.0}), "c99", name="it")
    for compiler in COMPILERS:
        step = plain_step(tmp_path, subject, compiler)
        assert [step(1.0, 1.0) for _ in range(4)] == [0.0, 2.0, 4.0, 6.0]
    if shutil.which("g++"):  # the header only, twice: it names functions of C
        main = '#include "it_plain.h"\n' * 2
        main += "int main() { it_plain f; it_plain_start(&f); return it_plain_step(&f, 1, 1) > 0; }"
        (tmp_path / "main.cc").write_text(main)
        command = ["g++", "-Wall", "-Werror", "-c", "main.cc"]
        subprocess.run(command, cwd=tmp_path, check=True)


def test_names_of_the_text_itself_are_refused() -> None:
    chart = Chart(
        "own",
        variables=("z",),
        parameters=("it_plain_sgn",),
        states=(State("a", flow={"z": "sgn(v)"}),),
        outputs={"F": "it_plain_sgn * z"},
    )
    model = ChartModel(chart, {"it_plain_sgn": 1.0})
    with pytest.raises(ParameterError, match=r"name 'it_plain_sgn'.*the text itself"):
        plain_c(Subject.of(model, "c99", name="it"))
    assert plain_c(Subject.of(model, "c99", name="other"))


@needs_c
@pytest.mark.slow
def test_one_state_needs_no_field(tmp_path: Path) -> None:
    """An edge of a chart of one state takes its actions, and nothing else."""
    chart = Chart(
        "reset",
        variables=("z",),
        states=(State("a", flow={"z": "v"}),),
        transitions=(Transition("back", "a", "a", guard="z >= 2", actions={"z": "0"}),),
        outputs={"F": "z"},
    )
    subject = Subject.of(ChartModel(chart, {}), "c99", name="reset")
    step = plain_step(tmp_path, subject)
    assert [step(1.0, 1.0) for _ in range(5)] == [0.0, 1.0, 0.0, 1.0, 0.0]
    assert "state" not in plain_c(subject)["reset_plain.h"]


def test_a_name_of_an_expression_that_c_has_is_refused(tmp_path: Path) -> None:
    chart = Chart("named", inputs=("v",), let={"double": "2 * v"}, states=(State("on"),),
                  outputs={"F": "double"})  # fmt: skip
    with pytest.raises(ParameterError, match="let 'double'"):
        export(ChartModel(chart, {}), "c99", tmp_path)
