"""State machines, if-else text and machine code give the same run to the last bit, failures too.

Compared are rows, micro-steps, states, all that rows show, both sides of every stop, slides and the
log; where a run fails, the same error with the same text, and the same part that was computed.
"""

from __future__ import annotations

import zlib
from dataclasses import fields

import numpy as np
import pytest

import gms_fsm
from gms_fsm.run.machines import IfElse
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.own_machines import engine_of
from gms_fsm.run.settings import Settings
from integrators import JUMPED, LET_GO
from tests.corpus import CORPUS, ENGINES, FAILING, FAILURES, each, outcome, run, trace
from tests.helpers import other_parts, same_logs
from tests.soak.random_systems import trial

STILL = {  # the others switch: the laws would hold where nothing happens, too
    "fig. 3",
    "scenario paper_fig3_non_drifting",
    "lugre",
    "lugre slider",
    "dahl",
    "lugre-sigma1",
    "bouc-wen",
    "rate-state-ageing",
    "rate-state-slip",
    "seven-parameter",
    "prandtl-tomlinson",
    "coulomb",
    "micrometres",
    "on a belt",
    "runs down",
    "random system 1",
    "random system 4",
}


@each(CORPUS)
def test_runs_are_equal_to_the_last_bit(name: str) -> None:
    one = trace(name, ENGINES[0])
    assert len(one) > 1
    assert len(one.transitions) or name in STILL
    for engine in ENGINES[1:]:
        assert other_parts(one, trace(name, engine)) == [], engine


@each(FAILING)
def test_failures_say_the_same_and_keep_the_same(name: str) -> None:
    one, said = outcome(name, ENGINES[0])
    kind, _, text = said.partition(": ")
    assert one is not None
    assert issubclass(getattr(gms_fsm, kind), FAILURES[name][0]), said
    assert "kept" in text
    assert "np." not in text
    for engine in ENGINES[1:]:
        other, too = outcome(name, engine)
        assert too == said, engine
        assert other_parts(one, other) == [], engine


@pytest.mark.every(2)
@each(FAILING)
@pytest.mark.parametrize("output", ["end", "t_eval"])
def test_failures_are_the_same_whatever_is_recorded(name: str, output: str) -> None:
    """With "end" the row recorded is the last that "all" would record; the log is complete."""
    whole, said = outcome(name)
    assert whole is not None
    times = np.linspace(run(name).how.get("t_start", 0.0), run(name).t_end, 41)
    how = {"output": output, "t_eval": times if output == "t_eval" else None}
    found = [run(name).outcome(engine=engine, **how) for engine in ENGINES]
    for other, too in found:
        assert too == said
        assert other is not None
        assert other_parts(found[0][0], other) == []
        same_logs(other, whole)
        if output == "end":
            assert other.t.tolist() == whole.t[-1:].tolist()
            assert other.rows.y.tobytes() == whole.rows.y[-1:].tobytes()
        else:
            assert other.t.tolist() == times[times <= whole.t[-1]][: len(other)].tolist()


def test_random_systems_are_drawn_again_by_their_numbers() -> None:
    one, same, other = (trial(7, index, 8) for index in (3, 3, 11))
    assert one.system.numbers == same.system.numbers
    assert one.kinds == other.kinds  # the same shape
    assert one.system.numbers != other.system.numbers


@pytest.mark.slow
def test_another_bit_is_found() -> None:
    changed = run("random system 0")(engine=ENGINES[0], rtol=1e-5)
    again = run("random system 0")(engine=ENGINES[0], rtol=1.0000000001e-5)
    assert "rows y" in other_parts(changed, again)


@each(CORPUS)
def test_both_decide_the_same_wherever_they_are_asked(name: str) -> None:
    """At random values, states, jolts, and edges that must not be taken twice."""
    what = run(name)
    how, options = dict(what.how), {each.name for each in fields(Settings)}
    chosen = Settings(**{key: how.pop(key) for key in options & {*how}})
    start = Problem.of(*(*what.subject, None)[:2], what.t_end, chosen, **how)
    program, draw = start.program, np.random.default_rng(zlib.crc32(name.encode()))
    engines = (engine_of(start, {}), IfElse(program))
    charts = [each.chart for each in start.system.machines for _ in range(each.n)]
    edges = [*range(-1, sum(len(each.chart.transitions) for each in start.system.machines))]
    size = 1e-9 + np.abs(start.y)
    for k in range(60):
        y = (draw.normal(size=size.size) * size * 10.0 ** draw.integers(0, 9)).tolist()
        mode = [int(draw.integers(len(chart.states))) for chart in charts]
        jolt = draw.choice([0, JUMPED, LET_GO], size=len(mode)).tolist()
        skip = draw.choice(edges, size=len(mode)).tolist()
        asked = []
        for engine in engines:
            asked.append(list(skip))
            engine.ask(start.t_start + 0.1 * k, y, mode, program.p, jolt, asked[-1])
        assert asked[0] == asked[1], (y, mode, jolt, skip)
