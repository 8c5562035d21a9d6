"""Draws a Graphviz graph with the Graphviz that is available, in the fonts of `plots.style`.

First the program ``dot`` on PATH, then the Python package pygraphviz, whose wheels contain the
Graphviz libraries. Both run in a process of their own: fontconfig reads its settings once in a
process, and pygraphviz cannot be told to be silent about labels that are wider than they need be.
"""

from __future__ import annotations

import atexit
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from tempfile import mkdtemp
from xml.sax.saxutils import escape

import graphviz

from gms_fsm.errors import OutputError
from gms_fsm.foundation.extras import missing
from gms_fsm.foundation.text import encoded
from plots.style.fonts import FOLDER

PNG_DPI = "144"  # twice a screen point: crisp on dense displays

_PACKAGE = """
import sys, pygraphviz
engine, form, args = sys.argv[1:]
try:
    graph = pygraphviz.AGraph(string=sys.stdin.buffer.read().decode())
    sys.stdout.buffer.write(graph.draw(format=form, prog=engine, args=args))
except (ValueError, OSError) as error:
    sys.exit(str(error))
"""

# Not the file of the system, which old libraries complain of. Other fonts are for characters that
# ours lack; DejaVu must be ours, because other versions of it may be installed. Upright letters are
# slanted where italics are wanted: symbols keep the widths that are measured.
_FONTS = """<?xml version="1.0"?>
<!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig>
  {folders}
  <selectfont>
    <acceptfont><glob>{ours}/*</glob></acceptfont>
    <rejectfont><glob>*/DejaVuSans*</glob></rejectfont>
  </selectfont>
  <match target="font">
    <test name="slant"><const>roman</const></test>
    <test target="pattern" name="slant" compare="not_eq"><const>roman</const></test>
    <edit name="matrix" mode="assign">
      <times>
        <name>matrix</name>
        <matrix><double>1</double><double>0.2</double><double>0</double><double>1</double></matrix>
      </times>
    </edit>
    <edit name="slant" mode="assign"><const>oblique</const></edit>
  </match>
  <cachedir prefix="xdg">fontconfig</cachedir>
  <cachedir>{cache}</cachedir>
</fontconfig>
"""
_OTHERS = (
    "<dir>/usr/share/fonts</dir>",
    "<dir>/usr/local/share/fonts</dir>",
    "<dir>/System/Library/Fonts</dir>",
    "<dir>/Library/Fonts</dir>",
    "<dir>WINDOWSFONTDIR</dir>",
    "<dir>~/Library/Fonts</dir>",
    '<dir prefix="xdg">fonts</dir>',
    "<dir>~/.fonts</dir>",
)


def picture(graph: graphviz.Digraph, form: str) -> bytes:
    """Return a picture as bytes."""
    found = drawn(graph, form)
    if found is None:
        raise missing("Graphviz", "render")
    return found


def drawn(graph: graphviz.Digraph, form: str) -> bytes | None:
    """Return a picture as bytes, or None if there is no Graphviz."""
    if not available():
        return None
    program = shutil.which("dot")
    # -q: our labels have fixed sizes, and Graphviz warns where it would make them wider.
    args = ["-q", *([f"-Gdpi={PNG_DPI}"] if form == "png" else [])]
    if program is not None:
        name, command = program, [program, f"-K{graph.engine}", f"-T{form}", *args]
    else:
        name = "pygraphviz"
        command = [sys.executable, "-c", _PACKAGE, graph.engine, form, " ".join(args)]
    fonts = {"FONTCONFIG_FILE": str(_settings())}
    done = subprocess.run(
        command,
        input=encoded(graph.source),
        capture_output=True,
        check=False,
        env=os.environ | fonts,
    )
    if done.returncode != 0:
        message = done.stderr.decode(errors="replace").strip()
        raise OutputError(f"Graphviz ({name}) cannot draw this graph: {message}")
    found: bytes = done.stdout
    if form == "pdf":
        # The same chart gives the same file: only the date would differ.
        found = re.sub(rb"(/CreationDate \(D:)\d{14}", rb"\g<1>19700101000000", found)
    return found


def available() -> bool:
    """Return whether there is a Graphviz: the program dot, or the package pygraphviz."""
    return shutil.which("dot") is not None or find_spec("pygraphviz") is not None


@cache
def _settings() -> Path:
    """Return a file of settings for fontconfig; its folder is removed when Python ends."""
    folder = Path(mkdtemp(prefix="gms-fsm-fonts-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    ours = escape(FOLDER.as_posix())
    folders = "\n  ".join([f"<dir>{ours}</dir>", *_OTHERS])
    text = _FONTS.format(folders=folders, ours=ours, cache=escape(folder.as_posix()))
    file = folder / "fonts.conf"
    file.write_bytes(encoded(text))
    return file
