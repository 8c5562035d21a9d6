"""The struct of an exported engine is its whole state, and bad arguments change nothing of it."""

from __future__ import annotations

import ctypes
import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    FrictionState,
    GMSParameters,
    Parameter,
    State,
    Stribeck,
    export,
)
from gms_fsm.exporters import Subject
from gms_fsm.exporters._c import engine_of
from tests.exporters.c_programs import COMPILERS, Library

pytestmark = pytest.mark.skipif(not COMPILERS, reason="there is no C compiler")


def model(k: float = 0.7, **curve: float) -> GMS:
    given: dict[str, float] = {"F_c": 0.4, "F_s": 1.5, "v_s": 1e-3, "delta": 2.0} | curve
    more: dict[str, Any] = {"sigma_2": 0.1, "stribeck": Stribeck(**given), "v_c": 1e-6}
    return GMS(GMSParameters([k, 0.9], [0.3, 0.4], [0.1, 0.05], **more), law="signed")


def library(folder: Path, given: GMS | ChartModel) -> Library:
    export(given, "c99", folder, name="it")
    return Library(folder, engine_of(Subject.of(given, "c99", name="it")))


@pytest.fixture(scope="module")
def c(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """Return the engine of a friction."""
    return library(tmp_path_factory.mktemp("engine"), model())


VELOCITIES = np.cumsum(np.random.default_rng(3).normal(size=60)) * 0.3


def forces(c: Library, state: object) -> list[float]:
    found = []
    for v0, v1 in itertools.pairwise(VELOCITIES):
        assert c.advance(state, v0, v1, 0.1) == 0
        found.append(state.F)  # type: ignore[attr-defined]
    return found


def test_the_engine_in_a_struct(c: Library) -> None:
    first, copied = c.begun(), c.State()
    begun = forces(c, first)
    ctypes.memmove(ctypes.byref(copied), ctypes.byref(first), ctypes.sizeof(first))
    assert forces(c, first) == forces(c, copied)  # a copy goes on in the same way
    assert forces(c, c.begun()) == begun  # and another one knows nothing of it
    friction = FrictionState(model())
    assert begun == [friction.advance(v0, v1, 0.1) for v0, v1 in itertools.pairwise(VELOCITIES)]
    assert first.switches > 4


@pytest.mark.parametrize(
    "numbers",
    [(math.nan, 0.0, 0.1), (0.0, math.inf, 0.1), (0.0, 0.0, -0.1), (0.0, 0.0, math.nan),
     (0.0, 0.0, 1e-300), (0.0, 0.0, 1e10)],
)  # fmt: skip
def test_bad_arguments(numbers: tuple[float, ...], c: Library) -> None:
    state = c.begun()
    assert c.advance(state, 0.1, 0.1, 5.0) == 0
    before = bytes(state)
    code = c.advance(state, *numbers)
    assert code == -1
    assert b"not finite" in c.message(code)
    assert bytes(state) == before


def test_numbers_are_set_and_all_that_follows_from_them(c: Library) -> None:
    """Tolerances and scales, too: the bits are those of a friction that began with the numbers."""
    given = {"F_s": 0.9, "v_s": 5e-3}
    state = c.begun()
    k = c.place("k")
    assert [c.get(state, k), c.get(state, k + 1)] == [0.7, 0.9]
    for name, value in given.items():
        assert c.set(state, c.place(name), value) == 0
    assert c.set(state, k, 70.0) == 0
    friction = FrictionState(model(**given, k=70.0))
    pairs = list(itertools.pairwise(VELOCITIES))
    assert forces(c, state) == [friction.advance(v0, v1, 0.1) for v0, v1 in pairs]
    for place, value in ((-1, 1.0), (4, 1.0), (10**6, 1.0), (k, math.nan)):
        assert c.set(state, place, value) == -1


def test_the_entry_of_the_default_state_follows_a_number(tmp_path: Path) -> None:
    chart = Chart(
        "winding down",
        parameters=(Parameter("z_0", "m"), Parameter("tau", "s", "> 0")),
        inputs=("v",),
        variables=("z",),
        states=(
            State("only", entry={"z": "2.0 * z_0 + sgn(tau - 2.0)"}, flow={"z": "v - z / tau"}),
        ),
        outputs={"F": "z"},
    )
    c = library(tmp_path, ChartModel(chart, {"z_0": 0.5, "tau": 2.0}))
    state: Any = c.begun()
    assert state.z[0] == 1.0
    assert c.set(state, c.place("z_0"), -3.0) == 0
    assert state.z[0] == -6.0
    assert c.set(state, c.place("tau"), 0.01) == 0
    friction = FrictionState(ChartModel(chart, {"z_0": -3.0, "tau": 0.01}))
    pairs = list(itertools.pairwise(VELOCITIES))
    assert forces(c, state) == [friction.advance(v0, v1, 0.1) for v0, v1 in pairs]
