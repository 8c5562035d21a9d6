"""Whole numbers of floats, and noise that counts: the same bits on every platform.

As in `integrators.elementary`: only operations that IEEE 754 rounds correctly, in the subset that
`integrators.machine_code` translates, and nothing raises.
"""

from __future__ import annotations

import math

__all__ = ["floor", "nearest", "noise", "tooth"]


def nearest(x: float) -> float:
    """Return the nearest whole number, the even one of two, with the sign of x."""
    size = abs(x)
    if not size < 4503599627370496.0:  # 2**52: there is nothing behind the point, or it is NaN
        return x
    return math.copysign((size + 4503599627370496.0) - 4503599627370496.0, x)


def floor(x: float) -> float:
    """Return the largest whole number that is not above x."""
    whole = nearest(x)
    return whole - 1.0 if whole > x else whole


def tooth(x: float) -> float:
    """Return how far x is from a whole number, negative where the one below x is odd."""
    if not abs(x) < math.inf:
        return math.nan
    rest = x - 2.0 * nearest(0.5 * x)
    if rest > 0.5:
        return 1.0 - rest
    return -1.0 - rest if rest < -0.5 else rest


def _in_32(a: float) -> float:
    """Return a whole number without multiples of 2**32."""
    return a - 4294967296.0 * floor(a * 2.3283064365386963e-10)


def _times(a: float, b: float) -> float:
    """Return the last 32 bits of a product of two such numbers; every part of it is exact."""
    high = floor(a * 1.52587890625e-05)
    top = high * b
    top = top - 65536.0 * floor(top * 1.52587890625e-05)
    return _in_32(65536.0 * top + (a - 65536.0 * high) * b)


def noise(n: float, seed: float) -> float:
    """Return the n-th of a series of numbers from -1 to below 1 that look like chance.

    Four rounds of x (2 x + 1), as in RC6, with the halves exchanged, on 32 bits: a counter-based
    generator needs no memory.
    """
    if not (abs(n) < 4503599627370496.0 and abs(seed) < 4503599627370496.0):
        return math.nan
    x, key = _in_32(floor(n)), _in_32(_times(_in_32(floor(seed)), 2654435769.0) + 1640531527.0)
    for _round in range(4):
        x = _in_32(x + key)
        x = _times(x, _in_32(2.0 * x + 1.0))
        high = floor(x * 1.52587890625e-05)
        x = 65536.0 * (x - 65536.0 * high) + high
        key = _in_32(key + 2654435769.0)
    return x * 4.656612873077393e-10 - 1.0
