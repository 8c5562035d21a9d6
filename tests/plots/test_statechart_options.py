"""Notation, direction, theme and choice of elements change the look of a chart, not its content.

Texts of the math notation come from the same trees; every notation and theme draws any
guard completely; a wrong option is rejected with its value and what is allowed.
"""

from __future__ import annotations

import shutil
from itertools import combinations, product
from pathlib import Path
from xml.etree import ElementTree

import pytest

import gms_fsm.charts.chart
from gms_fsm.charts import GMS_ELEMENT, LUGRE
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ParameterError
from gms_fsm.language import parse_condition, parse_value
from plots._notation import Writer
from plots.render import render
from plots.statechart import chosen, statechart
from plots.style import CHART_THEMES
from tests.plots.test_statechart_shows_the_whole_chart import SVG, Drawn, squeezed

LOOKS = list(product(("stateflow", "math"), ("TB", "LR"), ("light", "dark")))
SIGNED = GMS_ELEMENT["signed"]

LONG_CLAUSE = " + ".join(f"k * abs(z - {i}) ** 2" for i in range(10)) + " >= s"
HOSTILE = Chart(
    name="größe & <b>]]></b> \"x\" 'y' \\N ; # ]",
    inputs=("v", "s"),
    variables=("z", "Δζ"),
    parameters=("k", "σ_2", "sigma_0", "v_ç"),
    states=(
        State("état", flow={"z": "v", "Δζ": "sigma_0 * v"}, entry={"z": "-1e-6"}),
        State("слип", flow={"z": "0", "Δζ": "min(v, 0) / 2e20"}),
    ),
    transitions=(
        Transition("länge", "état", "слип", guard=LONG_CLAUSE + " and v < v_ç and z > -Δζ"),
        Transition("zurück", "слип", "état", guard="v < 0 or z > s or not (z <= -s and v > 0)"),
    ),
    outputs={"F": "k * z + σ_2 * v"},
)


def drawn(graph: object, folder: Path) -> dict[str, Drawn]:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")
    svg = ElementTree.parse(render(graph, folder / "chart.svg"))  # type: ignore[arg-type]
    return {group.get("id", ""): Drawn(group) for group in svg.iter(SVG + "g")}


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
def test_math(text: str, formula: str) -> None:
    chart = Chart(
        name="names",
        inputs=("v", "s"),
        variables=("z",),
        parameters=("v_c", "sigma_0", "omega"),
        states=(State("a", flow={"z": "0"}),),
        transitions=(),
        outputs={"F": "z"},
    )
    names = chart.inputs + chart.variables + chart.parameter_names
    assert Writer(chart, "math").text(parse_condition(text, names)) == formula


def test_math_writes_rates_and_assignments() -> None:
    write = Writer(HOSTILE, "math")
    value = parse_value("v", ["v"])
    assert write.flow("z", value) == "ż = v"
    assert write.flow("Δζ", value) == "dΔζ/dt = v"
    assert write.assignment("z", value) == "z := v"
    assert write.actions({"z": value, "Δζ": value}) == "/ z := v, Δζ := v"
    assert Writer(HOSTILE, "stateflow").actions({"z": value}) == "{z = v;}"


@pytest.mark.parametrize(("notation", "direction", "theme"), LOOKS)
def test_every_look_shows_the_whole_hostile_chart(
    notation: str, direction: str, theme: str, tmp_path: Path
) -> None:
    look = {"notation": notation, "direction": direction, "theme": theme}
    shown = drawn(statechart(HOSTILE, 2, **look), tmp_path)  # type: ignore[arg-type]
    write = Writer(HOSTILE, notation)

    def plain(text: str) -> str:  # the index of a name is a text of its own, lowered
        return squeezed(text).replace("_", "") if notation == "math" else squeezed(text)

    for element in ("element1", "element2"):
        for state in HOSTILE.states:
            texts = squeezed(*shown[f"{element}-state-{state.name}"].texts)
            assert texts.startswith(state.name)
            for variable in HOSTILE.variables:
                flow = write.flow(variable, HOSTILE.flows[state.name, variable])
                assert plain(flow) in texts
        for edge in HOSTILE.transitions:
            guard = plain(write.text(HOSTILE.guards[edge.name]))
            texts = squeezed(*shown[f"{element}-guard-{edge.name}"].texts)
            assert texts == ("1[g1]" if edge.name == "länge" else f"1[{guard}]")
            assert edge.name != "länge" or squeezed(*shown["legend1"].texts) == f"g1={guard}"
    solid = [group for group in shown.values() if group.classes & {"state", "guard"}]
    assert not [(a.id, b.id) for a, b in combinations(solid, 2) if a.box.meets(b.box)]
    assert max(len(text) for group in solid for text in group.texts) <= 60


@pytest.mark.parametrize(("notation", "direction", "theme"), LOOKS)
def test_invalid_names(
    notation: str, direction: str, theme: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gms_fsm.charts.chart, "_check_name", lambda *_: None)  # let them through
    bad = 'slip</B></TD></TR></TABLE>>]; "evil:n" [label=<<B>\\N" & \x01[x] \\'
    chart = Chart(
        name='<x>"]; evil [label=<<B>x</B>>]; "\\\n\0>',
        inputs=("v",),
        variables=("z<I>\\G</I>",),
        parameters=(),
        states=(State(bad, flow={"z<I>\\G</I>": "v"}),),
        transitions=(Transition('a"]; evil -> evil [x="', bad, bad, guard="v > 0"),),
        outputs={"F": "v"},
    )
    graph = statechart(chart, notation=notation, direction=direction, theme=theme)
    shown = drawn(graph, tmp_path)
    assert sum("node" in group.classes for group in shown.values()) == 3
    assert sum("edge" in group.classes for group in shown.values()) == 3
    (state,) = (group for group in shown.values() if "state" in group.classes)
    assert squeezed(state.texts[0]) == squeezed(bad.replace("\x01", ""))


@pytest.mark.parametrize("theme", CHART_THEMES)
def test_a_theme_has_its_colours(theme: str, tmp_path: Path) -> None:
    colours = CHART_THEMES[theme]
    render(statechart(SIGNED, 2, theme=theme), tmp_path / "chart.dot")
    text = (tmp_path / "chart.dot").read_text(encoding="utf-8")
    assert colours.ink in text
    others = set(vars(CHART_THEMES["dark" if theme == "light" else "light"]).values())
    assert not [colour for colour in others - set(vars(colours).values()) if colour in text]


def _luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("theme", CHART_THEMES)
@pytest.mark.parametrize(
    ("role", "least"),
    [("ink", 7.0), ("holds", 4.5), ("fails", 4.5), ("soft", 4.5), ("active", 3.0), ("fired", 3.0)],
)
def test_contrast(theme: str, role: str, least: float) -> None:
    """WCAG: text 4.5, lines 3."""
    colours = CHART_THEMES[theme]
    light, dark = sorted((_luminance(getattr(colours, role)), _luminance(colours.paper)))[::-1]
    assert (light + 0.05) / (dark + 0.05) >= least


def test_elements_are_chosen_from_0_and_shown_from_1(tmp_path: Path) -> None:
    shown = drawn(statechart(SIGNED, [3, 0]), tmp_path)
    assert {name for name in shown if "region" in shown[name].classes} == {"element4", "element1"}
    assert shown["element4"].texts == ["Element 4", "AND 4"]
    assert shown["element4"].box.left < shown["element1"].box.left
    assert [group for group in shown.values() if group.id == "element4-state-slip"]
    assert chosen(range(2)) == (0, 1)
    one = drawn(statechart(SIGNED, [2]), tmp_path)  # the element must be named
    assert one["element3"].texts == ["Element 3", "AND 3"]


def test_direction_turns_the_layout(tmp_path: Path) -> None:
    for direction, across in (("TB", False), ("LR", True)):
        shown = drawn(statechart(SIGNED, direction=direction), tmp_path)
        stick, slip = (shown[f"element1-state-{name}"].box for name in ("stick", "slip"))
        assert (stick.right < slip.left) == across
        assert (stick.bottom < slip.top) == (not across)


def test_wrong_options_are_rejected() -> None:
    for name, allowed in (
        ("notation", "'stateflow' or 'math'"),
        ("direction", "'TB' or 'LR'"),
        ("theme", "'light' or 'dark'"),
        ("form", "'auto' or 'graph' or 'matrix'"),
    ):
        with pytest.raises(ParameterError, match=f"{name} is 'other'; it must be {allowed}"):
            statechart(LUGRE, **{name: "other"})  # type: ignore[arg-type]
    for elements in ([], [0, 0], [-1], [0, 1.5], "01", None):
        with pytest.raises(ParameterError, match=r"elements is .*; (it must be|the number of)"):
            statechart(LUGRE, elements)  # type: ignore[arg-type]


def test_names_of_edges_are_shown_on_request(tmp_path: Path) -> None:
    shown = {"".join(box.texts) for box in drawn(statechart(SIGNED), tmp_path).values()}
    named = {"".join(box.texts) for box in drawn(statechart(SIGNED, names=True), tmp_path).values()}
    for edge in SIGNED.transitions:
        assert not any(edge.name in text for text in shown)
        assert any(edge.name in text and "[" in text for text in named)
