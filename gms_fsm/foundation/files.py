"""Atomic writing of files, which never overwrites files that gms-fsm did not write.

A file is written next to its destination under a temporary name, ``.<name>.<random>.gms-fsm-part``,
and then renamed. The writer holds a lock on it, which ends with its process: a file that another
process can lock was left behind by a killed process, and is removed.
"""

from __future__ import annotations

import contextlib
import csv
import errno
import hashlib
import io
import json
import mimetypes
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
from gms_fsm.foundation.text import encoded

if sys.platform != "win32":  # on Windows nothing is locked, and no leftovers are removed
    import fcntl

LIST = ".gms-fsm-files.json"  # in an output folder: checksums of the files written there
_prepared: set[Path] = set()  # output folders of this process
_LEFT = re.compile(r"\..+\.[0-9a-f]{16}\.gms-fsm-(part|rest)")


# --------------------------------------------------------------------------- folders
def output_folder(path: str | Path, names: Iterable[str] = ()) -> Path:
    """Create a folder for output and make sure that it is writable, before any work is done.

    Leftovers of killed processes are removed. Files written into the folder from now on are
    recorded in a list there.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "summary.md").write_text("my own notes")
    >>> output_folder(folder, ["summary.md"])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    gms_fsm.errors.OutputError: .../summary.md: already exists and was not written by gms-fsm...
    """
    folder = Path(path)
    if "\0" in str(folder):
        raise OutputError(
            f"cannot create the folder {str(folder)!r}: it contains a null byte",
            advice="choose another folder",
        )
    if mimetypes.guess_type(folder.name)[0] and not folder.exists():  # it was meant as a file
        raise OutputError(
            f"it is the name of a {folder.suffix} file, and several files are written to a folder",
            place=str(folder),
            advice=f"name a folder, such as {folder.with_suffix('')}",
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot create the folder {folder}: {error.strerror or error}",
            advice="choose another folder",
        ) from None
    remove_leftovers(folder)
    with folder_lock(folder):
        listed = _listed(folder)
        for place in (folder / name for name in names):
            _check_place(place)
            if place.exists() and _checksum(place) not in listed.get(place.name, ()):
                raise OutputError(
                    "already exists and was not written by gms-fsm in this form",
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


def refuse_input(path: str | Path, *inputs: Path) -> None:
    """Refuse to overwrite an input file.

    Examples
    --------
    >>> refuse_input("run.html", Path("run.npz"))
    """
    for given in inputs:
        try:
            same = os.path.samefile(path, given)
        except OSError:  # one of them does not exist
            continue
        if same:
            raise OutputError(
                "is an input here and would be overwritten",
                place=str(path),
                advice="choose another output",
            )


def inside(folder: Path, name: str) -> Path | None:
    """Return the path of a file named in another file, if it is inside a folder.

    Examples
    --------
    >>> inside(Path("runs"), "../secret.toml") is None
    True
    """
    place = (folder / name).resolve()
    place.is_file()  # raises for what is not a name
    if Path(name).is_absolute() or not place.is_relative_to(folder.resolve()):
        return None
    return folder / name


# --------------------------------------------------------------------------- files
def write_whole(path: Path, write: Callable[[IO[bytes]], object]) -> Path:
    """Write a file atomically through a temporary one: it is the old file or the new one."""
    write_together({path: write})
    return path


def write_text(path: Path, text: str) -> Path:
    """Write a text as `write_whole` does."""
    return write_whole(path, lambda file: file.write(encoded(text)))


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as the text of a CSV file."""
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def write_together(files: Mapping[Path, Callable[[IO[bytes]], object]]) -> None:
    """Write several files of one folder that belong together.

    All are complete before the first is renamed, and no other writer can interleave.
    """
    for path in files:
        _check_place(path)
        remove_leftovers(path.parent, path.name)
    _write(files)


def leftovers(path: Path) -> list[Path]:
    """Return files that a killed process may have completed but not renamed."""
    pattern = re.compile(rf"\.{re.escape(path.name)}\.[0-9a-f]{{16}}\.gms-fsm-rest")
    return sorted(other for other in path.parent.iterdir() if pattern.fullmatch(other.name))


def remove_leftovers(folder: Path, name: str = "") -> None:
    """Remove what processes killed while writing have left in a folder.

    Files of a running process, and files that `leftovers` returns, are kept.
    """
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(f".{name}") and entry.name.endswith(".gms-fsm-part"):
                _remove_if_left(entry.path)


@contextlib.contextmanager
def folder_lock(folder: Path, *, shared: bool = False) -> Iterator[None]:
    """Wait until no other process renames files in a folder, and keep others out meanwhile."""
    with ExitStack() as stack:
        with contextlib.suppress(OSError):  # a file system without locks: continue without one
            place = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, place)
            if sys.platform != "win32":
                fcntl.flock(place, fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
        yield


@contextlib.contextmanager
def file_lock(path: Path) -> Iterator[bool]:
    """Keep others out that read a file and write it anew; say whether there is something in it.

    What is renamed over a file is another file, with a lock of its own.
    """
    file = None
    while file is None and sys.platform != "win32":
        try:
            file = os.open(path, os.O_RDONLY | os.O_CREAT, 0o666)
        except OSError:  # who writes it says why
            break
        with contextlib.suppress(OSError):  # a file system without locks: continue without one
            fcntl.flock(file, fcntl.LOCK_EX)
        if not path.exists() or os.fstat(file).st_ino != path.stat().st_ino:
            os.close(file)
            file = None
    try:
        yield path.exists() and path.stat().st_size > 0
    finally:
        if file is not None:
            if path.stat().st_size == 0:  # nothing was written
                path.unlink()
            os.close(file)


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
                if sys.platform == "win32":  # Windows cannot rename open files
                    file.close()
            folder = path.parent
            listing = path.name != LIST and (
                folder.resolve() in _prepared or (folder / LIST).exists()
            )
            if listing or len(parts) > 1:
                stack.enter_context(folder_lock(folder))
            if listing:
                _add_to_list(folder, parts)
            for path, part in parts.items():
                os.replace(part, path)
            for follower in list(files)[1:]:
                for left in leftovers(follower):
                    _remove_if_left(left)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        advice = "free some space" if error.errno == errno.ENOSPC else "choose another folder"
        if isinstance(error, FileNotFoundError):
            advice = "create its folder first, or choose another folder"
        raise OutputError(
            f"cannot write {path}: {error.strerror or error}", advice=advice
        ) from None


@contextlib.contextmanager
def _part(path: Path, kind: str) -> Iterator[tuple[IO[bytes], Path]]:
    """Open a locked temporary file next to a file; whatever is left of it is removed at the end."""
    while True:
        part = path.with_name(f".{path.name}.{secrets.token_hex(8)}.gms-fsm-{kind}")
        try:
            with part.open("xb") as file:  # exclusive: no file or link with that name exists
                if sys.platform != "win32":
                    with contextlib.suppress(OSError):  # a file system without locks
                        fcntl.flock(file, fcntl.LOCK_EX)
                if os.fstat(file.fileno()).st_nlink:  # else it was removed as a leftover
                    yield file, part
                    return
        finally:  # also if the writer itself fails or is interrupted
            part.unlink(missing_ok=True)


def _remove_if_left(path: str | Path) -> None:
    """Remove a temporary file unless its process is still running and holds a lock on it."""
    if sys.platform == "win32" or not _LEFT.fullmatch(os.path.basename(path)):
        return
    with contextlib.suppress(OSError):  # owned by someone else, gone, locked, or no locks here
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            if stat.S_ISREG(os.fstat(file).st_mode):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.unlink(path)
        finally:
            os.close(file)


def _check_place(path: Path) -> None:
    """Refuse to write where something other than a regular file exists."""
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
            kind = "device"  # /dev/stdout, whatever it points to
    except OSError:
        return  # nothing there, or not accessible: writing will report it
    if kind is not None:
        raise OutputError(
            f"cannot write {path}: a {kind} is there, not a file", advice="give another name"
        )


# For each name, the list holds the checksums of the new file and of the one it replaces, so that a
# kill between the two writes does no harm.
def _listed(folder: Path) -> dict[str, list[str]]:
    try:
        listed = json.loads((folder / LIST).read_bytes())
        return {str(name): [str(each) for each in sums] for name, sums in listed.items()}
    except (OSError, ValueError, AttributeError, TypeError):  # missing, or not ours
        return {}


def _add_to_list(folder: Path, parts: Mapping[Path, Path]) -> None:
    listed = _listed(folder)
    for path, part in parts.items():
        sums = {_checksum(part)}
        if path.exists() and (before := _checksum(path)) in listed.get(path.name, ()):
            sums.add(before)
        listed[path.name] = sorted(sums)
    _write({folder / LIST: _as_json(listed)})


def _as_json(listed: Mapping[str, list[str]]) -> Callable[[IO[bytes]], object]:
    text = json.dumps(listed, indent=1, sort_keys=True)
    return lambda file: file.write(encoded(f"{text}\n"))


def _checksum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
