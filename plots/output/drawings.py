"""Drawings that show themselves: a graph with whatever Graphviz is installed, and SVG text."""

from __future__ import annotations

from base64 import b64encode
from html import escape

import graphviz

from gms_fsm.errors import OutputError
from gms_fsm.foundation.text import encoded, visible_lines
from plots.output.graphviz import drawn


def image(picture: str | bytes, words: str) -> str:
    """Return a picture as an image in HTML, no wider than the page.

    JupyterLab cuts off the right side of a wide SVG document that is not in HTML.

    Examples
    --------
    >>> image("<svg></svg>", "nothing")
    '<img style="max-width:100%" alt="nothing" src="data:image/svg+xml;base64,PHN2Zz48L3N2Zz4=">'
    """
    raw, kind = (picture, "png") if isinstance(picture, bytes) else (encoded(picture), "svg+xml")
    data = b64encode(raw).decode()
    words = escape(visible_lines(words))
    return f'<img style="max-width:100%" alt="{words}" src="data:image/{kind};base64,{data}">'


def svg_of(graph: graphviz.Digraph) -> str | None:
    """Return a graph as SVG, or None if it cannot be drawn."""
    try:
        picture = drawn(graph, "svg")
    except OutputError:
        return None
    return None if picture is None else picture.decode()


class DrawnGraph(graphviz.Digraph):  # type: ignore[misc]
    """A Graphviz graph that a notebook shows as a picture, or as text without Graphviz.

    Examples
    --------
    >>> from plots import block_diagram
    >>> block_diagram(2)
    <DrawnGraph 'block diagram'; plots.render writes it to a file>
    """

    text = ""  # what is drawn, in words; shown without Graphviz

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name!r:.120}; plots.render writes it to a file>"

    def _repr_mimebundle_(
        self,
        **_: object,  # include, exclude: the caller selects again
    ) -> dict[str, str]:
        # graphviz would run the program dot, and raise an error where there is none.
        picture = svg_of(self)
        if picture is None:
            return {"text/plain": self.text or repr(self)}
        html = image(picture, self.text)
        return {"text/html": html, "image/svg+xml": picture, "text/plain": repr(self)}


class _ShownText(str):
    """Text of a picture, which a prompt shows by its length."""

    __slots__ = ()
    kind = ""

    def __repr__(self) -> str:
        return f"<{self.kind} of {len(self)} characters>"


class Svg(_ShownText):
    """An SVG document as text, which a notebook shows as a picture.

    Examples
    --------
    >>> Svg("<svg></svg>")
    <SVG document of 11 characters>
    """

    __slots__ = ()
    kind = "SVG document"

    def _repr_svg_(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return image(self, "a picture")


class MermaidText(_ShownText):
    """Mermaid text, which a notebook shows as a diagram where it knows Mermaid.

    Examples
    --------
    >>> MermaidText("stateDiagram-v2")
    <Mermaid text of 15 characters>
    """

    __slots__ = ()
    kind = "Mermaid text"

    def _repr_markdown_(self) -> str:
        return f"```mermaid\n{self}```"


class PlantUMLText(_ShownText):
    """PlantUML text.

    Examples
    --------
    >>> PlantUMLText("@startuml")
    <PlantUML text of 9 characters>
    """

    __slots__ = ()
    kind = "PlantUML text"


class TikzText(_ShownText):
    r"""A TikZ picture as text.

    Examples
    --------
    >>> TikzText(r"\begin{tikzpicture}")
    <TikZ text of 19 characters>
    """

    __slots__ = ()
    kind = "TikZ text"
