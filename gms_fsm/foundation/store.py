"""A folder of byte strings under names, returned exactly as they were stored or not at all.

A faulty disk or cable, or a user, may alter a file, and machine code with one wrong bit crashes the
process that runs it. So each content is preceded by a checksum over name and content, which is
verified before use; a file that fails is removed, and the caller recreates it. The kind of content
does not matter here. What has not been used for longest makes room for what is new. A checksum
detects damage, not malice: the folder must be as trusted as the program.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from gms_fsm.errors import OutputError
from gms_fsm.foundation.files import remove_leftovers, write_whole

MOST_BYTES = 256_000_000  # of all files; the code of one run has some 100,000


@dataclass(frozen=True)
class CodeFolder:
    """A folder of verified files; several processes and threads may use it at the same time.

    Parameters
    ----------
    folder : Path
        The location of the files.
    most : int
        Bytes of all files together.

    Examples
    --------
    >>> import tempfile
    >>> store = CodeFolder.at(Path(tempfile.mkdtemp()))
    >>> store.put("flow-1", b"machine code")
    >>> store.get("flow-1"), store.get("flow-2")
    (b'machine code', None)
    """

    folder: Path
    most: int = MOST_BYTES

    @classmethod
    def at(cls, folder: Path) -> CodeFolder | None:
        """Return the store in a folder, or None if the folder cannot be written."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError:
            return None
        remove_leftovers(folder)
        return cls(folder)

    def get(self, name: str) -> bytes | None:
        """Return the content stored under a name."""
        path = self.folder / name
        try:
            found = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError:
            found = b""
        size = hashlib.sha256().digest_size
        if found[:size] == _checksum(name, found[size:]):
            with contextlib.suppress(OSError):  # removed meanwhile, or not ours to change
                os.utime(path)  # the time of the last use
            return found[size:]
        with contextlib.suppress(OSError):  # another process may have removed it first
            path.unlink()
        return None

    def put(self, name: str, content: bytes) -> None:
        """Store content under a name; on a full disk nothing is stored."""
        with contextlib.suppress(OutputError):
            write_whole(
                self.folder / name, lambda file: file.write(_checksum(name, content) + content)
            )
            self._make_room(name)

    def _make_room(self, kept: str) -> None:
        """Remove the files that have not been used for longest, if all are too large together."""
        with contextlib.suppress(OSError), os.scandir(self.folder) as entries:
            found = [each for each in entries if not each.name.startswith(".")]
            files = sorted(
                (each.stat().st_mtime_ns, each.stat().st_size, each.path, each.name)
                for each in found
                if each.is_file()
            )
            left = sum(size for _, size, _, _ in files) - self.most
            for _, size, path, name in files:
                if left <= 0:
                    return
                if name != kept:
                    left -= size
                    with contextlib.suppress(OSError):  # by another process, or open in it
                        os.unlink(path)


def _checksum(name: str, content: bytes) -> bytes:
    """Return the checksum over name and content; the name prevents files from being swapped."""
    stamp = hashlib.sha256(name.encode() + b"\0")
    stamp.update(content)
    return stamp.digest()
