"""What a format cannot express is refused by the place where it stands, and nothing is written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gms_fsm import Body, Chart, ChartModel, Contact, State, System, Transition, export
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ParameterError
from gms_fsm.run.settings import Settings
from tests.helpers import stick_slip

PAPER = stick_slip("signed")


def chart(guard: str = "v > 0", actions: Any = None, flow: str = "v", **parts: Any) -> Chart:
    """Return a chart of two states."""
    given: dict[str, Any] = {
        "variables": ("z",),
        "states": (State("a", flow={"z": flow}), State("b")),
        "transitions": (Transition("go", "a", "b", guard, actions or {}),),
        "outputs": {"F": "z"},
    }
    return Chart(**{"name": "own", **given, **parts})


def model(**parts: Any) -> ChartModel:
    """Return the same with numbers."""
    made = chart(**parts)
    return ChartModel(made, dict.fromkeys(made.parameter_names, 1.0))


def system(signal: Any = "0", *contacts: Contact) -> System:
    """Return a mass under a force."""
    body = Body("mass", inertia=1.0, force="f")
    pad = contacts or (Contact("pad", PAPER),)
    return System("driven", bodies=(body,), contacts=pad, signals={"f": signal})


def push(t: float) -> float:
    return 0.1 * t


PUSH = f"{Path(__file__).name}:{push.__code__.co_firstlineno}, push)"
KARNOPP = ChartModel(CHARTS["karnopp"], {"F_c": 1.0, "F_s": 1.5, "sigma_2": 0.4, "D": 1e-4})
READS_F, READS_A = chart("F > 1"), chart("a > 1")
ENTERED = chart(let={"twice": "2 * v"}, states=(State("a", entry={"z": "twice"}),), transitions=())
EDGES = Chart(
    "own", variables=("edges",), states=(State("a", flow={"edges": "v"}),), outputs={"F": "edges"}
)
CASES = chart(states=(State("a"), State("A")), transitions=())
ROWS: list[tuple[str, Any, str, str]] = [  # formats, what is given, place, word of the reason
    # locks, forces and accelerations in guards
    ("scxml transitions", CHARTS["karnopp"], "state 'stuck'", "locks"),
    ("fmu2 fmu3 matlab modelica st", KARNOPP, 'chart "Karnopp\'s model"', "locks"),
    ("scxml", CHARTS["backlash"], "edge 'leave_right': guard", "'F'"),
    ("scxml transitions", READS_A, "edge 'go': guard", "acceleration"),
    ("matlab modelica st", ChartModel(READS_F, {}), "edge 'go'", "'F'"),
    ("matlab modelica st", ChartModel(READS_A, {}), "edge 'go'", "'a'"),
    ("scxml transitions", chart(actions={"v": "0"}), "edge 'go': action 'v'", "velocity"),
    ("transitions", chart(actions={"z": "F"}), "edge 'go': action 'z'", "'F'"),
    ("transitions", chart(velocities=("v", "w"), outputs={"F": "v", "F_w": "w"}), "own", "v, w"),
    # names, words and functions of languages
    ("scxml", chart(parameters=("delete",)), "name 'delete'", "word"),
    ("scxml", chart(variables=("z", "Math")), "name 'Math'", "word"),
    ("scxml", chart(parameters=("σ",)), "name 'σ'", "ASCII"),
    ("scxml", chart(name="a\x00b"), "name", "'\\x00'"),
    ("scxml", chart(reference="\ufffe"), "reference", "U+FFFE"),
    ("c99 fmu2", model(parameters=("double",)), "'double'", "word"),
    ("matlab", model(parameters=("function",)), "parameter 'function'", "word"),
    ("modelica", model(parameters=("when",)), "parameter 'when'", "word"),
    ("st", model(parameters=("LReal",)), "parameter 'LReal'", "word"),
    ("st", model(parameters=("Z",)), "'z'", "one name"),
    ("st", ChartModel(CASES, {}), "state 'A'", "one name"),
    ("st", model(parameters=("k__1",), outputs={"F": "k__1 * z"}), "name 'k__1'", "underscores"),
    ("st", model(flow="v - tanh(z)"), "chart 'own'", "'tanh'"),
    ("st modelica", model(flow="v - asinh(z)"), "chart 'own'", "'asinh'"),
    ("matlab", ChartModel(EDGES, {}), "variable 'edges'", "field"),
    # numbers, first values, signals
    ("c99 fmu3 js matlab", chart(), "chart 'own'", "numbers"),
    ("c99 fmu2", ChartModel(ENTERED, {}), "contact 'friction'", "v is known"),
    ("fmu2 fmu3", system(push), "signal 'f'", "Python function"),
    ("js", system(push), "signal 'f'", PUSH),
    ("scxml transitions matlab", system(), "system 'driven'", "not a system of bodies"),
    # what is not used, or missing
    ("js", system(), "t_end", "needs its end"),
    ("js", system(), "settings", "rows"),
    ("c99", PAPER, "t_end", "does not use"),
    ("st", PAPER, "settings", "does not use"),
    ("c99", PAPER, "settings", "locate"),
]
OPTIONS = {  # by format and place
    ("js", "signal 'f'"): {"t_end": 1.0},
    ("js", "settings"): {"settings": Settings(output="end"), "t_end": 1.0},
    ("c99", "t_end"): {"t_end": 1.0},
    ("st", "settings"): {"settings": Settings()},
    ("c99", "settings"): {"settings": Settings(step=1e-3, events="held")},
}


@pytest.mark.parametrize(
    ("form", "given", "place", "word"),
    [(form, *row) for forms, *row in ROWS for form in forms.split()],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_refused(form: str, given: Any, place: str, word: str, tmp_path: Path) -> None:
    more: Any = OPTIONS.get((form, place), {})
    with pytest.raises(ParameterError) as caught:
        export(given, form, tmp_path / "out", name="it", **more)
    assert place in caught.value.place
    assert word in caught.value.reason
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("form", "name"), [("st", "step"), ("matlab", "k" * 52), ("transitions", "math"),
                       ("modelica", "z"), ("st", "Z"), ("fmu2", "double")]
)  # fmt: skip
def test_a_name_of_files_that_the_language_cannot_have(
    form: str, name: str, tmp_path: Path
) -> None:
    with pytest.raises(ParameterError) as caught:
        export(model(), form, tmp_path / "out", name=name)
    assert caught.value.place == f"name {name!r}"
    assert not (tmp_path / "out").exists()


def test_an_engine_without_a_plain_form_says_why(tmp_path: Path) -> None:
    files = export(ChartModel(READS_F, {}), "c99", tmp_path, name="it")
    assert not [each for each in files if "plain" in each.name]
    text = (tmp_path / "README-it-c99.md").read_text(encoding="utf-8")
    assert "There is no plain form: chart 'own', edge 'go': it reads 'F'" in text
