"""Names beside lines, placed when the picture is drawn so that none covers another."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plots.style import PAPER
from plots.style.matplotlib import Artist, Axes, Bbox, IdentityTransform, RendererBase, Text
from plots.style.presets import font

Floats = NDArray[np.float64]
STEP, PAD, CLEAR = 6.0, 1.5, 9.0  # points: between candidates, around a name, around the dot
BESIDE = 2.5  # points from a line to the ground of its name
CROSSING, OUTSIDE = 1.0, 0.6  # costs: of a covered point of a line, of the distance from an edge


@dataclass(frozen=True, eq=False)
class NamedLine:
    """A line and its name.

    Parameters
    ----------
    name : str
        The text.
    colour : str
        Of the text.
    pieces : tuple of ndarray, shape (points, 2)
        The line, in the coordinates of the axes' data.
    """

    name: str
    colour: str
    pieces: tuple[Floats, ...]


@dataclass(frozen=True)
class _Spot:
    """A place for a name, in pixels."""

    x: float
    y: float
    upright: bool
    box: Bbox
    cost: float


@dataclass
class _Taken:
    """What names must not cover, and what they should not, in pixels."""

    boxes: list[Bbox] = field(default_factory=list)
    points: list[Floats] = field(default_factory=list)


class LineNames(Artist):
    """The names of several lines; one that has no free place is left out.

    Parameters
    ----------
    ax : Axes
        The axes of the lines.

    Attributes
    ----------
    lines : list of NamedLine
        What to name.
    avoid : list of (float, float)
        Points of marks, which no name covers, in data coordinates.
    curves : list of ndarray, shape (points, 2)
        Further lines that names cover only if there is no other place.
    """

    def __init__(self, ax: Axes) -> None:
        super().__init__()
        self.lines: list[NamedLine] = []
        self.avoid: list[tuple[float, float]] = []
        self.curves: list[Floats] = []
        self.size = font(8)  # when the names are drawn, another preset may be in use
        self.set_zorder(9)
        self.set_in_layout(False)
        ax.add_artist(self)

    def draw(self, renderer: RendererBase) -> None:
        """Place the names and draw them."""
        for text in self.placed(renderer):
            text.draw(renderer)

    def placed(self, renderer: RendererBase) -> list[Text]:
        """Return the names that have a place, in pixels of a renderer."""
        ax, unit = self._owner, float(renderer.points_to_pixels(1.0))  # type: ignore[arg-type]
        taken = _Taken(self._avoided(unit))
        dense = [[_dense(ax, piece, unit) for piece in line.pieces] for line in self.lines]
        others = [_dense(ax, curve, unit) for curve in self.curves]
        found: list[Text] = []
        taken.points = [*others, *(points for each in dense for points in each)]
        for number, line in enumerate(self.lines):
            text = self._text(line)
            spots = self._spots(text, dense[number], taken, renderer)
            if not spots:
                continue
            best = min(spots, key=lambda spot: spot.cost)
            text.set(x=best.x, y=best.y, rotation=90 if best.upright else 0)
            taken.boxes.append(best.box)
            found.append(text)
        return found

    @property
    def _owner(self) -> Axes:
        assert isinstance(self.axes, Axes)
        return self.axes

    def _avoided(self, unit: float) -> list[Bbox]:
        """Return boxes around the points that no name covers."""
        points = [self._owner.transData.transform(point) for point in self.avoid]
        return [Bbox([point - CLEAR * unit, point + CLEAR * unit]) for point in points]

    def covered(self, renderer: RendererBase, tails: Floats, heads: Floats) -> NDArray[np.bool_]:
        """Return which arrows a name or a mark would cover, by their ends in data coordinates."""
        unit = float(renderer.points_to_pixels(1.0))  # type: ignore[arg-type]
        ends = [self._owner.transData.transform(each.reshape(-1, 2)) for each in (tails, heads)]
        found = np.zeros(len(ends[0]), dtype=bool)
        names = [text.get_window_extent(renderer) for text in self.placed(renderer)]
        for box in [*self._avoided(unit), *(name.padded(PAD * unit) for name in names)]:
            for part in np.linspace(0.0, 1.0, 5):
                point = ends[0] + part * (ends[1] - ends[0])
                found |= ((point > box.min) & (point < box.max)).all(axis=1)
        return found.reshape(tails.shape[:-1])

    def _text(self, line: NamedLine) -> Text:
        box = {"boxstyle": f"square,pad={PAD / 10}", "facecolor": PAPER, "edgecolor": "none"}
        text = Text(
            text=line.name,
            color=line.colour,
            fontsize=self.size,
            ha="center",
            va="center",
            bbox=box,
            transform=IdentityTransform(),
        )
        text.set_figure(self._owner.figure)
        return text

    def _spots(
        self, text: Text, pieces: list[Floats], taken: _Taken, renderer: RendererBase
    ) -> list[_Spot]:
        """Return the free places beside the pieces of a line."""
        whole = self._owner.bbox
        unit = float(renderer.points_to_pixels(1.0))  # type: ignore[arg-type]
        extent = text.get_window_extent(renderer)
        long, tall = extent.width + 2 * PAD * unit, extent.height + 2 * PAD * unit
        covered = np.concatenate([*taken.points, np.empty((0, 2))])
        spots = []
        for piece in pieces:
            if len(piece) < 2:
                continue
            slope = np.abs(np.gradient(piece, axis=0))
            places = product(zip(piece.tolist(), slope.tolist(), strict=True), (1.0, -1.0))
            for ((x, y), (dx, dy)), way in places:
                upright = dy > 1.5 * dx
                w, h = (tall, long) if upright else (long, tall)
                away = way * (tall / 2 + BESIDE * unit)
                x, y = (x - away, y) if upright else (x, y + away)
                box = Bbox.from_bounds(x - w / 2, y - h / 2, w, h)
                inside = whole.x0 <= box.x0 and box.x1 <= whole.x1
                if not inside or not (whole.y0 <= box.y0 and box.y1 <= whole.y1):
                    continue
                if any(box.overlaps(other) for other in taken.boxes):
                    continue
                hit = np.abs(covered - (x, y)) < (w / 2, h / 2)
                # Names are easiest to find at the ends of their lines, next to the frame.
                edge = min(x - whole.x0, whole.x1 - x) / whole.width
                side = min(y - whole.y0, whole.y1 - y) / whole.height
                cost = CROSSING * float(hit.all(axis=1).sum()) + OUTSIDE * min(edge, side)
                spots.append(_Spot(x, y, upright, box, cost))
        return spots


def _dense(ax: Axes, piece: Any, unit: float) -> Floats:
    """Return points of a line in pixels, evenly spaced."""
    pixels = ax.transData.transform(piece)
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    if len(pixels) < 2:
        return np.asarray(pixels)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(pixels, axis=0).T))])
    count = max(2, min(4000, int(length[-1] / (STEP * unit))))
    even = np.linspace(0.0, length[-1], count)
    return np.column_stack([np.interp(even, length, column) for column in pixels.T])
