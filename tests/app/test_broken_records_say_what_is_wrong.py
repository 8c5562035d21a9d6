"""A broken record gives one message with file, row, column, value and rule; nothing is written.

Exit code 2, no traceback. Only a record that ends before the run keeps the part it covers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Trace
from gms_fsm._files import LIST
from tests.scenario_files import (
    MEASURED,
    CommandLine,
    changed,
    nothing_written,
    one_message,
    sine_table,
    table,
)

GOOD = sine_table()
LINES = GOOD.splitlines()
EVEN = np.arange(60) * 0.01


def row(number: int, text: str) -> bytes:
    """Return the good table with one row replaced; the header is row 1."""
    return "\n".join([*LINES[: number - 1], text, *LINES[number:]]).encode() + b"\n"


# fault -> bytes of the record, and what the message must contain besides the file
CONTENTS: dict[str, tuple[bytes, tuple[str, ...]]] = {
    # cells
    "text in a number column": (
        row(5, "0.03,abc,1"),
        ("row 5", "column 'x'", "'abc'", "number", "where = "),
    ),
    "an empty cell": (row(5, "0.03,,1"), ("row 5", "column 'x'", "''", "number")),
    "a unit in a cell": (row(5, "0.03,1 mm,1"), ("row 5", "column 'x'", "'1 mm'", "number")),
    "a hexadecimal number": (row(5, "0x3,1,1"), ("row 5", "column 't'", "'0x3'", "number")),
    "a number as programs write it": (row(5, "0.0_3,1,1"), ("row 5", "column 't'", "'0.0_3'")),
    "NaN in the position": (row(5, "0.03,nan,1"), ("row 5", "column 'x'", "finite", "where")),
    "NaN in the force": (row(5, "0.03,1,NaN"), ("row 5", "column 'F'", "finite", "where")),
    "NaN in the time": (row(5, "nan,1,1"), ("row 5", "column 't'", "finite")),
    "infinity": (row(60, "0.58,-inf,1"), ("row 60", "column 'x'", "finite")),
    "a number too big": (row(5, "0.03,1e400,1"), ("row 5", "column 'x'", "finite")),
    "many NaN": (
        "\n".join([LINES[0], *(f"{i},nan,1" for i in range(20))]).encode(),
        ("rows 2, 3, 4, 5, 6 and 15 more", "column 'x'", "finite"),
    ),
    # rows
    "a row that is too short": (row(5, "0.03,1"), ("row 5", "2 cells", "3", "delimiter = ")),
    "a row that is too long": (row(5, "0.03,1,2,3"), ("row 5", "4 cells", "3")),
    "an empty row": (row(5, ""), ("row 5", "empty")),
    "an empty row between two tables": (GOOD.encode() + b"\n\n1,1,1\n", ("row 62", "empty")),
    "decimal commas": (
        GOOD.replace(",", ";").replace(".", ",").replace("t;", "t;", 1).encode(),
        ("row 2", "column 't'", "'0,0'", 'give decimal = ","'),
    ),
    "decimal commas between commas": (GOOD.replace(".", ",").encode(), ("row 2", "6 cells", "3")),
    "a remark below": (GOOD.encode() + b"the end\n", ("row 62", "1 cells", "3")),
    "a quote that never closes": (row(5, '"0.03,1,1'), ("row 5",)),
    "a quote that never closes, and a long file": (
        row(5, '"0.03,1,1') + b"0,0,0\n" * 50_000,
        ("row 5", "field"),
    ),
    # time
    "time that goes backward": (
        row(10, "0.01,1,1"),
        ("after row 9", "0.07", "0.01", "does not increase"),
    ),
    "time that stands still": (row(10, "0.07,1,1"), ("after row 9", "0.07", "does not increase")),
    "time that falls all along": (
        table(["t", "x", "F"], -EVEN, EVEN, EVEN).encode(),
        ("after rows 2, 3, 4, 5, 6 and 54",),
    ),
    # heads
    "a missing column": (
        b"t,pos,F\n0,0,0\n1,1,1\n",
        ("no column 'x'", "'t', 'pos', 'F'", "position = {"),
    ),
    "columns divided by /": (
        GOOD.replace(",", "/").encode(),
        ("no column 't'", "'t/x/F'", "delimiter = "),
    ),
    "a column twice": (b"t,x,F,x\n0,0,0,0\n1,1,1,1\n", ("several columns 'x'",)),
    "no head line": (GOOD.partition("\n")[2].encode(), ("no column 't'", "'0.0'")),
    "units that contradict the scenario": (
        row(2, "[ms],[mm],[N]"),
        ("row 2", "'ms'", "column 't'", "time is read in 's'"),
    ),
    "words in the second line": (row(2, "a,b,c"), ("row 2", "column 't'", "'a'", "number")),
    # sizes
    "an empty file": (b"", ("the file is empty", "column names")),
    "empty lines only": (b"\n \n", ("the file is empty", "column names")),
    "a head line only": (b"t,x,F\n", ("0 row(s)", "at least")),
    "one row": (b"t,x,F\n0,0,0\n", ("1 row(s)", "at least")),
    "four rows": (b"t,x,F\n0,0,0\n1,1,1\n2,2,2\n3,3,3\n", ("4 rows", "at least 5")),
    "a line of 2 MB": (b"t,x,F\n0,0," + b"1" * 2_000_000 + b"\n", ("line 2", "longer than 100000")),
    "a head line of 2 MB": (b"t" * 2_000_000, ("line 1", "longer than 100000")),
    "a line of 2 MB far down": (
        GOOD.encode() + b"7" * 2_000_000,
        ("line 62", "longer than 100000"),
    ),
    # not a text table
    "binary": (bytes(range(256)) * 50, ("line 1", "binary")),
    "a zero byte in a row": (row(5, "0.03,\0,1"), ("line 5", "binary")),
    "UTF-16 without a mark": (GOOD.encode("utf-16-le"), ("line 1", "binary", "utf-16-le")),
    "UTF-16 cut short": (GOOD.encode("utf-16")[:-1], ("a line after", "utf-16", "encoding = ")),
    "Latin-1": (GOOD.replace("F", "µ", 1).encode("latin-1"), ("line 1", "UTF-8", "cp1252")),
    "a picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", ("line 1", "UTF-8")),
    "an archive": (b"PK\x03\x04\x14\0\x06\0", ("line 1", "binary")),
}

# fault -> (old, new) text of the scenario, and what the message must contain
TABLES: dict[str, tuple[tuple[str, str], tuple[str, ...]]] = {
    "an unknown unit": (
        ('"mm"', '"furlong"'),
        ("broken.toml", "record", "'furlong'", "m, cm, mm, um, nm, in"),
    ),
    "a unit of something else": (
        ('"mm"', '"ms"'),
        ("broken.toml", "record", "'ms'", "time", "position", "m, cm, mm"),
    ),
    "a unit in capitals": (('"mm"', '"MM"'), ("broken.toml", "'MM'", "m, cm, mm")),
    "no unit": ((', unit = "mm"', ""), ("broken.toml", "record.position.unit is missing")),
    "a typo": (('"N" }', '"N", sgin = -1 }'), ("record.force.sgin", "-1", "did you mean 'sign'?")),
    "a sign of 2": (('"N" }', '"N", sign = 2 }'), ("record.force.sign", "2", "1 or -1")),
    "an unknown quantity": (("force =", "friction ="), ("record.friction", "unknown key", "force")),
    "another column": (
        ('column = "x"', 'column = "pos"'),
        ("own.csv", "'pos'", "position", "'t', 'x', 'F'"),
    ),
    "a column that looks like markup": (
        ('column = "x"', 'column = "[bold]x:warning:"'),
        ("own.csv", "'[bold]x:warning:'"),
    ),
    "no time": (('time = { column = "t", unit = "s" }\n', ""), ("record.time is missing",)),
    "no motion": (('position = { column = "x", unit = "mm" }\n', ""), ("velocity", "position = {")),
    "another folder": (
        ('"own.csv"', '"../own.csv"'),
        ("broken.toml", "'../own.csv'", "outside", "GMS_FSM_DATA"),
    ),
    "an absolute path": (('"own.csv"', '"/etc/passwd"'), ("'/etc/passwd'", "outside")),
    "out and in again": (('"own.csv"', '"sub/../../own.csv"'), ("'sub/../../own.csv'", "outside")),
    "no such file": (
        ('"own.csv"', '"gone.csv"'),
        ("broken.toml", "'gone.csv'", "no such file", "GMS_FSM_DATA"),
    ),
    "a negative smoothing": (
        ('file = "own.csv"', 'file = "own.csv"\nsmoothing = -1.0'),
        ("record.smoothing", "-1.0"),
    ),
    "a smoothing beyond all bounds": (
        ('file = "own.csv"', 'file = "own.csv"\nsmoothing = 1e100'),
        ("smoothing", "1e+100"),
    ),
    "two delimiters": (
        ('file = "own.csv"', 'file = "own.csv"\ndelimiter = ";;"'),
        ("record.delimiter", "';;'"),
    ),
    "a wrong delimiter": (
        ('file = "own.csv"', 'file = "own.csv"\ndelimiter = ";"'),
        ("own.csv", "'t,x,F'"),
    ),
    "a line end as delimiter": (
        ('file = "own.csv"', 'file = "own.csv"\ndelimiter = "\\n"'),
        ("delimiter",),
    ),
    # the selection
    "a selection that nothing fulfils": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "force > 100 N"'),
        ("own.csv", "where", "'force > 100 N'", "no row"),
    ),
    "a selection of one row": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "force > 0.9999 N"'),
        ("own.csv", "only 1 rows", "at least 5", "where = "),
    ),
    "a selection by an unknown name": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "F > 1 N"'),
        ("record", "where", "F > 1 N", "'F'", "time, position, velocity, force, normal"),
    ),
    "a selection by a column that is not given": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "normal > 4.5 N"'),
        ("own.csv", "where", "'normal > 4.5 N'", "no column", "normal = {"),
    ),
    "a selection in an unknown unit": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "force > 1 lb"'),
        ("where", "'lb'", "'force > 1 lb'", "lbf"),
    ),
    "a selection in a unit of something else": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "force > -5 mm"'),
        ("where", "'force > -5 mm'", "mm"),
    ),
    "a selection that ends early": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "force >"'),
        ("record", "where", "ends too early"),
    ),
    "a selection that is no comparison": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "force"'),
        ("record", "where", "comparison"),
    ),
    "a selection that divides by zero": (
        ('file = "own.csv"', 'file = "own.csv"\nwhere = "1 / (time - 0.1) > 0"'),
        ("own.csv", "where", "division by zero"),
    ),
    "a program as selection": (
        ('file = "own.csv"', """file = "own.csv"\nwhere = '__import__("os").mkdir("x") > 0'"""),
        ("where", "__import__"),
    ),
    # the run over it
    "a start before the record": (
        ("[output]", "[run]\nt_start = -1.0\n[output]"),
        ("0.59", "-1.0", "within the record"),
    ),
    "a start after the record": (("[output]", "[run]\nt_start = 0.7\n[output]"), ("0.59", "0.7")),
    "an end before the record": (
        ("[output]", "[run]\nt_end = -0.7\n[output]"),
        ("t_end", "-0.7", "later"),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("broken", CONTENTS)
def test_a_broken_table(broken: str, gms_fsm: CommandLine, tmp_path: Path) -> None:
    content, said = CONTENTS[broken]
    (tmp_path / "scenario.toml").write_text(MEASURED)
    (tmp_path / "own.csv").write_bytes(content)
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    one_message(answer, "own.csv", *said)
    nothing_written(tmp_path, {"scenario.toml", "own.csv"})


@pytest.mark.parametrize("broken", TABLES)
def test_a_wrong_setting_for_a_good_table(
    broken: str, gms_fsm: CommandLine, tmp_path: Path
) -> None:
    (old, new), said = TABLES[broken]
    folder = tmp_path / "inside"
    folder.mkdir()
    (folder / "broken.toml").write_text(changed(MEASURED, old, new))
    (folder / "own.csv").write_text(GOOD)
    (tmp_path / "own.csv").write_text(GOOD)
    answer = gms_fsm("run", folder / "broken.toml", "-o", folder / "out")
    one_message(answer, str(folder), *said)
    nothing_written(tmp_path, {"inside", "inside/broken.toml", "inside/own.csv", "own.csv"})


def test_a_link_out_of_the_folder_is_not_followed(gms_fsm: CommandLine, tmp_path: Path) -> None:
    folder = tmp_path / "inside"
    folder.mkdir()
    (tmp_path / "secret.csv").write_text(GOOD)
    (folder / "own.csv").symlink_to(tmp_path / "secret.csv")
    (folder / "broken.toml").write_text(MEASURED)
    answer = gms_fsm("run", folder / "broken.toml", "-o", folder / "out")
    one_message(answer, "broken.toml", "'own.csv'", "outside")
    assert not (folder / "out").exists()


def test_the_data_folder_is_searched(
    gms_fsm: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = tmp_path / "data"
    data.mkdir()
    (tmp_path / "scenario.toml").write_text(MEASURED)
    monkeypatch.setenv("GMS_FSM_DATA", str(data))
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    one_message(answer, "scenario.toml", "'own.csv'", "no such file", str(data))
    (data / "own.csv").write_text(GOOD)
    assert gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out").code == 0


@pytest.mark.parametrize("head", [b"", b"t,x,F\n0,0,0\n"])
def test_a_line_of_1_GB_is_not_read(head: bytes, gms_fsm: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "scenario.toml").write_text(MEASURED)
    with (tmp_path / "own.csv").open("wb") as file:
        file.write(head)
        file.truncate(10**9)
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    one_message(answer, "own.csv", f"line {head.count(10) + 1}", "longer than 100000")
    nothing_written(tmp_path, {"scenario.toml", "own.csv"})


def test_a_record_that_ends_before_the_run_keeps_its_part(
    gms_fsm: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "scenario.toml").write_text(
        changed(MEASURED, "[output]", "[run]\nt_end = 10.0\n[output]")
    )
    (tmp_path / "own.csv").write_text(GOOD)
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    one_message(
        answer, "scenario.toml", "a sampled signal at t = 0.59 s", "t_end = 10.0", "partial.npz"
    )
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"partial.npz", LIST}
    part = Trace.load(tmp_path / "out" / "partial.npz")
    np.testing.assert_array_equal(part.t, [float(line.split(",")[0]) for line in LINES[1:]])


def test_a_constant_force_is_accepted(gms_fsm: CommandLine, tmp_path: Path) -> None:
    """R² is undefined then; the run is still valid."""
    (tmp_path / "scenario.toml").write_text(MEASURED)
    (tmp_path / "own.csv").write_text(table(["t", "x", "F"], EVEN, np.sin(6 * EVEN), 0 * EVEN))
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    assert answer.code == 0, answer.err
    assert "RMSE" in (tmp_path / "out" / "summary.md").read_text()


@pytest.mark.parametrize("force", [True, False])
def test_a_motion_at_rest_does_not_crash(force: bool, gms_fsm: CommandLine, tmp_path: Path) -> None:
    """Either rejected with a message, or run."""
    text = MEASURED if force else changed(MEASURED, 'force = { column = "F", unit = "N" }\n', "")
    (tmp_path / "scenario.toml").write_text(text)
    (tmp_path / "own.csv").write_text(table(["t", "x", "F"], EVEN, 0 * EVEN + 1, EVEN))
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    if answer.code == 0:
        assert (tmp_path / "out" / "summary.md").is_file()
    else:
        one_message(answer, "own.csv")
        nothing_written(tmp_path, {"scenario.toml", "own.csv"})


def test_five_rows_are_enough(gms_fsm: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "scenario.toml").write_text(MEASURED)
    (tmp_path / "own.csv").write_text("\n".join(LINES[:6]) + "\n")
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    assert answer.code == 0, answer.err
    assert len(Trace.load(tmp_path / "out" / "trace.npz")) == 5


def test_one_message_is_one_line(gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even in a narrow terminal."""
    monkeypatch.setenv("COLUMNS", "80")
    Path("scenario.toml").write_text(MEASURED)
    Path("own.csv").write_bytes(row(5, "0.03,abc,1"))
    answer = gms_fsm("run", "scenario.toml")
    assert answer.code == 2
    assert answer.out == ""
    assert answer.err.splitlines() == [
        "error: own.csv: row 5, column 'x': 'abc' is not a number; "
        "correct it, or exclude the row with where = ..., a condition that is false there"
    ]
