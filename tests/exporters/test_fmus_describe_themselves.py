"""Claim: an FMU contains what the standard wants, with the names of the chart."""

from __future__ import annotations

import functools
import io
import shutil
import tempfile
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import pytest

from gms_fsm import (
    GMS,
    Chart,
    GMSParameters,
    State,
    Transition,
    export,
)
from gms_fsm.app.scenario import load_system
from gms_fsm.exporters.fmi.units import base_units
from gms_fsm.systems.models import ChartModel
from tests.helpers import matrix

PAPER = GMS(GMSParameters.paper("stick-slip"), law="signed")
FORMATS = ("fmu2", "fmu3")
pytestmark = pytest.mark.slow
SERVO = Path(__file__).parents[2] / "scenarios" / "servo.toml"


@pytest.fixture(autouse=True)
def _no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """No compiler: the archives are made faster."""
    monkeypatch.setattr(shutil, "which", lambda name: None)


@functools.cache
def paper(form: str) -> tuple[bytes, str]:
    """Return the FMU of the paper's friction and its README."""
    with tempfile.TemporaryDirectory() as folder:
        archive(PAPER, form, Path(folder)).close()
        fmu, readme = Path(folder, f"it_fmi{form[-1]}.fmu"), Path(folder, f"README-it-{form}.md")
        return fmu.read_bytes(), readme.read_text(encoding="utf-8")


def archive(what: object, form: str, folder: Path) -> zipfile.ZipFile:
    """Export, and open the FMU."""
    with pytest.warns(UserWarning, match="no C compiler was found"):
        export(what, form, folder, name="it")  # type: ignore[arg-type]
    return zipfile.ZipFile(folder / f"it_{form.replace('u', 'i')}.fmu")


def described(what: object, form: str, folder: Path) -> dict[str, dict[str, str]]:
    """Return the attributes of the variables by name."""

    def opened() -> zipfile.ZipFile:
        if what is PAPER:
            return zipfile.ZipFile(io.BytesIO(paper(form)[0]))
        return archive(what, form, folder)

    with opened() as files:
        tree = ET.fromstring(files.read("modelDescription.xml"))
    variables = tree.find("ModelVariables")
    assert variables is not None
    found = {}
    for each in variables:
        typed = dict(each[0].attrib) if form == "fmu2" else {}
        found[each.attrib["name"]] = {**typed, **each.attrib}
    return found


@pytest.mark.parametrize("form", FORMATS)
def test_the_files(form: str) -> None:
    fmu, readme = paper(form)
    with zipfile.ZipFile(io.BytesIO(fmu)) as files:
        names = set(files.namelist())
        text = files.read("documentation/index.html").decode()
    assert {"modelDescription.xml", f"sources/fmi{form[-1]}.c", "sources/it_engine.c"} <= names
    assert ("sources/buildDescription.xml" in names) == (form == "fmu3")
    assert any(name.endswith("license.txt") for name in names)
    assert not [name for name in names if name.startswith("binaries/")]
    assert "There is no binary in it: no C compiler was found" in readme
    assert "Co-Simulation" in text


@pytest.mark.parametrize("form", matrix(FORMATS, ["fmu3"]))
def test_the_same_model_gives_the_same_bytes(form: str, tmp_path: Path) -> None:
    with archive(PAPER, form, tmp_path):
        again = (tmp_path / f"it_fmi{form[-1]}.fmu").read_bytes()
    assert again == paper(form)[0]


@pytest.mark.parametrize("form", FORMATS)
def test_the_variables_of_a_friction(form: str, tmp_path: Path) -> None:
    found = described(PAPER, form, tmp_path)
    assert found["v"]["causality"] == "input"
    assert [name for name, each in found.items() if each["causality"] == "output"] == [
        "F",
        "switches",
    ]
    assert found["k[2]"]["start"] == "0.7"
    assert found["k[2]"]["unit"] == "N/m"
    assert found["state[4]"]["declaredType"] == "friction states"
    assert "derivative" in found["der(z[1])"]
    margins = {
        name: each["description"] for name, each in found.items() if name.startswith("margin.")
    }
    assert margins["margin.break_away_forward[3]"].startswith(
        "z >= s of element 3, in the guard of"
    )
    assert "break_away_forward, arrest" in margins["margin.break_away_forward_2"]


@pytest.mark.parametrize("form", FORMATS)
def test_the_variables_of_a_system(form: str, tmp_path: Path) -> None:
    found = described(load_system(SERVO), form, tmp_path)
    assert not [name for name, each in found.items() if each["causality"] == "input"]
    assert found["x_l"]["causality"] == "output"
    assert found["u"]["variability"] == "discrete"
    assert "der(u)" not in found
    assert "bearing.margin.arrest" not in found  # its comparisons are those of the break-aways
    assert "bearing.margin.break_away_forward[1]" in found


def test_units_are_made_of_base_units() -> None:
    assert base_units("N/s") == {"kg": 1, "m": 1, "s": -3}
    assert base_units("m/s2") == {"m": 1, "s": -2}
    assert base_units("Nm*rad") == {"kg": 1, "m": 2, "s": -2, "rad": 1}
    assert base_units("(m)/s") == {"m": 1, "s": -1}
    assert base_units("") is None
    assert base_units("N/") is None


RATE = Chart(
    "bristle that feels how fast it is moved",
    variables=("z",),
    parameters=("k",),
    inputs=("t",),
    states=(
        State("calm", flow={"z": "v"}, outputs={"F": "k * z"}),
        State("wild", flow={"z": "-z"}, outputs={"F": "k * z"}),
    ),
    transitions=(
        Transition("leave", "calm", "wild", guard="a > 1"),
        Transition("return_", "wild", "calm", guard="a < -1"),
    ),
)


@pytest.mark.parametrize("form", FORMATS)
def test_a_chart_that_reads_the_acceleration_has_no_model_exchange(
    form: str, tmp_path: Path
) -> None:
    with archive(ChartModel(RATE, {"k": 1.0}), form, tmp_path) as files:
        text = files.read("modelDescription.xml").decode()
    assert "<CoSimulation" in text
    assert "<ModelExchange" not in text
    assert "There is none: a chart reads how fast an input changes" in (
        tmp_path / f"README-it-{form}.md"
    ).read_text(encoding="utf-8")
