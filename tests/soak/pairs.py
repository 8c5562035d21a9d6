"""Random pairs of charts: those that do the same are called so, and mutants never are.

``python -m tests.soak.pairs --count 1000 --seed 1`` prints each pair that is judged wrongly. A
mutant that is undecided is counted only.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator

from gms_fsm import diff
from tests.difference.pairs import equivalent_pair, mutant_pair
from tests.soak.trying import Seen, examine

FAR = 1_000_000  # pairs of one seed


def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Judge a pair that does the same, and one that does not."""
    number = given.seed * FAR + index
    for make, wanted in ((equivalent_pair, "equivalent"), (mutant_pair, "different")):
        pair = make(number)
        found = diff(pair.a, pair.b)
        wrong = found.equivalent if wanted == "different" else not found.equivalent
        finding = f"{pair.how}: {found.summary}" if wrong else ""
        counts = {f"{wanted}: {found.verdict}": 1}
        yield Seen(f"--index {index}", counts, finding, shown=[pair.how, found])


if __name__ == "__main__":
    examine("pairs", "Are pairs of charts judged right?", look, count=1000)
