"""A run interrupted anywhere and continued from its checkpoint equals the uninterrupted run."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import Trace, simulate
from tests.corpus import CORPUS, ENGINES, KINDS, each, rates, run, trace
from tests.helpers import FASTEST, other_parts

LEFT_OUT = {"a function"}  # it may be another one


class Interrupted(Exception):
    """Represents a lost machine."""


def until_done(name: str, engine: str, path: Path, share: float) -> tuple[Trace, int]:
    """Interrupt the run wherever it has come further by a share; return it and the number."""
    last: list[float] = [run(name).how.get("t_start", 0.0)]
    far = share * (run(name).t_end - last[0])

    def stop(moment: Any) -> None:
        if moment.t > last[-1] + far:
            last.append(moment.t)
            raise Interrupted

    while True:
        try:
            whole = run(name)(engine=engine, checkpoint=path, checkpoint_every=0.0, progress=stop)
            return whole, len(last) - 1
        except Interrupted:
            assert path.exists()


@pytest.fixture(autouse=True)
def _short_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a compiled run return often enough to be interrupted."""
    monkeypatch.setattr("gms_fsm.run.recording.compiled_run.STEPS_AT_ONCE", 30)


@pytest.mark.every(3)
@each(sorted(set(CORPUS) - LEFT_OUT), KINDS)
def test_a_run_goes_on_bit_for_bit(name: str, tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    again, _ = until_done(name, FASTEST, path, 0.4)
    assert other_parts(again, trace(name)) == []
    assert not path.exists()


@pytest.mark.slow
@pytest.mark.parametrize("engine", sorted({*ENGINES} - {FASTEST}))
@each(
    ["open loop", "ramps with jumps", "wear", "sliding", "karnopp", "every kind of contact"],
    ["open loop", "sliding", "karnopp", "every kind of contact"],
)
def test_it_goes_on_in_every_engine(name: str, engine: str, tmp_path: Path) -> None:
    again, times = until_done(name, engine, tmp_path / "run.checkpoint", 0.3)
    assert times > 0
    assert other_parts(again, trace(name, engine)) == []


@pytest.mark.slow
@pytest.mark.parametrize("output", [{"output": "end"}, {"t_eval": [0.0, 7.7, 20.0, 30.0]}])
@pytest.mark.parametrize("engine", ENGINES)
def test_whatever_is_recorded(output: dict[str, Any], engine: str, tmp_path: Path) -> None:
    whole = run("pulled mass")(engine=engine, **output)
    told: list[float] = []

    def stop(moment: Any) -> None:
        told.append(moment.t)
        if len(told) in (5, 12):
            raise Interrupted

    how = {"checkpoint": tmp_path / "run.checkpoint", "checkpoint_every": 0.0, "progress": stop}
    for _ in range(2):
        with pytest.raises(Interrupted):
            run("pulled mass")(engine=engine, **output, **how)
    assert other_parts(run("pulled mass")(engine=engine, **output, **how), whole) == []


@pytest.mark.slow
@pytest.mark.parametrize("after", [7, 50, 203])
def test_no_row_is_lost_between_ticks(after: int, tmp_path: Path) -> None:
    """A checkpoint after a tick once left out the tick's row, which was then 0 at time 0."""
    told, path, how = itertools.count(1), tmp_path / "run.checkpoint", {"t_start": 0.1}

    def stop(_: object) -> None:
        if next(told) == after:
            raise Interrupted

    with pytest.raises(Interrupted):
        simulate(rates(), 0.12, checkpoint=path, checkpoint_every=0.0, progress=stop, **how)
    again = simulate(rates(), 0.12, checkpoint=path, **how)
    assert other_parts(again, simulate(rates(), 0.12, **how)) == []
