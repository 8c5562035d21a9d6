"""Claim: ``gms-fsm phenomena`` writes the table and a figure per phenomenon, also for own files."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Contact, System
from gms_fsm.app import phenomena
from gms_fsm.app.phenomena import own_models, write_table
from gms_fsm.charts import CHARTS
from gms_fsm.errors import MissingExtraError
from gms_fsm.phenomena.measure import PHENOMENA
from gms_fsm.phenomena.results import Cell, Curve, MeasuredNumber, PhenomenaTable, PhenomenonResult
from gms_fsm.systems.system import Body
from tests import own_files
from tests.scenario_files import CommandLine

DRAWN = {name: PHENOMENA[name] for name in ("break-away", "memory", "lag", "stick-slip")}
DRY = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}


def small_table() -> PhenomenaTable:
    """Return a table that needs no run: each verdict once per phenomenon."""
    cells, points = [], np.linspace(1.0, 2.0, 5)
    for phenomenon in DRAWN.values():
        curve = Curve("", points, points)
        numbers = (MeasuredNumber("what", 0.25, "N"), MeasuredNumber("other", 1e-9, "1"))
        cells += [
            Cell("one", phenomenon, PhenomenonResult("shows", numbers, "it does", (curve,))),
            Cell(
                "two", phenomenon, PhenomenonResult("shows wrongly", numbers, "it errs", (curve,))
            ),
            Cell("three", phenomenon, PhenomenonResult("failed", (), "t = 1 s: it chatters")),
            Cell("four", phenomenon, PhenomenonResult("does not apply", (), "it is a gear")),
        ]
    titles = {name: name for name in ("one", "two", "three", "four")}
    return PhenomenaTable(titles, tuple(DRAWN.values()), tuple(cells))


@pytest.mark.matrix
@pytest.mark.slow
def test_a_table_becomes_a_page_numbers_and_pictures(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    files = write_table(small_table(), tmp_path)
    assert files[0] == tmp_path / "phenomena.md"
    assert {each.name for each in files} == {
        "phenomena.md",
        "phenomena.csv",
        *(f"{name}.{end}" for name in ("matrix", *DRAWN) for end in ("png", "svg")),
    }
    page = files[0].read_text(encoding="utf-8")
    assert "| one | ● 0.250 N | ● 0.2 N | ● 0.2 N | ● 0.250 N |" in page
    assert "| two | ✗ 0.250 N |" in page
    assert "- four does not take part: it is a gear." in page
    assert "- **three** failed: t = 1 s: it chatters" in page
    assert "Limit: 0.02 for change of the break-away force" in page
    assert "other 0.000" in page  # small, but not exactly 0
    svg = (tmp_path / "matrix.svg").read_text(encoding="utf-8")
    assert svg.count("0.250 N") == len(DRAWN)
    assert "four" not in svg


@pytest.mark.matrix
@pytest.mark.slow
def test_a_model_and_a_file(gms_fsm: CommandLine) -> None:
    System(
        "pulled mass",
        bodies=(Body("mass", inertia="m", force="-x"),),
        contacts=(Contact("pad", CHARTS["stiction"], DRY),),
        numbers={"m": 1.0},
    ).save("mine.toml")
    done = gms_fsm("phenomena", "mine.toml", "--model", "lugre", "--phenomenon", "drift", "-o", "o")
    assert done.code == 0, done.err
    first, last = done.out.splitlines()
    assert first == "2 models, 1 phenomenon: 1 shows, 1 shows wrongly"
    assert last.endswith(f"start with {Path('o/phenomena.md')}")
    with open("o/phenomena.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["model"]: row["verdict"] for row in rows} == {
        "lugre": "shows wrongly",
        "mine": "shows",
    }


@pytest.mark.slow
def test_a_chart_file_takes_values(gms_fsm: CommandLine) -> None:
    CHARTS["stiction"].save("own.toml")
    given = [f"--value={name}={value}" for name, value in DRY.items()]
    done = gms_fsm("phenomena", "own.toml", *given, "--phenomenon", "break-away", "-o", "o")
    assert done.code == 0, done.err
    assert "1.5 N" in Path("o/phenomena.md").read_text(encoding="utf-8")


def test_a_contact_of_a_file_is_named_and_pictures_may_be_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own_files.write(tmp_path)
    for name in ("pad1", "pad2"):
        (found,) = own_models([str(tmp_path / "pair.toml")], name).values()
        assert isinstance(found, Contact)
        assert found.name == name
    monkeypatch.setattr(phenomena, "_draw", refuses)
    with pytest.warns(UserWarning, match="no figures were drawn: plots are away"):
        files = write_table(small_table(), tmp_path)
    assert [each.name for each in files] == ["phenomena.md", "phenomena.csv"]


def refuses(*_: object) -> None:
    raise MissingExtraError("plots are away")
