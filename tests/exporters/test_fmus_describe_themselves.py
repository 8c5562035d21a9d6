"""Claim: an FMU contains what the standard wants, with the names of the chart."""

from __future__ import annotations

import re
import shutil
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import pytest

from gms_fsm import (
    GMS,
    Chart,
    GMSParameters,
    ParameterError,
    State,
    System,
    Transition,
    export,
)
from gms_fsm.app.scenario import load_system
from gms_fsm.charts.gms import GMS_ELEMENT
from gms_fsm.charts.karnopp import KARNOPP
from gms_fsm.exporters._fmu_units import base_units
from gms_fsm.systems.models import ChartModel

PAPER = GMS(GMSParameters.paper("stick-slip"), law="signed")
FORMATS = ("fmu2", "fmu3")
pytestmark = pytest.mark.slow
SERVO = Path(__file__).parents[2] / "scenarios" / "servo.toml"


@pytest.fixture(autouse=True)
def _no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """No compiler: the archives are made faster."""
    monkeypatch.setattr(shutil, "which", lambda name: None)


def archive(what: object, form: str, folder: Path) -> zipfile.ZipFile:
    """Export, and open the FMU."""
    with pytest.warns(UserWarning, match="no C compiler was found"):
        export(what, form, folder, name="it")  # type: ignore[arg-type]
    return zipfile.ZipFile(folder / f"it_{form.replace('u', 'i')}.fmu")


def described(what: object, form: str, folder: Path) -> dict[str, dict[str, str]]:
    """Return the attributes of the variables by name."""
    with archive(what, form, folder) as files:
        tree = ET.fromstring(files.read("modelDescription.xml"))
    variables = tree.find("ModelVariables")
    assert variables is not None
    found = {}
    for each in variables:
        typed = dict(each[0].attrib) if form == "fmu2" else {}
        found[each.attrib["name"]] = {**typed, **each.attrib}
    return found


@pytest.mark.parametrize("form", FORMATS)
def test_the_files(form: str, tmp_path: Path) -> None:
    with archive(PAPER, form, tmp_path) as files:
        names = set(files.namelist())
        text = files.read("documentation/index.html").decode()
    assert {"modelDescription.xml", f"sources/fmi{form[-1]}.c", "sources/it_engine.c"} <= names
    assert ("sources/buildDescription.xml" in names) == (form == "fmu3")
    assert any(name.endswith("license.txt") for name in names)
    assert not [name for name in names if name.startswith("binaries/")]
    readme = (tmp_path / f"README-it-{form}.md").read_text(encoding="utf-8")
    assert "There is no binary in it: no C compiler was found" in readme
    assert "Co-Simulation" in text


@pytest.mark.parametrize("form", FORMATS)
def test_the_same_model_gives_the_same_bytes(form: str, tmp_path: Path) -> None:
    contents = []
    for folder in ("one", "two"):
        archive(PAPER, form, tmp_path / folder).close()
        contents.append((tmp_path / folder / f"it_{form.replace('u', 'i')}.fmu").read_bytes())
    assert contents[0] == contents[1]


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


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize(
    ("what", "name", "message"),
    [
        (GMS_ELEMENT["signed"], "it", "needs numbers"),
        (
            ChartModel(KARNOPP, {"F_c": 1.0, "F_s": 1.5, "sigma_2": 0.4, "D": 1e-4}),
            "it",
            "it locks the contact",
        ),
        (PAPER, "double", "it is a word of the format's language"),
        (PAPER, "../x", "names of ASCII letters"),
        ("function", "it", "it is a Python function"),
    ],
)
def test_what_cannot_be_expressed_is_refused(
    what: object, name: str, message: str, form: str, tmp_path: Path
) -> None:
    if what == "function":
        system = load_system(SERVO)
        numbers = {key: value for key, value in system.numbers.items() if key != "ref"}
        what = System(
            **{
                **{key: getattr(system, key) for key in ("bodies", "contacts", "sampled")},
                "name": "servo",
                "numbers": numbers,
                "signals": {"ref": abs},
            }
        )
    with pytest.raises(ParameterError, match=re.escape(message)):
        export(what, form, tmp_path / "out", name=name)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()
