"""The proofs of each chart: how many statements are proved, and what is not, and why.

Refuted: where N touches 0 and rises again at once, Modelica's contact is free for an instant.
"""

from __future__ import annotations

from collections import Counter

import pytest

pytest.importorskip("z3", reason="needs z3 (extra: check)")

from gms_fsm import Body, Contact, System, prove, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from tests.zoo.zoo_cases import MODELICA

EXP, SIN = "exp is not encoded", "sin is not encoded"
# Of each chart: proved, settled by order, refuted, and how many are undecided for which reason.
COUNTS: dict[str, tuple[int, int, int, dict[str, int]]] = {
    "karnopp": (38, 0, 0, {}),
    # The coefficient of friction has an exp, and with it the flow between Free and Forward.
    "modelica": (63, 8, 1, {EXP: 2}),
    "dahl": (7, 0, 0, {}),
    "lugre-sigma1": (7, 0, 0, {}),
    "reset-integrator": (22, 0, 0, {}),
    # Two pairs of states for chattering, three signs of v for stability.
    "elasto-plastic": (23, 0, 0, {SIN: 5}),
    "maxwell-slip": (22, 0, 0, {}),
    "prandtl-tomlinson": (5, 0, 0, {}),
    # The rate of psi falls with psi, so its equilibrium is stable; the proof would need exp.
    "rate-state-ageing": (4, 0, 0, {EXP: 3}),
    "rate-state-slip": (4, 0, 0, {"log is not encoded": 3}),
    # The exponent is a parameter, so the rate is no polynomial of z.
    "bouc-wen": (4, 0, 0, {"only integer powers up to 8 are encoded": 3}),
    # An arrest sets z such that F is continuous; a reversal of v is needed before the next edge.
    "seven-parameter": (37, 0, 0, {}),
    # Leaving stuck stores the direction of the load, which needs a root.
    "planar-coulomb": (20, 0, 0, {"sqrt is not encoded": 1}),
}


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", COUNTS)
def test_what_is_proved_and_why_the_rest_is_not(name: str) -> None:
    *decided, undecided = COUNTS[name]
    findings = prove(CHARTS[name], entry(name).domain).findings
    count = Counter(each.status for each in findings)
    kinds = ("proved", "settled by order", "refuted", "undecided")
    assert [count[kind] for kind in kinds] == [*decided, sum(undecided.values())]
    for reason, number in undecided.items():
        texts = [each.text for each in findings if each.status == "undecided"]
        assert sum(reason in text for text in texts) == number


@pytest.mark.slow
def test_the_refuting_point_of_modelica_is_an_instant_of_freedom() -> None:
    (finding,) = prove(CHARTS["modelica"], entry("modelica").domain).refuted
    assert finding.where == ("stuck", "lift", "free", "engage_at_rest")
    assert finding.counterexample["N"] == 0 < finding.counterexample["dN/dt"]
    pad = Contact("pad", CHARTS["modelica"], MODELICA, inputs={"N": "t"})
    system = System("one", bodies=(Body("body", inertia=1.0),), contacts=(pad,))
    assert simulate(system, 1.0).transitions.edge.tolist() == ["lift", "engage_at_rest"]
