"""Loads and temperatures of records are inputs of the chart, each record its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, Record, State, choose, fit, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.errors import RecordError
from gms_fsm.identification.joints import JOINTS, joint_candidates, joint_chart
from tests.helpers import FASTEST

pytestmark = pytest.mark.slow
LOADED = joint_chart("loaded", "F_0 + mu * abs(N)", ["N"])
TRUTH: dict[str, Any] = {"sigma_0": 4e4, "b": 5.0, "F_0": 0.5, "mu": 0.12}
START = ChartModel(LOADED, {**TRUTH, "mu": 0.2, "F_0": 0.3}, inputs={"N": "N"})
T = np.arange(300) * 0.02
V = 0.02 * np.sin(2.0 * np.pi * T / 2.0)


def loaded(load: float, **more: Any) -> Record:
    """Return the record of a slide under a load, with noise of 5 mN."""
    N = load * (1.0 + 0.1 * np.sin(T))
    on = Prescribed((T, V), inputs={"N": (T, N)})
    model = ChartModel(LOADED, TRUTH, inputs={"N": 1.0})
    run = simulate(model, on, T[-1], t_eval=T, engine=FASTEST)
    force = run.F + 5e-3 * np.random.default_rng(int(load)).standard_normal(T.size)
    given = {"inputs": {"N": N}} | more
    return Record.from_arrays(time=T, velocity=V, force=force, name=f"load {load:g}", **given)


def test_each_record_has_its_own_load() -> None:
    found = fit([loaded(20.0), loaded(130.0)], START, free=["mu", "F_0"], search="local")
    for name in ("mu", "F_0"):
        assert found[name].low <= TRUTH[name] <= found[name].high
    assert found["mu"].value == pytest.approx(0.12, rel=1e-3)
    assert found.score(loaded(60.0))["rmse"] == pytest.approx(5e-3, rel=0.2)


def test_a_run_takes_the_inputs_of_a_record_too() -> None:
    record = loaded(60.0)
    model = ChartModel(LOADED, TRUTH, inputs={"N": 1.0})
    run = simulate(model, Prescribed(record), T[-1], t_eval=T, engine=FASTEST)
    assert np.std(run.F - record.columns["force"]) == pytest.approx(5e-3, rel=0.2)


def test_a_record_without_the_load_is_refused() -> None:
    bare = loaded(60.0, inputs=None)
    with pytest.raises(RecordError, match="gives no input 'N'"):
        fit([loaded(20.0), bare], START, free=["mu"])


def test_loads_that_differ_are_not_shared_in_silence() -> None:
    model = ChartModel(LOADED, TRUTH, inputs={"N": 20.0})
    records = [loaded(n, inputs=None, normal=np.full(T.size, n)) for n in (20.0, 130.0)]
    with pytest.raises(RecordError, match=r"reads one N for all; give each record's own: inputs="):
        fit(records, model, free=["mu"])


@pytest.mark.matrix
def test_what_no_contact_reads_is_noted() -> None:
    model = ChartModel(joint_chart("plain", "F_0", []), {"sigma_0": 4e4, "b": 5.0, "F_0": 3.0})
    found = fit(loaded(20.0), model, free=["b"], search="local")
    assert "inputs that the model does not read: N" in found.notes


def test_candidates_are_those_whose_inputs_are_given() -> None:
    names = {each.name for each in joint_candidates([loaded(20.0)])}
    assert {"load (M3)", "load, Stribeck (M4)", "LuGre", "Dahl", "Bouc-Wen", "static"} <= names
    assert not {"load and temperature", "directional load (M5)", "gear loss"} & names


@pytest.mark.matrix
def test_choose_says_why_the_others_lost() -> None:
    records = [loaded(n) for n in (20.0, 60.0, 130.0)]
    some = [each for each in JOINTS if each.name in ("load (M3)", "Coulomb, viscous (M1)")]
    found = choose(records, candidates=some)
    assert found.choice is not None
    why = {row.name: row.why for row in found.choice.rows}
    assert why["load (M3)"] == "chosen"
    assert "worse on what was left out, in 3 of 3 folds" in why["Coulomb, viscous (M1)"]
    assert f"Coulomb, viscous (M1): {why['Coulomb, viscous (M1)']}" in str(found)


@pytest.mark.matrix
def test_a_force_without_a_memory_needs_no_state_and_a_score_needs_rows():
    t = np.arange(0.0, 2.0, 0.01)
    v = 0.1 * np.sin(4.0 * t)
    chart = Chart("plain", inputs=("v",), parameters=("c",), states=(State("on"),),
                  outputs={"F": "c * v"})  # fmt: skip
    record = Record.from_arrays(time=t, velocity=v, force=3.0 * v)
    found = fit(record, ChartModel(chart, {"c": 1.0}), free=["c"], search="local", progress=False)
    assert found.predict(record, initial="estimate", lead=0.5) == pytest.approx(3.0 * v, abs=1e-6)
    with pytest.raises(RecordError, match="nothing is left"):
        found.score(record, "estimate", lead=9.0)


@pytest.mark.matrix
def test_an_estimated_state_is_found_where_two_elements_share_the_force():
    model = ChartModel(CHARTS["maxwell-slip"], {"k": [4e4, 2e4], "F_c": [0.5, 1.0]}, n=2)
    t = np.arange(0.0, 4.0, 0.01)

    def record(v: Any, z: list[float]) -> Record:
        run = simulate(model, Prescribed((t, v)), t[-1], t_eval=t, initial={"z": z}, engine=FASTEST)
        force = run.F[-t.size :] + np.random.default_rng(1).normal(0.0, 5e-3, t.size)
        return Record.from_arrays(time=t, velocity=v, force=force)

    training = record(1e-3 * np.sin(2.0 * t), [0.0, 0.0])
    found = fit(training, model, free=["k1", "F_c2"], search="local", progress=False)
    later = record(2e-5 * np.sin(3.0 * t), [1e-5, -3e-5])
    with pytest.warns(UserWarning, match="outside of what was trained on"):
        assert found.score(later, "estimate", lead=0.5)["rmse"] < 0.01
