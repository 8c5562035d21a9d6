"""``output=`` and what looks on decide what is recorded, and nothing about the run itself."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from gms_fsm import Trace
from gms_fsm.language import EVENT
from tests.corpus import CORPUS, FEW, KINDS, each, in_turn, run, trace
from tests.helpers import other_parts, same_logs


def last_row(one: Trace) -> dict[str, object]:
    """Return all that a trace shows at its end, as text: -0.0 is not 0.0, NaN is NaN."""
    shown = {name: repr(column[-1]) for name, column in one.columns().items()}
    return {**shown, "microstep": ""}


def whole_of(name: str) -> Trace:
    """Return all rows of a run in its engine."""
    if "t_eval" in run(name).how:
        return run(name)(engine=in_turn(name), t_eval=None)
    return trace(name, in_turn(name))


@pytest.mark.every(3)
@each(CORPUS, KINDS)
def test_the_end_is_the_last_of_all_rows(name: str) -> None:
    whole, end = whole_of(name), run(name)(engine=in_turn(name), t_eval=None, output="end")
    assert len(end) == len(end.stops) == 1
    assert end.t.tolist() == [run(name).t_end]
    assert end.microstep.tolist() == [0]
    assert last_row(end) == last_row(whole)
    assert end.transitions.dtype == whole.transitions.dtype
    same_logs(end, whole)


@pytest.mark.every(3)
@each(CORPUS, KINDS)
def test_requested_rows_are_those_of_the_run(name: str) -> None:
    """A row on a switch is the one after it; both sides of every stop are kept beside them."""
    whole, t_end = whole_of(name), run(name).t_end
    start = whole.t[0]
    located = run(name).how.get("events") != "step"  # the others take an edge after the step's end
    events = np.unique(whole.transitions.t[:4]) if located else []
    times = np.unique([start, 0.9 * start + 0.1 * t_end, *events, 0.2 * start + 0.8 * t_end, t_end])
    some = run(name)(engine=in_turn(name), t_eval=times)
    assert some.t.tolist() == times.tolist()
    assert not some.microstep.any()
    same_logs(some, whole)
    assert last_row(some) == last_row(whole)
    rows = np.searchsorted(whole.t, events, side="right") - 1
    shared = whole.program.layout.y.shared
    lasting = [not name.startswith(EVENT) for name in shared]  # an event is over with its instant
    lasting += [True] * (whole.rows.y.shape[1] - len(shared))
    for column in ("y", "mode"):
        mine = getattr(some.rows, column)[np.searchsorted(times, events)]
        right = getattr(whole.rows, column)[rows]
        chosen = lasting if column == "y" else slice(None)
        assert mine[:, chosen].tolist() == right[:, chosen].tolist(), column
    assert (np.diff(some.stops.t) >= 0).all()
    for t in whole.transitions.t if located else []:
        assert (some.stops.t == t).sum() >= 2 - (t in (start, t_end)), "before and after"


@each(CORPUS, KINDS)
def test_samples_at_rows_are_the_rows(name: str) -> None:
    one = trace(name)
    last = np.append(np.flatnonzero(np.diff(one.t) > 0), len(one) - 1)[-200:]
    sampled = one.sample(one.t[last])
    assert sampled.rows.y.tolist() == one.rows.y[last].tolist()
    assert sampled.rows.mode.tolist() == one.rows.mode[last].tolist()


@each(FEW)
def test_looking_on_changes_nothing(name: str) -> None:
    """Progress and monitors see moments of the run in order of time; the run is the same."""
    engine = in_turn(name)
    seen: list[float] = []
    watched = run(name)(engine=engine, progress=lambda moment: seen.append(moment.t),
                        monitors="t >= 0")  # fmt: skip
    assert other_parts(watched, trace(name, engine)) == []
    assert seen == sorted(seen)
    assert [each.ok for each in watched.monitors.values()] == [True]


@each(FEW)
def test_a_trace_can_be_pickled(name: str) -> None:
    assert other_parts(pickle.loads(pickle.dumps(trace(name))), trace(name)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["open loop", "system servo"])
def test_requested_rows_may_be_one_or_many(name: str) -> None:
    for rows in ([0.0], [run(name).t_end], np.linspace(0, run(name).t_end, 2501)):
        found = run(name)(engine=in_turn(name), t_eval=rows)
        assert found.t.tolist() == list(rows)
        same_logs(found, trace(name))
