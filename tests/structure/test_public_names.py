"""Claim: each public name can be imported from `gms_fsm` in any order, and loads only its needs."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
import tomllib
import types
from pathlib import Path

import pytest

import gms_fsm
from gms_fsm import errors
from gms_fsm.traces import failures
from tests.helpers import ROOT
from tests.structure.source import PACKAGES, sources

LARGE = "matplotlib pygraphviz plots pandas IPython pydantic scipy"
HEAD = """
from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, PulledSlider, Slider, Stribeck, simulate
model = GMS(GMSParameters.paper("stick-slip"), law="signed")
"""
LOADED = {  # code, what it loads and what it does not
    "the façade": (
        "import gms_fsm; dir(gms_fsm)",
        "gms_fsm",
        f"{LARGE} llvmlite numpy transitions typer integrators",
    ),
    "integrators": ("import integrators", "integrators", f"{LARGE} llvmlite gms_fsm transitions"),
    "simulating": (
        HEAD + 'assert len(simulate(model, Prescribed("0.2*sin(2*pi*t/20)"), 21.0).transitions)\n'
        "lugre = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))\n"
        'simulate(lugre, Slider(1.0, "0.1*t"), 0.1).columns()',
        "gms_fsm integrators transitions numpy",
        f"{LARGE} llvmlite",
    ),
    "machine code": (
        HEAD + "from gms_fsm import sweep; rig = PulledSlider(1.0, 2.0, 0.1)\n"
        'simulate(model, rig, 1.0, engine="compiled").columns()\n'
        'sweep(model, rig, 1.0, {"sigma_2": [0.1, 0.2]}, engine="compiled")',
        "llvmlite",
        LARGE,
    ),
    "command line": (
        "from gms_fsm.app.cli import main; import sys; sys.argv[1:] = ['run', 'none.toml']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass",
        "typer pydantic",
        "matplotlib pygraphviz pandas IPython scipy llvmlite",
    ),
    "pictures": ("import plots; plots.statechart", "plots gms_fsm", "matplotlib pandas llvmlite"),
    "files": (
        HEAD + "from gms_fsm import Trace; import os, tempfile; os.chdir(tempfile.mkdtemp())\n"
        'Trace.load(simulate(model, Prescribed("0.1*t"), 1.0).save("run.npz"))',
        "pydantic",
        "matplotlib pandas",
    ),
}


def _python(code: str, cwd: Path = ROOT) -> str:
    """Run code in a fresh interpreter and return what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=cwd, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", LOADED)
def test_what_is_loaded(name: str) -> None:
    code, needed, unused = LOADED[name]
    if name == "machine code":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    said = _python(f"{code}\nimport json, sys; print(json.dumps(list(sys.modules)))")
    loaded = {each.partition(".")[0] for each in json.loads(said)}
    assert {*needed.split()} <= loaded
    assert loaded & {*unused.split()} == set()


@pytest.mark.slow
def test_a_fresh_process_has_every_name_before_and_after_its_module() -> None:
    _python("""
import importlib, types, gms_fsm
for place, name in enumerate(gms_fsm.__all__):
    early = getattr(gms_fsm, name) if place % 2 else None
    late = getattr(importlib.import_module("gms_fsm." + gms_fsm._HOME[name]), name)
    assert getattr(gms_fsm, name) is late and early in (None, late), name
    assert not isinstance(late, types.ModuleType), name
""")


@pytest.mark.slow
def test_public_names_are_those_that_type_checkers_see_and_no_rooms() -> None:
    branch = next(node for node in sources()["gms_fsm"].tree.body if isinstance(node, ast.If))
    told = {
        alias.asname: node.module
        for node in branch.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.name == alias.asname
    }
    assert told == {name: f"gms_fsm.{home}" for name, home in gms_fsm._HOME.items()}
    rooms = {path.stem for path in Path(gms_fsm.__file__).parent.iterdir()}
    assert rooms & set(gms_fsm.__all__) == set()
    ours = {
        name
        for module in (errors, failures)
        for name, value in vars(module).items()
        if isinstance(value, type) and issubclass(value, errors.GMSError)
    }
    assert len(ours) > 10
    assert ours | {"Rig", "Model", "Signal"} <= set(gms_fsm.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    assert not hasattr(gms_fsm, "simulatte")
    assert not isinstance(gms_fsm.simulate, types.ModuleType)
    with pytest.raises(ImportError, match="simulatte"):
        exec("from gms_fsm import simulatte")


@pytest.mark.slow
def test_a_file_that_shadows_a_package_is_named(tmp_path: Path) -> None:
    """Python prefers any package to a folder without __init__.py."""
    (tmp_path / "c" / "plots").mkdir(parents=True)
    hiding = {"a": "plots.py", "b": "integrators.py", "d": "integrators/__init__.py"}
    for folder, file in hiding.items():
        (tmp_path / folder / file).parent.mkdir(parents=True)
        (tmp_path / folder / file).write_text("")
    said = _python(
        f"""
import sys
for folder in "abcd":
    sys.path[:0] = [{str(tmp_path)!r} + "/" + folder, {str(ROOT)!r}]
    try:
        import gms_fsm
    except ImportError as error:
        print(error)
    del sys.path[:2]
    for name in [each for each in sys.modules if each.startswith(("gms_fsm", "plots", "integ"))]:
        del sys.modules[name]
""",
        tmp_path,
    )
    assert said.splitlines() == [
        f"{tmp_path / folder / file} hides the package {Path(file).parts[0].partition('.')[0]!r} "
        "of gms-fsm; rename that file or folder, or run Python from another folder"
        for folder, file in hiding.items()
    ]


def test_every_file_goes_into_the_wheel() -> None:
    """`make wheel` builds and tests one; this test is faster and names the missing file."""
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    tool = tool["setuptools"]
    assert [each.removesuffix("*") for each in tool["packages"]["find"]["include"]] == [*PACKAGES]
    assert set(tool["package-data"]) == {"*"}
    files = [
        path
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        # fontconfig 2.13 writes a .uuid next to fonts that it has read.
        if path.is_file() and "__pycache__" not in path.parts and path.name != ".uuid"
    ]
    assert {".js", ".css", ".c", ".typed", ".html"} <= {path.suffix for path in files}
    assert [f.parent for f in files if not (f.parent / "__init__.py").is_file()] == []
    data = [path for path in files if path.suffix != ".py"]
    assert [f for f in data if not any(map(f.match, tool["package-data"]["*"]))] == []
