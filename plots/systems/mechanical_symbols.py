"""Symbols of mechanical drawings: springs, dashpots, ground, contacts, arrows; and formulas.

Lengths are those of the axes; `UNIT` inches are one of them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from gms_fsm.language import FUNCTIONS
from plots.style import INK, LINE_GREY, PANEL, PAPER, RC
from plots.style.matplotlib import (
    Artist,
    Axes,
    FancyArrowPatch,
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
    r"(?P<power>\^-?\w[\w.]*)|(?P<name>[A-Za-z_]\w*)|(?P<number>[\d.]+(?:e[+-]?\d+)?)|."
)
TIMES = r"\,"  # a thin space
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
            parts.append({"*": TIMES, " ": r"\ "}.get(match[0], match[0]))
    # Matplotlib spaces operators itself.
    return "$" + re.sub(r"\\ ([-+=/<>])\\ ", r" \1 ", "".join(parts)) + "$"


def _symbol(name: str) -> str:
    head, _, index = name.partition("_")
    if name in FUNCTIONS:
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
    points = [point for stroke in strokes for point in (*stroke, (np.nan, np.nan))]
    return np.array(points[:-1])


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
    ) -> None:
        """Draw a rectangle."""
        patch = Rectangle(
            (left, bottom), wide, high, facecolor=fill, edgecolor=INK, linewidth=line, zorder=2
        )
        self.keep(self.ax.add_patch(patch), gid)

    def ground(self, left: float, bottom: float, wide: float, high: float) -> None:
        """Draw hatched ground."""
        patch = Rectangle(
            (left, bottom),
            wide,
            high,
            facecolor=PAPER,
            edgecolor=LINE_GREY,
            hatch="//////",
            linewidth=0,
            zorder=0,
        )
        self.keep(self.ax.add_patch(patch))

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

    def arrow(self, start: Point, end: Point, gid: str = "", *, lw: float = 1.3) -> None:
        """Draw an arrow."""
        patch = FancyArrowPatch(
            start,
            end,
            arrowstyle="-|>",
            mutation_scale=10,
            color=INK,
            linewidth=lw,
            linestyle="-",
            shrinkA=0,
            shrinkB=0,
            zorder=5,
        )
        self.keep(self.ax.add_patch(patch), gid)

    # ----------------------------------------------------------------- contacts, level
    def friction_between(self, left: float, right: float, y: float, gid: str) -> None:
        """Draw two plates that slide on each other, with bristles between them."""
        middle, half = 0.5 * (left + right), 0.55
        gap = (np.nan, np.nan)
        points: list[Point] = [
            (left, y - 0.16),
            (middle + half, y - 0.16),
            gap,
            (middle - half, y + 0.16),
            (right, y + 0.16),
            gap,
        ]
        self.line(
            [*points, *_bristles(middle - half + 0.1, middle + half - 0.1, y + 0.16, y - 0.16)],
            gid=gid,
        )

    def backlash(self, left: float, right: float, y: float, gid: str) -> None:
        """Draw a tongue with play in a fork."""
        middle, gap = 0.5 * (left + right), (np.nan, np.nan)
        a, b = middle - 0.45, middle + 0.45
        self.line(
            [
                (left, y),
                (a, y),
                gap,
                (a, y - 0.28),
                (a, y + 0.28),
                (b, y + 0.28),
                (b, y + 0.1),
                gap,
                (a, y - 0.28),
                (b, y - 0.28),
                (b, y - 0.1),
                gap,
                (middle, y - PLATE + 0.06),
                (middle, y + PLATE - 0.06),
                gap,
                (middle, y),
                (right, y),
            ],
            gid=gid,
        )

    def clutch(self, left: float, right: float, y: float, gid: str) -> None:
        """Draw two plates with teeth that fit into each other."""
        middle, gap = 0.5 * (left + right), (np.nan, np.nan)
        points: list[Point] = []
        for end, way in ((left, 1), (right, -1)):
            plate = middle - 0.2 * way
            # Teeth of one plate face the spaces of the other one.
            teeth = (-0.24, 0.04) if way > 0 else (-0.1, 0.18)
            points += [(end, y), (plate, y), gap, (plate, y - 0.28)]
            for low in teeth:
                tip = plate + 0.14 * way
                points += [(plate, y + low), (tip, y + low), (tip, y + low + 0.1)]
                points += [(plate, y + low + 0.1)]
            points += [(plate, y + 0.28), gap]
        self.line(points[:-1], gid=gid)

    def stop(self, face: float, post: float, y: float, gid: str) -> None:
        """Draw an end stop: a plate on the body's side and a block that it hits."""
        way = 1 if post > face else -1
        inner, gap = post - 0.55 * way, (np.nan, np.nan)
        touch = face + 0.35 * way
        self.line(
            [
                (face, y),
                (touch, y),
                gap,
                (touch, y - PLATE),
                (touch, y + PLATE),
                gap,
                (inner, y - PLATE),
                (inner, y + PLATE),
                (post, y + PLATE),
                gap,
                (inner, y - PLATE),
                (post, y - PLATE),
            ],
            gid=gid,
        )

    # ----------------------------------------------------------------- contacts, upright
    def bristles(self, left: float, right: float, top: float, bottom: float, gid: str) -> None:
        """Draw bristles from a body to what it slides on."""
        self.line(
            [(left, top), (right, top), (np.nan, np.nan), *_bristles(left, right, top, bottom)],
            gid=gid,
        )


def _bristles(left: float, right: float, top: float, bottom: float) -> list[Point]:
    count = max(4, round((right - left) / 0.2))
    lean = 0.35 * (top - bottom)
    points: list[Point] = []
    for x in np.linspace(left, right - lean, count):
        points += [(float(x) + lean, top), (float(x), bottom), (np.nan, np.nan)]
    return points[:-1]
