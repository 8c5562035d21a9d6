"""A chart picture says what force each state gives, and what a locked state holds."""

from __future__ import annotations

import html
import re

import pytest

from gms_fsm.charts import CHARTS, GMS_ELEMENT, LUGRE
from gms_fsm.charts.chart import Chart, State
from plots.mermaid import mermaid
from plots.statechart import Sheet
from tests.plots.systems_to_draw import BACKLASH, END_STOP, PLANAR, SHARED, STICTION, TIMED


def lines(chart: Chart, state: str, notation: str = "stateflow") -> list[str]:
    """Return the lines in the box of a state, without the title."""
    sheet = Sheet(chart, notation)
    (found,) = (each for each in chart.states if each.name == state)
    return ["".join(piece.text for piece in row) for row in sheet.state_rows(found, 0)[1:]]


def guards(chart: Chart, notation: str = "stateflow") -> list[tuple[str, str]]:
    """Return the source and the text of every edge."""
    sheet = Sheet(chart, notation)
    return [
        (edge.source, " ".join("".join(p.text for p in row) for row in rows))
        for state in chart.states
        for n, (_, edge) in enumerate(chart.leaving(state.name), start=1)
        for rows in (sheet.guard_rows(edge, n, 0),)
    ]


@pytest.mark.parametrize(
    ("chart", "state", "texts"),
    [
        (STICTION, "stuck", ["locked: v = 0, F holds it"]),
        (STICTION, "forward", ["force: F = F_c + b * v;"]),
        (BACKLASH, "left", ["force: F = k * (x + gap) + d * v;"]),
        (END_STOP, "free", ["force: F = 0;"]),
        (PLANAR, "start", ["force: F = F_c * h;", "       F_w = F_c * g;"]),
        (SHARED, "stick", ["during: dz = v;", "force: F = k * z;"]),
        (SHARED, "slip", ["during: dz = 0;", "force: F = k * z;"]),
    ],
    ids=lambda given: given if isinstance(given, str) else "",
)
def test_the_force_of_a_state(chart: Chart, state: str, texts: list[str]) -> None:
    assert lines(chart, state) == texts


def test_a_locked_state_of_several_velocities() -> None:
    """Variables that flow nowhere are not shown as flows."""
    assert lines(PLANAR, "stuck") == [
        "locked: v = 0, w = 0, F and F_w hold them",
        "exit: h = F / sqrt(F^2 + F_w^2);",
        "      g = F_w / sqrt(F^2 + F_w^2);",
    ]


def test_a_chart_without_variables_shows_its_only_force() -> None:
    damper = Chart("damper", parameters=("b",), states=(State("on"),), outputs={"F": "b * v"})
    assert lines(damper, "on") == ["force: F = b * v;"]


def test_the_timer_of_a_state_is_written_as_after() -> None:
    assert ("stuck", "2[F > F_s &&   after(T_d)]") in guards(TIMED)
    assert not [
        line for state in TIMED.states for line in lines(TIMED, state.name) if "age" in line
    ]


def test_a_guard_that_always_holds() -> None:
    assert ("rest", "1[true]") in guards(TIMED)
    assert ("rest", "1[⊤]") in guards(TIMED, "math")


def test_an_impulse_is_an_action() -> None:
    assert any(text.endswith("{v = -e * v;}") for _, text in guards(END_STOP))


def test_named_expressions_and_the_force_of_the_contact_are_below() -> None:
    below = ["".join(p.text for p in row) for row in Sheet(SHARED).definitions()]
    assert below == [
        "let: limit = F_c / k;",
        "     far = |z| / limit;",
        "force of the contact: F = sum(F) + b * v;",
    ]
    math = ["".join(p.text for p in row) for row in Sheet(SHARED, "math").definitions()]
    assert math[-1] == "force of the contact: F = ΣF + b · v"


@pytest.mark.parametrize("chart", [*GMS_ELEMENT.values(), LUGRE], ids=lambda chart: chart.name)
def test_a_force_that_is_the_same_in_all_states_stands_in_each(chart: Chart) -> None:
    assert Sheet(chart).definitions() == []
    for state in chart.states:
        assert len([line for line in lines(chart, state.name) if "force: F = " in line]) == 1


def test_charts_that_differ_in_their_force_only_look_different() -> None:
    one, other = (CHARTS[name] for name in ("lugre", "lugre-sigma1"))
    assert lines(one, "bristle")[:-1] == lines(other, "bristle")[:-1]
    assert lines(one, "bristle")[-1] == "force: F = sigma_0 * z + sigma_1 * dz;"
    assert lines(other, "bristle")[-1].startswith("force: F = sigma_0 * z + sigma_1 * exp(")


def test_one_force_of_three_states_is_said_once_below() -> None:
    chart = CHARTS["elasto-plastic"]
    assert not [line for s in chart.states for line in lines(chart, s.name) if "F" in line]
    below = ["".join(p.text for p in row) for row in Sheet(chart).definitions()]
    assert below[-1] == "force in all states: F = sigma_0 * z + sigma_1 * dz;"


def test_every_chart_says_every_force() -> None:
    for name, chart in CHARTS.items():
        below = " ".join("".join(p.text for p in row) for row in Sheet(chart).definitions())
        for state in chart.states:
            own = " ".join(lines(chart, state.name))
            for force in chart.force_names:
                assert re.search(rf"\b{force}\b", own + below), (name, state.name, force)


def test_mermaid_says_the_same() -> None:
    text = html.unescape(re.sub(r"#(\d+);", r"&#\1;", mermaid(STICTION) + mermaid(SHARED)))
    for line in (
        "s1_stuck : locked: v = 0, F holds it",
        "s2_forward : force: F = F_c + b * v;",
        "note right of s1_stick",
        "s1_stick : force: F = k * z;",
        "let: limit = F_c / k;",
        "force of the contact: F = sum(F) + b * v;",
    ):
        assert line in text
