"""Rows counted in machine code as they come are those of a run that keeps them.

The counts of guards, states and edges, and how close false comparisons came, are to the last bit
those made from the rows afterwards, of a run that stops with an error, too; the run is the same.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from gms_fsm import Coverage, Trace, coverage
from gms_fsm.errors import GMSError
from gms_fsm.lowering.printing.counting import counting_of
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun, CountTables
from gms_fsm.run.settings import Settings
from gms_fsm.traces.coverage.counting import FiredEdges, LogCounts, of_tables
from tests.corpus import CORPUS, FAILING, KINDS, Run, each, outcome, run, trace
from tests.helpers import same_logs

pytest.importorskip("llvmlite", reason="needs the extra fast")


def counted(one: Run) -> tuple[Coverage, Trace]:
    """Return what a run counts, and the trace of its end."""
    how, options = dict(one.how), {each.name for each in fields(Settings)}
    chosen = {key: how.pop(key) for key in options & {*how}} | {"t_eval": None, "output": "end"}
    settings = Settings(**{**chosen, "engine": "compiled"})
    start = Problem.of(*(*one.subject, None)[:2], one.t_end, settings, **how)
    counting = counting_of(start.program.plan)
    assert counting is not None
    tables = CountTables.empty(counting)
    running = CompiledRun(start, tables=tables)
    try:
        while running.advance():
            pass
    except GMSError:
        pass
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


@each(CORPUS, KINDS)
def test_a_run_counts_its_rows(name: str) -> None:
    whole = trace(name, "compiled")
    if "t_eval" in run(name).how:
        whole = run(name)(engine="compiled", t_eval=None)
    found, end = counted(run(name))
    assert found == coverage(whole)
    assert end.t[-1] == whole.t[-1]
    assert end.rows.y[-1].tobytes() == whole.rows.y[-1].tobytes()
    same_logs(end, whole)


@each(FAILING)
def test_a_run_that_stops_has_counted_its_rows(name: str) -> None:
    whole, _ = outcome(name, "compiled")
    assert whole is not None
    found, _ = counted(run(name))
    assert found == coverage(whole)
