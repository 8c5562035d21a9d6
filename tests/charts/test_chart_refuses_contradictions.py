"""An inconsistent chart is refused when it is built, and building it runs nothing.

The message names the chart, the place (state, edge, output), what is wrong and what would be
allowed; an unreadable text is shown with its column and its owner.
"""

from __future__ import annotations

import builtins
import dataclasses
import re
from typing import Any

import pytest

from gms_fsm.charts.chart import RESERVED, Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.errors import ChartError, ExpressionError
from gms_fsm.language import CONSTANTS, FUNCTIONS, spell

STICK = State("stick", flow={"z": "v"})
SLIP = State("slip", flow={"z": "C * (sgn(v) - z / s)"})
GO = Transition("go", "stick", "slip", guard="z >= s and v > v_c")
BACK = Transition("back", "slip", "stick", guard="abs(v) <= v_c")


def chart(**changes: Any) -> Chart:
    """Return a valid chart with changes."""
    sound: dict[str, Any] = {
        "name": "rubber",
        "inputs": ("v", "s"),
        "variables": ("z",),
        "parameters": ("k", "C", "v_c"),
        "states": (STICK, SLIP),
        "transitions": (GO, BACK),
        "outputs": {"F": "k * z + 0.1 * dz"},
    }
    return Chart(**{**sound, **changes})


def edge(**changes: Any) -> dict[str, Any]:
    """Return the valid chart's edges with the first one changed."""
    return {"transitions": (dataclasses.replace(GO, **changes), BACK)}


def state(**changes: Any) -> dict[str, Any]:
    """Return the valid chart's states with the second one changed."""
    return {"states": (STICK, dataclasses.replace(SLIP, **changes))}


def test_the_valid_chart_is_accepted_with_its_parts() -> None:
    sound = chart()
    assert sound.default_state.name == "stick"
    assert [sound.state_index(name) for name in ("stick", "slip")] == [0, 1]
    assert [(i, t.name) for i, t in sound.leaving("slip")] == [(1, "back")]
    assert sound.guard_text("back") == "|v| <= v_c"
    assert spell(sound.flows["slip", "z"]) == "C * (sgn(v) - z / s)"
    with pytest.raises(dataclasses.FrozenInstanceError):
        sound.name = "other"  # type: ignore[misc]


def test_an_unknown_state_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ChartError, match=r"'rubber' has no state 'slide'.*'stick', 'slip'"):
        chart().state_index("slide")


def test_an_unknown_edge_is_refused_with_the_known_ones() -> None:
    for name in ("slide", None, ["go"]):
        with pytest.raises(ChartError, match=r"'rubber' has no edge .*'go', 'back'"):
            chart().guard_text(name)
    with pytest.raises(ChartError, match=r"'rubber' has no edge 'go'; its edges are none"):
        chart(transitions=()).guard_text("go")


def test_a_state_with_an_unknown_part_is_refused() -> None:
    with pytest.raises(ChartError, match=r"state 'stick': a State takes .*, not 'during'"):
        State("stick", flow={"z": "v"}, during="z = 0")  # type: ignore[call-arg]


def test_parts_that_make_no_sense_are_refused_at_once() -> None:
    with pytest.raises(ChartError, match="state 'slip': locked is 1; it must be True or False"):
        State("slip", locked=1)  # type: ignore[arg-type]
    with pytest.raises(ChartError, match="edge 'go': it leaves no state"):
        Transition("go", (), "slip", guard="v > 0")
    with pytest.raises(ExpressionError, match=r"contact_outputs 'F', column 5: unknown name 'k'"):
        chart(contact_outputs={"F": "F + k * z"})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (edge(source="glue"), ["edge 'go'", "source 'glue' is not a state", "'stick', 'slip'"]),
        (edge(target="glue"), ["edge 'go'", "target 'glue' is not a state", "'stick', 'slip'"]),
        (state(flow={"z": "v", "w": "1"}), ["state 'slip'", "'w' is not a variable", "'z'"]),
        (state(entry={"w": "1"}), ["state 'slip', entry", "'w' is not a variable"]),
        (state(exit={"k": "1"}), ["state 'slip', exit", "'k' is not a variable"]),
        (edge(actions={"s": "0"}), ["edge 'go', action", "'s' is not a variable"]),
        ({"states": (), "transitions": ()}, ["it has no states", "give at least one"]),
        ({"velocities": ()}, ["it has no velocity", "give at least one"]),
        ({"outputs": {}}, ["state 'stick': no output 'F'", "give one"]),
        ({"outputs": {"G": "k"}}, ["outputs: it has 'G'", "its forces are 'F'"]),
        ({"outputs": {"F": {"stick": "k * z"}}}, ["one text for all states", "State("]),
        (state(outputs={"G": "k"}), ["state 'slip', outputs: it has 'G'"]),
        (state(locked=True, outputs={"F": "k"}), ["state 'slip': it is locked", "leave it out"]),
        (state(flow={"z": "F"}), ["flow of 'z': it reads 'F'", "algebraic loop"]),
        (state(outputs={"F": "a"}), ["output 'F': it reads 'a'", "algebraic loop"]),
        ({"let": {"u": "k * z"}, "contact_outputs": {"F": "F + u"}}, ["'u', which reads 'k'"]),
        (edge(source=("stick", "glue")), ["edge 'go'", "source 'glue' is not a state"]),
        ({"let": {"k": "1"}}, ["'k' is used twice", "parameter and let"]),
        ({"velocities": ("v", "w"), "parameters": ("k", "C", "v_c", "F_w")}, ["'F_w' is taken"]),
        ({"states": (STICK, "slip")}, ["states has 'slip'", "write it as State("]),
        ({"transitions": (GO, None)}, ["transitions has None", "write it as Transition("]),
        (
            {"parameters": ("k", "C", Parameter("v_c", "m/s", "< v_max"))},
            ["parameter 'v_c'", "names 'v_max'", "'C', 'k'"],
        ),
        # one name, one meaning
        ({"parameters": ("k", "C", "v_c", "k")}, ["'k' is used twice", "parameter"]),
        ({"parameters": ("k", "C", "v_c", "z")}, ["'z' is used twice", "variable and parameter"]),
        ({"parameters": ("k", "C", "v_c", "dz")}, ["'dz' is used twice", "derivative"]),
        ({"inputs": ("v", "s", "k")}, ["'k' is used twice", "input and parameter"]),
        ({"states": (STICK, STICK)}, ["'stick' is used twice", "state"]),
        ({"transitions": (GO, GO)}, ["'go' is used twice", "edge"]),
        (edge(name="slip"), ["'slip' is used twice", "state and edge"]),
        (edge(name="k"), ["'k' is used twice", "parameter and edge"]),
        # names that are none, or taken
        ({"parameters": ("k", "C", "v_c", "t")}, ["parameter name 't' is taken", "only be inputs"]),
        ({"parameters": ("k", "C", "v_c", "x")}, ["parameter name 'x' is taken"]),
        ({"inputs": ("s",), "parameters": ("v",)}, ["parameter name 'v' is taken"]),
        ({"inputs": ("v",), "variables": ("s",)}, ["variable name 's' is taken"]),
        (edge(name="x"), ["edge name 'x' is taken"]),
        ({"parameters": ("k", "C", "v_c", "2k")}, ["'2k' is not a name", "letters, digits"]),
        ({"parameters": ("k", "C", "v_c", "")}, ["parameter name '' is not a name"]),
        ({"parameters": ("k", "C", "v_c", "k 2")}, ["'k 2' is not a name"]),
        ({"parameters": ("k", "C", "v_c", "if")}, ["'if' is not a name", "keyword"]),
        (
            {"parameters": ("k", "C", "v_c", 3)},
            ["parameters has 3", "Parameter('k', 'N/m',"],
        ),
        ({"parameters": "k C"}, ["parameters is 'k C', not a tuple", "('k C',)"]),
        ({"variables": "z"}, ["variables is 'z', not a tuple", "('z',)"]),
        ({"states": STICK}, ["states is State(...), not a tuple", "(State(...),)"]),
        ({"transitions": GO}, ["transitions is Transition(...), not a tuple"]),
        (edge(name="go on"), ["edge name 'go on' is not a name"]),
        (state(name="slip!"), ["state name 'slip!' is not a name"]),
        ({"parameters": ("k", "C", "v_c", "_k")}, ["'_k' is reserved"]),
        (edge(name="on_exit"), ["edge name 'on_exit' is reserved"]),
        (edge(name="is_stick"), ["edge name 'is_stick' is reserved"]),
        (edge(name="may_go"), ["edge name 'may_go' is reserved"]),
        (state(name="to_slip"), ["state name 'to_slip' is reserved"]),
        # two spellings of one letter would be two names for the reader and one for Python
        ({"parameters": ("k", "C", "v_c", "\u017f")}, ["'\u017f'", "NFKC"]),
        ({"parameters": ("k", "C", "v_c", "e\u0301")}, ["NFKC"]),
        (edge(name="\U0001d467"), ["NFKC"]),
    ],
)
def test_a_contradiction_is_refused_with_its_place(
    changes: dict[str, Any], words: list[str]
) -> None:
    with pytest.raises(ChartError) as caught:
        chart(**changes)
    for word in ["chart 'rubber'", *words]:
        assert word in str(caught.value)


@pytest.mark.parametrize("name", sorted(RESERVED))
@pytest.mark.parametrize("kind", ["parameter", "variable", "state", "edge"])
def test_names_used_by_the_generated_code_are_reserved(name: str, kind: str) -> None:
    changes = {
        "parameter": {"parameters": ("k", "C", "v_c", name)},
        "variable": {
            "variables": ("z", name),
            "states": tuple(State(s.name, {**s.flow, name: "0"}) for s in (STICK, SLIP)),
        },
        "state": {"states": (STICK, SLIP, State(name, {"z": "0"}))},
        "edge": edge(name=name),
    }[kind]
    with pytest.raises(ChartError, match=rf"{kind} name '{name}' is reserved"):
        chart(**changes)


def test_the_words_of_the_language_are_reserved() -> None:
    assert set(FUNCTIONS) | set(CONSTANTS) <= RESERVED


@pytest.mark.parametrize(
    ("changes", "owner", "text", "column", "allowed"),
    [
        (edge(guard="z >= s and u > v_c"), "edge 'go', guard", "z >= s and u > v_c", 12, "v_c"),
        (edge(guard="z"), "edge 'go', guard", "z", 1, "v > v_c"),
        (edge(guard="z == s"), "edge 'go', guard", "z == s", 6, "< <= > >="),
        (edge(guard="dz > 0"), "edge 'go', guard", "dz > 0", 1, "v, s, z, k, C, v_c"),
        (edge(guard="x > 0"), "edge 'go', guard", "x > 0", 1, "v, s, z, k, C, v_c"),
        (edge(guard=""), "edge 'go', guard", "", 1, "numbers"),
        (edge(guard="\u00e9 > z.real"), "edge 'go', guard", "\u00e9 > z.real", 1, "v, s, z"),
        (state(flow={"z": "v > 0"}), "state 'slip', flow of 'z'", "v > 0", 1, "numbers"),
        (state(flow={"z": "2 * vv"}), "state 'slip', flow of 'z'", "2 * vv", 5, "v, s, z"),
        (state(entry={"z": "1 +* v"}), "state 'slip', entry 'z'", "1 +* v", 4, "numbers"),
        (state(exit={"z": "G"}), "state 'slip', exit 'z'", "G", 1, "v, s, z"),
        (edge(actions={"z": "s s"}), "edge 'go', action 'z'", "s s", 3, "numbers"),
        ({"outputs": {"F": "k * zz"}}, "output 'F'", "k * zz", 5, "v, s, z, k, C, v_c, dz"),
        ({"outputs": {"F": "z > 1"}}, "output 'F'", "z > 1", 1, "numbers"),
    ],
)
def test_an_unreadable_text_is_shown_with_its_owner_and_column(
    changes: dict[str, Any], owner: str, text: str, column: int, allowed: str
) -> None:
    with pytest.raises(ExpressionError) as caught:
        chart(**changes)
    error = caught.value
    assert error.where == f"chart 'rubber', {owner}"
    assert (error.text, error.column) == (text, column)
    assert allowed in error.allowed
    assert str(error).startswith(f"chart 'rubber', {owner}, column {column}: ")
    assert f"\n    {text}\n" in str(error)


@pytest.mark.parametrize("text", [None, 3, b"v", ["v"]])
def test_values_other_than_text_are_refused(text: Any) -> None:
    for changes in (edge(guard=text), state(flow={"z": text}), {"outputs": {"F": text}}):
        with pytest.raises(ExpressionError, match="expected a text"):
            chart(**changes)


def test_building_a_chart_runs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def forbidden(*_: object, **__: object) -> None:
        raise AssertionError("a chart was executed while it was built")

    for name in ("eval", "exec"):
        monkeypatch.setattr(builtins, name, forbidden)
    # Every one of these would fail or never end if it were computed.
    built = chart(
        **edge(guard="1 / 0 > 0 or sqrt(-1) > 0"),
        outputs={"F": "exp(1e300) / 0"},
        states=(State("stick", {"z": "1 / 0"}, entry={"z": "0 ** -1"}), SLIP),
    )
    assert spell(built.flows["stick", "z"]) == "1.0 / 0.0"


def test_sequences_become_tuples_and_texts_cannot_be_changed_afterwards() -> None:
    flow, outputs = {"z": "v"}, {"F": "k * z"}
    built = chart(states=[State("stick", flow), SLIP], transitions=[GO, BACK], outputs=outputs)
    assert isinstance(built.states, tuple)
    assert isinstance(built.transitions, tuple)
    flow["z"], outputs["F"] = "-v", "0"
    # What is drawn and printed (the texts) has to stay what is computed (the trees).
    assert built.states[0].flow["z"] == spell(built.flows["stick", "z"])
    assert built.outputs["F"] == spell(built.forces["slip", "F"])


def test_names_may_contain_the_unicode_that_python_allows() -> None:
    built = chart(
        parameters=("k", "C", "v_c", "\u03c3"),
        outputs={"F": "\u03c3 * z"},
        name="\u0413\u041c\u0421",
    )
    assert spell(built.forces["stick", "F"]) == "\u03c3 * z"


def test_messages_have_no_line_breaks_except_before_the_shown_text() -> None:
    with pytest.raises(ChartError) as caught:
        chart(**edge(source="gl\nue"))
    assert re.search(r"source 'gl\\nue' is not a state", str(caught.value))
    assert "\n" not in str(caught.value)
