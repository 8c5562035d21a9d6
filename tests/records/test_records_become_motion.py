"""A measured table becomes a motion in SI units, with notes on rows, gaps, smoothing and noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from gms_fsm import Record
from gms_fsm.foundation.quantities import COLUMN_UNITS, convert_numbers, factor
from gms_fsm.records.motion import Motion, motion_of
from gms_fsm.records.record import Column
from tests.scenario_files import MEASURED, CommandLine, changed, read_table, table

SI = {
    "time": Column("t", "s"),
    "position": Column("x", "m"),
    "velocity": Column("v", "m/s"),
    "force": Column("F", "N"),
    "normal": Column("N", "N"),
}


def record_of(**columns: np.ndarray) -> Record:
    size = len(columns["time"])
    return Record("made", columns, np.ones(size, dtype=bool), np.arange(size))


def read(tmp_path: Path, text: str, where: str = "", **columns: Column) -> Record:
    (tmp_path / "own.csv").write_text(text, encoding="utf-8")
    return read_table(tmp_path / "own.csv", {"time": SI["time"], **columns}, where)


# --------------------------------------------------------------------------- units
MICRO = dict.fromkeys(("um", "µm", "μm"), 1e-6)
EXPECTED = {
    "time": {"s": 1, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "min": 60, "h": 3600},
    "position": {"m": 1, "cm": 0.01, "mm": 1e-3, "nm": 1e-9, "in": 0.0254, **MICRO},
    "velocity": {"m/s": 1, "cm/s": 0.01, "mm/s": 1e-3, "um/s": 1e-6, "µm/s": 1e-6, "μm/s": 1e-6},
    "force": {"N": 1, "kN": 1e3, "mN": 1e-3, "uN": 1e-6, "µN": 1e-6, "μN": 1e-6},
}
EXPECTED["velocity"] |= {"nm/s": 1e-9}
EXPECTED["force"] |= {"lbf": 4.4482216152605}
EXPECTED["position"] |= {"rad": 1, "mrad": 1e-3, "deg": np.pi / 180, "°": np.pi / 180}
EXPECTED["velocity"] |= {"rad/s": 1, "mrad/s": 1e-3, "deg/s": np.pi / 180, "rpm": np.pi / 30}
EXPECTED["force"] |= {"Nm": 1, "kNm": 1e3, "mNm": 1e-3, "mN·m": 1e-3}
EXPECTED["position"] |= {"urad": 1e-6, "nrad": 1e-9}
EXPECTED["velocity"] |= {"urad/s": 1e-6, "nrad/s": 1e-9}
EXPECTED["force"] |= {"uNm": 1e-6}
EXPECTED["normal"] = EXPECTED["force"]


@pytest.mark.parametrize("quantity", EXPECTED)
def test_every_unit_reads_as_its_si_value(quantity: str, tmp_path: Path) -> None:
    assert set(COLUMN_UNITS.get(quantity, ())) <= set(EXPECTED[quantity])
    values = np.arange(1.0, 7.0)
    for unit, size in EXPECTED[quantity].items():
        for spelt in (unit, f" {unit} "):
            assert factor(quantity, spelt, COLUMN_UNITS) == size
        columns = {"time": Column("t", "s"), quantity: Column("a", unit, sign=-1)}
        if quantity == "time":
            columns = {quantity: Column("a", unit)}
        text = table(["t", "a", "remark"], np.arange(6.0), values, values)
        (tmp_path / "own.csv").write_text(text.replace("1.0\n", "of run 1\n"))
        read_back = read_table(tmp_path / "own.csv", columns).columns[quantity]
        np.testing.assert_array_equal(read_back, size * values * (1 if quantity == "time" else -1))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("normal > 4.5 N", "normal > 4.5"),
        ("normal > 4500 mN", "normal > 4.5"),
        ("normal > 4.5e6 µN and time < 3 min", "normal > 4.5 and time < 180.0"),
        ("time > 2ms", "time > 0.002"),
        ("velocity > 2 mm/s", "velocity > 0.002"),
        ("velocity > .5 um/s", "velocity > 5e-07"),
        ("force > 1 and force < 2", "force > 1 and force < 2"),
        ("time < 1 or time > 2", "time < 1 or time > 2"),
        ("2 * force > 1", "2 * force > 1"),
    ],
)
def test_numbers_in_a_condition_are_converted(text: str, expected: str) -> None:
    def words(condition: str) -> list[object]:
        return [float(w) if w[0] in ".0123456789" else w for w in condition.split()]

    assert words(convert_numbers(text)) == [
        pytest.approx(word, rel=1e-12) if isinstance(word, float) else word
        for word in words(expected)
    ]


# --------------------------------------------------------------------------- selection
T = np.arange(20.0)
FORCE = np.where((T >= 5) & (T < 15), 5.0, 1.0)


@pytest.mark.parametrize(
    ("where", "kept"),
    [
        ("", range(20)),
        ("normal > 4.5 N", range(5, 15)),
        ("normal > 4.5e6 µN", range(5, 15)),
        ("normal > 4.5 N and time < 10 s", range(5, 10)),
        ("time < 5 s or time >= 15000 ms", [*range(5), *range(15, 20)]),
        ("not normal > 4.5 N", [*range(5), *range(15, 20)]),
        ("4 s <= time <= 9 s", range(4, 10)),
        ("abs(position - 10 mm) < 2.5 mm", [8, 9, 10, 11, 12]),
    ],
)
def test_where_chooses_rows(where: str, kept: range, tmp_path: Path) -> None:
    text = table(["t", "x", "N"], T, 1e-3 * T, FORCE)
    record = read(tmp_path, text, where, position=SI["position"], normal=SI["normal"])
    first, last = min(kept), max(kept)
    np.testing.assert_array_equal(record.columns["time"], T[first : last + 1])
    np.testing.assert_array_equal(record.columns["time"][record.chosen], list(kept))
    assert record.rows.min() == first + 2
    said = " ".join(record.notes)
    if where:
        assert f"{len(list(kept))} of 20 rows" in said
        assert f"rows {first + 2} to {last + 2}" in said
        assert where in said
    else:
        assert record.notes == ()


def test_gaps_are_noted_with_row_numbers(tmp_path: Path) -> None:
    t = np.arange(40) * 0.01
    t[20:] += 1.0
    t[30:] += 0.2
    record = read(tmp_path, table(["t", "x"], t, t), position=SI["position"])
    (note,) = record.notes
    assert "2 gap(s)" in note
    assert "rows 21, 31" in note  # the header is row 1
    assert "1.01 s" in note
    even = np.arange(40) * 0.01
    assert read(tmp_path, table(["t", "x"], even, even), position=SI["position"]).notes == ()
    cut = read(tmp_path, table(["t", "x"], t, t), "time > 0.095 s", position=SI["position"])
    assert "rows 21, 31" in " ".join(cut.notes)


# --------------------------------------------------------------------------- velocity
def amplitude(values: np.ndarray, pure: np.ndarray) -> float:
    """Return the gain of a filtered sine, away from the ends of the record."""
    inner = slice(len(pure) // 8, -len(pure) // 8)
    return float((values[inner] @ pure[inner]) / (pure[inner] @ pure[inner]))


@pytest.mark.parametrize(("tau", "shift"), [(0.01, 0.0), (0.05, 1.0)])
def test_the_smoothing_spline_halves_the_amplitude_where_it_says(tau: float, shift: float) -> None:
    t = np.arange(8000) * 0.002
    for omega, gain in ((0.1 / tau, 1.0), (1 / tau, 0.5), (2 / tau, 1 / 17)):
        pure = np.sin(omega * t)
        motion = motion_of(record_of(time=t, position=shift + 1e-3 * pure), tau)
        assert motion.smoothing == tau
        assert amplitude((motion.position - shift) / 1e-3, pure) == pytest.approx(gain, abs=2e-3)
        rate = 1e-3 * omega * np.cos(omega * t)
        assert amplitude(motion.velocity, rate) == pytest.approx(gain, abs=2e-3)


def test_the_note_states_time_constant_frequency_and_residual() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(4000) * 0.005
    noise = 2e-6 * rng.standard_normal(t.size)
    position = 1e-3 * np.sin(0.5 * np.pi * t) + noise
    motion = motion_of(record_of(time=t, position=position))  # of four intervals
    assert motion.smoothing == pytest.approx(0.02)
    (note,) = motion.notes
    assert "time constant 0.02 s" in note
    assert "7.96 Hz" in note  # 1 / (2 pi 0.02 s)
    left = float(note.partition("positions is ")[2].split()[0])
    assert left == pytest.approx(2e-6, rel=0.15)


@pytest.mark.parametrize("noise", [1e-7, 5e-6])
def test_the_velocity_of_a_noisy_sine_is_near_the_true_one(noise: float) -> None:
    rng = np.random.default_rng(3)
    dt, tau, omega, size = 0.005, 0.02, 0.5 * np.pi, 1e-3
    t = np.arange(4000) * dt
    position = size * np.sin(omega * t) + noise * rng.standard_normal(t.size)
    motion = motion_of(record_of(time=t, position=position), tau)
    error = (motion.velocity - size * omega * np.cos(omega * t))[50:-50]
    # White noise through i w / (1 + (w tau)^4): its variance is noise^2 dt sqrt(2) / (16 tau^3)
    expected = noise * np.sqrt(np.sqrt(2) / 16 * dt / tau**3)
    assert float(np.std(error)) == pytest.approx(expected, rel=0.15)
    raw = np.gradient(position, t)[50:-50] - (size * omega * np.cos(omega * t))[50:-50]
    assert np.std(error) < 0.2 * np.std(raw)


def test_without_smoothing_the_spline_goes_through_the_positions() -> None:
    t = np.arange(400) * 0.005
    position = 1e-3 * np.sin(8 * t)
    motion = motion_of(record_of(time=t, position=position), 0.0)
    np.testing.assert_allclose(motion.position, position, atol=1e-12)
    np.testing.assert_allclose(motion.velocity[5:-5], 8e-3 * np.cos(8 * t)[5:-5], atol=1e-6)


def test_a_measured_velocity_is_used_unchanged_unless_it_is_smoothed() -> None:
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.005, 0.015, 300))
    velocity = rng.standard_normal(t.size)
    motion = motion_of(record_of(time=t, velocity=velocity))
    np.testing.assert_array_equal(motion.velocity, velocity)
    np.testing.assert_array_equal(motion.time, t)
    assert motion.smoothing == 0.0
    assert motion.notes == ("velocity: as measured",)
    expected = cumulative_trapezoid(velocity, t, initial=0.0)
    np.testing.assert_allclose(motion.position, expected, atol=1e-12)
    pure = np.sin(np.arange(2000) * 0.1)
    smooth = motion_of(record_of(time=np.arange(2000) * 0.005, velocity=pure), 0.05)
    assert amplitude(smooth.velocity, pure) == pytest.approx(0.5, abs=2e-3)
    assert "0.05 s" in smooth.notes[0]


# --------------------------------------------------------------------------- standstill
def dwelling(noise: float, top: float = 1e-3) -> Motion:
    """Return a motion back and forth with dwells, and white noise on the velocity."""
    rng = np.random.default_rng(5)
    cycle = np.repeat([top, 0.0, -top, 0.0], 200)
    velocity = np.tile(cycle, 6)
    velocity = velocity + noise * rng.standard_normal(velocity.size)
    return motion_of(record_of(time=0.01 * np.arange(velocity.size), velocity=velocity))


@pytest.mark.parametrize("noise", [1e-7, 5e-6, 1e-4])
def test_the_noise_at_standstill_is_found(noise: float) -> None:
    assert dwelling(noise).standstill == pytest.approx(noise, rel=0.15)


def test_without_noise_or_dwells_there_is_none() -> None:
    assert dwelling(0.0).standstill == 0.0
    assert dwelling(0.0).fitting_v_c() == 0.0
    steady = motion_of(record_of(time=T, velocity=np.ones(20)))
    assert steady.standstill == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("per_cycle", [100, 5000])
def test_a_slow_reversal_is_not_noise(per_cycle: int) -> None:
    """A clean sine never stands still, however densely it is sampled."""
    phase = 2 * np.pi * np.arange(4 * per_cycle) / per_cycle
    motion = motion_of(record_of(time=0.001 * np.arange(phase.size), velocity=np.sin(phase)))
    assert motion.standstill < 1e-3


@pytest.mark.parametrize(
    ("standstill", "expected"),
    [(1e-6, 3e-6), (1.1e-6, 4e-6), (3e-6, 9e-6), (3.2e-6, 1e-5), (5e-5, 2e-4), (0.0, 0.0)],
)
def test_a_fitting_v_c_is_three_times_the_noise_rounded_up(
    standstill: float, expected: float
) -> None:
    motion = Motion(T, T, T, 0.0, standstill)
    assert motion.fitting_v_c() == pytest.approx(expected, rel=1e-12, abs=0)
    assert motion.fitting_v_c() >= 3 * standstill * (1 - 1e-12)


def _noisy_scenario(tmp_path: Path, v_c: str) -> Path:
    motion = dwelling(5e-6)
    text = changed(
        MEASURED,
        'position = { column = "x", unit = "mm" }',
        'velocity = { column = "v", unit = "mm/s" }',
    )
    text = changed(text, "v_c = 1e-4", f"v_c = {v_c}")
    (tmp_path / "noisy.toml").write_text(text)
    force = np.tanh(motion.velocity / 1e-4)
    (tmp_path / "own.csv").write_text(
        table(["t", "v", "F"], motion.time, 1e3 * motion.velocity, force)
    )
    return tmp_path / "noisy.toml"


@pytest.mark.matrix
@pytest.mark.slow
def test_the_command_line_warns_of_a_v_c_below_the_noise_and_suggests_one(
    gms_fsm: CommandLine, tmp_path: Path
) -> None:
    done = gms_fsm("run", _noisy_scenario(tmp_path, "1e-6"), "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert done.err.count("v_c = 1e-06 m/s is below the velocity noise") == 1
    suggested = f"v_c = {dwelling(5e-6).fitting_v_c():.2g} m/s would suit"
    assert suggested in done.err
    summary = (tmp_path / "out" / "summary.md").read_text()
    assert suggested in summary
    assert "Parameters not identifiable from this record" in summary
    done = gms_fsm(
        "run", _noisy_scenario(tmp_path, repr(dwelling(5e-6).fitting_v_c())), "-o", "good"
    )
    assert done.code == 0, done.err
    assert "v_c" not in done.err
    assert "velocity noise" not in (tmp_path / "good" / "summary.md").read_text()
