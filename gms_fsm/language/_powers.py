"""The powers that every engine computes as products, because pow rounds differently."""

from __future__ import annotations

from gms_fsm.language.tree import Binary, Name, Negative, Number, Value

LARGEST_PRODUCT_POWER = 8  # x**8 and below are printed as products ...
LARGEST_PRODUCT = 64  # ... unless the text would exceed this many parts


def product_power(base: Value, exponent: Value) -> int | None:
    """Return the power if it is computed as a product, or None if it is computed by pow.

    Parameters
    ----------
    base, exponent : Value
        The parts of ``base**exponent``.

    Returns
    -------
    int or None
        The integer power, -8 to 8.

    Examples
    --------
    >>> from gms_fsm.language import Name, Number, product_power
    >>> product_power(Name("v"), Number(2.0)), product_power(Name("v"), Number(0.5))
    (2, None)
    """
    return _fitting_power(_parts(base), exponent)


def _fitting_power(parts: int, exponent: Value) -> int | None:
    whole = integer_power(exponent)
    return None if whole is None or abs(whole) * parts > LARGEST_PRODUCT else whole


def _parts(node: Value) -> int:
    """Count the names and numbers in a value as printed, with powers as products."""
    match node:
        case Number() | Name():
            return 1
        case Binary("**", base, exponent):
            parts = _parts(base)  # once: nested powers would otherwise double the work each time
            whole = _fitting_power(parts, exponent)
            return parts + _parts(exponent) if whole is None else max(1, parts * abs(whole))
    return sum(map(_parts, node.parts))


def integer_power(exponent: Value) -> int | None:
    """Return the integer that an exponent stands for if it is small, else None."""
    sign = 1.0
    while isinstance(exponent, Negative):
        sign, exponent = -sign, exponent.operand
    if not isinstance(exponent, Number) or not exponent.value.is_integer():
        return None
    whole = int(sign * exponent.value)
    return whole if abs(whole) <= LARGEST_PRODUCT_POWER else None
