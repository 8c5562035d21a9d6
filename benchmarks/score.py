"""Score a JSON file of predictions on the held-out rows of the benchmark.

    python benchmarks/score.py mine.json --data FOLDER

The file::

    {"name": "my model", "dataset": "tribometer", "F": {"tribometer": [2.31, 2.30, ...]}}

``F`` has a list for each record: the force at every held-out row of it, N, in the order of the
record. ``rows`` may name the rows instead, as ``Record.rows`` does (in a file the first line is 1):
then ``F`` has as many forces as rows, and only these are scored. For a data set with one record
both may be plain lists.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm.app.benchmark.card import Row
from gms_fsm.app.benchmark.datasets import data_set, held_rows, score
from gms_fsm.app.benchmark.pages import table
from gms_fsm.errors import GMSError, RecordError, cut, shown
from gms_fsm.records.record import Record

FORM = '{"name": "my model", "dataset": "tribometer", "F": {"tribometer": [2.31, ...]}}'


def scored(path: Path, folder: Path) -> Row:
    """Return the score of a file of predictions.

    Parameters
    ----------
    path : Path
        The JSON file.
    folder : Path
        With the data.

    Returns
    -------
    Row
        For the table of its data set.

    Raises
    ------
    ParameterError
        If the data set is unknown.
    RecordError
        If the file cannot be read, or the forces do not fit the held-out rows.
    """
    here = str(path)
    given = _read(path)
    data = data_set(given["dataset"])
    held = held_rows(data.splits(folder))
    forces = _by_record(given["F"], held, f"{here}: F")
    wanted = _by_record(given["rows"], held, f"{here}: rows") if "rows" in given else {}
    if missing := sorted({*(wanted or held)} - {*forces}):
        raise RecordError(f"no forces for {', '.join(missing)}", place=f"{here}: F")
    arrays = {name: _numbers(values, f"{here}: F of {name}") for name, values in forces.items()}
    left = {
        name: _with_rows(held[name], wanted[name], f"{here}: rows of {name}")
        if name in wanted
        else held[name]
        for name in arrays
    }
    for name, array in arrays.items():
        count = int(left[name].chosen.sum())
        if array.size != count:
            raise RecordError(
                f"{array.size} forces for {count} rows",
                place=f"{here}: F of {name}",
                advice=f"held out is {data.held_out}; give one force for each such row, or rows",
            )
    scores: Any = score(left, arrays)
    note = "" if not wanted else f"{scores['rows']:.0f} rows"
    return Row(
        given["name"],
        rmse=scores["rmse"],
        r2=scores["r2"],
        by_record=scores["by_record"],
        note=note,
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        given = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordError(
            f"it cannot be read ({error.strerror})", place=str(path), advice="give a JSON file"
        ) from None
    except ValueError as error:
        raise RecordError(
            f"it is not JSON ({cut(str(error))})", place=str(path), advice=f"for example {FORM}"
        ) from None
    missing = (
        [name for name in ("name", "dataset", "F") if name not in given]
        if isinstance(given, dict)
        else ["name", "dataset", "F"]
    )
    if missing:
        raise RecordError(
            f"it has no {', '.join(missing)}", place=str(path), advice=f"for example {FORM}"
        )
    if not isinstance(given["name"], str):
        raise RecordError(f"name is {shown(given['name'])}, not a text", place=str(path))
    found: dict[str, Any] = given
    return found


def _by_record(given: Any, held: Mapping[str, Record], place: str) -> dict[str, list[Any]]:
    """Return lists by record; a plain list belongs to the only record."""
    if isinstance(given, list) and len(held) == 1:
        given = {next(iter(held)): given}
    if not isinstance(given, dict) or not all(isinstance(each, list) for each in given.values()):
        raise RecordError(
            "it must be a list for each record", place=place, advice=f"records: {', '.join(held)}"
        )
    for name in given:
        if name not in held:
            raise RecordError(
                f"there is no record {shown(name)}",
                place=place,
                advice=f"there are {', '.join(held)}",
            )
    return given


def _numbers(values: list[Any], place: str) -> Any:
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise RecordError("it must be a list of numbers, N", place=place) from None
    if array.ndim != 1:
        raise RecordError("it must be a flat list of numbers, N", place=place)
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise RecordError(f"entry {bad[0]} (from 0) is {array[bad[0]]}, not finite", place=place)
    return array


def _with_rows(record: Record, rows: list[Any], place: str) -> Record:
    """Return a record of which only the named rows are selected."""
    known = set(record.rows[record.chosen].tolist())
    for i, row in enumerate(rows):
        if not isinstance(row, int) or row not in known:
            raise RecordError(
                f"entry {i} (from 0) is {shown(row)}, which is no held-out row",
                place=place,
                advice=f"held-out rows are from {min(known)} to {max(known)}",
            )
    if any(after <= before for before, after in pairwise(rows)):
        raise RecordError("it must increase", place=place)
    return replace(record, chosen=np.isin(record.rows, rows) & record.chosen)


def main() -> None:
    """Print the row of the table, and the error of each record."""
    parser = argparse.ArgumentParser(description="Score predictions of held-out rows.")
    parser.add_argument("file", type=Path, help="the JSON file")
    parser.add_argument(
        "--data",
        type=Path,
        default=Path(os.environ.get("GMS_FSM_DATA", ".")),
        help="folder with the records; by default what GMS_FSM_DATA names",
    )
    given = parser.parse_args()
    try:
        row = scored(given.file, given.data)
    except GMSError as error:
        sys.exit(f"score: {error}")
    print(table([row]))
    for name, rmse in row.by_record.items():
        print(f"{name}: {rmse:.4g} N")


if __name__ == "__main__":
    main()
