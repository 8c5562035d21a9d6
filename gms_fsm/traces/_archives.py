"""Arrays from untrusted .npz files: their size is checked before they are unpacked."""

from __future__ import annotations

from typing import Any

from gms_fsm.errors import TraceFileError
from gms_fsm.language._parser import PARSER

__all__ = ["member"]

ROOM = 2**26  # bytes that any array in a file may have
DENSEST = 200  # no header, time column or log is compressed by a larger factor than this


def member(file: Any, name: str, most: int | None = None) -> Any:
    """Read an array from an archive after checking its unpacked size.

    Parameters
    ----------
    file : numpy.lib.npyio.NpzFile
        The open archive.
    name : str
        Name of the array.
    most : int, optional
        Largest size in bytes, if other arrays determine it. Otherwise the limit follows from the
        compressed size.

    Returns
    -------
    ndarray
        The array.

    Raises
    ------
    TraceFileError
        If it is too large.
    KeyError
        If the archive has no such array.
    """
    members = {info.filename: info for info in file.zip.infolist()}
    found = members.get(name) or members[f"{name}.npy"]
    most = ROOM + (DENSEST * found.compress_size if most is None else most)
    if found.file_size > most:
        raise TraceFileError(
            f"{name} unpacks to {found.file_size} bytes",
            advice=f"a file of this length allows at most {most}",
        )
    with PARSER:
        return file[name]
