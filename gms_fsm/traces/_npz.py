"""Traces as NumPy archives (``.npz``): arrays for the rows and the log, and the header as JSON."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gms_fsm._files import write_whole
from gms_fsm.traces._archives import member
from gms_fsm.traces._header import Header
from gms_fsm.traces._log import Log
from gms_fsm.traces._parts import Parts, Ran
from gms_fsm.traces.rows import Rows

__all__ = ["read", "write"]


def write(path: Path, parts: Parts) -> Path:
    """Write a trace, completely or not at all."""
    arrays = {
        **{f"rows_{name}": value for name, value in vars(parts.rows).items()},
        **{f"stops_{name}": value for name, value in vars(parts.stops).items()},
        **{f"observed_{name}": parts.stored[place] for name, place in parts.ran.names.items()},
        "transitions": np.asarray(parts.log),
        "header": np.array(parts.header.model_dump_json()),
    }
    return write_whole(path, lambda file: np.savez_compressed(file, **arrays))


def read(path: Path) -> Parts:
    """Read a trace; an array larger than the number of rows allows is rejected."""
    with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        header = Header.model_validate_json(str(member(file, "header")))
        ran = Ran.of(header)
        layout = ran.layout
        width = 8 * max(layout.y.size, layout.observed.size, layout.modes)  # bytes per row
        tables = {}
        for kind in ("rows", "stops"):
            t = member(file, f"{kind}_t")
            names = [f"{kind}_{name}" for name in ("microstep", "y", "mode")]
            tables[kind] = Rows(t, *(member(file, name, width * t.size) for name in names))
        most = width * len(tables["rows"])
        stored = {
            place: member(file, f"observed_{name}", most) for name, place in ran.names.items()
        }
        log = member(file, "transitions").view(Log)
    return Parts(header, ran, tables["rows"], tables["stops"], log, stored)
