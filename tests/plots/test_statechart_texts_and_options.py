"""Texts of a chart: flows, forces, locks, guards, in both notations; counts of a run; options.

An edge that leaves several states is drawn, painted, counted and replayed once per source. A chart
with many edges is a matrix of sources and targets, with numbered guards.
"""

from __future__ import annotations

import html
import random
import re
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, SimulationError, Stribeck, Trace, simulate
from gms_fsm.app.report import dwell_times
from gms_fsm.charts import CHARTS, GMS_ELEMENT, LUGRE
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.language import MATLAB_LIKE, parse_condition, parse_value, spell
from gms_fsm.systems.models import ChartModel
from gms_fsm.systems.system import Body, Contact, System
from plots import LiveChart, mermaid
from plots.charts.labels import LONGEST_LINE, Tally, edge_id, wrapped
from plots.charts.notation import ChartWriter
from plots.charts.statechart import MOST_EDGES, ChartSheet, statechart
from plots.page._rows import page_rows
from plots.page._run import stored_run
from plots.page.chart import chart_svg
from plots.style import CHART_THEMES
from tests.helpers import stick_slip
from tests.plots.charts_to_draw import (
    LONG_GUARDS,
    MANY_EDGES,
    THREE_STATES,
    guard,
    random_chart,
)
from tests.plots.pictures import SVG, chart_picture, squeezed
from tests.plots.stored import integers
from tests.plots.systems_to_draw import END_STOP, PLANAR, SHARED, STICTION, TIMED

SIGNED = GMS_ELEMENT["signed"]


# --------------------------------------------------------------------------- notation
@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("z >= s and v > v_c", "z ≥ s(v) ∧ v > v_c"),
        ("z <= -s or v < -v_c", "z ≤ −s(v) ∨ v < −v_c"),
        ("not abs(z) < s", "¬(|z| < s(v))"),
        ("v ** 2 - (v / v_c) ** 10 > -1e-6", "v² − (v / v_c)¹⁰ > −10⁻⁶"),
        ("v ** 0.5 < 2.5e-7", "v^0.5 < 2.5·10⁻⁷"),
        ("sigma_0 * z <= pi", "σ₀ · z ≤ π"),
        ("sqrt(z) - (z - v) > 1e20", "√(z) − (z − v) > 10²⁰"),
        ("v ** -2 > max(z, s)", "v^(−2) > max(z, s(v))"),
        ("omega > 3", "ω > 3"),
    ],
)
def test_formulas(text: str, formula: str) -> None:
    names = ("v", "s", "z", "v_c", "sigma_0", "omega")
    chart = Chart("names", inputs=("v", "s"), variables=("z",), parameters=names[3:],
                  states=(State("a", flow={"z": "0"}),), outputs={"F": "z"})  # fmt: skip
    assert ChartWriter(chart, "math").text(parse_condition(text, names)) == formula


def test_rates_and_assignments() -> None:
    write, value = ChartWriter(LUGRE, "math"), parse_value("v", ["v"])
    assert write.flow("z", value) == "ż = v"
    assert write.flow("Δζ", value) == "dΔζ/dt = v"
    assert write.assignment("z", value) == "z := v"
    stops = Transition("stops", "a", "a", guard="True", actions={"z": "v", "Δζ": "v"})
    own = State("a", outputs={"F": "0"})
    chart = Chart("c", (), ("z", "Δζ"), states=(own,), transitions=(stops,))
    assert ChartWriter(chart, "math").actions(stops) == "/ z := v, Δζ := v"
    assert ChartWriter(chart, "stateflow").actions(stops) == "{z = v; Δζ = v;}"


# --------------------------------------------------------------------------- lines
def test_long_texts_are_broken_at_operators_and_nothing_is_lost() -> None:
    names = ("z", "w", "v", "s", "k", "v_c", "v_hi")
    for seed in range(30):
        rng = random.Random(seed)
        text = spell(parse_condition(guard(rng, rng.randint(1, 200)), names), MATLAB_LIKE)
        for limit in (24, 34, LONGEST_LINE):
            lines = wrapped(text, limit)
            assert " ".join(line.strip() for line in lines) == text, f"seed {seed}"
            assert max(map(len, lines)) <= limit
            assert all(line.startswith("  ") for line in lines[1:])
    assert wrapped("alpha * (beta + gamma) + d", 24) == ["alpha * (beta + gamma)", "  + d"]
    long = "x" * 60  # words are never broken
    assert wrapped(f"{long} > 1 && v > 2", 20) == [long, "  > 1 && v > 2"]
    assert wrapped("") == []


# --------------------------------------------------------------------------- forces and locks
def plain(rows: Any) -> list[str]:
    return ["".join(piece.text for piece in row) for row in rows]


def lines_of(chart: Chart, state: str) -> list[str]:
    """Return the lines in the box of a state, without the title."""
    (found,) = (each for each in chart.states if each.name == state)
    return plain(ChartSheet(chart).state_rows(found, 0)[1:])


def guards(chart: Chart, notation: str = "stateflow") -> list[tuple[str, str]]:
    """Return the source and the text of every edge."""
    sheet = ChartSheet(chart, notation)
    return [
        (edge.source, " ".join(plain(sheet.guard_rows(edge, n, 0))))
        for state in chart.states
        for n, (_, edge) in enumerate(chart.leaving(state.name), start=1)
    ]


@pytest.mark.parametrize(
    ("chart", "state", "texts"),
    [
        (STICTION, "stuck", ["locked: v = 0, F holds it"]),
        (STICTION, "forward", ["force: F = F_c + b * v;"]),
        (END_STOP, "free", ["force: F = 0;"]),
        (PLANAR, "start", ["force: F = F_c * h;", "       F_w = F_c * g;"]),
        (PLANAR, "stuck", ["locked: v = 0, w = 0, F and F_w hold them",
                           "exit: h = F / sqrt(F^2 + F_w^2);",
                           "      g = F_w / sqrt(F^2 + F_w^2);"]),
        (SHARED, "stick", ["during: dz = v;", "force: F = k * z;"]),
        (CHARTS["elasto-plastic"], "elastic", ["during: dz = v;"]),
    ],
    ids=lambda given: given if isinstance(given, str) else "",
)  # fmt: skip
def test_the_force_of_a_state(chart: Chart, state: str, texts: list[str]) -> None:
    assert lines_of(chart, state) == texts


def test_timers_impulses_and_guards_that_always_hold() -> None:
    assert ("stuck", "2[F > F_s &&   after(T_d)]") in guards(TIMED)
    assert not [line for s in TIMED.states for line in lines_of(TIMED, s.name) if "age" in line]
    assert ("rest", "1[true]") in guards(TIMED)
    assert ("rest", "1[⊤]") in guards(TIMED, "math")
    assert any(text.endswith("{v = -e * v;}") for _, text in guards(END_STOP))


def test_named_expressions_and_common_forces_are_below() -> None:
    assert plain(ChartSheet(SHARED).definitions()) == [
        "let: limit = F_c / k;",
        "     far = |z| / limit;",
        "force of the contact: F = sum(F) + b * v;",
    ]
    below = plain(ChartSheet(SHARED, "math").definitions())
    assert below[-1] == "force of the contact: F = ΣF + b · v"
    below = plain(ChartSheet(CHARTS["elasto-plastic"]).definitions())
    assert below[-1] == "force in all states: F = sigma_0 * z + sigma_1 * dz;"
    assert ChartSheet(LUGRE).definitions() == []  # of two states it stands in each
    assert lines_of(LUGRE, "bristle")[-1] == "force: F = sigma_0 * z + sigma_1 * dz;"


def test_values_at_the_start_are_below_the_states() -> None:
    chart = Chart("one", ("v",), ("z",), (), (State("a"),), (), {"F": "z"}, initial={"z": -0.5})
    assert plain(ChartSheet(chart).definitions()) == ["at the start: z = -0.5;"]
    assert "at the start#58; z = -0.5#59;" in str(mermaid(chart)).replace("#45;", "-")


def test_flows_that_all_states_share_are_said_once_below() -> None:
    chart = CHARTS["seven-parameter"]
    assert "during in all states: dv_l = (v - v_l) / tau_L;" in plain(
        ChartSheet(chart).definitions()
    )
    texts = [line for state in chart.states for line in lines_of(chart, state.name)]
    assert not [text for text in texts if "dv_l" in text]
    assert [text for text in texts if "dz" in text]


def test_the_mark_of_a_clause_stands_beside_it_and_other_charts_have_no_gap_for_it() -> None:
    for live in (False, True):
        sheet = ChartSheet(SIGNED, live=live)
        for edge in SIGNED.transitions:
            rows = plain(sheet.guard_rows(edge, 1, 0))
            mark = "✓" * live
            assert re.search(r"\w" + mark + " &&$", rows[0])
            assert re.search(r"\w" + mark + r"\]$", rows[-1])
    numbered = ChartSheet(SIGNED, live=True, numbered={"arrest": 3})
    assert plain(numbered.guard_rows(SIGNED.transitions[-1], 1, 0)) == ["1[g3✓✓]"]
    texts = chart_picture(SIGNED)["element1-guard-arrest"].texts
    assert texts == ["1", "[|v| <= v_c &&", "", "|z| < s]"]


def test_a_chart_from_left_to_right_keeps_short_guards_on_its_edges() -> None:
    for name in ("karnopp", "stiction", "planar-coulomb"):
        numbered = ChartSheet(CHARTS[name], direction="LR").fitted().numbered
        for edge in CHARTS[name].transitions:
            assert edge.name not in numbered or len(CHARTS[name].guard_text(edge.name)) >= 24


def test_every_chart_says_every_force() -> None:
    for name, chart in CHARTS.items():
        below = " ".join(plain(ChartSheet(chart).definitions()))
        for state in chart.states:
            own = " ".join(lines_of(chart, state.name))
            for force in chart.force_names:
                assert re.search(rf"\b{force}\b", own + below), (name, state.name, force)


def test_mermaid_says_the_same() -> None:
    text = html.unescape(re.sub(r"#(\d+);", r"&#\1;", mermaid(STICTION) + mermaid(SHARED)))
    for line in ("s1_stuck : locked: v = 0, F holds it", "note right of s1_stick"):
        assert line in text
    for line in plain(ChartSheet(SHARED).definitions()):
        assert line.strip() in text


# --------------------------------------------------------------------------- options
@pytest.mark.slow
def test_theme_direction_and_names_of_edges() -> None:
    colours, text = CHART_THEMES["dark"], statechart(SIGNED, 2, theme="dark").source
    assert colours.ink in text
    others = {*vars(CHART_THEMES["light"]).values()} - {*vars(colours).values()}
    assert not [colour for colour in others if colour in text]
    for direction in ("TB", "LR"):
        shown = chart_picture(SIGNED, direction=direction)
        stick, slip = (shown[f"element1-state-{name}"].box for name in ("stick", "slip"))
        assert (stick.right < slip.left) == (direction == "LR")
        assert (stick.bottom < slip.top) == (direction == "TB")
    for names in (False, True):
        texts = ["".join(box.texts) for box in chart_picture(SIGNED, names=names).groups.values()]
        for edge in SIGNED.transitions:
            assert any(edge.name in text for text in texts) == names


# --------------------------------------------------------------------------- counts
CURVE = Stribeck(1.0, 1.5, 0.05)
NUMBERS = {"k": 0.5, "v_c": 1e-3, "v_hi": 0.25}
COUNTED = {
    "bank, one way": (stick_slip("signed"), Prescribed("0.2"), 9.0),
    "three states": (
        ChartModel(THREE_STATES, NUMBERS, n=3, stribeck=CURVE),
        Prescribed("0.3*sin(2*pi*t/17)"),
        40.0,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", COUNTED)
def test_counts_are_those_of_the_run(name: str) -> None:
    trace = simulate(*COUNTED[name])
    chart, dwell, log = trace.model.chart, dwell_times(trace), trace.transitions
    some = trace.sample([trace.t[-1] / 2, trace.t[-1] / 3])  # the log is complete all the same
    for each in (trace, some):
        np.testing.assert_allclose(Tally(each).dwell, dwell, rtol=1e-12, atol=1e-12)
    shown = chart_picture(chart, trace.n, counts=trace)
    for i in range(trace.n):
        for column, state in enumerate(chart.states):
            text = shown[f"element{i + 1}-state-{state.name}"].texts[-1]
            found = re.fullmatch(r"active (\S+) s \((\d+) %\)", text)
            assert found
            assert float(found[1]) == pytest.approx(dwell[i, column], rel=1e-3)
            share = 100 * dwell[i, column] / dwell[i].sum()
            assert float(found[2]) == pytest.approx(share, abs=1)
        for edge in chart.transitions:
            count = int(((log.element == i) & (log.edge == edge.name)).sum())
            text = shown[f"element{i + 1}-guard-{edge.name}"].texts[-1]
            assert text == {0: "never taken", 1: "taken once"}.get(count, f"taken {count} times")
            (line,) = shown[f"element{i + 1}-edge-{edge.name}"].element.findall(SVG + "path")
            assert (line.get("stroke-dasharray") is not None) == (count == 0)
    assert "element1" in chart_picture(chart, 1, counts=trace).groups  # one of several is named


# --------------------------------------------------------------------------- several sources
RESET = Chart(
    "reset",
    inputs=("v", "t"),
    states=tuple(State(name, outputs={"F": "0"}) for name in ("low", "high", "off")),
    transitions=(
        Transition("up", "low", "high", guard="t >= 1"),
        Transition("stop", ("low", "high"), "off", guard="t >= 2"),
    ),
)


def test_an_edge_with_several_sources_is_one_line_for_each() -> None:
    source = statechart(RESET).source
    for state, priority in (("low", 2), ("high", 1)):
        name = f'"element1-guard-stop-from-{state}"'
        assert f'"element1-state-{state}" -> "element1-state-off"' in source
        (drawn,) = (line for line in source.splitlines() if line.strip().startswith(f"{name} ["))
        assert f"<B>{priority}</B>" in drawn
    assert "element1-guard-up-from" not in source
    assert [line.split(" : ")[0].strip() for line in mermaid(RESET).splitlines()[-3:]] == [
        "s1_low --> s2_high",
        "s1_low --> s3_off",
        "s2_high --> s3_off",
    ]
    # In a run low is left by the edge up, and high by the edge stop: that line is painted,
    # counted and replayed.
    bodies, contacts = (Body("mass", inertia=1.0),), (Contact("pad", RESET),)
    trace = simulate(System("reset", bodies=bodies, contacts=contacts), 3.0)
    svg = LiveChart(trace).frame(int(np.flatnonzero(trace.microstep)[-1]))
    fired = [line.split('"')[1] for line in svg.split("<g ") if "fired" in line]
    assert sorted(fired) == [
        "element1-edge-stop-from-high",
        "element1-guard-stop-from-high",
    ]
    source = statechart(RESET, counts=trace).source
    assert source.count("taken once") == 2
    assert source.count("never taken") == 1
    (contact,) = stored_run(page_rows(trace), [0], [])["contacts"]
    names = [(edge["name"], contact["states"][edge["source"]]) for edge in contact["edges"]]
    edges = integers(contact["log"][2])
    assert [names[edge] for edge in edges] == [("up", "low"), ("stop", "high")]


# --------------------------------------------------------------------------- matrices
@pytest.mark.slow
def test_a_chart_with_many_edges_a_wide_one_or_on_demand_is_a_matrix() -> None:
    names = [f"state_{i}" for i in range(12)]
    chain = Chart(  # would be wider than two pages from left to right
        "chain with a loop",
        inputs=("v",),
        states=tuple(State(name) for name in names),
        transitions=tuple(
            Transition(f"next_{i}", name, names[max(i - 1, 0)], guard="v > 0.1 and v < 0.2")
            for i, name in enumerate(names)
        ),
        outputs={"F": "v"},
    )
    for chart, form, direction, matrix in (
        (random_chart(1, 5, MOST_EDGES), "auto", "TB", False),
        (random_chart(1, 5, MOST_EDGES + 1), "auto", "TB", True),
        (MANY_EDGES, "graph", "TB", False),
        (THREE_STATES, "matrix", "TB", True),
        (chain, "auto", "TB", False),
        (chain, "auto", "LR", True),
    ):
        source = statechart(chart, form=form, direction=direction).source
        assert ("element1-target-1" in source) == matrix
        assert ("element1-default" in source) == (not matrix)


@pytest.mark.slow
def test_every_edge_is_in_the_cell_of_its_source_and_target() -> None:
    """Elements of a matrix are drawn once; edges with the same guard share a number."""
    chart, found = MANY_EDGES, chart_picture(MANY_EDGES, 3)
    assert found.of_class("region") == {"element1"}
    assert found["element1"].texts[:2] == ["Elements 1 to 3", "× 3"]
    rules = [found[name].line for name in found.groups if "-rule" in name]
    xs = sorted({line[0][0] for line in rules if line[0][0] == line[-1][0]})
    ys = sorted({line[0][1] for line in rules if line[0][1] == line[-1][1]})
    names = [state.name for state in chart.states]
    assert (len(xs), len(ys)) == (len(names) + 2, len(names) + 2)
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            shown = found[edge_id("element1", "guard", edge)]
            number = re.fullmatch(rf"{priority}\[(g\d+)\]", squeezed(*shown.texts))
            assert number
            assert squeezed(f"{number[1]} = {chart.guard_text(edge.name)}") in found.legend()
            row, column = names.index(edge.source) + 1, names.index(edge.target) + 1
            assert xs[column] <= shown.box.left
            assert shown.box.right <= xs[column + 1]
            assert ys[row] <= shown.box.top
            assert shown.box.bottom <= ys[row + 1]
    assert len(found.of_class("guard")) == len(chart.transitions)
    assert list(ChartSheet(SIGNED, form="matrix").fitted().numbered.values()) == [1, 2, 3]
    many = ChartSheet(MANY_EDGES).fitted()
    texts = {many.legend_text(edge) for edge in MANY_EDGES.transitions}
    assert len(set(many.numbered.values())) == len(texts) < len(MANY_EDGES.transitions)


@pytest.mark.slow
def test_a_matrix_marks_the_default_state_and_only_long_guards_are_numbered() -> None:
    found = chart_picture(THREE_STATES, form="matrix")
    titles = [found[f"element1-state-{state.name}"].texts[0] for state in THREE_STATES.states]
    assert titles[0] == "1  stick ●"
    assert not [title for title in titles[1:] if "●" in title]
    for state in THREE_STATES.states:
        assert "during:" in found[f"element1-state-{state.name}"].texts
    found = chart_picture(LONG_GUARDS)  # guards of six lines at most stand on the edges
    numbered = set(re.findall(r"g\d+(?==)", found.legend()))
    for edge in LONG_GUARDS.transitions:
        texts = found[edge_id("element1", "guard", edge)].texts
        number = re.search(r"\[(g\d+)\]", squeezed(*texts))
        assert not number or number[1] in numbered
        assert max(map(len, texts)) <= 36


@pytest.mark.slow
def test_a_live_chart_and_a_page_are_always_graphs() -> None:
    """The marks of the clauses of a numbered guard follow its number."""
    model = ChartModel(MANY_EDGES, NUMBERS, n=1, stribeck=CURVE)
    with pytest.raises(SimulationError) as failed:  # random guards: the chart switches for ever
        simulate(model, Prescribed("0.01"), 1e-3)
    trace: Trace = failed.value.trace
    shown = LiveChart(trace)
    (look,), svg = shown.look(0), shown.frame(0)
    assert look.leaving
    assert f'id="element1-edge-{look.leaving[0]}"' in svg
    assert svg.count('class="mark ') == sum(map(len, look.marks.values()))
    assert 'data-edge="39"' in chart_svg(MANY_EDGES, 1)


def test_a_name_longer_than_a_line_is_not_broken() -> None:
    assert wrapped("a" * 30, 20) == ["a" * 30]
