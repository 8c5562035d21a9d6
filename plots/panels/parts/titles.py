"""Titles of panels: a bold letter, and a name."""

from __future__ import annotations

from plots.style.matplotlib import Axes, ScaledTranslation
from plots.style.presets import inches

__all__ = ["lettered"]

AFTER_LETTER = 13.0  # points: from the letter of a panel to its name


def lettered(ax: Axes, letter: str, name: str, *, pad: float = 6.0) -> None:
    """Give a panel a title: a bold letter, and a name.

    Axes have three titles. The letter is the middle one, moved to the left; the name is the left
    one.

    Parameters
    ----------
    ax : Axes
        The panel.
    letter : str
        For example ``"a"``.
    name : str
        What the panel shows.
    pad : float
        Distance from the panel, points.

    Examples
    --------
    >>> from plots.style.matplotlib import Figure
    >>> ax = Figure().subplots()
    >>> lettered(ax, "a", "velocity")
    >>> ax.get_title(), ax.get_title(loc="left")
    ('a', 'velocity')
    """
    ax.set_title(letter, loc="center", fontweight="bold", ha="left", x=0.0, pad=pad)
    right = ScaledTranslation(inches(AFTER_LETTER) / 72, 0.0, ax.figure.dpi_scale_trans)
    text = ax.set_title(name, loc="left", pad=pad)
    text.set_transform(text.get_transform() + right)
