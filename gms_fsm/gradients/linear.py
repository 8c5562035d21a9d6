"""A program with tangents in several directions at once: its flow, and what else switches it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.gradients.directions import Directions
from gms_fsm.gradients.following import TangentRun, as_lists
from gms_fsm.gradients.tangents import tangents
from gms_fsm.lowering.observing import armed
from gms_fsm.lowering.program import Program, equations, machines_of
from integrators.sliding import Functions, Held, go_back, go_to
from integrators.tangents.motion import slide_in_lanes

FEW = 6  # directions that are computed one by one: numbers are faster than short arrays
Modes = Sequence[int]


class _Slide(NamedTuple):
    """A motion along surfaces."""

    f: FloatArray  # dy/dt
    slope: FloatArray  # its tangents
    sigma: FloatArray
    d_sigma: FloatArray
    N: FloatArray  # the gradients of the surfaces


@dataclass(frozen=True, eq=False)
class Linear:
    """A program and its tangents.

    Tangents of a state have shape (m, directions + 1) where the last column is that of the time: it
    follows the flow, t' = 1.
    """

    program: Program
    directions: Directions

    @cached_property
    def functions(self) -> Any:
        """The functions with tangents."""
        return tangents(self.program, self.directions.places)

    @cached_property
    def numbers(self) -> list[Any]:
        """Tangents of the numbers for each direction; the last one is the time's."""
        count = self.directions.count
        ones = [self._chosen(lambda row, c=c: float(row[c])) for c in range(count)]  # type: ignore[misc]
        return [*ones, self._chosen(lambda _: 0.0)]

    def _chosen(self, take: Callable[[FloatArray], Any]) -> tuple[list[Any], list[Any]]:
        """Return a part of the changes of each number: shared ones, and those per element."""
        d, p = self.directions, self.program.p
        shared = [take(d.shared[k]) if k in d.shared else 0.0 for k in range(len(p[0]))]
        own = [
            [take(row) for row in d.own[k]] if k in d.own else [0.0] * len(p[1][k])
            for k in range(len(p[1]))
        ]
        return shared, own

    def call(
        self,
        name: str,
        arguments: tuple[Any, ...],
        t_t: FloatArray,
        y_t: FloatArray,
        size: int = 0,
    ) -> tuple[list[float], FloatArray]:
        """Call a function; return what it fills, or y without a size, and the tangents of that.

        ``t_t`` has shape (columns,), ``y_t`` (m, columns); the last of the directions + 1 columns
        is the time's, and may be missing.
        """
        function, count = self.functions[name], t_t.size
        filled: list[float] = [0.0] * size
        if count == 0:
            self.program.ieee[name](*arguments, *([filled] if size else []))
            return filled, np.zeros((size or y_t.shape[0], 0))
        if count > FEW:
            slopes: list[Any] = [0.0] * size
            tangent = list(y_t)
            every = self._arrays[count]
            more = [filled] if size else []
            time: Any = t_t if t_t.any() else 0.0
            function(*arguments, *more, time, tangent, every, *([slopes] if size else []))
            rows = slopes if size else tangent
            made = np.empty((len(rows), count))
            for place, row in zip(made, rows, strict=True):
                place[:] = row
            return filled, made
        made = np.empty((size or y_t.shape[0], count))
        columns, given, numbers = y_t.T.tolist(), arguments, self.numbers
        for c in range(count):
            column = columns[c]
            slope = [0.0] * size
            number = numbers[c]
            if size:
                function(*given, filled, t_t[c], column, number, slope)
                made[:, c] = slope
            else:  # changes y and the modes: each time anew, the last one counts
                copies = tuple(
                    list(a) if isinstance(a, list) and c < count - 1 else a for a in given
                )
                function(*copies, t_t[c], column, number)
                made[:, c] = column
        return filled, made

    @cached_property
    def _arrays(self) -> dict[int, Any]:
        """The tangents of the numbers as arrays, by their number of columns."""
        shared, own = self._chosen(lambda row: row)
        longer = self._chosen(lambda row: np.append(row, 0.0))
        return {self.directions.count: (shared, own), self.directions.count + 1: longer}

    # ------------------------------------------------------------------ flow
    def flow(
        self, t: float, y: list[float], mode: Modes, held: list[float], t_t: FloatArray, y_t: Any
    ) -> tuple[FloatArray, FloatArray]:
        """Return dy/dt with frozen signs, along the surfaces slid on, and its tangents."""
        flags = mode[self.program.layout.slides]
        if not any(flags):
            plain, slope = self._plain(t, y, list(mode), held, t_t, y_t)
            return np.array(plain), slope
        slide = self.along(t, y, mode, held, t_t, y_t)
        return slide.f, slide.slope

    def _plain(
        self,
        t: float,
        y: list[float],
        mode: list[int],
        held: list[float],
        t_t: FloatArray,
        y_t: Any,
    ) -> tuple[list[float], FloatArray]:
        arguments = (t, y, mode, held, self.program.p)
        return self.call("flow", arguments, t_t, y_t, len(y))

    def along(
        self,
        t: float,
        y: list[float],
        mode: Modes,
        held: list[float],
        t_t: FloatArray,
        y_t: Any,
    ) -> _Slide:
        """Return the slope along surfaces, as `integrators.sliding` has it, and the sigmas."""
        flags, size, functions = mode[self.program.layout.slides], len(y), self._lane
        traced: Any = functions.p
        w, sliding = traced.lanes, traced.course.sliding
        which = np.flatnonzero(flags).tolist()
        count = sliding.count = len(which)
        sliding.which[:count] = which
        on, modes = Held(functions, list(held), sliding), list(mode)
        slope, d_sigma = np.empty((size, t_t.size)), np.empty((count, t_t.size))
        for c in range(t_t.size):
            w.t[0] = float(t_t[c])
            w.shared[:] = self.numbers[c][0]
            for row, values in zip(w.own, self.numbers[c][1], strict=True):
                row[: len(values)] = values
            w.now.y[:] = [*y, *y_t[:, c].tolist()]
            slide_in_lanes(on, t, w.now.y, modes, w.now.f)
            slope[:, c], d_sigma[:, c] = w.now.f[size:], w.slide.sigma_t[:count]
        N = np.array([normal[:size] for normal in sliding.normals[:count]])
        return _Slide(np.array(w.now.f[:size]), slope, np.array(sliding.sigma[:count]), d_sigma, N)

    @cached_property
    def _lane(self) -> Functions:
        """One direction of a motion along surfaces, in Python."""
        program = self.program
        alone = TangentRun(program, self.directions, program.layout.y.size, None, lanes=1)
        plain, asked = equations(program).functions(located=True), machines_of(program.ieee)
        return alone.traced(plain, asked, as_lists)[0]

    # ------------------------------------------------------------------ switches
    def armed(self, t: float, y: list[float], mode: Modes) -> list[float]:
        """Return the signs that an arc starting here would freeze."""
        return armed(self.program, t, y, mode)

    def margins(
        self,
        relations: Sequence[int],
        t: float,
        y: list[float],
        mode: Modes,
        held: list[float],
        t_t: FloatArray,
        y_t: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the margins of relations, and of the sigma that ends a slide; their tangents."""
        program, own = self.program, len(self.program.strict)
        watch = [0] * own
        for r in relations:
            if r < own:
                watch[r] = 1
        arguments = (t, y, list(mode), program.p, watch)
        values, slopes = [0.0] * own, np.zeros((own, t_t.size))
        if any(watch):
            values, slopes = self.call("margins", arguments, t_t, y_t, own)
        if max(relations) >= own:
            slide = self.along(t, y, mode, held, t_t, y_t)
            sigma, d_sigma = slide.sigma, slide.d_sigma
        g, g_t = [], []
        for r in relations:
            if r < own:
                g.append(values[r])
                g_t.append(slopes[r])
            else:
                c, side = divmod(r - own, 2)
                sign = 1.0 if side else -1.0
                g.append(1.0 + sign * sigma[c])
                g_t.append(sign * d_sigma[c])
        return np.array(g), np.array(g_t)

    def observe(self, t: float, y: list[float], mode: Modes, y_t: FloatArray) -> FloatArray:
        """Return the tangents of what is observed, shape (observed, directions)."""
        program, size = self.program, self.program.layout.observed.size
        t_t = np.zeros(y_t.shape[1])
        flags = mode[program.layout.slides]
        modes = list(mode)
        if not any(flags):
            arguments = (t, y, modes, program.live, program.p)
            return self.call("observe", arguments, t_t, y_t, size)[1]
        surfaces, held = program.surfaces, self.armed(t, y, mode)
        slide = self.along(t, y, mode, held, t_t, y_t)
        sigma, d_sigma = slide.sigma, slide.d_sigma
        which, signs = np.flatnonzero(flags).tolist(), list(program.live)
        for k in which:
            if surfaces.machine[k] < 0:
                signs[surfaces.sign[k]] = 0.0
        total = np.zeros((size, t_t.size))
        if len(which) > 1:
            arguments = (t, y, modes, signs, program.p)
            total = (1.0 - len(which)) * self.call("observe", arguments, t_t, y_t, size)[1]
        for c, k in enumerate(which):
            sides = []
            for side in (1.0, -1.0):
                kept = go_to(surfaces, k, side, signs, modes)
                arguments = (t, y, modes, signs, program.p)
                sides.append(self.call("observe", arguments, t_t, y_t, size))
                go_back(surfaces, k, kept, signs, modes)
            (up, up_t), (low, low_t) = sides
            half = 0.5 * (np.array(up) - low)
            total += 0.5 * (up_t + low_t) + sigma[c] * 0.5 * (up_t - low_t)
            total += half[:, None] * d_sigma[c]
        return total
