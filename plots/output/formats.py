"""The formats of pictures, films, pages and chart texts, rows of `gms_fsm.formats`.

A format is added by one row here, or with `register` from anywhere else.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gms_fsm import formats
from gms_fsm.formats import *  # noqa: F403
from gms_fsm.formats import Format, Written, of, register

__all__: list[str] = []
__all__ += formats.__all__


# --------------------------------------------------------------------------- writers
def _graphviz(form: str) -> Callable[[Any], bytes]:
    def write(graph: Any) -> bytes:
        from plots.output.graphviz import picture

        return picture(graph, form)

    return write


def _dot(graph: Any) -> bytes:
    text: str = graph.source
    return text.encode()


def _mermaid(chart: Any) -> bytes:
    from plots.output.mermaid import mermaid

    return mermaid(chart).encode()


def _plantuml(chart: Any) -> bytes:
    from plots.output.plantuml import plantuml

    return plantuml(chart).encode()


def _tikz(chart: Any) -> bytes:
    from plots.output.tikz import tikz

    return tikz(chart).encode()


def _matplotlib(form: str, **metadata: None) -> Callable[[Any], bytes]:
    def write(figure: Any) -> bytes:
        from plots.figures.saving import picture

        return picture(figure, form, metadata)

    return write


def _gif(movie: Any) -> bytes:
    from plots.film.files import gif

    return gif(movie)


def _video(form: str, codec: str) -> Callable[[Any], bytes]:
    def write(movie: Any) -> bytes:
        from plots.film.files import video

        return video(movie, form, codec)

    return write


def _html(page: Any) -> bytes:
    text: str = page.html
    return text.encode()


# --------------------------------------------------------------------------- the table
# The same trace must give the same file, so matplotlib writes no dates.
_svg, _pdf = _matplotlib("svg", Date=None), _matplotlib("pdf", CreationDate=None)
for _row in (
    Format(".svg", "graph", "a picture", "Graphviz", _graphviz("svg"), "render", usual=True),
    Format(".png", "graph", "a picture", "Graphviz", _graphviz("png"), "render", usual=True),
    Format(".pdf", "graph", "a picture", "Graphviz", _graphviz("pdf"), "render"),
    Format(".dot", "graph", "DOT text", "gms-fsm", _dot),
    Format(".gv", "graph", "DOT text", "gms-fsm", _dot),
    Format(".mmd", "chart", "Mermaid text", "gms-fsm", _mermaid),
    Format(".puml", "chart", "PlantUML text", "gms-fsm", _plantuml),
    Format(".tikz", "chart", "TikZ text", "gms-fsm", _tikz),
    Format(".png", "figure", "a figure", "matplotlib", _matplotlib("png"), "plots", usual=True),
    Format(".svg", "figure", "a figure", "matplotlib", _svg, "plots", usual=True),
    Format(".pdf", "figure", "a figure", "matplotlib", _pdf, "plots"),
    Format(".gif", "animation", "an animation", "Pillow", _gif, "plots"),
    Format(".mp4", "animation", "an animation", "PyAV", _video("mp4", "libx264"), "film"),
    Format(".webm", "animation", "an animation", "PyAV", _video("webm", "libvpx-vp9"), "film"),
    Format(".html", "page", "a replay page", "gms-fsm", _html, "replay", usual=True),
):
    register(_row)


def formats_of(*subjects: Written) -> list[Format]:
    """Return the formats of subjects, those of pictures included: what rooms below ask for."""
    return of(*subjects)
