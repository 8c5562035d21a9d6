"""Dwell times, counts, R², RMSE and notes of a report follow from the run and the record."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, Record, Stribeck, Trace, simulate
from gms_fsm.app.report import (
    compare,
    dwell_times,
    measured_force,
    run_scenario,
    summary_text,
    velocity_note,
    what_it_cannot_tell,
)
from gms_fsm.app.scenario import Loaded, load_scenario
from gms_fsm.records.motion import Motion
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Corners
from tests.helpers import non_drifting, open_loop, pulled_mass, stick_slip
from tests.scenario_files import MEASURED, OPEN_LOOP, changed, table

CASES: dict[str, Callable[[], tuple[Model, Rig, float]]] = {
    "signed law": lambda: (stick_slip("signed"), open_loop(), 61.0),
    "published law": lambda: (stick_slip("published"), open_loop(), 61.0),
    "pulled mass": lambda: (*pulled_mass(), 30.0),
    "all stick": lambda: (*non_drifting("signed"), 5.0),
    "no edges": lambda: (
        LuGre(sigma_0=1e3, sigma_1=3.0, sigma_2=0.4, stribeck=Stribeck(1, 1.5, 1e-3)),
        open_loop(),
        5.0,
    ),
}


@functools.cache
def whole(case: str) -> Trace:
    return run(case)


def run(case: str, **options: object) -> Trace:
    model, rig, t_end = CASES[case]()
    return simulate(model, rig, t_end, **options)  # type: ignore[arg-type]


# --------------------------------------------------------------------------- dwell times
@pytest.mark.parametrize(
    ("case", "start"), [*((case, 0.0) for case in CASES), ("pulled mass", 2.5)]
)
def test_dwell_times_fill_the_run_and_equal_the_rows(case: str, start: float) -> None:
    trace = run(case, t_start=start)
    dwell = dwell_times(trace)
    length = trace.t[-1] - start
    np.testing.assert_allclose(dwell.sum(axis=1), length, rtol=1e-12)
    assert (dwell >= 0).all()
    steps = np.diff(trace.t)
    for j, state in enumerate(trace.model.chart.states):
        in_state = trace.states[:-1] == state.name
        np.testing.assert_allclose(dwell[:, j], steps @ in_state, atol=1e-9 * length)


@pytest.mark.parametrize("case", CASES)
def test_dwell_times_equal_the_ribbons_drawn(case: str) -> None:
    pytest.importorskip("matplotlib", reason="ribbons need the extra 'plots'")
    from matplotlib.figure import Figure

    from plots import panels

    trace = whole(case)
    ax = Figure().subplots()
    panels.ribbons(ax, trace)
    states = len(trace.model.chart.states)
    widths = [
        sum(float(np.ptp(path.vertices[:, 0])) for path in ribbon.get_paths())
        for ribbon in ax.collections
    ]
    np.testing.assert_allclose(
        np.reshape(widths, (trace.n, states)), dwell_times(trace), atol=1e-9 * trace.t[-1]
    )


@pytest.mark.parametrize(("case", "rows"), [*((case, 7) for case in CASES), ("signed law", 500)])
def test_dwell_times_do_not_depend_on_the_requested_rows(case: str, rows: int) -> None:
    trace = whole(case)
    times = np.linspace(1.0, trace.t[-1] - 1.0, rows)  # neither the start nor the end is a row
    few = run(case, t_eval=times)
    np.testing.assert_allclose(dwell_times(few), dwell_times(trace), rtol=1e-12)
    np.testing.assert_allclose(dwell_times(trace.sample(times)), dwell_times(trace), rtol=1e-12)


def test_a_first_state_of_slip_is_counted_from_the_start() -> None:
    model = stick_slip("signed")
    states = ["slip", "stick", "slip", "stick"]
    trace = simulate(model, Prescribed("0.2"), 1.0, initial={"states": states})
    names = [state.name for state in model.chart.states]
    assert len(trace.transitions) == 0
    for i, state in enumerate(states):
        assert dwell_times(trace)[i, names.index(state)] == 1.0


# --------------------------------------------------------------------------- the element table
def element_rows(text: str) -> list[dict[str, str]]:
    lines = [line for line in text.splitlines() if line.startswith("|")]
    head, _, *rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in lines)
    return [dict(zip(head, row, strict=True)) for row in rows]


@pytest.mark.parametrize(
    ("case", "every"), [*((case, None) for case in CASES), ("published law", 0.5)]
)
def test_transitions_per_element_equal_the_log(
    case: str, every: float | None, tmp_path: Path
) -> None:
    options = {} if every is None else {"t_eval": np.arange(0.0, 5.0, every)}
    trace = run(case, **options)
    (tmp_path / "any.toml").write_text(OPEN_LOOP)
    base = load_scenario(tmp_path / "any.toml")
    loaded = Loaded(base.path, base.scenario, trace.model, trace.rig, {}, None, None)
    text = summary_text(loaded, trace)
    rows = element_rows(text)
    dwell = dwell_times(trace)
    assert [row["element"] for row in rows] == [str(i + 1) for i in range(trace.n)]
    for i, row in enumerate(rows):
        for edge in trace.model.chart.transitions:
            log = trace.transitions
            assert int(row[edge.name]) == int(((log.element == i) & (log.edge == edge.name)).sum())
        for j, state in enumerate(trace.model.chart.states):
            assert float(row[f"{state.name} [s]"]) == pytest.approx(dwell[i, j], rel=1e-3)
    assert f"{len(trace)} rows, {len(trace.transitions)} transitions" in text
    counted = sum(int(row[edge.name]) for row in rows for edge in trace.model.chart.transitions)
    assert counted == len(trace.transitions)


# --------------------------------------------------------------------------- R² and RMSE
MODEL = GMS(
    GMSParameters.from_shares(
        [0.5, 0.3, 0.2], [1e4, 2e4, 4e4], C=200.0, stribeck=Stribeck(1.0, 1.2, 1e-3), v_c=1e-6
    ),
    law="signed",
)
TIMES = np.round(np.arange(2001) * 0.005, 3)
NOISE = 0.05 * np.random.default_rng(11).standard_normal(TIMES.size)


def speed(t: np.ndarray) -> np.ndarray:
    """A motion that breaks away all elements in both directions."""
    return 1e-3 * np.sin(2 * np.pi * t / 2.5)


RIG = Prescribed(Corners(TIMES, speed(TIMES), held=False))


@functools.cache
def exact_run() -> Trace:
    return simulate(MODEL, RIG, 10.0, t_eval=TIMES, rtol=1e-9, atol=1e-12)


def measured(noise: np.ndarray, chosen: np.ndarray | None = None) -> tuple[Trace, Record]:
    """Return a run with the motion of a record, and the record: force of the model plus noise."""
    trace = exact_run()
    assert len(trace.transitions) > 20
    columns = {"time": TIMES, "velocity": speed(TIMES), "force": trace.F + noise}
    chosen = np.ones(TIMES.size, dtype=bool) if chosen is None else chosen
    return trace, Record("made", columns, chosen, np.arange(TIMES.size))


def by_hand(force: np.ndarray, model: np.ndarray) -> tuple[float, float]:
    r2 = 1 - np.sum((force - model) ** 2) / np.sum((force - np.mean(force)) ** 2)
    return float(r2), float(np.sqrt(np.mean((force - model) ** 2)))


def test_r2_and_rmse_are_those_of_numpy() -> None:
    trace, record = measured(NOISE)
    found = compare(trace, record)
    assert found is not None
    r2, rmse = by_hand(record.columns["force"], trace.F)
    assert found.rows == TIMES.size
    assert found.r2 == pytest.approx(r2, rel=1e-12)
    assert found.rmse == pytest.approx(rmse, rel=1e-12)
    assert found.rmse == pytest.approx(0.05, rel=0.05)
    assert 0.9 < found.r2 < 1.0


@pytest.mark.slow
def test_a_record_worse_than_its_mean_has_a_negative_r2() -> None:
    trace, record = measured(np.zeros(TIMES.size))
    columns = {**record.columns, "force": -record.columns["force"]}
    found = compare(trace, replace(record, columns=columns))
    assert found is not None
    assert found.r2 == pytest.approx(by_hand(columns["force"], trace.F)[0])
    assert found.r2 < 0.0


def test_only_selected_rows_are_compared() -> None:
    chosen = (TIMES > 1.0) & (np.arange(TIMES.size) % 3 != 0)
    trace, record = measured(np.where(chosen, NOISE, 1e6), chosen)
    found = compare(trace, record)
    assert found is not None
    r2, rmse = by_hand(record.columns["force"][chosen], trace.F[chosen])
    assert found.rows == chosen.sum()
    assert found.r2 == pytest.approx(r2, rel=1e-9)
    assert found.rmse == pytest.approx(rmse, rel=1e-9)
    times, force = measured_force(record)
    np.testing.assert_array_equal(times, TIMES[chosen])
    np.testing.assert_array_equal(force, record.columns["force"][chosen])


@pytest.mark.slow
@pytest.mark.parametrize(
    "rows",
    [None, np.linspace(2.0, 8.0, 100)],
    ids=["all accepted steps", "a part"],
)
def test_the_rows_of_the_trace_do_not_matter(rows: np.ndarray | None) -> None:
    exact, record = measured(NOISE)
    trace = simulate(MODEL, RIG, 10.0, t_eval=rows, rtol=1e-9, atol=1e-12)
    found = compare(trace, record)
    assert found is not None
    inside = (trace.t[0] <= TIMES) & (trace.t[-1] >= TIMES)
    r2, rmse = by_hand(record.columns["force"][inside], exact.F[inside])
    assert found.rows == inside.sum()
    assert found.r2 == pytest.approx(r2, abs=1e-4)
    assert found.rmse == pytest.approx(rmse, rel=1e-3)


def test_a_run_over_a_part_of_the_record_counts_that_part() -> None:
    exact, record = measured(NOISE)
    trace = simulate(MODEL, RIG, 6.0, t_start=2.0, t_eval=TIMES[400:1201])
    found = compare(trace, record)
    assert found is not None
    assert found.rows == 801
    force = record.columns["force"][400:1201]
    assert found.rmse == pytest.approx(by_hand(force, trace.F)[1], rel=1e-12)
    assert exact.t[400] == trace.t[0]


def test_without_a_force_there_is_nothing_to_compare() -> None:
    trace, record = measured(NOISE)
    columns = {name: value for name, value in record.columns.items() if name != "force"}
    bare = replace(record, columns=columns)
    assert compare(trace, bare) is None
    assert measured_force(bare)[0].size == 0


def test_a_constant_force_has_an_rmse_but_no_r2() -> None:
    trace, record = measured(NOISE)
    columns = {**record.columns, "force": np.full(TIMES.size, 0.5)}
    found = compare(trace, replace(record, columns=columns))
    assert found is not None
    rmse = float(np.sqrt(np.mean((0.5 - trace.F) ** 2)))
    assert found.rmse == pytest.approx(rmse)
    assert not np.isfinite(found.r2)


@pytest.mark.slow
def test_the_summary_prints_these_numbers(tmp_path: Path) -> None:
    trace, record = measured(NOISE)
    x = 1e3 * record.motion().position
    (tmp_path / "own.csv").write_text(table(["t", "x", "F"], TIMES, x, record.columns["force"]))
    (tmp_path / "own.toml").write_text(MEASURED)
    loaded = load_scenario(tmp_path / "own.toml")
    ran, files = run_scenario(loaded, tmp_path / "out")
    assert loaded.record is not None
    found = compare(ran, loaded.record)
    assert found is not None
    text = files[0].read_text()
    assert f"R² = {found.r2:.4f}, RMSE = {found.rmse:.4g} N" in text
    assert f"on {found.rows} rows" in text
    force = loaded.record.columns["force"]
    assert found.r2 == pytest.approx(by_hand(force, ran.F)[0], rel=1e-12)
    assert len(trace) == len(ran)


@pytest.mark.slow
def test_rows_every_so_often_change_the_file_not_the_comparison(tmp_path: Path) -> None:
    _, record = measured(NOISE)
    x = 1e3 * record.motion().position
    (tmp_path / "own.csv").write_text(table(["t", "x", "F"], TIMES, x, record.columns["force"]))
    found = []
    for every in ("", "every = 0.0125\n"):
        (tmp_path / "own.toml").write_text(changed(MEASURED, "[output]\n", "[output]\n" + every))
        loaded = load_scenario(tmp_path / "own.toml")
        trace, _ = run_scenario(loaded, tmp_path / "out")
        assert loaded.record is not None
        found.append(compare(trace, loaded.record))
        assert len(trace) == (801 if every else 2001)
    assert found[0] is not None
    assert found[1] is not None
    assert found[1].rows == found[0].rows
    assert found[1].rmse == pytest.approx(found[0].rmse, rel=1e-3)


# --------------------------------------------------------------------------- what it cannot tell
def motion(velocity: np.ndarray) -> Motion:
    t = 0.01 * np.arange(velocity.size)
    columns = {"time": t, "velocity": velocity}
    return Record.from_arrays(**columns).motion()


ONE_SPEED = motion(np.tile(np.repeat([1e-3, 0.0, -1e-3, 0.0], 100), 3))
SINE = motion(1e-3 * np.sin(2 * np.pi * np.arange(1200) / 300))
MANY_SPEEDS = motion(np.repeat([1e-5, -3e-5, 1e-4, -3e-4, 1e-3, -1e-3], 200))


def doubts(model: Model, over: Motion) -> str:
    rig = Prescribed(Corners(over.time, over.velocity, held=False))
    trace = simulate(model, rig, float(over.time[-1]))
    return "\n".join(what_it_cannot_tell(trace, over))


def test_one_speed_identifies_neither_the_stribeck_curve_nor_C() -> None:
    said = doubts(MODEL, ONE_SPEED)
    assert "Stribeck" in said
    assert "F_s, v_s and sigma_2" in said
    assert "only one speed (1 to 1 mm/s" in said
    assert "C:" in said


@pytest.mark.parametrize("over", [MANY_SPEEDS, SINE], ids=["stairs", "sine"])
def test_many_speeds_identify_them(over: Motion) -> None:
    said = doubts(MODEL, over)
    assert "Stribeck" not in said
    assert "C:" not in said


def test_lugre_has_no_C_to_doubt() -> None:
    model = LuGre(sigma_0=1e4, sigma_1=1.0, sigma_2=0.4, stribeck=Stribeck(1, 1.5, 1e-3))
    said = doubts(model, ONE_SPEED)
    assert "Stribeck" in said
    assert "C:" not in said


@pytest.mark.parametrize(("sigma", "seen"), [(0.0, False), (1e-3, False), (100.0, True)])
def test_damping_too_small_to_be_seen_is_reported(sigma: float, seen: bool) -> None:
    p = MODEL.parameters
    parameters = GMSParameters(
        p.k, [sigma] * 3, p.C, sigma_2=0.0, stribeck=p.stribeck, v_c=p.v_c, weights=p.weights
    )
    assert ("sigma_i" not in doubts(GMS(parameters, law="signed"), MANY_SPEEDS)) is seen


def test_a_v_c_below_the_noise_is_reported_and_one_above_is_not() -> None:
    rng = np.random.default_rng(2)
    noisy = motion(ONE_SPEED.velocity + 5e-6 * rng.standard_normal(ONE_SPEED.velocity.size))
    rig = Prescribed(Corners(noisy.time, noisy.velocity, held=False))
    trace = simulate(MODEL, rig, float(noisy.time[-1]))
    note = velocity_note(trace, noisy)
    assert "v_c = 1e-06 m/s is below" in note
    assert f"v_c = {noisy.fitting_v_c():.2g} m/s would suit" in note
    assert note in what_it_cannot_tell(trace, noisy)
    assert velocity_note(trace, ONE_SPEED) == ""
    lugre = LuGre(sigma_0=1e4, sigma_1=1.0, sigma_2=0.4, stribeck=Stribeck(1, 1.5, 1e-3))
    assert velocity_note(simulate(lugre, rig, 1.0), noisy) == ""
