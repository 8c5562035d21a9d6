"""Writing files whole: the old one or the new one, never a half, and never over what is not ours.

A file is written beside its place under a name of its own, ``.<name>.<random>.gms-fsm-part``, and
then renamed. Whoever writes holds a lock on it, which ends with its process: what can be locked by
somebody else was left by a process that was killed, and is removed.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import re
import secrets
import stat
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import IO

from gms_fsm.errors import OutputError

if sys.platform != "win32":  # there nothing is locked, and nothing that was left is removed
    import fcntl

__all__ = [
    "in_turn",
    "leftovers",
    "no_input",
    "output_folder",
    "remove_leftovers",
    "written_together",
    "written_whole",
]

LIST = ".gms-fsm-files.json"  # in an output folder: the checksums of what was written there
_prepared: set[Path] = set()  # output folders of this process
_LEFT = re.compile(r"\..+\.[0-9a-f]{16}\.gms-fsm-(part|rest)")


# --------------------------------------------------------------------------- folders
def output_folder(path: str | Path, names: Iterable[str] = ()) -> Path:
    """Make a folder for output, and make sure it can be written, before any work is done.

    What killed processes have left in it is removed. What is written into it from now on is put on
    a list there.

    Parameters
    ----------
    path : str or Path
        The folder; it and its parents are made where missing.
    names : iterable of str
        Files that will be written there.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    OutputError
        If it cannot be made or written, or if one of the files is there and not as gms-fsm has
        written it.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "summary.md").write_text("my own notes")
    >>> output_folder(folder, ["summary.md"])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    gms_fsm.errors.OutputError: .../summary.md: is there and gms-fsm has not written it ...
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot make the folder {folder}: {error.strerror or error}",
            advice="choose another folder",
        ) from None
    remove_leftovers(folder)
    with in_turn(folder):
        listed = _listed(folder)
        for place in (folder / name for name in names):
            _check_place(place)
            if place.exists() and _checksum(place) not in listed.get(place.name, ()):
                raise OutputError(
                    "is there and gms-fsm has not written it like that",
                    place=str(place),
                    advice="move it away, or choose another folder",
                )
    try:
        with _part(folder / LIST, "part"):
            _prepared.add(folder.resolve())
    except OSError as error:
        raise OutputError(
            f"cannot write into {folder}: {error.strerror or error}", advice="choose another folder"
        ) from None
    return folder


def no_input(path: str | Path, *inputs: Path) -> None:
    """Refuse to write over what is read.

    Parameters
    ----------
    path : str or Path
        The file to be written.
    *inputs : Path
        The files that are read.

    Raises
    ------
    OutputError
        If it is one of them, under whatever name.

    Examples
    --------
    >>> no_input("run.html", Path("run.npz"))
    """
    for given in inputs:
        try:
            same = os.path.samefile(path, given)
        except OSError:  # one of them is not there
            continue
        if same:
            raise OutputError(
                "is read here and would be written over",
                place=str(path),
                advice="choose another output",
            )


# --------------------------------------------------------------------------- files
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
        If the folder cannot be written, or a device, a pipe or a folder is in its place.
    """
    written_together({path: write})
    return path


def written_together(files: Mapping[Path, Callable[[IO[bytes]], object]]) -> None:
    """Write files of one folder that belong together.

    All are complete before the first takes its place, and no other writer comes between them.

    Parameters
    ----------
    files : mapping of Path to callable
        ``write(file)`` fills the open binary file; they take their places in this order. A process
        killed in between leaves the complete ones behind as `leftovers`.

    Raises
    ------
    OutputError
        If the folder cannot be written, or a device, a pipe or a folder is in the place of one.
    """
    for path in files:
        _check_place(path)
        remove_leftovers(path.parent, path.name)
    _write(files)


def leftovers(path: Path) -> list[Path]:
    """Return what may be a file that a killed process has written but not put in its place.

    Parameters
    ----------
    path : Path
        The file, one of several that belong together.

    Returns
    -------
    list of Path
        ``.<name>.<random>.gms-fsm-rest``; the next that writes the file removes them.
    """
    pattern = re.compile(rf"\.{re.escape(path.name)}\.[0-9a-f]{{16}}\.gms-fsm-rest")
    return sorted(other for other in path.parent.iterdir() if pattern.fullmatch(other.name))


def remove_leftovers(folder: Path, name: str = "") -> None:
    """Remove what processes that were killed while writing have left in a folder.

    Nothing of a living process, and nothing that `leftovers` may be asked for.

    Parameters
    ----------
    folder : Path
        Where to look.
    name : str
        Only what was to become the file of this name.
    """
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(f".{name}") and entry.name.endswith(".gms-fsm-part"):
                _remove_if_left(entry.path)


@contextlib.contextmanager
def in_turn(folder: Path, *, shared: bool = False) -> Iterator[None]:
    """Wait until nobody else puts files in their places in a folder, and keep them off.

    Parameters
    ----------
    folder : Path
        An existing folder.
    shared : bool
        Whether others may do the same: for readers.
    """
    with ExitStack() as stack:
        with contextlib.suppress(OSError):  # a file system without locks: then without
            place = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, place)
            if sys.platform != "win32":
                fcntl.flock(place, fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
        yield


# --------------------------------------------------------------------------- helpers
def _write(files: Mapping[Path, Callable[[IO[bytes]], object]]) -> None:
    parts: dict[Path, Path] = {}
    try:
        with ExitStack() as stack:
            for path, write in files.items():
                kind = "rest" if parts else "part"
                file, parts[path] = stack.enter_context(_part(path, kind))
                write(file)
                file.flush()
                if sys.platform == "win32":  # which renames no open file
                    file.close()
            folder = path.parent
            listing = path.name != LIST and (
                folder.resolve() in _prepared or (folder / LIST).exists()
            )
            if listing or len(parts) > 1:
                stack.enter_context(in_turn(folder))
            if listing:
                _put_on_list(folder, parts)
            for path, part in parts.items():
                os.replace(part, path)
            for follower in list(files)[1:]:
                for left in leftovers(follower):
                    _remove_if_left(left)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        advice = "make room" if error.errno == errno.ENOSPC else "choose another folder"
        if isinstance(error, FileNotFoundError):
            advice = "make its folder first, or choose another folder"
        raise OutputError(
            f"cannot write {path}: {error.strerror or error}", advice=advice
        ) from None


@contextlib.contextmanager
def _part(path: Path, kind: str) -> Iterator[tuple[IO[bytes], Path]]:
    """Open a temporary file beside a file, locked; what is left of it at the end is removed."""
    while True:
        part = path.with_name(f".{path.name}.{secrets.token_hex(8)}.gms-fsm-{kind}")
        try:
            with part.open("xb") as file:  # exclusively: neither a file nor a link is there
                if sys.platform != "win32":
                    with contextlib.suppress(OSError):  # a file system without locks
                        fcntl.flock(file, fcntl.LOCK_EX)
                if os.fstat(file.fileno()).st_nlink:  # else it was taken for one that was left
                    yield file, part
                    return
        finally:  # also when the writer itself fails, or is interrupted
            part.unlink(missing_ok=True)


def _remove_if_left(path: str | Path) -> None:
    """Remove a temporary file unless its process lives, which then holds a lock on it."""
    if sys.platform == "win32" or not _LEFT.fullmatch(os.path.basename(path)):
        return
    with contextlib.suppress(OSError):  # somebody else's, gone, locked, or no locks here
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            if stat.S_ISREG(os.fstat(file).st_mode):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.unlink(path)
        finally:
            os.close(file)


def _check_place(path: Path) -> None:
    """Refuse to put a file where something else is than a file."""
    kinds = {
        stat.S_IFDIR: "folder",
        stat.S_IFCHR: "device",
        stat.S_IFBLK: "device",
        stat.S_IFIFO: "pipe",
        stat.S_IFSOCK: "socket",
    }
    try:
        kind = kinds.get(stat.S_IFMT(path.stat().st_mode))
        if path.is_symlink() and os.readlink(path).startswith("/proc/"):
            kind = "device"  # /dev/stdout, whatever it leads to
    except OSError:
        return  # nothing there, or nothing that can be looked at: the writing will say so
    if kind is not None:
        raise OutputError(
            f"cannot write {path}: a {kind} is there, not a file", advice="give another name"
        )


# The list holds for each name the checksum of the file to come and of the one it replaces, so that
# a kill between the two writings does no harm.
def _listed(folder: Path) -> dict[str, list[str]]:
    try:
        listed = json.loads((folder / LIST).read_bytes())
        return {str(name): [str(each) for each in sums] for name, sums in listed.items()}
    except (OSError, ValueError, AttributeError, TypeError):  # not there, or not ours
        return {}


def _put_on_list(folder: Path, parts: Mapping[Path, Path]) -> None:
    listed = _listed(folder)
    for path, part in parts.items():
        sums = {_checksum(part)}
        if path.exists() and (before := _checksum(path)) in listed.get(path.name, ()):
            sums.add(before)
        listed[path.name] = sorted(sums)
    _write({folder / LIST: _as_json(listed)})


def _as_json(listed: Mapping[str, list[str]]) -> Callable[[IO[bytes]], object]:
    text = json.dumps(listed, indent=1, sort_keys=True).encode()
    return lambda file: file.write(text + b"\n")


def _checksum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
