"""What follows from the numbers of a system, as text: printed from its plan, as a program is.

Bends of its curves, scales, entries of default states, and tolerances where no scale is known. An
export runs this text when a number changes; `gms_fsm.run.problem` runs the same text.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import FunctionType
from typing import Any, NamedTuple

from gms_fsm.charts.stribeck import GAUSSIAN, dip_of, flat_of
from gms_fsm.foundation.text import visible
from gms_fsm.language import Number, Value, names_in, renamed, spell
from gms_fsm.lowering.generated import SIGNALS, CarefulText, ieee, load
from gms_fsm.lowering.printing.lines import CodeLine, indented
from gms_fsm.lowering.printing.lock_functions import LockFunctions
from gms_fsm.lowering.printing.names import ENDLESS, computed_names
from gms_fsm.lowering.printing.plan import ProgramPlan
from gms_fsm.lowering.printing.scale_text import HELPERS, scale_text
from gms_fsm.systems.reading.assembly import CURVE_LOAD, Bank, of
from gms_fsm.systems.signals import Function
from gms_fsm.systems.system import LEAST_LOAD
from integrators.loop import ASK, JUMPING, START, Buffers
from integrators.steps import Vector

FUNCTIONS = ("bend", "scale", "enter", "raise_floor")
# The default absolute tolerance is rtol times the scale times this: near zero, a component is as
# accurate as at a tenth of its scale.
SHARE = 0.1
LOOKS = (0.0, 0.13, 0.5, 1.0)  # parts of a run at which its forces are looked at
ROUNDED = 1e-15  # of the largest motion: a few units in its last place
LIMIT = math.sqrt(ENDLESS)  # where locks contradict each other a force has no limit


# --------------------------------------------------------------------------- the text
def _text(plan: ProgramPlan) -> str:
    printer = _AdaptingPrinter(plan)
    lines = [f"# What follows from the numbers of {visible(plan.title)}", printer.marks]
    for k, bank in enumerate(plan.read.banks):
        own = frozenset(n for n in bank.chart.parameter_names if of(bank.name, n) in plan.read.own)
        made = scale_text(bank.chart, f"scale_{k}", own, curved=printer.is_curved(bank))
        lines += ["", "", *made]
    for function in (printer.bend(), printer.scale(), printer.enter(), printer.raise_floor()):
        lines += ["", "", *function]
    return "\n".join(lines) + "\n"


class _AdaptingPrinter(LockFunctions):
    """Prints these functions of a plan."""

    def __init__(self, plan: ProgramPlan) -> None:
        super().__init__(plan)
        self.places = {name: f"shared[{k}]" for k, name in enumerate(self.names.shared)}

    def is_curved(self, bank: Bank) -> bool:
        """Return whether a chart reads the threshold of a curve."""
        return "s" in bank.chart.inputs and self._has_curve(bank)

    def _has_curve(self, bank: Bank) -> bool:
        return of(bank.name, "curve v dip") in self.places

    def bend(self) -> list[str]:
        lines = []
        for bank in self.read.banks:
            if self._has_curve(bank):
                F_c, F_s, v_s, dip, flat = (
                    self.places[of(bank.name, f"curve {each}")]
                    for each in ("F_c", "F_s", "v_s", "v dip", "v flat")
                )
                delta = self.places.get(of(bank.name, "curve delta"), repr(GAUSSIAN))
                lines.append(f"{dip} = dip_of({v_s}, {delta})")
                lines.append(f"{flat} = flat_of({F_c}, {F_s}, {v_s}, {delta})")
        return self.plain("bend(p)", "Where Stribeck curves have their dip and are flat.", lines)

    def plain(self, signature: str, doc: str, lines: list[str]) -> list[str]:
        """Assemble a function that reads numbers only."""
        body = ["shared, own, tables = p", *lines] if lines else ["pass"]
        return [f"def {signature}:", f'    """{doc}"""', *(f"    {line}" for line in body)]

    # ------------------------------------------------------------------ scales
    def scale(self) -> list[str]:
        lines, y, base = list[str](), self.layout.y, 0
        states = max((len(bank.states) for bank in self.read.banks), default=0)
        moved: dict[tuple[str, str], str] = {}  # what the scales of bodies are called
        for k, bank in enumerate(self.read.banks):
            weight = self.names.own.index(bank.weight)
            n = f"len(own[{weight}])" if len(self.read.banks) == 1 else str(bank.n)
            first = y.index(bank.variables[0]) if bank.variables else 0
            given = [self.number(of(bank.name, each)) for each in bank.chart.parameter_names]
            curve = ["0.0", "0.0"]
            if self.is_curved(bank):
                curve = [self.places[of(bank.name, f"curve {each}")] for each in ("F_c", "v_s")]
            lines.append(f"N = {self.load(bank)}")
            what = [n, "N", *curve, f"own[{weight}]", *given, str(first), "sizes", str(base)]
            call = f"scale_{k}({', '.join([*what, str(states), 'relaxing'])})"
            lines.append(f"x_{k}, v_{k}, slowest_{k}, time_{k} = {call}")
            lines.append(f"time = nearer({'inf' if k == 0 else 'time'}, time_{k})")
            for row in bank.jacobian:
                for name, coefficient in row.items():
                    lines.append(f"ratio = {self.constant(coefficient)}")
                    for kind in ("x", "v"):
                        least = moved.get((name, kind), "inf")
                        found = moved.setdefault((name, kind), f"least_{len(moved)}")
                        lines.append(f"{found} = nearer({least}, divided({kind}_{k}, ratio))")
            base += states * bank.n
        for body in self.read.system.bodies:
            for kind, name in (("x", body.x), ("v", body.v)):
                if name in y.shared and (body.name, kind) in moved:
                    lines.append(f"sizes[{y.index(name)}] = known({moved[body.name, kind]})")
        lines.append("times[0] = known(time)" if self.read.banks else "times[0] = 0.0")
        doc = "sizes = the scale of each component; the fastest time, and relaxation times."
        return self.plain("scale(p, sizes, times, relaxing)", doc, lines)

    def number(self, name: str) -> str:
        """Spell a number, or the array of one per element."""
        return self.places.get(name) or f"own[{self.names.own.index(name)}]"

    def load(self, bank: Bank) -> str:
        """Spell what the curve of a contact is multiplied by at rest; 0 if that is not known."""
        given = self.read.defined.get(of(bank.name, CURVE_LOAD))
        if given is None:
            return "1.0"
        assert given.tree is not None
        states = {"t", *(u for body in self.read.system.bodies for u in (body.x, body.v))}
        at_rest = renamed(self.read.expanded(given.tree), dict.fromkeys(states, Number(0.0)))
        text = self.constant(at_rest)
        return f"{text} if {text} > {LEAST_LOAD!r} else 0.0"

    def constant(self, tree: Value) -> str:
        """Spell the value of a coefficient; 0 if it depends on more than numbers."""
        if names_in(tree) - {*self.read.system.numbers}:
            return "0.0"
        text = spell(tree, rename=self.places)
        return text if isinstance(tree, Number) else f"number_or_0({text})"

    # ------------------------------------------------------------------ the beginning
    def enter(self) -> list[str]:
        steps = [
            (bank, [(name, tree) for name, tree in bank.start if name in bank.variables])
            for bank in self.read.banks
        ]
        lines = self.before_guards(computed_names(u) for _, found in steps for _, u in found)
        for bank, found in steps:
            body: list[CodeLine] = []
            for name, tree in found:
                place, sizes = self.at("y", self.layout.y, name)
                test = f"if {self.mode(bank.index)} == 0 and {place.replace('y', 'given', 1)} == 0:"
                put = [self.put(self.local(name), tree), CodeLine(f"{place} = {self.local(name)}")]
                body += [CodeLine(test, sizes | {name}), *indented(put)]
            lines += self.loop(bank.index, "live", body)
        return self.function(
            "enter(t, y, mode, p, given)",
            "Perform the entry of each element's default state, except for what is given.",
            lines,
            "live",
        )

    def raise_floor(self) -> list[str]:
        y, bodies = self.layout.y, self.read.free
        scaleless = [(u.x, 2) for u in bodies] + [(u.v, 1) for u in bodies]
        places = [(y.index(name), power) for name, power in scaleless if name in y.shared]
        lines = ["for j in range(len(atol)):", "    least[j] = atol[j]"]
        if places:
            signals = self.read.system.signals.values()
            # A user's own function is not asked ahead of time.
            looks = LOOKS[: 1 if any(isinstance(each, Function) for each in signals) else None]
            lines.append(f"if {' or '.join(f'atol[{place}] == 0.0' for place, _ in places)}:")
            body = ["length = span[1] - span[0]", "most = 0.0"]
            for part in looks:
                body += [f"t = span[0] + {part} * length" if part else "t = span[0]", *LOOK]
                body += [f"most = larger(most, abs({each}))" for each in self.accelerations()]
            for place, power in places:
                rounded = " * ".join([f"{ROUNDED} * most", *["length"] * power])
                body += [f"if atol[{place}] == 0.0:", f"    least[{place}] = {rounded}"]
            lines += [f"    {each}" for each in body]
        return self.plain(
            "raise_floor(span, y, mode, p, held, live, watch, dy, seen, atol, least)",
            "least = atol; where it is 0, what rounding leaves of the largest motion there can be.",
            lines,
        )

    def accelerations(self) -> Iterator[str]:
        """Spell the accelerations of bodies, and those that their contacts could give them."""
        for body in self.read.free:
            yield f"dy[{self.layout.y.index(body.v)}]"
            inertia = self.read.inertias[body.name]
            for bank in self.read.banks:
                for force, row in zip(bank.forces, bank.jacobian, strict=False):
                    if body.name in row:
                        place = self.layout.observed.index(force)
                        ratio, mass = (
                            spell(each, rename=self.places) for each in (row[body.name], inertia)
                        )
                        yield f"seen[{place}] * ({ratio}) / ({mass})"


LOOK = (
    "for j in range(len(watch)):",
    "    watch[j] = 0",
    "arm(t, y, mode, p, held, watch)",
    "flow(t, y, mode, held, p, dy)",
    "observe(t, y, mode, live, p, seen)",
)


def larger(most: float, u: float) -> float:
    """Return the larger of two sizes; one without a limit is no motion that there can be."""
    return u if most < u < LIMIT else most


# --------------------------------------------------------------------------- the functions
@functools.lru_cache(maxsize=64)
def text_of(plan: ProgramPlan) -> str:
    """Return the text of a plan's functions, as named in `FUNCTIONS`."""
    return _text(plan)


def bind(source: str, functions: Mapping[str, Callable[..., Any]]) -> dict[str, Any]:
    """Return the functions of a text, which call those of the program."""
    return load("what follows from the numbers", source, _names(functions))


def _names(functions: Mapping[str, Callable[..., Any]]) -> dict[str, Any]:
    own = {**HELPERS, "dip_of": dip_of, "flat_of": flat_of, "larger": larger}
    return {**SIGNALS, **functions, **own, "__name__": __name__}


@dataclass(frozen=True, eq=False)
class Adaptive:
    """These functions for Python; where Python would raise, they go on with inf and NaN."""

    functions: Mapping[str, Callable[..., Any]]


def adaptive(plan: ProgramPlan, functions: Mapping[str, Callable[..., Any]]) -> Adaptive:
    """Return the functions of a plan, with those of its program."""
    source, names = text_of(plan), _names(functions)
    fast = load("what follows from the numbers", source, names)
    careful = CarefulText("what follows from the numbers", source, names)
    return Adaptive({name: ieee(fast[name], careful[name]) for name in FUNCTIONS})


# --------------------------------------------------------------------------- in machine code
OF_A_RUN = (
    "functions buffers log.seen buffers.sliding.live more.adapting"  # the arguments of `adapt`
)


@functools.lru_cache(maxsize=64)
def stamp_of(plan: ProgramPlan) -> str:
    """Return a hash of what `adapt` does for a plan."""
    from integrators.runners.edition import digest

    helpers = [each for each in HELPERS.values() if isinstance(each, FunctionType)]
    constants = SHARE, LOOKS, ROUNDED, LIMIT
    return digest(adapt, dip_of, flat_of, larger, *helpers, text=f"{constants} {text_of(plan)}")


class Adapting(NamedTuple):
    """These functions, and what they need: part of the block of an export."""

    bend: Callable[..., Any]
    scale: Callable[..., Any]
    enter: Callable[..., Any]
    raise_floor: Callable[..., Any]
    chosen: Vector  # absolute tolerances that the user has given; 0 for the others
    y: Vector  # initial values before any entry
    given: list[int]  # which of those in the block stay
    span: Vector  # s
    sizes: Vector
    times: Vector


def adapt(functions: Any, b: Buffers, seen: Vector, live: Vector, a: Adapting) -> float:
    """Let everything follow from the numbers in a block, and return the new time scale.

    Before the first step initial values follow, too.
    """
    now, control, p = b.now, b.plan.control, functions.p
    a.bend(p)
    a.scale(p, a.sizes, a.times, b.plan.relaxing)
    for k in range(len(b.plan.relaxing)):
        if b.plan.relaxing[k] == 0.0:
            b.plan.relaxing[k] = math.inf
    for j in range(len(a.sizes)):
        control.atol[j] = a.chosen[j]
        if a.chosen[j] == 0.0:
            control.atol[j] = SHARE * control.rtol * a.sizes[j]
    if b.memory.phase == START:
        for j in range(len(a.y)):
            if a.given[j] == 0:
                now.y[j] = a.y[j]
        a.enter(now.t, now.y, now.mode, p, a.given)
        for j in range(len(a.y)):
            b.memory.anchor[j] = now.y[j]
        signs = now.held[0] if len(now.held) > 0 else 0.0  # all are equal before the first step
        a.raise_floor(
            a.span, now.y, now.mode, p, now.held, live, b.sliding.watch, b.scratch.k[0], seen,
            control.atol, now.floor,
        )  # fmt: skip
        for j in range(len(now.held)):
            now.held[j] = signs
    else:
        for j in range(len(a.sizes)):
            if control.atol[j] > 0.0:
                now.floor[j] = control.atol[j]
        # Slopes and margins that are kept are those of the old numbers.
        if b.memory.phase != JUMPING:
            b.memory.phase = ASK
            b.memory.fresh = True
    return a.times[0]
