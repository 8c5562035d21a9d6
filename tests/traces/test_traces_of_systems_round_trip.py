"""A trace of a system, or of a rig of your own, read from its file shows the same, bit for bit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import GMS, Chart, GMSParameters, State, Trace, Transition, simulate
from gms_fsm.errors import OutputError, SignalError, TraceFileError
from gms_fsm.systems.rigs import Slider
from gms_fsm.systems.system import Body, Contact, System
from tests import older_files
from tests.helpers import same_bits, stick_slip

STICTION = Chart(
    "stiction",
    parameters=("F_c", "F_s"),
    states=(  # the belt moves from the start
        State("backward", outputs={"F": "-F_c"}),
        State("stuck", locked=True),
        State("forward", outputs={"F": "F_c"}),
    ),
    transitions=(
        Transition("release_forward", "stuck", "forward", guard="F > F_s"),
        Transition("release_backward", "stuck", "backward", guard="F < -F_s"),
        Transition("arrest_forward", "forward", "stuck", guard="v < 0"),
        Transition("arrest_backward", "backward", "stuck", guard="v > 0"),
    ),
)
PLANAR = Chart(
    "viscous in the plane",
    velocities=("v", "w"),
    variables=("p", "q"),
    states=(State("slip", flow={"p": "v", "q": "w - q"}, outputs={"F": "v + p", "F_w": "w"}),),
)
GMS_MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")
COLUMNS = ("x", "v", "F", "z", "s", "F_elements", "dz", "states", "modes")


def belt(speed: Any = "0.1") -> System:
    """Return two blocks on a belt, with a contact of each kind."""
    values = {"F_c": 1.0, "F_s": 1.5}
    return System(
        "two blocks on a belt",
        bodies=(
            Body("one", inertia="m", force="1.3 * (q2 - q1) - 2 * q1 + 4 * sin(t)", x="q1", v="w1"),
            Body("two", inertia=1.2, force="1.3 * (q1 - q2) - 2 * q2 + i", x="q2", v="w2"),
            Body("belt", velocity="r", x="x_b", v="w_b"),
        ),
        contacts=(
            Contact("pad", STICTION, values, v="w1 - w_b"),
            Contact("bank", GMS_MODEL, v="w2 - w_b"),
            Contact("oil", PLANAR, v=("w1", "w1 - w2")),
        ),
        signals={"r": speed},
        numbers={"m": 1.0},
        flow={"i": "q1 - i"},
    )


def same_rows(one: Trace, other: Trace) -> None:
    for mine, its in zip(vars(one.rows).values(), vars(other.rows).values(), strict=True):
        np.testing.assert_array_equal(mine, its)
    for name in one.transitions.dtype.names:
        np.testing.assert_array_equal(one.transitions[name], other.transitions[name], err_msg=name)


def same(one: Trace, other: Trace) -> None:
    same_rows(one, other)
    assert other.contacts == one.contacts
    system = one.system
    assert system is not None
    for body in system.bodies:
        mine, its = one.body(body.name), other.body(body.name)
        assert np.array_equal(mine.x, its.x)
        assert np.array_equal(mine.v, its.v)
    for name in system.flow:
        assert one.value(name).tobytes() == other.value(name).tobytes()
    for name in one.contacts:
        seen, again = one.contact(name), other.contact(name)
        for column in COLUMNS:
            assert getattr(seen, column).tobytes() == getattr(again, column).tobytes(), column
        assert seen.transitions.edge.tolist() == again.transitions.edge.tolist()
        assert seen.model.n == again.model.n
    assert list(one.columns()) == list(other.columns())
    for column, values in one.columns().items():
        assert values.tolist() == other.columns()[column].tolist() or np.isnan(values).any()


@pytest.mark.parametrize(
    ("ending", "options"),
    [("npz", {"t_eval": np.linspace(0.0, 8.0, 30)}), ("csv", {}), ("npz", {"engine": "compiled"})],
)
def test_all_bodies_contacts_and_states(
    ending: str, options: dict[str, Any], tmp_path: Path
) -> None:
    if "engine" in options:
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    trace = simulate(belt(), 8.0, initial={"q2": 0.2}, **options)
    assert set(trace.transitions.contact) == {"pad", "bank"}
    path = trace.save(tmp_path / f"run.{ending}")
    again = Trace.load(path)
    same(trace, again)
    assert again.system is not None
    assert again.settings == Trace.load(again.save(tmp_path / f"again.{ending}")).settings
    assert again.sample(4.0).contact("pad").F == trace.sample(4.0).contact("pad").F


def test_columns_carry_the_names_of_contacts() -> None:
    trace = simulate(belt(), 1.0)
    names = list(trace.columns())
    assert names[:9] == ["t", "microstep", "q1", "w1", "q2", "w2", "x_b", "i", "w_b"]
    assert {"pad.F", "pad.F shared", "pad.state1", "bank.z4", "bank.F4", "bank.dz4"} <= {*names}
    assert {"oil.w", "oil.F_w", "oil.p1", "oil.dq1", "oil.F_w1"} <= {*names}
    assert list(trace.contact("bank").columns())[:5] == ["t", "microstep", "x", "v", "F"]


@pytest.mark.parametrize("ending", ["npz", "csv"])
def test_a_run_without_firings(ending: str, tmp_path: Path) -> None:
    trace = simulate(belt(), 0.05)
    assert len(trace.transitions) == 0
    same(trace, Trace.load(trace.save(tmp_path / f"run.{ending}")))


def test_a_python_function_is_named_as_such(tmp_path: Path) -> None:
    trace = simulate(belt(lambda t: 0.1), 8.0, initial={"q2": 0.2})
    again = Trace.load(trace.save(tmp_path / "run.npz"))
    same(trace, again)  # also the velocity of the belt
    with pytest.raises(SignalError, match="'r' was a Python function"):
        again.system.signals["r"].call(0.0)  # type: ignore[union-attr]


def test_what_one_contact_sees_is_no_whole_run(tmp_path: Path) -> None:
    trace = simulate(belt(), 1.0).contact("pad")
    with pytest.raises(OutputError, match="save the trace of the whole run"):
        trace.save(tmp_path / "run.npz")


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("contact", "none", "names a contact"),
        ("edge", "break_away_forward", "names an edge"),
        ("element", 1, "names an element"),
    ],
)
def test_a_log_that_does_not_fit_is_refused(
    name: str, value: Any, reason: str, tmp_path: Path
) -> None:
    path = tmp_path / "run.npz"
    arrays = older_files.format_1(simulate(belt(), 8.0, initial={"q2": 0.2}), path)
    log = arrays["transitions"]
    log[name][np.flatnonzero(log["contact"] == "pad")[0]] = value
    with pytest.raises(TraceFileError, match=reason):
        Trace.load(older_files.write(path, arrays))


def test_an_edge_of_another_contact_is_refused(tmp_path: Path) -> None:
    path = simulate(belt(), 8.0, initial={"q2": 0.2}).save(tmp_path / "run.npz")
    arrays = older_files.arrays_of(path)
    pad = np.flatnonzero(arrays["log_machine"] == 0)
    arrays["log_edge"][pad[0]] = len(STICTION.transitions)  # the first of the bank
    with pytest.raises(TraceFileError, match="names an edge"):
        Trace.load(older_files.write(path, arrays))


# --------------------------------------------------------------------------- rigs of your own
class Cart:
    title, acceleration = "cart on a slope", "(mass * 9.81 * sin(slope) + P - F) / mass"

    def __init__(self, push: Any = "0.2 * t") -> None:
        self.numbers = {"mass": 2.0, "slope": 0.01}
        self.signals = {"P": Slider(1.0, push).signals["F_a"]}


@pytest.mark.parametrize("ending", ["npz", "csv"])
@pytest.mark.parametrize("push", ["0.2 * t", [(0, 0), (5, 1)], lambda t: 0.2 * t])
def test_a_rig_of_your_own_is_read_back(ending: str, push: Any, tmp_path: Path) -> None:
    rig = Cart(push)
    trace = simulate(stick_slip("signed"), rig, 6.0)
    again = Trace.load(trace.save(tmp_path / f"run.{ending}"))
    same_bits(trace, again)
    for column in COLUMNS:
        assert getattr(trace, column).tobytes() == getattr(again, column).tobytes(), column
    assert (again.rig.title, again.rig.acceleration) == (rig.title, rig.acceleration)
    assert again.rig.numbers == rig.numbers
    if not callable(push):
        same_bits(trace, simulate(again.model, again.rig, 6.0))


def test_a_header_describes_a_run_once(tmp_path: Path) -> None:
    path = simulate(belt(), 1.0).save(tmp_path / "run.npz")
    with np.load(path) as file:
        arrays = dict(file)
    header = json.loads(str(arrays["header"]))
    assert header["format"] == "gms-fsm trace 2"
    del header["system"]
    arrays["header"] = np.array(json.dumps(header))
    np.savez(path, **arrays)
    with pytest.raises(TraceFileError, match="damaged"):
        Trace.load(path)
