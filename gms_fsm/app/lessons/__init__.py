r"""Lessons: the behaviour of friction models, and the pitfalls of simulating and fitting.

Each lesson answers one question: ``run()`` makes the runs and measures, ``figure(result)`` draws
what it returns, and ``result.lines()`` summarizes it in five lines, in which every number is
measured in that run. A module ``lN_name`` in a folder of this one, with a `LESSON`, is a lesson.

>>> print(lesson(7).question)
Why does friction lag behind the speed?
>>> print(*lesson(7).run().lines(), sep="\n")  # doctest: +ELLIPSIS
Question: Why does friction lag behind the speed?
Run: GMS, 4 elements, signed law, all in slip, v = 1.5 + 1 cos(w t) mm/s, ...
"""

from __future__ import annotations

import importlib
import pkgutil
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gms_fsm.app.lessons.engine.lesson import Lesson, Result
from gms_fsm.errors import MissingExtraError, ParameterError, shown
from gms_fsm.foundation.files import output_folder, write_text

__all__ = [
    "LESSONS",
    "Lesson",
    "Result",
    "Taught",
    "lesson",
    "listed",
    "numbered",
    "teach",
    "write_page",
]


def _found() -> Mapping[int, Lesson]:
    """Return the lessons in these folders: a module ``l3_name`` is lesson 3."""
    found = pkgutil.walk_packages(__path__, f"{__name__}.")
    names = (re.search(r"\.l(\d+)_\w+$", each.name) for each in found)
    modules = {int(name[1]): name.string for name in names if name}
    return {number: importlib.import_module(modules[number]).LESSON for number in sorted(modules)}


LESSONS: Mapping[int, Lesson] = _found()


@dataclass(frozen=True, eq=False)
class Taught:
    """A lesson that was run.

    Parameters
    ----------
    lines : tuple of str
        The five lines of the lesson.
    files : tuple of Path
        The files written, the text first.
    """

    lines: tuple[str, ...]
    files: tuple[Path, ...]


def lesson(number: int) -> Lesson:
    """Return a lesson.

    Parameters
    ----------
    number : int
        For example 7.

    Returns
    -------
    Lesson
        With its title, its question, ``run()`` and ``figure(result)``.

    Raises
    ------
    ParameterError
        If there is no such lesson.

    Examples
    --------
    >>> lesson(7).title
    'Frictional lag'
    """
    return LESSONS[numbered(str(number))]


def numbered(text: str) -> int:
    """Return the number of a lesson, given as text.

    Parameters
    ----------
    text : str
        Number as text, for example ``"7"``.

    Returns
    -------
    int
        A key of `LESSONS`.

    Raises
    ------
    ParameterError
        If there is no such lesson; the message lists all lessons.
    """
    for number in LESSONS:
        if text == str(number):
            return number
    raise ParameterError(f"there is no lesson {shown(text)}", advice=f"choose one of\n{listed()}")


def listed() -> str:
    """Return a list of the lessons, one line each.

    Returns
    -------
    str
        Number, title and question.
    """
    return "\n".join(f"{key}  {each.title}: {each.question}" for key, each in LESSONS.items())


def teach(number: int, folder: str | Path) -> Taught:
    """Run a lesson and write its text, figure and replay page.

    Parameters
    ----------
    number : int
        For example 7.
    folder : str or Path
        Output folder for ``lesson_N.txt``, the figure and the replay page; created before the run
        if it does not exist.

    Returns
    -------
    Taught
        The lines and the files.

    Raises
    ------
    ParameterError
        If there is no such lesson.
    OutputError
        If the folder cannot be written.

    Warns
    -----
    UserWarning
        If the figure or the page is omitted because an extra is not installed.
    """
    from plots.output import formats

    chosen = lesson(number)
    stem = f"lesson_{number}"
    pictures, pages = formats.files(stem, "figure"), formats.files(stem, "page")
    folder = output_folder(folder, [f"{stem}.txt", *pictures, *pages])
    result = chosen.run()
    files = [write_text(folder / f"{stem}.txt", "\n".join([*result.lines(), ""]))]
    for kind, names, write in (("figure", pictures, _draw), ("replay page", pages, _replay)):
        try:
            files += write(result, [folder / name for name in names])
        except MissingExtraError as error:
            warnings.warn(f"no {kind} was written: {error}", stacklevel=2)
    return Taught(result.lines(), tuple(files))


def write_page(number: int, folder: str | Path) -> Path:
    """Run a lesson and write it as one live page: predict, be judged, drag, read why.

    Parameters
    ----------
    number : int
        For example 6.
    folder : str or Path
        Output folder for ``lesson_6_live.html``.

    Returns
    -------
    Path
        The page, which needs no network.

    Raises
    ------
    ParameterError
        If there is no such lesson.
    OutputError
        If the folder cannot be written.
    MissingExtraError
        If uPlot or matplotlib is not installed.
    """
    from gms_fsm.app.lessons.engine.page import live_page

    chosen, name = lesson(number), f"lesson_{number}_live.html"
    folder = output_folder(folder, [name])
    return live_page(chosen.run()).save(folder / name)


def _draw(result: Result, paths: list[Path]) -> list[Path]:
    from plots import figures

    figure = result.lesson.figure(result)
    return [figures.save(figure, path) for path in paths]


def _replay(result: Result, paths: list[Path]) -> list[Path]:
    from plots.page.replay import replay

    runs = result.replayed
    page = replay(*runs.values(), title=result.lesson.heading, names=list(runs))
    return [page.save(path) for path in paths]
