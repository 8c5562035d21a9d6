"""A value in engineering units is the value, to its digits, with a prefix from 1 to 999."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from gms_fsm.foundation.quantities import BLOCKS, PREFIXES, quantity, scale_of, sparkline

POWERS = {prefix: power for power, prefix in PREFIXES.items()}
NUMBERS = st.floats(min_value=1e-11, max_value=1e11).flatmap(
    lambda size: st.sampled_from([size, -size])
)


@given(NUMBERS, st.sampled_from(["m", "m/s", "N", "N/m"]), st.integers(3, 6))
def test_it_reads_back_as_the_value(value: float, unit: str, digits: int) -> None:
    text = quantity(value, unit, digits)
    found = re.fullmatch(r"(-?[\d.]+) ([pnµmkMGT]?)(m/s|N/m|m|N)", text)
    assert found, text
    assert found[3] == unit
    number = float(found[1])
    assert 1.0 <= abs(number) < 1000.0
    assert len(re.sub(r"[-.]", "", found[1])) == digits
    back = number * 10.0 ** POWERS[found[2]]
    assert back == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (999.96, "m", "1.000 km"),
        (0.00099996, "N", "1.000 mN"),
        (-1e-6, "m/s", "-1.000 µm/s"),
        (1e-15, "N", "1.000e-15 N"),
        (1e-12, "N", "1.000 pN"),
        (1e-22, "N", "1.000e-22 N"),
        (0.5, "m^2", "0.5000 m^2"),
        (1500.0, "kg", "1500 kg"),
        (2.0, "rad", "2.000 rad"),
        (math.nan, "m", "nan m"),
        (1.7976e308, "m", "1.7976e+308 m"),
    ],
)
def test_edges(value: float, unit: str, text: str) -> None:
    assert quantity(value, unit) == text


@pytest.mark.parametrize(
    ("values", "unit", "texts"),
    [
        ([0.0, 0.018685, -2e-4], "m", ["0 mm", "18.69 mm", "-0.2000 mm"]),
        ([3e-3, 2.5], "m/s", ["0.003000 m/s", "2.500 m/s"]),
        ([1e-9, 0.15], "m/s", ["1.000e-06 mm/s", "150.0 mm/s"]),
        ([1234.0, 0.5], "kg", ["1234 kg", "0.5000 kg"]),
        ([0.0, math.nan], "N", ["0 N", "nan N"]),
    ],
)
def test_values_at_one_place_have_one_unit(
    values: list[float], unit: str, texts: list[str]
) -> None:
    scale = scale_of(values, unit)
    assert [scale.text(value) for value in values] == texts


@given(st.lists(st.none() | st.floats(allow_nan=False, allow_infinity=False), max_size=40))
@example([5e-324, 0.0])
@example([-1.7e308, 0.0, 1.7e308])
def test_a_sparkline_keeps_the_order_of_its_values(values: list[float | None]) -> None:
    text = sparkline(values)
    assert len(text) == len(values)
    known = [(value, mark) for value, mark in zip(values, text, strict=True) if value is not None]
    assert all(mark == " " for value, mark in zip(values, text, strict=True) if value is None)
    known.sort(key=lambda each: each[0])
    heights = [BLOCKS.index(mark) for _, mark in known]
    assert heights == sorted(heights)
