"""Colours and fonts that all pictures share.

The two accents are the blue and the vermilion of Okabe and Ito, which colour-blind readers can tell
apart; text in a colour takes the darker twin, so that it keeps its contrast on white.
"""

from __future__ import annotations

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

# Lists of names: the first one that is installed is taken.
SANS = "Helvetica,Arial,Liberation Sans,DejaVu Sans,sans-serif"
MONO = "DejaVu Sans Mono,Menlo,Consolas,Liberation Mono,monospace"

# Elements are told apart by colour and by dash (Okabe-Ito, readable in grey).
ELEMENT_COLOURS = (BLUE, VERMILION, "#009E73", "#CC79A7", "#E69F00", "#56B4E9", INK)
ELEMENT_DASHES = ("-", "--", ":", "-.")
HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\")

RC: Any = {  # matplotlib types its keys one by one
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.prop_cycle": "cycler('color', ['#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00'])",
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "figure.facecolor": PAPER,
    "savefig.dpi": 150,
    "svg.hashsalt": "gms-fsm",  # the same trace gives the same file
}
