"""The rules of the architecture hold: import layers, separation of knowledge, and no evaluation.

Checked on the source (by tokens, not by substrings) and in fresh interpreters.
"""

from __future__ import annotations

import functools
import io
import itertools
import json
import keyword
import re
import subprocess
import sys
import tokenize
import tomllib
from pathlib import Path

import pytest

from tests.helpers import ROOT

PACKAGES = ("gms_fsm", "integrators", "plots")


def _sources(*packages: str) -> list[Path]:
    return [path for package in packages for path in sorted((ROOT / package).rglob("*.py"))]


@functools.cache
def _tokens(path: Path) -> list[tokenize.TokenInfo]:
    return list(tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline))


def _calls(path: Path, function: str) -> list[int]:
    tokens = [t for t in _tokens(path) if t.type not in (tokenize.NL, tokenize.COMMENT)]
    return [
        one.start[0]
        for one, after in itertools.pairwise(tokens)
        if one.type == tokenize.NAME and one.string == function and after.string == "("
    ]


def _python(code: str) -> str:
    """Run code in a fresh interpreter in the project root and return its output."""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_import_contracts_hold() -> None:
    pytest.importorskip("importlinter", reason="needs import-linter (extra: dev)")
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports())",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    assert f"{len(contracts['contracts'])} kept, 0 broken" in done.stdout, done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("path", _sources("integrators"), ids=lambda p: p.name)
def test_integrators_know_nothing_about_friction(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert re.findall(r"(?i)\b(?:slip|stick|friction|stribeck|bristle)\w*", text) == []
    assert "gms" not in text.lower()  # nor its callers: messages to users come from them
    names = {t.string for t in _tokens(path) if t.type == tokenize.NAME}
    assert "z" not in names
    imported = {
        re.split(r"[.\s]", line.split(None, 1)[1])[0]
        for line in text.splitlines()
        if re.match(r"\s*(?:from|import)\s", line)
    }
    outside = (
        imported - set(sys.stdlib_module_names) - {"integrators", "numpy", "scipy", "llvmlite"}
    )
    assert outside == set()


@pytest.mark.parametrize("path", _sources(*PACKAGES), ids=lambda p: f"{p.parent.name}/{p.name}")
def test_nothing_is_evaluated(path: Path) -> None:
    assert _calls(path, "eval") == []
    expected = path == ROOT / "gms_fsm" / "lowering" / "generated.py"
    assert bool(_calls(path, "exec")) == expected
    # The front end compiles the text of a function only to compare it with the code that is loaded.
    compared = path == ROOT / "integrators" / "machine_code" / "front_end" / "sources.py"
    assert bool(_bare(path, "compile")) == (expected or compared)


def _bare(path: Path, function: str) -> list[int]:
    """Return calls of a builtin; re.compile and similar are methods."""
    tokens = _tokens(path)
    return [
        one.start[0]
        for before, one, after in zip(tokens, tokens[1:], tokens[2:], strict=False)
        if one.string == function and after.string == "(" and before.string not in (".", "def")
    ]


@pytest.mark.parametrize("package", PACKAGES)
def test_there_is_source_to_check(package: str) -> None:
    assert len(_sources(package)) >= 3


def test_the_search_by_tokens_finds_calls(tmp_path: Path) -> None:
    path = tmp_path / "example.py"
    path.write_text("# eval(1)\ntext = 'eval(1)'\nevaluate(1)\nmodel.eval\neval (1)\nexec(text)\n")
    assert _calls(path, "eval") == [5]
    assert _calls(path, "exec") == [6]
    path = tmp_path / "other.py"
    path.write_text("re.compile('a')\ndef compile(a): ...\ncompile('a')\n")
    assert _bare(path, "compile") == [3]


# What simulating does not need: drawing, reading files, integrators of others.
UNUSED = {"matplotlib", "pygraphviz", "plots", "pandas", "IPython", "pydantic", "scipy"}


@pytest.mark.slow
def test_simulating_loads_nothing_that_draws_or_reads_files() -> None:
    code = """
import json, sys
from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, Slider, Stribeck, simulate
model = GMS(GMSParameters.paper("stick-slip"), law="signed")
assert len(simulate(model, Prescribed("0.2*sin(2*pi*t/20)"), 21.0).transitions) > 0
lugre = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
simulate(lugre, Slider(1.0, "0.1*t"), 0.1).columns()
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""
    loaded = set(json.loads(_python(code)))
    assert {"gms_fsm", "integrators", "transitions", "numpy"} <= loaded
    assert loaded & (UNUSED | {"llvmlite"}) == set()


@pytest.mark.slow
def test_machine_code_loads_llvmlite_and_nothing_else_that_is_large() -> None:
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    code = """
import json, sys
from gms_fsm import GMS, GMSParameters, PulledSlider, simulate, sweep
model = GMS(GMSParameters.paper("stick-slip"), law="signed")
simulate(model, PulledSlider(1.0, 2.0, 0.1), 1.0, engine="compiled").columns()
sweep(model, PulledSlider(1.0, 2.0, 0.1), 1.0, {"sigma_2": [0.1, 0.2]}, engine="compiled")
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""
    loaded = set(json.loads(_python(code)))
    assert "llvmlite" in loaded
    assert loaded & UNUSED == set()


@pytest.mark.slow
def test_files_load_what_they_need_when_used() -> None:
    code = """
import json, sys, tempfile, pathlib
from gms_fsm import GMS, GMSParameters, Prescribed, Trace, simulate
model = GMS(GMSParameters.paper("stick-slip"), law="signed")
trace = simulate(model, Prescribed("0.1*t"), 1.0)
before = "pydantic" in sys.modules
with tempfile.TemporaryDirectory() as folder:
    Trace.load(trace.save(pathlib.Path(folder, "run.npz")))
print(json.dumps([before, "pydantic" in sys.modules]))
"""
    assert json.loads(_python(code)) == [False, True]


@pytest.mark.parametrize("name", ["gms_fsm", "integrators"])
def test_importing_a_package_loads_nothing_large(name: str) -> None:
    code = f"import json, sys, {name}\nprint(json.dumps(sorted(sys.modules)))"
    loaded = {each.partition(".")[0] for each in json.loads(_python(code))}
    assert name in loaded
    assert loaded & (UNUSED | {"llvmlite", "transitions"}) == set()


def test_integrators_load_no_other_package_of_ours() -> None:
    code = "import json, sys, integrators\nprint(json.dumps(sorted(sys.modules)))"
    loaded = {name.partition(".")[0] for name in json.loads(_python(code))}
    assert "integrators" in loaded
    assert loaded & {"gms_fsm", "plots", "transitions"} == set()


CORE = [p for p in _sources("gms_fsm") if p.parent.name != "paper"]


@pytest.mark.slow
@pytest.mark.parametrize("path", CORE, ids=lambda p: p.name)
def test_no_switching_outside_the_charts(path: Path) -> None:
    # States are named only in charts; code that compares with such a name has its own rule.
    if path.parent.name == "charts" or "lessons" in path.relative_to(ROOT).parts:
        return
    tokens = [t for t in _tokens(path) if t.type in (tokenize.NAME, tokenize.OP, tokenize.STRING)]
    for before, one in itertools.pairwise(tokens):
        compared = before.string in ("==", "!=") or keyword.iskeyword(before.string)
        if one.type == tokenize.STRING and compared:
            assert one.string.strip("\"'") not in {"stick", "slip"}, f"line {one.start[0]}"
