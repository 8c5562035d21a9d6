"""Sizes of figures: for the screen, for a journal, for slides and for posters.

`preset` is a context manager that every figure builder reads, and not an argument: figures are made
by commands, lessons and notebooks, and panels write texts on axes of any figure. Builders are
written in sizes for the screen; `font`, `pt` and `inches` turn these into sizes of the preset, and
`room` is the width that texts of such sizes have. A narrow figure therefore has other rows and
columns than a wide one, instead of smaller letters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import one_of
from plots.style import RC

__all__ = [
    "PRESETS",
    "SCREEN",
    "Preset",
    "current",
    "font",
    "inches",
    "preset",
    "pt",
    "room",
    "settings",
    "to_scale",
]

TEXT, LINE = 9.0, 1.2  # points: text and lines of figures for the screen


@dataclass(frozen=True)
class Preset:
    """Sizes of figures for one use.

    Parameters
    ----------
    name : str
        Name.
    width : float or None
        Inches; None if each figure has a width of its own.
    height : float or None
        Inches, of figures that may have any height; None if the figure decides.
    text : float
        Usual size of texts, points.
    smallest : float
        Smallest size of texts, points.
    line : float
        Width of curves, points.
    dpi : float
        Pixels per inch of figures that are written as pixels.

    Raises
    ------
    ParameterError
        If a size is not positive, or `smallest` exceeds `text`.

    Examples
    --------
    >>> from plots.style.presets import PRESETS
    >>> PRESETS["ieee1"].width
    3.5
    """

    name: str
    width: float | None
    height: float | None
    text: float
    smallest: float
    line: float
    dpi: float

    def __post_init__(self) -> None:
        for name in ("width", "height", "text", "smallest", "line", "dpi"):
            value = getattr(self, name)
            free = value is None and name in ("width", "height")
            if not free and not (isinstance(value, (int, float)) and value > 0):
                raise ParameterError("it must be a positive number", place=name, value=value)
        if self.smallest > self.text:
            raise ParameterError(
                f"it must not exceed text, {self.text:g} pt", place="smallest", value=self.smallest
            )


SCREEN = Preset("screen", None, None, TEXT, 7.0, LINE, 100.0)
PRESETS: Mapping[str, Preset] = {
    each.name: each
    for each in (
        SCREEN,
        Preset("ieee1", 3.5, None, 7.5, 7.0, 0.9, 300.0),  # one column, 88.9 mm
        Preset("ieee2", 7.16, None, 7.5, 7.0, 0.9, 300.0),  # two columns, 181.9 mm
        Preset("slide", 13.33, 7.5, 18.0, 18.0, 2.2, 150.0),
        Preset("poster", 22.05, None, 26.0, 24.0, 3.2, 150.0),  # half of A0 landscape, 560 mm
    )
}

_CURRENT: ContextVar[Preset] = ContextVar("preset", default=SCREEN)


@contextmanager
def preset(chosen: str | Preset) -> Iterator[Preset]:
    """Make the figures that are built in this context in the sizes of a preset.

    Parameters
    ----------
    chosen : {"screen", "ieee1", "ieee2", "slide", "poster"} or Preset
        Which sizes: for the screen; one column of a journal, 3.5 in; two columns, 7.16 in; a slide,
        13.33 x 7.5 in with type of at least 18 pt; half the width of A0 landscape, 22.05 in with
        type of at least 24 pt. Or sizes of your own.

    Yields
    ------
    Preset
        The sizes.

    Raises
    ------
    ParameterError
        If there is no such preset.

    Examples
    --------
    >>> import plots
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
    >>> with plots.preset("ieee1"):
    ...     figure = plots.overview(run)
    >>> float(figure.get_figwidth())
    3.5
    """
    if not isinstance(chosen, Preset):
        chosen = PRESETS[one_of("preset", chosen, PRESETS)]
    token = _CURRENT.set(chosen)
    try:
        yield chosen
    finally:
        _CURRENT.reset(token)


def current() -> Preset:
    """Return the preset in use."""
    return _CURRENT.get()


def _scale() -> float:
    return current().text / TEXT


def font(size: float) -> float:
    """Return the size of a text, points.

    Examples
    --------
    >>> from plots.style.presets import font, preset
    >>> with preset("slide"):
    ...     font(8), font(12)
    (18.0, 24.0)
    """
    return max(current().smallest, size * _scale())


def pt(size: float) -> float:
    """Return the width of a line, the size of a marker or a distance, from that on the screen."""
    return size * current().line / LINE


def to_scale(look: Mapping[str, Any]) -> dict[str, Any]:
    """Return a look of lines or patches whose width is that on the screen, with its width here.

    Examples
    --------
    >>> from plots.style.presets import preset, to_scale
    >>> with preset("ieee1"):
    ...     to_scale({"color": "k", "linewidth": 1.6})
    {'color': 'k', 'linewidth': 1.2}
    """
    return {**look, "linewidth": round(pt(look["linewidth"]), 3)}


def inches(size: float) -> float:
    """Return a length in which texts have as much room as on the screen."""
    return size * _scale()


def room(usual: float) -> float:
    """Return the width of a figure, in inches of the screen.

    Examples
    --------
    >>> from plots.style.presets import preset, room
    >>> with preset("slide"):
    ...     round(room(11.0), 2)
    6.67
    """
    width = current().width
    return usual if width is None else width / _scale()


def settings() -> Any:
    """Return the settings of matplotlib for the preset in use."""  # it types each key separately
    size = current().line / LINE
    return RC | {
        "font.size": font(9.0),
        "axes.titlesize": font(RC["axes.titlesize"]),
        "figure.titlesize": font(10.8),
        "legend.fontsize": font(RC["legend.fontsize"]),
        "axes.labelpad": 4.0 * size,
        "axes.titlepad": 6.0 * size,
        "axes.linewidth": 0.8 * size,
        "lines.linewidth": RC["lines.linewidth"] * size,
        "lines.markersize": 6.0 * size,
        "patch.linewidth": size,
        "hatch.linewidth": RC["hatch.linewidth"] * size,
        **{
            f"{axis}tick.{which}.{name}": value * size
            for axis in "xy"
            for which, values in (
                ("major", {"size": 3.5, "width": 0.8, "pad": 3.5}),
                ("minor", {"size": 2.0, "width": 0.6, "pad": 3.4}),
            )
            for name, value in values.items()
        },
        **{f"figure.constrained_layout.{way}_pad": inches(0.04167) for way in "hw"},
    }
