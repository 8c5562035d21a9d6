"""The tangents of a run: what the loop of `integrators.tangents` needs of a program.

They follow the loop in machine code, and in Python where that is not installed, with equal bits.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.gradients.directions import Directions
from gms_fsm.gradients.tangents import in_lanes
from gms_fsm.language import comparisons, split
from gms_fsm.lowering.program import Program, equations, machines_of
from integrators import METHODS, Functions, Held, LoopOptions, hybrid, sliding_scratch
from integrators.loop import (
    ADVANCE,
    DONE,
    FIRED,
    FIRING,
    ROWS,
    SLID,
    STOPPED,
    Machines,
    run_to_event,
)
from integrators.machine_code.records import numbers_of, put_numbers
from integrators.sliding import MOST_SLIDING, flow_on, follow_on, margins_on
from integrators.steps import ArcMotion, Dense, Now, Scratch, coefficients
from integrators.tangents import switches
from integrators.tangents.motion import LaneFunctions, Lanes, SlideLanes, TangentCourse, Traced
from integrators.tangents.run import machines_that_note

TABLEAU = METHODS["dp45"]
METHOD = coefficients(TABLEAU)
LANES = 4  # where there are several directions
ROWS_AT_ONCE = 256
FEW = 16  # first length of columns that grow


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


@dataclass(frozen=True, eq=False)
class TangentRun:
    """What a run has besides its own numbers, if tangents follow it.

    Parameters
    ----------
    program : Program
        What is run.
    directions : Directions
        By what it is differentiated.
    size : int
        Length of the state.
    times : sequence of float, optional
        Of the rows at which tangents are wanted, if not at all rows.
    lanes : int
        How many directions stand side by side.
    rtol : float
        The tolerance.
    same : bool
        Whether the run has the method of its tangents.
    """

    program: Program
    directions: Directions
    size: int
    times: Sequence[float] | Any | None
    lanes: int
    rtol: float = 0.0
    same: bool = False

    @functools.cached_property
    def wide(self) -> int:
        """How many directions there are; the time has a place, too, and the last group is full."""
        return (self.directions.count // self.lanes + 1) * self.lanes

    @functools.cached_property
    def texts(self) -> Mapping[str, Any]:
        """The functions with tangents."""
        program = self.program
        places = self.directions.places
        return in_lanes(program.source, program.plan.title, places, self.lanes, self.size)

    # ------------------------------------------------------------------ arguments
    def traced(
        self, functions: Functions, machines: Machines, outside: Callable[[Any], Any]
    ) -> tuple[Functions, Machines]:
        """Return functions and machines whose tangents are followed.

        Arrays of any length are put into something else; with it, functions are those that are
        translated.
        """
        program, tangents = self.program, self.texts
        plain = outside is not as_lists
        relations = len(program.strict) + 2 * min(len(program.surfaces.sign), MOST_SLIDING)
        of_lanes = tangents["plain"] if plain else tangents
        traced = Traced(
            functions,
            machines,
            LaneFunctions(*(of_lanes[name] for name in LaneFunctions._fields)),
            METHOD,
            [self.rtol],
            [int(self.times is None)],
            [int(self.same)],
            [program.velocities],
            [self.directions.count],
            self._course(relations, outside),
            self._scratch(relations),
        )
        return switches.functions_of(traced), machines_that_note()

    def _course(self, relations: int, outside: Callable[[Any], Any]) -> TangentCourse:
        """Return a course that has not begun."""
        program, size = self.program, self.size
        guards, first_guards = _guards(ByIdentity(program.plan), ByIdentity(program.layout))
        numbers: Any = {
            name: 0.0 if kind == "f" else 0 for name, kind in numbers_of(TangentCourse).items()
        }
        return TangentCourse(
            **numbers,
            y=[0.0] * size, y_before=[0.0] * size, mode=[0] * program.layout.n,
            held=[0.0] * program.held, f=[0.0] * size, sizes=[0.0] * size,
            watch=[0] * relations, only=[0] * relations, armed=[0] * relations,
            margins=[0.0] * relations, rates=[0.0] * relations,
            guards=guards, first_guards=first_guards, sliding=self._sliding(relations),
            **{name: outside(each) for name, each in self._columns(relations).items()},
        )  # fmt: skip

    def _columns(self, relations: int) -> dict[str, Any]:
        """Return the arrays of any length, as they are at first."""
        size, wide, groups = self.size, self.wide, self.wide // self.lanes
        times = np.array(() if self.times is None else self.times, float)
        shapes = {
            "S": (size, wide), "t_t": (wide,), "t_before": (wide,), "scales": (wide,),
            "slopes": (relations, wide), "slope": (groups, size * (1 + self.lanes)),
            "steps": (groups,), "firings": (FEW, wide), "doubt_t": (FEW,),
            "rows_t": (max(len(times), 1),), "table": (max(len(times), 1), size * wide),
        }  # fmt: skip
        lengths = {"doubt_kind": FEW, "doubt_end": FEW, "doubt_names": FEW * (relations + 1)}
        found: dict[str, Any] = {name: np.zeros(shape) for name, shape in shapes.items()}
        found |= {name: np.zeros(each, dtype=np.int64) for name, each in lengths.items()}
        return {**found, "moves": self.moves, "times": times}

    def _sliding(self, relations: int) -> Any:
        """Return scratch space for sliding."""
        program = self.program
        return sliding_scratch(program.surfaces, self.size, program.held, relations, 0)

    def _scratch(self, relations: int) -> Lanes:
        """Return the lanes of a group."""
        program, lanes, (shared, own, _) = self.program, self.lanes, self.program.p
        size, longest = self.size, max(map(len, own), default=0)
        both, most = size * (1 + lanes), len(self._sliding(relations).sigma)
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

    @functools.cached_property
    def moves(self) -> FloatArray:
        """What all numbers change by, lanes of each group."""
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

    @functools.cached_property
    def start(self) -> FloatArray:
        """The tangents of the state at the start."""
        start = np.zeros((self.size, self.wide))
        start[:, : self.directions.count] = self.directions.y
        return start

    @functools.cached_property
    def nothing(self) -> FloatArray:
        """Tangents of what has not moved."""
        return np.zeros(self.wide)

    # ------------------------------------------------------------------ a run
    def place(self, traced: Any) -> None:
        """Put the settings of a run, and columns of its own, into a block."""
        traced.rtol[0], traced.every[0] = self.rtol, int(self.times is None)
        traced.wide[0], traced.same[0] = self.directions.count, int(self.same)
        for name, column in self._columns(len(traced.course.watch)).items():
            setattr(traced.course, name, column)

    def begin(self, c: Any, t: float, y: Sequence[float], t_end: float, scales: FloatArray) -> None:
        """Put the start of a run into a course, whose columns stay."""
        put_numbers(c, numbers_of(TangentCourse), (0,) * len(numbers_of(TangentCourse)))
        c.t = c.before = t
        c.settled, c.span, c.instant = -np.inf, t_end - t, 1
        c.y[:], c.y_before[:], c.sizes[:] = y, y, np.abs(y)
        sizes = np.append(scales, self.nothing[len(scales) :] + 1.0)
        starts = (c.S, self.start), (c.scales, sizes), (c.t_t, self.nothing)
        for array, values in (*starts, (c.t_before, self.nothing)):
            array[:] = values if isinstance(array, np.ndarray) else values.tolist()

    def make_room(self, c: Any, rows: int, firings: int) -> None:
        """Lengthen the columns that have no room for so many more rows and firings."""
        relations = len(c.watch)
        _lengthen(c, c.rows + rows if self.times is None else 0, "rows_t", "table")
        _lengthen(c, c.fired + firings, "firings")
        _lengthen(c, c.doubts + 4, "doubt_t", "doubt_kind", "doubt_end")
        _lengthen(c, c.named + 3 * relations + 1, "doubt_names")

    def followed(self, c: Any) -> Followed:
        """Return copies of what has been kept."""
        count = self.directions.count
        table = np.array(c.table[: c.rows], float).reshape(c.rows, self.size, self.wide)
        firings = np.array(c.firings[: c.fired], float).reshape(c.fired, self.wide)
        return Followed(
            np.array(c.rows_t[: c.rows], float),
            table[:, :, :count],
            firings[:, :count],
            np.array(c.S, float)[:, :count],
            tuple(self._doubts(c)),
        )

    def _doubts(self, c: Any) -> Iterator[DerivativeDoubt]:
        """Yield what is doubtful, in words."""
        names, begin = self.program.relations, 0
        for k in range(c.doubts):
            end = int(c.doubt_end[k])
            which = [int(r) for r in c.doubt_names[begin:end]]
            said = dict.fromkeys(names[r] if r < len(names) else SLIDE_ENDS for r in which)
            word, place, reason = DOUBTS[int(c.doubt_kind[k])]
            t, begin = float(c.doubt_t[k]), end
            yield DerivativeDoubt(word, t, place or f"{' and '.join(said)} changes", reason)


def followed_in_python(
    run: TangentRun, options: LoopOptions, start: tuple[float, list[float], list[int], float]
) -> Followed:
    """Run once more without machine code, and follow it; its rows are not kept."""
    program, (t, y, mode, last) = run.program, start
    plain, asked = equations(program).functions(located=True), machines_of(program.ieee)
    functions, machines = run.traced(plain, asked, as_lists)
    every = dataclasses.replace(options, times=None)
    b = hybrid.buffers(equations(program), t, y, mode, last, every, ROWS_AT_ONCE)
    on = Held(functions, b.now.held, b.sliding)
    motion, solver = ArcMotion(flow_on, margins_on, on, follow_on, machines.moved), None
    if b.plan.foreign:
        from integrators.runners.scipy_arcs import SciPyStepper

        solver = SciPyStepper(on, b, options, machines.moved)
    c = functions.p.course
    run.begin(c, t, y, last, run.directions.scales)
    event = ROWS
    while event != DONE:
        run.make_room(c, ROWS_AT_ONCE + 2, 1)
        event = run_to_event(functions, machines, motion, b, ROWS_AT_ONCE)
        machines.noted(event, on, b)
        if event == ADVANCE and solver is not None:
            solver.advance(ROWS_AT_ONCE)
        elif event == ROWS:
            b.out.row = b.memory.taken = 0
        elif event not in (FIRING, FIRED, SLID, STOPPED, DONE):
            raise RuntimeError(f"a run has ended otherwise than before: {event}")
    return run.followed(c)


def as_lists(array: Any) -> Any:
    """Return an array as lists."""
    return array.tolist()


def as_columns(array: Any) -> Any:
    """Return what stands for an array of any length in a block of machine code."""
    from integrators.machine_code.layout import OuterArray

    return OuterArray(array.dtype.kind, table=array.ndim == 2)


def _lengthen(c: Any, needed: int, *names: str) -> None:
    """Make columns long enough, and at least twice as long as they are."""
    for name in names:
        column = getattr(c, name)
        if (length := len(column)) >= needed:
            continue
        more = max(needed - length, length)
        if isinstance(column, list):
            column += [copy.copy(column[0]) for _ in range(more)]
        else:
            setattr(
                c, name, np.concatenate([column, np.zeros((more, *column.shape[1:]), column.dtype)])
            )


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
