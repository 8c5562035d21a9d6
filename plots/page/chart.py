"""The chart of a replay page: an SVG whose parts have roles and numbers instead of colours."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree

from gms_fsm.charts.chart import Chart
from plots.charts.labels import Row, edge_id, element_id, part_id
from plots.charts.statechart import ChartSheet
from plots.output.graphviz import drawn

MOST_CHARTS = 6  # a larger bank is shown as one chart, that of the selected element
SVG = "http://www.w3.org/2000/svg"
COLOURING = ("fill", "stroke", "stroke-dasharray", "stroke-width")


def chart_svg(chart: Chart, n: int) -> str:
    """Return the chart's SVG, prepared for restyling with roles and numbers instead of colours."""
    sheet = ChartSheet(chart, live=True).fitted()
    numbers = range(n if n <= MOST_CHARTS else 1)
    picture = drawn(sheet.graph(numbers, bare=len(numbers) == 1), "svg")
    if picture is None:
        return "<p>No chart: Graphviz was not found when this page was written.</p>"
    root = ElementTree.fromstring(picture)
    for node in root.iter():
        node.tag = node.tag.removeprefix(f"{{{SVG}}}")
        for title in node.findall(f"{{{SVG}}}title"):
            node.remove(title)  # browsers show titles as tooltips, and these are ids
        _give_role(node)
    # With its namespace, because a page that gets another picture later reads it as XML.
    root.attrib = {"xmlns": SVG, "viewBox": root.attrib["viewBox"]}
    groups = {group.get("id", ""): group for group in root.iter("g")}
    groups["graph0"].remove(groups["graph0"][0])  # the background; the page has its own
    _name_texts(groups["graph0"], sheet.definitions())
    for number in numbers:
        element, edges = element_id(number), 0
        groups.get(element, root).attrib |= {"data-slot": str(number)}
        for k, state in enumerate(chart.states):
            group = groups[part_id(element, "state", state.name)]
            group.attrib |= {"data-slot": str(number), "data-state": str(k)}
            _name_texts(group, sheet.state_rows(state, number))
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                guard = groups[edge_id(element, "guard", edge)]
                for part in (guard, groups[edge_id(element, "edge", edge)]):
                    part.attrib |= {"data-slot": str(number), "data-edge": str(edges)}
                _name_texts(guard, sheet.guard_rows(edge, priority, number))
                _make_button(guard)
                edges += 1
    return ElementTree.tostring(root, encoding="unicode")


def _give_role(node: ElementTree.Element) -> None:
    """Replace the colours of a shape by their role; the page's style sheet defines the themes."""
    drawing = [node.attrib.pop(name, None) for name in COLOURING]
    if node.tag not in ("path", "polygon", "polyline", "ellipse"):
        return
    fill, stroke, dashes, _ = drawing
    if dashes:
        role = "frame"
    elif fill == "none":
        role = "line"
    else:
        role = "ground" if stroke in ("none", "transparent") else "solid"
    node.set("class", role)


def _name_texts(group: ElementTree.Element, rows: Iterable[Row]) -> None:
    pieces = [piece for row in rows for piece in row]
    for piece, text in zip(pieces, group.findall("text"), strict=True):
        text.set("class", piece.role)
        if piece.clause >= 0:
            text.set("data-clause", str(piece.clause))


def _make_button(guard: ElementTree.Element) -> None:
    guard.attrib |= {"role": "button", "tabindex": "0"}
    corners = [point.split(",") for point in guard[0].attrib["points"].split()]
    x, y = (min(corner, key=float) for corner in zip(*corners, strict=True))  # left, above
    ElementTree.SubElement(guard, "circle", {"class": "stop", "cx": x, "cy": y, "r": "4.5"})
