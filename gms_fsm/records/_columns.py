"""Which column of a table is which quantity, and in which unit."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from gms_fsm.errors import ParameterError, UnitError, keyed
from gms_fsm.foundation.quantities import UNITS, factor, plain

if TYPE_CHECKING:
    from gms_fsm.charts.parameters import FloatArray

QUANTITIES = ("time", "position", "velocity", "force", "normal")
LOADS = ("force", "normal")  # needed only in selected rows; motion is needed in between too


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
        quantity : {"time", "position", "velocity", "force", "normal"}
            What the column holds.
        values : ndarray
            The numbers of the table.

        Returns
        -------
        ndarray
            ``sign * factor * values``, a new array.

        Raises
        ------
        UnitError
            If the unit is unknown or belongs to another quantity.
        """
        return self.sign * factor(quantity, self.unit) * values


ColumnLike: TypeAlias = str | tuple[str, str] | tuple[str, str, int] | Column


def columns_of(given: dict[str, Any]) -> dict[str, Column]:
    """Return the column of each quantity that has one.

    Examples
    --------
    >>> columns_of({"position": ("x", "mm"), "force": "F", "normal": None})["force"]
    Column(name='F', unit='N', sign=1)
    """
    found: dict[str, Column] = {}
    for quantity, each in given.items():
        if each is not None:
            with keyed(quantity):
                found[quantity] = _column(quantity, each)
                factor(quantity, found[quantity].unit)
    return found


def _column(quantity: str, given: Any) -> Column:
    if isinstance(given, Column):
        given = (given.name, given.unit, given.sign)
    match given:
        case str() as name:
            _check_named_unit(quantity, name)
            return Column(name, _si(quantity))
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


def _check_named_unit(quantity: str, name: str) -> None:
    """Refuse a name that ends in another unit than that in which the column would be read."""
    unit = _named_unit(name)
    if UNITS[quantity].get(unit, 1.0) != 1.0:
        raise ParameterError(
            f"its values would be read in {_si(quantity)}",
            place=quantity,
            value=name,
            advice=f"give the unit, too: ({name!r}, {unit!r})",
        )


def _named_unit(name: str) -> str:
    """Return what stands at the end of a name as a unit does: in brackets, or after a blank."""
    before, *parts = re.split(r"[\s_(\[]+", name.rstrip(" )]"))
    return plain(parts[-1]) if before and parts else ""


def _named(quantity: str, column: Column) -> Column:
    """Return a column; refuse one whose name clearly gives another unit."""
    known, unit = UNITS[quantity], _named_unit(column.name)
    clear = len(unit) > 1 or column.name.rstrip().endswith(("]", ")"))
    if clear and known.get(unit, 0.0) != known.get(plain(column.unit), 0.0) and unit in known:
        raise UnitError(
            f"it is read in {column.unit}",
            place=f"column of {quantity}",
            value=column.name,
            advice=f"give the unit of its name, {unit!r}, or rename the column",
        )
    return column


def _si(quantity: str) -> str:
    return next(unit for unit, value in UNITS[quantity].items() if value == 1.0)
