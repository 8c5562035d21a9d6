"""The error in a chart file names file, line, key, text and column, and what to do."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from gms_fsm import Chart
from gms_fsm.errors import ChartError, ExpressionError, GMSError, ParameterError

TEXT = """\
name = "stiction"
parameters = ["F_c", "F_s"]

[let]
level = "F_c * sgn(v)"

[[state]]
name = "stuck"
locked = true

[[state]]
name = "slip"
outputs.F = "level"

[[edge]]
name = "release"
from = "stuck"
to = "slip"
guard = "F > F_s"

[[edge]]
name = "arrest"
from = "slip"
to = "stuck"
guard = "v < 0"
do.v = "0"
"""
PLAIN = 'parameters = ["F_c", "F_s"]'
TABLES = """\
[[parameter]]
name = "F_c"
[[parameter]]
name = "F_s"
rule = ">= F_x"
"""
CASES = {
    "an unknown name": ("F > F_s", "F > F_k", 19, "edge.0.guard", "unknown name 'F_k'"),
    "an unknown state": ('to = "stuck"', 'to = "stick"', 24, "edge.1.to", "is not a state"),
    "a loop": ('"level"', '"F"', 13, "state.1.outputs.F", "an algebraic loop"),
    "a let": ('"F_c * sgn(v)"', '"F_c * (v"', 5, "let.level", "column"),
    "an action": ('do.v = "0"', 'do.q = "0"', 26, "edge.1.do.q", "is not a variable"),
    "a name used twice": ('"arrest"', '"release"', 22, "edge.1.name", "used twice"),
    "no force": ('outputs.F = "level"\n', "", 11, "state.1", "no output 'F'"),
    "a force of a locked state": (
        "locked = true",
        'locked = true\noutputs.F = "1"',
        10,
        "state.0.outputs.F",
        "it is locked",
    ),
    "an unknown key": ("guard", "gard", 19, "edge.0.gard", "did you mean 'guard'?"),
    "a wrong type": ("locked = true", "locked = 1", 9, "state.0.locked", "valid boolean"),
    "a missing key": ('to = "slip"\n', "", 15, "edge.0.to", "is missing"),
    "an unknown table": ("[[state]]", "[[stat]]", 7, "stat", "did you mean 'state'?"),
    "a bad name": ('"slip"\nout', '"is_x"\nout', 12, "state.1.name", "is reserved"),
    "a rule": (PLAIN, TABLES, 6, "parameter.1.rule", "not another parameter"),
    "both kinds of parameters": (
        PLAIN,
        PLAIN + "\n[[parameter]]\nname = 'k'",
        1,
        "",
        "give only one of them",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_the_line_and_the_key_are_named(case: str, tmp_path: Path) -> None:
    old, new, line, key, reason = CASES[case]
    path = tmp_path / "own.toml"
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises((ChartError, ExpressionError)) as caught:
        Chart.load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: line {line}")
    assert key in message
    assert reason in message


def test_the_text_and_the_column_are_shown(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(TEXT.replace("F > F_s", "F > F_k"), encoding="utf-8")
    with pytest.raises(ExpressionError) as caught:
        Chart.load(path)
    assert (caught.value.text, caught.value.column) == ("F > F_k", 5)
    assert str(caught.value).endswith("\n    F > F_k\n        ^")
    assert "chart 'stiction', edge 'release', guard" in str(caught.value)


def test_the_chart_itself_is_sound(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(TEXT, encoding="utf-8")
    assert [edge.name for edge in Chart.load(path).transitions] == ["release", "arrest"]


HOSTILE = {
    "nothing": b"",
    "no TOML": b"name = ",
    "no text": b"\xff\xfe",
    "endless key": b".".join([b"a"] * 500) + b" = 1",
    "a long array": b'name = "a"\nstate = [\n' + b"{},\n" * 4_000 + b"]\nq = 1\n",
    "too large": b"#" * 1_100_000,
    "deep": b"name = " + b"[" * 5000,
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_files_are_refused_at_once(case: str, tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_bytes(HOSTILE[case])
    begin = time.process_time()
    with pytest.raises(ChartError, match=r"own\.toml"):
        Chart.load(path)
    assert time.process_time() - begin < 10.0


def test_what_is_no_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ChartError, match="no such file"):
        Chart.load(tmp_path / "none.toml")
    with pytest.raises(ChartError, match="cannot be read"):
        Chart.load(tmp_path)
    with pytest.raises(ChartError, match="cannot be read"):
        Chart.load("a\0b.toml")
    with pytest.raises(ParameterError, match="a path"):
        Chart.load(5)  # type: ignore[arg-type]
    with pytest.raises(GMSError, match="a text"):
        Chart(5, states=(), outputs={})  # type: ignore[arg-type]
