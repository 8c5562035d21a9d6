"""Colours and fonts of all pictures: one meaning per colour.

`ROLES` says what each colour means; `docs/colours.md` lists it. Every colour in `plots` is one of
these, and nothing is distinguished by hue alone: states also have hatches, elements and compared
runs dashes, edges numbers and hatches. Coloured text uses a darker variant where the line's colour
has too little contrast.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from gms_fsm.errors import ParameterError

Theme = Literal["light", "dark"]
THEMES: tuple[Theme, ...] = ("light", "dark")

INK = "#1B1B1B"
TEXT_GREY = "#62676F"
LINE_GREY = "#8A8F98"
PALE_GREY = "#B9BEC6"
PAPER = "#FFFFFF"
PANEL = "#F5F7FA"

BLUE = "#0072B2"
BLUE_TINT = "#E3F1FB"
VERMILION = "#D55E00"
VERMILION_TINT = "#FBE9DD"
TEXT_ORANGE = "#A84300"
TEXT_GREEN = "#00795A"


@dataclass(frozen=True)
class Role:
    """What a colour means.

    Parameters
    ----------
    name : str
        By which code asks for it.
    kind : str
        ``"text"`` has a contrast of at least 4.5 with the ground, ``"line"`` of at least 3. A
        ``"fill"`` is the ground of something that an outline, a hatch or a scale shows too, and
        ``"decoration"`` can be left out without loss.
    light, dark : tuple of str
        Colours in both themes; more than one if there are steps.
    meaning : str
        The only use of the colour.
    """

    name: str
    kind: str
    light: tuple[str, ...]
    dark: tuple[str, ...]
    meaning: str

    def colours(self, theme: Theme) -> tuple[str, ...]:
        """Return the colours of a theme.

        Examples
        --------
        >>> ROLES["now"].colours("light")
        ('#D55E00',)
        """
        return self.light if theme == "light" else self.dark

    @property
    def least(self) -> float:
        """Smallest contrast with the ground, as WCAG 2.2 computes it."""
        return {"text": 4.5, "line": 3.0}.get(self.kind, 1.0)


_ROLES = (
    Role("ink", "text", (INK,), ("#E6E8EB",), "a quantity of the whole contact (v, F, x); text"),
    Role("soft", "text", (TEXT_GREY,), ("#9AA1AB",), "secondary text"),
    Role("line", "line", (LINE_GREY,), ("#79808A",), "auxiliary lines, marks, outlines"),
    Role("pale", "decoration", (PALE_GREY,), ("#565C66",), "what is inactive; shading"),
    Role("grid", "decoration", ("#E3E6EA",), ("#2B3038",), "grids"),
    Role("paper", "fill", (PAPER,), ("#15181D",), "the ground"),
    Role("panel", "fill", (PANEL,), ("#1D2127",), "the ground of controls"),
    Role("chosen", "fill", ("#E9ECF1",), ("#2A3038",), "the ground of what is selected"),
    Role("active", "text", (BLUE,), ("#56B4E9",), "the active state of an element: outline"),
    Role("active fill", "fill", (BLUE_TINT,), ("#12344A",), "the active state: ground"),
    Role(
        "states",
        "fill",
        (BLUE_TINT, "#A9D0EC", "#84B8E0", "#C6E0F3", "#5E9DD0"),
        ("#12344A", "#2A6085", "#1D4A68", "#336D95", "#0F2736"),
        "which state is active: the default state plain and pale, the second darker and hatched",
    ),
    Role(
        "hatches",
        "line",
        (BLUE, "#003F66", "#003F66", "#003F66", "#003F66"),
        ("#56B4E9", "#C9E6F8", "#C9E6F8", "#C9E6F8", "#C9E6F8"),
        "outlines and hatches of states",
    ),
    Role(
        "slipping",
        "line",
        ("#4A94C8", "#0F6CA8", "#08456F", "#01182B"),
        ("#2F7FB8", "#56B4E9", "#9AD1F2", "#E3F1FB"),
        "how many elements have left their default state: the more, the stronger",
    ),
    Role(
        "heat",
        "fill",
        (PAPER, INK),
        ("#15181D", "#E6E8EB"),
        "how close a deflection is to its threshold; how many: paper to ink",
    ),
    Role(
        "elements",
        "line",
        ("#2D0A4E", "#6A35A0", "#A67BD2"),
        ("#F0E8FC", "#C4A8E8", "#8A63BE"),
        "elements, from the first to the last; with dashes",
    ),
    Role(
        "now", "line", (VERMILION,), ("#FF8A3D",), "now: the cursor, the row, the edge just fired"
    ),
    Role("now text", "text", (TEXT_ORANGE,), ("#FF9A57",), "text about what happens now"),
    Role("now fill", "fill", (VERMILION_TINT,), ("#46270F",), "the ground of what happens now"),
    Role("holds", "text", (TEXT_GREEN,), ("#3FCB9A",), "a clause that holds; with ✓"),
    Role("fails", "text", (TEXT_GREY,), ("#9AA1AB",), "a clause that fails; with ✗"),
    Role(
        "compared",
        "line",
        (INK, TEXT_GREY, LINE_GREY),
        ("#E6E8EB", "#9AA1AB", "#79808A"),
        "models, laws or runs that are compared; with dashes and widths",
    ),
    Role(
        "edges",
        "line",
        (INK, "#6B7078", "#3A3F46", "#80858E", "#545A62"),
        ("#E6E8EB", "#9AA1AB", "#D2D6DB", "#868D97", "#B3B9C2"),
        "edges that leave a state, and their regions; with hatches and numbers",
    ),
)
ROLES: Mapping[str, Role] = MappingProxyType({role.name: role for role in _ROLES})
# Roles where the terminal chooses the colours: numbers 0 to 15 of ANSI. It has no orange.
ANSI: Mapping[str, int] = MappingProxyType(
    {"active": 4, "now": 3, "holds": 2, "fails": 8, "error": 1}
)


def ansi(name: str, *, bold: bool = False) -> str:
    """Return the code with which a terminal writes in the colour of a role.

    Examples
    --------
    >>> ansi("holds"), ansi("active", bold=True), ansi("fails")
    ('32', '1;34', '90')
    """
    number = ANSI[name]
    return f"{'1;' * bold}{30 + number if number < 8 else 82 + number}"


def colour(name: str, theme: Theme = "light") -> str:
    """Return the colour of a role.

    Examples
    --------
    >>> colour("now"), colour("now", "dark")
    ('#D55E00', '#FF8A3D')
    """
    return ROLES[name].colours(theme)[0]


def ramp(name: str, count: int, theme: Theme = "light") -> tuple[str, ...]:
    """Return evenly spaced steps between the colours of a role.

    Examples
    --------
    >>> ramp("heat", 3)
    ('#FFFFFF', '#8D8D8D', '#1B1B1B')
    """
    if count < 1:
        raise ParameterError(f"count is {count}", advice="a ramp has at least one step")
    stops = [_channels(each) for each in ROLES[name].colours(theme)]
    steps = []
    for k in range(count):
        place = k / max(1, count - 1) * (len(stops) - 1)
        low = min(int(place), len(stops) - 2)
        share = place - low
        mixed = (
            round(a + share * (b - a)) for a, b in zip(stops[low], stops[low + 1], strict=True)
        )
        steps.append("#{:02X}{:02X}{:02X}".format(*mixed))
    return tuple(steps)


def _channels(text: str) -> tuple[int, ...]:
    return tuple(int(text[k : k + 2], 16) for k in (1, 3, 5))


def element_colour(i: int, n: int, theme: Theme = "light") -> str:
    """Return the colour of element i of n.

    Examples
    --------
    >>> [element_colour(i, 3) for i in range(3)]
    ['#2D0A4E', '#6A35A0', '#A67BD2']
    """
    return ramp("elements", n, theme)[i]


# The shipped fonts; for readers of an SVG there follow others that are about as wide.
SANS_FONT, MONO_FONT = "DejaVu Sans", "DejaVu Sans Mono"
SANS = f"{SANS_FONT},Verdana,Arial,sans-serif"
MONO = f"{MONO_FONT},Menlo,Lucida Console,monospace"

ELEMENT_STEPS = 7  # of a page and a schematic; dashes repeat only after the colours
ELEMENT_DASHES: tuple[str | tuple[int, tuple[float, ...]], ...] = (
    "-",
    "--",
    ":",
    "-.",
    (0, (7.0, 1.5, 1.0, 1.5, 1.0, 1.5)),
    (0, (9.0, 4.0)),
)
STATE_FILLS = ROLES["states"].light
STATE_EDGES = ROLES["hatches"].light
HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\")
# Edges that leave one state, by priority; with seven hatches.
EDGE_COLOURS = ROLES["edges"].light
EDGE_HATCHES = ("////", "\\\\\\\\", "....", "||||", "----", "xxxx", "oooo")

# Models, laws or runs that are compared: colour, dash, width.
COMPARED: tuple[tuple[str, str, float], ...] = (
    (INK, "-", 1.4),
    (TEXT_GREY, "--", 1.4),
    (LINE_GREY, "-", 2.4),
    (INK, ":", 1.4),
    (TEXT_GREY, "-.", 1.2),
)
# A number that a publication reports.
REPORTED: dict[str, Any] = {"color": TEXT_GREY, "linestyle": (0, (1.0, 1.5)), "linewidth": 1.4}


def state_look(mode: int) -> dict[str, Any]:
    """Return fill, hatch and outline of a state, for a patch of matplotlib.

    Examples
    --------
    >>> state_look(0)
    {'facecolor': '#E3F1FB', 'edgecolor': '#0072B2', 'hatch': '', 'linewidth': 0.6}
    """
    return {
        "facecolor": STATE_FILLS[mode % len(STATE_FILLS)],
        "edgecolor": STATE_EDGES[mode % len(STATE_EDGES)],
        # A fill that comes again has another hatch.
        "hatch": HATCHES[(mode + mode // len(STATE_FILLS)) % len(HATCHES)],
        "linewidth": 0.6,
    }


def compared_look(number: int) -> dict[str, Any]:
    """Return colour, dash and width of a run among others that it is compared with.

    Examples
    --------
    >>> compared_look(1)
    {'color': '#62676F', 'linestyle': '--', 'linewidth': 1.4}
    """
    ink, dash, width = COMPARED[number % len(COMPARED)]
    return {"color": ink, "linestyle": dash, "linewidth": width}


RC: Any = {  # matplotlib types each key separately
    "font.family": "sans-serif",
    "font.sans-serif": [SANS_FONT],
    "font.monospace": [MONO_FONT],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,  # "-0.1934" is easier to read than an offset of "-1.9e-1"
    "hatch.linewidth": 0.6,
    "axes.prop_cycle": f"cycler('color', {[ink for ink, *_ in COMPARED]})",
    "text.color": INK,
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


def _chart_theme(theme: Theme) -> ChartTheme:
    names = ("ink", "soft", "line", "pale", "paper", "active", "active fill", "now")
    return ChartTheme(*(colour(name, theme) for name in (*names, "holds", "fails")))


CHART_THEMES: Mapping[str, ChartTheme] = {
    "light": _chart_theme("light"),
    "dark": _chart_theme("dark"),
}


@dataclass(frozen=True)
class PageTheme:
    """Further colours of a replay page, next to those of its chart.

    Parameters
    ----------
    panel, grid, chosen : str
        Ground of the controls, lines in plots, ground of what is selected.
    fired_text, fired_fill : str
        Text about a firing, and its ground.
    elements, fills, hatches, slipping, edges : tuple of str
        Lines of elements; grounds and hatches of states; how many elements slip; edges that leave
        a state.
    """

    panel: str
    grid: str
    chosen: str
    fired_text: str
    fired_fill: str
    elements: tuple[str, ...]
    fills: tuple[str, ...]
    hatches: tuple[str, ...]
    slipping: tuple[str, ...]
    edges: tuple[str, ...]


def _page_theme(theme: Theme) -> PageTheme:
    return PageTheme(
        panel=colour("panel", theme),
        grid=colour("grid", theme),
        chosen=colour("chosen", theme),
        fired_text=colour("now text", theme),
        fired_fill=colour("now fill", theme),
        elements=ramp("elements", ELEMENT_STEPS, theme),
        fills=ROLES["states"].colours(theme),
        hatches=ROLES["hatches"].colours(theme),
        slipping=ramp("slipping", 7, theme),
        edges=ROLES["edges"].colours(theme),
    )


PAGE_THEMES: Mapping[str, PageTheme] = {"light": _page_theme("light"), "dark": _page_theme("dark")}
