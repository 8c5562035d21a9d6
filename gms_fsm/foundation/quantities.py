"""Values in engineering units for screens: ``-776.2 mm``, ``1.346 N``, ``25.00 kN/m``."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence

WIDTH = 80  # columns, where there is no terminal

PREFIXES = {3 * i - 18: prefix for i, prefix in enumerate(["a", *"fpnµm", "", *"kMGT"])}
# A prefix belongs to the first unit of a product; of a power or of kg it would be wrong.
TAKES_PREFIX = re.compile(r"(m|s|N|J|W|Pa|Hz|rad|V|A|Nm|Ns)(?=$|[/*·])")
BLOCKS = "▁▂▃▄▅▆▇█"


def quantity(value: float, unit: str = "", digits: int = 4) -> str:
    """Return a value with its unit, and a prefix instead of an exponent.

    Examples
    --------
    >>> quantity(-0.77618, "m"), quantity(1.5, "N"), quantity(0, "m/s"), quantity(2.5e4, "N/m")
    ('-776.2 mm', '1.500 N', '0 m/s', '25.00 kN/m')
    >>> quantity(1e-6, "m/s"), quantity(0.99999, "m"), quantity(3e-7, "m^2"), quantity(1.51743)
    ('1.000 µm/s', '1.000 m', '3.000e-07 m^2', '1.517')
    """
    rounded = float(f"{value:.{digits - 1}e}")  # of the largest numbers it is infinite
    if not math.isfinite(rounded) or value == 0.0:
        return f"{value:g} {unit}".rstrip()
    power = math.floor(math.log10(abs(rounded)) + 1e-12)
    step = 3 * (power // 3)
    if unit and TAKES_PREFIX.match(unit) and step in PREFIXES:
        return f"{rounded / 10.0**step:.{digits - 1 - power + step}f} {PREFIXES[step]}{unit}"
    if -4 <= power < digits:
        return f"{rounded:.{digits - 1 - power}f} {unit}".rstrip()
    return f"{rounded:.{digits - 1}e} {unit}".rstrip()


def named_numbers(values: Mapping[str, float]) -> str:
    """Return numbers by name: ``z = 0.1, s = 0.2``."""
    return ", ".join(f"{name} = {value:.6g}" for name, value in values.items())


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
    >>> list(wrapped("  proved   never at the same time", 24))
    ['  proved   never at the', '           same time']
    """
    if len(line) <= width:
        yield line.rstrip()
        return
    column = re.match(r" *\S+ {2,}", line)
    hanging = column.end() if column else len(line) - len(line.lstrip()) + 2
    yield from textwrap.wrap(
        line,
        width,
        subsequent_indent=" " * min(hanging, width // 2),
        break_long_words=not whole,
        break_on_hyphens=not whole,
    )
