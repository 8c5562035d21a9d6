"""The one table of output formats: pictures, texts and programs, each a row `Format`.

A room registers the formats that it writes: `plots.output.formats` those of pictures and pages,
each module of `gms_fsm.exporters` those of programs. Command line, help, messages, scenario files,
`plots.render`, `plots.figures.save`, `plots.animate` and `gms_fsm.export` read the table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_path, one_of
from gms_fsm.foundation.extras import EXTRAS
from gms_fsm.foundation.files import write_whole

__all__ = [
    "FORMATS",
    "INSTEAD",
    "Format",
    "Written",
    "chosen",
    "either",
    "endings",
    "files",
    "listed",
    "of",
    "register",
    "save",
]

Written = Literal["graph", "chart", "figure", "animation", "page", "friction"]


@dataclass(frozen=True)
class Format:
    """A format.

    Parameters
    ----------
    name : str
        Of one file its ending, for example ``".svg"``; of several files a word, for example
        ``"c99"``. Lower case.
    subject : {"graph", "chart", "figure", "animation", "page", "friction"}
        What is written: any Graphviz graph, a chart, a matplotlib figure, an animation, a replay
        page; or friction for another program.
    kind : str
        What is written, for messages and lists, for example ``"a picture"``.
    writer : str
        The program that writes it, for example ``"Graphviz"``.
    write : callable
        Takes the subject and returns the file's bytes. It may raise `MissingExtraError`. Of
        friction it takes a `gms_fsm.exporters.Subject`, refuses with a `ParameterError` what the
        format cannot express, and returns the contents of the files by name, a README included.
    extra : str
        The extra of gms-fsm that it needs; empty if none.
    usual : bool
        Whether commands that write several pictures to a folder write this format.
    words : collection of str
        Words of the format's language, which no exported name may be.
    takes : tuple of str
        Which of ``initial``, ``t_start``, ``settings``, ``t_end`` and ``compensator`` it uses;
        `gms_fsm.export` refuses the others.
    whole : bool
        Whether it takes systems, too.

    Raises
    ------
    ParameterError
        If the name, the subject or the extra is not one of those above.
    """

    name: str
    subject: Written
    kind: str
    writer: str
    write: Callable[[Any], Any]
    extra: str = ""
    usual: bool = False
    words: Collection[str] = ()
    takes: tuple[str, ...] = ()
    whole: bool = False

    def __post_init__(self) -> None:
        for name, known in (("subject", get_args(Written)), ("extra", ("", *EXTRAS))):
            one_of(name, getattr(self, name), known)
        dot = "" if self.subject == "friction" else "a dot and "
        pattern = r"\.[a-z0-9]+" if dot else "[a-z0-9]+"
        if not isinstance(self.name, str) or not re.fullmatch(pattern, self.name):
            raise ParameterError(
                f"it must be {dot}lower-case letters or digits", place="name", value=self.name
            )


FORMATS: list[Format] = []
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
        If its subject already has a format of that name.

    Examples
    --------
    >>> states = Format("states", "friction", "names of states", "me", lambda subject: {})
    >>> register(states)
    >>> FORMATS.remove(states)
    """
    if any((old.name, old.subject) == (new.name, new.subject) for old in FORMATS):
        raise ParameterError(f"the subject {new.subject!r} already has a format {new.name}")
    FORMATS.append(new)


def of(*subjects: Written) -> list[Format]:
    """Return the formats of subjects, in table order."""
    return [each for each in FORMATS if each.subject in subjects]


def endings(*subjects: Written, usual: bool = False) -> list[str]:
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
    >>> import plots.output.formats  # the rows of pictures
    >>> endings("page")
    ['.html']
    """
    return [each.name for each in of(*subjects) if each.usual or not usual]


def files(stem: str, subject: Written) -> list[str]:
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
    >>> import plots.output.formats
    >>> files("run", "page")
    ['run.html']
    """
    found = endings(subject, usual=True) + ([INSTEAD] if subject in ("graph", "chart") else [])
    return [stem + ending for ending in found]


def listed(*subjects: Written) -> str:
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
    >>> import plots.output.formats
    >>> listed("page")
    '.html'
    """
    kinds: dict[str, list[str]] = {}
    for each in of(*subjects):
        kinds.setdefault(each.kind, []).append(each.name)
    if len(kinds) == 1:
        return either(*kinds.values())
    return " or ".join(f"{', '.join(found)} for {kind}" for kind, found in kinds.items())


def either(words: Sequence[str]) -> str:
    """Return words joined as in a sentence.

    >>> either(["one", "two", "three"])
    'one, two or three'
    """
    return " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def chosen(path: str | Path, *subjects: Written) -> Format:
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
    >>> import plots.output.formats
    >>> chosen("a.HTML", "page").writer
    'gms-fsm'
    >>> chosen("a.bmp", "page")
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: path is 'a.bmp'; it must end in .html
    """
    path = checked_path("path", path)
    for each in of(*subjects):
        if path.suffix.lower() == each.name:
            return each
    raise ParameterError(f"it must end in {listed(*subjects)}", place="path", value=str(path))


def save(made: Any, path: str | Path, *subjects: Written) -> Path:
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
