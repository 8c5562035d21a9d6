"""Forty odd files: each is read as it means, or refused with the cure in the message."""

# ruff: noqa: E501 (a file is one line of the table)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Record
from gms_fsm.errors import GMSError

N = 8
T = 0.25 * np.arange(N)
X = 0.019 * np.arange(N)  # 19 mm a row
F = 1250.5 + np.arange(N)
MM = [1e3 * x for x in X]
ISO = [f"2026-11-26T23:59:{58 + t:05.2f}" if t < 2 else "" for t in T]
CLOCK = [f"12:00:{t:05.2f}" for t in T]
DATES = [f"2026-11-26 12:00:{t:05.2f}+01:00" for t in T]


def lines(*columns: Any, head: str = "t,x,F", by: str = ",", above: str = "") -> str:
    rows = [by.join(str(cell) for cell in row) for row in zip(*columns, strict=True)]
    return above + "\n".join([head, *rows] if head else rows) + "\n"


def grouped(values: Any, thousands: str, decimal: str = ".") -> list[str]:
    texts = [f"{value:,.1f}" for value in values]
    return [each.translate({44: thousands, 46: decimal}) for each in texts]


USUAL: dict[str, Any] = {"time": "t", "position": "x", "force": "F"}
TX: dict[str, Any] = {"time": "t", "position": "x", "force": None}
HOLE = [*F[:3], "OVR", *F[4:]]
READ: dict[str, tuple[str, dict[str, Any]]] = {
    "SI units": (lines(T, X, F), {}),
    "unit in brackets": (lines(T, MM, F, head="t,x [mm],F"), {"position": "x [mm]"}),
    "unit in parentheses": (lines(T, MM, F, head="t,x (mm),F"), {"position": "x (mm)"}),
    "unit behind a slash": (
        lines(T, MM, F, head="t/s,x/mm,F/N"),
        {"time": "t/s", "position": "x/mm", "force": "F/N"},
    ),
    "unit in words": (lines(T, MM, F, head="t,x in mm,F"), {"position": "x in mm"}),
    "kilonewtons": (lines(T, X, F / 1e3, head="t,x,F [kN]"), {"force": "F [kN]"}),
    "angles in degrees": (lines(T, np.degrees(X), F, head="t,q [deg],F"), {"position": "q [deg]"}),
    "degree sign": (lines(T, np.degrees(X), F, head="t,q [°],F"), {"position": "q [°]"}),
    "radians": (lines(T, X, F, head="t,q,tau"), {"position": ("q", "rad"), "force": ("tau", "Nm")}),
    "millinewton metres": (
        lines(T, X, F * 1e3, head="t,q,M"),
        {"position": ("q", "rad"), "force": ("M", "mNm")},
    ),
    "newton metres with a dot": (
        lines(T, X, F, head="t,q,M [N·m]"),
        {"position": ("q", "rad"), "force": "M [N·m]"},
    ),
    "thousands with commas": (
        lines(T, X, grouped(F, ","), head="t;x;F", by=";"),
        {"thousands": ","},
    ),
    "thousands with points": (
        lines(
            *([str(v).replace(".", ",") for v in c] for c in (T, X)),
            grouped(F, ".", ","),
            head="t;x;F",
            by=";",
        ),
        {"thousands": ".", "decimal": ","},
    ),
    "thousands with blanks": (
        lines(T, X, grouped(F, " "), head="t;x;F", by=";"),
        {"thousands": " "},
    ),
    "thousands with narrow blanks": (
        lines(T, X, grouped(F, "\u202f"), head="t;x;F", by=";"),
        {"thousands": " "},
    ),
    "thousands with apostrophes": (
        lines(T, X, grouped(F, "'"), head="t;x;F", by=";"),
        {"thousands": "'"},
    ),
    "no header": (lines(T, X, F, head=""), {"columns": ["t", "x", "F"]}),
    "no header, semicolons": (lines(T, X, F, head="", by=";"), {"columns": ["t", "x", "F"]}),
    "no header, blanks": (lines(T, X, F, head="", by="  "), {"columns": ["t", "x", "F"]}),
    "a header to replace": (
        lines(T, X, F, head="a,b,c"),
        {"columns": ["t", "x", "F"], "header": 1},
    ),
    "no header, comments above": (
        lines(T, X, F, head="", above="# rig 4\n# run 2\n"),
        {"columns": ["t", "x", "F"]},
    ),
    "ISO times over midnight": (
        lines(
            [
                *(f"2026-11-26T23:59:{59 + t:05.2f}" for t in T if t < 1),
                *(f"2026-11-27T00:00:{t - 1:05.2f}" for t in T if t >= 1),
            ],
            X,
            F,
        ),
        {},
    ),
    "times of a clock": (lines(CLOCK, X, F), {}),
    "times with a zone": (lines(DATES, X, F), {}),
    "times with a Z": (lines([f"2026-01-01T00:00:{t:05.2f}Z" for t in T], X, F), {}),
    "rows out of order": (lines(T[::-1], X[::-1], F[::-1]), {"sort": True}),
    "times twice": (
        lines(np.repeat(T, 2), np.repeat(X, 2) + np.tile([1e-4, -1e-4], N), np.repeat(F, 2)),
        {"duplicates": "mean"},
    ),
    "both": (
        lines(np.repeat(T, 2)[::-1], np.repeat(X, 2)[::-1], np.repeat(F, 2)[::-1]),
        {"sort": True, "duplicates": "mean"},
    ),
    "OVR in the force": (lines(T, X, HOLE), {"missing": "drop"}),
    "dashes in the force": (lines(T, X, [*F[:3], "---", *F[4:]]), {"missing": "interpolate"}),
    "stars in the force": (lines(T, X, [*F[:3], "*****", *F[4:]]), {"missing": "drop"}),
    "a spreadsheet's error in the force": (
        lines(T, X, [*F[:3], "#DIV/0!", *F[4:]]),
        {"missing": "drop"},
    ),
    "seconds in words": (lines(T, X, F, head="t (sec),x,F"), {"time": "t (sec)"}),
    "milliseconds": (lines(T * 1e3, X, F, head="t [ms],x,F"), {"time": "t [ms]"}),
}
REFUSED: dict[str, tuple[str, dict[str, Any], str]] = {
    "unit at the end alone": (lines(T, MM, F, head="t,x_mm,F"), {"position": "x_mm"}, "('x_mm', 'mm')"),
    "unit against the name": (lines(T, MM, F, head="t,x [mm],F"), {"position": ("x [mm]", "m")}, "'mm'"),
    "turns": (lines(T, MM, F, head="t,q [rev],F"), {"position": "q [rev]"}, "rev is not known"),
    "counts": (lines(T, MM, F, head="t,x [counts],F"), {"position": "x [counts]"}, "give the unit, too"),
    "velocity as position": (lines(T, MM, F, head="t,v [mm/s],F"), {"position": "v [mm/s]"}, "velocity=('v [mm/s]', 'mm/s')"),
    "velocity as position, plainly": (lines(T, MM, F, head="t,v_mm_s,F"), {"position": "v_mm_s"}, "velocity=("),
    "thousands without the option": (lines(T, X, grouped(F, ","), head="t;x;F", by=";"), {}, "thousands"),
    "thousands or decimals": (lines(T, X, ["1,250"] * N, head="t;x;F", by=";"), {}, "decimal = \",\"; if it separates thousands, thousands = ','"),
    "thousands in twos": (lines(T, X, ["12,50,5.0"] * N, head="t;x;F", by=";"), {"thousands": ","}, "not a number"),
    "one thousands separator for all": (lines(T, X, F), {"thousands": "."}, "not the decimal separator"),
    "no header without names": (lines(T, X, F, head=""), {}, "columns = ['t', 'x', ...]"),
    "too few names": (lines(T, X, F, head=""), {"columns": ["t", "x"]}, "name every column"),
    "rows out of order": (lines(T[::-1], X, F), {}, "sort = true"),
    "times twice": (lines(np.repeat(T, 2), np.repeat(X, 2), np.repeat(F, 2)), {}, 'duplicates = "mean"'),
    "a clock that passes midnight": (lines(["23:59:59", "00:00:01", *CLOCK[2:]], X, F), {}, "time does not increase"),
    "times of a clock with a unit": (lines(CLOCK, X, F), {"time": ("t", "ms")}, "without a unit"),
    "times of two kinds": (lines([*CLOCK[:4], *T[4:]], X, F), {}, "one kind of times"),
    "OVR": (lines(T, X, HOLE), {}, 'missing = "drop"'),
    "OVR in the time": (lines([*T[:3], "OVR", *T[4:]], X, F), {}, 'missing = "drop"'),
    "a word": (lines(T, X, [*F[:3], "stopped", *F[4:]]), {"missing": "drop"}, "exclude the row"),
    "Fahrenheit": (lines(T, X, F), {"inputs": {"T": ("F", "°F")}, "force": None}, "°C"),
    "load without a name of its own": (lines(T, X, F), {"inputs": {"force": "F"}}, "'N' for a load"),
}  # fmt: skip


def test_there_are_forty() -> None:
    assert len(READ) + len(REFUSED) >= 40


@pytest.mark.parametrize("name", READ)
def test_read(tmp_path: Path, name: str) -> None:
    text, options = READ[name]
    (tmp_path / "rig.csv").write_text(text, encoding="utf-8")
    record = Record.from_csv(tmp_path / "rig.csv", **(USUAL | options))
    np.testing.assert_allclose(record.columns["time"], T, atol=1e-9)
    np.testing.assert_allclose(record.columns["position"], X, atol=1e-12)
    own = record.chosen
    np.testing.assert_allclose(record.columns["force"][own], F[own], rtol=1e-12)
    assert own.all() == ("in the force" not in name)


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_the_cure(tmp_path: Path, name: str) -> None:
    text, options, cure = REFUSED[name]
    (tmp_path / "rig.csv").write_text(text, encoding="utf-8")
    with pytest.raises(GMSError) as error:
        Record.from_csv(tmp_path / "rig.csv", **(USUAL | options))
    assert cure in str(error.value)


def test_an_angle_beside_a_force_is_noted(tmp_path: Path) -> None:
    (tmp_path / "rig.csv").write_text(lines(T, X, F))
    record = Record.from_csv(tmp_path / "rig.csv", **(USUAL | {"position": ("x", "rad")}))
    assert record.notes == ("position is in rad, and force in N: their product is no power",)


def test_inputs_are_read_in_si_units_and_written(tmp_path: Path) -> None:
    (tmp_path / "rig.csv").write_text(lines(T, X, F, 20 + T, head="t,x,F,oil"))
    inputs = {"N": ("F", "kN"), "T": ("oil", "°C")}
    record = Record.from_csv(tmp_path / "rig.csv", **(USUAL | {"inputs": inputs}))
    np.testing.assert_allclose(record.inputs["N"], 1e3 * F)
    np.testing.assert_allclose(record.inputs["T"], 293.15 + T)
    assert record.to_csv(tmp_path / "own.csv").read_text().startswith("t_s,x_m,F_N,N,T\n")
    hot = Record.from_csv(tmp_path / "rig.csv", where="T > 293.5", **(USUAL | {"inputs": inputs}))
    assert len(hot) == int((293.15 + T > 293.5).sum())
