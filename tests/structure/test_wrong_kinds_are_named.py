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
    Transition,
    simulate,
)
from gms_fsm.errors import ChartError, ExpressionError, GMSError, ParameterError, SessionError
from gms_fsm.run.sweep import sweep
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


def session() -> Session:
    return Session(MODEL, RIG, 3.0)


INNER: Any = {"states": (STICK,)}
KINDS = "name, flow, entry, exit, outputs and locked"
Z: Any = {"z": {"v": 1}}
SWEPT = {"k": [1.0, 2.0]}
TEXTS: Any = "tau=0"
NOT_CHARTS: list[Any] = [Machine(), Machine, MODEL, "GMS"]
REFUSED: list[tuple[str, type[GMSError], str, Callable[[], object]]] = [
    # texts by name
    *((f"state {each}", ChartError, f"state 'a': {each} is 'tau=0'; it gives a text for each name",
       lambda each=each: State("a", **({"flow": {"z": "v"}} | {each: TEXTS})))
      for each in ("entry", "exit", "flow")),
    ("actions", ChartError, "edge 'go': actions is 'tau=0'",
     lambda: Transition("go", "a", "b", "v > 0", actions=TEXTS)),
    ("outputs", ChartError, "outputs is 'tau=0'", lambda: _chart(outputs=TEXTS)),
    ("a dict is not an equation", ExpressionError,
     "state 'stick', flow of 'z'.*expected a text, got dict; allowed: a text in quotes",
     lambda: _chart(states=(State("stick", flow=Z),))),
    ("states do not nest", ChartError,
     f"state 'outer': a State takes {KINDS}, not 'states'; states do not nest",
     lambda: State(name="outer", flow={}, **INNER)),
    # states and edges
    *((f"{each} of {wrong}", ChartError, rf"{each} has .*write it as {kind}\(",
       lambda each=each, wrong=wrong: _chart(**{each: wrong}))
      for each, kind in (("states", "State"), ("transitions", "Transition"))
      for wrong in (("a", "b"), ({"name": "a"},), ((1, 2),))),
    *((f"no {each}", ChartError, f"{each} is None; give a tuple",
       lambda each=each: _chart(**{each: None})) for each in ("states", "transitions")),
    # models
    *((f"chart {k}", ParameterError, "chart is .*it must be a gms_fsm.Chart .*ElementMachines",
       lambda wrong=wrong: ChartModel(wrong, {"k": 1.0})) for k, wrong in enumerate(NOT_CHARTS)),
    *((f"n {n!r}", ParameterError, "n is .*; the number of elements must be an integer",
       lambda n=n: ChartModel(_chart(), {"k": 1.0}, n=n)) for n in (True, False, 1.5, 0, "1")),
    *((f"values {wrong}", ParameterError, "values is .*a number for each parameter",
       lambda wrong=wrong: ChartModel(_chart(), wrong)) for wrong in (None, [1.0], "k = 1")),
    *((f"machines of {kind}", ParameterError, "model is .*it must be a model",
       lambda wrong=wrong: ElementMachines(wrong))
      for kind, wrong in (("a chart", MODEL.chart), ("a rig", RIG), ("nothing", None))),
    # arguments of a sweep in another order
    *((f"sweep, {said}", ParameterError, said, lambda given=given: sweep(*given, engine="machines"))
      for said, given in (
          ("model is Prescribed.*it must be a model", (RIG, MODEL, 3.0, SWEPT)),
          ("rig is .*it must be a rig", (MODEL, SWEPT, RIG, 3.0)),
          ("model is .*it must be a model", (SWEPT, MODEL, RIG, 3.0)),
          ("t_end is .*it must be a number", (MODEL, RIG, SWEPT, 3.0)),
          (r"parameters is \[1.0\].*values by name.*sweep\(model, rig, t_end",
           (MODEL, RIG, 3.0, [1.0])))),
    # runs
    *((f"variable {name!r}", ParameterError, f"name is {name!r}; the chart has the variables z",
       lambda name=name: simulate(MODEL, RIG, 0.1).variable(name)) for name in ("zz", 3)),
    ("an edge is not an element", SessionError,
     r"no element 'arrest' \(to name an edge, use edge='arrest'\); there are 0 to 3",
     lambda: session().why("arrest")),
    *((f"element {wrong!r}", SessionError, f"no element {wrong!r}; there are 0 to 3",
       lambda wrong=wrong: session().why(wrong)) for wrong in (0.5, True, "nobody", None)),
]  # fmt: skip


@pytest.mark.parametrize(
    ("error", "said", "call"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED]
)
def test_it_is_named(error: type[GMSError], said: str, call: Callable[[], object]) -> None:
    with pytest.raises(error, match=said):
        call()
