"""A wrong type of value at any public entry raises an error of ours, or is accepted.

Every public function, constructor and method is found by introspection, and called with one wrong
argument and the others right. Unknown keywords are left to Python.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gms_fsm
import plots
from gms_fsm import (
    GMS,
    Bench,
    Body,
    Chart,
    ChartModel,
    Contact,
    Element,
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
    Session,
    Settings,
    Slider,
    State,
    Stribeck,
    Sweep,
    System,
    Trace,
    Transition,
    fit,
    prove,
    simulate,
    sweep,
)

for _module in ("llvmlite", "matplotlib", "z3", "pandas", "xarray"):
    pytest.importorskip(_module, reason="the walk uses all extras")

WRONG: tuple[Any, ...] = (None, object(), "x", -1, [], {}, math.nan, lambda: 0)
PARAMETERS = GMSParameters([2.0], [0.1], [0.1], sigma_2=0.4, stribeck=Stribeck(1, 1.5, 0.1), v_c=1)
MODEL = GMS(PARAMETERS, law="signed")
RIG = Prescribed("0.2*sin(t)")
STATE = State("on", {"z": "v"})
EDGE = Transition("go", "on", "on", guard="z > 1", actions={"z": "0"})
CHART = Chart("one", ("v",), ("z",), ("k",), (STATE,), (EDGE,), {"F": "k * z"})
BODY, CONTACT = Body("mass", inertia=1.0), Contact("pad", CHART, {"k": 1.0})
SYSTEM = System("one mass", bodies=(BODY,), contacts=(CONTACT,))
FEWER = {
    "progress": WRONG[:-1],  # any function is accepted there
    "frames": WRONG[1:],  # None: the whole film
    "title": WRONG[:2],  # anything becomes text
}
# Classes that only the package creates, for users to read.
RECORDS = {
    "Finding",
    "Fit",
    "PhenomenaTable",
    "Record",
    "Report",
    "Sweep",
    "Trace",
    "Model",
    "Rig",
    "Signal",
}


@dataclass(frozen=True)
class Entry:
    """A public entry with valid arguments."""

    name: str
    make: Callable[[], Callable[..., Any]]
    right: dict[str, Any]


def _chart_parts() -> dict[str, Any]:
    return {each.name: getattr(CHART, each.name) for each in fields(CHART) if each.init}


@functools.cache
def _trace() -> Trace:
    return simulate(MODEL, RIG, 1.0)


@functools.cache
def _switching() -> Trace:
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    return simulate(model, Prescribed("0.2"), 3.0)


def _entries() -> Iterator[Entry]:
    """Yield every public entry with known valid arguments; files are in the current folder."""
    run = {"model": MODEL, "rig": RIG, "t_end": 1.0, "t_start": 0.0, "initial": None}
    run |= {"settings": None}
    options = {each.name: each.default for each in fields(Settings)}
    curve = PARAMETERS.stribeck
    bank = {"sigma_2": 0.4, "stribeck": curve}
    view = {"elements": None, "notation": "stateflow", "theme": "light", "values": False}
    view |= {"direction": "TB"}
    edge = {"name": "go", "source": "on", "target": "on", "guard": "z > 1", "actions": {}}
    right: dict[str, dict[str, Any]] = {
        "Bench": {each.name: each.default for each in fields(Bench)},
        "Body": {"name": "mass", "inertia": 1.0, "force": "0", "velocity": None}
        | {"x": "x", "v": "v"},
        "Chart": _chart_parts(),
        "ChartModel": {"chart": MODEL.chart, "values": dict(MODEL.values), "n": 1, "title": ""}
        | bank
        | {"weights": PARAMETERS.weights},
        "Contact": {"name": "pad", "chart": CHART, "values": {"k": 1.0}, "v": "v", "n": 1}
        | {"inputs": {}, "period": None},
        "Element": {},
        "FrictionBank": {"models": [MODEL], "t": 0.0, "initial": None, "rtol": 1e-6}
        | {"engine": None},
        "FrictionEquations": {"model_or_contact": MODEL, "t": 0.0, "initial": None},
        "FrictionState": {"model_or_contact": MODEL, "t": 0.0, "initial": None, "rtol": 1e-6}
        | {"engine": None},
        "ElementMachines": {"model": MODEL, "element": Element},
        "GMS": {"parameters": PARAMETERS, "law": "signed"},
        "GMSParameters": {"k": [2.0], "sigma": [0.1], "C": [0.1], "v_c": 1.0, "weights": None}
        | bank,
        "LuGre": {"sigma_0": 1.0, "sigma_1": 1.0} | bank,
        "Parameter": {"name": "k", "unit": "N", "rule": "> 0", "meaning": "", "assumed": ""}
        | {"per_element": True},
        "Prescribed": {"velocity": "t"},
        "PulledSlider": {"mass": 1.0, "stiffness": 1.0, "speed": 1.0},
        "Sampled": {"name": "pid", "period": 1e-3, "updates": {"u": "t"}, "initial": {"u": 1.0}}
        | {"offset": 0.0},
        "Session": run | options,
        "Settings": options,
        "Slider": {"mass": 1.0, "force": "t"},
        "Spring": {"name": "shaft", "first": "a", "second": None, "k": 1.0, "d": 0.0}
        | {"ratio": 1.0, "rest": 0.0},
        "State": {"name": "on", "flow": {"z": "v"}},
        "Stribeck": {"F_c": 1.0, "F_s": 1.5, "v_s": 0.1},
        "System": {"name": "one mass", "bodies": (BODY,), "contacts": (CONTACT,), "signals": {}}
        | {"springs": ()}
        | {"numbers": {}, "flow": {}, "sampled": ()},
        "Transition": edge,
        "excite": {"stroke": 1e-3, "speeds": [1e-3, 2e-3], "rate": None, "acceleration": None},
        "fit": _FIT
        | {"fixed": {"v_c": 1e-3}, "tied": (), "nuisance": ("offset",)}
        | {"linear": (), "measured": "F", "drive": None, "train": None, "test": None}
        | {"cycles": None, "bounds": {}, "seed": 0, "most_steps": None, "smoothing": None}
        | {"begin": None, "progress": False},
        "choose": {"records": _rubbed(), "candidates": {"bank": (_FIT["model"], ["k"])}}
        | {"fold": "cycles", "cycles": 5.0, "train": None, "test": None, "smoothing": None}
        | {"seed": 0, "most_steps": None, "progress": False},
        "initial_bank": {"records": _rubbed(), "n": 2, "law": "signed", "train": None}
        | {"smoothing": None, "v_c": None},
        "export": {"system": MODEL, "format": "c99", "folder": Path("c99"), "name": "friction"}
        | {"initial": None, "t_start": 0.0, "settings": None},
        "measure_phenomena": {"models": ["stiction"], "phenomena": ["stick-slip"]}
        | {"bench": None, "progress": None},
        "prove": {"chart": CHART, "domain": None},
        "simulate": run
        | options
        | {"machines": None, "progress": None, "checkpoint": None, "monitors": ()}
        | {"checkpoint_every": 60.0},
        "sweep": run
        | options
        | {"parameters": {"v_c": [1.0]}, "executor": None, "progress": False},
        "LiveChart": {"trace": _trace()} | view,
        "animate": {"trace": _trace(), "path": Path("a.gif"), "frames": 2},
        "block_diagram": {"elements": 1},
        "explore": run | options | {"sliders": {"v_c": (1e-9, 2.0)}, "height": 500},
        "handout": {"model": MODEL, "path": Path("a.pdf"), "velocity": "0.1", "t_end": 1.0},
        "live_statechart": {"trace": _trace(), "row": 0} | view,
        "landscape": {"trace": _trace(), "element": 0, "row": -1, "t": None, "window": None}
        | {"checks": None, "title": ""},
        "mermaid": {"chart": CHART},
        "overview": {"trace": _trace(), "title": ""},
        "phase": {"trace": _trace(), "row": None, "window": None, "elements": None, "title": ""},
        "preset": {"chosen": "ieee1"},
        "render": {"graph": plots.block_diagram(1), "path": Path("a.dot")},
        "replay": {"trace": _trace(), "other": None, "title": "", "names": ()},
        "schematic": {"system": SYSTEM},
        "statechart": {"chart": CHART, "elements": 1, "notation": "stateflow", "direction": "TB"}
        | {"theme": "light", "counts": None, "marked": (), "names": False, "note": ""},
        "unfold": {"trace": _switching(), "t0": 1.0, "t1": 3.0, "elements": None, "title": ""},
        "write_replay": {"path": Path("a.html"), "trace": _trace(), "other": None, "title": ""}
        | {"names": ()},
    }
    for home in (gms_fsm, plots):
        for name in home.__all__:
            each = getattr(home, name)
            if name in RECORDS or (inspect.isclass(each) and issubclass(each, BaseException)):
                continue
            assert name in right, f"{name} is public; say here what its right arguments are"
            yield Entry(name, functools.partial(getattr, home, name), right[name])
    yield from _methods()


def _session() -> Session:
    return Session(MODEL, RIG, 1.0)


@functools.cache
def _swept() -> Sweep:
    return sweep(MODEL, RIG, 1.0, {"v_c": [1.0, 2.0]}, progress=False)


def _methods() -> Iterator[Entry]:
    """Yield every public method, by its signature; valid arguments are known by name."""
    objects: dict[str, Callable[[], Any]] = {
        "Trace": _trace,
        "Session": _session,
        "Sweep": _swept,
        "Chart": lambda: CHART,
        "Parameter": lambda: Parameter("k"),
        "Stribeck": lambda: PARAMETERS.stribeck,
        "GMSParameters": lambda: PARAMETERS,
        "GMS": lambda: MODEL,
        "LuGre": lambda: LuGre(sigma_0=1, sigma_1=1, sigma_2=1, stribeck=PARAMETERS.stribeck),
        "ChartModel": lambda: ChartModel(CHART, {"k": 1.0}),
        "Slider": lambda: Slider(1.0, "t"),
        "PulledSlider": lambda: PulledSlider(1.0, 1.0, 1.0),
        "Prescribed": lambda: RIG,
        "Settings": Settings,
        "System": lambda: SYSTEM,
        "ElementMachines": lambda: ElementMachines(MODEL),
        "FrictionBank": lambda: FrictionBank([MODEL]),
        "FrictionEquations": _settled,
        "FrictionState": lambda: FrictionState(MODEL),
        "Record": _record,
        "Fit": _fit,
        "Report": lambda: prove(CHART),
        "LiveChart": lambda: plots.LiveChart(_trace()),
    }
    right = RIGHT | {"path": Path("file.npz")}
    right |= {f"FrictionState.{each}.v{k}": 0.1 for each in SAMPLES for k in (0, 1)}
    right |= {f"FrictionBank.{each}.v{k}": [0.1] for each in SAMPLES for k in (0, 1)}
    for kind, make in objects.items():
        for name, member in inspect.getmembers(type(make()), callable):
            if name.startswith("_") or inspect.isclass(member):
                continue
            parameters = list(inspect.signature(member).parameters.values())
            if not inspect.ismethod(member):  # a class method is already bound
                parameters = parameters[1:]
            given = {
                each.name: right.get(f"{kind}.{name}.{each.name}", right.get(each.name))
                if each.default is inspect.Parameter.empty
                else each.default
                for each in parameters
                if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)
            }
            yield Entry(f"{kind}.{name}", lambda make=make, name=name: getattr(make(), name), given)


def _record() -> Record:
    t = np.arange(20.0)
    return Record.from_arrays(time=t, position=np.sin(t), force=np.cos(t))


@functools.cache
def _rubbed() -> Record:
    t = np.linspace(0.0, 20.0, 200)
    return Record.from_arrays(time=t, position=np.sin(t), force=np.sign(np.cos(t)) + np.sin(t))


_FIT = {"records": _rubbed(), "model": MODEL, "free": ["k"], "search": "local"}


@functools.cache
def _fit() -> Fit:
    return fit(**_FIT)


def _settled() -> FrictionEquations:
    friction = FrictionEquations(MODEL)
    friction.settle(0.0, friction.initial, 0.5)
    return friction


SAMPLES = ("advance", "advance_to", "peek")
RIGHT: dict[str, Any] = {
    "name": "z",
    "t": 0.5,
    "v": np.array(0.5),
    "text": "z > 1",
    "expression": "z > 1",
    "condition": "z > 1",
    "values": {"z": {0: 0.1}},
    "element": 0,
    "number": 0,
    "branch": 0,
    "edge": "break_away_forward",
    "state": "stick",
    "column": "stick-slip",
    "alpha": [1.0],
    "k": [2.0],
    "C": 0.1,
    "stribeck": PARAMETERS.stribeck,
    "v_c": 1.0,
    "weights": [1.0],
    "settings": None,
    "whose": "simulate",
    "monitors": {},
    "kind": "guard",
    "row": 0,
    "points": 5,
    "times": [0.5],
    "chart": MODEL.chart,
    "FrictionBank.restore.snapshot": FrictionBank([MODEL]).snapshot(),
    "FrictionBank.from_array.array": FrictionBank([MODEL]).to_array(),
    "FrictionState.restore.snapshot": FrictionState(MODEL).snapshot(),
    "FrictionState.from_array.array": FrictionState(MODEL).to_array(),
    "y": FrictionEquations(MODEL).initial,
    "dt": 0.1,
    "Fit.bootstrap.draws": 2,
    "Fit.compare.others": _fit(),
    "Fit.predict.record": _rubbed(),
    "Fit.score.record": _rubbed(),
    "Fit.profile.name": "k1",
    "Record.from_arrays.time": np.arange(20.0),
    "Record.from_arrays.position": np.arange(20.0),
    "Session.break_on.kind": "tested",
    "Session.watch.expression": "z1",
    "Session.watch.text": "z1",
    "System.body.name": "mass",
    "System.contact.name": "pad",
    "Chart.guard_text.edge": "go",
    "Chart.state_index.name": "on",
}


def _defaults_to_none(call: Callable[..., Any], name: str) -> bool:
    parameter = inspect.signature(call).parameters.get(name)
    return parameter is not None and parameter.default is None


def _faults(entry: Entry) -> Iterator[str]:
    for name in entry.right:
        for wrong in FEWER.get(name, WRONG):
            call = entry.make()
            if wrong is None and _defaults_to_none(call, name):
                continue
            given = {**entry.right, name: wrong}
            try:
                call(**given)
            except GMSError:
                pass
            except Exception as error:
                yield f"{entry.name}({name}={wrong!r}): {type(error).__name__}: {str(error)[:150]}"


ENTRIES = {entry.name: entry for entry in _entries()}


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ENTRIES)
@pytest.mark.filterwarnings("ignore")
def test_wrong_types_raise_our_errors(name: str) -> None:
    assert list(_faults(ENTRIES[name])) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in ENTRIES if "." not in name])
def test_valid_arguments_are_accepted(name: str) -> None:
    """Otherwise the wrong ones above would be rejected for another reason."""
    ENTRIES[name].make()(**ENTRIES[name].right)
