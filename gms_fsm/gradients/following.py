"""The tangents of a run: the loop of `integrators.tangents` on the functions of a program.

It is machine code wherever that is installed, whatever engine the run itself has: the bits are the
same without it.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.foundation.extras import has_machine_code
from gms_fsm.gradients.linear import Directions
from gms_fsm.gradients.tangents import in_lanes, refuse_callables
from gms_fsm.language import comparisons, split
from gms_fsm.lowering import compiling
from gms_fsm.lowering.program import Program, equations
from integrators import METHODS, Functions, Held, LoopOptions, Tableau, hybrid, sliding_scratch
from integrators.loop import ADVANCE, DONE, ROWS, Machines
from integrators.machine_code.records import arrays_of, numbers_in, numbers_of, put_numbers
from integrators.runners.states import begin
from integrators.steps import Dense, Now, Scratch, coefficients
from integrators.tangents import switches
from integrators.tangents.motion import LaneFunctions, Lanes, SlideLanes, TangentCourse, Traced
from integrators.tangents.run import FollowArguments, follow_run

METHOD = coefficients(METHODS["dp45"])
LANES = 4  # directions side by side, where there are several
ROWS_AT_ONCE = 256
STEPS_AT_ONCE = 20_000


@dataclass(frozen=True)
class DerivativeDoubt:
    """A switch whose derivative is not the ordinary one.

    Parameters
    ----------
    kind : str
        ``"grazing"``, ``"tie"``, or ``"none"`` where a rate has no slope.
    t : float
        s.
    place : str
        What happens there.
    reason : str
        What follows.
    """

    kind: str
    t: float
    place: str
    reason: str


@dataclass(frozen=True, eq=False)
class Followed:
    """Tangents of a run.

    Parameters
    ----------
    t : ndarray, shape (rows,)
        Times of the rows, s.
    rows : ndarray, shape (rows, m, directions)
        Of the state at the rows of the run, at fixed times.
    times : ndarray, shape (firings, directions)
        Of the time of each firing.
    end : ndarray, shape (m, directions)
        Of the state at the end.
    doubts : tuple of Doubt
        Switches whose derivative is one-sided, or does not exist.
    """

    t: FloatArray
    rows: FloatArray
    times: FloatArray
    end: FloatArray
    doubts: tuple[DerivativeDoubt, ...]


def follow(
    program: Program,
    options: LoopOptions,
    start: tuple[float, list[float], list[int], float],
    directions: Directions,
    rows: int = 4 * ROWS_AT_ONCE,
) -> Followed:
    """Differentiate a run of about so many rows."""
    refuse_callables(program)
    inside = has_machine_code() and isinstance(options.method, Tableau)
    run = _TangentRun(program, options, start, directions, inside, rows)
    return run.to_its_end(run.in_block() if inside else run.in_lists())


class _TangentRun:
    """A run with tangents, as arrays or as lists."""

    def __init__(
        self,
        program: Program,
        options: LoopOptions,
        start: tuple[float, list[float], list[int], float],
        directions: Directions,
        compiled: bool,
        rows: int,
    ) -> None:
        self.program, self.directions, self.compiled = program, directions, compiled
        self.start, self.wanted = start, options.times
        self.options = dataclasses.replace(options, times=None)
        self.rows = rows + ROWS_AT_ONCE + 3 if self.wanted is None else len(self.wanted)
        self.lanes = LANES if directions.count > 1 else 1
        self.wide = (directions.count // self.lanes + 1) * self.lanes  # the time has a place, too
        size, title = len(start[1]), program.plan.title
        self.tangents = in_lanes(program.source, title, directions.places, self.lanes, size)
        self.texts: Any = compiling.functions(program) if compiled else program.ieee

    # ------------------------------------------------------------------ arguments
    def arguments(self, outside: Callable[[Any], Any]) -> FollowArguments:
        """Return the arguments, with something in place of arrays of any length."""
        program, (t, y, mode, last), made = self.program, self.start, self.texts
        tangents = self.tangents["plain"] if self.compiled else self.tangents
        shared, own, tables = compiling.packed(program.p)
        p = (shared.tolist(), own.tolist(), outside(tables)) if self.compiled else program.p
        numbers = Functions(
            made["flow"], made["arm"], made["margins"], made["normal"], made["follow"], p
        )
        machines = [made[name] for name in ("switch", "act", "tick", "jolts", "observe")]
        b = hybrid.buffers(equations(program), t, y, mode, last, self.options, ROWS_AT_ONCE)
        relations, plan = len(b.relations.watch), b.plan
        columns = {name: outside(np.array(getattr(plan, name), float)) for name in _FLOATS}
        b = b._replace(plan=plan._replace(**columns, ticks=outside(np.array(plan.ticks, int))))
        b.out.times, b.out.rows_t, b.out.rows_y = (
            outside(np.array(each, float)) for each in ([], b.out.rows_t, b.out.rows_y)
        )
        traced = Traced(
            numbers,
            Machines(*machines),
            LaneFunctions(*(tangents[name] for name in LaneFunctions._fields)),
            METHOD,
            [self.options.rtol],
            [int(self.wanted is None)],
            [program.velocities],
            [self.directions.count],
            self.course(relations, outside),
            self.scratch(relations),
        )
        noting = switches.ask, switches.act, switches.tick, switches.jolts, machines[-1]
        return FollowArguments(switches.functions_of(traced), Machines(*noting), b)

    def course(self, relations: int, outside: Callable[[Any], Any]) -> TangentCourse:
        """Return the tangents at the start."""
        program, (t, y, _, last), count = self.program, self.start, self.directions.count
        size, wide, n = len(y), self.wide, program.layout.n
        S, scales = np.zeros((size, wide)), np.ones(wide)
        S[:, :count], scales[:count] = self.directions.y, self.directions.scales
        guards, first_guards = _guards(ByIdentity(program.plan), ByIdentity(program.layout))

        def floats(*shape: int) -> Any:
            return outside(np.zeros(shape))

        def places(length: int) -> Any:
            return outside(np.zeros(length, dtype=np.int64))

        return TangentCourse(
            t=t, before=t, settled=-np.inf, span=last - t, instant=1, changed=0, moving=0,
            rows=0, fired=0, next_time=0, doubts=0, named=0,
            y=list(y), y_before=list(y), mode=[0] * n, held=[0.0] * program.held,
            f=[0.0] * size, sizes=[abs(u) for u in y],
            watch=[0] * relations, only=[0] * relations, armed=[0] * relations,
            margins=[0.0] * relations, rates=[0.0] * relations,
            guards=guards, first_guards=first_guards, sliding=self.sliding(relations),
            S=outside(S), t_t=floats(wide), t_before=floats(wide),
            slopes=floats(relations, wide), moves=outside(self.moves()), scales=outside(scales),
            times=outside(np.array(() if self.wanted is None else self.wanted, float)),
            rows_t=floats(self.rows), table=floats(self.rows, size * wide),
            firings=floats(64, wide), doubt_t=floats(16), doubt_kind=places(16),
            doubt_end=places(16), doubt_names=places(16 * (relations + 1)),
        )  # fmt: skip

    def sliding(self, relations: int) -> Any:
        """Return scratch space for sliding."""
        program, size = self.program, len(self.start[1])
        return sliding_scratch(program.surfaces, size, program.held, relations, 0)

    def scratch(self, relations: int) -> Lanes:
        """Return the lanes of a group."""
        program, lanes, (shared, own, _) = self.program, self.lanes, self.program.p
        size, longest = len(self.start[1]), max(map(len, own), default=0)
        both, most = size * (1 + lanes), len(self.sliding(relations).sigma)
        alone, wide = (size, both) if most else (0, 0)

        def vector(length: int = both) -> list[float]:
            return [0.0] * length

        def rows(number: int, length: int) -> list[list[float]]:
            return [vector(length) for _ in range(number)]

        now = Now(
            **dict.fromkeys(("t", "h", "error_before", "anchor", "switched"), 0.0),
            **dict.fromkeys(("t_stop", "pause", "latest", "seen"), np.inf),
            y=vector(), f=vector(), mode=[0] * program.layout.n, held=vector(program.held),
            floor=[],
        )  # fmt: skip
        dense = Dense(*(vector() for _ in Dense._fields))
        return Lanes(
            now,
            Scratch(rows(len(METHOD.B), both), vector(), vector(), vector(), dense),
            [0] * program.layout.n,
            vector(lanes),
            vector(lanes),
            vector(len(shared) * lanes),
            rows(len(own), longest * lanes),
            vector(relations),
            vector(relations * lanes),
            SlideLanes(
                vector(alone), vector(alone), vector(wide), vector(wide),
                rows(max(most, 1), wide), vector(alone + 1), vector((alone + 1) * lanes),
                vector(most * lanes), vector(most * lanes), vector(most),
            ),
        )  # fmt: skip

    def moves(self) -> FloatArray:
        """Return what all numbers change by, lanes of each group."""
        d, (shared, own, _) = self.directions, self.program.p
        longest = max(map(len, own), default=0)
        rows = np.zeros((len(shared) + len(own) * longest, self.wide))
        for k, change in d.shared.items():
            rows[k, : d.count] = change
        for k, changes in d.own.items():
            for i, change in enumerate(changes):
                rows[len(shared) + k * longest + i, : d.count] = change
        groups = rows.reshape(len(rows), -1, self.lanes).transpose(1, 0, 2)
        return np.ascontiguousarray(groups.reshape(groups.shape[0], -1))

    # ------------------------------------------------------------------ how it is run
    def in_lists(self) -> _TangentCall:
        """Return what goes on in Python."""
        arguments, solver = self.arguments(lambda array: array.tolist()), None
        b = arguments.buffers
        if b.plan.foreign:
            from integrators.runners.scipy_arcs import SciPyStepper

            solver = SciPyStepper(Held(arguments.functions, b.now.held, b.sliding), b, self.options)

        def call() -> int:
            event = follow_run(*arguments, STEPS_AT_ONCE)
            if event == ADVANCE and solver is not None:
                solver.advance(ROWS_AT_ONCE)
                event = ROWS
            return event

        course = arguments.functions.p.course
        return _TangentCall(call, course, course)

    def in_block(self) -> _TangentCall:
        """Return what goes on in machine code."""
        ready = self.ready()
        block = ready.block()
        contents = self.put(block.contents)

        def call() -> int:
            block.update(contents)
            return ready.engine(block, STEPS_AT_ONCE)

        course = contents.functions.p.course
        return _TangentCall(call, course, course, lambda: ready.take_back(block))

    def put(self, contents: Any) -> Any:
        """Put the numbers of this run into a block."""
        program, options, (t, y, mode, last) = self.program, self.options, self.start
        shared, own, tables = compiling.packed(program.p)
        traced, b = contents.functions.p, contents.buffers
        numbers = traced.functions
        numbers.p[0][...], numbers.p[1][...] = shared, own
        traced.rtol[0], traced.every[0] = options.rtol, self.wanted is None
        traced.wide[0] = self.directions.count
        plan = hybrid.plan_of(equations(program), t, last, options, len(mode))
        b = b._replace(plan=compiling.plan_in_block(plan, b.plan))
        begin(b, t, y, mode, last, options.floor or options.atol)
        b.out.rows_t, b.out.rows_y = np.zeros(ROWS_AT_ONCE), np.zeros((ROWS_AT_ONCE, len(y)))
        course = self.course(len(traced.course.watch), lambda array: array)
        put_numbers(traced.course, counts := numbers_of(TangentCourse), numbers_in(course, counts))
        for name in arrays_of(TangentCourse):
            value = getattr(course, name)
            if isinstance(value, np.ndarray):
                setattr(traced.course, name, value)
            elif name in ("y", "y_before", "sizes"):
                getattr(traced.course, name)[:] = value
        numbers = numbers._replace(p=(*numbers.p[:2], tables))
        functions = contents.functions._replace(p=traced._replace(functions=numbers))
        return contents._replace(functions=functions, buffers=b)

    def ready(self) -> compiling.ReadyCode:
        """Return machine code for all runs that differ in numbers only."""
        from integrators.machine_code.layout import OuterArray
        from integrators.runners import compiled

        program, text = self.program, self.tangents["text"]
        lengths = len(program.p[0]), *map(len, program.p[1])
        key = program.source, text, lengths, self.options.method
        if key not in _KEPT:
            if len(_KEPT) >= compiling.MOST_ENGINES:
                _KEPT.clear()

            def column(array: Any) -> Any:
                return OuterArray(array.dtype.kind, table=array.ndim == 2)

            example = self.arguments(column)
            text = compiling.text_of(program, text)
            made = compiled.follower(text, example, compiling.store(), compiling.notify)
            _KEPT[key] = compiling.ReadyCode(made, example, program.functions)
        found: compiling.ReadyCode = _KEPT[key]
        return found

    def to_its_end(self, call: _TangentCall) -> Followed:
        """Go on to the end, and return what has been kept."""
        c = call.course
        while (event := call.on()) != DONE:
            if event != ROWS:
                raise RuntimeError(f"a run has ended otherwise than before: {event}")
            call.make_room()
        count, arrays, size = self.directions.count, call.arrays, len(self.start[1])
        table = np.asarray(arrays.table, float)[: c.rows].reshape(c.rows, size, self.wide)
        firings = np.asarray(arrays.firings, float)[: c.fired].reshape(c.fired, self.wide)
        found = Followed(
            np.asarray(arrays.rows_t, float)[: c.rows],
            table[:, :, :count],
            firings[:, :count],
            np.asarray(arrays.S, float)[:, :count],
            tuple(self.doubts(c, arrays)),
        )
        call.over()
        return found

    def doubts(self, c: Any, arrays: Any) -> Iterator[DerivativeDoubt]:
        """Yield what is doubtful, in words."""
        names = self.program.relations
        ends = [int(end) for end in arrays.doubt_end[: c.doubts]]
        named = np.split(np.asarray(arrays.doubt_names, int), ends)[:-1]
        for t, kind, which in zip(arrays.doubt_t, arrays.doubt_kind, named, strict=False):
            said = dict.fromkeys(names[r] if r < len(names) else SLIDE_ENDS for r in which)
            word, place, reason = DOUBTS[int(kind)]
            yield DerivativeDoubt(word, float(t), place or f"{' and '.join(said)} changes", reason)


SLIDE_ENDS = "the end of a slide"
DOUBTS = {
    switches.GRAZES: (
        "grazing", "", "it grazes there, so that nothing has a derivative from then on",
    ),
    switches.JUMPS: (
        "grazing", "", "it jumps there, so that nothing has a derivative from then on",
    ),
    switches.TIE: (
        "tie", "", "they hold on the side on which these follow each other as they did",
    ),
    switches.NO_SLOPE: (
        "none", "the slope of a rate is not finite", "nothing has a derivative from then on",
    ),
}  # fmt: skip


@dataclass(eq=False)
class _TangentCall:
    """What goes on with a run."""

    on: Callable[[], int]
    course: Any  # has the numbers
    arrays: Any  # has the columns
    over: Callable[[], None] = lambda: None

    def make_room(self) -> None:
        """Double the columns that are full, or will be soon."""
        c, a = self.course, self.arrays
        full = {"firings": c.fired + 1, "rows_t": c.rows + ROWS_AT_ONCE + 2}
        full["doubt_t"] = c.doubts + 3
        full["doubt_names"] = c.named + 3 * len(a.watch)
        pairs = {"rows_t": ("rows_t", "table"), "doubt_t": ("doubt_t", "doubt_kind", "doubt_end")}
        for name, needed in full.items():
            if needed >= len(getattr(a, name)) and not (name == "rows_t" and len(a.times)):
                for each in pairs.get(name, (name,)):
                    column = getattr(a, each)
                    if isinstance(column, list):
                        column += copy.deepcopy(column)
                    else:
                        setattr(a, each, np.concatenate([column, np.zeros_like(column)]))


_FLOATS = ("jumps", "before_jumps", "knots")
_KEPT: dict[Any, Any] = {}


@functools.lru_cache(maxsize=64)
def _guards(plan: ByIdentity[Any], layout: ByIdentity[Any]) -> tuple[list[list[int]], list[int]]:
    """Return the relations in the guards of all edges, and where those of a machine begin."""
    found, first = list[list[int]](), list[int]()
    relations = plan.it.relations
    for machine in range(layout.it.n):
        place = layout.it.bank(machine)
        bank = next(b for b in plan.it.read.banks if b.name == place.name)
        first.append(len(found) - place.first_edge)
        for edge in bank.edges:
            asked = comparisons(split(edge.guard))
            known = [u for u in asked if u in relations.shared or u in relations.own]
            found.append([relations.index(u, machine - place.first) for u in known])
    found.append([-1])  # a table has a row
    most = max(map(len, found))
    return [row + [-1] * (most - len(row)) for row in found], first
