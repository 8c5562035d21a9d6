"""Every shipped scenario runs to its end, writes its report, and its trace reads back equal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import GMS, Trace
from gms_fsm.app._tables import Scenario
from gms_fsm.app.report import compare, measured_force, plain, run_scenario
from gms_fsm.app.scenario import Loaded, load_scenario
from gms_fsm.charts.registry import registered
from gms_fsm.foundation.files import LIST
from gms_fsm.scenarios import FOLDER, scenario_path, shipped
from tests.corpus import OF_SCIPY
from tests.helpers import FASTEST, other_parts, same_bits
from tests.scenario_files import CommandLine, data_folder

pytestmark = pytest.mark.slow

TRANSITIONS = {  # of the shipped scenarios, where a change would be one of the physics
    "ball_screw_table": 312,
    "belt_driven_mass": 124,
    "bowed_string": 45,
    "brake_squeal": 54,
    "chair_squeak": 37,
    "door_hinge": 3,
    "drill_string": 25,
    "earthquake": 0,
    "friction_damper": 278,
    "two_blocks_on_a_belt": 51,
    "paper_fig3_non_drifting": 0,
    "pulled_mass": 28,
    "robot_joint": 40,
    "stribeck_sweep": 4,
}
SHIPPED = [*shipped()]
DRAWN = ("pulled_mass", "brake_squeal", "tribometer")  # the others without their pictures


@pytest.fixture(autouse=True)
def _figures() -> None:
    pytest.importorskip("matplotlib", reason="the figures need the extra 'plots'")


def check_report(loaded: Loaded, trace: Trace, files: list[Path], *, drawn: bool) -> None:
    """Check what every report contains."""
    folder = files[0].parent
    assert {*files, folder / LIST} == set(folder.iterdir())
    assert files[0] == folder / "summary.md"
    contacts = trace.contacts
    several = len(contacts) > 1
    pictures = {
        f"overview-{contact}.{end}" if several else f"overview.{end}"
        for contact in contacts
        for end in ("png", "svg")
    }
    names = {path.name for path in files}
    assert {"summary.md", "trace.npz", "transitions.csv"} <= names
    assert names & pictures == (pictures if drawn else set())
    for path in files:
        if path.suffix == ".png":
            assert path.read_bytes().startswith(b"\x89PNG")
        if path.suffix == ".svg":
            assert b"</svg>" in path.read_bytes()[-20:]
    read_back = Trace.load(folder / "trace.npz")
    assert other_parts(read_back, trace) == []
    assert read_back.settings == trace.settings
    assert read_back.heading == trace.heading == loaded.scenario.title
    log = (folder / "transitions.csv").read_text(encoding="utf-8")
    assert log == trace.transitions_csv()
    assert log.count("\n") == len(trace.transitions) + 1
    summary = files[0].read_text(encoding="utf-8")
    assert summary.startswith(f"# {loaded.title}\n")
    assert plain(loaded.scenario.notes.strip()) in summary
    assert f"{len(trace.transitions)} transitions" in summary
    for contact in contacts:
        title = trace.contact(contact).model.title
        assert f"## Contact {contact}" in summary or f"{title}" in summary
    if loaded.scenario.__class__ is Scenario and isinstance(loaded.model, GMS):
        assert "law" in trace.model.title
        assert "weights = [" in summary
        assert "| element | stick [s] | slip [s] | break_away_forward |" in summary


@pytest.mark.every(2)
@pytest.mark.parametrize("name", sorted({*SHIPPED} - {"tribometer"}))
def test_a_shipped_scenario_runs(name: str, tmp_path: Path) -> None:
    drawn = name in DRAWN
    changes = [] if name in OF_SCIPY else [f"run.engine={FASTEST!r}"]
    changes += [] if drawn else ["output.figures=[]"]
    loaded = load_scenario(name, changes)
    trace, files = run_scenario(loaded, tmp_path / "out")
    check_report(loaded, trace, files, drawn=drawn)
    assert trace.t[-1] == loaded.arguments["t_end"]
    assert loaded.title != name
    assert len(trace.transitions) == TRANSITIONS.get(name, len(trace.transitions))


def test_a_second_run_replaces_the_first_by_the_same(tmp_path: Path) -> None:
    contents = []
    for _ in range(2):
        run_scenario(load_scenario("nested_reversals", ["output.figures=[]"]), tmp_path / "out")
        contents.append({file.name: file.read_bytes() for file in (tmp_path / "out").iterdir()})
    assert contents[0].keys() == contents[1].keys()
    for name in ("summary.md", "transitions.csv"):
        assert contents[0][name] == contents[1][name]


@pytest.mark.matrix
def test_figures_and_csv_are_written_as_requested(tmp_path: Path) -> None:
    wanted = ['output.figures=["png", "pdf"]', "output.csv=true", "output.every=0.5"]
    trace, files = run_scenario(load_scenario("stribeck_sweep", wanted), tmp_path)
    names = {file.name for file in files}
    assert {"overview.png", "overview.pdf", "trace.csv"} <= names
    assert {Path(name).suffix for name in names} == {".md", ".npz", ".csv", ".png", ".pdf"}
    assert trace.t.tolist() == [0.5 * i for i in range(93)]
    same_bits(Trace.load(tmp_path / "trace.csv"), trace)


def test_without_figures_nothing_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a run without matplotlib does not warn of an unwanted figure."""
    drawn: list[object] = []
    monkeypatch.setattr("plots.figures.overview", lambda *given, **_: drawn.append(given))
    loaded = load_scenario("stribeck_sweep", ["output.figures=[]"])
    _, files = run_scenario(loaded, tmp_path)
    assert {file.name for file in files} == {"summary.md", "trace.npz", "transitions.csv"}
    assert not drawn


# --------------------------------------------------------------------------- the tribometer
@pytest.mark.matrix
def test_the_tribometer_explains_the_measurement_and_shows_its_loops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The overview has the measured loops and those of the model in one panel."""
    from plots import figures

    monkeypatch.setenv("GMS_FSM_DATA", str(data_folder()))
    loaded = load_scenario("tribometer", [f"run.engine={FASTEST!r}"])
    trace, files = run_scenario(loaded, tmp_path / "out")
    check_report(loaded, trace, files, drawn=True)
    assert loaded.record is not None
    assert loaded.motion is not None
    np.testing.assert_array_equal(trace.t, loaded.motion.time)
    assert len(trace.transitions) > 700  # 50 cycles of four elements, both ways
    record = loaded.record
    assert (record.columns["normal"][record.chosen] > 4.5).all()
    found = compare(trace, record)
    assert found is not None
    assert found.r2 >= 0.95
    assert found.r2 == pytest.approx(0.995, abs=0.002)
    assert found.rows == record.chosen.sum() > 40_000
    force = record.columns["force"][record.chosen]
    error = force - trace.F[record.chosen]
    assert found.r2 == pytest.approx(1 - np.mean(error**2) / force.var(), rel=1e-9)
    summary = files[0].read_text(encoding="utf-8")
    assert f"R² = {found.r2:.4f}" in summary
    assert plain("where = 'normal > 4.5 N'") in summary
    assert "time constant 0.02 s" in summary
    doubts = summary.partition("### Parameters not identifiable from this record")[2]
    for said in ("Stribeck", "F_s, v_s and sigma_2", "C:", "sigma_i"):
        assert said in doubts, said
    assert "velocity noise" not in doubts  # the v_c of the scenario is above it
    times, force = measured_force(loaded.record)
    measured = figures.Measured(times, loaded.motion.position[loaded.record.chosen], force)
    first, *axes = figures.overview(trace, measured).axes
    (panel,) = [ax for ax in axes if ax.get_title("left") == "friction over position"]
    model, data = panel.lines
    begin, end = first.get_xlim()
    assert len(data.get_xdata()) == ((times >= begin) & (times <= end)).sum() > 2000
    for line in (model, data):  # 228 µm to and fro, +-2.3 N, one on the other
        assert np.ptp(line.get_xdata()) == pytest.approx(230, abs=10)
        assert np.ptp(line.get_ydata()) == pytest.approx(4.8, abs=0.4)


def test_a_cycle_is_searched_as_the_scenario_runs(gms_fsm: CommandLine) -> None:
    few = gms_fsm("cycle", "bowed_string", "--set", "run.max_steps=10")
    assert few.code == 2
    assert "10 steps" in few.err
    jumps = gms_fsm("cycle", "bowed_string", "--set", "run.events=step", "--set", "run.step=1e-4")
    assert jumps.code == 2
    assert "not located" in jumps.err


# --------------------------------------------------------------------------- by name
def test_scenarios_are_listed_with_their_titles(gms_fsm: CommandLine) -> None:
    rows = gms_fsm("run", "--list").out.splitlines()
    assert [row.split()[0] for row in rows] == SHIPPED
    assert rows[SHIPPED.index("servo")].endswith("  Servo with friction on the load")


def test_a_copy_is_the_file_and_no_file_is_written_over(gms_fsm: CommandLine) -> None:
    assert gms_fsm("copy", "servo").out == "servo.toml; run it with: gms-fsm run servo.toml\n"
    text = Path("servo.toml").read_text(encoding="utf-8")
    assert text == (FOLDER / "servo.toml").read_text(encoding="utf-8")
    Path("servo.toml").write_text("mine")
    assert gms_fsm("copy", "servo").code == 2
    assert Path("servo.toml").read_text() == "mine"


def test_a_file_goes_before_a_scenario_of_its_name_and_a_folder_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("servo").mkdir()
    assert scenario_path("servo") == FOLDER / "servo.toml"
    Path("pulled_mass").write_text("")
    assert scenario_path("pulled_mass") == Path("pulled_mass")


def test_no_scenario_has_the_name_of_a_chart() -> None:
    assert not {*SHIPPED} & {*registered()}
