"""Rows counted as they come are those of a run that keeps them.

The counts of guards, states and edges, and how close false comparisons came, are to the last bit
those made from the rows afterwards, of a run that stops with an error, too; the run is the same.
"""

from __future__ import annotations

import contextlib
from dataclasses import fields

import numpy as np
import pytest

from gms_fsm import Coverage, Trace, coverage
from gms_fsm.errors import GMSError
from gms_fsm.lowering.printing.counting import counting_of
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.recording.counted import CountTables
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import Run as PythonRun
from gms_fsm.traces.coverage.counting import FiredEdges, LogCounts, of_tables
from tests.corpus import CORPUS, FAILING, FEW, QUICK, Run, each, in_turn, outcome, run, trace
from tests.helpers import FASTEST, same_logs

SOME = (
    *(*QUICK, "fig. 3, slipping, published", "every kind of contact", "divided by zero"),
    "system pushed against a stop",  # its guards read a force without limit
)


def counted(one: Run, engine: str) -> tuple[Coverage, Trace]:
    """Return what a run counts, and the trace of its end."""
    how, options = dict(one.how), {each.name for each in fields(Settings)}
    chosen = {key: how.pop(key) for key in options & {*how}} | {"t_eval": None, "output": "end"}
    settings = Settings(**{**chosen, "engine": engine})
    start = Problem.of(*(*one.subject, None)[:2], one.t_end, settings, **how)
    counting = counting_of(start.program.plan)
    assert counting is not None
    tables = CountTables.empty(counting)
    made = CompiledRun if engine == "compiled" else PythonRun
    running = made(start, tables=tables)
    with contextlib.suppress(GMSError):
        while running.advance():
            pass
    if not isinstance(running, CompiledRun):
        assert running.counter is not None
        running.counter.put()
    end = running.recorder.trace()
    parts = {}
    for bank, part in zip(start.program.layout.banks, tables.parts(), strict=True):
        chart, firings = start.system.contact(bank.name).chart, end.firings
        mine = (firings.machine >= bank.first) & (firings.machine < bank.first + bank.n)
        element, edge = firings.machine[mine] - bank.first, firings.edge[mine] - bank.first_edge
        last = end.rows.mode[-1:, bank.elements]
        log = LogCounts.of(chart, FiredEdges(np.zeros_like(element), element, edge, last))
        parts[start.what.whose(bank.name)] = of_tables(chart, log, *part)
    return Coverage(parts), end


def check(name: str, engine: str) -> None:
    whole = trace(name, engine)
    if "t_eval" in run(name).how:
        whole = run(name)(engine=engine, t_eval=None)
    found, end = counted(run(name), engine)
    assert found == coverage(whole)
    assert end.t[-1] == whole.t[-1]
    assert end.rows.y[-1].tobytes() == whole.rows.y[-1].tobytes()
    same_logs(end, whole)


@each(CORPUS, SOME)
def test_a_run_counts_its_rows(name: str) -> None:
    check(name, FASTEST)


@each(FEW, QUICK)
@pytest.mark.parametrize("engine", ["ifelse", "machines"])
def test_so_it_does_in_python(name: str, engine: str) -> None:
    check(name, engine)


@pytest.mark.every(2)
@each(FAILING)
def test_a_run_that_stops_has_counted_its_rows(name: str) -> None:
    whole, _ = outcome(name, in_turn(name))
    assert whole is not None
    found, _ = counted(run(name), in_turn(name))
    assert found == coverage(whole)
