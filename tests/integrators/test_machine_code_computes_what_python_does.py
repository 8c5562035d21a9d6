"""Translated functions compute what Python computes, to the last bit, through LLVM and through C99.

Each function below uses a part of the subset. Random arguments come from a seed that is printed
when a comparison fails.
"""

import ctypes
import linecache
import math
import re
import shutil
import struct
import subprocess
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest

pytest.importorskip("llvmlite")

from integrators import elementary
from integrators.elementary import asinh, atan, atan2, cos, exp, log, power
from integrators.machine_code import llvm, objects, tuning
from integrators.machine_code.c99 import c99_text
from integrators.machine_code.front_end.translate import HostFunction, TranslationError, Translator
from integrators.machine_code.front_end.values import ArrayValue, NumberValue
from integrators.machine_code.layout import BlockLayout, MemoryBlock, OuterArray
from integrators.machine_code.llvm import llvm_text
from integrators.machine_code.script.javascript import javascript_text, library_text
from integrators.machine_code.tree import Const, Local
from integrators.machine_code.tuning import INLINE
from integrators.runners import edition
from integrators.step_size import retry_factor
from tests.soak.platforms import CLibrary

SIZE = 5
INFINITY = float("inf")
WEIGHTS = (0.25, -1.5, 3.0, 0.125, 7.0)
ROWS = ((1.0,), (2.0, 3.0), (4.0, 5.0, 6.0))


class Pair(NamedTuple):
    first: list[float]
    second: list[float]


@dataclass(slots=True, eq=False)
class State:
    t: float
    count: int
    on: bool
    x: list[float]


class Given(NamedTuple):
    x: list[float]
    y: list[float]
    i: list[int]
    flags: list[bool]
    table: list[list[float]]
    out: list[float]
    whole: list[int]
    scale: float
    count: int
    state: State


class Window(NamedTuple):
    part: list[float]
    factor: float
    count: int


def arithmetic(g):
    for j in range(len(g.out)):
        a, b = g.x[j], g.y[j]
        g.out[j] = (a + b) * 3 - a / b + -a * g.scale
    return 0


def conversions(g):
    for j in range(len(g.out)):
        g.out[j] = int(g.x[j] * 10.0) / 3 + g.i[j] * 2 + abs(g.i[j]) - abs(g.x[j])
        g.whole[j] = g.i[j] // 3 + g.i[j] % 4 + (g.i[j] & 6 | 1) + (g.i[j] ^ 5) + (g.count << 2)
    return g.whole[0]


def choices(g):
    for j in range(len(g.out)):
        a, b = g.x[j], g.y[j]
        low = min(a, b, 0.5)
        high = max(a, float(g.i[j]))
        g.out[j] = low if a < b else high
        if 0.0 < a <= 1.0:
            g.out[j] += 1.0
        elif not (g.flags[j] or a == b) and g.i[j] in (1, 2, 3):
            g.out[j] -= 1.0
        else:
            g.out[j] = -g.out[j]
    return 0


def undefined(g):
    for j in range(len(g.out)):
        zero = g.x[j] - g.x[j]
        nan = zero / zero
        g.out[j] = min(nan, 1.0) if nan != nan else 2.0
        g.whole[j] = 1 if nan < 1.0 or not nan >= 1.0 else 0
        g.out[j] += 1.0 / zero if g.x[j] > 0.0 else -INFINITY
    return 0


def functions(g):
    for j in range(len(g.out)):
        u = abs(g.x[j]) + 0.1
        a = exp(-u) + log(u) + elementary.sin(g.x[j]) + cos(g.y[j]) + elementary.tanh(g.x[j])
        g.out[j] = a + atan(u) + asinh(u) + math.sqrt(u) + power(u, 0.5) + power(u, 2.0)
    return 0


def loops(g):
    total, steps = 0.0, 0
    while True:
        steps += 1
        if steps % 3 == 0:
            continue
        if steps > 20:
            break
        for j in range(1, len(g.x), 2):
            total += g.x[j] * steps
            if total > 50.0:
                break
    for u in g.y[: g.count]:
        total -= u
    while total > g.scale and steps < 100:
        total *= 0.5
        steps += 1
    g.out[0] = total
    return steps


def both_of(a, b):
    if a < b:
        return a, b
    return b, a


def turned(pair, scale):
    return Pair(pair.second, pair.first)


def window(g, count):
    factor = 2.0 * g.scale
    return Window(g.x[:count], factor, count)


def longer(g):
    count = 0
    for j in range(len(g.flags)):
        if g.flags[j]:
            count += 1
    return window(g, count)


def records(g):
    pair = turned(Pair(g.x, g.y), g.scale)
    first, second = pair
    low, high = both_of(first[0], second[1])
    g.out[0] = low - 2.0 * high
    w = longer(g)
    if g.flags[0]:
        w = window(g, 1)
    for u in w.part:
        g.out[1] += u * w.factor
    for j in (0, 2):
        g.out[j] += second[j]
    g.out[3], g.out[4] = g.out[4], g.out[3]
    return len(w.part) + w.count


def advanced(state, h):
    state.t += h
    state.count += 1
    state.on = not state.on
    return state.count


def fields(g):
    """Numbers of a dataclass are changed in place, whatever name it has."""
    state, whole = g.state, g.whole
    before = state.t
    pair = (state.t, state.count)
    g.out[0] = before - advanced(state, g.scale) * state.t
    whole[state.count % 5] = g.state.count
    state.t, state.x[0] = state.x[0], state.t
    state.count = whole[1] = 3 if state.on else advanced(g.state, 0.5)
    g.out[1] = before + pair[0] + pair[1]
    for j in range(len(state.x)):
        state.x[j] = state.x[j] - state.t
    return state.count


def tables(g):
    for r in range(len(g.table)):
        row = g.table[r]
        for c in range(len(row)):
            row[c] = row[c] * WEIGHTS[c] + ROWS[r][0]
        g.out[r] = row[-1]
        picked = ROWS[r] if r < 2 else WEIGHTS
        g.out[r] += picked[0]
    g.whole[-1] |= 12
    g.whole[0] = g.whole[1] = 7
    return 0


def applied(f, x, out):
    for j in range(len(x)):
        out[j] = f(x[j], j)


def scaled(u, j):
    return u * j


def passed(g):
    applied(scaled, g.x, g.out)
    return 0


def lengths(g):
    """A variable has its present length where it is read, also before its last assignment."""
    part, total = g.x, 0
    for j in range(4):
        total = 10 * total + len(part)
        part = g.x[:j]
        if j == 1:
            part = g.y
    w = Window(g.x, 1.0, 2)
    for j in range(3):
        g.out[j] += w.factor * w.part[0] + len(w.part)
        w = Window(g.y[: j + 1], -0.0, j)
        if j > 0:
            w = Window(g.x, g.scale, 5)
    return total + w.count


def signs_of(zero, out, j):
    out[j] = 1.0 / (zero if zero < 0.0 else atan2(zero, -1.0))


def zeros(g):
    """The two zeros are two constants."""
    signs_of(0.0, g.out, 0)
    signs_of(-0.0, g.out, 1)
    w = Window(g.x, 0.0, 0)
    if g.flags[0]:
        w = Window(g.x, -0.0, 0)
    g.out[2] = atan2(w.factor, -1.0)
    return 0


def longer_of(g, j):
    if j > 1:
        return g.x, 2
    if j > 0:
        return g.y, 1.5
    return g.x[:j], 0.0


def returns(g):
    """What is returned may be one or the other."""
    total = 0
    for j in range(3):
        part, factor = longer_of(g, j)
        both = longer_of(g, 2 - j)
        total = 10 * total + len(part) + len(both[0])
        for u in part:
            g.out[j] += u * factor - both[1]
    return total


def now_and_later(g):
    """What was read stays as it was."""
    g.whole[0], g.whole[1] = 1, 0
    row = g.table[g.whole[0]]
    w = (g.whole[0], row[0])
    g.whole[0] = 2
    g.out[0] = row[1] + w[0] + w[1]
    head = first_of(g.x, g.whole[0])
    g.whole[0] = 4
    last = 0
    for j in (1, 2, 3):
        if g.i[j] > 0:
            last = j
            found = 2 * j
            g.out[1] += found
    a, b = g.x, g.y
    for j in range(3):
        a, b = b, a
        g.out[2] += a[j] - 2.0 * b[j]
    return 100 * len(head) + last


def first_of(x, count):
    return x[:count]


def raised(g):
    g.whole[2] += 1
    return g.whole[2]


def once(g):
    """Calls happen once, in their order."""
    g.whole[2] = 0
    inside = 0 <= raised(g) < 2 and g.i[0] < 3
    g.x[raised(g)] = g.y[g.whole[2] - 2]
    g.whole[raised(g) - 3] = raised(g) - g.whole[2]
    if raised(g) in (1, 5, 6):
        g.out[0] = 1.0
    return g.whole[2] + inside


def last_turn(g, i):
    for j in range(g.count):
        g.out[j] += 1.0
    for i in range(3):
        g.out[i] += 1.0
    for i in range(2, 2):
        g.out[i] += 1.0
    for k in range(0, 5, 2):
        if g.flags[k]:
            break
    g.out[i] = 7.0
    g.out[k] -= 8.0
    return i


def after_loops(g):
    """A loop's variable keeps its last value."""
    return last_turn(g, g.count) + 10 * last_turn(g, 0)


def which_one():
    return scaled


def truth(g):
    """Truth values are integers where integers are asked for; constants are computed before."""
    if SIZE:
        g.whole[0] = -g.flags[0] + min(g.flags[1], g.flags[2]) + 2**3
    g.whole[1] = (g.flags[0] & g.flags[1]) + (g.flags[2] | g.flags[3]) + int(g.flags[4])
    g.out[0] = which_one()(g.x[0], 3) + math.nextafter(g.y[0], 1.0)
    count = 0
    while len(first_of(g.x, count)) < 3:
        count += 1
    return len(g) + count


def beside(g):
    """Turns that are lanes: branches, sums in order, division where it is wanted only."""
    found, total, largest = False, 0.0, g.scale
    for j in range(len(g.out)):
        found = found or g.i[j] > 7 or (g.flags[j] and g.x[j] > 3.0)
    b = g.scale
    for j in range(len(g.out)):
        a, b = g.x[j], g.scale
        if g.i[j] > 0:
            b = a
        elif g.i[j] & 1 == 0:
            share = g.scale * g.y[j]
            b = g.scale - a / share
            g.out[j] = -share
        if not (g.flags[j] or a >= b):
            g.out[j] = min(b, -a) if a < 0.5 else max(b, g.y[j], 0.5)
        total += abs(a) * b - math.sqrt(abs(b))
        g.table[1][j] = math.copysign(b, g.y[j])
    for j in range(len(g.out)):
        largest = max(largest, g.x[j])
    g.table[0][0] = total + largest + b  # of the last turn
    return 1 if found else 0


def neighbours(g):
    """Turns that follow one another: they read or write what another one does."""
    before = 0.0
    for j in range(len(g.out)):
        g.out[j] += before
        before = g.x[j]
    for j in range(4):
        g.table[0][j + 1] = g.table[0][j] + 1.0
    for j in range(4):
        g.table[1][j] = g.table[1][j + 1] + 1.0
    for j in range(4):
        g.table[2][j] = g.table[2][2] + g.x[j]
    for j in range(4):
        g.out[j] += g.scale
        g.out[j + 1] *= g.scale
    for j in range(4):
        if g.flags[j]:
            before += g.x[j]
        g.out[j] = g.out[j] + before
    return 0


def shifted(g):
    """Turns that may write what the next ones read, which only a run knows."""
    n, by = len(g.out), g.count % 2
    for j in range(n - by):
        if g.x[j] > 0.0:
            g.out[by + j] = g.out[j] + 1.0
    for j in range(g.count, n):
        if g.x[j] > 0.0:
            g.out[j] = g.out[j] * g.scale
        g.table[0][0] += g.y[j]
    total = 0.0
    for j in range(n - 1):
        if g.flags[j]:
            g.table[1][j + 1] = g.table[1][j] + 1.0
        total += g.table[1][j]
    g.table[2][0] = total
    return 0


def of_branches(g):
    """What a branch has set is read later: after the loop, or in another turn of an outer one."""
    hit, b, total = False, g.scale, 0.0
    for j in range(len(g.out)):
        g.out[j] = -g.x[j]
        if g.x[j] > 1.0:
            hit = True
            b = g.x[j]
    for k in range(3):
        total += b
        for j in range(5):
            if g.flags[j]:
                b = g.y[j] * k
            g.table[0][j] = g.x[j] + total
    g.table[1][0] = total + b
    return 1 if hit else 0


def following(a, b, n):
    for j in range(4):
        b[j + 1] = a[j] + 1.0
    for j in range(n):
        b[j] = -a[j] if a[j] > 0.0 else a[j] * a[0]


def share(n, k):
    return n // k


def in_place(g):
    """Arrays of two names that are one, and places that depend on what is written."""
    following(g.out, g.out, len(g.out))
    following(g.x, g.table[0], 5)
    a = g.y if g.count > 2 else g.table[1]
    for j in range(4):
        g.table[1][j + 1] = a[j] * 0.5
    row = g.table[g.count % 3]
    for j in range(5):
        row[j] = g.x[j] * g.table[1][2]
    g.table[2][0] = 0.0
    for j in range(4):
        if g.flags[j] or not g.flags[j]:
            g.table[2][j + int(g.table[2][0])] = 1.0
    return 0


def asked_first(g):
    """What cannot be computed is not, where it is asked for only if it can."""
    none, found = g.count - g.count, False
    for j in range(5):
        found = found or (g.x[j] > 1e3 and share(7, none) > 1)
        if g.x[j] > 1e3:
            g.out[7 // none + j] = 1.0
        g.out[j] = float(share(7, none)) if g.x[j] > 1e3 else g.x[j]
    return 1 if found else 0


CASES = [
    beside, neighbours, shifted, of_branches, in_place, asked_first,
    arithmetic, conversions, choices, undefined, functions, loops, records, fields, tables, passed,
    lengths, zeros, returns, now_and_later, once,
    after_loops, truth,
]  # fmt: skip


def given(seed: int) -> Given:
    """Return random arguments as lists."""
    rng = np.random.default_rng(seed)
    return Given(
        x=rng.normal(0.0, 2.0, SIZE).tolist(),
        y=rng.normal(0.0, 2.0, SIZE).tolist(),
        i=rng.integers(-9, 9, SIZE).tolist(),
        flags=rng.integers(0, 2, SIZE).astype(bool).tolist(),
        table=rng.normal(0.0, 2.0, (3, SIZE)).tolist(),
        out=rng.normal(0.0, 2.0, SIZE).tolist(),
        whole=rng.integers(-9, 9, SIZE).tolist(),
        scale=float(rng.normal()),
        count=int(rng.integers(0, SIZE)),
        state=State(float(rng.normal()), 7, bool(rng.integers(0, 2)), rng.normal(size=2).tolist()),
    )


def plainly(function, arguments: Given) -> int:
    """Call a function as Python, with numbers that do not raise."""
    with np.errstate(all="ignore"):
        wide = Given(*([np.float64(u) for u in part] if name in ("x", "y") else part
                       for name, part in zip(Given._fields, arguments, strict=True)))  # fmt: skip
        result = function(wide)
    for name in ("x", "y"):
        getattr(arguments, name)[:] = [float(u) for u in getattr(wide, name)]
    return int(result)


def bits(arguments: Given) -> list[bytes]:
    """Return all arrays bit for bit."""
    state = arguments.state
    numbers = [state.t, state.count, state.on, *state.x]
    parts = [arguments.out, *arguments.table, arguments.whole, numbers]
    return [struct.pack(f"<{len(p)}d", *map(float, p)) for p in parts]


def module_of(functions, inside: bool):
    layout = BlockLayout(given(0), callable, inside=inside)
    translator = Translator()
    for each in functions:
        translator.entry(f"entry_{each.__name__}", each, [layout.value])
    return layout, translator.module


def called(address):
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)(address)


def in_llvm(module):
    return objects.Library(objects.compiled(llvm_text(module)))


def in_c(module, folder):
    (folder / "text.c").write_text(c99_text(module))
    command = ["cc", "-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wno-unused", "-Werror",
               "-fPIC", "-shared", "text.c", "-o", "text.so", "-lm"]  # fmt: skip
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return CLibrary(bytes(folder / "text.so"))


OTHERS = ("llvm, outside", "c99", "c99, outside")


@pytest.fixture(
    scope="module",
    params=["llvm", *(pytest.param(each, marks=pytest.mark.slow) for each in OTHERS)],
)
def made(request, tmp_path_factory):
    """All functions, compiled together; their arrays inside the block of arguments, or not."""
    printer, _, outside = request.param.partition(", ")
    if printer == "c99" and shutil.which("cc") is None:
        pytest.skip("there is no C compiler")
    layout, module = module_of(CASES, not outside)
    folder = tmp_path_factory.mktemp("c")
    return layout, in_llvm(module) if printer == "llvm" else in_c(module, folder)


@pytest.mark.parametrize("function", CASES, ids=lambda each: each.__name__)
def test_same_bits(function, made):
    layout, library = made
    call = called(library.address(f"entry_{function.__name__}"))
    for seed in range(40):
        expected = given(seed)
        result = plainly(function, expected)
        block = MemoryBlock(layout, given(seed))
        block.update(block.contents)
        assert call(block.address) == result, f"given({seed})"
        assert bits(block.contents) == bits(expected), f"given({seed})"


def test_turns_that_do_not_follow_one_another_are_lanes_of_vectors():
    for function, lanes in ((beside, True), (neighbours, False)):
        _, module = module_of([function], inside=True)
        assert ("store <4 x double>" in llvm_text(module)) == lanes


def flow(x, dy):
    dy[0] = x[4]
    for j in range(4):
        dy[1 + j] = 2.0 * x[j]


def by_number(x, dy):
    dy[0] = x[4]


def take_step(g, slope):
    slope(g.x, g.out)
    for j in range(5):
        g.table[0][j] = g.out[j]
    return 0


def with_flow(g):
    return take_step(g, flow)


def without_flow(g):
    return take_step(g, by_number)


def test_a_step_reads_side_by_side_what_its_flow_has_stored_so():
    for function, kinds in (
        (with_flow, ["double", "<4 x double>"]),
        (without_flow, ["double"] * 5),
    ):
        text = llvm_text(module_of([function], inside=True)[1])
        step = text[text.index(" @take_step(") :]
        assert (
            re.findall(r"store (\S*(?: x )?double>?) %t\d+, ptr %t", step.partition("}")[0])
            == kinds
        )


def test_c_text_leaves_out_what_nobody_reads():
    def forgets(g):
        left = cos(g.x[0]) + 1.0  # noqa: F841  # a compiler would warn
        return g.count

    _, module = module_of([forgets], True)
    assert "cos" not in c99_text(module).partition(" forgets(")[2]


def asks(g):
    for j in range(len(g.out)):
        g.out[j] = signal(g.x[j]) + 1.0
    return 0


signal = HostFunction(0)


def test_a_host_function_is_called():
    layout, module = module_of([asks], True)
    library = in_llvm(module)
    thunk = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(lambda t: 3.0 * t)
    place = ctypes.c_void_p.from_address(library.variable("callbacks"))
    place.value = ctypes.cast(thunk, ctypes.c_void_p).value
    block = MemoryBlock(layout, given(1))
    block.update(block.contents)
    called(library.address("entry_asks"))(block.address)
    assert block.contents.out.tolist() == [3.0 * u + 1.0 for u in given(1).x]


@pytest.mark.parametrize("new", ["u - 1.0", "u + 2.0", "abs(u)"])
def test_a_text_that_has_changed_since_it_was_loaded_is_refused(new, tmp_path, monkeypatch):
    path = tmp_path / "changed.py"
    path.write_text("def function(u):\n    return u + 1.0\n")
    names = {}
    exec(compile(path.read_text(), str(path), "exec"), names)
    assert Translator().translated(names["function"], [NumberValue(Local("f", "u"))]).slots
    path.write_text(f"def function(u):\n    return {new}\n")
    linecache.checkcache()
    linecache.cache.pop(str(path), None)
    with pytest.raises(TranslationError, match="has changed since it was loaded"):
        Translator().translated(names["function"], [NumberValue(Local("f", "u"))])


def columns_of(column, factor):
    total = 0.0
    for j in range(len(column)):
        total += column[j] * factor
    column[0] = total
    return len(column)


def test_a_column_may_change_between_calls():
    example = (OuterArray(), 2.0)
    layout = BlockLayout(example, callable)
    translator = Translator()
    translator.entry("entry", columns_of, list(layout.value.fields.values()))
    library = in_llvm(translator.module)
    call = called(library.address("entry"))
    block = MemoryBlock(layout, example)
    for length in (3, 10):
        column = np.arange(1.0, length + 1.0)
        total = 2.0 * column.sum()
        block.update((column, 2.0))
        assert call(block.address) == length
        assert column[0] == total
    assert library


def test_many_blocks_are_one_after_the_other():
    layout = BlockLayout(given(0), callable, inside=True)
    translator = Translator()
    entry = translator.entry("entry", arithmetic, [layout.value])
    translator.for_each("each", entry, layout.words)
    library = in_llvm(translator.module)
    blocks = [MemoryBlock(layout, given(seed)) for seed in (1, 2, 3)]
    for block in blocks:
        block.update(block.contents)
    memory = np.concatenate([block.words for block in blocks])
    call = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
    assert call(library.address("each"))(memory.ctypes.data, len(blocks)) == 0
    for seed, (block, words) in enumerate(zip(blocks, np.split(memory, len(blocks)), strict=True)):
        block.words[:] = words
        expected = given(seed + 1)
        plainly(arithmetic, expected)
        assert bits(block.contents) == bits(expected)


def test_numbers_of_a_dataclass_are_words_of_the_block():
    layout, arguments = BlockLayout(given(0), callable), given(1)
    block = MemoryBlock(layout, arguments)
    state = block.contents.state
    assert [state.t, state.count, state.on] == [arguments.state.t, 7, arguments.state.on]
    state.t, state.count = 0.5, 8
    k = layout.offset("state.t")
    assert (block.words[k : k + 1].view(float)[0], block.words[k + 1]) == (0.5, 8)
    assert dict(block.set_words())[k] == 0.5
    copy = MemoryBlock(layout, arguments, block)
    copy.contents.state.t = 1.5
    assert (state.t, copy.contents.state.count) == (0.5, 8)


def test_a_block_takes_over_arrays_that_are_outside():
    layout = BlockLayout(given(0), callable, inside=False)
    block, other = MemoryBlock(layout, given(1)), MemoryBlock(layout, given(2))
    other.become(block)
    assert bits(other.contents) == bits(block.contents)
    other.contents.out[0] += 1.0
    assert bits(other.contents) != bits(block.contents)


def test_a_column_of_a_dataclass_is_replaced():
    example = (State(0.0, 0, False, OuterArray()),)
    block = MemoryBlock(BlockLayout(example, callable), example)
    (state,) = block.contents
    state.x = np.arange(3.0)
    block.update(block.contents)
    other = MemoryBlock(block.layout, example, block)
    assert other.contents[0].x is state.x
    other.become(MemoryBlock(block.layout, example))
    assert other.contents[0].x.size == 0


# --------------------------------------------------------------------------- what is refused
def unknown_statement(g):
    raise ValueError(g.count)


def unknown_call(g):
    g.out[0] = round(g.x[0])
    return 0


def unknown_name(g):
    g.out[0] = nowhere  # noqa: F821
    return 0


def wrong_kind(g):
    g.whole[0] = g.x[0]
    return 0


def wrong_field(g):
    g.state.count = g.scale
    return 0


def no_dataclass(g):
    g.scale = 1.0
    return 0


def own_variable(g):
    for j in range(3):
        j = j + 1
    return 0


def no_value(g):  # noqa: RET503
    if g.count > 3:
        return 0
    g.out[0] = 1.0


def two_kinds(g):
    w = Pair(g.x, g.y)
    w = Window(g.x, 1.0, 2)
    return w.count


def two_results(g):
    if g.count > 3:
        return g.x
    return g.count


@pytest.mark.parametrize(
    ("function", "line"),
    [
        (unknown_statement, "raise ValueError(g.count)"),
        (unknown_call, "g.out[0] = round(g.x[0])"),
        (unknown_name, "g.out[0] = nowhere  # noqa: F821"),
        (wrong_kind, "g.whole[0] = g.x[0]"),
        (wrong_field, "g.state.count = g.scale"),
        (no_dataclass, "g.scale = 1.0"),
        (own_variable, "for j in range(3):"),
        (no_value, "def no_value(g):  # noqa: RET503"),
        (two_kinds, "w = Window(g.x, 1.0, 2)"),
        (two_results, "return g.count"),
    ],
    ids=lambda each: getattr(each, "__name__", None),
)
def test_an_error_names_the_line(function, line):
    with pytest.raises(TranslationError) as caught:
        module_of([function], True)
    assert caught.value.line == line
    number = function.__code__.co_firstlineno
    lines = [f"line {number + k}, in {function.__name__}" for k in range(4)]
    assert any(caught.value.place.endswith(each) for each in lines)


REFUSED = {
    "a = applied(scaled, g.x, g.out)": "the function returns nothing",
    "a = [g.scale]": "this expression is not part of the subset",
    "a = -g.x": "g.x is not a number",
    "a = g.x + 1.0": "g.x is not a number",
    "a = g.x[g.scale]": "g.scale is not an integer",
    "g.out[0] = a; a = 1.0": "a is read before it is assigned",
    "a = g.nothing": "there is no nothing",
    "a = g.scale[0]": "g.scale is not an array",
    "a = g.x[1:]": "only the first entries of an array",
    "a = g.scale ** 2": "a power of floats is not part of the subset: call elementary.power",
    "a = g.count ** 2": "a power of integers is not part of the subset",
    "a = g.scale @ g.scale": "this operator is not part of the subset",
    "a = g.scale % 2.0": "% is for integers only",
    "a = g.count // 0": "division by zero",
    "a = g.count is g.count": "this comparison is not part of the subset",
    "a = g.flags[0] and len(first_of(g.x, 2)) > 1": "after and and or only plain expressions",
    "a = first_of(g.x, 2) if g.flags[0] else g.y": "the alternatives must be plain expressions",
    "a = g.x if g.flags[0] else 1.0": "the alternatives differ in kind",
    "a = g.x(1)": "g.x is not a function",
    "a = min(g.scale, key=1)": "arguments are given by place",
    "a = min(g.x, 1.0)": "the function takes numbers",
    "a = len(g.scale)": "a number has no length",
    "a = Pair(g.x)": "Pair takes first, second",
    "a = scaled(g.scale)": "it takes 2 arguments, not 1",
    "for u in g.scale: pass": "a loop goes over a range or over an array of numbers",
    "for j in range(5, 0, -1): pass": "the step of a range must be a positive constant",
    "for j in range(3): pass\n    for j in g.x: pass": "j would be of two kinds",
    "j = 1.0\n    for j in range(3): pass": "j would be of two kinds",
    "for u in (1, 2): break": "a loop over a tuple cannot be left",
    "a, b = g.scale": "only tuples can be unpacked",
    "a, b = 1, 2, 3": "the numbers of names and values differ",
    "g.out[0] += raised(g)": "call the function first",
    "g.out[0] = g.x": "an entry or a field is a number",
    "if g.flags[0]: return": "the function returns a value or nothing",
    "if g.flags[0]: return g.x if g.flags[1] else g.y": "is an array and a number",
}


@pytest.mark.parametrize(("text", "reason"), REFUSED.items())
def test_what_is_outside_the_subset_is_refused(text, reason, tmp_path):
    path = tmp_path / "refused.py"
    path.write_text(f"def function(g):\n    {text}\n    return 0\n")
    names = dict(globals())
    exec(compile(path.read_text(), str(path), "exec"), names)
    with pytest.raises(TranslationError, match=re.escape(reason)):
        module_of([names["function"]], True)


def test_javascript_refuses_what_it_cannot_call_or_address():
    with pytest.raises(ValueError, match="cannot call a function of the host program"):
        javascript_text(module_of([asks], True)[1])
    with pytest.raises(ValueError, match="no address within a word"):
        javascript_text(module_of([truth], True)[1])  # a truth value has one byte


def stepped(u, v):
    return math.nextafter(u, v) + int(u > v)


def test_javascript_has_integers_of_truth_values_and_neighbours():
    text = library_text({"stepped": stepped})
    assert "nextafter(u, v) + ((u > v ? 1 : 0) + 0)" in text
    assert "function nextafter(" in text


def test_what_is_said_of_functions_by_name_is_said_of_functions_that_exist():
    """Those of the loop are in its modules, the others in every generated program."""
    known = {name for module in edition.LOOPS for name in vars(module)}
    program = {"arm", "flow", "flow_live", "jolts", "normal", "observe", "switch", "tick"}
    assert INLINE.keys() - (known - program) == program
    assert known | program | {"margins"} >= tuning.DISTINCT | tuning.IN_ROWS


def test_functions_are_put_inline_as_said_but_not_long_ones(monkeypatch):
    def text(inline):
        translator = Translator({"retry_factor": inline})
        given = [NumberValue(Local("f", "e")), NumberValue(Local("i", "order"))]
        translator.entry("entry", retry_factor, given)
        return llvm_text(translator.module)

    for inline, mark in ((True, "alwaysinline"), (False, "noinline")):
        said = text(inline)
        assert said.count(mark) == 1
        assert "@retry_factor(double" in said[: said.index(mark)].splitlines()[-1]
    monkeypatch.setattr(llvm, "LONGEST", 3)
    assert "inline" not in text(True)


def half(x, _ignored):
    return 0.5 * x


def halves(a):
    return half(a[0], half) + half(a[1], halves)


def test_equal_statements_are_compiled_once():
    """The types of arguments may differ where the statements do not depend on them."""
    translator = Translator()
    translator.entry("entry", halves, [ArrayValue("f", (Const("i", 2),), Local("p", "a"))])
    assert [each.name for each in translator.module.functions] == ["half", "halves", "entry"]
