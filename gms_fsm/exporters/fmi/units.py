"""Units as FMI wants them: exponents of the SI base units."""

from __future__ import annotations

import re
from collections.abc import Mapping

_SYMBOLS: Mapping[str, Mapping[str, int]] = {
    "1": {},
    "m": {"m": 1},
    "kg": {"kg": 1},
    "s": {"s": 1},
    "A": {"A": 1},
    "K": {"K": 1},
    "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Hz": {"s": -1},
}
_TOKEN = re.compile(
    rf"({'|'.join(sorted(_SYMBOLS, key=len, reverse=True))})(?:(?:\^|\*\*)?(-?\d))?"
)


def base_units(text: str) -> dict[str, int] | None:
    """Return the exponents of the SI base units in a unit.

    Examples
    --------
    >>> base_units("Ns/m")
    {'kg': 1, 's': -1}
    >>> base_units("m/s^2"), base_units("1"), base_units("furlong")
    ({'m': 1, 's': -2}, {}, None)
    """
    found: dict[str, int] = {}
    for k, part in enumerate(re.sub(r"[()]", "", text).split("/")):
        rest = re.sub(r"[\s*·]+(?!\*)", "", part) if "**" not in part else part
        if not rest:
            return None
        while rest:
            token = _TOKEN.match(rest)
            if token is None:
                return None
            power = int(token[2] or 1) * (-1 if k else 1)
            for name, exponent in _SYMBOLS[token[1]].items():
                found[name] = found.get(name, 0) + power * exponent
            rest = rest[token.end() :]
    return {name: exponent for name, exponent in found.items() if exponent}
