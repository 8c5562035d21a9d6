"""A fit finds the numbers that made a record: from training rows only, in any unit and frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    ChartModel,
    Contact,
    GMSError,
    LuGre,
    ParameterError,
    Record,
    RecordError,
    Stribeck,
    System,
    choose,
    excite,
    fit,
    initial_bank,
    simulate,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import MissingExtraError
from gms_fsm.identification import _saved, result
from gms_fsm.identification.candidates import STIFFER_ONE_WAY
from gms_fsm.identification.certainty.compared import Choice, ChoiceRow
from gms_fsm.identification.problem.runs import ComparedColumn
from gms_fsm.systems.models import with_values
from tests.identification.fits_made import small
from tests.identification.records import (
    FREE,
    NOISE,
    START,
    TRUTH,
    bank,
    fitted,
    measured,
    noise,
    plain,
    rubbed,
    sine,
)

pytest.importorskip("llvmlite", reason="fits take long without machine code")

pytestmark = pytest.mark.slow


def test_the_truth_is_within_three_standard_deviations() -> None:
    k, weights = [2.5e4, 6e3], [2e-5, 9e-5]
    truth = {"k1": k[0], "k2": k[1], "weights1": weights[0], "weights2": weights[1], "C": 5e-4}
    truth |= {"F_s": 1.2, "v_s": 2e-4, "sigma_2": 80.0, "offset": 0.0}
    motion = excite(3e-4, [1e-4, 4e-4, 1.4e-3], rate=50.0)
    record = measured(bank(k, weights, sigma_2=80.0), motion, 0.02, seed=3)
    first = initial_bank(record, 2)
    thresholds = first.weights * first.stribeck.F_c
    start = with_values(first, {"weights": thresholds, "F_c": 1.0, "F_s": 1.05, "v_c": 5e-6})
    found = fit(record, start, free=("k", "weights", "C", "F_s", "v_s", "sigma_2"), tied=("C",))
    assert found.training["rmse"] == pytest.approx(0.02, rel=0.03)
    assert found.weakest.startswith("All parameters are determined.")
    assert not found.open
    for each in found.table:
        assert each.told, each
        half = 0.5 * (each.high - each.low)
        assert abs(each.value - truth[each.name]) < 1.6 * half, each  # 3 of 1.96


def test_force_without_noise_is_reproduced() -> None:
    truth = bank([2.5e4, 6e3], [2e-5, 9e-5], sigma_2=80.0)
    record = measured(truth, excite(3e-4, [1e-4, 1e-3], rate=50.0), 0.0)
    start = with_values(truth, {"k": [1e4, 1e4], "sigma_2": 0.0})
    found = fitted(record, start, ("k", "sigma_2"))
    assert [found[name].value for name in ("k1", "k2")] == pytest.approx([2.5e4, 6e3], rel=1e-5)
    assert found["sigma_2"].value == pytest.approx(80.0, rel=1e-4)
    assert found.predict(record) == pytest.approx(record.columns["force"], abs=1e-4)


def test_equal_arguments_give_equal_results() -> None:
    one, two = small(), small.__wrapped__()
    assert [each.value for each in one.table] == [each.value for each in two.table]
    assert np.array_equal(one.covariance, two.covariance)
    assert one.runs == two.runs


def test_every_unit_gives_the_same_fit_and_the_same_order_of_models() -> None:
    """Forces in MN, strokes in nm, cycles of hours."""
    force, length, time = 1e6, 1e-6, 3600.0

    def scaled(model: GMS) -> GMS:
        p, curve, speed = model.parameters, model.stribeck, length / time
        numbers = {
            "k": p.k * force / length,
            "C": p.C * speed,
            "v_c": p.v_c * speed,
            "weights": p.weights * length / force,
            "stribeck": Stribeck(curve.F_c * force, curve.F_s * force, curve.v_s * speed),
        }
        return replace(model, parameters=p.replaced(**numbers))

    columns = rubbed(3.0).columns
    other = Record.from_arrays(
        time=columns["time"] * time,
        velocity=columns["velocity"] * length / time,
        force=columns["force"] * force,
    )
    one, two = fitted(rubbed(3.0)), fitted(other, scaled(START))
    scales = {"k": force / length, "w": length / force, "o": force}
    for a, b in zip(one.table, two.table, strict=True):
        scale = scales[a.name[0]]
        width = (a.high - a.low) * scale
        assert (b.name, b.told) == (a.name, a.told)
        assert b.value == pytest.approx(a.value * scale, abs=0.02 * width), a
        assert b.high - b.low == pytest.approx(width, rel=0.2), a
    worse = bank([2e4], [8e-5])
    pairs = [(one, fitted(rubbed(3.0), worse, ["k"])), (two, fitted(other, scaled(worse), ["k"]))]
    differences = [rows[0].bic - rows[1].bic for rows in (a.compare([b]).rows for a, b in pairs)]
    assert differences[0] == pytest.approx(differences[1], rel=1e-3)
    assert differences[0] < 0.0  # the better one has the lower criterion


# --------------------------------------------------------------------------- which rows
def test_rows_held_out_are_not_read() -> None:
    record, one = rubbed(), plain()
    held = record.columns["time"] >= 8.0
    force = np.where(held, 1e6, record.columns["force"])
    spoilt = replace(record, columns={**record.columns, "force": force})
    two = fitted(spoilt, test=(8, 13))  # without train, all other rows
    assert [each.value for each in one.table] == [each.value for each in two.table]
    assert [each.low for each in one.table] == [each.low for each in two.table]
    assert one.held_out is not None
    assert two.held_out is not None
    assert one.held_out["rmse"] == pytest.approx(NOISE, rel=0.1)
    assert two.held_out["rmse"] > 1e5
    last = int(held.sum()) - 1  # at the end of the interval
    assert (one.training["rows"], one.held_out["rows"]) == (len(record) - last - 1, last)


def test_a_choice_does_not_see_the_motion_after_the_training() -> None:
    record = rubbed(5.0)
    v = record.motion().velocity * np.where(record.columns["time"] > 8.5, 4.0, 1.0)
    position = record.motion().position
    moved = replace(record, columns={**record.columns, "position": position, "velocity": v})
    kinds = {"one": (bank([2e4], [8e-5]), ["k", "weights"])}
    one, two = (
        choose(each, candidates=kinds, train=(0, 8), test=(8.5, 10), cycles=2.0)
        for each in (record, moved)
    )
    assert [each.value for each in one.table] == [each.value for each in two.table]


@pytest.mark.matrix
@pytest.mark.parametrize("begin", [9.3, 6.495])  # in the middle of a stroke, and where it turns
def test_a_record_that_begins_in_motion_runs_in(begin: float) -> None:
    late = rubbed(12.0).between(begin, 24.0)  # all elements deflected
    found = fitted(late)
    assert found.begin == "run in"
    assert found["k1"].value == pytest.approx(2e4, rel=0.01)
    assert found.training["rmse"] == pytest.approx(NOISE, rel=0.05)
    assert fitted(late, begin="relaxed").training["rmse"] > 2 * NOISE
    assert plain().predict(late).shape == (len(late),)
    assert plain().score(late)["rmse"] == pytest.approx(NOISE, rel=0.1)


def test_a_record_that_begins_relaxed_in_motion_is_found_out() -> None:
    t = np.linspace(0.0, 8.0, 1601)
    motion = Record.from_arrays(time=t, velocity=1e-3 * np.cos(np.pi * t))
    found = fitted(measured(TRUTH, motion))
    assert found.begin == "relaxed"
    assert found["k1"].value == pytest.approx(2e4, rel=0.01)


def test_several_records_are_one_experiment() -> None:
    both = [rubbed(), measured(TRUTH, sine(1e-4, 1.0, 4.0), seed=1)]
    found = fitted(both)
    assert found.training["rows"] == sum(map(len, both))
    assert found["k1"].value == pytest.approx(2e4, rel=0.01)
    width = [each["k2"].high - each["k2"].low for each in (found, plain())]
    assert width[0] < width[1]


# --------------------------------------------------------------------------- promises
@pytest.mark.every(2)
@pytest.mark.parametrize("bounds", [{}, {"z_c1": (2e-5, 2e-4), "z_c2": (2e-5, 1.1e-4)}])
def test_elements_are_in_the_order_of_their_thresholds_unless_bounds_name_them(
    bounds: dict[str, tuple[float, float]],
) -> None:
    values: Any = {"k": [5e3, 2e4], "b": [0.0, 0.0], "z_c": [1.1e-4, 5e-5]}
    model = ChartModel(STIFFER_ONE_WAY, values, n=2)
    found = fitted(rubbed(), model, ["k", "z_c"], bounds=bounds)
    thresholds = [found["z_c1"].value, found["z_c2"].value]
    assert thresholds == sorted(thresholds, reverse=bool(bounds))
    assert found["k2" if bounds else "k1"].value == pytest.approx(2e4, rel=0.2)


def test_all_of_an_element_moves_with_it() -> None:
    found = fitted(rubbed(), bank([5e3, 2e4], [1e-4, 5e-5], C=[1e-3, 2e-3]))
    assert found["weights1"].value < found["weights2"].value
    assert found.model.values["C"].tolist() == [2e-3, 1e-3]  # type: ignore[union-attr]


@pytest.mark.matrix
def test_bounds_of_stiction_hold_while_friction_is_free() -> None:
    truth = LuGre(sigma_0=4e4, sigma_1=0.0, sigma_2=0.0, stribeck=Stribeck(2.0, 2.1, 1e-3))
    record = measured(truth, sine(3e-4, 2.0, 4.0))
    start = replace(truth, stribeck=Stribeck(1.5, 1.8, 1e-3))
    found = fitted(record, start, ["F_c", "F_s"], bounds={"F_s": (1.6, 5.0)})
    for each in found.table:
        assert each.low <= each.value <= each.high, each
    assert found["F_c"].low < 2.0 < found["F_c"].high
    places = found.task.fine.coordinates
    assert [each.name for each in places.unknowns] == ["F_c", "F_s"]
    further = np.array([places.start[0] + 0.3, places.limits[1][1]])
    assert places.numbers(further)[1] == 5.0  # also above another F_c
    with pytest.raises(ParameterError, match=r"bounds of 'F_s': the highest value is 1.2, and F_c"):
        fit(record, start, free=["F_s"], bounds={"F_s": (1.0, 1.2)})


def test_terms_of_the_measurement_have_its_unit(tmp_path: Path) -> None:
    found = fitted(rubbed(), TRUTH, ["k"], nuisance=["offset", "drift", "inertia"])
    assert [found[name].unit for name in ("offset", "drift", "inertia")] == ["N", "N/s", "kg"]
    assert found["inertia"].low >= 0.0
    text = found.save(tmp_path / "fitted.toml").read_text(encoding="utf-8")
    assert "Without terms of the measurement that were fitted besides: offset" in text


def test_predictions_keep_no_runs() -> None:
    fine = plain().task.fine
    plain().predict(rubbed())
    kept = vars(fine._own).get("runs", {})
    assert {*kept} <= {id(each) for each in fine.courses}


@pytest.mark.parametrize(
    ("record", "given", "kind", "words"),
    [
        (rubbed, {"train": (0, 6), "test": (4, 8)}, ParameterError, "test: it is from 4 s to 8 s"),
        (rubbed, {"train": (0, 6), "test": (100, 200)}, RecordError, "from 100 s to 200 s; change"),
        (rubbed, {"free": FREE, "linear": ["weights"]}, ParameterError, "not linear in 'weights1'"),
        (rubbed, {"nuisance": ["offset"] * 2}, ParameterError, "'offset' is given twice"),
        (lambda: [rubbed(), rubbed().between(0, 4)], {"train": (5, 9)}, RecordError, "leave the"),
    ],
)
def test_what_a_record_cannot_be_asked_is_named(
    record: Any, given: dict[str, Any], kind: type[GMSError], words: str
) -> None:
    with pytest.raises(kind, match=words):
        fit(record(), TRUTH, **{"free": ["k"]} | given)


def test_a_fit_answers_by_number_of_record_and_by_name() -> None:
    found = plain()
    (rows,) = found.residuals()
    assert found.residuals(0) == [rows]
    assert found.smoothing is None
    column = ComparedColumn.of("F", found.task.subject)
    assert (column.column, column.contact) == ("force", found.task.measured.contact)
    later = fitted(rubbed(), TRUTH, ["k"], train=(2, 8), test=(8, 12))
    options = replace(found.task.options, test=(9, 12))
    other = replace(found, task=replace(found.task, options=options))
    silent = Record.from_arrays(**dict(rubbed().columns) | {"force": None}, name="silent")
    asked: list[tuple[type[GMSError], str, Callable[[], Any]]] = [
        (ParameterError, "there are 1 records, counted from 0", lambda: found.residuals(1)),
        (ParameterError, "there is no parameter 'q'; there are k1", lambda: found["q"]),
        (ParameterError, "there is no profile of 'q'", lambda: found.profile("q")),
        (RecordError, "'silent': it has no force, with which", lambda: found.score(silent)),
        (ParameterError, "was made from other rows", lambda: found.compare([later])),
        (ParameterError, "other rows were held out of fit", lambda: found.compare([other])),
    ]
    for kind, words, call in asked:
        with pytest.raises(kind, match=words):
            call()


def test_a_choice_says_among_how_many_and_what_failed() -> None:
    good = ChoiceRow("a", "", 1, 0.1, 0.9, -3.0, 0.1)
    chosen = plain().with_choice(Choice((good, replace(good, name="b", note="lost")), "a"), 0.2)
    assert str(chosen).endswith("chosen among 2 candidates: a\nb failed: lost")


def test_a_report_needs_what_makes_reports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(result, "asked", lambda _: None)
    with pytest.raises(MissingExtraError, match="plots"):
        plain().report(tmp_path)


def test_a_thinned_course_is_the_same_motion() -> None:
    course = plain().task.courses[0]
    half = course.thinned(2)
    assert course.thinned(1) is course
    assert (half.t == course.t[::2]).all()
    assert (half.measured == course.measured[::2]).all()
    t = np.linspace(0.0, 8.0, 99)
    one, other = (np.interp(t, each.signal.times, each.signal.values) for each in (half, course))
    assert one == pytest.approx(other, abs=1e-6)


# --------------------------------------------------------------------------- saved
@pytest.fixture
def saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario whose motion is a table beside it, as that of a long record is."""
    monkeypatch.setattr(_saved, "LONGEST", 10)
    return plain().save(tmp_path / "fitted.toml")


def test_the_saved_scenario_gives_the_same_force_also_beside_a_table(
    saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_saved, "LONGEST", 10_000)
    whole = plain().save(tmp_path / "whole.toml")
    assert saved.stat().st_size < 2000 < whole.stat().st_size
    assert (tmp_path / "fitted.csv").read_text().startswith("t_s,v\n")
    record = rubbed()
    how: Any = {"t_eval": record.columns["time"], "rtol": 1e-9}
    one, other = (load_scenario(path) for path in (saved, whole))
    force = one.simulate(**how).contact("friction").F
    assert np.array_equal(force, other.simulate(**how).contact("friction").F)
    assert plain().predict(record) - plain()["offset"].value == pytest.approx(force, abs=1e-7)
    assert one.scenario.title == "GMS, 2 elements, signed law fitted to synthetic"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"fitted.csv"', '"gone.csv"', r"fitted\.toml: .*signals.*gone\.csv"),
        ('"fitted.csv"', '"../fitted.csv"', "it is outside the folder"),
        ('"fitted.csv"', '"a\\u0000b.csv"', "it is no file name"),
        ('v.value = "v"', 'v.value = "w"', "no column 'w'"),
    ],
)
def test_a_wrong_table_is_named(old: str, new: str, words: str, saved: Path) -> None:
    saved.write_text(saved.read_text().replace(old, new))
    with pytest.raises(GMSError, match=words):
        load_scenario(saved)


# --------------------------------------------------------------------------- systems
def _pulled(m: float, F_c: float) -> System:
    pad = bank([200.0, 100.0], [3e-3, 1e-2], C=[0.1, 0.1], F_s=1.5 * F_c, v_s=0.05, v_c=1e-4)
    curve = replace(pad.parameters.stribeck, F_c=F_c)
    model = replace(pad, parameters=pad.parameters.replaced(stribeck=curve))
    load = Body("load", inertia="m", force="K * (0.1 * t - x)")
    return System(
        "pulled", bodies=(load,), contacts=(Contact("pad", model),), numbers={"m": m, "K": 20.0}
    )


@pytest.mark.matrix
def test_a_mass_and_its_friction_from_positions() -> None:
    t = np.linspace(0.0, 8.0, 401)
    run = simulate(_pulled(1.0, 1.0), 8.0, t_eval=t, rtol=1e-9)
    seen = Record.from_arrays(time=t, position=run.body("load").x + 1e-5 * noise(0, t.size))
    truth = {"numbers.m": 1.0, "pad.F_c": 1.0, "pad.F_s": 1.5}
    found = fit(seen, _pulled(1.2, 0.9), free=[*truth], measured="load.x", nuisance=())
    for name, value in truth.items():
        assert found[name].value == pytest.approx(value, rel=1e-3)
        assert abs(found[name].value - value) < found[name].high - found[name].low
    assert found.training["rmse"] == pytest.approx(1e-5, rel=0.1)
    assert isinstance(found.model, System)


@pytest.mark.matrix
def test_a_driven_system_is_the_model_on_the_record_and_asks_which_signal_drives() -> None:
    bodies = (Body("a", velocity="w", x="x_a", v="v_a"), Body("b", velocity="u", x="x_b", v="v_b"))
    pad = Contact("pad", START, v="v_a - v_b")
    two = System("two", bodies=bodies, contacts=(pad,), signals={"w": 0.0, "u": 0.0})
    free, more = ("pad.k", "pad.weights"), {"train": (0, 8), "test": (8, 12)}
    inside = fitted(rubbed(), two, free, drive="w", measured="pad.F", **more)
    for name in ("k1", "weights1", "k2", "weights2"):
        assert inside[f"pad.{name}"].value == pytest.approx(plain()[name].value, rel=1e-6)
    with pytest.raises(ParameterError, match=r"drive: it cannot be told which signal.*w, u"):
        fit(rubbed(), two, free=["pad.k"])
    with pytest.raises(ParameterError, match=r"drive: there is no signal 'q'; there are w, u"):
        fit(rubbed(), two, free=["pad.k"], drive="q")
