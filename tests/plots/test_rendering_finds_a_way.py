"""A picture is written with any available Graphviz, or as DOT text if there is none.

The chain is: program ``dot`` on PATH, package pygraphviz, DOT text with a warning. Every
failure is an error of this package, and no incomplete file is left behind.
"""

from __future__ import annotations

import shutil
import struct
import sys
import time
import warnings
from pathlib import Path
from xml.etree import ElementTree

import graphviz
import pytest

from gms_fsm.charts import GMS_ELEMENT, LUGRE
from gms_fsm.errors import OutputError, ParameterError
from plots.block_diagram import block_diagram
from plots.render import render
from plots.statechart import statechart

BEGINS = {".svg": b"<?xml", ".png": b"\x89PNG\r\n", ".pdf": b"%PDF-"}
GRAPHS = {"chart": statechart(GMS_ELEMENT["signed"], 2), "blocks": block_diagram(3)}

needs_dot = pytest.mark.skipif(shutil.which("dot") is None, reason="needs the program dot on PATH")


@pytest.fixture
def no_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide every program."""
    monkeypatch.setenv("PATH", "")


@pytest.fixture
def no_graphviz(no_program: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide the package too."""
    monkeypatch.setitem(sys.modules, "pygraphviz", None)


@pytest.fixture
def no_package(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide the package only."""
    monkeypatch.setitem(sys.modules, "pygraphviz", None)


def texts(svg: Path) -> list[str]:
    texts = ElementTree.parse(svg).iter("{http://www.w3.org/2000/svg}text")
    return sorted((text.text or "").replace("\xa0", " ").strip() for text in texts)


@needs_dot
@pytest.mark.parametrize("graph", GRAPHS.values(), ids=GRAPHS)
@pytest.mark.parametrize("suffix", BEGINS)
def test_program(graph: graphviz.Digraph, suffix: str, tmp_path: Path, no_package: None) -> None:
    path = tmp_path / f"picture{suffix}"
    assert render(graph, str(path)) == path
    assert path.read_bytes().startswith(BEGINS[suffix])
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("graph", GRAPHS.values(), ids=GRAPHS)
@pytest.mark.parametrize("suffix", BEGINS)
def test_package(graph: graphviz.Digraph, suffix: str, tmp_path: Path, no_program: None) -> None:
    pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    path = tmp_path / f"picture{suffix}"
    assert render(graph, path) == path
    assert path.read_bytes().startswith(BEGINS[suffix])
    assert list(tmp_path.iterdir()) == [path]


@needs_dot
@pytest.mark.parametrize("graph", GRAPHS.values(), ids=GRAPHS)
def test_program_and_package_show_the_same(
    graph: graphviz.Digraph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    by_program = render(graph, tmp_path / "program.svg")
    monkeypatch.setenv("PATH", "")
    by_package = render(graph, tmp_path / "package.svg")
    assert texts(by_program) == texts(by_package)


@pytest.mark.parametrize("graph", GRAPHS.values(), ids=GRAPHS)
def test_neither_gives_the_text_and_a_warning(
    graph: graphviz.Digraph, tmp_path: Path, no_graphviz: None
) -> None:
    with pytest.warns(UserWarning, match=r'DOT text: .* Graphviz, .*"gms-fsm\[render\]"') as caught:
        written = render(graph, tmp_path / "picture.svg")
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert written == tmp_path / "picture.dot"
    assert written.read_text(encoding="utf-8") == graph.source
    assert list(tmp_path.iterdir()) == [written]


@pytest.mark.parametrize("name", ["chart.dot", "chart.gv", "CHART.DOT"])
def test_text_needs_no_graphviz(name: str, tmp_path: Path, no_graphviz: None) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = render(GRAPHS["chart"], tmp_path / name)
    assert path == tmp_path / name
    assert path.read_text(encoding="utf-8") == GRAPHS["chart"].source


@needs_dot
def test_text_alone_tells_graphviz_how_to_draw(tmp_path: Path) -> None:
    """A reader may give the text to plain ``dot``; the positions of the diagram still hold."""
    text = render(GRAPHS["blocks"], tmp_path / "blocks.dot").read_text(encoding="utf-8")
    again = render(graphviz.Source(text, engine="dot"), tmp_path / "again.svg")
    direct = render(GRAPHS["blocks"], tmp_path / "direct.svg")
    assert again.read_bytes() == direct.read_bytes()


@pytest.mark.slow
@needs_dot
@pytest.mark.parametrize("suffix", BEGINS)
def test_same_graph_same_file(suffix: str, tmp_path: Path) -> None:
    first = render(GRAPHS["chart"], tmp_path / f"first{suffix}").read_bytes()
    time.sleep(1.1 if suffix == ".pdf" else 0.0)  # a PDF carries a date, in seconds
    assert render(GRAPHS["chart"], tmp_path / f"second{suffix}").read_bytes() == first


@needs_dot
def test_png_has_two_pixels_per_point(tmp_path: Path) -> None:
    png = render(GRAPHS["chart"], tmp_path / "chart.png").read_bytes()
    svg = ElementTree.parse(render(GRAPHS["chart"], tmp_path / "chart.svg")).getroot()
    (width,) = struct.unpack(">I", png[16:20])
    assert width == pytest.approx(2 * float(svg.get("width", "").removesuffix("pt")), abs=4)


@pytest.mark.parametrize("name", ["chart.jpg", "chart", "chart.svgz", ".svg", "chart.svg.bak"])
def test_another_suffix_is_rejected(name: str, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"\.svg, \.png, \.pdf .* \.dot, \.gv"):
        render(GRAPHS["chart"], tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["chart.dot", pytest.param("chart.svg", marks=needs_dot)])
def test_unwritable_folder_is_named(name: str, tmp_path: Path) -> None:
    blocked = tmp_path / "a-file"
    blocked.write_text("not a folder")
    with pytest.raises(OutputError, match=r"a-file.*choose another folder"):
        render(GRAPHS["chart"], blocked / name)
    with pytest.raises(OutputError, match="nowhere"):
        render(GRAPHS["chart"], tmp_path / "nowhere" / name)
    assert list(tmp_path.iterdir()) == [blocked]


def test_failed_write_leaves_no_trace(tmp_path: Path) -> None:
    folder = tmp_path / "chart.dot"
    folder.mkdir()
    with pytest.raises(OutputError, match=r"chart\.dot"):
        render(GRAPHS["chart"], folder)
    assert list(tmp_path.iterdir()) == [folder]


@needs_dot
def test_program_failing_is_an_error_with_its_message(tmp_path: Path) -> None:
    old = tmp_path / "chart.svg"
    old.write_text("the picture of yesterday")
    broken = graphviz.Digraph(body=["a [label=<<B>x</I>>]"])
    with pytest.raises(OutputError, match="mismatched tag"):
        render(broken, old)
    assert old.read_text() == "the picture of yesterday"


def test_package_failing_is_an_error(tmp_path: Path, no_program: None) -> None:
    pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    with pytest.raises(OutputError, match="pygraphviz"):
        render(graphviz.Digraph(body=["a -> -> b"]), tmp_path / "chart.svg")
    assert not list(tmp_path.iterdir())


def test_wrong_objects_and_missing_folders_are_reported(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="first the graph"):
        render("chart.svg", statechart(LUGRE))  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match=r"of a model its \.chart"):
        statechart("gms")  # type: ignore[arg-type]
    with pytest.raises(OutputError, match="create its folder first, or choose another"):
        render(statechart(LUGRE), tmp_path / "none" / "chart.dot")
