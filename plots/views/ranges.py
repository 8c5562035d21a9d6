"""The ranges of sliders: those that a user gives, and one decade around a value."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.systems.numbers import NamedNumber

DECADE = math.sqrt(10.0)  # below and above a value
WIDE = 10.0  # a positive range with such a ratio of its ends has a logarithmic slider
Ends = tuple[float, float]


def checked_ranges(
    argument: str, ranges: Mapping[str, Ends], number: Callable[[str], NamedNumber]
) -> dict[str, Ends]:
    """Return the ranges of sliders by name; raise `ParameterError` for one that is none."""
    if not isinstance(ranges, Mapping):
        raise ParameterError(
            "give ranges by name, for example {'F_s': (1.0, 3.0)}", place=argument, value=ranges
        )
    found = {}
    for name, ends in ranges.items():
        value = number(name).value
        try:
            low, high = (checked_scalar(f"{argument}[{name!r}]", end, "finite") for end in ends)
        except (TypeError, ValueError) as error:
            if isinstance(error, GMSError):
                raise
            raise ParameterError(
                "give its lowest and its highest value", place=f"{argument}[{name!r}]", value=ends
            ) from None
        if low > high:
            raise ParameterError(
                "the lowest value comes first",
                place=f"{argument}[{name!r}]",
                value=ends,
                advice=f"give ({high!r}, {low!r})",
            )
        if not (low < high and low <= value <= high and math.isfinite(high - low)):
            raise ParameterError(
                f"it must be a range around {value!r}, the value of the model",
                place=f"{argument}[{name!r}]",
                value=ends,
            )
        found[name] = (low, high)
    return found


def usual_range(number: NamedNumber) -> Ends:
    """Return a range around the value of a number, within the limits of its rule.

    Examples
    --------
    >>> from gms_fsm.charts.parameters import Parameter
    >>> usual_range(NamedNumber("k", Parameter("k", "N/m", "> 0"), 2.0, "k", None))
    (0.63, 6.3)
    >>> usual_range(NamedNumber("b", Parameter("b", "Ns/m", ">= 0"), 0.0, "b", None))
    (0.0, 1.0)
    """
    u = number.value
    limits = [each for each in number.parameter.bounds if isinstance(each.limit, float)]
    low, high = sorted((_rounded(u / DECADE), _rounded(u * DECADE))) if u else (-1.0, 1.0)
    for each in limits:
        assert isinstance(each.limit, float)
        if each.op in (">", ">="):
            low = max(low, each.limit)
        else:
            high = min(high, each.limit)
    return low, high


def is_logarithmic(low: float, high: float) -> bool:
    """Return whether the slider of a range is logarithmic."""
    return low > 0.0 and high / low >= 0.99 * WIDE


def _rounded(u: float) -> float:
    return float(f"{u:.2g}")
