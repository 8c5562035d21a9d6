"""The block diagram connects what Fig. 2a connects, for any n, without overlaps or gaps.

Checked on the drawn SVG: the wires are followed from block to block, and must be exactly those of
the paper: v to the chart, the Stribeck curve and the viscous part; each element's rate through an
integrator back to the chart; each element's force and the viscous force into the sum; the sum to F.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import combinations

import pytest

from plots.systems.block_diagram import block_diagram
from tests.plots.pictures import SVG, Box, Picture, Point, points_of

SIZES = [1, 4, 20]
VECTORS = 5  # from here on the elements are drawn as vectors


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
    def box(self) -> Box:
        return Box.around([self.start, self.end])

    def covers(self, other: Wire) -> bool:
        """Return whether both run in parallel, too close to be distinguished."""
        for along, across in ((0, 1), (1, 0)):
            mine, its = (sorted((each.start[along], each.end[along])) for each in (self, other))
            shared = min(mine[1], its[1]) - max(mine[0], its[0])
            if shared > 3.0 and abs(self.start[across] - other.start[across]) < 5.0:
                return abs(other.end[across] - other.start[across]) < 0.5
        return False


class Diagram:
    """The contents of the SVG."""

    def __init__(self, n: int) -> None:
        self.picture = Picture(block_diagram(n))
        self.boxes: dict[str, Box] = {}
        self.classes: dict[str, set[str]] = {}
        self.texts: dict[str, str] = {}
        self.wires: list[Wire] = []
        for name, group in self.picture.groups.items():
            if "wire" in group.classes:
                tail, head = group.element.findtext(SVG + "title", "").split("->")
                path = group.element.find(SVG + "path")
                assert path is not None
                line = points_of(path.get("d", ""))
                arrow = bool(group.polygons)
                self.wires.append(Wire(name, tail, head, line[0], line[-1], arrow))
            elif "node" in group.classes:
                self.classes[name] = group.classes
                texts = group.element.iter(SVG + "text")
                self.texts[name] = "".join(text.text or "" for text in texts)
                if group.line or group.polygons:
                    self.boxes[name] = group.box

    def blocks(self) -> set[str]:
        return {name for name, kinds in self.classes.items() if kinds & {"block", "integrator"}}


@cache
def draw(n: int) -> Diagram:
    return Diagram(n)


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
def test_wires_are_those_of_the_paper(n: int) -> None:
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
    diagram = draw(n)
    assert connections(diagram) == expected
    blocks = {"v", "stribeck", "chart", "sigma_2", "sum", "F"}
    assert diagram.blocks() == blocks | {f"integrator{i}" for i in sets(n)}
    for i in sets(n):
        assert diagram.texts[f"chart-F{i}-name"] == f"F{i or f'1…{n}'}"


@pytest.mark.parametrize("n", SIZES)
def test_ports_sit_on_the_edge_of_their_block(n: int) -> None:
    diagram = draw(n)
    chart, total = diagram.boxes["chart"], diagram.boxes["sum"]
    borders = {f"chart-{port}": chart.left for port in ("v", "s")} | {"sum-viscous": total.left}
    for i in sets(n):
        borders |= {f"chart-z{i}": chart.left, f"sum-F{i}": total.left}
        borders |= {f"chart-F{i}": chart.right, f"chart-dz{i}": chart.right}
    for port, x in borders.items():
        box = diagram.boxes[port]
        block = chart if port.startswith("chart") else total
        assert (box.left + box.right) / 2 == pytest.approx(x, abs=1.0), port
        assert block.top < box.top < box.bottom < block.bottom, port


@pytest.mark.parametrize("n", SIZES)
def test_nothing_overlaps_feedback_lines_never_cross_and_pieces_meet(n: int) -> None:
    diagram = draw(n)
    blocks = {name: diagram.boxes[name] for name in diagram.blocks()}
    assert not [(a, b) for a, b in combinations(sorted(blocks), 2) if blocks[a].meets(blocks[b])]
    ends = {wire.head: wire.end for wire in diagram.wires if "corner" in wire.head}
    back: dict[str, list[Wire]] = {}
    for wire in diagram.wires:
        dx, dy = (abs(wire.end[k] - wire.start[k]) for k in (0, 1))
        assert min(dx, dy) < 0.5, f"{wire.id} is neither level nor upright"
        assert not [b for b in blocks if wire.box.meets(blocks[b], -2.5)], wire.id
        if "corner" in wire.tail:  # begins where the one before it ends
            assert wire.start == pytest.approx(ends[wire.tail], abs=0.05), wire.id
        if wire.id.startswith("deflection"):
            back.setdefault(wire.id.split("-")[0], []).append(wire)
    # Wires may cross at right angles; two on top of each other would read as one.
    assert not [(a.id, b.id) for a, b in combinations(diagram.wires, 2) if a.covers(b)]
    assert len(back) == len(sets(n))
    for one, other in combinations(back.values(), 2):
        assert not [(a.id, b.id) for a in one for b in other if a.box.meets(b.box, 1.0)]


def test_many_elements_are_vectors_and_take_no_more_room() -> None:
    four, twelve, twenty = (draw(n).picture for n in (4, 12, 20))
    assert (twelve.width, twelve.height) == (twenty.width, twenty.height)
    assert twelve.width <= four.width
    assert twelve.height <= four.height
    texts = draw(12).texts
    assert [texts[f"{wire}-count"] for wire in ("force", "rate", "deflection")] == ["12"] * 3
    # Subscripts need nothing of a viewer.
    assert not [each for each in four.root.iter() if each.get("baseline-shift")]
