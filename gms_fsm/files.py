"""Writing files whole: the old one or the new one, never a half."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO

from gms_fsm.errors import OutputError

__all__ = ["leftovers", "output_folder", "written_together", "written_whole"]


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
    written_together({path: write})
    return path


def written_together(files: Mapping[Path, Callable[[IO[bytes]], object]]) -> None:
    """Write files that belong together: all are complete before the first takes its place.

    Parameters
    ----------
    files : mapping of Path to callable
        ``write(file)`` fills the open binary file; they take their places in this order. A process
        killed in between leaves the complete ones behind as `leftovers`.

    Raises
    ------
    OutputError
        If a folder cannot be written.
    """
    temporary = {path: path.with_name(f".{path.name}.{os.getpid()}.part") for path in files}
    try:
        try:
            for path, write in files.items():
                with temporary[path].open("wb") as file:
                    write(file)
            for path in files:
                os.replace(temporary[path], path)
        finally:  # also when the writer itself fails, or is interrupted
            for part in temporary.values():
                part.unlink(missing_ok=True)
    except OSError as error:
        advice = "make room" if error.errno == errno.ENOSPC else "choose another folder"
        if isinstance(error, FileNotFoundError):
            advice = "make its folder first, or choose another folder"
        raise OutputError(f"cannot write {path}: {error.strerror or error}; {advice}") from None


def leftovers(path: Path) -> list[Path]:
    """Return what processes that were killed while writing a file have left beside it.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    list of Path
        ``.<name>.<number>.part``; a later run does not need them, and they may be deleted.
    """
    pattern = re.compile(rf"\.{re.escape(path.name)}\.[0-9]+\.part")
    return sorted(other for other in path.parent.iterdir() if pattern.fullmatch(other.name))
