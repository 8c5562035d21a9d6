"""Units of measured records: a small explicit table of factors to SI."""

from __future__ import annotations

import re
from collections.abc import Mapping

from gms_fsm.errors import UnitError, shown

__all__ = ["FACTORS", "convert_numbers", "factor", "plain"]

# quantity -> unit -> factor to SI
FACTORS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "position": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254},
    "velocity": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "um/s": 1e-6, "nm/s": 1e-9},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "uN": 1e-6, "lbf": 4.4482216152605},
}
FACTORS["normal"] = FACTORS["force"]


def plain(unit: str) -> str:
    """Return a unit as the table of factors writes it.

    Parameters
    ----------
    unit : str
        Unit, for example ``" µm"``.

    Returns
    -------
    str
        Without spaces around it, and with ``u`` for micro.

    Examples
    --------
    >>> plain(" µm")
    'um'
    """
    return unit.strip().replace("µ", "u").replace("μ", "u")


def factor(quantity: str, unit: str) -> float:
    """Return the factor from a unit to SI.

    Parameters
    ----------
    quantity : {"time", "position", "velocity", "force", "normal"}
        The quantity.
    unit : str
        Unit, for example ``"mm"``; ``µ`` and ``μ`` are read as ``u``.

    Returns
    -------
    float
        Value in SI = factor * value in the unit.

    Raises
    ------
    UnitError
        If the unit is unknown or belongs to another quantity.

    Examples
    --------
    >>> factor("position", "µm")
    1e-06
    """
    name, known = plain(unit), FACTORS[quantity]
    if name in known:
        return known[name]
    for other, units in FACTORS.items():
        if name in units:
            raise UnitError(
                f"unit {shown(unit)} measures {other}, not {quantity}",
                advice=f"use one of {', '.join(known)}",
            )
    raise UnitError(
        f"unknown unit {shown(unit)}", advice=f"for {quantity} use one of {', '.join(known)}"
    )


def convert_numbers(text: str, quantities: Mapping[str, str] | None = None) -> str:
    """Replace each ``number unit`` in a condition by the number in SI.

    Parameters
    ----------
    text : str
        Condition, for example ``"normal > 4.5 N"``.
    quantities : mapping of str to str, optional
        The quantity that each name measures; by default names are those of quantities.

    Returns
    -------
    str
        The condition with SI numbers, for example ``"normal > 4.5"``.

    Raises
    ------
    UnitError
        If a word after a number is not a unit, or not one of the quantity that it is compared with.

    Examples
    --------
    >>> convert_numbers("normal > 4500 mN and time < 3 min")
    'normal > 4.5     and time < 180.0'
    >>> convert_numbers("abs(v) > 300 mm/s", {"v": "velocity"})
    'abs(v) > 0.3     '
    """
    known = {each: each for each in FACTORS} if quantities is None else quantities
    # Possessive (++): 2e3 is not 2 with the unit e3, and long digit strings do not backtrack.
    number = r"(?:\d++(?:\.\d*+)?+|\.\d++)(?:[eE][-+]?\d++)?+"
    number_unit = rf"(?<![\w.])({number})\s*+([^\W\d]\w*+(?:/s)?)"

    def converted(clause: str) -> str:
        measured = [known[name] for name in re.findall(r"[^\W\d][\w.]*", clause) if name in known]

        def in_si(found: re.Match[str]) -> str:
            value, unit = float(found.group(1)), found.group(2)
            fitting = measured or [q for q, units in FACTORS.items() if plain(unit) in units]
            # Padded to the length of the original if possible, so columns in messages are correct.
            return repr(value * factor((fitting or ["force"])[0], unit)).ljust(len(found.group(0)))

        return re.sub(number_unit, in_si, clause)

    parts = re.split(r"(\band\b|\bor\b|\bnot\b|&&|\|\|)", text)
    return "".join(p if k % 2 else converted(p) for k, p in enumerate(parts))
