"""Random systems give equal bits in all engines; `tests.random_systems` draws many more."""

from __future__ import annotations

import importlib.util
from dataclasses import replace

import pytest

from gms_fsm import Trace
from tests import random_systems
from tests.random_systems import Trial, differences, trial

SEED, SHAPES = 7, 8


@pytest.mark.slow
@pytest.mark.parametrize("index", range(2 * SHAPES))
def test_engines_agree(index: int) -> None:
    one = trial(SEED, index, SHAPES)
    compiled = ("compiled",) if importlib.util.find_spec("llvmlite") else ()
    differ, trace = differences(one, ("ifelse", "machines", *compiled))
    assert not differ, f"{differ}; repeat with: {one.again}"
    assert trace is not None
    assert len(trace.t) > 10


@pytest.mark.slow
def test_these_systems_switch() -> None:
    runs = [random_systems.run(trial(SEED, index, SHAPES), "ifelse")[0] for index in range(SHAPES)]
    assert sum(bool(trace is not None and len(trace.transitions)) for trace in runs) > SHAPES // 2


def test_the_same_arguments_give_the_same_system() -> None:
    one, same, other = (trial(SEED, index, SHAPES) for index in (3, 3, 3 + SHAPES))
    assert one.system.numbers == same.system.numbers
    assert one.kinds == other.kinds  # the same shape
    assert one.system.numbers != other.system.numbers


def test_other_bits_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    one, run = trial(SEED, 0, SHAPES), random_systems.run

    def changed(trial: Trial, engine: str) -> tuple[Trace | None, str]:
        rtol = 1e-5 if engine == "ifelse" else 1.0000000001e-5
        return run(replace(trial, how={**trial.how, "rtol": rtol}), "ifelse")

    monkeypatch.setattr(random_systems, "run", changed)
    differ, _ = differences(one, ("ifelse", "machines"))
    assert differ
    assert "columns v0" in differ[0]


def test_another_end_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = iter(["end", "SimulationError: at t = 1 s"])
    monkeypatch.setattr(random_systems, "run", lambda trial, engine: (None, next(ends)))
    differ, _ = differences(trial(SEED, 0, SHAPES), ("ifelse", "machines"))
    assert differ == ["machines: 'SimulationError: at t = 1 s' and not 'end'"]
