"""What a chart is as a drawing: labels and lines that have positions.

Lengths are points; y points down.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from plots.charts.cells import Label
from plots.charts.layout.layers import Point, straight

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Transition
    from plots.charts.statechart import ChartSheet


MARKED = "2.6"  # points; width of highlighted lines
DOT_SIZE = 8.0  # diameter of the dot at the default state


@dataclass(frozen=True)
class Node:
    """A label at a place.

    Parameters
    ----------
    name : str
        Its id.
    kind : str
        Its classes.
    at : (float, float)
        Its centre.
    label : Label, optional
        Its text; without one it is the dot of the default state.
    """

    name: str
    kind: str
    at: Point
    label: Label | None = None


@dataclass(frozen=True)
class DrawnLine:
    """A line between two nodes.

    Parameters
    ----------
    name : str
        Its id.
    ends : (str, str)
        Names of the nodes.
    points : tuple of (float, float)
        A point, then three for each Bezier curve.
    arrow : bool
        Whether the last point is the tip of an arrow.
    look : dict of str to str
        Further attributes.
    """

    name: str
    ends: tuple[str, str]
    points: tuple[Point, ...]
    arrow: bool
    look: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Drawing:
    """Labels and lines, with the left upper corner at the origin.

    Parameters
    ----------
    width, height : float
        Points.
    nodes, lines : tuple
        What is drawn.
    """

    width: float
    height: float
    nodes: tuple[Node, ...]
    lines: tuple[DrawnLine, ...]


def edge_look(sheet: ChartSheet, number: int, edge: Transition) -> dict[str, str]:
    """Return the attributes of an edge's line: never taken or removed is dashed, marked is wide."""
    look = {"style": "dashed"} if edge.name in sheet.removed else {}
    if sheet.tally is not None:
        if not sheet.tally.times(number, edge):
            look = {"style": "dashed"}
        elif width := sheet.tally.width(number, edge):
            look = {"penwidth": f"{width:.2f}"}
    if edge.name in sheet.marked:
        look |= {"class": "marked", "penwidth": MARKED}
    return look


def default_line(
    dot: str, state: str, at: Point, centre: Point, size: tuple[float, float]
) -> DrawnLine:
    """Return the arrow from the dot, above or to the left, to the default state."""
    (x, y), (to_x, to_y) = at, centre
    if y < to_y - size[1] / 2:
        start, end = (x, y + DOT_SIZE / 2), (x, to_y - size[1] / 2)
    else:
        start, end = (x + DOT_SIZE / 2, y), (to_x - size[0] / 2, y)
    name = f"{dot}-edge"
    return DrawnLine(name, (dot, state), tuple(straight(start, end)), True, {"class": "default"})
