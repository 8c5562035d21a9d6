"""Measured records: read from tables, arrays and data frames, and turned into motion.

`damper` and `tribometer` read public records from a folder of the user's.
"""

from gms_fsm.records.public_sets import damper as damper
from gms_fsm.records.public_sets import tribometer as tribometer
from gms_fsm.records.record import Column as Column
from gms_fsm.records.record import Record as Record

__all__ = ["Column", "Record", "damper", "tribometer"]
