"""A sweep is many runs: each row is, to the last bit, what `simulate` gives with its numbers.

Whatever the engine, whatever is recorded; from a file it comes back as it was saved.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Contact, Prescribed, Slider, Sweep, System, Trace, simulate, sweep
from gms_fsm.charts import CHARTS
from gms_fsm.run.repeated.beginnings import as_numbers
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.numbers import known_in, value_in, varied
from tests.corpus import FAILING, FEW, QUICK, each, in_turn, outcome, run
from tests.exporters.frictions import servo
from tests.helpers import FASTEST, stick_slip

FACTORS = (1.0, 1.01, 0.99)  # of every number at once
LEFT_OUT = {"numbers.V"}  # the velocity that a run begins with


def swept(name: str) -> tuple[Sweep, list[Trace]]:
    """Sweep over all numbers of a run, each by its name; return it, and the runs one by one."""
    what, one = mounted(*run(name).subject), run(name)
    times = np.linspace(one.how.get("t_start", 0.0), one.t_end, 5)
    how = {**one.how, "t_eval": times, "engine": in_turn(name)}
    values = {
        each: np.asarray(value_in(what, each)) for each in known_in(what) if each not in LEFT_OUT
    }
    numbers = {each: np.stack([by * u for by in FACTORS]) for each, u in values.items()}
    alone = []
    for k in range(len(FACTORS)):
        other = varied(what, {each: u[k] for each, u in numbers.items()})
        subject: Any = (other.system,) if other.named else (other.model, other.rig)
        alone.append(simulate(*subject, one.t_end, **how))
    return sweep(*one.subject, one.t_end, numbers, **how), alone


def same(found: Sweep, other: Sweep) -> None:
    """Assert that two sweeps are equal in all that they have."""
    mine, its = found.columns(), other.columns()
    assert [*mine] == [*its]
    pairs = [(mine[name], its[name]) for name in mine]
    pairs += [(found.rows[name], other.rows[name]) for name in found.rows]
    fields = found.transitions.dtype.names or ()
    pairs += [(found.transitions[name], other.transitions[name]) for name in fields]
    assert found.times.tolist() == other.times.tolist()
    for a, b in pairs:
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    assert [*found.rows] == [*other.rows]
    assert (found.edges, found.contacts) == (other.edges, other.contacts)


@pytest.mark.every(3)
@each(FEW, {*QUICK, "system servo"})
def test_each_row_is_a_run(name: str, tmp_path: Path) -> None:
    found, alone = swept(name)
    assert found.outcome.tolist() == ["ok"] * len(FACTORS)
    for k, one in enumerate(alone):
        for contact in found.contacts or ("",):
            ours, theirs = (each.contact(contact) if contact else each for each in (found, one))
            for column in ("x", "v", "F", "z", "states"):
                mine, its = getattr(ours, column)[k], getattr(theirs, column)
                np.testing.assert_array_equal(mine, its[-1], err_msg=column)
                if column in ours.rows:
                    np.testing.assert_array_equal(ours.rows[column][k], its, err_msg=column)
            log = theirs.transitions
            fired = zip(log.element.tolist(), log.edge.tolist(), strict=True)
            assert ours.sequence(k) == list(fired)
        for part, ends in found.ends.items():
            body, _, axis = part.partition(".")
            its = getattr(one.body(body), axis) if axis else one.value(part)
            np.testing.assert_array_equal(ends[k], its[-1], err_msg=part)
        assert found.transition_count[k] == len(one.transitions)
        log = found.transitions[found.transitions["run"] == k]
        for column in ("t", "z", "v", "s", "F_before", "F_after"):
            np.testing.assert_array_equal(log[column], one.transitions[column], err_msg=column)
    same(Sweep.load(found.save(tmp_path / "runs.npz")), found)


@pytest.mark.every(6)
@each(FAILING)
def test_a_failure_is_the_outcome_of_its_run(name: str) -> None:
    what, one = mounted(*run(name).subject), run(name)
    number = next(iter(known_in(what)))
    values = np.stack([np.asarray(value_in(what, number))] * 2)
    how = {**one.how, "engine": in_turn(name)}
    found = sweep(*one.subject, one.t_end, {number: values}, **how)
    part, said = outcome(name)
    assert part is not None
    for k in range(2):
        assert said.startswith(f"{found.outcome[k]}: {found.message[k]}")
        assert found.t[k] == (part.t[-1] if len(part) else one.how.get("t_start", 0.0))
        assert found.transition_count[k] == len(part.transitions)


@pytest.mark.parametrize("engine", sorted({"ifelse", FASTEST}))
def test_initial_values_and_periods_vary_by_name(engine: str, tmp_path: Path) -> None:
    system, z, x = servo(), np.arange(12.0).reshape(3, 4) * 1e-7, [0.0, 1e-4, -2e-4]
    periods, F_c, z2 = [1e-3, 2e-3, 7e-4], [1.0, 1.1, 1.2], [3e-7, 4e-7, 5e-7]
    given = {"initial.load.x": x, "initial.I": [0.1, 0.0, 0.2], "bearing.F_c": F_c}
    wide = {**given, "pid.period": periods, "initial.bearing.z": z}
    single = {**given, "initial.z2": z2}
    begin = {"bearing.z": [1e-7] * 4, "x_l": 9.0}
    for found in (
        sweep(system, 0.02, wide, engine=engine, initial=begin),
        sweep(system, 0.02, single, engine=engine, initial=begin),
    ):
        for k in range(3):
            deflections = z[k] if "pid.period" in found.parameters else [1e-7, z2[k], 1e-7, 1e-7]
            period = periods[k] if "pid.period" in found.parameters else 1e-3
            its = varied(mounted(system), {"bearing.F_c": F_c[k]}).system
            its = replace(its, sampled=(replace(its.sampled[0], period=period),))
            initial = {"load.x": x[k], "I": given["initial.I"][k], "bearing.z": deflections}
            one = simulate(its, 0.02, initial=initial, engine=engine)
            assert found.ends["load.x"][k] == one.body("load").x[-1] != 0.0
            assert found.ends["u"][k] == one.value("u")[-1]
            assert found.transition_count[k] == len(one.transitions)
        same(Sweep.load(found.save(tmp_path / "runs.npz")), found)


PUSHED = System(
    "pushed",
    bodies=(Body("mass", inertia=1.0, force="u + w"),),
    contacts=(Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.1}),),
    numbers={"seed": 1.0},
    signals={"w": "2 * noise(floor(5 * t), seed)"},
    inputs=("u",),
)


RAMPS: list[Any] = [[(0, 0), (1, 3)], ([0.0, 0.5, 2.0], [1.0, 3.0, 0.0]), [(0, 2), (1, 2)]]
SINES = [f"{a}*sin({b}*t)**2 - seed*t/{b}" for a, b in ((3.3, 4.1), (2.9, 3.7), (4.7, 5.3))]
PULSES = [f"3 - 4*exp(-((t - {t})/0.01)**2)" for t in (0.7, 0.9, 1.1)]


@pytest.mark.parametrize("engine", sorted({"ifelse", FASTEST}))
@pytest.mark.parametrize("given", [RAMPS, SINES], ids=["records", "one text"])
def test_signals_and_seeds_vary_by_name(given: list[Any], engine: str, tmp_path: Path) -> None:
    seeds = [1.0, 2.0, 2.0]
    found = sweep(PUSHED, 2.0, {"signals.u": given, "numbers.seed": seeds}, engine=engine)
    for k in range(3):
        its = replace(PUSHED, numbers={"seed": seeds[k]})
        one = simulate(its, 2.0, inputs={"u": given[k]}, engine=engine)
        assert found.ends["mass.x"][k] == one.body("mass").x[-1] != 0.0
        assert found.transition_count[k] == len(one.transitions)
    same(Sweep.load(found.save(tmp_path / "runs.npz")), found)


def test_texts_that_differ_in_numbers_are_one_program() -> None:
    def found(texts: list[str]) -> dict[str, Any]:
        signals = {"signals.u": np.array(texts, dtype=object)}
        return as_numbers(mounted(PUSHED), signals, (0.0, 2.0))[1]

    names = [f"numbers.u__at{end}" for end in ("", "_2", "_3")]
    assert list(found(SINES)["signals.u"]) == names
    assert found([*SINES, "t"]) == found(PULSES) == found(["abs(2*t)", "abs(3*t)"]) == {}


@pytest.mark.parametrize("name", ["v", "F_a"])
def test_a_rig_is_given_signals(name: str) -> None:
    model, given = stick_slip("signed"), ["0.2", "0.3*sin(t)", [(0, 0), (1, 1)]]
    rigs = [Prescribed(each) if name == "v" else Slider(2.0, each) for each in given]
    found = sweep(model, rigs[0], 2.0, {name: given}, engine="ifelse")
    alone = [simulate(model, each, 2.0, engine="ifelse") for each in rigs]
    assert [*found.x] == [each.x[-1] for each in alone]
    assert found.parameters[name].tolist() == [*given[:2], "signal 2"]
