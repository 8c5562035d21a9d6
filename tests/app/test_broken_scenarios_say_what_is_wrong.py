"""A scenario that breaks leaves what was there before it, and the rows it had computed.

What is refused is in `tests/refusals.py`; here: exit code 2, one line, and the files.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from gms_fsm import Trace
from gms_fsm.app.scenario import load_scenario
from gms_fsm.foundation.files import LIST
from tests.scenario_files import (
    OPEN_LOOP,
    CommandLine,
    changed,
    nothing_written,
    one_message,
    sine_table,
)


def test_a_file_of_1_GB_is_not_read(gms_fsm: CommandLine, tmp_path: Path) -> None:
    with (tmp_path / "huge.toml").open("wb") as file:
        file.truncate(10**9)
    answer = gms_fsm("run", tmp_path / "huge.toml", "-o", tmp_path / "out")
    one_message(answer, "huge.toml", "larger than 1000000 bytes")
    nothing_written(tmp_path, {"huge.toml"})


def test_an_earlier_result_survives_a_broken_file(gms_fsm: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "good.toml").write_text(OPEN_LOOP)
    (tmp_path / "broken.toml").write_text(changed(OPEN_LOOP, "t_end = 1.0", "t_end = -1.0"))
    assert gms_fsm("run", tmp_path / "good.toml", "-o", tmp_path / "out").code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    assert gms_fsm("run", tmp_path / "broken.toml", "-o", tmp_path / "out").code == 2
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before


@pytest.mark.parametrize(
    ("velocity", "reached", "why"),
    [
        ("0.1*sqrt(0.5 - t)", 0.4, "not finite"),
        ("exp(1000*t)", 0.6, "not finite"),
        ("9**9**9**9*t", 0.0, "not finite"),
        ("0.1/(t - 0.5)", 0.4, "step size"),
    ],
)
def test_a_run_that_fails_midway_keeps_its_part(
    velocity: str, reached: float, why: str, gms_fsm: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "fails.toml").write_text(changed(OPEN_LOOP, "0.1*sin(t)", velocity))
    answer = gms_fsm("run", tmp_path / "fails.toml", "-o", tmp_path / "out")
    one_message(answer, "fails.toml", why, "t = ", "partial.npz")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"partial.npz", LIST}
    part = Trace.load(tmp_path / "out" / "partial.npz")
    assert len(part) == 0 or reached <= part.t[-1] < 1.0


def test_a_measured_signal_that_is_too_short_keeps_its_part(
    gms_fsm: CommandLine, tmp_path: Path
) -> None:
    signal = '{ file = "own.csv", time = { column = "t", unit = "s" }, value = { column = "x", '
    text = changed(OPEN_LOOP, '"0.1*sin(t)"', signal + 'unit = "mm/s" } }')
    (tmp_path / "short.toml").write_text(text)
    (tmp_path / "own.csv").write_text(sine_table(60))
    answer = gms_fsm("run", tmp_path / "short.toml", "-o", tmp_path / "out")
    one_message(
        answer, "short.toml", "a sampled signal at t = 0.59 s", "t_end = 1.0", "partial.npz"
    )
    assert Trace.load(tmp_path / "out" / "partial.npz").t[-1] == 0.59


def test_dots_in_texts_and_numbers_are_not_keys(tmp_path: Path) -> None:
    numbers = ", ".join(f"[{i}.5, 0.1]" for i in range(100))
    text = changed(OPEN_LOOP, '"0.1*sin(t)"', f"[{numbers}]")
    text = changed(text, '"open loop"', '"1. Here. And so on ... e.g. v.i.z. a.b.c/d.e.f"')
    (tmp_path / "a.toml").write_text(text)
    assert load_scenario(tmp_path / "a.toml").title.startswith("1. Here.")


def test_a_formula_may_begin_with_a_point(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(OPEN_LOOP)
    assert load_scenario(tmp_path / "a.toml", ["rig.velocity=.5*sin(t)"]).rig.signals["v"]


@pytest.mark.parametrize("change", [("t_end = 1.0", "t_end = -1.0"), ("sin(t)", "sqrt(0.5 - t)")])
def test_the_message_begins_its_own_line_after_the_progress_bar(
    change: tuple[str, str], gms_fsm: CommandLine
) -> None:
    Path("broken.toml").write_text(changed(OPEN_LOOP, *change))
    answer = gms_fsm("run", "broken.toml", "-o", "out")
    assert answer.code == 2
    assert "Traceback" not in answer.err
    assert [line for line in answer.err.splitlines() if line.startswith("error: broken.toml")]
    assert answer.err.count("error:") == 1
    assert answer.out == ""


@pytest.mark.filterwarnings("default:published law")
def test_a_warning_of_a_scenario_is_printed_once(gms_fsm: CommandLine) -> None:
    text = changed(OPEN_LOOP, '"signed"', '"published"')
    Path("warns.toml").write_text(changed(text, "F_s = 1.5", "F_s = 1.0"))
    answer = gms_fsm("run", "warns.toml", "-o", "out")
    assert answer.code == 0, answer.err
    assert answer.err.count("never arrests") == 1
