"""The proofs of each chart: how many statements are proved, and what is not.

Undecided: the elasto-plastic model bends by a sine, which the solver does not know (two pairs of
states for chattering, three signs of v for stability); Modelica's coefficient of friction has an
exp, and with it the flow that leads from Free to Forward and back.

Refuted: where N touches 0 and rises again at once, Modelica's contact is free for an instant.
"""

from __future__ import annotations

from collections import Counter

import pytest

pytest.importorskip("z3", reason="needs z3 (extra: check)")

from gms_fsm import Body, Contact, Report, System, prove, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from tests.zoo.zoo_cases import MODELICA

# Proved, settled by order, refuted, undecided.
COUNTS = {
    "karnopp": (38, 0, 0, 0),
    "modelica": (63, 8, 1, 2),
    "dahl": (7, 0, 0, 0),
    "lugre-sigma1": (7, 0, 0, 0),
    "reset-integrator": (22, 0, 0, 0),
    "elasto-plastic": (23, 0, 0, 5),
    "maxwell-slip": (22, 0, 0, 0),
    "prandtl-tomlinson": (5, 0, 0, 0),
}


def report(name: str) -> Report:
    return prove(CHARTS[name], entry(name).domain)


@pytest.mark.parametrize("name", COUNTS)
def test_the_counts(name: str) -> None:
    count = Counter(finding.status for finding in report(name).findings)
    kinds = ("proved", "settled by order", "refuted", "undecided")
    assert tuple(count[kind] for kind in kinds) == COUNTS[name]


def test_few_statements_are_undecided() -> None:
    assert sum(row[3] for row in COUNTS.values()) < 0.1 * sum(map(sum, COUNTS.values()))


def test_what_is_undecided_is_known() -> None:
    for name, word in (("modelica", "exp"), ("elasto-plastic", "sin")):
        found = [each for each in report(name).findings if each.status == "undecided"]
        assert all(each.text.startswith(f"{word} is not encoded") for each in found)


def test_the_refuting_point_of_modelica_is_an_instant_of_freedom() -> None:
    (finding,) = report("modelica").refuted
    assert finding.where == ("stuck", "lift", "free", "engage_at_rest")
    assert finding.counterexample["N"] == 0 < finding.counterexample["dN/dt"]
    pad = Contact("pad", CHARTS["modelica"], MODELICA, inputs={"N": "t"})
    system = System("one", bodies=(Body("body", inertia=1.0),), contacts=(pad,))
    assert simulate(system, 1.0).transitions.edge.tolist() == ["lift", "engage_at_rest"]
