"""Defensive reading of TOML, and changes to single keys."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from gms_fsm.errors import ScenarioError, cut, shown

__all__ = ["override", "parsed"]

LARGEST_FILE = 1_000_000  # bytes
DEEPEST_KEY = 6  # parts
# tomllib takes quadratic time in the number of parts of a key, which can be hours.
_ENDLESS_KEY = re.compile(
    r"""(?<![\w"'-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){20}"""
)
_TEXT_OR_COMMENT = re.compile(r""""[^"]*"?|'[^']*'?|#.*""")
_HALF_A_NUMBER = re.compile(  # a digit on only one side of the point
    r"(?<![\w.+-])([+-]?)(?:(\d+)\.|\.(\d+))((?:[eE][+-]?\d+)?)(?![\w.])"
)


def parsed(path: Path) -> dict[str, Any]:
    """Return the contents of a TOML file.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    dict
        Tables and values as written.

    Raises
    ------
    ScenarioError
        If the file cannot be read, is too large, or is not TOML.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise ScenarioError(
            "no such file", place=str(path), advice="check the name and the folder"
        ) from None
    except OSError as error:
        raise ScenarioError(
            f"cannot be read ({error.strerror})", place=str(path), advice="give a readable file"
        ) from None
    if len(raw) > LARGEST_FILE:
        raise ScenarioError(
            f"larger than {LARGEST_FILE} bytes",
            place=str(path),
            advice="keep records in separate files",
        )
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ScenarioError(
            "not UTF-8 text", place=str(path), advice="a scenario is a TOML file"
        ) from None
    if endless := _ENDLESS_KEY.search(text):
        line = text.count("\n", 0, endless.start()) + 1
        raise ScenarioError(
            f"line {line}: a key of more than 20 parts",
            place=str(path),
            advice="no key is nested this deeply",
        )
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number with 5,000 digits raises ValueError
        hint = _with_digits(text)
        raise ScenarioError(f"not valid TOML: {cut(str(error))}{hint}", place=str(path)) from None


def _with_digits(text: str) -> str:
    """Return advice on the first number of a text that is invalid in TOML, such as .25."""
    for number, line in enumerate(text.splitlines(), start=1):
        found = _HALF_A_NUMBER.search(_TEXT_OR_COMMENT.sub("", line))
        if found:
            sign, whole, part, exponent = found.groups()
            better = f"{sign}{whole or 0}.{part or 0}{exponent}"
            return f"; line {number}: write {better}, not {found[0]}"
    return ""


def override(data: dict[str, Any], setting: str) -> None:
    """Change one key.

    Parameters
    ----------
    data : dict
        Contents of a file; modified in place.
    setting : str
        ``"model.law=published"``: a key path and a TOML value; a bare word is a string.

    Raises
    ------
    ScenarioError
        If the text does not have this form.
    """
    key, equals, text = setting.partition("=")
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts):
        raise ScenarioError(
            "give it as key=value, for example run.t_end=10", place=f"--set {cut(setting)}"
        )
    if "\n" in setting:
        line = setting.partition("\n")[0]
        raise ScenarioError("give one key and one value, on one line", place=f"--set {cut(line)}")
    if len(parts) > DEEPEST_KEY:
        raise ScenarioError("no key is nested this deeply", place=f"--set {cut(setting)}")
    if _ENDLESS_KEY.search(text):
        raise ScenarioError("no key is nested this deeply", place=f"--set {cut(setting)}")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
        hint = _with_digits(text)
        if hint and (value[0] in "[{" or _HALF_A_NUMBER.fullmatch(value)):
            raise ScenarioError(f"not valid TOML{hint}", place=f"--set {cut(setting)}") from None
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"{cut(str(error))}", place=f"--set {cut(setting)}") from None
    table = data
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ScenarioError(
                f"{shown(part)} is a value, not a table", place=f"--set {cut(setting)}"
            )
    table[parts[-1]] = value
