"""Drawings that show themselves: a graph with whatever Graphviz is installed, and SVG text."""

from __future__ import annotations

import re
from collections.abc import Container

import graphviz

__all__ = ["DrawnGraph", "MermaidText", "Svg", "fitted"]

FITTED = "max-width:100%;height:auto;"


def fitted(svg: str) -> str:
    """Return an SVG document that is no wider than the page it is in.

    Parameters
    ----------
    svg : str
        The document, with a size and a viewBox.

    Returns
    -------
    str
        The same with a style.

    Examples
    --------
    >>> fitted('<svg width="10pt" style="background:#FFF">')
    '<svg style="max-width:100%;height:auto;background:#FFF" width="10pt" >'
    """
    before, _, rest = svg.partition("<svg ")
    tag, _, after = rest.partition(">")
    own = re.search(r'style="([^"]*)"', tag)
    tag = tag.replace(own[0], "") if own else tag
    return f'{before}<svg style="{FITTED}{own[1] if own else ""}" {tag}>{after}'


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
        include: Container[str] | None = None,
        exclude: Container[str] | None = None,
        **_: object,
    ) -> dict[str, str]:
        # graphviz would run the program dot, and raise an error where there is none.
        from plots import notebook

        form = "image/svg+xml"
        if (include is None or form in include) and (exclude is None or form not in exclude):
            picture = notebook.svg_of(self)
            if picture is not None:
                return {form: picture, "text/plain": repr(self)}
        return {"text/plain": self.text or repr(self)}


class Svg(str):
    """An SVG document as text, which a notebook shows as a picture.

    Examples
    --------
    >>> Svg("<svg></svg>")
    <SVG document of 11 characters>
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return f"<SVG document of {len(self)} characters>"

    def _repr_svg_(self) -> str:
        return fitted(self)


class MermaidText(str):
    """Mermaid text, which a notebook shows as a diagram where it knows Mermaid.

    Examples
    --------
    >>> MermaidText("stateDiagram-v2")
    <Mermaid text of 15 characters>
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return f"<Mermaid text of {len(self)} characters>"

    def _repr_markdown_(self) -> str:
        return f"```mermaid\n{self}```"
