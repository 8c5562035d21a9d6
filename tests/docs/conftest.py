"""The built site, once for all tests of this folder."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.helpers import ROOT

PATIENCE = 900  # s, for a site that another worker builds


@dataclass(frozen=True)
class Built:
    """The site, the exit code of Sphinx, which is 1 after warnings, and what it said."""

    site: Path
    code: int
    said: str


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Build the site, or wait until another worker of pytest-xdist has built it."""
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent
    folder = shared / "built-site"
    site, code, said = folder / "site", folder / "code", folder / "said"
    try:
        folder.mkdir()
    except FileExistsError:
        end = time.monotonic() + PATIENCE
        while not code.exists():
            assert time.monotonic() < end, f"the site was not built in {PATIENCE} s"
            time.sleep(0.5)
    else:
        command = ["-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going", "-t", "draft"]
        done = subprocess.run(
            [sys.executable, *command, "-d", str(folder / "doctrees"), "docs", str(site)],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "PYTHONWARNINGS": "default"},
        )
        said.write_text(done.stdout + done.stderr, encoding="utf-8")
        part = folder / "part"
        part.write_text(str(done.returncode))
        part.rename(code)  # at once: others wait for it
    return Built(site, int(code.read_text()), said.read_text(encoding="utf-8"))
