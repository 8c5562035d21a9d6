"""Where the items of a layered layout stand across the layers: short, straight, symmetric lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

Segment = tuple[int, int]

STRAIGHT = 3.0  # weight of the parts of a line that passes rows, against 1 at a state
CENTRED = 0.3  # weight of a state above or below the middle of its labels
NARROW = 0.02


def places(
    wide: Sequence[tuple[float, float]],
    apart: Sequence[tuple[int, int, float]],
    segments: Sequence[Segment],
    offset: Mapping[Segment, float],
    sides: Sequence[tuple[int, Sequence[int]]],
    states: int,
) -> list[float]:
    """Return the place of each item, from a linear programme."""
    from scipy.optimize import linprog
    from scipy.sparse import csr_array

    count = len(wide)
    if count == 1:
        return [0.0]
    terms: list[tuple[dict[int, float], float, float]] = []  # |coefficients . x + constant|
    for upper, lower in segments:
        shift = offset.get((upper, lower), 0.0)
        ends = upper < states, lower < states
        weight = (2.0 if not shift else 1.0) if any(ends) else STRAIGHT
        terms.append(({upper: 1.0, lower: -1.0}, shift if ends[0] else -shift, weight))
    for state, others in sides:
        mean = dict.fromkeys(others, -1.0 / len(others))
        terms.append(({state: 1.0, **mean}, 0.0, CENTRED))
    terms += [({a: -1.0, b: 1.0}, 0.0, NARROW) for a, b, _ in apart]
    rows: list[tuple[dict[int, float], float]] = []
    for k, (coefficients, constant, _) in enumerate(terms):
        rows.append(({**coefficients, count + k: -1.0}, -constant))
        rows.append(({**{i: -c for i, c in coefficients.items()}, count + k: -1.0}, constant))
    rows += [({a: 1.0, b: -1.0}, -least) for a, b, least in apart]
    at = [(r, i, c) for r, (coefficients, _) in enumerate(rows) for i, c in coefficients.items()]
    where = np.array([(r, i) for r, i, _ in at]).T
    matrix = csr_array(([c for *_, c in at], where), shape=(len(rows), count + len(terms)))
    found = linprog(  # type: ignore[call-overload]  # matrices may be sparse
        [*[0.0] * count, *(weight for *_, weight in terms)],
        A_ub=matrix,
        b_ub=[limit for _, limit in rows],
        bounds=[(0, 1e6)] * (count + len(terms)),
        method="highs",
    )
    return [round(float(x), 1) for x in found.x[:count]]
