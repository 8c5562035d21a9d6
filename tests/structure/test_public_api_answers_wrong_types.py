"""A wrong type of value at any public entry raises an error of ours, or is accepted.

Every public function, constructor and method is found by introspection, and called with one wrong
argument and the others right. Unknown keywords are left to Python.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gms_fsm
import plots
from gms_fsm import (
    GMS,
    Belt,
    Bench,
    Body,
    Chart,
    ChartModel,
    Compensator,
    Contact,
    ElementMachines,
    Fit,
    FrictionBank,
    FrictionEquations,
    FrictionState,
    GMSError,
    GMSParameters,
    LuGre,
    Parameter,
    Prescribed,
    PulledSlider,
    Record,
    Sampled,
    Session,
    Settings,
    Slider,
    Spring,
    State,
    Stribeck,
    Supervisor,
    Sweep,
    System,
    SystemState,
    Trace,
    Transition,
    fit,
    prove,
    simulate,
    sweep,
)
from tests.helpers import matrix

for _module in ("llvmlite", "matplotlib", "z3", "pandas", "xarray"):
    pytest.importorskip(_module, reason="the walk uses all extras")

pytestmark = pytest.mark.slow

WRONG: tuple[Any, ...] = (None, object(), "x", -1, [], {}, math.nan, lambda: 0)
PARAMETERS = GMSParameters([2.0], [0.1], [0.1], sigma_2=0.4, stribeck=Stribeck(1, 1.5, 0.1), v_c=1)
MODEL = GMS(PARAMETERS, law="signed")
RIG = Prescribed("0.2*sin(t)")
SHAKEN = Prescribed("1e-4*sin(2*pi*t)")
STATE = State("on", {"z": "v"})
EDGE = Transition("go", "on", "on", guard="z > 1", actions={"z": "0"})
CHART = Chart("one", ("v",), ("z",), ("k",), (STATE,), (EDGE,), {"F": "k * z"})
BODY, CONTACT = Body("mass", inertia=1.0), Contact("pad", CHART, {"k": 1.0})
SYSTEM = System("one mass", bodies=(BODY,), contacts=(CONTACT,))
TIMES = np.arange(20.0)
FEWER = {
    "progress": WRONG[:-1],  # any function is accepted there
    "frames": WRONG[1:],  # None: the whole film
    "title": WRONG[:2],  # anything becomes text
    # The others are accepted, and draw or write for long.
    "export.folder": (None, -1, math.nan),
    "export.name": (None, -1, ""),
    "export.initial": (object(), "x", -1, math.nan),
    "export.t_start": (object(), "x", math.nan),
    "Fit.report.folder": (object(), -1),
}
# These take long to draw; landscape, animate and the methods of LiveChart stand for them.
DRAWN = {"handout", "phase", "LiveChart", "live_statechart", "explore", "play"}
# Classes that only the package creates, for users to read.
RECORDS = {"Coverage", "Finding", "Fit", "PhenomenaTable", "Record", "Report", "Sweep", "Trace"}
RECORDS |= {"Model", "Rig", "Signal"}  # protocols


# --------------------------------------------------------------------------- what is called on
@functools.cache
def _trace() -> Trace:
    return simulate(MODEL, RIG, 1.0)


@functools.cache
def _switching() -> Trace:
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    return simulate(model, Prescribed("0.2"), 3.0)


@functools.cache
def _swept() -> Sweep:
    return sweep(MODEL, RIG, 1.0, {"v_c": [1.0, 2.0]}, progress=False)


@functools.cache
def _rubbed() -> Record:
    t = np.linspace(0.0, 20.0, 200)
    return Record.from_arrays(time=t, position=np.sin(t), force=np.sign(np.cos(t)) + np.sin(t))


@functools.cache
def _fit() -> Fit:
    return fit(_rubbed(), MODEL, free=["k"], search="local")


def _settled() -> FrictionEquations:
    friction = FrictionEquations(MODEL)
    friction.settle(0.0, friction.initial, 0.5)
    return friction


OBJECTS: dict[str, Callable[[], Any]] = {
    "Trace": _trace,
    "Session": lambda: Session(MODEL, RIG, 1.0),
    "Sweep": _swept,
    "Coverage": lambda: gms_fsm.coverage(_trace()),
    "Chart": lambda: CHART,
    "Parameter": lambda: Parameter("k"),
    "Stribeck": lambda: PARAMETERS.stribeck,
    "GMSParameters": lambda: PARAMETERS,
    "GMS": lambda: MODEL,
    "LuGre": lambda: LuGre(sigma_0=1, sigma_1=1, sigma_2=1, stribeck=PARAMETERS.stribeck),
    "ChartModel": lambda: ChartModel(CHART, {"k": 1.0}),
    "Slider": lambda: Slider(1.0, "t"),
    "PulledSlider": lambda: PulledSlider(1.0, 1.0, 1.0),
    "Belt": lambda: Belt(1.0, 1.0, 1.0),
    "Prescribed": lambda: Prescribed("t"),
    "Settings": Settings,
    "System": lambda: SYSTEM,
    "Compensator": lambda: Compensator(MODEL, 1e-3),
    "ElementMachines": lambda: ElementMachines(MODEL),
    "FrictionBank": lambda: FrictionBank([MODEL]),
    "FrictionEquations": _settled,
    "FrictionState": lambda: FrictionState(MODEL),
    "SystemState": lambda: SystemState(SYSTEM),
    "Record": lambda: Record.from_arrays(time=TIMES, position=np.sin(TIMES), force=np.cos(TIMES)),
    "Fit": _fit,
    "Report": lambda: prove(CHART),
    "LiveChart": lambda: plots.LiveChart(_trace()),
}


# --------------------------------------------------------------------------- right arguments
@functools.cache
def right() -> dict[str, Any]:
    """Return valid arguments by name; "Entry.name" goes before.

    A dataclass is made of the fields of an example. What has a default and is not here is given its
    default.
    """
    examples = [make() for name, make in OBJECTS.items() if name not in RECORDS]
    examples += [BODY, CONTACT, STATE, EDGE, Bench(), Spring("shaft", "a", k=1.0)]
    idle = Chart("idle", velocities=(), states=(State("on"),))
    examples += [Supervisor("mode", idle)]
    examples += [Sampled("pid", period=1e-3, updates={"u": "t"}, initial={"u": 1.0})]
    found = {
        f"{type(example).__name__}.{each.name}": getattr(example, each.name)
        for example in examples
        if is_dataclass(example)
        for each in fields(example)
        if each.init
    }
    found |= _by_name()
    return found | {
        f"{name}.{key}": given[key] for name, given in _by_entry().items() for key in given
    }


def _by_name() -> dict[str, Any]:
    return {
        **dict.fromkeys(("branch", "element", "number", "row"), 0),
        **dict.fromkeys(("condition", "expression", "text"), "z > 1"),
        **dict.fromkeys(("system", "model", "model_or_contact"), MODEL),
        "alpha": [1.0],
        "chart": CHART,
        "column": "stick-slip",
        "dt": 0.1,
        "edge": "break_away_forward",
        "elements": 1,
        "graph": plots.block_diagram(1),
        "k": [2.0],
        "kind": "guard",
        "law": "signed",
        "models": [MODEL],
        "monitors": {},
        "name": "z",
        "path": Path("file.npz"),
        "points": 5,
        "records": _rubbed(),
        "rig": RIG,
        "settings": None,
        "speeds": [1e-3, 2e-3],
        "state": "stick",
        "stribeck": PARAMETERS.stribeck,
        "stroke": 1e-3,
        "t": 0.5,
        "t_end": 1.0,
        "times": [0.5],
        "trace": _trace(),
        "v": np.array(0.5),
        "v_c": 1.0,
        "values": {"z": {0: 0.1}},
        "weights": [1.0],
        "what": _trace(),
        "whose": "simulate",
        "y": FrictionEquations(MODEL).initial,
        "C": 0.1,
    }


def _by_entry() -> dict[str, dict[str, Any]]:
    return {
        "Chart.guard_text": {"edge": "go"},
        "Chart.state_index": {"name": "on"},
        "Compensator": {"model_or_fit": MODEL, "period": 1e-3},
        "Compensator.advance": {"reference": 0.1},
        "Coverage.contact": {"name": ""},
        "Coverage.merged": {"several": [gms_fsm.coverage(_trace())]},
        "Fit.bootstrap": {"draws": 2},
        "Fit.compare": {"others": _fit()},
        "Fit.predict": {"record": _rubbed()},
        "Fit.profile": {"name": "k1"},
        "Fit.score": {"record": _rubbed()},
        "FrictionBank": {"t": 0.0},
        "FrictionBank.from_array": {"array": FrictionBank([MODEL]).to_array()},
        "FrictionBank.restore": {"snapshot": FrictionBank([MODEL]).snapshot()},
        "FrictionEquations": {"t": 0.0},
        "FrictionState": {"t": 0.0},
        "FrictionState.from_array": {"array": FrictionState(MODEL).to_array()},
        "FrictionState.restore": {"snapshot": FrictionState(MODEL).snapshot()},
        **{
            f"{kind}.{name}": {"v0": v, "v1": v}
            for kind, v in (("FrictionState", 0.1), ("FrictionBank", [0.1]))
            for name in ("advance", "advance_to", "peek")
        },
        "Record.from_arrays": {"position": TIMES, "time": TIMES},
        "Session": {"t_end": 1.0},
        "Session.break_on": {"kind": "tested"},
        "Session.watch": {"expression": "z1", "text": "z1"},
        "System.body": {"name": "mass"},
        "SystemState": {"system": SYSTEM, "t": 0.0, "t_end": 1.0},
        "SystemState.restore": {"snapshot": SystemState(SYSTEM).snapshot()},
        "SystemState.peek": {"names": "x"},
        "SystemState.value": {"name": "x"},
        "System.contact": {"name": "pad"},
        "animate": {"path": Path("a.gif"), "frames": 2},
        "chart_diff": {"a": MODEL.chart, "b": MODEL.chart},
        "choose": {"candidates": {"bank": (MODEL, ["k"])}, "fold": "cycles", "cycles": 5.0},
        "describing_function": {"friction_or_system": MODEL, "amplitude": 0.1, "omega": 1.0},
        "diff": {"a": MODEL, "b": MODEL},
        "explore": {"initial": None, "settings": None, "t_start": 0.0, "t_end": 1.0}
        | {"sliders": {"v_c": (1e-9, 2.0)}},
        "export": {"folder": Path("c99"), "format": "c99", "name": "friction"},
        "fit": {"fixed": {"v_c": 1e-3}, "free": ["k"], "search": "local"},
        "handout": {"path": Path("a.pdf")},
        "initial_bank": {"n": 2, "v_c": None},
        "limit_cycle": {"rig": SHAKEN, "near": simulate(MODEL, SHAKEN, 2.0), "period": 1.0},
        "live_statechart": {"row": 0},
        "measure_phenomena": {"models": ["stiction"], "phenomena": ["stick-slip"]},
        "play": {"t_end": 1.0, "vary": {"v_c": (1e-9, 2.0)}},
        "preset": {"chosen": "ieee1"},
        "render": {"path": Path("a.dot")},
        "schematic": {"system": SYSTEM},
        "simulate": {"t_end": 1.0},
        "prepare": {"t_end": 1.0},
        "sweep": {"parameters": {"v_c": [1.0]}},
        "unfold": {"trace": _switching(), "t0": 1.0, "t1": 3.0},
        "write_replay": {"path": Path("a.html")},
    }


def _right(name: str, call: Callable[..., Any], skipped: int) -> dict[str, Any]:
    """Return valid arguments, by the signature."""
    found = {}
    for each in list(inspect.signature(call).parameters.values())[skipped:]:
        if each.kind is each.VAR_KEYWORD:
            if name in ("simulate", "prepare", "sweep", "Session", "explore", "play"):
                found |= {one.name: one.default for one in fields(Settings)}
            mine = [key for key in right() if key.rpartition(".")[0] == name]
            found |= {key.rpartition(".")[2]: right()[key] for key in mine}
        elif f"{name}.{each.name}" in right():
            found[each.name] = right()[f"{name}.{each.name}"]
        elif each.default is not each.empty:
            found[each.name] = each.default
        elif each.kind is not each.VAR_POSITIONAL:
            found[each.name] = right().get(each.name)
    return found


def _names() -> Iterator[str]:
    """Yield every public entry."""
    for home in (gms_fsm, plots):
        for name in home.__all__:
            call = getattr(home, name)
            if name not in RECORDS and not (isinstance(call, type) and issubclass(call, Exception)):
                yield name
    for kind in OBJECTS:
        for name, member in inspect.getmembers(_class(kind), callable):
            if not name.startswith("_") and not inspect.isclass(member):
                yield f"{kind}.{name}"


def _class(name: str) -> Any:
    return getattr(gms_fsm, name) if name in gms_fsm.__all__ else getattr(plots, name)


def entry(name: str) -> tuple[Callable[[], Callable[..., Any]], dict[str, Any]]:
    """Return an entry, made when it is called, and valid arguments."""
    kind, _, method = name.partition(".")
    if not method:
        return lambda: _class(name), _right(name, _class(name), 0)
    member = getattr(_class(kind), method)  # a class method is bound
    arguments = _right(name, member, 0 if inspect.ismethod(member) else 1)
    return lambda: getattr(OBJECTS[kind](), method), arguments


def _faults(name: str) -> Iterator[str]:
    make, arguments = entry(name)
    for place in arguments:
        for wrong in FEWER.get(f"{name}.{place}", FEWER.get(place, WRONG)):
            call = make()
            parameter = inspect.signature(call).parameters.get(place)
            if wrong is None and parameter is not None and parameter.default is None:
                continue
            try:
                call(**{**arguments, place: wrong})
            except GMSError:
                pass
            except Exception as error:
                yield f"{name}({place}={wrong!r}): {type(error).__name__}: {str(error)[:150]}"


@pytest.mark.parametrize("name", matrix([*_names()], {*_names()} - DRAWN))
@pytest.mark.filterwarnings("ignore")
def test_wrong_types_raise_our_errors(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if "." not in name:  # otherwise the wrong ones would be rejected for another reason
        make, arguments = entry(name)
        make()(**arguments)
    assert list(_faults(name)) == []
