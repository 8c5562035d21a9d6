"""One table defines the file formats; a new row works wherever files are named.

Command line and its help, `plots.render`, figures, scenario files and their schema, the debugger,
animations and replay pages, and every message about a wrong ending.
"""

from __future__ import annotations

import ast
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import plots
from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.app.scenario import Scenario
from gms_fsm.charts import LUGRE
from gms_fsm.errors import MissingExtraError, ParameterError
from gms_fsm.exporters import formats as exported
from plots.output import formats
from plots.output.formats import FORMATS, Format, Written, of, register
from tests.helpers import ROOT, stick_slip
from tests.scenario_files import OPEN_LOOP, CommandLine, one_message

SUBJECTS: tuple[Written, ...] = ("graph", "chart", "figure", "animation", "page")


@pytest.fixture(autouse=True)
def _own_table(monkeypatch: pytest.MonkeyPatch) -> None:
    assert exported()  # all are in the table
    monkeypatch.setattr("gms_fsm.formats.FORMATS", list(FORMATS))


@pytest.fixture(scope="module")
def trace() -> Trace:
    return simulate(stick_slip("signed"), Prescribed("0.2"), 2.0)


def new(subject: Written, **fields: Any) -> Format:
    """Return a format that writes the type of its input."""

    def write(made: object) -> bytes:
        return type(made).__name__.encode()

    given = {"name": ".new", "kind": "a name", "writer": "a test", "write": write}
    return Format(**{**given, "subject": subject, **fields})


# --------------------------------------------------------------------------- one new row
@pytest.mark.slow
def test_a_new_format_of_graphs_or_of_charts_only(gms_fsm: CommandLine) -> None:
    register(new("graph"))
    register(new("chart", name=".own", kind="a text"))
    for verb in (["chart", "lugre"], ["blocks"]):
        assert gms_fsm(*verb, "-o", "a.new").out == "a.new\n"
        assert Path("a.new").read_text().endswith("aph")  # ChartGraph, Digraph
        assert ".new for a name" in gms_fsm(verb[0], "--help").out
        one_message(gms_fsm(*verb, "-o", "a.bmp"), "path is 'a.bmp'; it must", ".new for a name")
    assert gms_fsm("chart", "lugre", "-o", "a.OWN").out == "a.OWN\n"
    assert ".own" not in gms_fsm("blocks", "--help").out
    one_message(gms_fsm("blocks", "-o", "a.own"), "it must end in .svg")


@pytest.mark.slow
def test_a_new_format_of_figures(gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    register(new("figure"))
    Path("own.toml").write_text(OPEN_LOOP)
    assert gms_fsm("run", "own.toml", "-o", "out", "--set", 'output.figures=["new"]').code == 0
    assert Path("out/overview.new").read_text() == "Figure"
    assert "new" in json.dumps(Scenario.model_json_schema())
    one_message(
        gms_fsm("run", "own.toml", "--set", 'output.figures=["bmp"]'),
        "output.figures.0 = 'bmp': it must be 'png', 'svg', 'pdf' or 'new'",
    )
    monkeypatch.setattr("sys.stdin", io.StringIO("plot a.new\nplot a.bmp\nquit\n"))
    done = gms_fsm("debug", "own.toml")
    assert ".png, .svg, .pdf for a figure or .new for" in " ".join(done.out.split())
    assert Path("a.new").read_text() == "Figure"


@pytest.mark.slow
def test_a_new_format_of_films_and_of_pages(gms_fsm: CommandLine, trace: Trace) -> None:
    for module in ("matplotlib", "uplot", "pygraphviz"):
        pytest.importorskip(module, reason="films and pages need the extras that draw them")
    count = new("animation", kind="an animation", write=lambda m: b"%d" % len(list(m.pictures())))
    register(count)
    register(new("page", name=".own"))
    trace.save("t.npz")
    assert gms_fsm("animate", "t.npz", "-o", "a.new", "--frames", "3").out == "a.new\n"
    assert Path("a.new").read_text() == "3"
    assert gms_fsm("replay", "t.npz", "-o", "a.own").out == "a.own\n"
    assert Path("a.own").read_text() == "Replay"
    for verb, ending in (("animate", ".new"), ("replay", ".own")):
        assert ending in gms_fsm(verb, "--help").out
        one_message(gms_fsm(verb, "t.npz", "-o", "a.avi"), "it must end in", ending)


@pytest.mark.slow
def test_a_usual_format_is_written_by_default(
    gms_fsm: CommandLine, trace: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    others = [each for each in FORMATS if not (each.subject == "figure" and each.usual)]
    monkeypatch.setattr("gms_fsm.formats.FORMATS", others)
    register(new("figure", usual=True))
    trace.save("t.npz")
    assert gms_fsm("plot", "t.npz", "-o", "out").code == 0
    Path("own.toml").write_text(OPEN_LOOP.replace("figures = []\n", ""))
    assert gms_fsm("run", "own.toml", "-o", "ran").code == 0
    assert Path("ran/overview.new").read_text() == "Figure"
    assert Path("out/ribbons.new").read_text() == "Figure"


def test_a_missing_extra_is_reported_and_a_graph_is_written_as_text(tmp_path: Path) -> None:
    def write(_: object) -> bytes:
        raise MissingExtraError("the writer is away")

    register(new("graph", write=write, extra="render"))
    with pytest.warns(UserWarning, match="charts are written as DOT text: the writer is away"):
        path = plots.render(plots.statechart(LUGRE), tmp_path / "a.new")
    assert path == tmp_path / "a.dot"
    assert "digraph" in path.read_text()


# --------------------------------------------------------------------------- wrong rows
def test_a_format_is_registered_once_under_a_proper_ending_with_a_known_subject() -> None:
    register(new("figure"))
    register(new("page"))
    with pytest.raises(ParameterError, match=r"the subject 'page' already has a format \.new"):
        register(new("page"))
    for ending in ("", "new", ".", ".New", ".a.b", " .a", 5):
        with pytest.raises(ParameterError, match=re.escape(f"name is {ending!r}; it must be a")):
            new("figure", name=ending)
    with pytest.raises(ParameterError, match=r"subject is 'film'; it must be 'graph', "):
        new("film")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match=r"extra is 'fats'; it must be '', 'plots', "):
        new("figure", extra="fats")


# --------------------------------------------------------------------------- no second list
KNOWN = {word for each in of(*SUBJECTS) for word in (each.name, each.name[1:])}
MENTIONED = re.compile(rf"(?<![\w.])({'|'.join(re.escape(e.name) for e in of(*SUBJECTS))})(?!\w)")

NAMED = re.compile("|".join(re.escape(each.name[1:]) for each in of(*SUBJECTS)))


def lists_of_endings(text: str) -> Iterator[str]:
    """Yield the places in a module that name several endings, including docstrings."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if len(set(MENTIONED.findall(node.value))) > 1:
                yield f"line {node.lineno}: {node.value[:60]!r}"
        elif isinstance(node, ast.Tuple | ast.List | ast.Set | ast.Dict):
            parts = node.keys if isinstance(node, ast.Dict) else node.elts
            named = {p.value for p in parts if isinstance(p, ast.Constant)}
            if len(named & KNOWN) > 1:
                yield f"line {node.lineno}: {sorted(named & KNOWN)}"


@pytest.mark.slow
def test_no_module_lists_endings_beside_the_table() -> None:
    modules = [path for room in ("gms_fsm", "plots") for path in (ROOT / room).rglob("*.py")]
    assert len(modules) > 100
    texts = {path: path.read_text(encoding="utf-8") for path in modules}
    texts = {path: text for path, text in texts.items() if len(set(NAMED.findall(text))) > 1}
    found = {path: [*lists_of_endings(text)] for path, text in texts.items()}
    assert {path: places for path, places in found.items() if places} == {}


def test_a_list_is_found() -> None:
    assert list(lists_of_endings('x = ("png", 1, "svg")'))
    assert list(lists_of_endings('x = {".png": 1, ".svg": 2}'))
    assert list(lists_of_endings('x = f"ends in .png or .pdf{y}"'))
    assert list(lists_of_endings('"""Ends in ``.png``, ``.svg``."""'))
    assert not list(lists_of_endings('x = "a.png", "b.png", ".png", "svg"[0]'))


def test_pages_name_existing_endings() -> None:
    pages = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]
    said = [
        ending
        for page in pages
        for listed in re.findall(r"# or ((?:\.\w+(?:, )?)+)", page.read_text(encoding="utf-8"))
        for ending in listed.split(", ")
    ]
    assert len(said) > 4
    assert set(said) <= set(formats.endings(*SUBJECTS))
