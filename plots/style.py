"""Colours and fonts of all pictures.

The two accents are the blue and the vermilion of Okabe and Ito, which colour-blind readers can
distinguish; coloured text uses a darker variant, which has enough contrast on white.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

BLUE = "#0072B2"
VERMILION = "#D55E00"
BLUE_TINT = "#E3F1FB"
VERMILION_TINT = "#FBE9DD"
TEXT_GREEN = "#00795A"
TEXT_ORANGE = "#A84300"

INK = "#1B1B1B"
TEXT_GREY = "#6B7078"
LINE_GREY = "#8A8F98"
PALE_GREY = "#B9BEC6"
PAPER = "#FFFFFF"
PANEL = "#F5F7FA"

# Lists of names; the first installed one is used.
SANS = "Helvetica,Arial,Liberation Sans,DejaVu Sans,sans-serif"
MONO = "DejaVu Sans Mono,Menlo,Consolas,Liberation Mono,monospace"

# Elements are distinguished by colour and by dash (Okabe-Ito, readable in grey): seven colours and
# six dashes repeat only after 42 elements.
ELEMENT_COLOURS = (BLUE, VERMILION, "#009E73", "#CC79A7", "#E69F00", "#56B4E9", INK)
ELEMENT_DASHES: tuple[str | tuple[int, tuple[float, ...]], ...] = (
    "-",
    "--",
    ":",
    "-.",
    (0, (7.0, 1.5, 1.0, 1.5, 1.0, 1.5)),
    (0, (9.0, 4.0)),
)
# States: the default state is plain, the next ones are hatched as well as coloured.
STATE_FILLS = ("#CFE3F2", "#F7CDB0", "#CDEBE0", "#F1D9E7", "#FAE8C0")
STATE_EDGES = (BLUE, VERMILION, "#009E73", "#CC79A7", "#E69F00")
HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\")
# Edges that leave one state, by priority; the tints are light enough for lines on top of them.
EDGE_COLOURS = (BLUE, VERMILION, "#00795A", "#A8487F", "#8A6100", INK, LINE_GREY)
EDGE_HATCHES = ("////", "\\\\\\\\", "....", "||||", "----", "xxxx", "oooo")

RC: Any = {  # matplotlib types each key separately
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,  # "-0.1934" is easier to read than an offset of "-1.9e-1"
    "hatch.linewidth": 0.6,
    "axes.prop_cycle": "cycler('color', ['#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00'])",
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "figure.facecolor": PAPER,
    "savefig.dpi": 150,
    "svg.hashsalt": "gms-fsm",  # the same trace gives the same file
}


@dataclass(frozen=True)
class ChartTheme:
    """Colours of a statechart; shapes show the same information, for printing in grey.

    Parameters
    ----------
    ink, soft, line, pale, paper : str
        Lines and text, secondary text, regions, inactive parts, and the background.
    active, active_fill : str
        The active state.
    fired, holds, fails : str
        The edge last taken; clauses that are true and that are not.
    """

    ink: str
    soft: str
    line: str
    pale: str
    paper: str
    active: str
    active_fill: str
    fired: str
    holds: str
    fails: str


CHART_THEMES: Mapping[str, ChartTheme] = {
    "light": ChartTheme(
        INK,
        TEXT_GREY,
        LINE_GREY,
        PALE_GREY,
        PAPER,
        BLUE,
        BLUE_TINT,
        VERMILION,
        TEXT_GREEN,
        TEXT_GREY,
    ),
    "dark": ChartTheme(
        "#E6E8EB",
        "#9AA1AB",
        "#79808A",
        "#565C66",
        "#15181D",
        "#56B4E9",
        "#12344A",
        "#FF8A3D",
        "#3FCB9A",
        "#9AA1AB",
    ),
}


@dataclass(frozen=True)
class PageTheme:
    """Further colours of a replay page, next to those of its chart.

    Parameters
    ----------
    panel, grid : str
        Ground of the controls, and lines in plots.
    fired_text, fired_fill : str
        Text about a firing, and its ground.
    elements, fills, edges : tuple of str
        Lines of elements; grounds and hatches of states.
    """

    panel: str
    grid: str
    fired_text: str
    fired_fill: str
    elements: tuple[str, ...]
    fills: tuple[str, ...]
    edges: tuple[str, ...]


PAGE_THEMES: Mapping[str, PageTheme] = {
    "light": PageTheme(
        PANEL, "#E3E6EA", TEXT_ORANGE, VERMILION_TINT, ELEMENT_COLOURS, STATE_FILLS, STATE_EDGES
    ),
    "dark": PageTheme(
        "#1D2127",
        "#2B3038",
        "#FF9A57",
        "#46270F",
        ("#56B4E9", "#FF8A3D", "#3FCB9A", "#E29BC4", "#F0B93A", "#9AD1F2", "#E6E8EB"),
        ("#173C57", "#5A3214", "#15463A", "#4A2C43", "#4A3B12"),
        ("#56B4E9", "#FF8A3D", "#3FCB9A", "#E29BC4", "#F0B93A"),
    ),
}
