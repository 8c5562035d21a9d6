"""The teaching pack: everything for a class of 90 minutes, in files that need no network."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from gms_fsm.app.lessons import LESSONS
from gms_fsm.app.lessons.engine.notebooks import composed, notebook
from gms_fsm.app.lessons.engine.page import live_page
from gms_fsm.app.lessons.pack.sheets import HOMEWORK, homework, plan, slides, solutions, tasks
from gms_fsm.foundation.files import output_folder, write_text

CHOSEN = (1, 6, 7, 9)  # the lessons of the class
SHEETS = ("index.html", "slides.html", "tasks.html", "solutions.html", "homework.html")


def write_class(folder: str | Path, tell: Callable[[str], None] = print) -> list[Path]:
    """Write the teaching pack: a plan, slides, tasks, solutions, homework, and four lessons.

    Parameters
    ----------
    folder : str or Path
        Output folder; ``index.html`` is where to begin.
    tell : callable, optional
        Called with the name of what is being made.

    Returns
    -------
    list of Path
        The files, the plan first.

    Raises
    ------
    OutputError
        If the folder cannot be written.
    MissingExtraError
        If uPlot or matplotlib is not installed.
    """
    pages = {number: f"lesson_{number}_live.html" for number in CHOSEN}
    books = {number: f"lesson_{number}.ipynb" for number in CHOSEN}
    names = [*SHEETS, *pages.values(), *books.values(), HOMEWORK.name]
    folder = output_folder(folder, names)
    results, files = [], []
    for number in CHOSEN:
        tell(f"lesson {number}")
        result = LESSONS[number].run()
        results.append(result)
        files.append(live_page(result).save(folder / pages[number]))
        files.append(write_text(folder / books[number], notebook(composed(number))))
    tell("slides, tasks and solutions")
    made = (plan(results), slides(results), tasks(results), solutions(results), homework())
    sheets = [write_text(folder / name, text) for name, text in zip(SHEETS, made, strict=True)]
    book = write_text(folder / HOMEWORK.name, HOMEWORK.read_text(encoding="utf-8"))
    return [*sheets, *files, book]
