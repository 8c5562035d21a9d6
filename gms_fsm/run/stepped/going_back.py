"""States to return to, and one thread at a time."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A state to return to, of a `FrictionState` or a `FrictionBank`.

    Parameters
    ----------
    t : float
        s.
    """

    t: float
    of: tuple[str, str] = field(repr=False)  # which friction, and its engine
    content: Any = field(repr=False)


class Alone:
    """Lets one thread at a time into a friction, and refuses the others at once.

    The same thread may come in again: after Ctrl-C it may never have left. While one is `inside`,
    there are no short calls.
    """

    def __init__(self) -> None:
        lock = threading.RLock()
        self.acquire, self.leave, self.inside = lock.acquire, lock.release, 0

    def __enter__(self) -> None:
        if not self.acquire(False):
            raise in_use()
        self.inside += 1

    def __exit__(self, *_: object) -> None:
        self.inside -= 1
        self.leave()


def in_use() -> ParameterError:
    """Return the error for a call while another thread's call is under way."""
    return ParameterError(
        "another thread is in a call of this friction",
        advice="give each thread a friction of its own, or hold a lock during each call; nothing "
        "has changed",
    )


def content_of(snapshot: object, kind: type[Any], identity: tuple[str, str]) -> Any:
    """Return the content of a snapshot if it is of the same friction."""
    checked: Any = checked_kind("snapshot", snapshot, kind, "what snapshot() returned")
    if checked.of != identity:
        reason = "it is of a friction with another engine"
        if checked.of[0] != identity[0]:
            reason = "it is of another model, or of one with other numbers"
        raise ParameterError(
            reason, place="snapshot", advice="take it from a friction made in the same way"
        )
    return checked.content
