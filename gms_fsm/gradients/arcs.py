"""Tangents along the arcs of a run: `integrators.runners.varying` on the numbers of a program."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.extras import has_machine_code
from gms_fsm.gradients.linear import Linear
from gms_fsm.lowering.compiling import notify, packed, store, text_of
from gms_fsm.lowering.program import Program
from integrators import METHODS, LoopOptions
from integrators.runners.varying import VaryArguments, vary, work
from integrators.steps import coefficients

METHOD = coefficients(METHODS["dp45"])


@dataclass(eq=False)
class Arcs:
    """What integrates the tangents of one run between its nodes.

    Parameters
    ----------
    linear : Linear
        The program and its tangents.
    options : LoopOptions
        How the run integrates.
    """

    linear: Linear
    options: LoopOptions

    def integrate(
        self,
        mode: tuple[int, ...],
        held: list[float],
        t: list[float],
        y: list[list[float] | None],
        S: FloatArray,
        sizes: FloatArray,
    ) -> FloatArray:
        """Return the tangents at the nodes, shape (nodes, m, directions), the first ones given.

        States that are None are not known.
        """
        size, directions = S.shape
        table = np.zeros((len(t), directions * size))
        table[0] = S.T.ravel()
        arguments = self._python._replace(
            held=held,
            mode=list(mode),
            t=np.array(t),
            known=np.array([int(row is not None) for row in y]),
            y=np.array([row or [0.0] * size for row in y]),
            table=table,
            sizes=sizes,
        )
        slides = any(mode[self.linear.program.layout.slides])
        if self._machine_code is None or slides:
            if slides:
                arguments = arguments._replace(flow=self._along(mode))
            lists: Any = (u.tolist() if isinstance(u, np.ndarray) else u for u in arguments)
            arguments = VaryArguments(*lists)
            vary(*arguments, directions, len(t))
            table[:] = arguments.table
        else:
            function, block = self._machine_code
            own = block.contents
            own.held[...], own.mode[...], own.sizes[...] = held, mode, sizes
            outside = {name: getattr(arguments, name) for name in ("t", "known", "y", "table")}
            shared, elements, _ = own.p
            tables = packed(self.linear.program.p)[2]
            block.update(
                own._replace(
                    **outside,
                    p=(shared, elements, tables),
                    moves=self._moves,
                    scales=self.linear.directions.scales,
                )
            )
            function(block, directions, len(t))
        return table.reshape(len(t), directions, size).transpose(0, 2, 1)

    def _along(self, mode: tuple[int, ...]) -> Any:
        """Return the flow along the surfaces slid on, for one direction."""
        along = self.linear.along

        def flow(t, y, _, held, p, dy, t_t, y_t, p_t, dy_t):  # type: ignore[no-untyped-def]
            del p
            y_t = np.array(y_t)[:, None]
            slide = along(t, y, mode, held, np.array([t_t]), y_t, [p_t])
            dy[:] = slide.f.tolist()
            dy_t[:] = slide.slope[:, 0].tolist()

        return flow

    @functools.cached_property
    def _moves(self) -> FloatArray:
        """What all numbers change by in each direction, one after the other."""
        rows = []
        longest = max(map(len, self.linear.program.p[1]), default=0)
        for shared, own in self.linear.numbers:
            padded = [u for row in own for u in (*row, *[0.0] * (longest - len(row)))]
            rows.append([*shared, *padded])
        return np.array(rows)

    @functools.cached_property
    def _python(self) -> VaryArguments:
        """The arguments that stay the same."""
        program, directions = self.linear.program, self.linear.directions
        p: Any = program.p
        size = program.layout.y.size
        longest = max(map(len, p[1]), default=0)
        scratch = work(size, len(p[1]), longest, len(p[0]), len(METHOD.B))
        return VaryArguments(
            method=METHOD,
            flow=self.linear.functions["flow"],
            p=p,
            moves=self._moves.tolist(),
            held=[],
            mode=[],
            t=[],
            known=[],
            y=[],
            table=[],
            sizes=[],
            scales=directions.scales.tolist(),
            tolerance=[self.options.rtol, *self.options.atol],
            work=scratch,
        )

    @functools.cached_property
    def _machine_code(self) -> tuple[Any, Any] | None:
        """The function and a block of its own; None without machine code."""
        if not has_machine_code():
            return None
        from integrators.machine_code.layout import MemoryBlock

        function, example = _compiled(self)
        block = MemoryBlock(function.layout, example)
        shared, own, _ = packed(self.linear.program.p)
        contents = block.contents
        contents.p[0][...], contents.p[1][...] = shared, own
        contents.tolerance[...] = self._python.tolerance
        return function, block


def _compiled(arcs: Arcs) -> tuple[Any, Any]:
    """Return machine code and the example that its block begins with."""
    program = arcs.linear.program
    key = arcs.linear.functions["text"], program.layout.modes, program.held
    if key not in _KEPT:
        if len(_KEPT) > MOST_KEPT:
            _KEPT.clear()
        _KEPT[key] = _translated(arcs)
    return _KEPT[key]


MOST_KEPT = 64
_KEPT: dict[Any, tuple[Any, Any]] = {}


def _translated(arcs: Arcs) -> tuple[Any, Any]:
    from integrators.machine_code.layout import OuterArray
    from integrators.runners import compiled

    program: Program = arcs.linear.program
    size, column = program.layout.y.size, OuterArray
    shared, own, _ = packed(program.p)
    example = arcs._python._replace(
        flow=arcs.linear.functions["plain flow"],
        p=(shared, own, column(table=True)),
        moves=column(table=True),
        held=[0.0] * program.held,
        mode=[0] * program.layout.modes,
        t=column(),
        known=column("i"),
        y=column("f", size),
        table=column(table=True),
        sizes=[0.0] * size,
        scales=column(),
    )
    text = text_of(program, arcs.linear.functions["text"])
    return compiled.varier(text, example, store(), notify), example
