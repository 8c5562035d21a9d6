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
from gms_fsm.errors import MissingExtraError
from gms_fsm.records.motion import Motion
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Corners
from tests.helpers import FASTEST, non_drifting, open_loop, pulled_mass, stick_slip
from tests.scenario_files import MEASURED, OPEN_LOOP, changed, table

LUGRE = LuGre(sigma_0=1e4, sigma_1=1.0, sigma_2=0.4, stribeck=Stribeck(1, 1.5, 1e-3))
CASES: dict[str, Callable[[], tuple[Model, Rig, float]]] = {
    "published law": lambda: (stick_slip("published"), open_loop(), 61.0),
    "pulled mass": lambda: (*pulled_mass(), 30.0),
    "all stick": lambda: (*non_drifting("signed"), 5.0),
    "no edges": lambda: (LUGRE, open_loop(), 5.0),
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


def test_dwell_times_equal_the_ribbons_drawn_and_need_no_rows() -> None:
    trace = whole("published law")
    times = np.linspace(1.0, trace.t[-1] - 1.0, 7)  # neither the start nor the end is a row
    few = run("published law", t_eval=times)
    np.testing.assert_allclose(dwell_times(few), dwell_times(trace), rtol=1e-12)
    np.testing.assert_allclose(dwell_times(trace.sample(times)), dwell_times(trace), rtol=1e-12)
    pytest.importorskip("matplotlib", reason="ribbons need the extra 'plots'")
    from matplotlib.figure import Figure

    from plots import panels

    ax = Figure().subplots()
    panels.ribbons(ax, trace)
    widths = [
        sum(float(np.ptp(path.vertices[:, 0])) for path in ribbon.get_paths())
        for ribbon in ax.collections
    ]
    np.testing.assert_allclose(
        np.reshape(widths, (trace.n, 2)), dwell_times(trace), atol=1e-9 * trace.t[-1]
    )


def test_a_first_state_of_slip_is_counted_from_the_start() -> None:
    states = ["slip", "stick", "slip", "stick"]
    trace = simulate(stick_slip("signed"), Prescribed("0.2"), 1.0, initial={"states": states})
    assert len(trace.transitions) == 0
    assert dwell_times(trace).tolist() == [[0.0, 1.0], [1.0, 0.0]] * 2  # stick, slip


def element_rows(text: str) -> list[dict[str, str]]:
    lines = [line for line in text.splitlines() if line.startswith("|")]
    head, _, *rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in lines)
    return [dict(zip(head, row, strict=True)) for row in rows]


@pytest.mark.parametrize("case", CASES)
def test_the_element_table_equals_the_log(case: str, tmp_path: Path) -> None:
    trace = whole(case)
    (tmp_path / "any.toml").write_text(OPEN_LOOP)
    base = load_scenario(tmp_path / "any.toml")
    loaded = Loaded(base.file, base.scenario, trace.model, trace.rig, {}, None, None)
    text = summary_text(loaded, trace, trace.trust())
    rows, dwell, log = element_rows(text), dwell_times(trace), trace.transitions
    assert [row["element"] for row in rows] == [str(i + 1) for i in range(trace.n)]
    for i, row in enumerate(rows):
        for edge in trace.model.chart.transitions:
            assert int(row[edge.name]) == int(((log.element == i) & (log.edge == edge.name)).sum())
        for j, state in enumerate(trace.model.chart.states):
            assert float(row[f"{state.name} [s]"]) == pytest.approx(dwell[i, j], rel=1e-3)
    assert f"{len(trace)} rows, {len(log)} transitions" in text


def test_the_range_of_the_force_is_over_what_lasts() -> None:
    """The guide is stuck between two micro-steps with 7 kN; else it has less than 100 N."""
    table = load_scenario("ball_screw_table", ["run.t_end=1.7"])
    trace = table.simulate()
    guide = trace.contact("guide")
    assert np.abs(guide.F).max() > 7e3
    ends = [k for k in range(1, len(trace)) if trace.t[k] > trace.t[k - 1]]
    lasting = guide.F[sorted({*ends, *(k - 1 for k in ends)})]
    said = f"F from {lasting.min():.4g} to {lasting.max():.4g} N\n"
    assert np.abs(lasting).max() < 100
    assert said in summary_text(table, trace, trace.trust())


# --------------------------------------------------------------------------- R² and RMSE
MODEL = GMS(
    GMSParameters.from_shares(
        [0.5, 0.3, 0.2], [1e4, 2e4, 4e4], C=200.0, stribeck=Stribeck(1.0, 1.2, 1e-3), v_c=1e-6
    ),
    law="signed",
)
TIMES = np.round(np.arange(2001) * 0.005, 3)
SPEED = 1e-3 * np.sin(2 * np.pi * TIMES / 2.5)  # breaks away all elements in both directions
NOISE = 0.05 * np.random.default_rng(11).standard_normal(TIMES.size)
RIG = Prescribed(Corners(TIMES, SPEED, held=False))
ALL = np.ones(TIMES.size, dtype=bool)


@functools.cache
def exact_run() -> Trace:
    trace = simulate(MODEL, RIG, 10.0, t_eval=TIMES, rtol=1e-9, atol=1e-12, engine=FASTEST)
    assert len(trace.transitions) > 20
    return trace


def measured(noise: np.ndarray = NOISE, chosen: np.ndarray = ALL, **columns: object) -> Record:
    """Return the record of that run: the force of the model plus noise."""
    force = exact_run().F + noise
    found = {"time": TIMES, "velocity": SPEED, "force": force, **columns}
    return Record("made", found, chosen, np.arange(TIMES.size))


def by_hand(force: np.ndarray, model: np.ndarray) -> tuple[float, float]:
    r2 = 1 - np.sum((force - model) ** 2) / np.sum((force - np.mean(force)) ** 2)
    return float(r2), float(np.sqrt(np.mean((force - model) ** 2)))


PART = (TIMES > 1.0) & (np.arange(TIMES.size) % 3 != 0)


@pytest.mark.parametrize(
    "made",
    [
        measured,
        lambda: measured(np.where(PART, NOISE, 1e6), PART),  # only the rows chosen count
        lambda: measured(force=-exact_run().F),  # worse than its mean: R² is negative
    ],
    ids=["all", "chosen", "negative"],
)
def test_r2_and_rmse_are_those_of_numpy(made: Callable[[], Record]) -> None:
    record = made()
    trace, force = exact_run(), record.columns["force"][record.chosen]
    found = compare(trace, record)
    assert found is not None
    assert found.rows == record.chosen.sum()
    assert (found.r2, found.rmse) == pytest.approx(by_hand(force, trace.F[record.chosen]), rel=1e-9)
    times, shown = measured_force(record)
    np.testing.assert_array_equal(times, TIMES[record.chosen])
    np.testing.assert_array_equal(shown, force)


@pytest.mark.slow
def test_the_rows_of_the_trace_do_not_matter_and_a_part_counts_as_that_part() -> None:
    record, force = measured(), measured().columns["force"]
    trace = simulate(MODEL, RIG, 10.0, rtol=1e-9, atol=1e-12)  # all accepted steps
    found = compare(trace, record)
    assert found is not None
    assert found.rows == TIMES.size
    assert found.rmse == pytest.approx(by_hand(force, exact_run().F)[1], rel=1e-3)
    trace = simulate(MODEL, RIG, 6.0, t_start=2.0, t_eval=TIMES[400:1201])
    found = compare(trace, record)
    assert found is not None
    assert found.rows == 801
    assert found.rmse == pytest.approx(by_hand(force[400:1201], trace.F)[1], rel=1e-12)


def test_without_a_force_there_is_nothing_and_with_a_constant_one_no_r2() -> None:
    record = measured()
    columns = {name: value for name, value in record.columns.items() if name != "force"}
    bare = replace(record, columns=columns)
    assert compare(exact_run(), bare) is None
    assert measured_force(bare)[0].size == 0
    found = compare(exact_run(), measured(force=np.full(TIMES.size, 0.5)))
    assert found is not None
    assert found.rmse == pytest.approx(float(np.sqrt(np.mean((0.5 - exact_run().F) ** 2))))
    assert not np.isfinite(found.r2)


@pytest.mark.slow
def test_the_summary_prints_these_numbers_whatever_rows_are_kept(tmp_path: Path) -> None:
    record = measured()
    x = 1e3 * record.motion().position
    (tmp_path / "own.csv").write_text(table(["t", "x", "F"], TIMES, x, record.columns["force"]))
    found = []
    for every in ("", "every = 0.0125\n"):
        (tmp_path / "own.toml").write_text(changed(MEASURED, "[output]\n", f"[output]\n{every}"))
        loaded = load_scenario(tmp_path / "own.toml")
        trace, files = run_scenario(loaded, tmp_path / "out")
        assert loaded.record is not None
        found.append(compare(trace, loaded.record))
        assert len(trace) == (801 if every else 2001)
    one, other = found
    assert one is not None
    assert other is not None
    assert (other.rows, other.rmse) == (one.rows, pytest.approx(one.rmse, rel=1e-3))
    said = f"R² = {other.r2:.4f}, RMSE = {other.rmse:.4g} N"
    assert said in (text := files[0].read_text())
    assert f"on {other.rows} rows" in text


# --------------------------------------------------------------------------- what it cannot tell
def motion(velocity: np.ndarray) -> Motion:
    return Record.from_arrays(time=0.01 * np.arange(velocity.size), velocity=velocity).motion()


ONE_SPEED = motion(np.tile(np.repeat([1e-3, 0.0, -1e-3, 0.0], 100), 3))
SINE = motion(1e-3 * np.sin(2 * np.pi * np.arange(1200) / 300))
MANY_SPEEDS = motion(np.repeat([1e-5, -3e-5, 1e-4, -3e-4, 1e-3, -1e-3], 200))


def over(model: Model, motion: Motion) -> Trace:
    rig = Prescribed(Corners(motion.time, motion.velocity, held=False))
    return simulate(model, rig, float(motion.time[-1]))


def damped(sigma: float) -> GMS:
    return GMS(replace(MODEL.parameters, sigma=np.full(3, sigma)), law="signed")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "record", "said", "not_said"),
    [
        (MODEL, ONE_SPEED, ["F_s, v_s and sigma_2", "only one speed (1 to 1 mm/s", "C:"], []),
        (MODEL, MANY_SPEEDS, [], ["Stribeck", "C:"]),
        (MODEL, SINE, [], ["Stribeck", "C:"]),
        (LUGRE, ONE_SPEED, ["Stribeck"], ["C:"]),
        (damped(1e-3), MANY_SPEEDS, ["sigma_i"], []),
        (damped(100.0), MANY_SPEEDS, [], ["sigma_i"]),
    ],
)
def test_what_a_record_cannot_tell(
    model: Model, record: Motion, said: list[str], not_said: list[str]
) -> None:
    doubts = "\n".join(what_it_cannot_tell(over(model, record), record))
    assert [words for words in said if words not in doubts] == []
    assert [words for words in not_said if words in doubts] == []


@pytest.mark.slow
def test_a_v_c_below_the_noise_is_reported_and_one_above_is_not() -> None:
    rng = np.random.default_rng(2)
    noisy = motion(ONE_SPEED.velocity + 5e-6 * rng.standard_normal(ONE_SPEED.velocity.size))
    trace = over(MODEL, noisy)
    note = velocity_note(trace, noisy)
    assert "v_c = 1e-06 m/s is below" in note
    assert f"v_c = {noisy.fitting_v_c():.2g} m/s would suit" in note
    assert note in what_it_cannot_tell(trace, noisy)
    assert velocity_note(trace, ONE_SPEED) == ""
    assert velocity_note(over(LUGRE, noisy), noisy) == ""


def test_without_motion_no_parameter_can_be_told() -> None:
    still = motion(np.zeros_like(ONE_SPEED.velocity))
    said = what_it_cannot_tell(over(MODEL, ONE_SPEED), still)
    assert said == ["all parameters: there is no motion"]


DRY_CHART = """\
name = "dry friction"

[[parameter]]
name = "F_c"
unit = "N"
rule = "> 0"

[[state]]
name = "on"
outputs.F = "F_c * sgn(v)"
"""
HELD = """\
name = "held"

[[body]]
name = "mass"
inertia = 1.0
force = "0.2"
x = "x"
v = "w"

[[contact]]
name = "pad"
chart = "dry.toml"
values = { F_c = 1.0 }
v = "w"

[initial]
w = 0.5

[run]
t_end = 2.0
"""


def test_a_summary_says_where_the_motion_was_held(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And pictures may be missing."""
    (tmp_path / "dry.toml").write_text(DRY_CHART)
    path = tmp_path / "held.toml"
    path.write_text(HELD)

    def refuses(*_: object) -> None:
        raise MissingExtraError("plots are away")

    monkeypatch.setattr("gms_fsm.app.report._draw", refuses)
    with pytest.warns(UserWarning, match="no figure was drawn: plots are away"):
        _, files = run_scenario(load_scenario(path), tmp_path / "out")
    said = files[0].read_text()
    assert "- note, sliding: held on w = 0 for 1.375 s, first at t = 0.625 s" in said
