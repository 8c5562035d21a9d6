"""Values in engineering units, one unit for each quantity and place (``-776.2 mm``); factors.

Weighed against pint 0.25: importing it and making its registry took 4 to 6 s where this module
takes 0.4 s, for five packages. It would replace the tables of factors and of base units, not what
writes a value at a place. And it reads Nm, as everyone writes it, as numbers times metres, and
refuses Ns/m: it would need a table of these names beside its own.
"""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from gms_fsm.errors import UnitError, shown

WIDTH = 80  # columns, where there is no terminal
JOINED = "\N{NO-BREAK SPACE}"
NAME_AND_NUMBER = re.compile(r"[^ ]+ = -?\d[^ ]*")
NUMBER_AND_UNIT = re.compile(r"(?<=\d) (?=[pnuµmkMGT]?(?:m/s|rad/s|rad|Nm|m|N|s)\b)")

PREFIXES = {3 * i - 12: prefix for i, prefix in enumerate([*"pnµm", "", *"kMGT"])}
# A prefix belongs to the first unit of a product; of a power or of kg it would be wrong.
TAKES_PREFIX = re.compile(r"(m|s|N|J|W|Pa|Hz|rad|V|A|Nm|Ns|Nms)(?=$|[/*·])")
LONGEST_NUMBER = 60  # characters, with its unit: the search takes quadratic time
# Factors to SI.
NOT_OF_SI = {
    **{"g": 1e-3, "min": 60.0, "h": 3600.0, "%": 0.01, "in": 0.0254, "lbf": 4.4482216152605},
    **{"deg": math.pi / 180.0, "rpm": math.pi / 30.0, "bar": 1e5, "K": 1.0, "1": 1.0},
}
# What a unit of a translation is for a rotation, unit by unit.
OF_ROTATION = {"m": "rad", "N": "Nm", "Ns": "Nms", "kg": "kg m^2"}
OF_A_ROTATION = re.compile(r"\brad\b|\bNm(s|\b)")
# The exponents of the base units in a unit.
BASES: Mapping[str, Mapping[str, int]] = {
    "1": {},
    **{base: {base: 1} for base in ("m", "kg", "s", "A", "K", "rad")},
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Hz": {"s": -1},
}
_BASE = re.compile(rf"({'|'.join(sorted(BASES, key=len, reverse=True))})(?:(?:\^|\*\*)?(-?\d))?")
_ONE_UNIT = re.compile(r"([pnuµmckMGT]?)(Nm|Ns|Pa|Hz|rad|m|s|N|J|W|V|A|g)\^?(-?\d)?")
_POWER_OF_TEN = re.compile(r"(?:([\d.,]+)\s*[*x×·]\s*)?\b10\s*(?:\^|\*\*)\s*\(?([+-]?\d+)\)?")
_WITH_UNIT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")
_THOUSANDS = re.compile(r"(?<!\d)[1-9]\d{0,2}(?:,\d{3})+(?!\d)")
BLOCKS = "▁▂▃▄▅▆▇█"
DIGITS = 4
SMALLEST = -4  # power of ten of a value in the unit of its place, below which it has an exponent


@dataclass(frozen=True)
class Scale:
    """The unit of a quantity at one place: that of SI with the prefix of a power of ten."""

    power: int
    unit: str

    @property
    def factor(self) -> float:
        """What a value in SI is multiplied by."""
        return 10.0**-self.power

    def number(self, value: float, digits: int = DIGITS) -> str:
        """Return a value in this unit, without the unit.

        >>> Scale(-3, "mm").number(0.0123456), Scale(-3, "mm").number(0.0)
        ('12.35', '0')
        """
        rounded = float(f"{value:.{digits - 1}e}")  # of the largest numbers it is infinite
        if not math.isfinite(rounded) or value == 0.0:
            return f"{value:g}"
        power = _power(rounded)
        shown = power - self.power
        if SMALLEST <= shown < max(digits, 3 if self.power else 0):
            return f"{_shifted(rounded, -self.power):.{max(0, digits - 1 - shown)}f}"
        return f"{_shifted(rounded, -self.power):.{digits - 1}e}"

    def text(self, value: float, digits: int = DIGITS) -> str:
        """Return a value in this unit.

        >>> Scale(-3, "mm/s").text(0.0), Scale(-3, "mm/s").text(2e-6)
        ('0 mm/s', '0.002000 mm/s')
        """
        return f"{self.number(value, digits)} {self.unit}".rstrip()

    def near(self, value: float) -> Scale:
        """Return this unit, or for a value that is far smaller the one that suits it.

        >>> Scale(-3, "mm/s").near(2e-5).unit, Scale(-3, "mm/s").near(-1e-6).unit
        ('mm/s', 'µm/s')
        """
        if not 0.0 < abs(value) < 10.0 ** (self.power - 2):
            return self
        return scale_of(value, self.unit[1:] if self.power else self.unit)


def scale_of(values: float | Iterable[float], unit: str, digits: int = DIGITS) -> Scale:
    """Return the scale that suits the largest of some values: one unit for all of them.

    >>> scale_of([0.0, 2e-4, -0.03], "m/s"), scale_of([0.0], "N"), scale_of(3e-7, "m^2")
    (Scale(power=-3, unit='mm/s'), Scale(power=0, unit='N'), Scale(power=0, unit='m^2'))
    """
    each = (values,) if isinstance(values, (int, float)) else values
    largest = max((abs(value) for value in each if math.isfinite(value)), default=0.0)
    rounded = float(f"{largest:.{digits - 1}e}")
    step = 3 * (_power(rounded) // 3) if 0.0 < rounded < math.inf else 0
    if unit and TAKES_PREFIX.match(unit) and step in PREFIXES:
        return Scale(step, f"{PREFIXES[step]}{unit}")
    return Scale(0, unit)


def quantity(value: float, unit: str = "", digits: int = DIGITS) -> str:
    """Return a value with its unit, and a prefix instead of an exponent.

    Examples
    --------
    >>> quantity(-0.77618, "m"), quantity(1.5, "N"), quantity(0, "m/s"), quantity(2.5e4, "N/m")
    ('-776.2 mm', '1.500 N', '0 m/s', '25.00 kN/m')
    >>> quantity(1e-6, "m/s"), quantity(0.99999, "m"), quantity(3e-7, "m^2"), quantity(1.51743)
    ('1.000 µm/s', '1.000 m', '3.000e-07 m^2', '1.517')
    """
    return scale_of(value, unit, digits).text(value, digits)


def in_words(value: float, unit: str = "", digits: int = 6) -> str:
    """Return a value with its unit for a sentence: without zeros at its end.

    >>> in_words(0.3, "m/s"), in_words(-3.173430001, "N"), in_words(1e-6, "m"), in_words(100.0)
    ('300 mm/s', '-3.17343 N', '1 µm', '100')
    """
    return trimmed(quantity(value, unit, digits))


def trimmed(text: str) -> str:
    """Return a number, with or without a unit, without zeros at its end."""
    return re.sub(r"(\.\d*[1-9])0+(?!\d)|\.0+(?!\d)", r"\1", text)


def in_si(text: str) -> str:
    """Return the number that a text means, in SI units; empty if it means none, or several.

    >>> in_si("1 mm/s"), in_si("1,5"), in_si("10^-3"), in_si("2 N/mm"), in_si("3 kg")
    ('0.001', '1.5', '1e-3', '2000', '3')
    >>> in_si("1,000"), in_si("1e-3*t"), in_si("5 apples")
    ('', '', '')
    """
    if len(text) > LONGEST_NUMBER:
        return ""
    plain = _POWER_OF_TEN.sub(lambda found: f"{found[1] or 1}e{found[2]}", text.strip())
    found = _WITH_UNIT.fullmatch(re.sub(r"(?<=\d),(?=\d)", ".", plain))
    if found is None or _THOUSANDS.search(plain):
        return ""
    scale = _size(found[2].replace("μ", "µ").replace("²", "2").replace("³", "3"))
    number = float(found[1]) * scale
    if not math.isfinite(number):
        return ""
    as_given = scale == 1.0 and re.fullmatch(r"[+-]?\d+(\.\d+)?([eE][+-]?\d+)?", found[1])
    return found[1] if as_given else f"{number:.12g}"


def _size(unit: str) -> float:
    """Return the factor to SI of a product of units; NaN if one is not known."""
    scale, over = 1.0, False
    for part in re.split(r"([/*·])", unit) if unit else []:
        if part in "/*·":
            over = part == "/"
        else:
            scale *= 1.0 / _factor(part.strip()) if over else _factor(part.strip())
    return scale


def _factor(unit: str) -> float:
    """Return the factor to SI of one unit, with its prefix and power; NaN if it is not known."""
    if unit in NOT_OF_SI:
        return NOT_OF_SI[unit]
    found = _ONE_UNIT.fullmatch(unit)
    if found is None:
        return math.nan
    prefixes = {prefix: power for power, prefix in PREFIXES.items()} | {"u": -6, "c": -2}
    factor = 10.0 ** prefixes[found[1]] * NOT_OF_SI.get(found[2], 1.0)
    return float(factor ** int(found[3] or 1))


# quantity -> unit -> factor to SI
UNITS = {
    quantity: {unit: _size(unit) for unit in units.split()}
    for quantity, units in {
        "time": "s ms us min h",
        "position": "m cm mm um nm in",
        "velocity": "m/s cm/s mm/s um/s nm/s",
        "force": "N kN mN uN lbf",
        "normal": "N kN mN uN lbf",
        "angle": "rad mrad urad nrad deg",
        "angular velocity": "rad/s mrad/s urad/s nrad/s deg/s rpm",
        "torque": "Nm kNm mNm uNm",
    }.items()
}
# A column of a record may be that of a rotation.
_ROTATIONS = {
    **{"position": "angle", "velocity": "angular velocity"},
    **{"force": "torque", "normal": "torque"},
}
ROTARY = {unit for quantity in _ROTATIONS.values() for unit in UNITS[quantity]}
COLUMN_UNITS = {
    quantity: UNITS[quantity] | UNITS.get(_ROTATIONS.get(quantity, ""), {})
    for quantity in ("time", *_ROTATIONS)
}
_SPELLED = {
    **{"µ": "u", "μ": "u", "°": "deg", "deg C": "degC", "sec": "s", " s^-1": "/s"},
    **dict.fromkeys(("N·m", "N m", "N*m"), "Nm"),
    **dict.fromkeys(("1/min", "min^-1", "U/min"), "rpm"),
}


def of_rotation(unit: str) -> str:
    """Return the unit of a rotation that stands for one of a translation.

    >>> [of_rotation(unit) for unit in ("m/s", "Ns/m", "m/N", "kg", "1", "s/rad")]
    ['rad/s', 'Nms/rad', 'rad/Nm', 'kg m^2', '1', 's/rad']
    """
    return re.sub(r"[^\W\d]+", lambda found: OF_ROTATION.get(found[0], found[0]), unit)


def base_units(text: str) -> dict[str, int] | None:
    """Return the exponents of the SI base units in a unit; None if it is not known.

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
            token = _BASE.match(rest)
            if token is None:
                return None
            power = int(token[2] or 1) * (-1 if k else 1)
            for name, exponent in BASES[token[1]].items():
                found[name] = found.get(name, 0) + power * exponent
            rest = rest[token.end() :]
    return {name: exponent for name, exponent in found.items() if exponent}


def si_unit(text: str) -> bool:
    """Return whether a text is a unit of SI without a prefix.

    >>> [each for each in ("m/rad", "Nms/rad", "kg m^2", "mm", "deg", "") if si_unit(each)]
    ['m/rad', 'Nms/rad', 'kg m^2']
    """
    size = _size(text)
    return base_units(text) is not None and (math.isnan(size) or size == 1.0)


def per_second(unit: str) -> str:
    """Return the unit of a rate; empty if that of the quantity is.

    >>> [per_second(unit) for unit in ("m", "rad/s", "N/m", "")]
    ['m/s', 'rad/s^2', 'N/m/s', '']
    """
    return f"{unit}^2" if unit.endswith("/s") else f"{unit}/s" if unit else ""


def plain(unit: str) -> str:
    """Return a unit as the table of factors writes it.

    Parameters
    ----------
    unit : str
        Unit, for example ``" µm"``.

    Returns
    -------
    str
        Without spaces around it, with ``u`` for micro, ``deg`` for ``°``, ``rpm`` for ``1/min``.

    Examples
    --------
    >>> plain(" µm"), plain("°/s"), plain("mN·m")
    ('um', 'deg/s', 'mNm')
    """
    found = unit.strip()
    for spelled, name in _SPELLED.items():
        found = found.replace(spelled, name)
    return found


def input_factor(unit: str) -> tuple[float, float]:
    """Return factor and offset from any unit to SI, for what is not a motion or a force.

    >>> input_factor("kN"), input_factor("bar"), input_factor("°C")
    ((1000.0, 0.0), (100000.0, 0.0), (1.0, 273.15))
    """
    name = plain(unit)
    if name == "degC":
        return 1.0, 273.15
    found = 1.0 if not name else _size(name)
    if not math.isfinite(found):
        raise UnitError(
            f"unknown unit {shown(unit)}",
            advice="use one of SI with a prefix, for example N, kN, Pa, bar, K, °C, A, Nm; or 1",
        )
    return found, 0.0


def factor(
    quantity: str, unit: str, table: Mapping[str, Mapping[str, float]] | None = None
) -> float:
    """Return the factor from a unit to SI.

    Parameters
    ----------
    quantity : {"time", "position", "velocity", "force", "normal"}
        The quantity.
    unit : str
        Unit, for example ``"mm"``; ``µ`` and ``μ`` are read as ``u``.
    table : mapping, optional
        The units of each quantity; by default `UNITS`.

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
    table = UNITS if table is None else table
    name, known = plain(unit), table[quantity]
    if name in known:
        return known[name]
    for other, units in table.items():
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
    table = COLUMN_UNITS if quantities is None else UNITS
    known = {each: each for each in table} if quantities is None else quantities
    # Possessive (++): 2e3 is not 2 with the unit e3, and long digit strings do not backtrack.
    number = r"(?:\d++(?:\.\d*+)?+|\.\d++)(?:[eE][-+]?\d++)?+"
    number_unit = rf"(?<![\w.])({number})\s*+([^\W\d]\w*+(?:/s)?)"

    def converted(clause: str) -> str:
        measured = [known[name] for name in re.findall(r"[^\W\d][\w.]*", clause) if name in known]

        def in_si(found: re.Match[str]) -> str:
            value, unit = float(found.group(1)), found.group(2)
            fitting = measured or [q for q, units in table.items() if plain(unit) in units]
            # Padded to the length of the original if possible, so columns in messages are correct.
            return repr(value * factor((fitting or ["force"])[0], unit, table)).ljust(
                len(found.group(0))
            )

        return re.sub(number_unit, in_si, clause)

    parts = re.split(r"(\band\b|\bor\b|\bnot\b|&&|\|\|)", text)
    return "".join(p if k % 2 else converted(p) for k, p in enumerate(parts))


def _power(value: float) -> int:
    return math.floor(math.log10(abs(value)) + 1e-12)


def _shifted(value: float, power: int) -> float:
    """Return a value times a power of ten, rounded once."""
    return value * 10.0**power if power >= 0 else value / 10.0**-power


def named_numbers(values: Mapping[str, float], units: Mapping[str, str] | None = None) -> str:
    """Return numbers by name, with units where these are known: ``z = 0.1 m, s = 0.2``."""
    known = {} if units is None else units
    return ", ".join(
        f"{name} = {value:.6g} {known.get(name, '')}".rstrip() for name, value in values.items()
    )


def sparkline(values: Sequence[float | None]) -> str:
    """Return values as a line of blocks, the lowest and the highest at its edges.

    Examples
    --------
    >>> sparkline([0.0, 0.5, 1.0, None, -1.0]), sparkline([2.0, 2.0])
    ('▅▆█ ▁', '▁▁')
    """
    known = [value for value in values if value is not None and math.isfinite(value)]
    low, high = min(known, default=0.0), max(known, default=0.0)
    # By shares of the range, which neither overflows nor underflows; a reciprocal would.
    scale = 1.0 if math.isfinite(high - low) else 0.5
    span = scale * high - scale * low

    def block(value: float | None) -> str:
        if value is None or not math.isfinite(value):
            return " "
        share = (scale * value - scale * low) / span if span > 0.0 else 0.0
        return BLOCKS[round(share * (len(BLOCKS) - 1))]

    return "".join(map(block, values))


def wrapped(line: str, width: int = WIDTH, *, whole: bool = False) -> Iterator[str]:
    """Yield a line in parts that fit a screen, below the text behind its first column, if any.

    Whole words, such as the names of files, are not broken on request.

    >>> [len(part) <= WIDTH for part in wrapped("word " * 40)]
    [True, True, True]
    >>> list(wrapped("v = 300 mm/s", 11))
    ['v =', '  300 mm/s']
    >>> list(wrapped("  true  left 1      right 1    margin 0 m", 24))
    ['  true  left 1  right 1', '        margin 0 m']
    >>> list(wrapped("  proved   never at the same time", 24))
    ['  proved   never at the', '           same time']
    """
    if len(line) <= width:
        yield line.rstrip()
        return
    column = re.match(r" *\S+ {2,}", line)
    hanging = column.end() if column else len(line) - len(line.lstrip()) + 2
    hanging = min(hanging, width // 2)

    def joined(text: str) -> str:
        return text.replace(" ", JOINED) if len(text) <= width - hanging else text

    if column:  # a row of a table is broken between its cells
        cells = re.split(r" {2,}", line[column.end() :].rstrip())
        line = column[0] + "  ".join(map(joined, cells) if len(cells) > 1 else cells)
    line = NUMBER_AND_UNIT.sub(JOINED, line)
    for part in textwrap.wrap(
        NAME_AND_NUMBER.sub(lambda found: joined(found[0]), line),
        width,
        subsequent_indent=" " * hanging,
        break_long_words=not whole,
        break_on_hyphens=not whole,
    ):
        yield part.replace(JOINED, " ")
