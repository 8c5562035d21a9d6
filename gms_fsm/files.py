"""Writing files whole: the old one or the new one, never a half."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import IO

from gms_fsm.errors import OutputError

__all__ = ["output_folder", "written_whole"]


def output_folder(path: str | Path) -> Path:
    """Make a folder for output, and make sure it can be written, before any work is done.

    Parameters
    ----------
    path : str or Path
        The folder; it and its parents are made where missing.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    OutputError
        If it cannot be made or written.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot make the folder {folder}: {error.strerror or error}; choose another folder"
        ) from None
    probe = folder / ".gms-fsm-probe"
    written_whole(probe, lambda _: None).unlink()
    return folder


def written_whole(path: Path, write: Callable[[IO[bytes]], object]) -> Path:
    """Write a file through a temporary one beside it: the old file or the new, never a half.

    Parameters
    ----------
    path : Path
        Where it goes.
    write : callable
        ``write(file)`` fills the open binary file.

    Returns
    -------
    Path
        The same path.

    Raises
    ------
    OutputError
        If the folder cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        try:
            with temporary.open("wb") as file:
                write(file)
            os.replace(temporary, path)
        finally:  # also when the writer itself fails, or is interrupted
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot write {path}: {error.strerror or error}; choose another folder or make room"
        ) from None
    return path
