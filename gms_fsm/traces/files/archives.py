"""Arrays in .npz files, compressed where it pays. Sizes are checked before they are unpacked."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Mapping
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import TraceFileError
from gms_fsm.foundation.parser import PARSER

ROOM = 2**26  # bytes that any array in a file may have
DENSEST = 200  # no header, time column or log is compressed by a larger factor than this

# Half of the bytes of a run's numbers are close to random: compressing all of them takes more than
# ten times as long as writing them, and saves a quarter. What shrinks this much compresses fast.
WORTH_IT = 0.25
SAMPLES, SAMPLE = 16, 4096  # number and bytes of the places that are tried


def write_arrays(file: IO[bytes], arrays: Mapping[str, Any]) -> None:
    """Write arrays as a file that `numpy.load` reads."""
    with zipfile.ZipFile(file, "w") as archive:
        for name, value in arrays.items():
            array = np.asarray(value)
            part = zipfile.ZipInfo(f"{name}.npy")  # without a time: equal runs give equal files
            part.compress_type = zipfile.ZIP_DEFLATED if _shrinks(array) else zipfile.ZIP_STORED
            with archive.open(part, "w", force_zip64=True) as out:
                np.lib.format.write_array(out, array, allow_pickle=False)


def _shrinks(array: NDArray[Any]) -> bool:
    """Return whether an array is worth compressing, from samples of it."""
    count = max(1, SAMPLE // max(1, array.itemsize))
    places = np.unique(np.linspace(0, max(0, array.size - count), SAMPLES, dtype=np.int64))
    sample = b"".join(array.flat[place : place + count].tobytes() for place in places)
    return len(zlib.compress(sample, 1)) < WORTH_IT * len(sample)


def member(file: Any, name: str, most: int | None = None) -> Any:
    """Read an array from an archive after checking its unpacked size."""
    members = {info.filename: info for info in file.zip.infolist()}
    found = members.get(name) or members[f"{name}.npy"]
    most = ROOM + (DENSEST * found.compress_size if most is None else most)
    if found.file_size > most:
        raise TraceFileError(
            f"{name} unpacks to {found.file_size} bytes",
            advice=f"a file of this length allows at most {most}",
        )
    with PARSER:
        try:
            array = file[name]
        except (ValueError, SyntaxError, TypeError):  # of NumPy, which speaks of its own format
            array = b""
    if isinstance(array, bytes):
        raise TraceFileError(f"{name} is overwritten, or holds more than numbers and texts")
    return array
