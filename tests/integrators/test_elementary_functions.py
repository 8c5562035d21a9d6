"""The elementary functions against mpmath, IEEE 754, their symmetry, and their machine code."""

from __future__ import annotations

import ctypes
import math
import struct
from collections.abc import Callable
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest

from integrators import elementary
from integrators.machine_code import whole_numbers
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.front_end.values import NumberValue
from integrators.machine_code.tree import Local
from integrators.runners import quick

OWN = {
    name: getattr(module, name) for module in (elementary, whole_numbers) for name in module.__all__
}
TWO = ("atan2", "noise", "power")
ODD = ("asin", "asinh", "atan", "sin", "sinh", "tan", "tanh")
SPECIAL = [
    0.0, 5e-324, 2.2250738585072014e-308, 1e-200, 0.5, math.pi / 4, 1.0, 2.0, 3.0, 709.78, 709.79,
    710.4758600739439, 745.13, 745.14, 1e22, 1e300, 1.7976931348623157e308, math.inf,
]  # fmt: skip
SPECIAL = [math.nan, *SPECIAL, *(-each for each in SPECIAL)]


def spread(dice: Random, low: float, high: float) -> float:
    """Return a number of either sign whose size lies between two powers of ten."""
    return math.copysign(10.0 ** dice.uniform(low, high), dice.random() - 0.5)


def argument(name: str, dice: Random) -> tuple[float, ...]:
    """Draw arguments where the function is finite."""
    near = dice.random() < 0.5
    if name == "power":
        x = 10.0 ** dice.uniform(-3, 3) if near else 10.0 ** dice.uniform(-300, 300)
        return x, dice.uniform(-300, 300) / max(abs(math.log10(x)), 3.0)
    if name in ("atan2", "noise"):
        return spread(dice, -5, 5), spread(dice, -5, 5)
    if name == "log":
        return (dice.uniform(0.5, 2.0) if near else 10.0 ** dice.uniform(-323, 308),)
    if name in ("asin", "acos"):
        edge = math.copysign(1.0 - 10.0 ** dice.uniform(-16, -1), dice.random() - 0.5)
        return (dice.uniform(-1, 1) if near else edge,)
    if name in ("exp", "sinh", "cosh"):
        return (dice.uniform(-2, 2) if near else dice.uniform(-708, 709),)
    if name in ("sin", "cos", "tan"):
        return (dice.uniform(-7, 7) if near else spread(dice, -9, 300),)
    return (dice.uniform(-3, 3) if near else spread(dice, -9, 20),)


@pytest.mark.parametrize("name", elementary.__all__)
def test_the_error_is_at_most_one_unit_in_the_last_place(name: str) -> None:
    own, exact, draw = getattr(elementary, name), getattr(mpmath, name), Random(1)
    with mpmath.workprec(1200 if name in ("sin", "cos", "tan") else 140):
        for _ in range(1000):
            given = argument(name, draw)
            right = exact(*map(mpmath.mpf, given))
            apart = abs(mpmath.mpf(own(*given)) - right)
            assert apart <= math.ulp(float(right)), f"{name}{given}, seed 1"


@pytest.mark.parametrize("name", elementary.__all__)
def test_special_cases_are_those_of_ieee_754(name: str) -> None:
    own, library = getattr(elementary, name), getattr(math, name.replace("power", "pow"))
    cases = [(x, y) for x in SPECIAL for y in SPECIAL] if name in TWO else [(x,) for x in SPECIAL]
    for given in cases:
        found = own(*given)
        try:
            right = library(*given)
        except OverflowError:
            assert math.isinf(found), f"{name}{given}"
            continue
        except ValueError:  # outside the domain; or a pole, where IEEE 754 gives infinity
            pole = (name == "log" and given[0] == 0.0) or (name == "power" and given[0] == 0.0)
            assert math.isinf(found) if pole else math.isnan(found), f"{name}{given}"
            continue
        if math.isnan(right):
            assert math.isnan(found), f"{name}{given}"
        elif right == 0.0 or math.isinf(right):
            assert struct.pack("d", found) == struct.pack("d", right), f"{name}{given}"
        else:
            assert abs(found - right) <= 2.0 * math.ulp(right), f"{name}{given}"


@pytest.mark.parametrize(("name", "library"), [("floor", np.floor), ("nearest", np.rint)])
def test_whole_numbers_are_those_of_ieee_754(name: str, library: Callable[[float], float]) -> None:
    own, draw = OWN[name], Random(5)
    halves = [0.5 * k for k in range(-9, 10)]
    near = [math.nextafter(u, way) for u in halves for way in (-math.inf, math.inf)]
    drawn = [spread(draw, -3, 17) for _ in range(1000)]
    for x in (*SPECIAL, *halves, *near, *drawn):
        pair = struct.pack("dd", own(x), float(library(x)))
        assert pair[:8] == pair[8:] or math.isnan(x), f"{name}({x!r})"


def test_a_tooth_changes_its_sign_where_floor_jumps() -> None:
    draw = Random(6)
    for x in (*(0.5 * k for k in range(-9, 10)), *(spread(draw, -3, 6) for _ in range(1000))):
        whole, found = math.floor(x), whole_numbers.tooth(x)
        assert abs(found) <= min(x - whole, whole + 1 - x) + 1e-9
        assert (found == 0.0) == (x == whole)
        assert found == 0.0 or (found > 0.0) == (whole % 2 == 0), x


def test_noise_looks_like_chance() -> None:
    """Even, without memory, and other seeds give other numbers; limits are four deviations."""
    count = 4096
    rows = np.array([[whole_numbers.noise(n, seed) for n in range(count)] for seed in (7.0, 8.0)])
    assert rows.min() >= -1.0
    assert rows.max() < 1.0
    for row in rows:
        cells = np.histogram(row, 64, (-1.0, 1.0))[0]
        assert np.sum((cells - 64) ** 2 / 64) < 63 + 4 * math.sqrt(126)
        for lag in (1, 2, 16):
            assert abs(np.mean(row[lag:] * row[:-lag])) * 3 * math.sqrt(count) < 4
    assert abs(np.mean(rows[0] * rows[1])) * 3 * math.sqrt(count) < 4
    assert whole_numbers.noise(2.9, 7.9) == rows[0][2]


@pytest.mark.parametrize("name", ODD)
def test_odd_functions_are_exactly_odd(name: str) -> None:
    own, draw = getattr(elementary, name), Random(2)
    for _ in range(1000):
        (x,) = argument(name, draw)
        assert own(-x) == -own(x), f"{name}({x!r}), seed 2"


@pytest.mark.parametrize("name", ["acos", "asin", "asinh", "atan", "exp", "log", "sinh", "tanh"])
def test_monotone_functions_stay_so_from_one_number_to_the_next(name: str) -> None:
    own, draw, sign = getattr(elementary, name), Random(3), -1.0 if name == "acos" else 1.0
    for _ in range(1000):
        (x,) = argument(name, draw)
        assert sign * own(x) <= sign * own(math.nextafter(x, math.inf)), f"{name}({x!r}), seed 3"


def test_the_angle_next_to_a_quarter_turn_is_reduced_exactly() -> None:
    """The double nearest to a multiple of pi/2: J.-M. Muller, Elementary Functions (2006), 11.2."""
    assert elementary.cos(6381956970095103.0 * 2.0**797) == -4.68716592425462761112e-19


@pytest.mark.parametrize("name", OWN)
def test_machine_code_computes_the_same_bits(
    name: str, compiled: Callable[[str], Callable[..., float]]
) -> None:
    own, made, draw = OWN[name], compiled(name), Random(4)
    cases: list[Any] = [argument(name, draw) for _ in range(1000)]
    cases += [(x, y) for x in SPECIAL for y in SPECIAL] if name in TWO else [(x,) for x in SPECIAL]
    for _ in range(1000):  # any bits
        pair = struct.unpack("dd", draw.randbytes(16))
        cases.append(pair if name in TWO else pair[:1])
    for given in cases:
        a, b = own(*given), made(*given)
        assert struct.pack("d", a) == struct.pack("d", b) or a != a != b != b, (name, given)


@pytest.fixture(scope="module")
def compiled() -> Callable[[str], Callable[..., float]]:
    """Return each function as machine code."""
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    from integrators.machine_code.llvm import llvm_text
    from integrators.machine_code.objects import Library
    from integrators.machine_code.objects import compiled as made

    translator, many = Translator(), {}
    for name in OWN:
        many[name] = [NumberValue(Local("f", each)) for each in ("x", "y")[: 1 + (name in TWO)]]
        translator.entry(f"own_{name}", OWN[name], many[name])
    library = Library(made(llvm_text(translator.module)))

    def function(name: str) -> Callable[..., float]:
        kinds = [ctypes.c_double] * (1 + len(many[name]))
        address = library.address(f"own_{name}")
        return lambda *given: ctypes.CFUNCTYPE(*kinds)(address)(*given)

    return function


@pytest.mark.parametrize(("function", "loop"), [("exp", "_of_one"), ("atan2", "_of_two")])
def test_long_columns_have_the_same_bits(
    function: str, loop: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A loop is compiled for them; without llvmlite each entry is computed as it stands."""
    own = getattr(elementary, function)
    rows = np.random.default_rng(3).normal(size=(2, 4, 5))[: 1 + (function in TWO)]
    told = np.empty(rows[0].size)
    getattr(quick, loop)(own, *(row.ravel().tolist() for row in rows), told)
    monkeypatch.setattr(quick, "FREE", 10)
    assert quick.each(own, *rows).tobytes() == told.tobytes()
    monkeypatch.setattr(quick, "find_spec", lambda name: None)
    assert quick.each(own, *rows).tobytes() == told.tobytes()
    assert quick.scalar(own, len(rows)) is own
