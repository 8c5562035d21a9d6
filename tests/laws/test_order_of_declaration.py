"""Bodies, contacts, signals and numbers may be declared in any order: the run is the same.

Sums of rounded numbers depend on it in their last digits, so the runs are compared at a tight
tolerance: the same switches of each contact, and the same end. Samplers that tick together take
their turns as they are declared; so do locks that share a load no law divides.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gms_fsm import System, Trace
from tests.corpus import Run, run

TIGHT = {"rtol": 1e-9, "atol": 1e-12, "engine": "ifelse", "t_eval": None}
DECLARED = (
    "system two blocks", "system servo", "system puck", "system pushed against a stop",
    "several rates", "loads", "every kind of contact", "random system 5",
)  # fmt: skip


def reversed_of(system: System) -> System:
    """Return the system with its parts in the opposite order."""
    return replace(
        system,
        bodies=system.bodies[::-1],
        contacts=system.contacts[::-1],
        signals=dict([*system.signals.items()][::-1]),
        numbers=dict([*system.numbers.items()][::-1]),
        flow=dict([*system.flow.items()][::-1]),
    )


def switches(one: Trace, contact: str) -> list[tuple[int, str]]:
    log = one.contact(contact).transitions
    return [(int(row.element), str(row.edge)) for row in log]


@pytest.mark.every(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", DECLARED)
def test_the_opposite_order(name: str) -> None:
    (system,), how = run(name).subject, {**run(name).how, **TIGHT}
    one = Run((system,), run(name).t_end, how)()
    other = Run((reversed_of(system),), run(name).t_end, how)()
    for contact in one.contacts:
        assert switches(one, contact) == switches(other, contact), contact
    mine, its = one.columns(), other.columns()
    assert {*mine} == {*its}
    for column in {*mine} - {"t", "microstep"}:
        if mine[column].dtype.kind == "f" and not column.startswith("slides"):
            size = np.nanmax(np.abs(mine[column]), initial=0.0)
            difference = np.abs(mine[column][-1] - its[column][-1])
            assert not difference > 1e-6 * size + 1e-12, column
