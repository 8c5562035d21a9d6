"""Claim: an FMU contains what the standard wants, with the names of the chart, and FMPy runs it."""

from __future__ import annotations

import functools
import re
import shutil
import tempfile
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
import pytest

from gms_fsm import ChartModel, Model, Prescribed, System, export, simulate
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.fmi.variables import variables_of
from gms_fsm.foundation.quantities import base_units
from tests.exporters.frictions import reads_acceleration, scenario, servo
from tests.helpers import stick_slip
from tests.supervisor_cases import crossing

PAPER = stick_slip("signed")
FORMATS = ("fmu2", "fmu3")
pytestmark = pytest.mark.slow


class Archive(NamedTuple):
    """The files of an FMU by name, and its README."""

    files: Mapping[str, str]
    readme: str

    def variables(self) -> dict[str, dict[str, str]]:
        """Return the attributes of the variables by name."""
        found = ET.fromstring(self.files["modelDescription.xml"]).find("ModelVariables")
        assert found is not None
        typed = (each[0].attrib if len(each) else {} for each in found)
        return {
            each.attrib["name"]: {**more, **each.attrib}
            for each, more in zip(found, typed, strict=True)
        }


def archive(what: Model | System, form: str) -> Archive:
    """Export without a compiler, which is faster, and open the FMU."""
    with (
        tempfile.TemporaryDirectory() as name,
        mock.patch.object(shutil, "which", return_value=None),
    ):
        folder = Path(name)
        with pytest.warns(UserWarning, match="no C compiler was found"):
            export(what, form, folder, name="it")
        with zipfile.ZipFile(folder / f"it_{form.replace('u', 'i')}.fmu") as fmu:
            files = {each: fmu.read(each).decode(errors="replace") for each in fmu.namelist()}
        return Archive(files, (folder / f"README-it-{form}.md").read_text(encoding="utf-8"))


paper = functools.cache(lambda form: archive(PAPER, form))


@pytest.mark.parametrize("form", FORMATS)
def test_the_files(form: str) -> None:
    files, readme = paper(form)
    assert {"modelDescription.xml", f"sources/fmi{form[-1]}.c", "sources/it_engine.c"} <= {*files}
    assert ("sources/buildDescription.xml" in files) == (form == "fmu3")
    assert any(name.endswith("license.txt") for name in files)
    assert not [name for name in files if name.startswith("binaries/")]
    assert "There is no binary in it: no C compiler was found" in readme
    assert "Co-Simulation" in files["documentation/index.html"]


@pytest.mark.parametrize("form", FORMATS)
def test_the_variables_of_a_friction(form: str) -> None:
    found = paper(form).variables()
    outputs = [name for name, each in found.items() if each["causality"] == "output"]
    assert (found["v"]["causality"], outputs) == ("input", ["F", "switches"])
    assert (found["k[2]"]["start"], found["k[2]"]["unit"]) == ("0.7", "N/m")
    assert found["state[4]"]["declaredType"] == "friction states"
    assert "derivative" in found["der(z[1])"]
    margins = {name: each.get("description", "") for name, each in found.items()}
    assert margins["margin.break_away_forward[3]"].startswith("z >= s of element 3, in the guard")
    assert "break_away_forward, arrest" in margins["margin.break_away_forward_2"]


@pytest.mark.every(2)
@pytest.mark.parametrize("form", FORMATS)
def test_the_variables_of_a_system(form: str) -> None:
    found = archive(servo(), form).variables()
    assert not [name for name, each in found.items() if each["causality"] == "input"]
    assert found["x_l"]["causality"] == "output"
    assert found["u"]["variability"] == "discrete"
    assert "der(u)" not in found
    assert "bearing.margin.arrest" not in found  # its comparisons are those of the break-aways
    assert "bearing.margin.break_away_forward[1]" in found


@pytest.mark.matrix
@pytest.mark.parametrize("form", FORMATS)
def test_an_event_has_its_own_name_where_it_is_free_and_a_supervisor_no_bristle(form: str) -> None:
    system = crossing().system
    named = archive(system, form).variables()
    assert named["red"]["description"] == "event, 1 where it has come"
    assert not [name for name in named if "event__" in name or re.search("weights|_elements", name)]
    assert "main.s[1]" not in named
    taken = archive(replace(system, numbers={"red": 2.0}), form).variables()
    assert {"red", "event__red"} <= taken.keys()


@pytest.mark.parametrize("form", FORMATS)
def test_a_chart_that_reads_the_acceleration_has_no_model_exchange(form: str) -> None:
    files, readme = archive(ChartModel(reads_acceleration(), {"k": 1.0}), form)
    assert "<CoSimulation" in files["modelDescription.xml"]
    assert "<ModelExchange" not in files["modelDescription.xml"]
    assert "There is none: a chart reads how fast an input changes" in readme


def test_what_turns_has_units_of_turning() -> None:
    system = scenario("robot_joint")
    units = {
        each.name: each.unit for each in variables_of(Subject.of(system, "fmu2"), exchange=True)
    }
    wanted = {
        "theta": "rad", "w_m": "rad/s", "der(w_m)": "rad/s^2", "bearings.F": "Nm",
        "bearings.k[1]": "Nm/rad", "bearings.sigma_2": "Nms/rad", "bearings.v_s": "rad/s",
    }  # fmt: skip
    assert {name: units[name] for name in wanted} == wanted
    assert all(base_units(unit) is not None for unit in units.values() if unit)
    bit = {
        e.name: e.unit
        for e in variables_of(Subject.of(scenario("drill_string"), "fmu2"), exchange=True)
    }
    assert [bit[f"rock.{each}"] for each in ("W", "R_b", "v", "F")] == ["N", "m", "rad/s", "Nm"]


def test_units_are_made_of_base_units() -> None:
    assert base_units("N/s") == {"kg": 1, "m": 1, "s": -3}
    assert base_units("m/s2") == {"m": 1, "s": -2}
    assert base_units("Nm*rad") == {"kg": 1, "m": 2, "s": -2, "rad": 1}
    assert base_units("(m)/s") == {"m": 1, "s": -1}
    assert base_units("") is base_units("N/") is None


# --------------------------------------------------------------------------- in FMPy
@pytest.mark.every(2)
@pytest.mark.parametrize("form", FORMATS)
def test_it_steps_to_the_engine_s_bits_and_its_readme_is_a_program(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("fmpy", reason="FMPy drives the FMUs")
    from fmpy.validation import validate_fmu

    from tests.exporters.fmus import Slave, paper_record, written

    path = written(PAPER, form, tmp_path, name="gms")
    assert path.name == f"gms_fmi{form[-1]}.fmu"
    assert validate_fmu(str(path)) == []
    # On a grid of powers of two the line of input derivatives ends exactly on the next sample.
    t, v = (each[:2048] for each in paper_record(2.0**-6))
    v = np.round(v * 2**20) / 2**20
    trace = simulate(PAPER, Prescribed((t, v)), t[-1], t_eval=t)
    slave = Slave(path)
    force = slave.run(t, ["F"], v=v)[:, 0]
    assert slave.count("switches") == len(trace.transitions) > 20
    np.testing.assert_array_equal(force[:-1], trace.F[1:-1])

    text = (tmp_path / f"README-gms-{form}.md").read_text(encoding="utf-8")
    found = re.search(r"^(?: {4}(?:from ctypes|import fmpy)\b.*\n)(?:(?: {4}.*)?\n)+", text, re.M)
    assert found is not None, text
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    capsys.readouterr()
    exec(re.sub(r"^ {4}", "", found[0], flags=re.M), names)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    t = np.arange(4) * 0.01
    trace = simulate(PAPER, Prescribed((t, t)), t[-1], t_eval=t)
    assert [float(at) for at, _ in rows] == pytest.approx(t[1:])
    assert [float(force) for _, force in rows] == pytest.approx(trace.F[1:], rel=1e-9)


@pytest.mark.parametrize(
    ("function", "found", "why"),
    [
        ("shutil.which", "/bin/false", "/bin/false .* failed: no message"),
        ("platform.system", "Plan9", "FMI 2 has no name for Plan9 on "),
    ],
)
def test_without_a_binary_it_says_why(function: str, found: str, why: str, tmp_path: Path) -> None:
    with (
        mock.patch(function, return_value=found),
        pytest.warns(UserWarning, match=f"the FMU has no binary: {why}"),
    ):
        export(PAPER, "fmu2", tmp_path, name="gms")
