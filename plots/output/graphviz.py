"""Draws a Graphviz graph with the Graphviz that is available.

First the program ``dot`` on PATH, then the Python package pygraphviz, whose wheels contain the
Graphviz libraries.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from importlib.util import find_spec

import graphviz

from gms_fsm.errors import OutputError
from gms_fsm.foundation.extras import missing

PNG_DPI = "144"  # twice a screen point: crisp on dense displays


def picture(graph: graphviz.Digraph, form: str) -> bytes:
    """Return a picture as bytes."""
    found = drawn(graph, form)
    if found is None:
        raise missing("Graphviz", "render")
    return found


def drawn(graph: graphviz.Digraph, form: str) -> bytes | None:
    """Return a picture as bytes, or None if there is no Graphviz."""
    picture = _by_program(graph, form)
    if picture is None:
        picture = _by_package(graph, form)
    if picture is not None and form == "pdf":
        # The same chart gives the same file: only the date would differ.
        picture = re.sub(rb"(/CreationDate \(D:)\d{14}", rb"\g<1>19700101000000", picture)
    return picture


def available() -> bool:
    """Return whether there is a Graphviz: the program dot, or the package pygraphviz."""
    return shutil.which("dot") is not None or find_spec("pygraphviz") is not None


def _by_program(graph: graphviz.Digraph, form: str) -> bytes | None:
    program = shutil.which("dot")
    if program is None:
        return None
    # -q: our labels have fixed sizes, and Graphviz warns where its own font is wider.
    command = [program, "-q", f"-K{graph.engine}", f"-T{form}"]
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
        picture: bytes = drawing.draw(format=form, prog=graph.engine, args="-q")
    except (ValueError, OSError) as error:
        raise OutputError(f"Graphviz (pygraphviz) cannot draw this graph: {error}") from None
    return picture
