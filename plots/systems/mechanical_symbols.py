"""Symbols of mechanical drawings: springs, dashpots, ground, contacts, arrows; and formulas.

Lengths are those of the axes; `UNIT` inches are one of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from gms_fsm.language import FUNCTIONS, SHORT
from plots.style import INK, LINE_GREY, PANEL, PAPER, RC
from plots.style.matplotlib import (
    Artist,
    Axes,
    FancyArrowPatch,
    FancyBboxPatch,
    Figure,
    FigureCanvasAgg,
    Rectangle,
    RendererBase,
    rc_context,
)

Point = tuple[float, float]
Points = npt.NDArray[np.float64]

UNIT = 0.5
NAME, SMALL = 9.0, 8.0  # sizes of type, points
LINE = 0.3  # from one line of small type to the next
LEAD, PLATE = 1.2, 0.22  # widths of lines; half the height of a plate

_TOKEN = re.compile(
    r"(?P<power>\^-?\w[\w.]*)|(?P<name>[A-Za-z_]\w*)|(?P<number>[\d.]+(?:e[+-]?\d+)?)|[<>]=|."
)
TIMES = r"\,"  # a thin space
_MARKS = {"*": TIMES, " ": r"\ ", "<=": r"\leq ", ">=": r"\geq "}
_GREEK = frozenset(
    ("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda", "mu")
    + ("nu", "xi", "pi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega")
)


def formula(text: str) -> str:
    r"""Return the text of an expression as a formula for matplotlib.

    Examples
    --------
    >>> formula("k_c * (x_2 - x_1)")
    '$k_{c}\\,(x_{2} - x_{1})$'
    >>> formula("if(x >= 0, 1, 2)")
    '$\\mathrm{if}(x\\ \\geq \\ 0,\\ 1,\\ 2)$'
    """
    opening = text.find("^(")
    if opening >= 0:  # an exponent in brackets
        depth, end = 0, opening + 1
        for end in range(opening + 1, len(text)):
            depth += {"(": 1, ")": -1}.get(text[end], 0)
            if depth == 0:
                break
        before, inside, after = (
            formula(part)[1:-1]
            for part in (text[:opening], text[opening + 2 : end], text[end + 1 :])
        )
        return f"${before}^{{{inside}}}{after}$"
    parts = []
    for match in _TOKEN.finditer(re.sub(r" *\* *", "*", text)):
        if match["power"]:
            parts.append(f"^{{{match['power'][1:]}}}")
        elif match["name"]:
            parts.append(_symbol(match["name"]))
        elif match["number"]:
            mantissa, _, power = match["number"].partition("e")
            ten = rf"\cdot 10^{{{int(power)}}}" if power else ""
            # Two numbers side by side would read as one.
            times = r"\cdot " if parts and parts[-1] == TIMES else ""
            parts.append(f"{times}{mantissa}{ten}")
        else:
            parts.append(_MARKS.get(match[0], match[0]))
    # Matplotlib spaces operators itself.
    return "$" + re.sub(r"\\ ([-+=/<>])\\ ", r" \1 ", "".join(parts)) + "$"


def _symbol(name: str) -> str:
    head, _, index = name.partition("_")
    if name in (*FUNCTIONS, *SHORT, "and", "or", "not"):
        return rf"\mathrm{{{name}}}"
    shown = rf"\{head}" if head in _GREEK else head if len(head) == 1 else rf"\mathit{{{head}}}"
    if not index:
        return shown
    index = index.replace("_", r"\_")
    return f"{shown}_{{{index}}}" if len(index) == 1 else rf"{shown}_{{\mathrm{{{index}}}}}"


@lru_cache(maxsize=1)
def _measuring() -> tuple[Figure, RendererBase]:
    figure = Figure(dpi=72)
    renderer: RendererBase = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
    return figure, renderer


@lru_cache(maxsize=1024)
def _width(text: str, size: float, bold: bool) -> float:
    figure, renderer = _measuring()
    with rc_context(RC):
        drawn = figure.text(0, 0, text, fontsize=size, fontweight="bold" if bold else "normal")
    box = drawn.get_window_extent(renderer)
    drawn.remove()
    return float(box.width) / 72 / UNIT


def width(text: str, size: float = SMALL, *, bold: bool = False) -> float:
    """Return the width of a text in lengths of the axes."""
    return _width(text, size, bold) if text else 0.0


def spring_points(left: float, right: float, y: float) -> Points:
    """Return the corners of a spring, with leads, between two places."""
    turns = np.linspace(left + 0.25, right - 0.25, 15)
    zigzag = y + 0.1 * np.array([0, *([1, -1] * 6), 1, 0])
    return np.array([(left, y), *zip(turns, zigzag, strict=True), (right, y)])


def damper_points(left: float, right: float, y: float) -> Points:
    """Return the corners of a dashpot as one line with gaps, so that it is a single artist.

    A rod and piston from the right into a cup that opens towards it.
    """
    cup, piston, mouth = (left + share * (right - left) for share in (0.35, 0.5, 0.65))
    strokes = (
        [(left, y), (cup, y), (cup, y + 0.11), (mouth, y + 0.11)],
        [(cup, y), (cup, y - 0.11), (mouth, y - 0.11)],
        [(piston, y), (right, y)],
        [(piston, y - 0.08), (piston, y + 0.08)],
    )
    return np.array(_joined(strokes))


def arrow_between(
    ax: Axes, start: Point, end: Point, *, size: float, lw: float, bend: float = 0.0
) -> Artist:
    """Draw an arrow; its bend is the height of the arc, in its length."""
    look: dict[str, Any] = {"color": INK, "linewidth": lw, "linestyle": "-", "zorder": 5}
    look |= {"arrowstyle": "-|>", "mutation_scale": size, "shrinkA": 0, "shrinkB": 0}
    arc = f"arc3,rad={-2.0 * bend}"
    return ax.add_patch(FancyArrowPatch(start, end, connectionstyle=arc, **look))


def hatched(
    ax: Axes, left: float, bottom: float, wide: float, high: float, ink: str, hatch: str
) -> Artist:
    """Draw hatched ground."""
    look: dict[str, Any] = {"facecolor": PAPER, "edgecolor": ink, "hatch": hatch}
    return ax.add_patch(Rectangle((left, bottom), wide, high, linewidth=0, zorder=0, **look))


class Pen:
    """Draws symbols on axes, and keeps what it drew.

    Parameters
    ----------
    ax : Axes
        Where.
    """

    def __init__(self, ax: Axes) -> None:
        self.ax = ax
        self.drawn: list[Artist] = []

    def line(self, points: Sequence[Point] | Points, *, gid: str = "", lw: float = LEAD) -> None:
        """Draw a line through points; NaN is a gap."""
        (drawn,) = self.ax.plot(
            *np.transpose(np.asarray(points, dtype=float)),
            color=INK,
            linewidth=lw,
            linestyle="-",
            solid_capstyle="round",
            solid_joinstyle="round",
            zorder=3,
        )
        self.keep(drawn, gid)

    def strokes(self, *lines: Sequence[Point], gid: str = "") -> None:
        """Draw several lines as one."""
        self.line(_joined(lines), gid=gid)

    def keep(self, artist: Artist, gid: str = "") -> None:
        """Keep an artist under a group id."""
        if gid:
            artist.set_gid(gid)
        self.drawn.append(artist)

    def box(
        self,
        left: float,
        bottom: float,
        wide: float,
        high: float,
        gid: str = "",
        *,
        fill: str = PANEL,
        line: float = 1.3,
        corner: float = 0.0,
    ) -> None:
        """Draw a rectangle, which may have round corners."""
        look: dict[str, Any] = {"facecolor": fill, "edgecolor": INK, "linewidth": line, "zorder": 2}
        patch: Rectangle | FancyBboxPatch = Rectangle((left, bottom), wide, high, **look)
        if corner:
            style = f"round,pad=0,rounding_size={corner}"
            patch = FancyBboxPatch((left, bottom), wide, high, boxstyle=style, **look)
        self.keep(self.ax.add_patch(patch), gid)

    def ground(self, left: float, bottom: float, wide: float, high: float) -> None:
        """Draw hatched ground."""
        self.keep(hatched(self.ax, left, bottom, wide, high, LINE_GREY, "//////"))

    def wall(self, x: float, bottom: float, top: float, way: int) -> None:
        """Draw a wall whose face is at x; its material is on the side `way`."""
        self.ground(x if way > 0 else x - 0.16, bottom, 0.16, top - bottom)
        self.line([(x, bottom), (x, top)], lw=1.4)

    def floor(self, left: float, right: float, y: float) -> None:
        """Draw ground whose surface is at y."""
        self.ground(left, y - 0.16, right - left, 0.16)
        self.line([(left, y), (right, y)], lw=1.4)

    def text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        size: float = SMALL,
        bold: bool = False,
        ha: str = "center",
        va: str = "center",
        colour: str = INK,
        gid: str = "",
    ) -> None:
        """Write a text."""
        weight = "bold" if bold else "normal"
        drawn = self.ax.text(
            x, y, text, ha=ha, va=va, fontsize=size, fontweight=weight, color=colour, zorder=6
        )
        self.keep(drawn, gid)

    def arrow(
        self, start: Point, end: Point, gid: str = "", *, lw: float = 1.3, bend: float = 0.0
    ) -> None:
        """Draw an arrow."""
        self.keep(arrow_between(self.ax, start, end, size=10, lw=lw, bend=bend), gid)

    # ----------------------------------------------------------------- contacts, level
    def friction_between(self, left: float, right: float, y: float, gid: str) -> None:
        """Draw two plates that slide on each other, with bristles between them."""
        middle, half = 0.5 * (left + right), 0.55
        low, high = y - 0.16, y + 0.16
        self.strokes(
            [(left, low), (middle + half, low)],
            [(middle - half, high), (right, high)],
            *_bristles(middle - half + 0.1, middle + half - 0.1, high, low),
            gid=gid,
        )

    def backlash(self, left: float, right: float, y: float, gid: str) -> None:
        """Draw a tongue with play in a fork."""
        middle = 0.5 * (left + right)
        a, b = middle - 0.45, middle + 0.45
        self.strokes(
            [(left, y), (a, y)],
            [(a, y - 0.28), (a, y + 0.28), (b, y + 0.28), (b, y + 0.1)],
            [(a, y - 0.28), (b, y - 0.28), (b, y - 0.1)],
            [(middle, y - PLATE + 0.06), (middle, y + PLATE - 0.06)],
            [(middle, y), (right, y)],
            gid=gid,
        )

    def clutch(self, left: float, right: float, y: float, gid: str) -> None:
        """Draw two plates with teeth that fit into each other."""
        middle = 0.5 * (left + right)
        lines: list[list[Point]] = []
        for end, way in ((left, 1), (right, -1)):
            plate = middle - 0.2 * way
            edge = [(plate, y - 0.28)]
            # Teeth of one plate face the spaces of the other one.
            for low in (-0.24, 0.04) if way > 0 else (-0.1, 0.18):
                tip = plate + 0.14 * way
                edge += [(plate, y + low), (tip, y + low), (tip, y + low + 0.1)]
                edge += [(plate, y + low + 0.1)]
            lines += [[(end, y), (plate, y)], [*edge, (plate, y + 0.28)]]
        self.strokes(*lines, gid=gid)

    def stop(self, face: float, post: float, y: float, gid: str) -> None:
        """Draw an end stop: a plate on the body's side and a block that it hits."""
        way = 1 if post > face else -1
        inner, touch = post - 0.55 * way, face + 0.35 * way
        low, high = y - PLATE, y + PLATE
        self.strokes(
            [(face, y), (touch, y)],
            [(touch, low), (touch, high)],
            [(inner, low), (inner, high), (post, high)],
            [(inner, low), (post, low)],
            gid=gid,
        )

    # ----------------------------------------------------------------- contacts, upright
    def bristles(self, left: float, right: float, top: float, bottom: float, gid: str) -> None:
        """Draw bristles from a body to what it slides on."""
        lines = _bristles(left, right, top, bottom)
        self.strokes([(left, top), (right, top)], *lines, gid=gid)


def _bristles(left: float, right: float, top: float, bottom: float) -> list[list[Point]]:
    count = max(4, round((right - left) / 0.2))
    lean = 0.35 * (top - bottom)
    places = np.linspace(left, right - lean, count).tolist()
    return [[(x + lean, top), (x, bottom)] for x in places]


def _joined(lines: Iterable[Sequence[Point]]) -> list[Point]:
    """Return lines as one with gaps."""
    return [point for each in lines for point in (*each, (np.nan, np.nan))][:-1]
