"""Notebooks made from the lessons: composed with jupytext, executed, written as pages.

A lesson's module remains the only source of its text and its runs. ``docs/lessons/lesson_N.py``
contains what a notebook adds, in jupytext's percent format: a slider, things to try. Each notebook
is executed with warnings as errors, and again only when a source has changed.

    python docs/notebooks.py FOLDER
"""

from __future__ import annotations

import base64
import hashlib
import inspect
import logging
import math
import re
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from queue import Empty
from typing import Any

import jupytext
import nbformat
from jupyter_client.asynchronous import AsyncKernelClient
from jupyter_client.channels import AsyncZMQSocketChannel
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from traitlets import Type

from gms_fsm.app.lessons import LESSONS

logging.getLogger("traitlets").setLevel(logging.WARNING)  # no line per notebook

ROOT = Path(__file__).parents[1]
MORE = ROOT / "docs" / "lessons"
# Warnings from inside the notebook packages are not ours to fix.
OTHERS = "IPython|ipykernel|ipywidgets|jupyter|matplotlib_inline|tornado|traitlets|zmq"
STRICT = f"""import warnings
warnings.simplefilter("error")
warnings.filterwarnings("ignore", module=".*({OTHERS})")"""
VIEW = "application/vnd.jupyter.widget-view+json"
SLIDER_NOTE = "*The notebook has a slider; this page shows its initial picture.*"


# --------------------------------------------------------------------------- composing
def composed(number: int) -> str:
    """Return a lesson as a program in jupytext's percent format.

    Parameters
    ----------
    number : int
        1 to 10.

    Returns
    -------
    str
        Text and runs of the lesson's module, then ``docs/lessons/lesson_N.py``.
    """
    module: Any = LESSONS[number]
    text = inspect.getdoc(module).partition("\n\n")[2]  # without the first line, a title
    source = inspect.getsource(module.run)
    replay = f'"lesson_{number}_replay.html"'
    cells = [
        ("markdown", f"# Lesson {number}: {module.TITLE}\n\n{_escaped(text)}"),
        (
            "code",
            f"# %matplotlib inline\n# %config InlineBackend.figure_formats = ['retina']\n"
            f"import textwrap\n\nfrom gms_fsm.app.lessons import lesson\n\n"
            f"this = lesson({number})\nresult = this.run()\n"
            'for line in result.lines():\n    print(textwrap.fill(line, 84), end="\\n\\n")',
        ),
        ("code", "this.figure(result)"),
        (
            "markdown",
            f"## The code of the runs\n\nThis is `run()` of `{module.__name__}`:\n\n"
            f"```python\n{source}```",
        ),
        (
            "markdown",
            "## Step through the runs\n\nA page in which you can step and scrub the runs, with "
            "every guard explained:",
        ),
        (
            "code",
            "from plots import write_replay\n\nruns = result.replayed\n"
            f'print(write_replay({replay}, *runs.values(), title="Lesson {number}", '
            "names=list(runs)))",
        ),
    ]
    return "\n\n".join(_cell(kind, body) for kind, body in cells) + "\n\n" + _more(number)


def _more(number: int) -> str:
    """Return the lesson's own cells: what follows the docstring of its file."""
    return (MORE / f"lesson_{number}.py").read_text(encoding="utf-8").partition("\n\n")[2]


def _cell(kind: str, body: str) -> str:
    if kind == "code":
        return f"# %%\n{body}"
    return "# %% [markdown]\n" + "\n".join(f"# {line}".rstrip() for line in body.split("\n"))


def _escaped(text: str) -> str:
    """Return a docstring as Markdown, with stars escaped outside its code."""
    parts = re.split(r"(``.*?``)", text, flags=re.DOTALL)
    return "".join(part if i % 2 else part.replace("*", r"\*") for i, part in enumerate(parts))


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


def executed(text: str, folder: Path) -> Any:
    """Run a composed notebook.

    Parameters
    ----------
    text : str
        From `composed`.
    folder : Path
        Where it runs.

    Returns
    -------
    NotebookNode
        With outputs, and the state of its widgets.

    Raises
    ------
    CellExecutionError
        If a cell fails or warns.
    """
    notebook = jupytext.reads(text, fmt="py:percent")
    notebook.cells.insert(0, nbformat.v4.new_code_cell(STRICT))
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3"}
    NotebookClient(
        notebook,
        timeout=600,
        kernel_name="python3",
        kernel_manager_class=_Manager,
        extra_arguments=["--log-level=CRITICAL"],
        resources={"metadata": {"path": str(folder)}},
    ).execute()
    del notebook.cells[0]
    for cell in notebook.cells:
        cell["id"] = hashlib.sha256(cell.source.encode()).hexdigest()[:8]
        cell.metadata.pop("execution", None)
    for output in _behind_sliders(notebook):
        if output["output_type"] == "error":
            raise RuntimeError("\n".join(output["traceback"]))
    return notebook


def _widgets(notebook: Any) -> Mapping[str, Any]:
    found = notebook.metadata.get("widgets", {}).values()
    return {name: widget for each in found for name, widget in each["state"].items()}


def _behind_sliders(notebook: Any) -> Iterator[Mapping[str, Any]]:
    for widget in _widgets(notebook).values():
        yield from widget["state"].get("outputs", ())


# --------------------------------------------------------------------------- a page
def page(notebook: Any, name: str, title: str) -> tuple[str, dict[str, bytes]]:
    """Return a notebook as Markdown, with its pictures.

    Parameters
    ----------
    notebook : NotebookNode
        Executed.
    name : str
        Of the page, without file extension.
    title : str
        Of the lesson.

    Returns
    -------
    (str, dict of str to bytes)
        The text, and files by their names.
    """
    widgets, lines, pictures = _widgets(notebook), list[str](), dict[str, bytes]()

    def shown(output: Mapping[str, Any]) -> None:
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
        elif "image/png" in data:
            file = f"{name}_{len(pictures) + 1}.png"
            pictures[file] = base64.b64decode(data["image/png"])
            what = "initial picture of the slider" if pictures.keys() > {file} else "the runs"
            lines.append(f"![{title}: {what}]({file})")
        else:
            lines.append(f"```text\n{data['text/plain']}\n```")

    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            lines.append(cell.source)
            continue
        lines.append(f"```ipython3\n{cell.source}\n```")
        for output in cell.outputs:
            shown(output)
    replay = f"{name}_replay.html"
    opened = f'<p><a href="{replay}">Open the replay page of these runs</a></p>'
    lines = [opened if line.strip("`\n").endswith(f"text\n{replay}") else line for line in lines]
    lines.insert(1, f"[This page as a notebook]({name}.ipynb), executed when the site was built.")
    return "\n\n".join(lines) + "\n", pictures


def write_all(folder: Path) -> None:
    """Write every lesson that has changed: page, pictures, notebook, replay page.

    Parameters
    ----------
    folder : Path
        Destination.
    """
    folder.mkdir(parents=True, exist_ok=True)
    stamps = folder / ".stamps"
    stamps.mkdir(exist_ok=True)
    sources = [Path(__file__)]
    for package in ("gms_fsm", "integrators", "plots"):
        sources += sorted(
            path for path in (ROOT / package).rglob("*.*") if "__pycache__" not in path.parts
        )
    common = b"".join(path.read_bytes() for path in sources)
    for number in LESSONS:
        text, name = composed(number), f"lesson_{number}"
        stamp, now = stamps / name, hashlib.sha256(common + text.encode()).hexdigest()
        made = [folder / f"{name}{ending}" for ending in (".md", ".ipynb", "_replay.html")]
        if stamp.exists() and stamp.read_text() == now and all(path.exists() for path in made):
            continue
        for old in folder.glob(f"{name}_*.png"):
            old.unlink()
        notebook = executed(text, folder)
        markdown, pictures = page(notebook, name, LESSONS[number].TITLE)
        for file, data in pictures.items():
            (folder / file).write_bytes(data)
        nbformat.write(notebook, folder / f"{name}.ipynb")
        (folder / f"{name}.md").write_text(markdown, encoding="utf-8")
        stamp.write_text(now)


if __name__ == "__main__":
    write_all(Path(sys.argv[1]))
