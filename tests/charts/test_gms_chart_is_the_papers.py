"""The GMS chart is the paper's: its states, edges, guards, and both slip laws.

The oracle is written by hand from the table of the paper's chart (Fig. 2b), over a grid of
(z, s, v) that contains every boundary; chart, machines and generated if-else must agree with it.
"""

from __future__ import annotations

import math

import pytest

from gms_fsm import GMS, ElementMachines, GMSParameters, ParameterError, Prescribed, Stribeck
from gms_fsm.charts import GMS_ELEMENT, LAWS, SLIP_LAWS, gms_element
from gms_fsm.charts.parts import SUPPLIED
from gms_fsm.language import evaluate, names_in
from gms_fsm.lowering.program import lower

V_C = 1e-6
S = (0.4, 1.0, 1.5)


def _around(u: float) -> list[float]:
    return [math.nextafter(u, -math.inf), u, math.nextafter(u, math.inf)]


GRID = [
    (z, s, v)
    for s in S
    for z in [*_around(s), *_around(-s), *_around(0.0), 0.5 * s, -0.5 * s, 3 * s, -3 * s]
    for v in [*_around(V_C), *_around(-V_C), *_around(0.0), 0.2, -0.2]
]


def oracle(state: str, z: float, s: float, v: float) -> str | None:
    """Return the edge that is taken, derived by hand from the paper."""
    if state == "stick":
        if z >= s and v > V_C:
            return "break_away_forward"
        if z <= -s and v < -V_C:
            return "break_away_backward"
        return None
    if -V_C <= v <= V_C and -s < z < s:
        return "arrest"
    return None


@pytest.mark.parametrize("law", LAWS)
def test_states_edges_and_default(law: str) -> None:
    chart = GMS_ELEMENT[law]
    assert [state.name for state in chart.states] == ["stick", "slip"]
    assert chart.default_state.name == "stick"
    assert [(e.name, e.source, e.target) for e in chart.transitions] == [
        ("break_away_forward", "stick", "slip"),
        ("break_away_backward", "stick", "slip"),
        ("arrest", "slip", "stick"),
    ]
    assert all(not e.actions for e in chart.transitions), "z is never reset"
    assert all(not s.entry and not s.exit for s in chart.states)
    assert chart.variables == ("z",)
    assert set(chart.parameter_names) == {"k", "sigma", "C", "v_c"}
    assert set(chart.inputs) <= set(SUPPLIED)
    assert dict(chart.outputs) == {"F": "k * z + sigma * dz"}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("state", ["stick", "slip"])
def test_the_truth_table(law: str, state: str) -> None:
    chart = GMS_ELEMENT[law]
    for z, s, v in GRID:
        point = {"z": z, "s": s, "v": v, "v_c": V_C}
        enabled = [e.name for _, e in chart.leaving(state) if evaluate(chart.guards[e.name], point)]
        assert len(enabled) <= 1, "the guards of one state exclude each other"
        assert (enabled or [None])[0] == oracle(state, z, s, v), point


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("weight", S)
def test_machines_and_generated_text_have_the_same_truth_table(law: str, weight: float) -> None:
    # The dip is so narrow that s is `weight` at every v of the grid except near v = 0.
    parameters = GMSParameters(
        [1.0],
        [0.0],
        [1.0],
        sigma_2=0.0,
        v_c=V_C,
        stribeck=Stribeck(1.0, 1.5, 1e-300),
        weights=[weight],
    )
    model = GMS(parameters, law=law)  # type: ignore[arg-type]
    machines = ElementMachines(model)
    element = machines.elements[0]
    names = [edge.name for edge in model.chart.transitions]
    table = dict(zip(("stick", "slip"), machines.table(model.chart), strict=True))
    for v in sorted({v for _, _, v in GRID}):
        program = lower(model, Prescribed(v))
        s = weight * (1.5 if abs(v) < 1e-300 else 1.0)
        for z in [z for z, s_, v_ in GRID if s_ == weight and v_ == v]:
            element.z, element.s, element.v = z, s, v  # type: ignore[attr-defined]
            for mode, state in enumerate(("stick", "slip")):
                wanted = oracle(state, z, s, v)
                asked = [names[edge] for edge, guard in table[state] if guard.holds(element)]
                out = [0]
                program.functions["switch"](0.0, [0.0, z], [mode], program.p, [0], out)
                assert asked == ([wanted] if wanted else [])
                assert (names[out[0]] if out[0] >= 0 else None) == wanted


def test_slip_laws_are_the_two_of_the_literature() -> None:
    assert LAWS == ("signed", "published")
    assert SLIP_LAWS == {
        "published": "sgn(v) * C * (1 - z / s)",
        "signed": "C * (sgn(v) - z / s)",
    }
    for law in LAWS:
        stick, slip = GMS_ELEMENT[law].states
        assert dict(stick.flow) == {"z": "v"}
        assert dict(slip.flow) == {"z": SLIP_LAWS[law]}
        assert names_in(GMS_ELEMENT[law].flows["slip", "z"]) == {"v", "C", "z", "s"}


def test_laws_agree_forward_and_differ_backward() -> None:
    flows = {law: GMS_ELEMENT[law].flows["slip", "z"] for law in LAWS}
    for z, s, v in GRID:
        point = {"z": z, "s": s, "v": v, "C": 0.5}
        published, signed = (float(evaluate(flows[law], point)) for law in ("published", "signed"))
        if v > 0:
            assert published == pytest.approx(signed, rel=1e-15, abs=1e-16)
        elif v < 0:
            # -C (1 - z/s) against C (-1 - z/s): they differ by 2 C z / s.
            assert published - signed == pytest.approx(0.5 * 2 * z / s, rel=1e-12, abs=1e-15)
            assert (published == signed) == (abs(z) < 1e-300)
        else:
            assert published == 0.0
            assert signed == pytest.approx(-0.5 * z / s)


def test_there_is_no_default_law() -> None:
    with pytest.raises(ParameterError, match="law is missing; give law='signed' or 'published'"):
        gms_element()  # type: ignore[call-arg]
    with pytest.raises(ParameterError, match="law is missing; give law='signed' or 'published'"):
        GMS(GMSParameters.paper("stick-slip"))  # type: ignore[call-arg]
    with pytest.raises(ParameterError, match="give at most 1, the others by name: law="):
        GMS(GMSParameters.paper("stick-slip"), "signed")  # type: ignore[misc]
