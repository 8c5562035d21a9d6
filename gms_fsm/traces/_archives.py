"""Arrays out of .npz files that anybody may have made: looked at before they are unpacked."""

from __future__ import annotations

from typing import Any

from gms_fsm.errors import TraceFileError
from gms_fsm.language._parser import PARSER

__all__ = ["member"]

ROOM = 2**26  # bytes that any array of a file may have
DENSEST = 200  # times: no header, column of times or log is packed tighter than this


def member(file: Any, name: str, most: int | None = None) -> Any:
    """Read an array of an archive, if it unpacks to no more bytes than it can have.

    Parameters
    ----------
    file : numpy.lib.npyio.NpzFile
        The open archive.
    name : str
        Of the array.
    most : int, optional
        Bytes it can have, as far as other arrays tell; else as many as its packed size allows.

    Returns
    -------
    ndarray
        The array.

    Raises
    ------
    TraceFileError
        If it is too large.
    KeyError
        If there is none.
    """
    members = {info.filename: info for info in file.zip.infolist()}
    found = members.get(name) or members[f"{name}.npy"]
    most = ROOM + (DENSEST * found.compress_size if most is None else most)
    if found.file_size > most:
        raise TraceFileError(
            f"{name} unpacks to {found.file_size} bytes",
            advice=f"in a file of this length it has at most {most}",
        )
    with PARSER:
        return file[name]
