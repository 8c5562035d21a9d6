"""A mistake in a call of `Record.from_csv` gives one clear error that says what to do."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import GMSError, Record, RecordError, UnitError

TEXT = "t_s;x_mm;F_N\n" + "".join(f"{i / 4};{i};{i / 2}\n" for i in range(20))


def refusal(tmp_path: Path, content: bytes | str = TEXT, **options: Any) -> str:
    path = tmp_path / "rig.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(GMSError) as caught:
        Record.from_csv(path, **options)
    return str(caught.value)


def test_the_table_itself_is_good(tmp_path: Path) -> None:
    (tmp_path / "rig.csv").write_text(TEXT)
    assert len(Record.from_csv(tmp_path / "rig.csv")) == 20


def test_a_wrong_column(tmp_path: Path) -> None:
    said = refusal(tmp_path, force=("Kraft", "N"))
    assert "rig.csv: no column 'Kraft' (for force); columns in row 1: 't_s', 'x_mm', 'F_N'" in said
    assert "force=(name, unit) or None in Python" in said


def test_decimal_commas_without_the_option(tmp_path: Path) -> None:
    said = refusal(tmp_path, TEXT.replace(".", ","))
    assert said.endswith("row 2, column 't_s': '0,0' has a decimal comma; give decimal = \",\"")
    assert "decimal comma" in refusal(tmp_path, TEXT.replace(".", ","), where="force > 1 N")


def test_the_option_without_decimal_commas(tmp_path: Path) -> None:
    said = refusal(tmp_path, decimal=",")
    assert "row 2, column 't_s': '0.0' has a decimal point, but decimal = \",\"" in said
    assert "'1.234,5' is not a number" in refusal(
        tmp_path, TEXT.replace(".", ",").replace("0,0;", "1.234,5;", 1), decimal=","
    )


def test_a_wrong_encoding(tmp_path: Path) -> None:
    said = refusal(tmp_path, TEXT.replace("F_N", "F_µN").encode("latin-1"))
    assert "line 1 is not UTF-8 text" in said
    assert 'encoding = "cp1252"' in said
    lines = [*TEXT.splitlines()[:12], "9;9;é", "10;10;10"]
    assert "line 13 is not UTF-8" in refusal(tmp_path, "\n".join(lines).encode("latin-1"))
    assert "utf-16 text" in refusal(tmp_path, TEXT[:-1], encoding="utf-16")
    content = b"\x81" + TEXT.encode()
    assert "line 1 is not cp1252 text" in refusal(tmp_path, content, encoding="cp1252")


def test_nan(tmp_path: Path) -> None:
    said = refusal(tmp_path, TEXT.replace("4;8.0", "4;nan").replace(";4;2.0", ";4;nan"))
    assert "row 6, column 'F_N': not a finite number" in said
    assert 'missing = "drop" or "interpolate"' in said


@pytest.mark.parametrize("quantity", ["time", "position", "velocity", "force", "normal"])
@pytest.mark.parametrize(
    "given", [5, (), ("x_mm",), ("x_mm", 3), ("x_mm", "mm", 2), ["x_mm", "mm", 1, 1], {}, b"x_mm"]
)
def test_a_column_given_in_no_known_way(tmp_path: Path, quantity: str, given: Any) -> None:
    said = refusal(tmp_path, **{quantity: given})
    assert said.startswith(f"{quantity} is ")
    assert "(name, unit, sign)" in said


def test_a_wrong_unit(tmp_path: Path) -> None:
    with pytest.raises(UnitError, match="'mm' measures position, not force"):
        Record.from_csv(tmp_path, force=("F_N", "mm"))


WRONG = (None, object(), "", "ab", 0, -1, 1.5, True, [], {}, [None], math.nan, lambda: 0)
OPTIONS: dict[str, Callable[[Any], bool]] = {  # and what is right
    "where": (lambda each: isinstance(each, str)),
    "missing": (lambda each: False),
    "delimiter": (lambda each: each is None),
    "decimal": (lambda each: False),
    "comment": (lambda each: each in ([], {}, "ab")),
    "header": (lambda each: each is None),
    "encoding": (lambda each: each is None),
    "name": (lambda each: each is None or isinstance(each, str)),
}


PAIRS = [
    pytest.param(option, value, id=f"{option}-{type(value).__name__}-{number}")
    for option, right in OPTIONS.items()
    for number, value in enumerate(WRONG)
    if not right(value)
]


@pytest.mark.parametrize(("option", "value"), PAIRS)
def test_a_wrong_option_is_named(tmp_path: Path, option: str, value: Any) -> None:
    assert refusal(tmp_path, **{option: value}).startswith(f"{option} is ")


@pytest.mark.parametrize("encoding", ["klingon", "rot13", "base64", "utf\0", "x" * 500])
def test_an_encoding_that_is_none(tmp_path: Path, encoding: str) -> None:
    said = refusal(tmp_path, encoding=encoding)
    assert "it must be an encoding of text" in said
    assert len(said) < 400


@pytest.mark.parametrize("path", [None, 5, "", "gone.csv", "a\0b", "x" * 5000])
def test_a_path_that_is_none(path: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(GMSError):
        Record.from_csv(path)
    with pytest.raises(RecordError, match="cannot be read"):
        Record.from_csv(tmp_path)
