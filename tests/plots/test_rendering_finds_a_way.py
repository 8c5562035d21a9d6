"""A picture is written with any available Graphviz, or as DOT text if there is none.

The chain is: program ``dot`` on PATH, package pygraphviz, DOT text with a warning. Both draw the
same texts at the same places and sizes. Every failure is an error of this package, and no
incomplete file is left behind.
"""

from __future__ import annotations

import shutil
import struct
import sys
import time
import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import graphviz
import pytest

from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.errors import OutputError, ParameterError
from plots.charts.statechart import statechart
from plots.output.graphviz import drawn, picture
from plots.output.render import render
from plots.style.fonts import FOLDER
from plots.systems.block_diagram import block_diagram
from tests.plots.charts_to_draw import LONG_GUARDS, MANY_EDGES
from tests.plots.pictures import SVG, root_of, size_of
from tests.plots.systems_to_draw import SERVO

BEGINS = {".svg": b"<?xml", ".png": b"\x89PNG\r\n", ".pdf": b"%PDF-"}
SIGNED = GMS_ELEMENT["signed"]
GRAPHS = {"chart": statechart(SIGNED, 2), "blocks": block_diagram(3)}
ALIKE = {
    "twelve": statechart(SIGNED, 12, notation="math", direction="LR"),
    "40 edges": statechart(MANY_EDGES, direction="LR"),
    "long": statechart(LONG_GUARDS, direction="LR"),
    "blocks": block_diagram(4),
    "servo": block_diagram(SERVO),
}

needs_dot = pytest.mark.skipif(shutil.which("dot") is None, reason="needs the program dot on PATH")


def hide(patch: pytest.MonkeyPatch, *what: str) -> None:
    """Hide the program, the package, or both."""
    if "program" in what:
        patch.setenv("PATH", "")
    if "package" in what:
        patch.setitem(sys.modules, "pygraphviz", None)


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    "hidden", [pytest.param("package", marks=needs_dot), "program"], ids=["dot", "pygraphviz"]
)
def test_each_graphviz_writes_every_format_and_the_same_graph_is_the_same_file(
    hidden: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if hidden == "program":
        pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    hide(monkeypatch, hidden)
    files = {}
    for turn in ("first", "second"):
        for name, graph in GRAPHS.items():
            for suffix, begin in BEGINS.items():
                path = tmp_path / f"{turn} {name}{suffix}"
                assert render(graph, str(path)) == path
                files[turn, name, suffix] = path.read_bytes()
                assert files[turn, name, suffix].startswith(begin)
        if turn == "first":
            time.sleep(1.001 - time.time() % 1)  # a PDF carries a date, in seconds
    assert len(list(tmp_path.iterdir())) == len(files)
    for (turn, name, suffix), content in files.items():
        assert content == files["second", name, suffix], (turn, name, suffix)
    (width,) = struct.unpack(">I", files["first", "chart", ".png"][16:20])  # two pixels per point
    svg = ElementTree.fromstring(files["first", "chart", ".svg"])
    assert width == pytest.approx(2 * size_of(svg)[0], abs=4)


FONTS = """<?xml version="1.0"?>
<!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig><dir>%s</dir></fontconfig>
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "hidden", [pytest.param("package", marks=needs_dot), "program"], ids=["dot", "pygraphviz"]
)
def test_the_fonts_of_the_machine_change_no_picture_and_nothing_is_said(
    hidden: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """No fonts at all, DejaVu alone, Liberation alone if it is there."""
    if hidden == "program":
        pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    hide(monkeypatch, hidden)
    liberation = Path("/usr/share/fonts/truetype/liberation2")
    (tmp_path / "empty").mkdir()
    files = set()
    for fonts in (tmp_path / "empty", FOLDER, liberation):
        (tmp_path / "fonts.conf").write_text(FONTS % fonts, encoding="utf-8")
        monkeypatch.setenv("FONTCONFIG_FILE", str(tmp_path / "fonts.conf"))
        files.add(picture(GRAPHS["chart"], "png"))
        monkeypatch.setenv("FONTCONFIG_FILE", str(fonts))
        files.add(picture(GRAPHS["chart"], "png"))
    assert len(files) == 1
    assert capfd.readouterr() == ("", "")


def found_in(graph: Any) -> tuple[tuple[float, float], list[tuple[str, float, float]]]:
    root = root_of(graph)
    texts = [
        (each.text or "", float(each.get("x", "")), float(each.get("y", "")))
        for each in root.iter(SVG + "text")
    ]
    return size_of(root), texts


@pytest.mark.slow
@needs_dot
@pytest.mark.parametrize("name", ALIKE)
def test_program_and_package_draw_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    size, texts = found_in(ALIKE[name])
    hide(monkeypatch, "program")
    other_size, other_texts = found_in(ALIKE[name])
    assert other_size == pytest.approx(size, rel=0.02)
    assert [text for text, *_ in other_texts] == [text for text, *_ in texts]
    for (_, x, y), (_, other_x, other_y) in zip(texts, other_texts, strict=True):
        assert other_x == pytest.approx(x, abs=1.0 if "element1" in ALIKE[name].source else 3.0)
        assert other_y == pytest.approx(y, abs=2.5)


def test_neither_gives_the_text_and_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = GRAPHS["chart"]
    hide(monkeypatch, "program", "package")
    with pytest.warns(UserWarning, match=r'DOT text: .* Graphviz, .*"gms-fsm\[render\]"') as caught:
        written = render(graph, tmp_path / "picture.svg")
    assert [each.filename for each in caught] == [__file__]
    assert written == tmp_path / "picture.dot"
    assert written.read_text(encoding="utf-8") == graph.source
    assert list(tmp_path.iterdir()) == [written]
    for name in ("chart.gv", "CHART.DOT"):  # who asks for the text needs no Graphviz
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            path = render(graph, tmp_path / name)
        assert path == tmp_path / name
        assert path.read_text(encoding="utf-8") == graph.source


@needs_dot
def test_text_alone_tells_graphviz_how_to_draw(tmp_path: Path) -> None:
    """A reader may give the text to plain ``dot``; the positions of the diagram still hold."""
    text = render(GRAPHS["blocks"], tmp_path / "blocks.dot").read_text(encoding="utf-8")
    again = render(graphviz.Source(text, engine="dot"), tmp_path / "again.svg")
    direct = render(GRAPHS["blocks"], tmp_path / "direct.svg")
    assert again.read_bytes() == direct.read_bytes()


def test_what_cannot_be_written_is_refused_and_leaves_no_trace(tmp_path: Path) -> None:
    blocked, folder = tmp_path / "a-file", tmp_path / "chart.dot"
    blocked.write_text("not a folder")
    folder.mkdir()
    for path, kind in (
        *(
            (tmp_path / name, ParameterError)
            for name in ("chart.jpg", "chart", ".svg", "c.svg.bak")
        ),
        (blocked / "chart.dot", OutputError),
        (tmp_path / "nowhere" / "chart.dot", OutputError),
        (folder, OutputError),
    ):
        with pytest.raises(kind) as error:
            render(GRAPHS["chart"], path)
        assert str(path.name) in str(error.value) or str(path.parent) in str(error.value)
    with pytest.raises(ParameterError, match="first the graph"):
        render("chart.svg", GRAPHS["chart"])  # type: ignore[arg-type]
    assert sorted(tmp_path.iterdir()) == [blocked, folder]


@pytest.mark.parametrize(
    ("hidden", "text", "said"),
    [
        pytest.param("package", "a [label=<<B>x</I>>]", "mismatched tag", marks=needs_dot),
        ("program", "a -> -> b", r"pygraphviz.* syntax error"),
    ],
)
def test_a_graph_that_cannot_be_drawn_is_an_error_and_the_old_picture_is_kept(
    hidden: str, text: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if hidden == "program":
        pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    hide(monkeypatch, hidden)
    old = tmp_path / "chart.svg"
    old.write_text("the picture of yesterday")
    with pytest.raises(OutputError, match=said):
        render(graphviz.Digraph(body=[text]), old)
    assert old.read_text() == "the picture of yesterday"
    assert list(tmp_path.iterdir()) == [old]


@pytest.mark.parametrize("hidden", [pytest.param("package", marks=needs_dot), "program"])
def test_italics_are_slanted_though_no_slanted_font_is_shipped(
    hidden: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if hidden == "program":
        pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    hide(monkeypatch, hidden)
    face = 'fontname="DejaVu Sans"'
    upright, slanted = (
        drawn(graphviz.Digraph(body=[f"a [{face} label=<{text}>]"]), "png")
        for text in ("<B>v</B>", "<B><I>v</I></B>")
    )
    assert upright is not None
    assert upright != slanted
