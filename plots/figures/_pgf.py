"""Figures as PGF, the pictures of LaTeX, whose texts are set in the fonts of the document.

matplotlib asks a running LaTeX how wide each text is. Here its own fonts answer, which are wider
than those of LaTeX: a figure is written without LaTeX, and the same trace gives the same file.
Texts that LaTeX would misread, such as an underscore or a Greek letter, are replaced by commands,
so that pdfLaTeX needs no package but pgf.
"""

from __future__ import annotations

import re
import unicodedata
from io import StringIO
from typing import Any

from gms_fsm.errors import OutputError
from plots._matplotlib import Figure, FigureCanvasAgg, RendererPgf

__all__ = ["pgf"]

HEAD = r"""%% A figure of gms-fsm, {wide:.3f} in wide. In the preamble:
%%   \usepackage{{pgf}}
%% and, if the fonts of the document do not exist in every size,
%%   \usepackage{{lmodern}}
\begingroup%
\makeatletter%
\providecommand{{\mathdefault}}[1]{{#1}}%
\begin{{pgfpicture}}%
\pgfpathrectangle{{\pgfpointorigin}}{{\pgfqpoint{{{wide:f}in}}{{{tall:f}in}}}}%
\pgfusepath{{use as bounding box, clip}}%
"""
FOOT = r"""\end{pgfpicture}%
\makeatother%
\endgroup%
"""

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\ensuremath{<}",
    ">": r"\ensuremath{>}",
    "|": r"\ensuremath{\vert}",
    '"': r"\textquotedbl{}",
    **{each: "\\" + each for each in "#$%&_{}"},
}
_SMALL = (
    "alpha beta gamma delta varepsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau "
    "upsilon varphi chi psi omega"
)
_CAPITAL = "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
_GREEK = dict(zip("αβγδεζηθικλμνξπρστυφχψωΓΔΘΛΞΠΣΦΨΩ", f"{_SMALL} {_CAPITAL}".split(), strict=True))
_SIGNS = {
    "µ": r"\mu",
    "−": "-",
    "·": r"\cdot",
    "×": r"\times",
    "±": r"\pm",
    "≤": r"\leq",
    "≥": r"\geq",
    "≠": r"\neq",
    "≈": r"\approx",
    "∞": r"\infty",
    "√": r"\surd",
    "∧": r"\wedge",
    "∨": r"\vee",
    "¬": r"\neg",
    "⊤": r"\top",
    "→": r"\rightarrow",
    "←": r"\leftarrow",
    "↔": r"\leftrightarrow",
    "⇒": r"\Rightarrow",
    "°": r"^\circ",
    "●": r"\bullet",
    "○": r"\circ",
    "✗": r"\times",
    "✓": r"\surd",
    "∫": r"\int",
    "∂": r"\partial",
    "∑": r"\sum",
}
_RAISED = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+", strict=True))
_LOWERED = dict(zip("₀₁₂₃₄₅₆₇₈₉", "0123456789", strict=True))
_WORDS = {
    "–": "--",
    "—": "---",
    "…": r"\ldots{}",
    "’": "'",
    "‘": "`",
    "“": "``",
    "”": "''",
    "\u00a0": "~",
    "\u2009": r"\,",
    "\u202f": r"\,",
}
_DOTTED = {"\u0307": r"\dot", "\u0308": r"\ddot", "\u0302": r"\hat", "\u0304": r"\bar"}


def pgf(figure: Figure) -> bytes:
    """Return a figure as PGF.

    Parameters
    ----------
    figure : Figure
        What.

    Returns
    -------
    bytes
        Text that LaTeX reads with its command input.

    Raises
    ------
    OutputError
        If a text has a character that pdfLaTeX does not know.
    """
    canvas: Any = FigureCanvasAgg(figure)
    text = StringIO()
    wide, tall = (float(size) for size in figure.get_size_inches())
    text.write(HEAD.format(wide=wide, tall=tall))
    figure.draw(_Renderer(figure, text, canvas.get_renderer()))
    text.write(FOOT)
    return text.getvalue().encode("ascii")


def latex(text: str, *, math: bool) -> str:
    r"""Return a text of matplotlib as LaTeX.

    Parameters
    ----------
    text : str
        One line.
    math : bool
        Whether dollar signs begin and end formulas.

    Returns
    -------
    str
        ASCII only.

    Raises
    ------
    OutputError
        If a character has no command.

    Examples
    --------
    >>> print(latex("v_c = 10⁻³ m/s, $F_{1}$", math=True))
    v\_c = 10\ensuremath{^{-3}} m/s, $F_{1}$
    """
    if not math:
        return _words(text)
    parts = re.split(r"(?<!\\)\$", text)
    return "".join(
        f"${_formula(part)}$" if number % 2 else _words(part.replace(r"\$", "$"))
        for number, part in enumerate(parts)
    )


def _words(text: str) -> str:
    text = re.sub(f"[{''.join(_RAISED)}]+", lambda m: _script("^", m[0], _RAISED), text)
    text = re.sub(f"[{''.join(_LOWERED)}]+", lambda m: _script("_", m[0], _LOWERED), text)
    text = re.sub(f"(.)([{''.join(_DOTTED)}])", _dotted, text)
    # Commands made above are between zero bytes; everything else is replaced letter by letter.
    parts = text.split("\0")
    return "".join(
        rf"\ensuremath{{{part}}}" if number % 2 else "".join(map(_letter, part))
        for number, part in enumerate(parts)
    )


def _script(sign: str, letters: str, table: dict[str, str]) -> str:
    return f"\0{sign}{{{''.join(table[each] for each in letters)}}}\0"


def _dotted(match: re.Match[str]) -> str:
    letter = _command(match[1]) or match[1]
    return f"\0{_DOTTED[match[2]]}{{{letter}}}\0"


def _letter(letter: str) -> str:
    command = _command(letter)
    if command is not None:
        return rf"\ensuremath{{{command}}}"
    if letter in _SPECIAL:
        return _SPECIAL[letter]
    if letter in _WORDS:
        return _WORDS[letter]
    if letter.isascii():
        return letter
    return _accented(letter)


def _accented(letter: str) -> str:
    accents = {"\u0300": "`", "\u0301": "'", "\u0302": "^", "\u0303": "~", "\u0308": '"'}
    parts = unicodedata.normalize("NFD", letter)
    if len(parts) == 2 and parts[0].isascii():
        if parts[1] in accents:
            return rf"\{accents[parts[1]]}{{{parts[0]}}}"
        if parts[1] in _DOTTED:
            return rf"\ensuremath{{{_DOTTED[parts[1]]}{{{parts[0]}}}}}"
    raise OutputError(
        f"the figure has the character {letter!r}, which pdfLaTeX does not know: write it as PDF "
        "or SVG, or change the text"
    )


def _command(letter: str) -> str | None:
    if letter in _GREEK:
        return "\\" + _GREEK[letter]
    return _SIGNS.get(letter)


def _formula(text: str) -> str:
    """Replace the letters of a formula; its commands stay."""
    found = []
    for letter in text:
        command = _command(letter)
        found.append(letter if command is None else f"{{{command}}}")
    return "".join(found)


class _Renderer(RendererPgf):
    """Writes PGF; texts are measured in matplotlib's fonts.

    Parameters
    ----------
    figure : Figure
        What is drawn.
    text : StringIO
        Where to.
    measure : RendererAgg
        Measures texts.
    """

    def __init__(self, figure: Figure, text: StringIO, measure: Any) -> None:
        super().__init__(figure, text)  # type: ignore[no-untyped-call]
        self._measure = measure

    def get_text_width_height_descent(self, s: str, prop: Any, ismath: Any) -> Any:
        """Return the size of a text, pixels."""
        return self._measure.get_text_width_height_descent(s, prop, ismath)

    def draw_text(
        self,
        gc: Any,
        x: float,
        y: float,
        s: str,
        prop: Any,
        angle: float,
        ismath: Any = False,
        mtext: Any = None,
    ) -> None:
        """Write a text as LaTeX."""
        s = latex(s, math=bool(ismath))
        super().draw_text(gc, x, y, s, prop, angle, ismath, mtext)  # type: ignore[no-untyped-call]
