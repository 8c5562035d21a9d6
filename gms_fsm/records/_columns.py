"""Which column of a table is which quantity, and in which unit."""

from __future__ import annotations

import keyword
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from gms_fsm.errors import ParameterError, RecordError, UnitError, keyed
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.foundation.quantities import COLUMN_UNITS, ROTARY, factor, input_factor, plain

if TYPE_CHECKING:
    from gms_fsm.charts.parameters import FloatArray

QUANTITIES = ("time", "position", "velocity", "force", "normal")
LOADS = ("force", "normal")  # needed only in selected rows; motion is needed in between too
MODELS_OWN = ("t", "x", "v", "s", "F")  # what a model supplies to its chart, or gives

RENAME = "a name stands for one column: rename the others in the header"


@dataclass(frozen=True)
class Column:
    """The column of a quantity in a table.

    Parameters
    ----------
    name : str
        Name in the header line.
    unit : str
        Unit, for example ``"mm"``.
    sign : int
        -1 to reverse the sign of the quantity.
    """

    name: str
    unit: str
    sign: int = 1

    def in_si(self, quantity: str, values: FloatArray) -> FloatArray:
        """Return the values of this column in SI units.

        Parameters
        ----------
        quantity : str
            What the column holds: ``"time"``, ``"position"``, ``"velocity"``, ``"force"``,
            ``"normal"``, or the name of an input.
        values : ndarray
            The numbers of the table.

        Returns
        -------
        ndarray
            ``sign * factor * values``, a new array; of a temperature in °C the absolute one.

        Raises
        ------
        UnitError
            If the unit is unknown or belongs to another quantity.
        """
        if quantity in COLUMN_UNITS:
            return self.sign * factor(quantity, self.unit, COLUMN_UNITS) * values
        size, offset = input_factor(self.unit)
        return self.sign * (size * values + offset)


ColumnLike: TypeAlias = str | tuple[str, str] | tuple[str, str, int] | Column


def columns_of(place: str, given: dict[str, Any], inputs: Any = None) -> dict[str, Column]:
    """Return the column of each quantity and each input that has one.

    Examples
    --------
    >>> columns_of("rig", {"time": "t", "force": "F [kN]", "normal": None})["force"]
    Column(name='F [kN]', unit='kN', sign=1)
    """
    if given["time"] is None:
        raise RecordError("no column is given for 'time'", place=place, advice="give time = ...")
    found: dict[str, Column] = {}
    for quantity, each in given.items():
        if each is not None:
            with keyed(quantity):
                found[quantity] = _column(quantity, each)
                factor(quantity, found[quantity].unit, COLUMN_UNITS)
    for name, each in checked_inputs(inputs).items():
        with keyed("inputs", name):
            found[name] = _column(name, each)
            input_factor(found[name].unit)
    return found


def checked_inputs(given: Any) -> Mapping[str, Any]:
    """Return the inputs of charts that a record gives, by name."""
    if given is None:
        return {}
    checked_kind("inputs", given, Mapping, "a mapping, for example {'N': ...}")
    for name in given:
        right = isinstance(name, str) and name.isidentifier() and not keyword.iskeyword(name)
        if not right or name in QUANTITIES or name in MODELS_OWN:
            raise ParameterError(
                "it must be the name of an input of a chart, which the model does not supply",
                place="name in inputs",
                value=name,
                advice="for example 'N' for a load, 'T' for a temperature",
            )
    return dict(given)


def mixed(units: Mapping[str, str]) -> str:
    """Return what is odd about the units of a record: angles beside lengths.

    >>> mixed({"position": "rad", "velocity": "mm/s"})[:40]
    'position is in rad, and velocity in mm/s'
    """
    known = {name: plain(units[name]) in ROTARY for name in QUANTITIES[1:4] if name in units}
    for name in ("velocity", "force"):
        if known.get("position", known.get(name)) != known.get(name, known.get("position")):
            return f"position is in {units['position']}, and {name} in {units[name]}"
    if known.get("velocity", known.get("force")) != known.get("force", known.get("velocity")):
        return f"velocity is in {units['velocity']}, and force in {units['force']}"
    return ""


def _column(quantity: str, given: Any) -> Column:
    if isinstance(given, Column):
        given = (given.name, given.unit, given.sign)
    match given:
        case str() as name:
            return Column(name, _unit_of_name(quantity, name))
        case (str() as name, str() as unit):
            return _named(quantity, Column(name, unit))
        case (str() as name, str() as unit, 1 | -1 as sign):
            return _named(quantity, Column(name, unit, sign))
    raise ParameterError(
        "it must be the name of a column, (name, unit) or (name, unit, sign) with a sign "
        "of 1 or -1",
        place=quantity,
        value=given,
    )


def _unit_of_name(quantity: str, name: str) -> str:
    """Return the unit of a name that stands in brackets or behind a slash; else that of SI.

    Refused is a name that ends in another unit less clearly, or in one of something else.
    """
    unit, clear = _named_unit(name)
    if quantity not in COLUMN_UNITS:
        return unit if clear else "1"
    known = COLUMN_UNITS[quantity]
    if unit in known and (clear or known[unit] == 1.0):
        return unit
    other = next(
        (each for each, units in COLUMN_UNITS.items() if unit in units and len(unit) > 1), ""
    )
    if unit in known:
        reason, advice = "", f"give the unit, too: ({name!r}, {unit!r})"
    elif other:
        reason = f", and {unit} measures {other}"
        advice = f"give the column of {other}: {other}=({name!r}, {unit!r})"
    elif clear and unit:
        reason = f", and {unit} is not known"
        advice = f"convert it, or give the unit, too, one of {', '.join(known)}"
    else:
        return _si(quantity)
    raise ParameterError(
        f"its values would be read in {_si(quantity)}{reason}",
        place=quantity,
        value=name,
        advice=advice,
    )


def _named_unit(name: str) -> tuple[str, bool]:
    """Return what stands at the end of a name as a unit does, and whether it clearly is one.

    >>> _named_unit("x [mm]"), _named_unit("x/mm"), _named_unit("v_mm_s"), _named_unit("weight")
    (('mm', True), ('mm', True), ('mm/s', False), ('', False))
    """
    every = {unit for units in COLUMN_UNITS.values() for unit in units}
    if found := re.search(r"[\[(<{]([^\[\](){}<>]+)[\])>}]\s*$", name):
        return plain(found[1]), True
    before, slash, after = name.partition("/")
    if slash and before.strip() and plain(after.strip("() ")) in every:
        return plain(after.strip("() ")), True
    words = [each for each in re.split(r"[\s_,;:-]+", name.strip()) if each]
    if len(words) > 2 and plain("/".join(words[-2:])) in every:
        return plain("/".join(words[-2:])), False
    if len(words) > 1 and (words[-2] == "in" or plain(words[-1]) in every):
        return plain(words[-1]), words[-2] == "in"
    return "", False


def _named(quantity: str, column: Column) -> Column:
    """Return a column; refuse one whose name clearly gives another unit."""
    if quantity not in COLUMN_UNITS:
        return column
    known, (unit, clear) = COLUMN_UNITS[quantity], _named_unit(column.name)
    clear = clear or len(unit) > 1
    if clear and known.get(unit, 0.0) != known.get(plain(column.unit), 0.0) and unit in known:
        raise UnitError(
            f"it is read in {column.unit}",
            place=f"column of {quantity}",
            value=column.name,
            advice=f"give the unit of its name, {unit!r}, or rename the column",
        )
    return column


def _si(quantity: str) -> str:
    return next(unit for unit, value in COLUMN_UNITS[quantity].items() if value == 1.0)
