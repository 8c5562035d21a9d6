"""--set replaces values of the file, the schema has every key, and nothing is executed."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from scipy.integrate import Radau

from gms_fsm import Prescribed
from gms_fsm.app._tables import Scenario, SystemScenario
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts.parts import SUPPLIED
from gms_fsm.charts.registry import registered
from gms_fsm.systems.signals import Corners, Formula
from tests.scenario_files import (
    MEASURED,
    OPEN_LOOP,
    CommandLine,
    changed,
    nothing_written,
    one_message,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "given.toml"
    file.write_text(OPEN_LOOP)
    return file


# --------------------------------------------------------------------------- --set
@pytest.mark.parametrize(
    ("override", "place", "value"),
    [
        ("run.t_end=2.5", "run.t_end", 2.5),
        ("run.t_end = 3", "run.t_end", 3.0),
        ("run.rtol=1e-9", "run.rtol", 1e-9),
        ("model.law=published", "model.law", "published"),
        ("model.law='published'", "model.law", "published"),
        ("model.sigma=[1,2]", "model.sigma", [1.0, 2.0]),
        ("model.stribeck.F_s=2.0", "model.stribeck.F_s", 2.0),
        ("initial.states=['slip', 'stick']", "initial.states", ["slip", "stick"]),
        ("output={ every = 0.1 }", "output.every", 0.1),
        ('output.figures=["pdf"]', "output.figures", ["pdf"]),
        ("rig.velocity=0.2*sin(t)", "rig.velocity", "0.2*sin(t)"),
        ("rig.velocity=[[0, 0], [1, 2]]", "rig.velocity", [[0.0, 0.0], [1.0, 2.0]]),
        ("title=a = b", "title", "a = b"),
        ("title=", "title", ""),
        ("title=[bold] :warning:", "title", "[bold] :warning:"),
    ],
)
def test_a_key_is_set(override: str, place: str, value: object, path: Path) -> None:
    found: Any = load_scenario(path, [override]).scenario
    for part in place.split("."):
        found = getattr(found, part)
    assert found == value


def test_the_rest_stays_the_last_of_two_counts_and_a_file_is_corrected(path: Path) -> None:
    plain = load_scenario(path)
    other = load_scenario(path, ["run.t_end=2", "model.law=published", "run.t_end=3"])
    assert other.arguments == {**plain.arguments, "t_end": 3.0}
    assert "published" in other.model.title
    assert other.scenario.rig == plain.scenario.rig
    assert path.read_text() == OPEN_LOOP
    path.write_text(changed(OPEN_LOOP, "t_end = 1.0", ""))
    assert load_scenario(path, ["run.t_end=1.0"]).arguments["t_end"] == 1.0


def test_the_run_obeys(gms_fsm: CommandLine, path: Path) -> None:
    sets = ("model.law=published", "run.t_end=0.25", "title=Mine")
    done = gms_fsm("run", path, "-o", "out", *(word for each in sets for word in ("--set", each)))
    assert done.code == 0, done.err
    summary = Path("out/summary.md").read_text()
    assert summary.startswith("# Mine\n")
    assert "published law" in summary
    assert "t_end = 0.25" in summary


# --------------------------------------------------------------------------- schema
@pytest.fixture
def schema(gms_fsm: CommandLine) -> dict[str, Any]:
    done = gms_fsm("schema")
    assert done.code == 0
    assert done.err == ""
    text: dict[str, Any] = json.loads(done.out)
    return text


@pytest.fixture
def on_a_rig(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema of a model on a rig."""
    return dict(schema["$defs"]["Scenario"])


def test_the_schema_is_that_of_the_reader(schema: dict[str, Any], on_a_rig: dict[str, Any]) -> None:
    tables = schema["$defs"]
    for model, required in (
        (Scenario, {"model", "rig"}),
        (SystemScenario, {"name"}),
    ):
        keys = {field.alias or name for name, field in model.model_fields.items()}
        assert set(tables[model.__name__]["properties"]) == keys
        assert set(tables[model.__name__]["required"]) == required
    for name, table in tables.items():
        assert table["additionalProperties"] is False, name
    assert set(tables["GMSTable"]["required"]) == {"kind", "law"}
    assert tables["GMSTable"]["properties"]["law"]["enum"] == ["signed", "published"]
    rigs = on_a_rig["properties"]["rig"]["discriminator"]["mapping"]
    assert set(rigs) == {"prescribed", "record", "slider", "pulled", "belt"}
    by_kind, by_chart = on_a_rig["properties"]["model"]["oneOf"]
    assert set(by_kind["discriminator"]["mapping"]) == {"GMS", "LuGre"}
    assert set(by_chart["discriminator"]["mapping"]) == set(registered())


def test_every_reference_of_the_schema_resolves(schema: dict[str, Any]) -> None:
    found = re.findall(r'"(#/[^"]*)"', json.dumps(schema))
    assert len(found) > 50
    for reference in found:
        assert reference.removeprefix("#/$defs/") in schema["$defs"], reference


def test_a_chart_s_keys_are_its_parameters_with_units_and_rules(
    schema: dict[str, Any], on_a_rig: dict[str, Any]
) -> None:
    by_chart = on_a_rig["properties"]["model"]["oneOf"][1]["discriminator"]["mapping"]
    for name, entry in registered().items():
        table = schema["$defs"][by_chart[name].removeprefix("#/$defs/")]
        keys = table["properties"]
        own = {each.name for each in entry.parameters}
        shared = {"chart", "n", "sigma_2"} | ({"stribeck", "weights"} if entry.curve else set())
        shared |= {"law"} if entry.laws else set()
        others = ["inputs"] if {*entry.inputs} - {*SUPPLIED} else []
        assert set(keys) == own | shared | {*others}
        wanted = {"chart", *own, *others, *(["law"] if entry.laws else [])}
        assert set(table["required"]) == wanted | ({"stribeck"} if entry.curve else set())
        for each in entry.parameters:
            said = keys[each.name]["description"]
            assert each.unit
            assert f", {each.unit}" in said
            assert (each.rule in said) == (each.rule != "finite")
            assert ("array" in str(keys[each.name])) == each.per_element


# --------------------------------------------------------------------------- nothing is executed
PROGRAMS = [
    "__import__('os').mkdir('pwned')",
    "open('pwned', 'w')",
    "(lambda: open('pwned', 'w'))()",
    "[open(p, 'w') for p in ('pwned',)]",
    "t.__class__.__base__.__subclasses__()",
    "f'{open(1)}'",
]


@pytest.mark.parametrize("key", ["rig.velocity", "record.where"])
def test_a_program_in_a_scenario_is_rejected_and_never_run(
    key: str, gms_fsm: CommandLine, tmp_path: Path
) -> None:
    Path("given.toml").write_text(OPEN_LOOP if key == "rig.velocity" else MEASURED)
    Path("own.csv").write_text("t,x,F\n" + "".join(f"{i},{i},{i}\n" for i in range(9)))
    for program in PROGRAMS:
        one_message(gms_fsm("run", "given.toml", "--set", f'{key}="{program}"'), "column ")
        nothing_written(tmp_path, {"given.toml", "own.csv"})


def test_a_signal_is_an_expression_or_corners_never_a_function(path: Path) -> None:
    formula = load_scenario(path).rig
    assert isinstance(formula, Prescribed)
    assert isinstance(formula.signals["v"], Formula)
    ramps = load_scenario(path, ["rig.velocity=[[0, 0], [1, 2]]"]).rig
    assert isinstance(ramps.signals["v"], Corners)
    assert ramps.signals["v"].held


def test_a_solver_of_scipy_is_given_by_its_name(path: Path) -> None:
    assert load_scenario(path, ["run.method=Radau"]).arguments["method"] is Radau
