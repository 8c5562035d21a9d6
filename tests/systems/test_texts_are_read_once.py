"""A system whose texts were read before is not read again, and its numbers still count."""

from __future__ import annotations

import pickle
from typing import Any

import pytest

from gms_fsm import GMS, Body, Contact, GMSParameters, Sampled, System, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.systems import system as module
from gms_fsm.traces.system_scope import given_values


def pulled(m: float = 1.0, K: float = 2.0, *, start: float = 0.0, signal: Any = "0.1*t") -> System:
    return System(
        "pulled",
        bodies=(Body("mass", inertia="m", force="K * (end - x) + u"),),
        contacts=(
            Contact("pad", GMS(GMSParameters.paper("stick-slip"), law="signed")),
            Contact("stop", CHARTS["stiction"], {"F_c": 0.1, "F_s": 0.2, "b": 0.1}),
        ),
        signals={"end": signal},
        numbers={"m": m, "K": K},
        sampled=(Sampled("hand", period=0.5, updates={"u": "u / 2"}, initial={"u": start}),),
    )


def run(system: System) -> str:
    trace = simulate(system, 8.0, engine="ifelse")
    return repr([trace.t.tolist(), trace.rows.y.tolist(), trace.transitions.tolist()])


@pytest.mark.parametrize(
    "change",
    [{"m": 3.0}, {"K": 5.0}, {"start": 1.0}, {"signal": ([0.0, 4.0, 9.0], [0.0, 0.4, 0.1])}],
    ids=str,
)
def test_other_numbers_give_what_a_new_reading_gives(
    change: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = pulled(**({"signal": ([0.0, 9.0], [0.0, 1.0])} if "signal" in change else {}))
    second = pulled(**change)
    assert second.shape is first.shape
    found = run(second)
    assert found != run(first)
    monkeypatch.setattr(module, "_read_before", {})
    again = pulled(**change)
    assert again.shape is again
    assert run(again) == found


def test_a_pickled_system_runs_alike() -> None:
    system = pulled(m=2.0)
    again = pickle.loads(pickle.dumps(system))
    assert run(again) == run(system)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (([0.0, 9.0], [0.0, 1.0]), ([0.0, 9.0], [0.0, 2.0])),
        (lambda t: t / 9.0, lambda t: 2.0 * t / 9.0),
    ],
    ids=["record", "function"],
)
def test_expressions_see_the_signals_of_their_own_system(one: Any, other: Any) -> None:
    first, second = pulled(signal=one), pulled(signal=other)
    assert second.shape is first.shape
    assert given_values(first, 9.0 - 1e-12)["end"] == pytest.approx(1.0)
    assert given_values(second, 9.0 - 1e-12)["end"] == pytest.approx(2.0)
