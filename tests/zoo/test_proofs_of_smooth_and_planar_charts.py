"""Proofs of rate-and-state, Bouc-Wen, seven parameters and planar Coulomb: how many, and why not.

Each undecided finding is about a function that is not encoded, or about an edge that assigns.
"""

from __future__ import annotations

import pytest

pytest.importorskip("z3", reason="needs z3 (extra: check)")

from gms_fsm import prove
from gms_fsm.charts import CHARTS

# For each chart how many are proved, and the checks and reasons of the others.
EXPECTED: dict[str, tuple[int, dict[tuple[str, str], int]]] = {
    # The rate of psi falls with psi, so its equilibrium is stable; the proof would need exp.
    "rate-state-ageing": (4, {("stability", "exp is not encoded"): 3}),
    "rate-state-slip": (4, {("stability", "log is not encoded"): 3}),
    # The exponent is a parameter, so the rate is no polynomial of z.
    "bouc-wen": (4, {("stability", "only integer powers up to 8 are encoded"): 3}),
    # An arrest sets z such that F is continuous; a reversal of v is needed before the next edge.
    "seven-parameter": (37, {}),
    # Leaving stuck stores the direction of the load, which needs a root.
    "planar-coulomb": (20, {("livelock", "sqrt is not encoded"): 1}),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_what_is_proved_and_why_the_rest_is_not(name: str) -> None:
    proved, others = EXPECTED[name]
    findings = prove(CHARTS[name]).findings
    undecided = [each for each in findings if each.status == "undecided"]
    assert {each.status for each in findings} <= {"proved", "undecided"}
    assert (len(findings) - len(undecided), len(undecided)) == (proved, sum(others.values()))
    for (check, words), number in others.items():
        assert sum(each.check == check and words in each.text for each in undecided) == number
