"""A run that is prepared and repeated with other numbers has the bits of `simulate` with these.

Whatever was run before in the same memory, whatever is recorded; errors too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    ChartModel,
    Contact,
    GMSParameters,
    ParameterError,
    Prepared,
    Prescribed,
    PulledSlider,
    System,
    Trace,
    prepare,
    simulate,
)
from gms_fsm.charts import CHARTS
from gms_fsm.errors import GMSError
from gms_fsm.identification.play_bank import SPRING_WITH_PLAY
from gms_fsm.run.repeated import again
from gms_fsm.run.repeated.block import RepeatedRun
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.numbers import known_in, value_in, varied
from tests.corpus import CORPUS, FAILING, FEW, QUICK, each, run
from tests.helpers import FASTEST, other_parts
from tests.laws.test_a_sweep_is_many_runs import LEFT_OUT

FACTORS = (1.01, 1.0, 0.99)


def alone(name: str, numbers: dict[str, Any], **more: Any) -> tuple[Trace | None, str]:
    """Simulate a run with other numbers; return what was computed, and how it failed."""
    one = run(name)
    try:
        what = varied(mounted(*one.subject), numbers)
        subject: Any = (what.system,) if what.named else (what.model, what.rig)
        return simulate(*subject, one.t_end, **{**one.how, **more}), ""
    except GMSError as error:
        return getattr(error, "trace", None), f"{type(error).__name__}: {error}"


def repeated(ready: Prepared, numbers: dict[str, Any]) -> tuple[Trace | None, str]:
    """Do the same with a run that is prepared."""
    try:
        return ready(numbers), ""
    except GMSError as error:
        return getattr(error, "trace", None), f"{type(error).__name__}: {error}"


@pytest.fixture
def in_one_block(monkeypatch: pytest.MonkeyPatch) -> Callable[[bool], None]:
    """Return a function that lets runs of `simulate` share a block, or not."""
    shared: dict[Any, Any] = {}

    def choose(chosen: bool) -> None:
        monkeypatch.setattr(again, "_known", shared if chosen else {})
        monkeypatch.setattr(again, "WORTH_IT", 1 if chosen else math.inf)

    return choose


@pytest.mark.every(6)
@each([*CORPUS, *FAILING], {*FEW, *QUICK, *[*FAILING][::4]})
def test_every_number_can_be_changed(name: str, in_one_block: Callable[[bool], None]) -> None:
    one = run(name)
    what = mounted(*one.subject)
    values = {
        each: np.asarray(value_in(what, each)) for each in known_in(what) if each not in LEFT_OUT
    }
    how = {"engine": FASTEST}
    ready = prepare(*one.subject, one.t_end, **{**one.how, **how})
    for by in FACTORS:
        numbers = {each: by * u for each, u in values.items()}
        in_one_block(False)
        theirs, why = alone(name, numbers, **how)
        in_one_block(True)
        for ours, too in (repeated(ready, numbers), alone(name, numbers, **how)):
            assert too == why
            assert other_parts(theirs, ours) == []
        if not why and theirs is not None and "t_eval" not in one.how:
            end, last = ready.end(numbers), theirs.rows
            assert (end.t, end.y) == (last.t[-1], tuple(last.y[-1].tolist()))
            assert end.transitions == len(theirs.firings)
            assert len(ready.names) == len(end.y)


PULLED = GMS(GMSParameters.paper("stick-slip"), law="signed"), PulledSlider(1.0, 2.0, 0.1)


def test_numbers_of_single_elements_and_keywords_are_taken() -> None:
    ready = prepare(*PULLED, 20.0, engine=FASTEST)
    k = PULLED[0].parameters.k * [1.0, 2.0, 1.0, 1.0]
    found = ready({"k2": k[1]}, F_s=1.3)
    ready()  # a run in the same memory leaves the trace as it is
    what = varied(mounted(*PULLED), {"k": k, "F_s": 1.3})
    assert other_parts(found, simulate(what.model, what.rig, 20.0, engine=FASTEST)) == []


@pytest.mark.parametrize(
    ("numbers", "said"),
    [({"F_s": 0.1}, "F_s is 0.1"), ({"f_s": 1.5}, "'f_s'"), ({"k": 0.0}, "> 0")],
)
def test_numbers_that_break_their_rules_are_refused(numbers: dict[str, float], said: str) -> None:
    ready = prepare(*PULLED, 1.0, engine=FASTEST)
    for call in (ready, ready.end):
        with pytest.raises(ParameterError, match=said):
            call(numbers)
    assert ready.end() == ready.end()


def test_numbers_that_are_another_program_are_run_from_new() -> None:
    ready = prepare(*PULLED, 5.0, engine=FASTEST)
    what = varied(mounted(*PULLED), {"delta": 1.0})
    theirs = simulate(what.model, what.rig, 5.0, engine=FASTEST)
    assert other_parts(ready(delta=1.0), theirs) == []


def test_traces_are_their_own_whatever_is_run_after_them() -> None:
    times = np.linspace(0.0, 20.0, 101)
    ready = prepare(*PULLED, 20.0, engine=FASTEST, t_eval=times)
    k = 1.5 * PULLED[0].parameters.k
    found = [ready(mass=mass, k=k) for mass in (0.5, 3.0)]
    k[:] = 1.0
    for trace, mass in zip(found, (0.5, 3.0), strict=True):
        what = varied(mounted(*PULLED), {"mass": mass, "k": 1.5 * PULLED[0].parameters.k})
        theirs = simulate(what.model, what.rig, 20.0, engine=FASTEST, t_eval=times)
        assert other_parts(trace, theirs) == []


def test_an_exponent_of_two_is_another_program_from_either_side() -> None:
    what = varied(mounted(*PULLED), {"delta": 1.5})
    ready = prepare(what.model, what.rig, 20.0, engine=FASTEST)
    assert other_parts(ready(delta=2.0), simulate(*PULLED, 20.0, engine=FASTEST)) == []


@pytest.mark.matrix
def test_calls_between_further_functions_arrive() -> None:
    """Both objects of this one have a table of offsets; LLVM would mix the two up."""
    z_c = 0.1 * np.arange(1, 8)
    terms = dict.fromkeys(("k_f", "k_b", "d_f", "d_b"), 1.0)
    model = ChartModel(SPRING_WITH_PLAY, {**terms, "g": 0.05, "z_c": z_c, "v_s": 1.0}, n=7)
    times = np.linspace(0.0, 4.0, 41)
    here = model, Prescribed((times, np.cos(3.0 * times)))
    theirs = simulate(*here, 4.0, engine=FASTEST)
    assert other_parts(prepare(*here, 4.0, engine=FASTEST)(), theirs) == []


@pytest.mark.parametrize("mass", [10**400, np.array([]), np.array([1.0, 2.0])], ids=str)
def test_what_is_no_number_for_it_is_refused(mass: Any) -> None:
    with pytest.raises(ParameterError, match="mass"):
        prepare(*PULLED, 1.0, engine=FASTEST)(mass=mass)


def test_a_motion_without_a_scale_that_is_pushed_by_an_input_has_the_bits() -> None:
    pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.1})
    mass = Body("mass", inertia="m", force="u")
    sled = System("sled", bodies=(mass,), contacts=(pad,), inputs=("u",), numbers={"m": 1.0})
    pushed = sled.with_inputs({"u": "2*sin(3*t)"})
    heavy = simulate(replace(pushed, numbers={"m": 2.0}), 3.0, engine="ifelse")
    end = prepare(pushed, 3.0, engine=FASTEST).end({"numbers.m": 2.0})
    assert end.y[0] == heavy.body("mass").x[-1]


@pytest.mark.parametrize("engine", ["compiled", "ifelse"])
def test_its_derivatives_are_those_of_simulate(engine: str) -> None:
    pytest.importorskip("llvmlite")
    names = ("F_s", "initial.v")
    numbers = {"mass": 1.1, "F_s": 1.4}
    wanted, _ = alone("pulled mass", numbers, engine=FASTEST, sensitivities=names)
    ready = prepare(
        *run("pulled mass").subject, run("pulled mass").t_end, engine=engine, sensitivities=names
    )
    assert wanted is not None
    for name in names:
        found = ready(numbers).sensitivity("z", name)
        np.testing.assert_array_equal(found, wanted.sensitivity("z", name))


def test_ctrl_c_in_a_shared_block_leaves_the_part_before(
    monkeypatch: pytest.MonkeyPatch, in_one_block: Callable[[bool], None]
) -> None:
    pytest.importorskip("llvmlite", reason="a block is one of machine code")

    def stopped(run: RepeatedRun) -> None:
        raise KeyboardInterrupt

    in_one_block(True)
    one = run("pulled mass")
    whole = simulate(*one.subject, 2000.0, engine=FASTEST)
    monkeypatch.setattr(RepeatedRun, "_make_room", stopped)
    with pytest.raises(KeyboardInterrupt) as error:
        simulate(*one.subject, 2000.0, engine=FASTEST)
    part: Any = error.value.trace  # type: ignore[attr-defined]
    assert 0 < len(part) < len(whole)
    assert np.array_equal(part.rows.y, whole.rows.y[: len(part)])
