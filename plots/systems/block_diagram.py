"""Draw block diagrams: of a system, or of the whole friction model (Fig. 2a of the paper).

A system is drawn by `plots.systems.system_diagram`. In the friction model, for any number n of
elements, the velocity enters the chart of the elements directly and through the Stribeck curve; the
chart gives each element's force F_i and deflection rate dz_i; integrators turn the rates into
deflections and feed them back; the forces and the viscous part add up to F. Above `MOST_WIRES`
elements the forces, rates and deflections are vectors: one thick line each, with a stroke and the
number n. All positions are fixed here, in points, so Graphviz only draws: an automatic layout does
not keep ports and wires in order, and its sizes depend on the fonts that it finds.

Colours carry no meaning: kinds of blocks differ in shape, and what is fed back is grey.

In the SVG, blocks have the classes ``block`` and ``integrator``, and lines the class ``wire``.

References
----------
K. Roffi, "State Transition Block Diagram of the Generalized Maxwell Slip Friction Model",
arXiv 2512.03049 (2025), Fig. 2a, eq. (2)-(4).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import graphviz

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.systems.system import System
from plots.output.drawings import DrawnGraph
from plots.style import INK, PANEL, PAPER, TEXT_GREY
from plots.systems.system_diagram import system_diagram
from plots.systems.wires import (
    THICK,
    THIN,
    Point,
    blank,
    caption,
    draw_wire,
    joint,
    placed,
    position,
)

MOST_WIRES = 4  # elements; more are drawn as vectors

# Columns from left to right and rows of the first element, in points; y points up.
X_INPUT, X_BRANCH, X_STRIBECK, X_LEFT_LANE = 20, 72, 150, 228
X_CHART_LEFT, X_CHART_RIGHT, X_INTEGRATOR, X_RIGHT_LANE = 250, 400, 480, 524
Y_VISCOUS, Y_TITLE, Y_CHART_TOP, Y_VELOCITY, Y_STRIBECK, Y_NOTE = 167, 133, 121, 95, 59, 32
Y_FORCE, Y_RATE, Y_DEFLECTION = 85, 59, 21
# From one element to the next: its two outputs, its z port, its feedback line.
ELEMENT, PORT, LANE = 60, 30, 12
SUM_WIDTH, MARGIN = 36, 22

# Where values enter and leave.
TERMINAL = {"style": "rounded,filled", "fillcolor": PANEL}
INTEGRATOR = (
    '<<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="0">'
    '<TR><TD SIDES="B" BORDER="1">1</TD></TR><TR><TD><I>s</I></TD></TR></TABLE>>'
)


@dataclass(frozen=True)
class Lane:
    """What one set of wires carries: the values of one element, or those of all of them.

    Parameters
    ----------
    id : str
        What ids of its parts end in: the number of the element, empty for a vector.
    index : str
        Subscript of its names.
    count : int
        Values per wire.
    """

    id: str
    index: str
    count: int = 1

    @property
    def width(self) -> float:
        """Width of its wires, points."""
        return THIN if self.count == 1 else THICK

    def tip(self, end: Point) -> list[Point]:
        """Return where a thick wire gives way to an arrowhead: its own would be blunt."""
        return [] if self.count == 1 else [(end[0] - 6, end[1])]


@refusing()
def block_diagram(elements: int | System = 4) -> DrawnGraph:
    """Draw the block diagram of a system, or of a GMS model.

    Parameters
    ----------
    elements : int or System, optional
        A system: its bodies, contacts, signals, controllers and further states, and who acts on
        whom. Or the number of elements of a GMS model; the picture counts them from 1, and draws
        more than four as a vector.

    Returns
    -------
    graphviz.Digraph
        The picture as a Graphviz graph; `plots.render` writes it to a file.

    Raises
    ------
    ParameterError
        If it is neither a system nor an integer of at least 1.

    Examples
    --------
    >>> graph = block_diagram(2)
    >>> graph.engine, sum("class=integrator" in line for line in graph.body)
    ('neato', 2)
    >>> from gms_fsm import GMS, GMSParameters, PulledSlider
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> graph = block_diagram(system_of(model, PulledSlider(1.0, 2.0, 0.1)))
    >>> sum("class=body" in line for line in graph.body)
    1
    """
    return _drawn(elements)


@functools.singledispatch
def _drawn(elements: object) -> DrawnGraph:
    if isinstance(elements, bool) or not isinstance(elements, int) or elements < 1:
        raise ParameterError(
            "it must be a System, or the number of elements, an integer of at least 1",
            place="elements",
            value=elements,
        )
    return _model_diagram(int(elements))


_drawn.register(System, system_diagram)


def _model_diagram(elements: int) -> DrawnGraph:
    graph = blank("block diagram", fontsize="12")
    graph.text = (
        f"GMS model, {elements} element{'s' * (elements != 1)}: F is the sum of the forces of the "
        "elements, and of sigma_2 v.\nEach element: v and s(v) -> chart (stick, slip) -> dz, "
        "integrated to z; F_i = k_i z_i + sigma_i dz_i."
    )
    lanes = [Lane(str(i), str(i)) for i in range(1, elements + 1)]
    if elements > MOST_WIRES:
        lanes = [Lane("", f"1…{elements}", elements)]
    last = len(lanes) - 1
    x_sum = X_RIGHT_LANE + last * LANE + 100
    y_bottom = min(Y_RATE - last * ELEMENT, Y_DEFLECTION - last * PORT) - 32
    _chart(graph, elements, y_bottom)
    _velocity(graph)
    _sum(graph, x_sum, top=Y_VISCOUS + MARGIN, bottom=Y_FORCE - last * ELEMENT - MARGIN)
    _viscous_path(graph, x_sum)
    for i, lane in enumerate(lanes):
        _element(graph, i, lane, x_sum, y_bottom, inset=(last - i) * LANE)
    return graph


def _chart(graph: graphviz.Digraph, n: int, y_bottom: float) -> None:
    middle = (X_CHART_LEFT + X_CHART_RIGHT) / 2
    _block(
        graph,
        "chart",
        (middle, (Y_CHART_TOP + y_bottom) / 2),
        (X_CHART_RIGHT - X_CHART_LEFT, Y_CHART_TOP - y_bottom),
        "",
        style="rounded,filled",
        fillcolor=PANEL,
    )
    count = f' <FONT COLOR="{TEXT_GREY}">&#215; {n}</FONT>' if n > 1 else ""
    title = f"<B>GMS element chart</B>{count}"
    caption(graph, "chart-title", (middle, Y_TITLE), title, width=150)
    for name, text, y in (("v", "<I>v</I>", Y_VELOCITY), ("s", "<I>s</I>(<I>v</I>)", Y_STRIBECK)):
        joint(graph, f"chart-{name}", (X_CHART_LEFT, y))
        caption(graph, f"chart-{name}-name", (X_CHART_LEFT + 20, y), text)


def _velocity(graph: graphviz.Digraph) -> None:
    """Draw the input and its connections to the chart and the Stribeck curve."""
    _block(graph, "v", (X_INPUT, Y_VELOCITY), (44, 24), "<<I>v</I>>", **TERMINAL)
    _block(graph, "stribeck", (X_STRIBECK, Y_STRIBECK), (86, 40), "<<I>s</I>(<I>v</I>)>")
    note = f'<FONT POINT-SIZE="9" COLOR="{TEXT_GREY}">Stribeck, eq. (2) of the paper</FONT>'
    caption(graph, "stribeck-note", (X_STRIBECK, Y_NOTE), note, width=86)
    graph.node(
        "branch", "", id="branch", pos=position((X_BRANCH, Y_VELOCITY)), shape="point", width="0.07"
    )
    draw_wire(graph, "velocity", "v", [], "branch", arrow="none")
    draw_wire(graph, "velocity-chart", "branch", [], "chart-v")
    draw_wire(graph, "velocity-stribeck", "branch", [(X_BRANCH, Y_STRIBECK)], "stribeck")
    draw_wire(graph, "threshold", "stribeck", [], "chart-s")


def _sum(graph: graphviz.Digraph, x: float, top: float, bottom: float) -> None:
    y = (top + bottom) / 2
    _block(graph, "sum", (x, y), (SUM_WIDTH, top - bottom), "")
    # The letter has no descender, so that its middle is above that of its line.
    caption(graph, "sum-name", (x, y - 1.5), '<FONT POINT-SIZE="16">&#931;</FONT>', width=SUM_WIDTH)
    _block(graph, "F", (x + 82, y), (44, 24), "<<I>F</I>>", **TERMINAL)
    draw_wire(graph, "friction", "sum", [], "F")


def _summand(graph: graphviz.Digraph, name: str, x_sum: float, y: float) -> None:
    joint(graph, name, (x_sum - SUM_WIDTH / 2, y))
    caption(graph, f"{name}-sign", (x_sum - SUM_WIDTH / 2 - 14, y + 8), "+", width=10)


def _viscous_path(graph: graphviz.Digraph, x_sum: float) -> None:
    label = f"<{_indexed('&#963;', '2')}>"
    at = (X_INTEGRATOR, Y_VISCOUS)
    _block(graph, "sigma_2", at, (54, 54), label, shape="triangle", orientation="-90")
    _summand(graph, "sum-viscous", x_sum, Y_VISCOUS)
    draw_wire(graph, "velocity-viscous", "branch", [(X_BRANCH, Y_VISCOUS)], "sigma_2")
    draw_wire(graph, "viscous", "sigma_2", [], "sum-viscous")


def _element(
    graph: graphviz.Digraph, i: int, lane: Lane, x_sum: float, y_bottom: float, inset: float
) -> None:
    """Draw the ports, the integrator and the wires of one set, the i-th from above."""
    y_force, y_rate = Y_FORCE - i * ELEMENT, Y_RATE - i * ELEMENT
    y_deflection = Y_DEFLECTION - i * PORT
    inwards = 20 if lane.count == 1 else 28
    for name, at, side in (
        ("z", (X_CHART_LEFT, y_deflection), 1),
        ("F", (X_CHART_RIGHT, y_force), -1),
        ("dz", (X_CHART_RIGHT, y_rate), -1),
    ):
        port = f"chart-{name}{lane.id}"
        joint(graph, port, at)
        text = _indexed(f"<I>{'ż' if name == 'dz' else name}</I>", lane.index)
        caption(graph, f"{port}-name", (at[0] + side * inwards, at[1]), text, width=2 * inwards)

    _summand(graph, f"sum-F{lane.id}", x_sum, y_force)
    force = f"force{lane.id}"
    tip = lane.tip((x_sum - SUM_WIDTH / 2, y_force))
    draw_wire(graph, force, f"chart-F{lane.id}", tip, f"sum-F{lane.id}", width=lane.width)

    integrator = f"integrator{lane.id}"
    kind = {"class": "integrator"}
    _block(graph, integrator, (X_INTEGRATOR, y_rate), (40, 36), INTEGRATOR, **kind)
    rate = f"rate{lane.id}"
    tip = lane.tip((X_INTEGRATOR - 20, y_rate))
    draw_wire(graph, rate, f"chart-dz{lane.id}", tip, integrator, width=lane.width)
    # The first element's feedback is the outermost, so that the feedback lines never cross.
    right, left, below = X_RIGHT_LANE + inset, X_LEFT_LANE - inset, y_bottom - 16 - inset
    corners = [(right, y_rate), (right, below), (left, below), (left, y_deflection)]
    corners += lane.tip((X_CHART_LEFT, y_deflection))
    fed_back, port = f"deflection{lane.id}", f"chart-z{lane.id}"
    draw_wire(graph, fed_back, integrator, corners, port, colour=TEXT_GREY, width=lane.width)
    if lane.count > 1:
        _stroke(graph, force, (X_CHART_RIGHT + 30, y_force), lane.count)
        _stroke(graph, rate, (X_CHART_RIGHT + 30, y_rate), lane.count)
        middle = 0.5 * (X_CHART_LEFT + X_CHART_RIGHT)
        _stroke(graph, fed_back, (middle, below), lane.count, colour=TEXT_GREY)


# --------------------------------------------------------------------------- parts
def _block(
    graph: graphviz.Digraph, name: str, at: Point, size: Point, label: str, **look: str
) -> None:
    plain = {"class": "block", "shape": "box", "style": "filled", "fillcolor": PAPER}
    placed(graph, name, at, size, label, **(plain | look))


def _indexed(symbol: str, index: str) -> str:
    """Return the label of a symbol with a subscript.

    Two cells, because viewers of SVG place what Graphviz makes of ``<SUB>`` on the line, or nowhere
    near it.
    """
    return (
        '<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="0"><TR>'
        f'<TD VALIGN="TOP" HEIGHT="15">{symbol}</TD><TD VALIGN="BOTTOM" HEIGHT="15">'
        f'<FONT POINT-SIZE="9">{index}</FONT></TD></TR></TABLE>'
    )


def _stroke(graph: graphviz.Digraph, wire: str, at: Point, count: int, colour: str = INK) -> None:
    """Draw the oblique stroke of a vector through its wire, and the number of its values."""
    for end, way in (("low", -1), ("high", 1)):
        place = (at[0] + way * 3.5, at[1] + way * 6.5)
        joint(graph, f"{wire}-{end}", place, colour, width=0.1)
    look = {"dir": "none", "color": colour, "tailclip": "false", "headclip": "false"}
    look |= {"id": f"{wire}-stroke", "class": "stroke"}
    graph.edge(f"{wire}-low", f"{wire}-high", **look)
    text = f'<FONT POINT-SIZE="10">{count}</FONT>'
    caption(graph, f"{wire}-count", (at[0] + 13, at[1] + 9), text, width=20)
