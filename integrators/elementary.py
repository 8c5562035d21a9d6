"""Elementary functions from + - * / and comparisons: the same bits on every platform.

C libraries differ in the last bit of exp, sin and pow, and a difference in the last bit can change
the order of two switches. Here every operation is one that IEEE 754 rounds correctly, so the bits
are those of the standard, in Python, in machine code, in C and in JavaScript alike. Everything is
written in the subset that `integrators.machine_code` translates.

Sources. exp: P. T. P. Tang, ACM TOMS 15 (1989) 144, with his coefficients; log: his method of ACM
TOMS 16 (1990) 378, with two doubles for the result. sin and cos: the coefficients of FDLIBM's
``__kernel_sin`` and ``__kernel_cos`` (Sun Microsystems, 1993). Reduction by whole quarter turns:
W. J. Cody and W. Waite (1980), and M. H. Payne and R. N. Hanek, ACM SIGNUM 18 (1983) 19. atan and
the hyperbolic functions: tables and Taylor series. Errors of a product and of a sum: T. J. Dekker,
Numer. Math. 18 (1971) 224, and D. E. Knuth.

A pair ``h, small`` stands for the unrounded sum of two doubles. No operation here raises: the
result outside the domain is NaN, and beyond the largest double infinity.
"""

from __future__ import annotations

import math

__all__ = [
    "acos", "asin", "asinh", "atan", "atan2", "cos", "cosh", "exp", "log", "power", "sin", "sinh",
    "tan", "tanh",
]  # fmt: skip

INF, NAN = math.inf, math.nan
LARGEST = 710.4758600739439  # the sinh of more overflows
SPLIT = 134217729.0  # 2**27 + 1
WHOLE = 6755399441055744.0  # 1.5 * 2**52: adding and subtracting it rounds to a whole number


# --------------------------------------------------------------------------- tables
BITS, FAR = 200, 1400  # of the integers that stand for constants, and for 2 / pi


def _ratio(value: int) -> float:
    """Return the double nearest to an integer over 2**BITS."""
    return value / (1 << BITS)


def _in_two(value: int) -> tuple[float, float]:
    """Return a constant as two doubles."""
    head = _ratio(value)
    top, bottom = head.as_integer_ratio()
    return head, _ratio(value - (top << BITS) // bottom)


def _cut(value: int, bits: int) -> tuple[float, float]:
    """Return a constant as a multiple of 2**-bits and the rest."""
    head = value >> (BITS - bits)
    return head / (1 << bits), _ratio(value - (head << (BITS - bits)))


def _in_four(value: int) -> tuple[float, ...]:
    """Return a constant as three doubles of 33 digits, which whole numbers multiply exactly."""
    parts = []
    for bits in (32, 65, 98):
        head = value >> (BITS - bits)
        parts.append(head / (1 << bits))
        value -= head << (BITS - bits)
    return *parts, _ratio(value)


def _odd_series(top: int, bottom: int, sign: int, bits: int = BITS) -> int:
    """Return atanh (sign 1) or atan (sign -1) of a ratio, times 2**bits."""
    total, term, k = 0, (abs(top) << bits) // bottom, 0
    while term:
        part = term // (2 * k + 1)
        total += part if sign > 0 or k % 2 == 0 else -part
        term, k = term * top * top // (bottom * bottom), k + 1
    return total if top > 0 else -total


def _log_of(top: int, bottom: int) -> int:
    """Return the logarithm of a ratio near 1, times 2**BITS."""
    return 2 * _odd_series(top - bottom, top + bottom, 1)


FAR_PI = 16 * _odd_series(1, 5, -1, FAR) - 4 * _odd_series(1, 239, -1, FAR)  # Machin
PI = FAR_PI >> (FAR - BITS)
LN2 = 2 * _odd_series(1, 3, 1)


def _roots() -> tuple[tuple[float, float], ...]:
    """Return 2**(j / 32) in two parts."""
    root = 2 << BITS
    for _ in range(5):
        root = math.isqrt(root << BITS)
    rows, value = [], 1 << BITS
    for _ in range(32):
        rows.append(_in_two(value))
        value = value * root >> BITS
    return tuple(rows)


def _logs() -> tuple[tuple[float, float, float], ...]:
    """Return 1 / (j / 64), rounded to nine bits, and minus its logarithm in two parts."""
    rows = []
    for j in range(92):
        near = round(512 * 64 / j) if j > 44 else 512
        rows.append((near / 512, *_cut(-_log_of(near, 512), 42)))
    return tuple(rows)


def _angles() -> tuple[tuple[float, float], ...]:
    """Return atan(j / 16) in two parts."""
    return tuple(_in_two(_odd_series(j, 16, -1) if j < 16 else PI >> 2) for j in range(17))


def _quarters() -> tuple[tuple[float, ...], ...]:
    """Return 2**(24 j - 48) quarter turns of a radian, without whole turns, in parts of 26 bits."""
    ratio, rows = (2 << (2 * FAR)) // FAR_PI, []
    for j in range(46):
        rest, row = ratio % (1 << (FAR + 50 - 24 * j)), []
        rest = (rest << 24 * j) >> 48
        for i in range(6):
            shift = FAR - 24 - 26 * i
            row.append((rest >> shift) / (1 << (24 + 26 * i)))
            rest &= (1 << shift) - 1
        rows.append(tuple(row))
    return tuple(rows)


ROOTS, LOGS, ANGLES, QUARTERS = _roots(), _logs(), _angles(), _quarters()
LOW = tuple(2.0**k for k in range(-31, 32))
HIGH = tuple(2.0 ** (32 * k) for k in range(-33, 32))
GROWTH = tuple(2.0 ** (512 >> j) for j in range(10))
DECAY = tuple(2.0 ** -(512 >> j) for j in range(10))
STEP_HI, STEP_LO = _cut(LN2 >> 5, 37)  # ln 2 / 32
STEPS = _ratio((32 << 2 * BITS) // LN2)
LN2_HI, LN2_LO = _cut(LN2, 42)
PI_HI, PI_LO = _in_two(PI)
HALF_HI, HALF_LO = _in_two(PI >> 1)
QUARTER_1, QUARTER_2, QUARTER_3, QUARTER_4 = _in_four(PI >> 1)
TURNS = _ratio((2 << 2 * BITS) // PI)


# --------------------------------------------------------------------------- pairs
def _sum(a: float, b: float) -> tuple[float, float]:
    """Return a + b and its rounding error."""
    s = a + b
    c = s - a
    return s, (a - (s - c)) + (b - c)


def _after(a: float, b: float) -> tuple[float, float]:
    """Return a + b and its rounding error, if b is not larger than a."""
    s = a + b
    return s, b - (s - a)


def _head(x: float) -> float:
    """Return the upper half of the digits."""
    c = SPLIT * x
    return c - (c - x)


def _product(a: float, b: float) -> tuple[float, float]:
    """Return a * b and its rounding error."""
    p = a * b
    c, d = _head(a), _head(b)
    e, f = a - c, b - d
    return p, ((c * d - p) + c * f + e * d) + e * f


def _ratio_of(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Return (a + b) / (c + d)."""
    q = a / c
    p, e = _product(q, c)
    return q, (((a - p) - e) + b - q * d) / c


def _exponent(x: float) -> int:
    """Return k such that 2**(k - 1) <= x < 2**k, for a normal x."""
    k = 1
    for j in range(5 if 2e-5 < x < 6e4 else 0, 10):
        if x >= GROWTH[j]:
            x, k = x * DECAY[j], k + (512 >> j)
        elif x < 2.0 * DECAY[j]:
            x, k = x * GROWTH[j], k - (512 >> j)
    return k


def _scaled(x: float, k: int) -> float:
    """Return x * 2**k for -1088 < k < 1024; only the last product may round."""
    high = k >> 5 if k >= 0 else -(-k >> 5)
    return x * LOW[k - 32 * high + 31] * HIGH[high + 33]


# --------------------------------------------------------------------------- exp and log
def _exp(x: float, more: float) -> tuple[float, float, float, int]:
    """Return root, rest, part, k: e**(x + more) is root + (rest + root * part), times 2**k."""
    n = x * STEPS + WHOLE - WHOLE
    i = int(n)
    upper = x - n * STEP_HI
    lower = more - n * STEP_LO
    r = upper + lower
    w = r * r
    tail = w * (0.5 + r * 1.6666666666526087e-1 + w * (4.1666666666226079e-2
        + r * 8.3333679843421958e-3 + w * 1.3888949086377719e-3))  # fmt: skip
    j = i & 31
    return ROOTS[j][0], ROOTS[j][1], upper + (lower + tail), i >> 5


def exp(x: float) -> float:
    """Return e**x."""
    if x != x:
        return x
    if x > 709.782712893384:
        return INF
    if x < -745.1332191019412:
        return 0.0
    return _powered(x, 0.0)


def _powered(x: float, more: float) -> float:
    """Return e**(x + more), for -746 < x < 710."""
    root, rest, part, k = _exp(x, more)
    if -900 < k < 1000:  # scaled first, because part is known last
        scale = LOW[(k & 31) + 31] * HIGH[(k >> 5) + 33]
        return root * scale + (rest * scale + root * scale * part)
    h = root + (rest + root * part)
    return _scaled(h, k) if k < 0 else _scaled(h, k - 1000) * 1.0715086071862673e301  # 2**1000


def _log(x: float) -> tuple[float, float]:
    """Return the logarithm of a positive, finite x."""
    shift = 0
    if x < 2.2250738585072014e-308:
        x, shift = x * 18014398509481984.0, -54  # 2**54
    k = _exponent(x)
    m = _scaled(x, -k)
    if m < 0.7071067811865476:
        m, k = 2.0 * m, k - 1
    k = k + shift
    j = int(64.0 * m + 0.5)
    near = LOGS[j][0]
    head = _head(m)
    f, low = _sum(head * near - 1.0, (m - head) * near)  # both terms are exact
    square, error = _product(f, f)
    cube = f * square * (0.3333333333333333 + f * (-0.25 + f * (0.2 + f * (-0.16666666666666666
        + f * (0.14285714285714285 + f * (-0.125 + f * (0.1111111111111111
        + f * -0.1)))))))  # fmt: skip
    h, small = _sum(k * LN2_HI + LOGS[j][1], f)
    h, more = _sum(h, -0.5 * square)
    small = small + more + (low - f * low - 0.5 * error + cube + (k * LN2_LO + LOGS[j][2]))
    return _after(h, small)


def log(x: float) -> float:
    """Return the natural logarithm of x."""
    if not 0.0 < x < INF:
        if x == 0.0:
            return -INF
        return x if x == INF else NAN
    return _log(x)[0]


def power(x: float, y: float) -> float:
    """Return x**y, with the special cases of IEEE 754."""
    if y == 0.0 or x == 1.0:
        return 1.0
    if x != x or y != y:
        return NAN
    if y == 1.0:
        return x
    size = abs(x)
    sign = 1.0
    if math.copysign(1.0, x) < 0.0:
        whole = _whole(y)
        if not whole and x != 0.0 and size < INF and abs(y) < INF:
            return NAN
        if whole and not _whole(0.5 * y):
            sign = -1.0
    if size == 1.0:
        return sign
    if abs(y) > 1e22 or size == 0.0 or size == INF:  # or the logarithm times y is beyond 745
        return sign * INF if (size > 1.0) == (y > 0.0) else sign * 0.0
    if y == 2.0:
        return x * x
    h, small = _log(size)
    p, e = _product(y, h)
    if p > 709.8:
        return sign * INF
    if p < -745.2:
        return sign * 0.0
    return sign * _powered(p, e + y * small)


def _whole(y: float) -> bool:
    """Return whether y is finite and a whole number."""
    size = abs(y)
    if size >= 4503599627370496.0:  # 2**52
        return size < INF
    return (size + 4503599627370496.0) - 4503599627370496.0 == size


# --------------------------------------------------------------------------- circular functions
def _reduced(x: float) -> tuple[int, float, float]:
    """Return the quarter turns in a finite x, from 0 to 3, and the rest of its angle."""
    size = abs(x)
    if size < 0.7853981633974483:
        return 0, x, 0.0
    if size < 500000.0:
        n = size * TURNS + WHOLE - WHOLE
        y, a = _sum(size - n * QUARTER_1, -n * QUARTER_2)
        y, b = _sum(y, -n * QUARTER_3)
        y, more = _after(y, a + b - n * QUARTER_4)
        i = int(n) & 3
    else:
        i, y, more = _reduced_far(size)
    if x < 0.0:
        return -i & 3, -y, -more
    return i, y, more


def _reduced_far(x: float) -> tuple[int, float, float]:
    """Return the same for x > 5e5: the product with 2 / pi, digit by digit, without whole turns."""
    top = (_exponent(x) + 48) // 24
    s0, s1, s2, s3, s4, s5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(4):
        j = max(top - k, 0)
        digit = float(int(_scaled(x, 48 - 24 * j)))
        x = x - _scaled(digit, 24 * j - 48)
        s0 = s0 + digit * QUARTERS[j][0]
        s1 = s1 + digit * QUARTERS[j][1]
        s2 = s2 + digit * QUARTERS[j][2]
        s3 = s3 + digit * QUARTERS[j][3]
        s4 = s4 + digit * QUARTERS[j][4]
        s5 = s5 + digit * QUARTERS[j][5]
    s0 = s0 - 4.0 * (0.25 * s0 + WHOLE - WHOLE)
    n = s0 + s1 + WHOLE - WHOLE
    h, small = s0 - n + s1, 0.0
    h, more = _sum(h, s2)
    small = small + more
    h, more = _sum(h, s3)
    small = small + more
    h, more = _sum(h, s4)
    h, small = _sum(h, small + more + s5)
    y, e = _product(h, HALF_HI)
    y, more = _after(y, e + (h * HALF_LO + small * HALF_HI))
    return int(n) & 3, y, more


def _sine(y: float, more: float) -> tuple[float, float]:
    """Return the sine of y + more, up to an eighth of a turn."""
    w = y * y
    r = 8.33333333332248946124e-03 + w * (-1.98412698298579493134e-04
        + w * (2.75573137070700676789e-06 + w * (-2.50507602534068634195e-08
        + w * 1.58969099521155010221e-10)))  # fmt: skip
    return _after(y, more * (1.0 - 0.5 * w) + w * y * (-1.66666666666666324348e-01 + w * r))


def _cosine(y: float, more: float) -> tuple[float, float]:
    """Return the cosine of y + more, up to an eighth of a turn."""
    w, e = _product(y, y)
    r = w * (4.16666666666666019037e-02 + w * (-1.38888888888741095749e-03
        + w * (2.48015872894767294178e-05 + w * (-2.75573143513906633035e-07
        + w * (2.08757232129817482790e-09 + w * -1.13596475577881948265e-11)))))  # fmt: skip
    h, small = _after(1.0, -0.5 * w)
    return _after(h, small + (w * r - 0.5 * e - y * more))


def _turned(x: float, quarters: int) -> float:
    """Return the sine of x and some quarter turns."""
    if not abs(x) < INF:
        return NAN
    n, y, more = _reduced(x)
    n = n + quarters & 3
    if n == 0:
        return _sine(y, more)[0]
    if n == 1:
        return _cosine(y, more)[0]
    if n == 2:
        return -_sine(y, more)[0]
    return -_cosine(y, more)[0]


def sin(x: float) -> float:
    """Return the sine of x [rad]."""
    return x if abs(x) < 1e-8 else _turned(x, 0)


def cos(x: float) -> float:
    """Return the cosine of x [rad]."""
    return _turned(x, 1)


def tan(x: float) -> float:
    """Return the tangent of x [rad]."""
    if abs(x) < 1e-8:
        return x
    if not abs(x) < INF:
        return NAN
    n, y, more = _reduced(x)
    a, b = _sine(y, more)
    c, d = _cosine(y, more)
    if n & 1:
        a, b, c, d = -c, -d, a, b
    q, e = _ratio_of(a, b, c, d)
    return q + e


def _angle(y: float, low_y: float, x: float, low_x: float) -> tuple[float, float]:
    """Return the angle of a point with 0 <= y <= x > 0."""
    j = int(16.0 * (y / x) + 0.5)
    c = 0.0625 * j
    if j > 0:
        p, e = _product(c, x)
        bottom, rest = _after(x, c * y)
        t, more = _ratio_of(
            (y - p) - e + (low_y - c * low_x), 0.0, bottom, rest + low_x + c * low_y
        )
    else:
        t, more = _ratio_of(y, low_y, x, low_x)
    w = t * t
    tail = w * t * (-0.3333333333333333 + w * (0.2 + w * (-0.14285714285714285
        + w * (0.1111111111111111 + w * -0.09090909090909091))))  # fmt: skip
    h, small = _after(ANGLES[j][0], t)
    return _after(h, small + (ANGLES[j][1] + (more + tail)))


def _full_angle(y: float, low_y: float, x: float, low_x: float) -> float:
    """Return the angle of a point with y >= 0 that is not the origin."""
    size, low = x, low_x
    if x < 0.0:
        size, low = -x, -low_x
    if y <= size:
        h, small = _angle(y, low_y, size, low)
    else:
        h, small = _angle(size, low, y, low_y)
        h, small = _minus(HALF_HI, HALF_LO, h, small)
    if x < 0.0:
        h, small = _minus(PI_HI, PI_LO, h, small)
    return h + small


def _minus(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Return a + b - (c + d)."""
    h, small = _sum(a, -c)
    return _after(h, small + (b - d))


def atan(x: float) -> float:
    """Return the angle [rad] whose tangent is x."""
    if x != x or abs(x) < 1e-8:
        return x
    if abs(x) > 1e17:
        return math.copysign(HALF_HI, x)
    return math.copysign(_full_angle(abs(x), 0.0, 1.0, 0.0), x)


def asin(x: float) -> float:
    """Return the angle [rad] whose sine is x."""
    if not abs(x) <= 1.0:
        return NAN
    if abs(x) < 1e-8:
        return x
    c, d = _leg(x)
    return math.copysign(_full_angle(abs(x), 0.0, c, d), x)


def acos(x: float) -> float:
    """Return the angle [rad] whose cosine is x."""
    if not abs(x) <= 1.0:
        return NAN
    c, d = _leg(x)
    return _full_angle(c, d, x, 0.0)


def _leg(x: float) -> tuple[float, float]:
    """Return sqrt(1 - x**2), for abs(x) <= 1."""
    p, e = _product(x, x)
    h, small = _after(1.0, -p)
    h, small = _after(h, small - e)
    if h == 0.0:
        return 0.0, 0.0
    return _root(h, small)


def _root(a: float, b: float) -> tuple[float, float]:
    """Return the square root of a + b > 0."""
    r = math.sqrt(a)
    p, e = _product(r, r)
    return r, ((a - p) - e + b) / (2.0 * r)


def atan2(y: float, x: float) -> float:
    """Return the angle [rad] of a point, from -pi to pi, with the special cases of IEEE 754."""
    if x != x or y != y:
        return NAN
    size, other = abs(y), abs(x)
    turned = math.copysign(1.0, x) < 0.0
    if size == 0.0:
        return math.copysign(PI_HI, y) if turned else y
    if size == INF:
        if other == INF:
            return math.copysign(2.356194490192345 if turned else 0.7853981633974483, y)
        return math.copysign(HALF_HI, y)
    if other == INF:
        return math.copysign(PI_HI if turned else 0.0, y)
    if other == 0.0:
        return math.copysign(HALF_HI, y)
    if not turned and size / other < 1e-8:
        return y / x
    if max(size, other) < 1e-280:  # no product of them may lose digits
        size, x = size * 4.149515568880993e180, x * 4.149515568880993e180  # 2**600
    elif max(size, other) > 1e280:
        size, x = size * 2.409919865102884e-181, x * 2.409919865102884e-181
    return math.copysign(_full_angle(size, 0.0, x, 0.0), y)


# --------------------------------------------------------------------------- hyperbolic functions
def sinh(x: float) -> float:
    """Return (e**x - e**-x) / 2."""
    size = abs(x)
    if size < 0.5:
        if size < 1e-8:
            return x
        w = x * x
        return x + x * w * (0.16666666666666666 + w * (0.008333333333333333
            + w * (0.0001984126984126984 + w * (2.7557319223985893e-06
            + w * (2.505210838544172e-08 + w * (1.6059043836821613e-10
            + w * 7.647163731819816e-13))))))  # fmt: skip
    if not size <= LARGEST:
        return x * INF
    a, b = _grown(size)
    if size < 22.0:
        c, d = _grown(-size)
        a, b = _minus(a, b, c, d)
    return math.copysign(a, x)


def cosh(x: float) -> float:
    """Return (e**x + e**-x) / 2."""
    size = abs(x)
    if size < 0.5:
        w, e = _product(x, x)
        h, small = _after(1.0, 0.5 * w)
        tail = w * w * (0.041666666666666664 + w * (0.001388888888888889
            + w * (2.48015873015873e-05 + w * (2.755731922398589e-07
            + w * (2.08767569878681e-09 + w * (1.1470745597729725e-11
            + w * 4.779477332387385e-14))))))  # fmt: skip
        return h + (small + (0.5 * e + tail))
    if not size <= LARGEST:
        return size * INF
    a, b = _grown(size)
    if size < 22.0:
        c, d = _grown(-size)
        a, b = _minus(a, b, -c, -d)
    return a


def _grown(x: float) -> tuple[float, float]:
    """Return e**x / 2."""
    root, rest, part, k = _exp(x, 0.0)
    h, small = _after(root, rest + root * part)
    return 2.0 * _scaled(h, k - 2), 2.0 * _scaled(small, k - 2)


def tanh(x: float) -> float:
    """Return sinh(x) / cosh(x)."""
    size = abs(x)
    if size < 0.0625:
        if size < 1e-8:
            return x
        w = x * x
        return x + x * w * (-0.3333333333333333 + w * (0.13333333333333333
            + w * (-0.05396825396825397 + w * (0.021869488536155203
            + w * (-0.008863235529902197 + w * 0.003592128036572481)))))  # fmt: skip
    if not size < 22.0:
        return x if x != x else math.copysign(1.0, x)
    a, b = _grown(2.0 * size)
    top, low = _minus(a, b, 0.5, 0.0)
    bottom, more = _minus(a, b, -0.5, 0.0)
    q, e = _ratio_of(top, low, bottom, more)
    return math.copysign(q + e, x)


def asinh(x: float) -> float:
    """Return the number whose sinh is x."""
    size = abs(x)
    if not size < INF or size < 1e-8:
        return x
    if size < 0.002:
        w = x * x
        return x + x * w * (-0.16666666666666666 + w * (0.075 + w * -0.044642857142857144))
    if size > 268435456.0:
        h, small = _log(size)
        h, small = _minus(h, small, -LN2_HI, -LN2_LO)
        return math.copysign(h + small, x)
    w, e = _product(size, size)
    h, small = _sum(1.0, w)
    h, small = _after(h, small + e)
    r, e = _root(h, small)
    h, small = _sum(r, size)
    a, b = _log(h)
    return math.copysign(a + (b + (small + e) / h), x)
