"""An argument of the wrong type raises an error of ours that names it and says what is expected.

These calls were made by people who had read the documentation; each of them ended in an unclear
Python exception from deep inside the package.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from transitions import Machine

from gms_fsm import (
    Chart,
    ChartModel,
    ElementMachines,
    Prescribed,
    Session,
    State,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.errors import ChartError, ExpressionError, GMSError, ParameterError, SessionError
from gms_fsm.run.sweep import sweep
from plots import block_diagram
from tests.helpers import stick_slip

MODEL = stick_slip("signed")
RIG = Prescribed("0.2*sin(t)")
STICK = State("stick", flow={"z": "v"})


def _chart(**other: Any) -> Chart:
    parts: dict[str, Any] = {
        "name": "mine",
        "inputs": ("v",),
        "variables": ("z",),
        "parameters": ("k",),
        "states": (STICK,),
        "transitions": (),
        "outputs": {"F": "k * z"},
    }
    return Chart(**{**parts, **other})


@pytest.fixture(scope="module")
def trace() -> Trace:
    return simulate(MODEL, RIG, 3.0)


def _refused(error: type[GMSError], said: str, call: Callable[[], object]) -> None:
    with pytest.raises(error, match=said):
        call()


# --------------------------------------------------------------------------- charts and models
def test_texts_by_name() -> None:
    wrong: Any = "tau=0"
    for each in ("entry", "exit", "flow"):
        texts: Any = {"flow": {"z": "v"}, each: wrong}
        said = rf"state 'a': {each} is 'tau=0'; it gives a text for each name"
        _refused(ChartError, said, lambda texts=texts: State("a", **texts))
    said = "edge 'go': actions is 'tau=0'"
    _refused(ChartError, said, lambda: Transition("go", "a", "b", "v > 0", actions=wrong))
    _refused(ChartError, "outputs is 'tau=0'", lambda: _chart(outputs=wrong))


def test_a_state_has_no_states() -> None:
    inner: Any = {"states": (STICK,)}
    parts = "name, flow, entry, exit, outputs and locked"
    said = f"state 'outer': a State takes {parts}, not 'states'; states do not nest"
    _refused(ChartError, said, lambda: State(name="outer", flow={}, **inner))


@pytest.mark.parametrize("each", ["states", "transitions"])
@pytest.mark.parametrize("wrong", [("a", "b"), ({"name": "a"},), ((1, 2),)], ids=str)
def test_invalid_states_and_edges(each: str, wrong: Any) -> None:
    kind = each.removesuffix("s").capitalize()
    _refused(ChartError, rf"{each} has .*write it as {kind}\(", lambda: _chart(**{each: wrong}))
    _refused(ChartError, f"{each} is None; give a tuple", lambda: _chart(**{each: None}))


def test_a_dict_is_not_an_equation() -> None:
    wrong: Any = {"z": {"v": 1}}
    said = r"state 'stick', flow of 'z'.*expected a text, got dict; allowed: a text in quotes"
    _refused(ExpressionError, said, lambda: _chart(states=(State("stick", flow=wrong),)))


@pytest.mark.parametrize(
    "wrong", [Machine(), Machine, MODEL, "GMS"], ids=["machine", "class", "model", "text"]
)
def test_a_model_is_made_of_a_chart(wrong: Any) -> None:
    said = r"chart is .*it must be a gms_fsm.Chart .*ElementMachines"
    _refused(ParameterError, said, lambda: ChartModel(wrong, {"k": 1.0}))


@pytest.mark.parametrize("n", [True, False, 1.5, 0, "1"])
def test_how_many_elements(n: Any) -> None:
    said = "n is .*; the number of elements must be an integer"
    _refused(ParameterError, said, lambda: ChartModel(_chart(), {"k": 1.0}, n=n))
    if n != 1.5:
        _refused(ParameterError, "elements is .*an integer", lambda: block_diagram(n))


@pytest.mark.parametrize("values", [None, [1.0], "k = 1"])
def test_values_have_names(values: Any) -> None:
    said = "values is .*a number for each parameter"
    _refused(ParameterError, said, lambda: ChartModel(_chart(), values))


@pytest.mark.parametrize("wrong", [MODEL.chart, RIG, None])
def test_machines_are_made_of_a_model(wrong: Any) -> None:
    _refused(ParameterError, "model is .*it must be a model", lambda: ElementMachines(wrong))


# --------------------------------------------------------------------------- runs
def test_arguments_of_a_sweep_in_another_order() -> None:
    values = {"k": [1.0, 2.0]}
    said: list[tuple[str, tuple[Any, ...]]] = [
        ("model is Prescribed.*it must be a model", (RIG, MODEL, 3.0, values)),
        ("rig is .*it must be a rig", (MODEL, values, RIG, 3.0)),
        ("model is .*it must be a model", (values, MODEL, RIG, 3.0)),
        ("t_end is .*it must be a number", (MODEL, RIG, values, 3.0)),
        (
            r"parameters is \[1.0\].*values by name.*sweep\(model, rig, t_end",
            (MODEL, RIG, 3.0, [1.0]),
        ),
    ]
    for text, given in said:
        _refused(ParameterError, text, lambda given=given: sweep(*given, engine="machines"))


def test_an_unknown_variable(trace: Trace) -> None:
    for name in ("zz", 3):
        said = f"name is {name!r}; the chart has the variables z"
        _refused(ParameterError, said, lambda name=name: trace.variable(name))


def test_an_edge_is_not_an_element() -> None:
    session = Session(MODEL, RIG, 3.0)
    wrong: Any = "arrest"
    said = r"no element 'arrest' \(to name an edge, use edge='arrest'\); there are 0 to 3"
    _refused(SessionError, said, lambda: session.why(wrong))
    for wrong in (0.5, True, "nobody", None):
        said = f"no element {wrong!r}; there are 0 to 3"
        _refused(SessionError, said, lambda wrong=wrong: session.why(wrong))


# --------------------------------------------------------------------------- pictures
@pytest.mark.parametrize(
    "draw",
    [
        "overview",
        "ribbons_figure",
        "cascade_figure",
        "schematic_figure",
        "landscape",
        "unfold",
        "phase",
        "animate",
        "replay",
        "velocity",
    ],
)
@pytest.mark.parametrize("wrong", ["run.npz", MODEL], ids=["path", "model"])
def test_figures_need_a_trace(draw: str, wrong: Any) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    import plots
    from plots import figures, panels
    from plots.mechanism import schematic_figure

    calls: dict[str, Callable[[], object]] = {
        "overview": lambda: figures.overview(wrong),
        "ribbons_figure": lambda: figures.ribbons_figure(wrong),
        "cascade_figure": lambda: figures.cascade_figure(wrong),
        "schematic_figure": lambda: schematic_figure(wrong),
        "landscape": lambda: figures.landscape(wrong, 0),
        "unfold": lambda: figures.unfold(wrong, 0.0, 1.0),
        "phase": lambda: figures.phase(wrong),
        "animate": lambda: plots.animate(wrong, "film.gif"),
        "replay": lambda: plots.replay(wrong),
        "velocity": lambda: panels.velocity(None, wrong),  # type: ignore[arg-type]
    }
    said = r"trace is .*; it must be a Trace, from simulate\(...\) or Trace.load\(path\)"
    _refused(ParameterError, said, calls[draw])
