"""Trace files as older versions wrote them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm import Trace
from gms_fsm.lowering.log_columns import CONTACT, LOG_TEXTS
from gms_fsm.traces.rows import merged


def arrays_of(path: Path) -> dict[str, Any]:
    """Return the arrays of a file."""
    with np.load(path) as file:
        return dict(file)


def format_1(trace: Trace, path: Path) -> dict[str, Any]:
    """Return the arrays of a trace in a file of format 1.

    Integers have eight bytes, stops are always there, and the log is a record array in which texts
    have one width.
    """
    header = json.loads(str(arrays_of(trace.save(path))["header"]))
    arrays = {"header": np.array(json.dumps(header | {"format": "gms-fsm trace 1"}))}
    tables = {"rows": trace.rows, "stops": merged(trace.rows, trace.stops)}
    arrays |= {
        f"{kind}_{name}": column
        for kind, table in tables.items()
        for name, column in vars(table).items()
    }
    arrays |= {
        name: column for name, column in arrays_of(path).items() if name.startswith("observed_")
    }
    log = trace.transitions
    texts = [name for name in (*LOG_TEXTS, CONTACT) if name in log.dtype.names]
    width = max([1, *(len(text) for name in texts for text in log[name].tolist())])
    kinds = [(n, f"U{width}" if n in texts else log.dtype[n]) for n in log.dtype.names]
    return arrays | {"transitions": np.asarray(log).astype(kinds)}


def write(path: Path, arrays: dict[str, Any]) -> Path:
    """Write a file with these arrays."""
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)
    return path
