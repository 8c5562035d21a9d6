"""The columns of the transition log."""

from __future__ import annotations

from typing import NamedTuple


class LogRecord(NamedTuple):
    """One firing, as recorded in the transition log.

    ``z``, ``v`` and ``s`` are the element's first variable, the velocity and the threshold before
    it.
    """

    t: float
    element: int  # from 0
    edge: str
    source: str
    target: str
    z: float
    v: float
    s: float
    F_before: float
    F_after: float
    contact: str = ""  # in a run of a system; of one model there is one contact only


LOG_TEXTS = ("edge", "source", "target")
CONTACT = "contact"  # a column of the logs of systems only
# In the order in which machine code stores them for a firing.
LOG_NUMBERS = ("z", "v", "s", "F_before", "F_after")
