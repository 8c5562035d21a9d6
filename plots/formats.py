"""The file formats: what pictures and texts can be written to, by which program and extra.

`FORMATS` is the only list of file endings. The command-line help, `plots.render`,
`plots.figures.save`, `plots.animate`, scenario files and the messages about a wrong ending read it.
A format is added by one row here, or with `register` from anywhere else.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from gms_fsm._arguments import checked_path
from gms_fsm._extras import EXTRAS
from gms_fsm._files import write_whole
from gms_fsm.errors import ParameterError

__all__ = [
    "FORMATS",
    "Format",
    "Subject",
    "chosen",
    "either",
    "endings",
    "files",
    "listed",
    "register",
    "save",
]

Subject = Literal["graph", "chart", "figure", "animation", "page"]


@dataclass(frozen=True)
class Format:
    """A file format.

    Parameters
    ----------
    ending : str
        File ending, for example ``".svg"``; lower case.
    subject : {"graph", "chart", "figure", "animation", "page"}
        What is written: any Graphviz graph, the graph of a state chart only, a matplotlib figure,
        an animation, a replay page.
    kind : str
        What the file contains, for messages, for example ``"a picture"``.
    writer : str
        The program that writes it, for example ``"Graphviz"``.
    write : callable
        Takes the subject and returns the file's bytes. It may raise `MissingExtraError`.
    extra : str
        The extra of gms-fsm that it needs; empty if none.
    usual : bool
        Whether commands that write several pictures to a folder write this format.

    Raises
    ------
    ParameterError
        If the ending, the subject or the extra is not one of those above.
    """

    ending: str
    subject: Subject
    kind: str
    writer: str
    write: Callable[[Any], bytes]
    extra: str = ""
    usual: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.ending, str) or not re.fullmatch(r"\.[a-z0-9]+", self.ending):
            raise ParameterError(
                "it must be a dot and lower-case letters or digits",
                place="ending",
                value=self.ending,
            )
        for name, known in (("subject", get_args(Subject)), ("extra", ("", *EXTRAS))):
            value = getattr(self, name)
            if value not in known:
                raise ParameterError(
                    f"it must be one of {', '.join(map(repr, known))}", place=name, value=value
                )


# --------------------------------------------------------------------------- writers
def _graphviz(form: str) -> Callable[[Any], bytes]:
    def write(graph: Any) -> bytes:
        from plots._graphviz import picture

        return picture(graph, form)

    return write


def _dot(graph: Any) -> bytes:
    text: str = graph.source
    return text.encode()


def _mermaid(graph: Any) -> bytes:
    from plots.mermaid import mermaid

    return mermaid(graph.chart).encode()


def _plantuml(graph: Any) -> bytes:
    from plots.plantuml import plantuml

    return plantuml(graph.chart).encode()


def _tikz(graph: Any) -> bytes:
    from plots.tikz import tikz

    return tikz(graph.chart).encode()


def _matplotlib(form: str, **metadata: None) -> Callable[[Any], bytes]:
    def write(figure: Any) -> bytes:
        from plots.figures._saving import picture

        return picture(figure, form, metadata)

    return write


def _gif(movie: Any) -> bytes:
    from plots.film._files import gif

    return gif(movie)


def _video(form: str, codec: str) -> Callable[[Any], bytes]:
    def write(movie: Any) -> bytes:
        from plots.film._files import video

        return video(movie, form, codec)

    return write


def _html(page: Any) -> bytes:
    text: str = page.html
    return text.encode()


# --------------------------------------------------------------------------- the table
# The same trace must give the same file, so matplotlib writes no dates.
_svg, _pdf = _matplotlib("svg", Date=None), _matplotlib("pdf", CreationDate=None)
FORMATS: list[Format] = [
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
]
INSTEAD = ".dot"  # written for a graph if there is no Graphviz


def register(new: Format) -> None:
    """Add a format.

    Parameters
    ----------
    new : Format
        The format.

    Raises
    ------
    ParameterError
        If its subject already has a format with that ending.

    Examples
    --------
    >>> from gms_fsm.charts import LUGRE
    >>> from plots import statechart
    >>> size = Format(".size", "graph", "a size", "me", lambda graph: b"%d" % len(graph.body))
    >>> register(size)
    >>> chosen("chart.size", "graph").write(statechart(LUGRE))
    b'4'
    >>> FORMATS.remove(size)
    """
    if any((old.ending, old.subject) == (new.ending, new.subject) for old in FORMATS):
        raise ParameterError(f"the subject {new.subject!r} already has a format {new.ending}")
    FORMATS.append(new)


def of(*subjects: Subject) -> list[Format]:
    """Return the formats of subjects, in table order."""
    return [each for each in FORMATS if each.subject in subjects]


def endings(*subjects: Subject, usual: bool = False) -> list[str]:
    """Return the file endings of subjects.

    Parameters
    ----------
    *subjects : {"graph", "chart", "figure", "animation", "page"}
        What is written.
    usual : bool
        Only those that are written by default.

    Returns
    -------
    list of str
        With dots.

    Examples
    --------
    >>> endings("figure")
    ['.png', '.svg', '.pdf']
    """
    return [each.ending for each in of(*subjects) if each.usual or not usual]


def files(stem: str, subject: Subject) -> list[str]:
    """Return the names of the files that may be written by default.

    Parameters
    ----------
    stem : str
        Name without file ending.
    subject : {"graph", "chart", "figure", "animation", "page"}
        What is written.

    Returns
    -------
    list of str
        For a graph, including the text that is written without Graphviz.

    Examples
    --------
    >>> files("chart", "graph")
    ['chart.svg', 'chart.png', 'chart.dot']
    """
    found = endings(subject, usual=True) + ([INSTEAD] if subject in ("graph", "chart") else [])
    return [stem + ending for ending in found]


def listed(*subjects: Subject) -> str:
    """Return the file endings of subjects as text for a sentence.

    Parameters
    ----------
    *subjects : {"graph", "chart", "figure", "animation", "page"}
        What is written.

    Returns
    -------
    str
        With their contents, if these differ.

    Examples
    --------
    >>> listed("figure")
    '.png, .svg or .pdf'
    >>> listed("chart")
    '.mmd for Mermaid text or .puml for PlantUML text or .tikz for TikZ text'
    """
    kinds: dict[str, list[str]] = {}
    for each in of(*subjects):
        kinds.setdefault(each.kind, []).append(each.ending)
    if len(kinds) == 1:
        return either(*kinds.values())
    return " or ".join(f"{', '.join(found)} for {kind}" for kind, found in kinds.items())


def either(words: Sequence[str]) -> str:
    """Return words joined as in a sentence.

    >>> either([".png", ".svg", ".pdf"])
    '.png, .svg or .pdf'
    """
    return " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def chosen(path: str | Path, *subjects: Subject) -> Format:
    """Return the format selected by the ending of a path.

    Parameters
    ----------
    path : str or Path
        Path of the file; case does not matter.
    *subjects : {"graph", "chart", "figure", "animation", "page"}
        What is written.

    Returns
    -------
    Format
        A row of `FORMATS`.

    Raises
    ------
    ParameterError
        If there is no such format; the message lists the available ones.

    Examples
    --------
    >>> chosen("a.SVG", "figure").writer
    'matplotlib'
    >>> chosen("a.bmp", "figure")
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: path is 'a.bmp'; it must end in .png, .svg or .pdf
    """
    path = checked_path("path", path)
    for each in of(*subjects):
        if path.suffix.lower() == each.ending:
            return each
    raise ParameterError(f"it must end in {listed(*subjects)}", place="path", value=str(path))


def save(made: Any, path: str | Path, *subjects: Subject) -> Path:
    """Write something to a file; the file ending selects the format.

    Parameters
    ----------
    made : object
        A graph, a figure, an animation or a page.
    path : str or Path
        The folder must exist. An existing file is replaced atomically.
    *subjects : {"graph", "chart", "figure", "animation", "page"}
        What is written.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ParameterError
        If there is no such format.
    OutputError
        If the folder cannot be written.
    MissingExtraError
        If the format needs an extra that is not installed.
    """
    write = chosen(path, *subjects).write
    # The folder is checked first, because an animation takes long.
    return write_whole(Path(path), lambda file: file.write(write(made)))
