"""Reading back what a replay page stores."""

from __future__ import annotations

import base64
import json
import re
from typing import Any

import numpy as np


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found is not None
    return dict(json.loads(found[1]))


def unpacked(kind: str, text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype=f"<{kind}")


def integers(packed: list[str]) -> np.ndarray:
    kind, text = packed
    values = unpacked(kind.removeprefix("+"), text).astype(np.int64)
    return values.cumsum() if kind.startswith("+") else values


def column(run: dict[str, Any], stored: int | list[float]) -> np.ndarray:
    """Return a column at all rows of the page."""
    if isinstance(stored, list):
        number, factor = stored
        return factor * column(run, int(number))
    kind, place, text = run["pool"][stored]
    values = unpacked(kind, text)
    if place == "constant":
        return np.broadcast_to(values, run["rows"])
    return values[integers(run["instants"])] if place == "instants" else values


def modes(contact: dict[str, Any], rows: int) -> np.ndarray:
    found = np.tile(contact["initial"], (rows, 1))
    for row, element, mode in zip(*map(integers, contact["switches"]), strict=True):
        found[row:, element] = mode
    return found


def log(contact: dict[str, Any]) -> list[np.ndarray]:
    return [integers(each) for each in contact["log"][:4]]


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two columns have the same bits."""
    return np.asarray(a, dtype=float).tobytes() == np.asarray(b, dtype=float).tobytes()
