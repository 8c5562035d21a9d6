"""Bytes kept in a folder under names: what was put there, to the last bit, or nothing.

A disk, a cable or a hand may change a file, and machine code with one wrong bit ends the process
that runs it. So a checksum over name and content stands before the content and is verified before
anybody sees it; a file that fails is removed, and whoever asked makes it anew. Whose bytes they are
does not matter here. A checksum finds damage, not malice: the folder is as trusted as the program.
"""

from __future__ import annotations

import contextlib
import hashlib
import tempfile
from dataclasses import dataclass
from pathlib import Path

from gms_fsm._files import remove_leftovers, written_whole
from gms_fsm.errors import OutputError

__all__ = ["Store"]


@dataclass(frozen=True)
class Store:
    """A folder of verified files; several processes and threads may use it at once.

    Parameters
    ----------
    folder : Path
        Where they lie.

    Examples
    --------
    >>> import tempfile
    >>> store = Store.at(Path(tempfile.mkdtemp()))
    >>> store.put("flow-1", b"machine code")
    >>> store.get("flow-1"), store.get("flow-2")
    (b'machine code', None)
    """

    folder: Path

    @classmethod
    def at(cls, folder: Path) -> Store | None:
        """Return the store in a folder, None where the folder cannot be written.

        Parameters
        ----------
        folder : Path
            Made where missing. What killed processes have left in it is removed.

        Returns
        -------
        Store or None
            Ready.
        """
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError:
            return None
        remove_leftovers(folder)
        return cls(folder)

    def get(self, name: str) -> bytes | None:
        """Return what is kept under a name.

        Parameters
        ----------
        name : str
            A file's name.

        Returns
        -------
        bytes or None
            What was put there; None if there is nothing, or nothing whole.
        """
        path = self.folder / name
        try:
            found = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError:
            found = b""
        size = hashlib.sha256().digest_size
        if found[:size] == _checksum(name, found[size:]):
            return found[size:]
        with contextlib.suppress(OSError):  # another process may have been faster
            path.unlink()
        return None

    def put(self, name: str, content: bytes) -> None:
        """Keep bytes under a name; on a full disk they are not kept.

        Parameters
        ----------
        name : str
            A file's name.
        content : bytes
            Replaces what is there, at once and as a whole.
        """
        with contextlib.suppress(OutputError):
            written_whole(
                self.folder / name, lambda file: file.write(_checksum(name, content) + content)
            )


def _checksum(name: str, content: bytes) -> bytes:
    """Return what stands before a content; of the name too, so that no file stands for another."""
    stamp = hashlib.sha256(name.encode() + b"\0")
    stamp.update(content)
    return stamp.digest()
