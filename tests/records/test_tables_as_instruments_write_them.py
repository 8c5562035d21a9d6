"""One measurement reads to the same bits from every kind of table; what was found is noted."""

from __future__ import annotations

import codecs
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gms_fsm import Record
from gms_fsm.app.scenario import load_scenario
from tests.scenario_files import MEASURED, OPEN_LOOP, changed

NAMES = ("Zeit", "Weg", "Kraft")
UNITS = ("s", "mm", "N")
T = np.arange(50) * 0.01
ROWS = [(f"{t:.2f}", f"{np.sin(6 * t):.5f}", f"{3 * np.cos(6 * t):.3e}") for t in T]
EXPECTED = np.array(ROWS, dtype=float).T * np.array([[1.0], [1e-3], [1.0]])
COLUMNS: dict[str, Any] = {"time": "Zeit", "position": ("Weg", "mm"), "force": ("Kraft", "N")}


def written(
    delimiter: str = ",", decimal: str = ".", units: str = "", above: tuple[str, ...] = ()
) -> str:
    """Return the table as text."""
    lines = [*above, delimiter.join(NAMES)]
    if units:
        lines.append(delimiter.join(units.replace("_", unit) for unit in UNITS))
    lines += [delimiter.join(cell.replace(".", decimal) for cell in row) for row in ROWS]
    return "\n".join(lines) + "\n"


def read(tmp_path: Path, content: bytes | str, **options: Any) -> Record:
    path = tmp_path / "rig.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return Record.from_csv(path, **COLUMNS | options)


def check(record: Record) -> None:
    for name, expected in zip(("time", "position", "force"), EXPECTED, strict=True):
        np.testing.assert_array_equal(record.columns[name], expected)


# --------------------------------------------------------------------------- separators
@pytest.mark.parametrize(
    ("delimiter", "decimal"),
    [(",", "."), *((each, mark) for each in (";", "\t", "|", " ", "   ") for mark in ".,")],
)
def test_separators(tmp_path: Path, delimiter: str, decimal: str) -> None:
    """Found or stated, and also at the ends of lines."""
    text = written(delimiter, decimal)
    for options in ({}, {"delimiter": delimiter[0]}):
        record = read(tmp_path, text, decimal=decimal, **options)
        check(record)
        assert record.notes == ()
    if delimiter.strip():
        check(read(tmp_path, text.replace("\n", f"{delimiter}\n"), decimal=decimal))


def test_decimal_commas_between_commas_are_quoted(tmp_path: Path) -> None:
    lines = [",".join(NAMES)]
    lines += [",".join(f'"{cell.replace(".", ",")}"' for cell in row) for row in ROWS]
    check(read(tmp_path, "\n".join(lines), decimal=","))


# --------------------------------------------------------------------------- encodings
@pytest.mark.parametrize(
    ("mark", "codec", "option", "ending"),
    [
        (b"", "utf-8", None, "\r"),
        (codecs.BOM_UTF8, "utf-8", None, "\n"),
        (codecs.BOM_UTF8, "utf-8", "UTF8", "\r\n"),
        (codecs.BOM_UTF16_LE, "utf-16-le", None, "\n"),
        (codecs.BOM_UTF16_BE, "utf-16-be", None, "\r\n"),
        (b"", "utf-16-be", "utf-16-be", "\r"),
        (b"", "cp1252", "cp1252", "\r\n"),
    ],
)
def test_encodings_and_line_ends(
    tmp_path: Path, mark: bytes, codec: str, option: str | None, ending: str
) -> None:
    text = written(";").replace("Kraft", "Kraft, in, say, [µ]").replace("\n", ending)
    content = mark + text.encode(codec)
    record = read(tmp_path, content, encoding=option, force=("Kraft, in, say, [µ]", "N"))
    check(record)
    assert record.rows.tolist() == [*range(2, 52)]


# --------------------------------------------------------------------------- around the numbers
@pytest.mark.parametrize("units", ["_", "[_]", "(_)", " [_] "])
def test_a_line_of_units_is_skipped_and_noted(tmp_path: Path, units: str) -> None:
    record = read(tmp_path, written(units=units))
    check(record)
    assert record.notes == ("row 2 is a line of units: s, mm, N",)
    assert record.rows.min() == 3


@pytest.mark.parametrize("line", ["sec,mm,N", "s,mm,V", ",[mm],", "-,um,-"])
def test_units_that_are_not_known_are_not_compared(tmp_path: Path, line: str) -> None:
    text = written().replace("\n", f"\n{line}\n", 1)
    options = {"position": ("Weg", "µm")} if "um" in line else {}
    assert len(read(tmp_path, text, **options)) == 50


def test_empty_lines_around_the_rows(tmp_path: Path) -> None:
    head, rows = written().split("\n", 1)
    check(read(tmp_path, f"\n{head}\n\n,,\n{rows}\n \n"))


METADATA = ("Prüfstand 4", "", "Datum;2026-11-23;;", "Rate;100 Hz")


def test_lines_above_the_header_are_not_read(tmp_path: Path) -> None:
    for options in ({}, {"header": 5}):
        record = read(tmp_path, written(";", above=METADATA), **options)
        check(record)
        assert record.notes == ("the header is row 5; the rows above are not read",)
        assert record.rows.tolist() == [*range(6, 56)]
    check(read(tmp_path, written(above=("Zeit,Weg,Kraft",)), header=2))
    check(read(tmp_path, written(above=("note",) * 1000), header=1001))


@pytest.mark.parametrize("mark", ["#", "%", "//", "Rem"])
def test_comment_lines(tmp_path: Path, mark: str) -> None:
    lines = written(above=(f"{mark} rig 4",)).splitlines()
    lines[10:10] = [f"  {mark} the pad was cleaned, twice"]
    lines.append(f"{mark} end")
    options = {} if mark in "#%" else {"comment": mark}
    record = read(tmp_path, "\n".join(lines), **options)
    check(record)
    assert record.rows.tolist() == [*range(3, 11), *range(12, 54)]


@pytest.mark.parametrize(("mark", "delimiter"), [("# ", " "), ("%", ","), ("# ", "\t")])
def test_a_header_in_a_comment(tmp_path: Path, mark: str, delimiter: str) -> None:
    """As `numpy.savetxt` writes it."""
    np.savetxt(
        tmp_path / "rig.csv",
        np.array(ROWS, dtype=float),
        fmt="%.17g",
        delimiter=delimiter,
        header=delimiter.join(NAMES),
        comments=mark,
    )
    check(Record.from_csv(tmp_path / "rig.csv", **COLUMNS))


# --------------------------------------------------------------------------- all at once
@pytest.mark.slow
@given(
    delimiter=st.sampled_from([";", "\t", "|"]),
    decimal=st.sampled_from([".", ","]),
    units=st.sampled_from(["", "_", "[_]"]),
    above=st.lists(st.sampled_from([*METADATA, "# a comment", "Zeit;Weg"]), max_size=5),
    codec=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"]),
    data=st.data(),
)
def test_any_of_them_together(
    tmp_path_factory: pytest.TempPathFactory,
    delimiter: str,
    decimal: str,
    units: str,
    above: list[str],
    codec: str,
    data: st.DataObject,
) -> None:
    lines = written(delimiter, decimal, units, tuple(above)).splitlines()
    for _ in range(data.draw(st.integers(0, 3))):
        lines.insert(data.draw(st.integers(len(above) + 1, len(lines))), "% pause")
    content = "\n".join(lines).encode(codec)
    folder = tmp_path_factory.mktemp("any")
    encoding = codec if codec == "latin-1" else None
    record = read(folder, content, decimal=decimal, encoding=encoding)
    check(record)
    assert any("units" in note for note in record.notes) == bool(units)
    assert any("header is row" in note for note in record.notes) == bool(above)


def test_scenario_files_take_the_same_options(tmp_path: Path) -> None:
    text = written(";", ",", "[_]", METADATA).replace("0,01;", ";", 1) + "// end\n"
    (tmp_path / "own.csv").write_bytes(text.encode("cp1252"))
    options = (
        'file = "own.csv"\ndecimal = ","\nencoding = "cp1252"\nheader = 5\ncomment = ["//"]\n'
        'missing = "drop"\n'
    )
    scenario = changed(MEASURED, 'file = "own.csv"\n', options)
    for own, name in (('"t"', "Zeit"), ('"x"', "Weg"), ('"F"', "Kraft")):
        scenario = changed(scenario, own, f'"{name}"')
    (tmp_path / "rig.toml").write_text(scenario)
    record = load_scenario(tmp_path / "rig.toml").record
    assert record is not None
    np.testing.assert_array_equal(record.columns["time"], np.delete(EXPECTED, 1, axis=1)[0])
    assert len(record.notes) == 3  # header, units, a row left out
    signal = (
        '{ file = "own.csv", decimal = ",", encoding = "cp1252", comment = ["//"], missing = "drop"'
        ', time = { column = "Zeit", unit = "s" }, value = { column = "Weg", unit = "mm/s" } }'
    )
    (tmp_path / "own.csv").write_bytes(text.replace("[mm]", "mm/s").encode("cp1252"))
    (tmp_path / "own.toml").write_text(changed(OPEN_LOOP, '"0.1*sin(t)"', signal))
    corners: Any = load_scenario(tmp_path / "own.toml").rig.signals["v"]
    np.testing.assert_array_equal(corners.values, np.delete(EXPECTED, 1, axis=1)[1])
