"""Runs of `simulate` that differ in numbers only: later ones begin anew in one block.

What does not depend on the numbers is done once. The key has all that the text of a program depends
on, and the settings; the bits are those of a run of its own.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Any

from gms_fsm.foundation.arguments import copied
from gms_fsm.foundation.equality import ByBits
from gms_fsm.lowering.program import Arguments, arguments, structure
from gms_fsm.run.problem import Problem, checked_times
from gms_fsm.run.repeated.block import RepeatedRun
from gms_fsm.run.repeated.numbers import RepeatedRuns
from gms_fsm.run.settings import Settings
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.signals import Corners
from gms_fsm.traces.trace import Trace

MOST = 16  # keys that are remembered
WORTH_IT = 256  # runs of one key, then functions are compiled: 0.5 s, to save 0.5 ms a run
LARGE = 2**24  # bytes of rows that are not kept for another run

_known = dict[Hashable, "RunsOfOneText"]()
_count = itertools.count()
_lock = threading.Lock()


@dataclass(eq=False)
class RunsOfOneText:
    """What is remembered of runs that differ in numbers only."""

    asked: int = 0  # when it was asked last, counted over all
    alone: int = 0  # how many were runs of their own
    runs: RepeatedRuns | None = None

    def trace(self, what: Mounted) -> Trace | None:
        """Return the run with the numbers of a system; None if it must be a run of its own."""
        if self.runs is None or not self.runs.repeatable:
            return None
        start, run = self.runs.start, self.runs.waiting()
        p = arguments(what.system)
        run.put_all(p)
        run.follow()
        solved = _with_numbers(start, what, p, run)
        try:
            done = run.run(lambda: start.with_numbers(what))
        except KeyboardInterrupt as error:
            error.trace = solved.trace(*run.columns.contents())  # type: ignore[attr-defined]
            raise
        found = solved.trace(*run.taken()()) if done else None
        if run.size < LARGE:
            self.runs.take_back(run)
        return found

    def keep(self, start: Problem) -> None:
        """Remember a run of its own that has ended."""
        self.alone += 1
        if self.runs is None and self.alone >= WORTH_IT:
            self.runs = RepeatedRuns(start)


def runs_like(
    what: Mounted, t_start: float, t_end: float, chosen: Settings, special: Iterable[object]
) -> RunsOfOneText | None:
    """Return what is remembered of such runs; None if one asks for anything special."""
    alone = chosen.engine != "compiled" or isinstance(chosen.atol, dict)
    if alone or any(each is not None for each in special):
        return None
    key = _key(what, *checked_times(t_start, t_end), chosen)
    with _lock:
        if (found := _known.get(key)) is None:
            if len(_known) >= MOST:
                del _known[min(_known, key=lambda each: _known[each].asked)]
            _known[key] = found = RunsOfOneText()
        found.asked = next(_count)
    return found


def _with_numbers(start: Problem, what: Mounted, p: Arguments, run: RepeatedRun) -> Problem:
    """Return what a trace needs of the problem that a run solves."""
    used: Any = run.columns.buffers.plan.control.atol
    atol = start.program.layout.labelled(used.tolist())
    settings = start.settings if start.chosen.atol else {**start.settings, "atol": atol}
    program = copied(start.program, p=p)
    solved: Problem = copied(start, what=what, program=program, settings=settings)
    return solved


def _key(what: Mounted, t_start: float, t_end: float, chosen: Settings) -> Hashable:
    """Return all but the numbers; what is not hashable is alive as long as its `id` is used."""
    records = (id(u) for u in what.system.signals.values() if isinstance(u, Corners))
    others = {**vars(chosen), "t_eval": None if chosen.t_eval is None else ByBits(chosen.t_eval)}
    return structure(what.system), what.named, *records, t_start, t_end, *others.values()
