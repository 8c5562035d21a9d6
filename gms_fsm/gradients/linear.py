"""A program with tangents in several directions at once: its flow, and what else switches it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.gradients.tangents import ActiveNumbers, tangents
from gms_fsm.lowering.observing import armed
from gms_fsm.lowering.program import Program
from integrators.sliding import go_back, go_to

FEW = 6  # directions that are computed one by one: numbers are faster than short arrays
Modes = Sequence[int]


@dataclass(frozen=True)
class Directions:
    """Directions in which the numbers and the initial state change.

    Parameters
    ----------
    names : tuple of str
        As the user gave them.
    shared, own : mapping
        For each number that changes, by its place, what it changes by in each direction: shape
        (directions,), or (elements, directions).
    y : ndarray, shape (m, directions)
        Change of the initial state.
    scales : ndarray, shape (directions,)
        How much a number changes at most, for tolerances.
    """

    names: tuple[str, ...]
    shared: dict[int, FloatArray]
    own: dict[int, FloatArray]
    y: FloatArray
    scales: FloatArray

    @cached_property
    def places(self) -> ActiveNumbers:
        """Which numbers change."""
        return ActiveNumbers(frozenset(self.shared), frozenset(self.own))

    @property
    def count(self) -> int:
        """Number of directions."""
        return len(self.names)


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
        program, modes, signs = self.program, list(mode), list(held)
        surfaces, size = program.surfaces, len(y)
        which = np.flatnonzero(mode[program.layout.slides]).tolist()
        for k in which:
            if surfaces.machine[k] < 0:
                signs[surfaces.sign[k]] = 0.0
        f = np.zeros(size)
        slope = np.zeros((size, t_t.size))
        if len(which) > 1:
            one, slopes = self._plain(t, y, modes, signs, t_t, y_t)
            f, slope = (1.0 - len(which)) * np.array(one), (1.0 - len(which)) * slopes
        halves, half_slopes, normals, normal_slopes = [], [], [], []
        for k in which:
            sides = []
            for side in (1.0, -1.0):
                kept = go_to(surfaces, k, side, signs, modes)
                sides.append(self._plain(t, y, modes, signs, t_t, y_t))
                go_back(surfaces, k, kept, signs, modes)
            (up, up_t), (low, low_t) = sides
            f += 0.5 * (np.array(up) + low)
            slope = slope + 0.5 * (up_t + low_t)
            halves.append(0.5 * (np.array(up) - low))
            half_slopes.append(0.5 * (up_t - low_t))
            arguments = (k, t, y, modes, program.p)
            g, g_t = self.call("normal", arguments, t_t, y_t, size + 1)
            normals.append(np.array(g))
            normal_slopes.append(g_t)
        H, dH = np.array(halves), np.array(half_slopes)
        N, dN = np.array(normals), np.array(normal_slopes)
        A = N[:, :-1] @ H.T
        b = -(N[:, :-1] @ f + N[:, -1])
        dA = np.einsum("rjp,cj->rcp", dN[:, :-1], H) + np.einsum("rj,cjp->rcp", N[:, :-1], dH)
        db = -(np.einsum("rjp,j->rp", dN[:, :-1], f) + N[:, :-1] @ slope + dN[:, -1])
        try:
            sigma = np.linalg.solve(A, b)
            d_sigma = np.linalg.solve(A, db - np.einsum("rcp,c->rp", dA, sigma))
        except np.linalg.LinAlgError:
            sigma, d_sigma = np.full(len(which), np.nan), np.full((len(which), t_t.size), np.nan)
        f = f + sigma @ H
        slope = slope + np.einsum("cp,cj->jp", d_sigma, H) + np.einsum("c,cjp->jp", sigma, dH)
        return _Slide(f, slope, sigma, d_sigma, N[:, :-1])

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
