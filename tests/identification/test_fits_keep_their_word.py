"""What a fit promises in small print: elements in order, scores that compare, bounds that hold."""

from __future__ import annotations

import functools
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import ChartModel, LuGre, ParameterError, Record, RecordError, Stribeck, choose, fit
from gms_fsm.identification.candidates import STIFFER_ONE_WAY
from gms_fsm.identification.problem import task
from tests.identification.records import bank, measured, sine

pytest.importorskip("llvmlite", reason="fits take long without machine code")

TRUTH = bank([2e4, 5e3], [5e-5, 1e-4])
LOCAL: Any = {"search": "local"}


@functools.cache
def _record() -> Record:
    return measured(TRUTH, sine(3e-4, 2.0, 5.0), 0.01, 0)


@pytest.mark.parametrize("bounds", [{}, {"z_c1": (2e-5, 2e-4), "z_c2": (2e-5, 1.1e-4)}])
def test_elements_are_in_the_order_of_their_thresholds_unless_bounds_name_them(
    bounds: dict[str, tuple[float, float]],
) -> None:
    values: Any = {"k": [5e3, 2e4], "b": [0.0, 0.0], "z_c": [1.1e-4, 5e-5]}
    found = fit(
        _record(),
        ChartModel(STIFFER_ONE_WAY, values, n=2),
        free=["k", "z_c"],
        bounds=bounds,
        **LOCAL,
    )
    thresholds = [found["z_c1"].value, found["z_c2"].value]
    assert thresholds == sorted(thresholds, reverse=bool(bounds))
    stiff = "k2" if bounds else "k1"
    assert found[stiff].value == pytest.approx(2e4, rel=0.2)
    assert found.training["rmse"] < 0.1


def test_all_of_an_element_moves_with_it() -> None:
    start = bank([5e3, 2e4], [1e-4, 5e-5], C=[1e-3, 2e-3])
    found = fit(_record(), start, free=["k", "weights"], **LOCAL)
    assert found["weights1"].value < found["weights2"].value
    assert found.model.values["C"].tolist() == [2e-3, 1e-3]  # type: ignore[union-attr]


def test_criterion_and_order_do_not_depend_on_the_unit() -> None:
    record = _record()
    thousand = replace(record, columns={**record.columns, "force": 1e3 * record.columns["force"]})
    one, two = bank([2e4], [8e-5]), bank([2e4, 5e3], [5e-5, 1e-4])
    found = [
        fit(each, model, free=["k"], **LOCAL).compare([fit(each, other, free=["k"], **LOCAL)])
        for each in (record, thousand)
        for model, other in [(one, two)]
    ]
    differences = [rows.rows[0].bic - rows.rows[1].bic for rows in found]
    assert differences[0] == pytest.approx(differences[1], rel=1e-3)
    assert differences[0] < 0.0  # the better one has the lower criterion


def test_held_out_rows_are_never_trained_on() -> None:
    record = _record()
    found = fit(record, TRUTH, free=["k"], test=(6.0, 8.0), **LOCAL)
    held = int(((record.columns["time"] >= 6.0) & (record.columns["time"] < 8.0)).sum())
    assert found.training["rows"] == len(record) - held
    assert found.held_out is not None
    assert found.held_out["rows"] == held
    with pytest.raises(ParameterError, match=r"test: it is from 4 s to 8 s, and train from 0 s"):
        fit(record, TRUTH, free=["k"], train=(0, 6), test=(4, 8), **LOCAL)
    with pytest.raises(RecordError, match=r"no selected row is from 100 s to 200 s; change test"):
        fit(record, TRUTH, free=["k"], train=(0, 6), test=(100, 200), **LOCAL)


def test_a_record_without_training_rows_is_refused() -> None:
    late, early = _record(), _record().between(0, 4)
    with pytest.raises(RecordError, match=r"no selected row is from 5 s to 9 s.*leave the record"):
        fit([late, early], TRUTH, free=["k"], train=(5, 9), **LOCAL)


def test_choice_does_not_see_the_motion_after_the_training() -> None:
    record = _record()
    x = record.motion().position.copy()
    v = record.motion().velocity.copy()
    late = record.columns["time"] > 8.5
    v[late] *= 4.0
    moved = replace(record, columns={**record.columns, "position": x, "velocity": v})
    kinds = {"one": (bank([2e4], [8e-5]), ["k", "weights"])}
    found = [
        choose(each, candidates=kinds, train=(0, 8), test=(8.5, 10), cycles=2.0)
        for each in (record, moved)
    ]
    assert [each.value for each in found[0].table] == [each.value for each in found[1].table]


def test_bounds_of_stiction_hold_while_friction_is_free() -> None:
    curve = Stribeck(2.0, 2.1, 1e-3)
    truth = LuGre(sigma_0=4e4, sigma_1=0.0, sigma_2=0.0, stribeck=curve)
    record = measured(truth, sine(3e-4, 2.0, 4.0), 0.01, 0)
    start = replace(truth, stribeck=Stribeck(1.5, 1.8, 1e-3))
    found = fit(record, start, free=["F_c", "F_s"], bounds={"F_s": (1.6, 5.0)}, **LOCAL)
    for each in found.table:
        assert each.low <= each.value <= each.high, each
    assert found["F_c"].low < 2.0 < found["F_c"].high
    places = found.task.fine.coordinates
    assert [each.name for each in places.unknowns] == ["F_c", "F_s"]
    further = np.array([places.start[0] + 0.3, places.limits[1][1]])
    assert places.numbers(further)[1] == 5.0  # also above another F_c
    with pytest.raises(ParameterError, match=r"bounds of 'F_s': the highest value is 1.2, and F_c"):
        fit(record, start, free=["F_s"], bounds={"F_s": (1.0, 1.2)}, **LOCAL)


def test_a_false_declaration_of_linearity_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"linear: the force is not linear in 'weights1'"):
        fit(_record(), TRUTH, free=["k", "weights"], linear=["weights"], **LOCAL)


def test_profiles_stay_within_bounds() -> None:
    bounds = {"k": (2.8e4, 1e5)}  # the best is 2.88e4
    found = fit(_record(), bank([3e4], [5e-5]), free=["k"], bounds=bounds, **LOCAL)
    profile = found.profile("k1", restarts=False)
    assert profile.low == profile.values.min() == 2.8e4
    assert profile.rise.min() == 0.0


def test_terms_of_the_measurement_have_its_unit(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"nuisance: 'offset' is given twice"):
        fit(_record(), TRUTH, free=["k"], nuisance=["offset", "offset"], **LOCAL)
    found = fit(_record(), TRUTH, free=["k"], nuisance=["offset", "drift", "inertia"], **LOCAL)
    assert [found[name].unit for name in ("offset", "drift", "inertia")] == ["N", "N/s", "kg"]
    assert found["inertia"].low >= 0.0
    text = found.save(tmp_path / "fitted.toml").read_text(encoding="utf-8")
    assert "Without terms of the measurement that were fitted besides: offset" in text


def test_many_predictions_keep_few_runs() -> None:
    found = fit(_record(), TRUTH, free=["k"], **LOCAL)
    for _ in range(34):
        found.predict(_record())
    assert len(found.task.fine.driver._runs) <= 32


def test_an_interrupt_while_intervals_are_made_keeps_the_values(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def interrupted(*_: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules[fit.__module__], "assessed", interrupted)
    found = fit(_record(), TRUTH, free=["k"], **LOCAL)
    assert found["k1"].value == pytest.approx(2e4, rel=0.01)
    assert found.stopped.startswith("Interrupted before the intervals were known")
    assert not found["k1"].told
    assert np.isfinite(found.effective_rows)
    assert str(found)


def test_a_better_point_met_while_intervals_are_made_is_searched_from(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Here all searches before find nothing but the start."""
    polish, calls = task.Task.polish, list[Any]()

    def later(self: Any, u: Any, best: Any, pool: Any) -> None:
        if calls:
            polish(self, u, best, pool)
        calls.append(u)

    monkeypatch.setattr(task, "_local", lambda given, _, best, __: best.take([given.start_point()]))
    monkeypatch.setattr(task.Task, "polish", later)
    found = fit(_record(), bank([2e4, 5e3], [4.7e-5, 9.5e-5]), free=["weights"], **LOCAL)
    assert found["weights1"].value == pytest.approx(5e-5, rel=1e-3)


def test_a_choice_names_what_failed() -> None:
    kinds = {"good": (TRUTH, ["k"]), "bad": (TRUTH, ["wieghts"])}
    with pytest.raises(ParameterError, match=r"candidate 'bad': free: there is no parameter"):
        choose(_record(), candidates=kinds, cycles=2.0)
