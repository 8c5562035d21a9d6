"""Claim: each public name can be imported from `gms_fsm` in a fresh process, in any order."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
import types
from pathlib import Path

import pytest

import gms_fsm
from gms_fsm import errors
from gms_fsm.traces import failures

ROOT = Path(gms_fsm.__file__).parents[1]


def _python(code: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Run code in a fresh interpreter."""
    return subprocess.run(
        [sys.executable, "-c", code], cwd=cwd, capture_output=True, text=True, check=False
    )


@pytest.mark.slow
@pytest.mark.parametrize("first", ["name", "module"])
def test_a_fresh_process_has_every_name_before_and_after_its_module(first: str) -> None:
    code = f"""
import importlib, types, gms_fsm
homes = gms_fsm._HOME
for name in gms_fsm.__all__ if {first == "name"} else gms_fsm.__all__[::-1]:
    early = getattr(gms_fsm, name) if {first == "name"} else None
    home = importlib.import_module("gms_fsm." + homes[name])
    late = getattr(gms_fsm, name)
    assert late is getattr(home, name) and (early is late or early is None), name
    assert not isinstance(late, types.ModuleType), name
"""
    done = _python(code)
    assert done.returncode == 0, done.stderr


def test_no_subpackage_has_the_name_of_a_public_function() -> None:
    rooms = {path.stem for path in Path(gms_fsm.__file__).parent.iterdir()}
    assert len(rooms) >= 8
    assert rooms & set(gms_fsm.__all__) == set()


def test_type_checkers_and_python_see_the_same_names() -> None:
    tree = ast.parse(Path(gms_fsm.__file__).read_text(encoding="utf-8"))
    branch = next(node for node in tree.body if isinstance(node, ast.If))
    told = {
        alias.asname: node.module
        for node in branch.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.name == alias.asname
    }
    assert told == {name: f"gms_fsm.{home}" for name, home in gms_fsm._HOME.items()}


def test_all_errors_are_public() -> None:
    ours = {
        name
        for module in (errors, failures)
        for name, value in vars(module).items()
        if isinstance(value, type) and issubclass(value, errors.GMSError)
    }
    assert len(ours) > 10
    assert ours <= set(gms_fsm.__all__)
    assert {"Rig", "Model", "Signal"} <= set(gms_fsm.__all__)


def test_importing_the_package_imports_no_numbers() -> None:
    done = _python(
        "import json, sys, gms_fsm; dir(gms_fsm); print(json.dumps(sorted(sys.modules)))"
    )
    loaded = {name.partition(".")[0] for name in json.loads(done.stdout)}
    assert loaded & {"numpy", "scipy", "transitions", "typer", "pydantic", "integrators"} == set()


def test_an_unknown_name_is_an_attribute_error() -> None:
    assert not hasattr(gms_fsm, "simulatte")
    assert not isinstance(gms_fsm.simulate, types.ModuleType)
    with pytest.raises(ImportError, match="simulatte"):
        exec("from gms_fsm import simulatte")


def test_a_file_that_shadows_a_package_is_named(tmp_path: Path) -> None:
    """Python prefers any package to a folder without __init__.py."""
    hiding = {"a": "plots.py", "b": "integrators.py", "c": "plots", "d": "integrators/__init__.py"}
    for folder, file in hiding.items():
        place = tmp_path / folder / file
        (place if folder == "c" else place.parent).mkdir(parents=True)
        if folder != "c":
            place.write_text("")
    code = f"""
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
"""
    done = _python(code, tmp_path)
    assert done.stdout.splitlines() == [
        f"{tmp_path / folder / file} hides the package {name!r} of gms-fsm; rename that file or "
        "folder, or run Python from another folder"
        for (folder, file), name in zip(
            [each for each in hiding.items() if each[0] != "c"],
            ["plots", "integrators", "integrators"],
            strict=True,
        )
    ]
