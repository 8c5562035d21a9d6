"""Drive the widget in other people's notebooks, by their own user interfaces, in Chromium.

``python -m tests.foreign`` runs JupyterLab and marimo; ``make foreign`` installs them. It takes
about a minute, and prints what it saw. ``--pictures DIR`` keeps screenshots.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Frame, Locator, Page, expect, sync_playwright

SETUP = """\
import plots
from gms_fsm import GMS, GMSParameters, Prescribed

w = plots.explore(
    GMS(GMSParameters.paper("stick-slip"), law="published"),
    Prescribed("0.15*sin(2*pi*t/25)"), 100.0,
    sliders={"F_s": (0.5, 3.0), "k1": (0.01, 10.0)},
)
"""
MARIMO = """\
import marimo

app = marimo.App(width="full")


@app.cell
def _():
{setup}
    import marimo as mo

    view = mo.ui.anywidget(w)
    view
    return


if __name__ == "__main__":
    app.run()
"""
PATIENCE = 120_000  # ms, for a first start
ARGUMENTS = ["--no-sandbox", "--headless", "--disable-gpu"]
FORCE = "Array.from({length: runs.at(-1).rows}, (_, k) => runs.at(-1).contacts[0].columns.F(k))"
PLOT = "document.querySelector('.pane.time canvas').toDataURL()"


def main() -> int:
    """Drive every notebook, and return 1 if one of them failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.foreign", description=__doc__)
    parser.add_argument("--pictures", type=Path, help="a folder for screenshots")
    parser.add_argument("names", nargs="*", default=list(HOSTS), help=", ".join(HOSTS))
    given = parser.parse_args()
    failed = 0
    with sync_playwright() as playwright:
        program = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = playwright.chromium.launch(executable_path=program, args=ARGUMENTS)
        for name in given.names:
            try:
                with (
                    tempfile.TemporaryDirectory() as folder,
                    HOSTS[name](browser, Path(folder)) as page,
                ):
                    drive(name, page, given.pictures)
            except Exception as error:
                failed = 1
                print(f"{name}: FAILED: {type(error).__name__}: {error}")
        browser.close()
    return failed


# --------------------------------------------------------------------------- what a user does
def drive(name: str, page: Page, pictures: Path | None) -> None:
    """Move a slider, poke and compare, export; print what was seen.

    What the widget does is tried in tests/plots; here each message crosses a host's own way.
    """

    def say(text: str) -> None:
        print(f"{name}: {text}", flush=True)
        if pictures is not None:
            page.screenshot(path=pictures / f"{name}-{text.partition(':')[0]}.png")

    widget = page.locator(".gms-explore").first
    widget.wait_for(timeout=PATIENCE)
    widget.scroll_into_view_if_needed()
    expect(widget.locator(".gms-now")).to_have_count(1, timeout=PATIENCE)  # the page has answered
    frame = replay_of(page)
    before, drawn = frame.evaluate(FORCE), frame.evaluate(PLOT)
    widget.locator("input[type=range]").first.focus()
    for _ in range(40):
        page.keyboard.press("ArrowRight")
    value = widget.locator("input[type=number]").first.input_value()
    until(lambda: frame.evaluate(PLOT) != drawn and settled(widget))
    assert float(value) == 1.6, value
    assert before != at_rest(frame)
    say(f"slider: F_s = {value} N; F changed in data and plot")

    frame.evaluate("go(events[14])")
    poke = widget.get_by_role("button", name="poke at 24.99997 s")
    poke.wait_for()
    widget.get_by_label("New value").fill("-1.4")
    poke.click()
    expect(widget.locator(".gms-branch")).to_have_count(2)
    until(lambda: settled(widget) and frame.evaluate("runs.length") == 2)
    told = widget.locator(".gms-pin").inner_text()
    assert "first difference" in told, told
    say(f"compare: {told}")

    with page.expect_download() as download:
        widget.get_by_role("button", name="export").click()
    assert 'law = "published"' in Path(download.value.path()).read_text(encoding="utf-8")
    say(f"export: {download.value.suggested_filename}")


def replay_of(page: Page) -> Frame:
    """Return the frame with the replay page."""
    handle = page.locator(".gms-explore iframe").first.element_handle()
    frame = handle.content_frame() if handle else None
    assert frame is not None
    return frame


def at_rest(frame: Frame) -> Any:
    """Return the forces on the page once they do not change any more."""
    before = None
    while (now := frame.evaluate(FORCE)) != before:
        before = now
        time.sleep(0.3)
    return now


def settled(widget: Locator) -> bool:
    return "gms-busy" not in (widget.get_attribute("class") or "")


def until(condition: Callable[[], bool], patience: float = 30.0) -> None:
    """Wait for a condition."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


# --------------------------------------------------------------------------- the notebooks
@contextlib.contextmanager
def jupyterlab(browser: Browser, folder: Path) -> Iterator[Page]:
    """Open a notebook in JupyterLab and run all its cells."""
    empty = {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": []}
    cells = [{**empty, "id": f"cell{i}", "source": each} for i, each in enumerate((SETUP, "w"))]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    notebook = {"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}
    (folder / "explore.ipynb").write_text(json.dumps(notebook), encoding="utf-8")
    port = free_port()
    command = ["jupyterlab", "--no-browser", "--allow-root", f"--port={port}"]
    command += ["--IdentityProvider.token=one", f"--ServerApp.root_dir={folder}"]
    with server(command, folder, f"http://127.0.0.1:{port}/api?token=one"):
        page = new_page(browser)
        page.goto(f"http://127.0.0.1:{port}/lab/tree/explore.ipynb?token=one")
        page.locator(".jp-Notebook .jp-CodeCell").nth(1).wait_for(timeout=PATIENCE)
        # With the kernel idle, the menu runs all cells.
        page.locator(".jp-Notebook-ExecutionIndicator[data-status=idle]").first.wait_for(
            timeout=PATIENCE
        )
        page.get_by_role("menuitem", name="Run", exact=True).click()
        page.get_by_role("menuitem", name=re.compile("^Run All Cells$")).first.click()
        yield page
        page.context.close()


@contextlib.contextmanager
def marimo(browser: Browser, folder: Path) -> Iterator[Page]:
    """Open a notebook in marimo, which runs it."""
    indented = "".join(f"    {line}" for line in SETUP.splitlines(keepends=True))
    (folder / "explore.py").write_text(MARIMO.format(setup=indented), encoding="utf-8")
    port = free_port()
    command = ["marimo", "run", "--headless", "--no-token", f"--port={port}", "explore.py"]
    with server(command, folder, f"http://127.0.0.1:{port}/health"):
        page = new_page(browser)
        page.goto(f"http://127.0.0.1:{port}/")
        yield page
        page.context.close()


HOSTS: dict[str, Any] = {"jupyterlab": jupyterlab, "marimo": marimo}


def new_page(browser: Browser) -> Page:
    return browser.new_context(viewport={"width": 1500, "height": 1150}).new_page()


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@contextlib.contextmanager
def server(command: list[str], folder: Path, address: str) -> Iterator[None]:
    """Run a server module until it answers, and stop it at the end."""
    path = os.pathsep.join(filter(None, [str(Path.cwd()), os.environ.get("PYTHONPATH")]))
    settings = {**os.environ, "PYTHONPATH": path, "JUPYTER_CONFIG_DIR": str(folder / ".jupyter")}
    with (folder / "server.log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", *command], cwd=folder, env=settings, stdout=log, stderr=log
        )
        try:
            until(lambda: answers(address) or process.poll() is not None, 120)
            if process.poll() is not None:
                text = (folder / "server.log").read_text(encoding="utf-8", errors="replace")
                raise AssertionError(f"{command[0]} ended at once:\n{text[-2000:]}")
            yield
        finally:
            process.terminate()
            process.wait(30)


def answers(address: str) -> bool:
    try:
        with urllib.request.urlopen(address, timeout=2) as answer:
            return bool(answer.status == 200)
    except OSError:
        return False


if __name__ == "__main__":
    sys.exit(main())
