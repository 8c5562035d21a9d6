"""Notebooks of the lessons: written to the repository, executed, and written as pages of the site.

`gms_fsm.app.lessons.engine.notebooks` composes them. They are executed with warnings as errors, and
again only when a source has changed.

    python docs/notebooks.py    # writes docs/lessons/*.ipynb, which are in the repository
"""

from __future__ import annotations

import base64
import hashlib
import logging
import math
import time
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from queue import Empty
from typing import Any

import nbformat
from jupyter_client.asynchronous import AsyncKernelClient
from jupyter_client.channels import AsyncZMQSocketChannel
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from traitlets import Type

from gms_fsm.app.lessons import LESSONS
from gms_fsm.app.lessons.engine.notebooks import cells_of, composed, notebook

logging.getLogger("traitlets").setLevel(logging.WARNING)  # no line per notebook

ROOT = Path(__file__).parents[1]
MORE = ROOT / "docs" / "lessons"
PACK = ROOT / "gms_fsm" / "app" / "lessons" / "pack"
PAGES = (ROOT / "docs" / "howto" / "desk-experiment.md",)  # how-to pages that are notebooks too
# Warnings from inside the notebook packages are not ours to fix.
OTHERS = "IPython|ipykernel|ipywidgets|jupyter|matplotlib_inline|tornado|traitlets|zmq"
STRICT = f"""import warnings
warnings.simplefilter("error")
warnings.filterwarnings("ignore", module=".*({OTHERS})")"""
# The lessons' pages show sliders, so ipywidgets is there; nothing else of the extra docs is.
HIDDEN = ("furo", "latex2mathml", "myst_parser", "nbformat", "sphinx")
WITHOUT_DOCS = f"""import sys

import scipy.stats  # before: it takes the None of Sphinx below for a package

sys.modules.update(dict.fromkeys({HIDDEN!r}))  # as if not installed"""
VIEW = "application/vnd.jupyter.widget-view+json"
SLIDER_NOTE = "*The notebook has a slider; this page shows its initial picture.*"


# --------------------------------------------------------------------------- notebooks
def sources() -> dict[Path, str]:
    """Return the notebooks in the repository, without outputs.

    Returns
    -------
    dict of Path to str
        What each file must contain: the lessons, and the how-to pages in `PAGES`.
    """
    lessons = {MORE / f"lesson_{number}.ipynb": notebook(composed(number)) for number in LESSONS}
    pages = {
        MORE / f"{page.stem.replace('-', '_')}.ipynb": notebook(
            cells_of(page.read_text(encoding="utf-8"))
        )
        for page in PAGES
    }
    # The teaching pack brings the phone experiment along.
    packed = {PACK / path.name: text for path, text in pages.items()}
    return lessons | pages | packed


# --------------------------------------------------------------------------- executing
class _Channel(AsyncZMQSocketChannel):
    """Polls every second: an asynchronous socket occasionally misses a wake-up."""

    async def get_msg(self, timeout: float | None = None) -> dict[str, Any]:
        end = math.inf if timeout is None else time.monotonic() + timeout
        while True:
            left = end - time.monotonic()
            try:
                return await super().get_msg(timeout=max(0.0, min(1.0, left)))
            except Empty:
                if left <= 0:
                    raise


class _Client(AsyncKernelClient):
    shell_channel_class = Type(_Channel)
    iopub_channel_class = Type(_Channel)


class _Manager(AsyncKernelManager):
    client_factory = Type(_Client)


def executed(text: str, folder: Path, first: str = STRICT) -> Any:
    """Run a notebook.

    Parameters
    ----------
    text : str
        Contents of its file.
    folder : Path
        Where it runs.
    first : str, optional
        A program to run before the first cell.

    Returns
    -------
    NotebookNode
        With outputs, and the state of its widgets.

    Raises
    ------
    CellExecutionError
        If a cell fails or warns.
    """
    found = nbformat.reads(text, as_version=4)
    found.cells.insert(0, nbformat.v4.new_code_cell(first))
    NotebookClient(
        found,
        timeout=600,
        kernel_name="python3",
        kernel_manager_class=_Manager,
        extra_arguments=["--log-level=CRITICAL"],
        resources={"metadata": {"path": str(folder)}},
    ).execute()
    del found.cells[0]
    for output in _behind_sliders(found):
        if output["output_type"] == "error":
            raise RuntimeError("\n".join(output["traceback"]))
    return found


def _widgets(executed: Any) -> Mapping[str, Any]:
    found = executed.metadata.get("widgets", {}).values()
    return {name: widget for each in found for name, widget in each["state"].items()}


def _behind_sliders(executed: Any) -> Iterator[Mapping[str, Any]]:
    for widget in _widgets(executed).values():
        yield from widget["state"].get("outputs", ())


# --------------------------------------------------------------------------- a page
def page(executed: Any, name: str, title: str) -> tuple[str, dict[str, bytes]]:
    """Return a notebook as Markdown, with its pictures.

    Parameters
    ----------
    executed : NotebookNode
        From `executed`.
    name : str
        Of the page, without file extension.
    title : str
        Of the lesson.

    Returns
    -------
    (str, dict of str to bytes)
        The text, and files by their names.
    """
    widgets, lines, pictures = _widgets(executed), list[str](), dict[str, bytes]()

    runs_shown = False

    def shown(output: Mapping[str, Any]) -> None:
        nonlocal runs_shown
        if output["output_type"] == "stream":
            lines.append(f"```text\n{output['text'].rstrip()}\n```")
            return
        data = output["data"]
        if VIEW in data:
            box = widgets[data[VIEW]["model_id"]]["state"]
            for child in box.get("children", ()):
                for each in widgets[child.removeprefix("IPY_MODEL_")]["state"].get("outputs", ()):
                    shown(each)
            lines.append(SLIDER_NOTE)
        elif "image/svg+xml" in data:
            file = f"{name}_{len(pictures) + 1}.svg"
            pictures[file] = data["image/svg+xml"].encode()
            lines.append(f"![{title}: a chart]({file})")
        elif "image/png" in data:
            file = f"{name}_{len(pictures) + 1}.png"
            pictures[file] = base64.b64decode(data["image/png"])
            what = "initial picture of the slider" if runs_shown else "the runs"
            runs_shown = True
            lines.append(f"![{title}: {what}]({file})")
        else:
            lines.append(f"```text\n{data['text/plain']}\n```")

    for cell in executed.cells:
        if cell.cell_type == "markdown":
            lines.append(cell.source)
            continue
        lines.append(f"```ipython3\n{cell.source}\n```")
        for output in cell.outputs:
            shown(output)
    replay = f"{name}_replay.html"
    opened = f'<p><a href="{replay}">Open the replay page of these runs</a></p>'
    lines = [opened if line.strip("`\n").endswith(f"text\n{replay}") else line for line in lines]
    lines.insert(1, f"[This page as a notebook]({name}.ipynb), without its outputs.")
    return "\n\n".join(lines) + "\n", pictures


def common_sources() -> bytes:
    """Return the contents of all files of the three packages."""
    return b"".join(
        path.read_bytes()
        for package in ("gms_fsm", "integrators", "plots")
        for path in sorted((ROOT / package).rglob("*.*"))
        if "__pycache__" not in path.parts
    )


def write_all(folder: Path, run: Collection[int] = LESSONS) -> None:
    """Write every lesson that has changed: page, pictures, replay page.

    Parameters
    ----------
    folder : Path
        Destination.
    run : collection of int, optional
        Those whose notebooks are executed; the pages of the others have no outputs.
    """
    folder.mkdir(parents=True, exist_ok=True)
    stamps = folder / ".stamps"
    stamps.mkdir(exist_ok=True)
    common = common_sources() + Path(__file__).read_bytes()
    for number in LESSONS:
        text, name = notebook(composed(number)), f"lesson_{number}"
        stamp, now = stamps / name, hashlib.sha256(common + text.encode()).hexdigest()
        made = [folder / f"{name}{ending}" for ending in (".md", "_replay.html")]
        if stamp.exists() and stamp.read_text() == now and all(path.exists() for path in made):
            continue
        for old in [*folder.glob(f"{name}_*.png"), *folder.glob(f"{name}_*.svg")]:
            old.unlink()
        if number in run:
            book = executed(text, folder, f"{WITHOUT_DOCS}\n{STRICT}")
        else:
            book = nbformat.reads(text, as_version=4)
        markdown, pictures = page(book, name, LESSONS[number].title)
        for file, data in pictures.items():
            (folder / file).write_bytes(data)
        (folder / f"{name}.md").write_text(markdown, encoding="utf-8")
        stamp.write_text(now if number in run else "")


if __name__ == "__main__":
    for path, text in sources().items():
        path.write_text(text, encoding="utf-8")
