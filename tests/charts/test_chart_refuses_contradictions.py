"""An inconsistent chart is refused when it is built, and building it runs nothing.

The message names the chart, the place (state, edge, output), what is wrong and what would be
allowed; an unreadable text is shown with its column and its owner.
"""

from __future__ import annotations

import builtins
import dataclasses

import pytest

from gms_fsm.charts.parts import RESERVED, State
from gms_fsm.errors import ChartError
from gms_fsm.language import CONSTANTS, FUNCTIONS, YIELDING, spell
from tests.refusals import BACK, GO, SLIP, STICK, chart, edge


def test_the_valid_chart_is_accepted_with_its_parts() -> None:
    sound = chart({})
    assert sound.default_state.name == "stick"
    assert [sound.state_index(name) for name in ("stick", "slip")] == [0, 1]
    assert [(i, t.name) for i, t in sound.leaving("slip")] == [(1, "back")]
    assert sound.guard_text("back") == "|v| <= v_c"
    assert spell(sound.flows["slip", "z"]) == "C * (sgn(v) - z / s)"
    parts = ((sound, "name"), (sound.states[0], "flow"), (sound.transitions[0], "guard"))
    for part, attribute in parts:
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, attribute, "another")
    assert not {"guards=", "flows=", "assignments=", "forces="} & {*repr(sound).split("(")}
    assert sound == chart({})


@pytest.mark.parametrize("kind", ["parameter", "variable", "state", "edge"])
def test_names_used_by_the_generated_code_are_reserved(kind: str) -> None:
    for name in sorted(RESERVED):
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
            chart(changes)


def test_the_words_of_the_language_are_reserved() -> None:
    assert {*FUNCTIONS, *CONSTANTS} - {*YIELDING} <= RESERVED


def test_building_a_chart_runs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def forbidden(*_: object, **__: object) -> None:
        raise AssertionError("a chart was executed while it was built")

    for name in ("eval", "exec"):
        monkeypatch.setattr(builtins, name, forbidden)
    # Every one of these would fail or never end if it were computed.
    built = chart(
        {
            **edge(guard="1 / 0 > 0 or sqrt(-1) > 0"),
            "outputs": {"F": "exp(1e300) / 0"},
            "states": (State("stick", {"z": "1 / 0"}, entry={"z": "0 ** -1"}), SLIP),
        }
    )
    assert spell(built.flows["stick", "z"]) == "1.0 / 0.0"


def test_sequences_become_tuples_and_texts_cannot_be_changed_afterwards() -> None:
    flow, outputs = {"z": "v"}, {"F": "k * z"}
    states = [State("stick", flow), SLIP]
    built = chart({"states": states, "transitions": [GO, BACK], "outputs": outputs})
    assert isinstance(built.states, tuple)
    assert isinstance(built.transitions, tuple)
    flow["z"], outputs["F"] = "-v", "0"
    # What is drawn and printed (the texts) has to stay what is computed (the trees).
    assert built.states[0].flow["z"] == spell(built.flows["stick", "z"])
    assert built.outputs["F"] == spell(built.forces["slip", "F"])


def test_names_may_contain_the_unicode_that_python_allows() -> None:
    parameters, force = ("k", "C", "v_c", "\u03c3"), {"F": "\u03c3 * z"}
    built = chart({"parameters": parameters, "outputs": force, "name": "\u0413\u041c\u0421"})
    assert spell(built.forces["stick", "F"]) == "\u03c3 * z"
