"""Checks of the arguments that several functions of this room take."""

from __future__ import annotations

from typing import Any

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.errors import ParameterError, RecordError
from gms_fsm.foundation.arguments import listed
from gms_fsm.records.record import Record
from gms_fsm.systems.mounted import misplaced


def window_of(name: str, given: Any) -> tuple[float, float] | None:
    """Return a span of time."""
    if given is None:
        return None
    try:
        first, last = given
    except (TypeError, ValueError):
        raise ParameterError(
            "it must be two times (from, to), s", place=name, value=given
        ) from None
    first = checked_scalar(f"{name}: from", first, "finite")
    last = checked_scalar(f"{name}: to", last, "finite")
    if not first < last:
        raise ParameterError(
            f"it ends at {last:g} s, not after its start at {first:g} s", place=name
        )
    return first, last


def checked_records(given: Any) -> list[Record]:
    """Return one record or several as a list."""
    wanted = "a Record, for example Record.from_csv(path), or several"
    if not isinstance(given, Record) and (advice := misplaced(given)):
        raise ParameterError(f"it must be {wanted}", place="records", value=given, advice=advice)
    every = [given] if isinstance(given, Record) else listed("records", given, wanted)
    if not every:
        raise ParameterError(f"it must be {wanted}", place="records", value=given)
    for i, each in enumerate(every):
        if not isinstance(each, Record):
            raise ParameterError(
                "it must be a Record, from Record.from_csv or from_dataframe",
                place=f"records[{i}]",
                value=each,
                advice=misplaced(each),
            )
    return every


def column_of(record: Record, column: str) -> FloatArray:
    """Return the column that a model is compared with."""
    if column not in record.columns:
        raise RecordError(
            f"it has no {column}, with which to compare",
            place=record.place,
            advice=f"give {column} = {{ column = ..., unit = ... }} in a scenario, "
            f"{column}=(name, unit) in Python; it has {', '.join(record.columns)}",
        )
    return record.columns[column]
