"""The formats of pictures, films, pages and chart texts: rows of `gms_fsm.formats.FORMATS`.

A format is added by one row here, or with `register` from anywhere else.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from gms_fsm import formats
from gms_fsm.formats import *  # noqa: F403
from gms_fsm.formats import Format, Written, of, register
from gms_fsm.foundation.text import encoded

__all__: list[str] = []
__all__ += formats.__all__


# --------------------------------------------------------------------------- writers
def _late(module: str, name: str, *more: Any) -> Callable[[Any], bytes]:
    """Return a writer of a module of `plots` that is imported when something is written."""

    def write(subject: Any) -> bytes:
        written = getattr(import_module(f"plots.{module}"), name)(subject, *more)
        return encoded(written) if isinstance(written, str) else bytes(written)

    return write


def _dot(graph: Any) -> bytes:
    text: str = graph.source
    return encoded(text)


def _graph(form: str) -> Callable[[Any], bytes]:
    return _late("output.graphviz", "picture", form)


def _html(page: Any) -> bytes:
    text: str = page.html
    return encoded(text)


# --------------------------------------------------------------------------- the table
# The same trace must give the same file, so matplotlib writes no dates.
_png = _late("figures.saving", "picture", "png", {})
_svg = _late("figures.saving", "picture", "svg", {"Date": None})
_pdf = _late("figures.saving", "picture", "pdf", {"CreationDate": None})
_mp4 = _late("film.files", "video", "mp4", "libx264")
_webm = _late("film.files", "video", "webm", "libvpx-vp9")
_mermaid, _plantuml, _tikz = (
    _late(f"output.{name}", name) for name in ("mermaid", "plantuml", "tikz")
)
for _row in (
    Format(".svg", "graph", "a picture", "Graphviz", _graph("svg"), "render", usual=True),
    Format(".png", "graph", "a picture", "Graphviz", _graph("png"), "render", usual=True),
    Format(".pdf", "graph", "a picture", "Graphviz", _graph("pdf"), "render"),
    Format(".dot", "graph", "DOT text", "gms-fsm", _dot),
    Format(".gv", "graph", "DOT text", "gms-fsm", _dot),
    Format(".mmd", "chart", "Mermaid text", "gms-fsm", _mermaid),
    Format(".puml", "chart", "PlantUML text", "gms-fsm", _plantuml),
    Format(".tikz", "chart", "TikZ text", "gms-fsm", _tikz),
    Format(".png", "figure", "a figure", "matplotlib", _png, "plots", usual=True),
    Format(".svg", "figure", "a figure", "matplotlib", _svg, "plots", usual=True),
    Format(".pdf", "figure", "a figure", "matplotlib", _pdf, "plots"),
    Format(".gif", "animation", "an animation", "Pillow", _late("film.files", "gif"), "plots"),
    Format(".mp4", "animation", "an animation", "PyAV", _mp4, "film"),
    Format(".webm", "animation", "an animation", "PyAV", _webm, "film"),
    Format(".html", "page", "a replay page", "gms-fsm", _html, "replay", usual=True),
):
    register(_row)


def formats_of(*subjects: Written) -> list[Format]:
    """Return the formats of subjects, those of pictures included: what rooms below ask for."""
    return of(*subjects)
