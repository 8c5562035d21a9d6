"""``gms-fsm cover`` says what runs never took; counts of several calls add up in a file."""

from __future__ import annotations

import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from gms_fsm import Coverage, coverage, sweep
from gms_fsm.app.scenario import load_scenario
from gms_fsm.app.verbs.cover import added
from tests import own_files
from tests.scenario_files import OPEN_LOOP, CommandLine

BACK = "rig.velocity=-2.0"
FORTH = "rig.velocity=2.0"


@pytest.fixture
def cover(gms_fsm: CommandLine) -> CommandLine:
    Path("a.toml").write_text(OPEN_LOOP)
    return lambda *arguments: gms_fsm("cover", *arguments)


def counted(*changes: str) -> Coverage:
    return coverage(load_scenario("a.toml", changes).simulate())


def test_it_prints_the_coverage_of_the_run(cover: CommandLine) -> None:
    answer = cover("a.toml", "--set", FORTH)
    assert (answer.code, answer.err) == (0, "")
    assert answer.out == f"{counted(FORTH)}\n"
    assert "never taken:\n  break_away_backward from stick: `z <= -s` was never" in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80


def test_several_scenarios_count_together(cover: CommandLine) -> None:
    Path("b.toml").write_text(OPEN_LOOP)
    answer = cover("a.toml", "b.toml", "--set", FORTH)
    assert answer.out == f"{counted(FORTH) + counted(FORTH)}\n"
    assert answer.out.startswith("2 runs of ")


def test_a_saved_run_counts_as_it_did(cover: CommandLine) -> None:
    load_scenario("a.toml", [FORTH]).simulate().save("run.npz")
    assert cover("run.npz").out == f"{counted(FORTH)}\n"


def test_counts_of_several_calls_add_up(cover: CommandLine) -> None:
    for change in (FORTH, BACK, FORTH):
        answer = cover("a.toml", "--set", change, "--merge", "counts.json")
        assert (answer.code, answer.err) == (0, "")
    total = Coverage.merged([counted(FORTH), counted(BACK), counted(FORTH)])
    assert Coverage.load("counts.json") == total
    assert answer.out == f"{total}\ncounts.json\n"


def test_of_a_system_one_contact_can_be_told(cover: CommandLine) -> None:
    own_files.write(Path())
    whole = coverage(load_scenario("pair.toml").simulate())
    answer = cover("pair.toml", "--contact", "gear")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out == f"{Coverage({'gear': whole.contact('gear')})}\n"


@pytest.mark.parametrize(("wanted", "code"), [("0", 0), ("15", 0), ("90", 1)])
def test_the_exit_code_says_if_the_lowest_score_is_too_low(
    cover: CommandLine, wanted: str, code: int
) -> None:
    answer = cover("a.toml", "--set", FORTH, "--fail-under", wanted, "--merge", "counts.json")
    assert answer.code == code
    name, percent = counted(FORTH).lowest
    assert 15 < percent < 90
    said = f"the lowest is {name}: {percent:.1f} %, below {wanted} %"
    assert (said in answer.out) == bool(code)
    assert Path("counts.json").exists()  # what was counted is kept


@pytest.mark.parametrize("wanted", ["101", "-1", "much"])
def test_a_share_is_between_0_and_100(cover: CommandLine, wanted: str) -> None:
    answer = cover("a.toml", "--fail-under", wanted)
    assert answer.code == 2
    assert "--fail-under" in answer.err


@pytest.mark.slow
def test_a_grid_of_runs_counts_with_its_clauses(cover: CommandLine) -> None:
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    answer = cover("a.toml", "--over", "F_s=1.5:2:3")
    loaded = load_scenario("a.toml")
    options = {name: each for name, each in loaded.arguments.items() if name in ("initial",)}
    swept = sweep(
        loaded.model,
        loaded.rig,
        loaded.arguments["t_end"],
        {"F_s": [1.5, 1.75, 2.0]},
        coverage=True,
        **options,
    )
    assert answer.out == f"{coverage(swept)}\n"
    assert answer.out.startswith("3 runs of ")
    assert "MC/DC" in answer.out


def test_a_run_that_fails_counts_as_far_as_it_came(cover: CommandLine) -> None:
    answer = cover("a.toml", "--set", "run.max_steps=5")
    assert answer.code == 0
    assert answer.out.startswith("1 run of ")
    assert "counts as far as it came" in " ".join(answer.err.split())
    assert ".trace" not in answer.err


def test_the_picture_is_of_the_counts(cover: CommandLine) -> None:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")
    answer = cover("a.toml", "--set", FORTH, "-o", "chart.svg")
    assert (answer.code, answer.out.splitlines()[-1]) == (0, "chart.svg")
    assert "never taken" in Path("chart.svg").read_text(encoding="utf-8")


def test_a_word_that_is_meant_is_named(gms_fsm: CommandLine) -> None:
    assert "Did you mean 'cover'?" in gms_fsm("coverage", "a.toml").err


@pytest.mark.slow
def test_generated_motions_are_files_that_count_the_same(cover: CommandLine) -> None:
    answer = cover("dog-clutch", "--generate", "-o", "out", "--seed", "3", "--bounds", "load=-1..1")
    assert answer.code == 0, answer.err
    told, files = answer.out.split("(SI units); seed 3\n")
    assert told.startswith("6 runs of Dog clutch\n")
    paths = files.splitlines()
    assert paths == [str(Path("out", f"motion_{i:02}.toml")) for i in range(1, 7)]
    assert "load -1..1 " in told
    again = cover(*paths).out.splitlines()
    assert [line for line in again if "%" in line] == [
        line for line in told.splitlines() if "%" in line and not line.startswith("pairs")
    ]


def test_motions_are_made_for_a_file_of_ones_own(cover: CommandLine) -> None:
    own_files.write(Path())
    answer = cover("pair.toml", "--contact", "gear", "--generate", "--fail-under", "100")
    assert answer.code == 0, answer.err
    assert "not taken" not in answer.out


@pytest.mark.matrix
def test_a_short_share_of_generated_motions_is_told(cover: CommandLine) -> None:
    answer = cover("backlash", "--generate", "--bounds", "v=0..1", "--fail-under", "100")
    assert answer.code == 1
    assert "below 100 %" in answer.out
    assert "  open    touch_left from apart: not proved, and not reached by" in answer.out


@pytest.mark.skipif(sys.platform == "win32", reason="nothing is locked on Windows")
def test_several_calls_at_once_lose_no_counts(cover: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "counts.json"
    one = counted(FORTH)
    with ThreadPoolExecutor(4) as pool:
        for _ in pool.map(lambda _: added(one, path), range(12)):
            pass
    assert Coverage.load(path) == Coverage.merged([one] * 12)
    assert [each.name for each in tmp_path.iterdir() if "counts" in each.name] == ["counts.json"]
