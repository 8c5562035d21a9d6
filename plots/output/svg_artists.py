"""The SVG of a chart as matplotlib artists.

Graphviz lays out the chart and `plots.charts.live_chart` paints it; the painted SVG contains only
paths, polygons, circles and texts, which matplotlib draws. A chart therefore looks the same
everywhere, and no SVG converter is needed.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np

from plots.style.matplotlib import Artist, Axes, Curve, Figure, patches

# Letters are not moved to whole pixels, so that a line has the width of its cell.
EXACT: Any = {"text.hinting": "none"}
INDEX = 0.75  # an index is smaller than that, relative to the text before it


class SvgPart:
    """One part of the SVG and its artist.

    Parameters
    ----------
    node : Element
        Of the painted tree.
    artist : Artist
        Drawn for it.
    scale : float
        Size of the drawing, relative to that of the SVG.
    """

    def __init__(self, node: ElementTree.Element, artist: Artist, scale: float) -> None:
        self.node, self.artist, self.scale = node, artist, scale

    def update(self) -> None:
        """Update the artist from the tree."""
        get = self.node.get
        if self.node.tag == "text":
            shown = get("visibility") != "hidden"
            self.artist.set(color=get("fill"), text=self.node.text or "", visible=shown)
        else:
            fill, stroke = (
                "none" if get(name) in (None, "transparent") else get(name)
                for name in ("fill", "stroke")
            )
            width = self.scale * float(get("stroke-width") or 1.0)
            self.artist.set(facecolor=fill, edgecolor=stroke, linewidth=width)

    def draw(self, figure: Figure) -> None:
        """Draw the artist on the figure."""
        figure.draw_artist(self.artist)


def drawn(
    ax: Axes, root: ElementTree.Element, *, scale: float = 1.0, animated: bool = False
) -> Iterator[SvgPart]:
    """Make an artist for each part of the SVG, in its order."""
    (graph,) = root.findall("g")
    moved = re.search(r"translate\((\S+) (\S+)\)", graph.get("transform", ""))
    dx, dy = (float(n) for n in moved.groups()) if moved else (0.0, 0.0)
    for node in graph.iter():
        artist = _artist(ax, node, dx, dy, scale)
        if artist is not None:
            artist.set_animated(animated)
            part = SvgPart(node, artist, scale)
            part.update()
            yield part


def smallest(root: ElementTree.Element) -> float:
    """Return the size of the smallest text of an SVG but an index, points."""
    sizes = []
    for group in root.iter():
        before = 0.0
        for node in group.findall("text"):
            size = float(_font(node, 1.0)["fontsize"])
            if size > INDEX * before:
                before = size
                sizes.append(size)
    return min(sizes)


def _artist(
    ax: Axes, node: ElementTree.Element, dx: float, dy: float, scale: float
) -> Artist | None:
    get = node.get
    if node.tag == "text":
        return ax.text(
            float(get("x", "0")) + dx,
            float(get("y", "0")) + dy,
            "",
            ha={"start": "left", "middle": "center"}[get("text-anchor", "start")],
            va="baseline",
            fontweight=get("font-weight", "normal"),
            parse_math=False,
            **_font(node, scale),
        )
    if node.tag == "ellipse":
        at = (float(get("cx", "0")) + dx, float(get("cy", "0")) + dy)
        size = 2 * float(get("rx", "0")), 2 * float(get("ry", "0"))
        return ax.add_patch(patches.Ellipse(at, *size))
    if node.tag not in ("path", "polygon", "polyline"):
        return None
    numbers = [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?", get("d") or get("points") or "")]
    points = np.array(numbers).reshape(-1, 2) + (dx, dy)
    # Graphviz writes a path as M followed by cubic curves only.
    kind = Curve.CURVE4 if node.tag == "path" else Curve.LINETO
    codes = [Curve.MOVETO, *itertools.repeat(kind, len(points) - 1)]
    dashes = {"linestyle": (0, (5, 2))} if get("stroke-dasharray") else {}
    return ax.add_patch(patches.PathPatch(Curve(points, codes), **dashes))


def _font(node: ElementTree.Element, scale: float) -> dict[str, Any]:
    # The first of the families, which matplotlib has too, so that it never searches for fonts.
    family, *_ = node.get("font-family", "").split(",")
    return {"fontfamily": family, "fontsize": scale * float(node.get("font-size", "10"))}
