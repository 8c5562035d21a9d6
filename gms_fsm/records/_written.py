"""A record as a text file, for a rig or another program; read back it is equal."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.arguments import checked_path
from gms_fsm.foundation.files import output_folder, write_text

# With the unit, as `Record.from_csv` names them in its examples.
HEADINGS = {
    "time": "t_s",
    "position": "x_m",
    "velocity": "v_m_s",
    "force": "F_N",
    "normal": "N_N",
}


def write_csv(columns: Mapping[str, FloatArray], path: str | os.PathLike[str]) -> Path:
    """Write columns of a record to a CSV file, whole."""
    place = checked_path("path", path)
    inputs = [name for name in columns if name not in HEADINGS]
    names = [*(name for name in HEADINGS if name in columns), *inputs]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(HEADINGS.get(name, name) for name in names)
    cells = np.stack([columns[name] for name in names], axis=1).tolist()
    # The repr of a float reads back equal.
    table.writerows(["" if cell != cell else repr(cell) for cell in row] for row in cells)
    output_folder(place.parent, [place.name])
    return write_text(place, text.getvalue())
