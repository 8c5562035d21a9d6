"""The scenarios of the package, which can be named wherever a scenario file is asked for."""

from __future__ import annotations

import tomllib
from pathlib import Path

FOLDER = Path(__file__).parent


def shipped() -> dict[str, Path]:
    """Return the files of the scenarios, by name.

    Examples
    --------
    >>> "servo" in shipped()
    True
    """
    return {path.stem: path for path in sorted(FOLDER.glob("*.toml"))}


def titles() -> dict[str, str]:
    """Return the titles of the scenarios, by name."""
    read = {name: path.read_text(encoding="utf-8") for name, path in shipped().items()}
    return {name: str(tomllib.loads(text)["title"]) for name, text in read.items()}


def scenario_path(given: str | Path) -> Path:
    """Return the file of a scenario of the package, if that is what is named, else the path.

    A file in the current folder goes first.

    Examples
    --------
    >>> scenario_path("servo").name, str(scenario_path("own.toml"))
    ('servo.toml', 'own.toml')
    """
    path = Path(given)
    return path if path.is_file() else shipped().get(str(given), path)
