"""Write a Graphviz picture to a file, with whatever Graphviz there is.

First the program ``dot`` on PATH, then the Python package pygraphviz, whose wheels bring the
Graphviz libraries along. Without either, the DOT text is written instead, with a warning that says
how to get pictures: a missing drawing program must not stop a computation.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import warnings
from collections.abc import Mapping
from pathlib import Path

import graphviz

from gms_fsm._files import written_whole
from gms_fsm.errors import OutputError, ParameterError
from plots.mermaid import mermaid
from plots.statechart import ChartGraph

__all__ = ["FORMATS", "drawn", "render"]

# What a file can be, by its suffix. Mermaid text is made of state charts only.
FORMATS: Mapping[str, str] = {
    ".svg": "a picture",
    ".png": "a picture",
    ".pdf": "a picture",
    ".dot": "DOT text",
    ".gv": "DOT text",
    ".mmd": "Mermaid text",
}
PNG_DPI = "144"  # twice a screen point: crisp on dense displays


def render(graph: graphviz.Digraph, path: str | Path) -> Path:
    """Write a picture; the format is the path's suffix.

    Parameters
    ----------
    graph : graphviz.Digraph
        For example from `plots.statechart.statechart`.
    path : str or Path
        Ends with ``.svg``, ``.png`` or ``.pdf`` for a picture, ``.dot`` or ``.gv`` for the DOT
        text; of a state chart also ``.mmd`` for Mermaid text. The folder has to exist. A file of
        that name is replaced as a whole or not at all.

    Returns
    -------
    Path
        The file really written: where there is no Graphviz, the DOT text beside `path`.

    Raises
    ------
    ParameterError
        If the suffix is another one.
    OutputError
        If the folder cannot be written, or if Graphviz cannot draw the graph.

    Warns
    -----
    UserWarning
        If there is no Graphviz, neither program nor package.

    Examples
    --------
    >>> import tempfile
    >>> from gms_fsm.charts import LUGRE
    >>> from plots.statechart import statechart
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     render(statechart(LUGRE), Path(folder, "lugre.dot")).name
    'lugre.dot'
    """
    if not hasattr(graph, "source"):
        raise ParameterError(
            f"graph is {graph!r:.60}; give first the graph, for example from statechart, then the "
            "path"
        )
    path = Path(path)
    suffix = path.suffix.lower()
    texts = {"DOT text": graph.source}
    if isinstance(graph, ChartGraph):
        texts["Mermaid text"] = mermaid(graph.chart)
    kinds = {s: kind for s, kind in FORMATS.items() if kind in ("a picture", *texts)}
    if suffix not in kinds:
        listed = [
            f"{', '.join(s for s in kinds if kinds[s] == kind)} for {kind}"
            for kind in dict.fromkeys(kinds.values())
        ]
        raise ParameterError(f"path is {str(path)!r}; it must end in {' or '.join(listed)}")
    if kinds[suffix] in texts:
        text = texts[kinds[suffix]].encode()
        return written_whole(path, lambda file: file.write(text))
    picture = drawn(graph, suffix[1:])
    if picture is not None:
        written_whole(path, lambda file: file.write(picture))
    else:
        path = path.with_suffix(".dot")
        written_whole(path, lambda file: file.write(graph.source.encode()))
        warnings.warn(
            # The same words each time, so that Python says them once a run, not once a picture.
            "No Graphviz was found, so charts are written as DOT text: install Graphviz (program "
            'dot) or run `pip install "gms-fsm[render]"` to get pictures.',
            stacklevel=2,
        )
    return path


def drawn(graph: graphviz.Digraph, form: str) -> bytes | None:
    """Return a picture as bytes, or None if there is no Graphviz.

    Parameters
    ----------
    graph : graphviz.Digraph
        What to draw.
    form : str
        ``"svg"``, ``"png"``, ``"pdf"`` or another output format of Graphviz.

    Returns
    -------
    bytes or None
        The picture.

    Raises
    ------
    OutputError
        If Graphviz cannot draw the graph.
    """
    picture = _by_program(graph, form)
    if picture is None:
        picture = _by_package(graph, form)
    if picture is not None and form == "pdf":
        # The same chart gives the same file: the date is the only thing that would change.
        picture = re.sub(rb"(/CreationDate \(D:)\d{14}", rb"\g<1>19700101000000", picture)
    return picture


def _by_program(graph: graphviz.Digraph, form: str) -> bytes | None:
    program = shutil.which("dot")
    if program is None:
        return None
    command = [program, f"-K{graph.engine}", f"-T{form}"]
    if form == "png":
        command.append(f"-Gdpi={PNG_DPI}")
    done = subprocess.run(command, input=graph.source.encode(), capture_output=True, check=False)
    if done.returncode != 0:
        message = done.stderr.decode(errors="replace").strip()
        raise OutputError(f"Graphviz ({program}) cannot draw this graph: {message}")
    picture: bytes = done.stdout
    return picture


def _by_package(graph: graphviz.Digraph, form: str) -> bytes | None:
    try:
        import pygraphviz
    except ImportError:
        return None
    try:
        drawing = pygraphviz.AGraph(string=graph.source)
        if form == "png":
            drawing.graph_attr["dpi"] = PNG_DPI
        picture: bytes = drawing.draw(format=form, prog=graph.engine)
    except (ValueError, OSError) as error:
        raise OutputError(f"Graphviz (pygraphviz) cannot draw this graph: {error}") from None
    return picture
