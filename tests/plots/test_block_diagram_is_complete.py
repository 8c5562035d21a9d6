"""The block diagram connects what Fig. 2a connects, for any n, without overlaps or gaps.

Checked on the drawn SVG: the wires are followed from block to block, and must be exactly those of
the paper: v to the chart, the Stribeck curve and the viscous part; each element's rate through an
integrator back to the chart; each element's force and the viscous force into the sum; the sum to F.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gms_fsm.errors import ParameterError
from plots.block_diagram import block_diagram
from plots.render import render

SVG = "{http://www.w3.org/2000/svg}"
SIZES = [1, 2, 3, 4, 5, 12, 20]
VECTORS = 5  # from here on the elements are drawn as vectors

Point = tuple[float, float]


@dataclass(frozen=True)
class Wire:
    """One straight piece of a line."""

    id: str
    tail: str
    head: str
    start: Point
    end: Point
    arrow: bool

    @property
    def box(self) -> tuple[float, float, float, float]:
        return _box([self.start, self.end])

    def covers(self, other: Wire) -> bool:
        """Return whether both run in parallel, too close to be distinguished."""
        for along, across in ((0, 1), (1, 0)):
            mine, its = sorted((self.box[along::2], other.box[along::2]))
            shared = min(mine[1], its[1]) - its[0]
            if shared > 3.0 and abs(self.start[across] - other.start[across]) < 5.0:
                return abs(other.end[across] - other.start[across]) < 0.5
        return False


@dataclass(frozen=True)
class Diagram:
    """The contents of the SVG."""

    boxes: dict[str, tuple[float, float, float, float]]
    classes: dict[str, set[str]]
    texts: dict[str, str]
    wires: list[Wire]

    def blocks(self) -> set[str]:
        return {name for name, kinds in self.classes.items() if kinds & {"block", "integrator"}}


def _points(numbers: str) -> list[Point]:
    values = [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?", numbers)]
    return list(zip(values[::2], values[1::2], strict=True))


def _box(points: list[Point]) -> tuple[float, float, float, float]:
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def _overlap(
    a: tuple[float, float, float, float], b: tuple[float, float, float, float], margin: float
) -> bool:
    return (
        a[0] + margin < b[2]
        and b[0] + margin < a[2]
        and a[1] + margin < b[3]
        and b[1] + margin < a[3]
    )


Draw = Callable[[int], Diagram]


@pytest.fixture
def draw(tmp_path: Path) -> Draw:
    """Draw the diagram and read the SVG."""
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")

    def drawn(elements: int) -> Diagram:
        svg = render(block_diagram(elements), tmp_path / "blocks.svg")
        diagram = Diagram({}, {}, {}, [])
        for group in ElementTree.parse(svg).iter(SVG + "g"):
            name, kinds = group.get("id", ""), set(group.get("class", "").split())
            shapes = [
                point
                for kind, key in (("path", "d"), ("polygon", "points"))
                for shape in group.findall(f".//{SVG}{kind}")
                for point in _points(shape.get(key, ""))
            ]
            if "wire" in kinds:
                tail, head = group.findtext(SVG + "title", "").split("->")
                path = group.find(SVG + "path")
                assert path is not None
                line = _points(path.get("d", ""))
                arrow = group.find(SVG + "polygon") is not None
                diagram.wires.append(Wire(name, tail, head, line[0], line[-1], arrow))
            elif "node" in kinds:
                texts = (text.text or "" for text in group.iter(SVG + "text"))
                diagram.texts[name] = "".join(texts)
                diagram.classes[name] = kinds
                if shapes:
                    diagram.boxes[name] = _box(shapes)
        return diagram

    return drawn


def connections(diagram: Diagram) -> set[tuple[str, str]]:
    """Follow every wire through branches and corners to its arrowhead."""
    next_pieces: dict[str, list[Wire]] = {}
    for wire in diagram.wires:
        next_pieces.setdefault(wire.tail, []).append(wire)
    passing = {name for name in diagram.classes if "corner" in name} | {"branch"}

    def arrivals(start: str) -> set[str]:
        found = set()
        for wire in next_pieces.get(start, []):
            assert wire.arrow == (wire.head not in passing), wire.id
            found |= arrivals(wire.head) if wire.head in passing else {wire.head}
        return found

    return {(start, end) for start in set(next_pieces) - passing for end in arrivals(start)}


def sets(n: int) -> list[str]:
    """Return what ends the ids of the parts of each set of wires."""
    return [str(i) for i in range(1, n + 1)] if n < VECTORS else [""]


@pytest.mark.parametrize("n", SIZES)
def test_wires_are_those_of_the_paper(n: int, draw: Draw) -> None:
    expected = {
        ("v", "chart-v"),
        ("v", "stribeck"),
        ("stribeck", "chart-s"),
        ("v", "sigma_2"),
        ("sigma_2", "sum-viscous"),
        ("sum", "F"),
    }
    for i in sets(n):
        expected |= {
            (f"chart-F{i}", f"sum-F{i}"),
            (f"chart-dz{i}", f"integrator{i}"),
            (f"integrator{i}", f"chart-z{i}"),
        }
    assert connections(draw(n)) == expected


@pytest.mark.parametrize("n", SIZES)
def test_every_block_and_port_is_named(n: int, draw: Draw) -> None:
    diagram, of_all = draw(n), f"1…{n}"
    expected = {
        "v": "v",
        "stribeck": "s(v)",
        "sigma_2": "\N{GREEK SMALL LETTER SIGMA}2",
        "sum-name": "\N{GREEK CAPITAL LETTER SIGMA}",
        "F": "F",
        "chart-title": "GMS element chart" + (f" \N{MULTIPLICATION SIGN} {n}" if n > 1 else ""),
        "chart-v-name": "v",
        "chart-s-name": "s(v)",
        "sum-viscous-sign": "+",
    }
    for i in sets(n):
        expected |= {
            f"integrator{i}": "1s",
            f"chart-F{i}-name": f"F{i or of_all}",
            f"chart-dz{i}-name": f"dz{i or of_all}",
            f"chart-z{i}-name": f"z{i or of_all}",
            f"sum-F{i}-sign": "+",
        }
    assert {name: diagram.texts[name] for name in expected} == expected
    blocks = {"v", "stribeck", "chart", "sigma_2", "sum", "F"}
    assert diagram.blocks() == blocks | {f"integrator{i}" for i in sets(n)}


@pytest.mark.parametrize("n", SIZES)
def test_ports_sit_on_the_edge_of_their_block(n: int, draw: Draw) -> None:
    diagram = draw(n)
    chart, total = diagram.boxes["chart"], diagram.boxes["sum"]
    borders = {f"chart-{port}": chart[0] for port in ("v", "s")} | {"sum-viscous": total[0]}
    for i in sets(n):
        borders |= {f"chart-z{i}": chart[0], f"sum-F{i}": total[0]}
        borders |= {f"chart-F{i}": chart[2], f"chart-dz{i}": chart[2]}
    for port, x in borders.items():
        left, top, right, bottom = diagram.boxes[port]
        block = chart if port.startswith("chart") else total
        assert (left + right) / 2 == pytest.approx(x, abs=1.0), port
        assert block[1] < top < bottom < block[3], port


@pytest.mark.parametrize("n", SIZES)
def test_nothing_overlaps(n: int, draw: Draw) -> None:
    diagram = draw(n)
    blocks = {name: diagram.boxes[name] for name in diagram.blocks()}
    assert not [
        (a, b) for a, b in combinations(sorted(blocks), 2) if _overlap(blocks[a], blocks[b], 0.0)
    ]
    for wire in diagram.wires:
        dx, dy = (abs(wire.end[k] - wire.start[k]) for k in (0, 1))
        assert min(dx, dy) < 0.5, f"{wire.id} is neither level nor upright"
        assert not [b for b in blocks if _overlap(wire.box, blocks[b], 2.5)], wire.id
    # Wires may cross at right angles; two on top of each other would read as one.
    assert not [(a.id, b.id) for a, b in combinations(diagram.wires, 2) if a.covers(b)]


@pytest.mark.parametrize("n", SIZES)
def test_feedback_lines_never_cross(n: int, draw: Draw) -> None:
    lines: dict[str, list[Wire]] = {}
    for wire in draw(n).wires:
        if wire.id.startswith("deflection"):
            lines.setdefault(wire.id.split("-")[0], []).append(wire)
    assert len(lines) == len(sets(n))
    for one, other in combinations(lines.values(), 2):
        assert not [(a.id, b.id) for a in one for b in other if _overlap(a.box, b.box, -1.0)]


@pytest.mark.parametrize("n", SIZES)
def test_pieces_of_a_line_meet(n: int, draw: Draw) -> None:
    """Each piece begins where the one before it ends: in the middle of the corner's square."""
    diagram = draw(n)
    ends = {wire.head: wire.end for wire in diagram.wires if "corner" in wire.head}
    assert ends
    for wire in diagram.wires:
        if "corner" in wire.tail:
            assert wire.start == pytest.approx(ends[wire.tail], abs=0.05), wire.id


def test_texts_stay_apart(draw: Draw) -> None:
    """Signs, names and counts are in nodes of fixed size, which do not overlap."""
    for n in SIZES:
        rooms = {}
        for line in block_diagram(n).body:
            found = re.search(r'pos="(\S+?),(\S+?)!".*shape=plaintext', line)
            if found:
                name = re.search(r" id=\"?([\w-]+)", line)
                sizes = [re.search(rf"{side}=([\d.]+)", line) for side in ("width", "height")]
                assert name is not None
                assert all(sizes)
                x, y = float(found[1]), float(found[2])
                half = [36 * float(size[1]) for size in sizes if size]
                rooms[name[1]] = (x - half[0], y - half[1], x + half[0], y + half[1])
        assert len(rooms) > 5
        assert not [
            (n, a, b) for a, b in combinations(sorted(rooms), 2) if _overlap(rooms[a], rooms[b], 1)
        ]


def test_many_elements_take_no_more_room(tmp_path: Path, draw: Draw) -> None:
    def size(n: int) -> tuple[float, float]:
        draw(n)
        root = ElementTree.parse(tmp_path / "blocks.svg").getroot()
        return float(root.get("width", "")[:-2]), float(root.get("height", "")[:-2])

    four, twelve, twenty = size(4), size(12), size(20)
    assert twelve == twenty
    assert twelve[0] <= four[0]
    assert twelve[1] <= four[1]


def test_a_vector_says_how_many_values_it_has(draw: Draw) -> None:
    texts = draw(12).texts
    assert [texts[f"{wire}-count"] for wire in ("force", "rate", "deflection")] == ["12"] * 3


def test_subscripts_need_nothing_of_a_viewer(tmp_path: Path, draw: Draw) -> None:
    draw(4)
    assert "baseline-shift" not in (tmp_path / "blocks.svg").read_text()


def test_program_and_package_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("dot") is None:
        pytest.skip("needs the program dot")
    pytest.importorskip("pygraphviz", reason="needs the package pygraphviz")
    from plots._graphviz import drawn as drawing

    def drawn(graph: object) -> tuple[list[str], list[float]]:
        picture = drawing(graph, "svg")  # type: ignore[arg-type]
        assert picture is not None
        root = ElementTree.fromstring(picture)
        texts = sorted(text.text or "" for text in root.iter(SVG + "text"))
        return texts, [float(root.get(side, "")[:-2]) for side in ("width", "height")]

    for n in (1, 4, 12):
        texts, size = drawn(block_diagram(n))
        with monkeypatch.context() as patch:
            patch.setattr(shutil, "which", lambda _: None)
            other_texts, other_size = drawn(block_diagram(n))
        assert other_texts == texts
        assert other_size == pytest.approx(size, rel=0.02)


@pytest.mark.parametrize("elements", [0, -1, 2.5])
def test_a_model_without_elements_is_rejected(elements: int) -> None:
    with pytest.raises(ParameterError, match=f"elements is {elements}.*at least 1"):
        block_diagram(elements)
