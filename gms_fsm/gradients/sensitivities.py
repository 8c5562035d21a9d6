"""The derivatives of a run, by the names of quantities and of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.arguments import unknown
from gms_fsm.gradients.directions import Directions
from gms_fsm.gradients.following import Followed
from gms_fsm.gradients.linear import Linear
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.lowering.program import Program


class TraceRows(Protocol):
    """The rows of a run."""

    @property
    def t(self) -> FloatArray:
        """Times, s."""

    @property
    def y(self) -> FloatArray:
        """States, shape (rows, m)."""

    @property
    def mode(self) -> NDArray[np.int64]:
        """Modes."""


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """The derivatives of a run.

    Parameters
    ----------
    directions : Directions
        By what it was differentiated.
    followed : Followed
        The tangents.
    seen : dict
        Those of observed quantities that were asked for, by name.
    """

    directions: Directions
    followed: Followed
    seen: dict[str, FloatArray] = field(default_factory=dict, repr=False)

    def column(self, to: str) -> int:
        """Return the place of a direction."""
        if to not in self.directions.names:
            raise unknown("sensitivity", to, self.directions.names, place="to")
        return self.directions.names.index(to)

    def times(self, to: str) -> FloatArray:
        """Return the derivatives of the times of all firings."""
        return self.followed.times[:, self.column(to)]

    def at_rows(
        self, program: Program, rows: TraceRows, of: str, to: str, which: str = ""
    ) -> FloatArray:
        """Return the derivatives of a quantity at the rows of the run."""
        c, layout = self.column(to), program.layout
        name = _name(layout, of, which)
        if name in layout.y.shared or name in layout.y.own:
            made: FloatArray = self.followed.rows[:, layout.y.where(name), c]
            return made
        if name not in self.seen:  # of all directions at once
            where, linear = layout.observed.where(name), Linear(program, self.directions)
            table = zip(
                rows.t.tolist(),
                rows.y.tolist(),
                rows.mode.tolist(),
                self.followed.rows,
                strict=True,
            )
            self.seen[name] = np.array([linear.observe(*row)[where] for row in table])
        return self.seen[name][..., c]


def _name(layout: SystemLayout, of: str, which: str) -> str:
    """Return what the layout calls a quantity."""
    known = dict(layout.keys)
    observed: Sequence[str] = (*layout.observed.shared, *layout.observed.own)
    known |= {name: name for name in observed if " " not in name}
    banks = layout.banks if len(layout.banks) == 1 else ()
    chosen = [bank for bank in layout.banks if bank.name == which]
    for bank in (*banks, *chosen):
        names = {name: name for name in (*layout.y.shared, *layout.y.own, *observed)}
        known |= {k: u for k, u in bank.plain(names).items() if " " not in k}
        known.setdefault("x", bank.position)
        if bank.velocity and bank.velocity not in known:
            known[bank.velocity] = bank.of(bank.velocity)
    if not isinstance(of, str) or of not in known:
        raise unknown("quantity", of, ("transitions", *known), place="of")
    return known[of]
