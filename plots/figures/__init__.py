"""Composite figures: the paper's Fig. 3 and 4, overview of a run, a fit, ribbons, cascades.

Figures are made without pyplot, so there is no global state and no display.
"""

from __future__ import annotations

from pathlib import Path

from plots.figures._fit import fit_figure
from plots.figures._landscapes import landscape
from plots.figures._paper import (
    FIG3_PHASES,
    compare_laws,
    figure_3,
    figure_4,
    held_residuals,
    residuals,
)
from plots.figures._phase import phase
from plots.figures._phenomena import phenomena_matrix, phenomenon_figure
from plots.figures._profiles import profiles_figure
from plots.figures._runs import Measured, cascade_figure, overview, ribbons_figure
from plots.figures._unfold import unfold
from plots.output import formats
from plots.panels.parts.selection import SMOOTH
from plots.style.matplotlib import Figure

__all__ = [
    "FIG3_PHASES",
    "SMOOTH",
    "Measured",
    "cascade_figure",
    "compare_laws",
    "figure_3",
    "figure_4",
    "fit_figure",
    "held_residuals",
    "landscape",
    "overview",
    "phase",
    "phenomena_matrix",
    "phenomenon_figure",
    "profiles_figure",
    "residuals",
    "ribbons_figure",
    "save",
    "unfold",
]


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure; the file ending selects the format.

    Parameters
    ----------
    figure : Figure
        What.
    path : str or Path
        Its ending must be that of a figure format in `plots.output.formats.FORMATS`.

    Returns
    -------
    Path
        The file, written atomically.

    Raises
    ------
    ParameterError
        If the file ending is not supported.
    OutputError
        If the folder cannot be written.
    """
    return formats.save(figure, path, "figure")
