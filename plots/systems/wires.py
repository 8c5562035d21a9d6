"""Pieces of block diagrams whose positions are given, in points: wires, corners, labels.

Graphviz only draws what is placed here, so that every program that draws it gives the same sizes.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import hypot
from typing import Any

import graphviz

from plots.output.drawings import DrawnGraph
from plots.style import INK, PAPER, SANS

Point = tuple[float, float]

THIN, THICK = 1.1, 3.0  # lines of one value and of several
CORNER = 1.5  # how far an arrowhead's corner is beyond its tip, in widths of its outline
PLACED = {
    "layout": "neato",  # so that the DOT text is self-contained
    "inputscale": "72",  # positions are points, not inches
    "splines": "line",
    "outputorder": "nodesfirst",
    "pad": "0.2",
}


def blank(name: str, **node: str) -> DrawnGraph:
    """Return an empty diagram, whose nodes get places and sizes."""
    plain = {"fontname": SANS, "fontcolor": INK, "color": INK, "fixedsize": "true", "margin": "0"}
    return DrawnGraph(
        name=name,
        engine="neato",
        graph_attr=PLACED | {"bgcolor": PAPER},
        node_attr=plain | node,
        edge_attr={"color": INK, "arrowsize": "0.7", "penwidth": "1.1"},
    )


def placed(
    graph: graphviz.Digraph, name: str, at: Point, size: Point, label: str = "", **look: str
) -> None:
    """Draw a node around a place."""
    graph.node(name, label, id=name, pos=position(at), **(sides(size) | look))


def caption(
    graph: graphviz.Digraph, name: str, at: Point, text: str, width: float = 40, **look: str
) -> None:
    """Write a text, in the markup of Graphviz, around a place."""
    # With this, Graphviz does not warn of a text that it takes to be larger than its room.
    plain = {"shape": "plaintext", "fixedsize": "shape"}
    placed(graph, name, at, (width, 18), f"<{text}>", **(plain | look))


def joint(
    graph: graphviz.Digraph, name: str, at: Point, colour: str = INK, width: float = THIN
) -> None:
    """Draw a square of a wire's width where wires end or turn, so that corners have no notch."""
    # An outline would make it wider than its wire.
    look = {"shape": "box", "style": "filled", "fillcolor": colour, "peripheries": "0"}
    placed(graph, name, at, (width, width), **look)


def draw_wire(
    graph: graphviz.Digraph,
    name: str,
    start: str,
    corners: Sequence[Point],
    end: str,
    *,
    colour: str = INK,
    arrow: str = "forward",
    width: float = THIN,
    tip: float = THIN,
    kind: str = "wire",
    style: str = "solid",
) -> None:
    """Draw a line from node to node with corners between them."""
    stops = [start, *(f"{name}-corner{k}" for k in range(1, len(corners) + 1)), end]
    for stop, corner in zip(stops[1:], corners, strict=False):  # the last stop is not a corner
        joint(graph, stop, corner, colour, width)
    for k, (here, there) in enumerate(pairwise(stops), start=1):
        first, last = here == start, there == end
        heads = {(True, True): "both", (True, False): "back", (False, True): "forward"}
        shown = heads.get((first and arrow == "both", last and arrow != "none"), "none")
        graph.edge(
            here,
            there,
            id=f"{name}-{k}",
            **{"class": kind},
            color=colour,
            penwidth=f"{tip if last else width:g}",
            style=style,
            # A line that ended at the side of a corner's square would leave a gap.
            tailclip=str(first).lower(),
            headclip=str(last).lower(),
            dir=shown,
        )


def draw_path(
    graph: graphviz.Digraph,
    name: str,
    path: Sequence[Point],
    *,
    arrow: str = "forward",
    tip: float = THIN,
    **look: Any,
) -> None:
    """Draw a wire between two places, where no node is; a tip ends before its place."""
    ends = f"{name}-first", f"{name}-last"
    # The outline of an arrowhead has a corner beyond its tip, which would be in the frame there.
    back = CORNER * tip
    first = _moved(path[0], path[1], back if arrow == "both" else 0.0)
    last = _moved(path[-1], path[-2], back if arrow != "none" else 0.0)
    joint(graph, ends[0], first)
    joint(graph, ends[1], last)
    draw_wire(graph, name, ends[0], path[1:-1], ends[1], arrow=arrow, tip=tip, **look)


def _moved(at: Point, towards: Point, far: float) -> Point:
    """Return a place moved towards another one."""
    x, y = towards[0] - at[0], towards[1] - at[1]
    part = far / (hypot(x, y) or 1.0)
    return at[0] + part * x, at[1] + part * y


def position(at: Point) -> str:
    """Return a place as Graphviz reads it."""
    return f"{at[0]:g},{at[1]:g}!"


def sides(of: Point) -> dict[str, str]:
    """Return width and height as attributes of a node."""
    return {"width": f"{of[0] / 72:.4f}", "height": f"{of[1] / 72:.4f}"}
