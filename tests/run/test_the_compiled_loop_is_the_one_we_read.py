"""What only machine code can get wrong: its functions, columns that are full, random tables.

And `record`, run by Python over the compiled engine's arrays, gives the same rows: so the loop that
fills the columns is correct as source, whatever a compiler makes of it. That machine code runs the
corpus to the bit is in tests/laws/test_engines_agree.py.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("llvmlite", reason="needs the extra fast")

import integrators.runners.compiled
from gms_fsm import (
    Chart,
    ChartModel,
    ElementMachines,
    Prescribed,
    State,
    Trace,
    coverage,
    simulate,
    sweep,
)
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.lowering import compiling as compiled
from gms_fsm.lowering.observing import on_surfaces
from gms_fsm.lowering.program import lower
from gms_fsm.run.recording import compiled_run, ready_code
from gms_fsm.traces import observed
from integrators.loop import FIRING, Machines
from integrators.machine_code import calls
from integrators.machine_code.layout import BlockLayout
from integrators.runners import columns
from integrators.runners.observing import observe_free
from integrators.runners.observing import observe_rows as rows_observed
from integrators.sliding import Functions
from tests.corpus import each, outcome, run, trace
from tests.helpers import CURVE, banging, other_parts, pulled_mass, stick_slip


# --------------------------------------------------------------------------- as source
@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Make engine="compiled" run the Python source over its own arrays; return what it returned."""
    returned = []
    machine = integrators.runners.compiled

    def engine(program: Any, run: Any, counting: Any, *tangents: Any) -> Any:
        assert not any(tangents)
        inside = machine._longest(run) <= machine.LONGEST_INSIDE
        return SimpleNamespace(layout=BlockLayout(run, machine.is_known, inside=inside))

    def run(self: Any, most_steps: int, *, pause: bool) -> int:
        code = self.start.program.ieee
        flow = code["flow" if self.start.options.located else "flow_live"]
        names = ("arm", "margins", "normal", "follow")
        functions = Functions(flow, *(code[name] for name in names), self.p)
        machines = Machines(*(code[name] for name in ("switch", "act", "tick", "jolts", "observe")))
        recorded, tally = self.run_of.recorded, self._tally()
        with np.errstate(all="ignore"):
            event = columns.record(
                functions, machines, self.buffers, self.log, recorded, tally, most_steps, pause
            )
        returned.append(event)
        return event

    def observe_rows(program: Any, t: Any, y: Any, mode: Any, kept: range) -> Any:
        table, seen = np.empty((t.size, len(kept))), np.empty(program.layout.observed.size)
        on = on_surfaces(program, program.ieee, compiled.packed(program.p))
        observe, rows = program.ieee["observe"], (t, y, mode, seen, table, kept.start)
        free = observe_free(observe, on.functions.p, on.sliding, *rows, t.size)
        rows_observed(on.functions, observe, on.held, on.sliding, *rows, free, t.size)
        return table

    monkeypatch.setattr(compiled, "engine", engine)
    monkeypatch.setattr(ready_code, "_known", {})
    monkeypatch.setattr(compiled_run.Columns, "run", run)
    monkeypatch.setattr(observed, "observe_rows", observe_rows)
    return returned


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["open loop", "pulled mass, rk4", "open loop, rk4 by step", "open loop, t_eval", "sliding"],
)
def test_the_source_of_the_loop_gives_the_same_run(name: str, read: list[int]) -> None:
    assert other_parts(run(name)(engine="compiled"), trace(name, "ifelse")) == []
    assert read, "the source was run"


def test_the_source_of_the_loop_records_the_end(read: list[int]) -> None:
    end = run("open loop")(engine="compiled", output="end")
    assert other_parts(end, run("open loop")(engine="ifelse", output="end")) == []
    assert read


def test_the_source_of_the_loop_counts_rows(read: list[int]) -> None:
    model, rig = stick_slip("signed"), Prescribed("0.2*sin(t)")
    found = sweep(model, rig, 6.0, {"delta": [2.0]}, coverage=True)  # looked at, so run by itself
    assert coverage(found) == coverage(simulate(model, rig, 6.0, engine="ifelse"))
    assert read


def test_failures_end_the_source_of_the_loop_at_the_same_point(read: list[int]) -> None:
    (ours, said), (theirs, too) = run("livelock").outcome(engine="compiled"), outcome("livelock")
    assert said == too
    assert other_parts(ours, theirs) == []
    assert read


def test_the_source_of_the_loop_makes_room_for_many_firings(read: list[int]) -> None:
    what = banging(0.01), Prescribed("0"), 3.7
    mine, theirs = (simulate(*what, engine=engine) for engine in ("compiled", "ifelse"))
    assert len(mine.transitions) > 256  # so many have room at first
    assert other_parts(mine, theirs) == []
    assert read


def test_the_source_of_the_loop_waits_for_machines_of_ones_own(read: list[int]) -> None:
    what = stick_slip("signed"), Prescribed("0.2"), 3.0
    machines = ElementMachines(what[0])
    mine = simulate(*what, engine="compiled", machines=machines)
    assert other_parts(mine, simulate(*what, engine="ifelse")) == []
    assert FIRING in read


# --------------------------------------------------------------------------- as machine code
def agreed(model: Any, rig: Any, t_end: float, **options: Any) -> Trace:
    """Run both engines to the end and compare; return one trace."""
    one, other = (
        simulate(model, rig, t_end, engine=engine, **options) for engine in ("ifelse", "compiled")
    )
    assert other_parts(one, other) == []
    return one


@pytest.mark.matrix
@pytest.mark.slow
def test_a_run_that_fills_its_columns_many_times_over() -> None:
    """More rows, firings and stops than there is room for at first, in several calls."""
    (model, _), rig = pulled_mass(), Prescribed("0.3*sin(20*t)")
    trace = agreed(model, rig, 20.0, method="rk4", step=7.003e-3)
    assert len(trace) > 3000
    assert len(trace.transitions) > 512
    few = agreed(model, rig, 20.0, t_eval=[0.0, 20.0])
    assert len(few.stops) > 1024
    agreed(model, rig, 2.1, method="euler", step=1e-4)  # 21,000 steps


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.lists(st.floats(0, 1.5, allow_subnormal=False) | st.just(0.0), min_size=2, max_size=12),
    st.lists(st.floats(-0.5, 0.5), min_size=12, max_size=12),
    st.booleans(),
)
def test_random_corners_and_jumps(gaps: list[float], values: list[float], held: bool) -> None:
    times = np.concatenate([[0.0], np.cumsum(gaps), [np.sum(gaps) + 1.0]])
    level = np.resize(values, times.size)
    given = list(zip(times, level, strict=True)) if held else (times, level)
    rig = Prescribed(given)
    if times[1] > 0.0 or held:  # a record must cover the start
        agreed(stick_slip("signed"), rig, float(times[-1]), rtol=1e-5)


def _function(text: str) -> ChartModel:
    """Return a chart whose force is a function of z."""
    chart = Chart("f", ("v",), ("z",), (), (State("on", {"z": "0"}),), (), {"F": text})
    return ChartModel(chart, {}, n=1, stribeck=CURVE)


def _argument_values() -> list[float]:
    rng = np.random.default_rng(11)
    whole = [float(u) for u in range(-12, 13)]
    near = rng.normal(0, 2, 1500).tolist() + rng.uniform(-800, 800, 500).tolist()
    wide = (rng.choice([-1, 1], 500) * 10 ** rng.uniform(-300, 300, 500)).tolist()
    return [0.0, -0.0, *whole, *near, *wide]


FUNCTIONS = [
    "8**z", "2**z", "0.5**z", "10**z", "z**0.5", "z**(-0.5)", "abs(z)**0.25", "z**(-1.0)", "z**9",
    "exp(z)**0.5", "pi**z", "z**z", "z**5", "exp(z)", "exp(-z)*exp(z)", "sin(z)*cos(z)",
    "tanh(z)", "sqrt(z)", "1/z", "z/3*3", "0*z", "-z", "sgn(sqrt(z))", "min(z, sqrt(z))",
    "max(sqrt(z), z)", "min(0*z, -0*z)", "max(z, 1, sqrt(z))", "abs(-abs(z))", "1e300*z*z",
    "(z - z)/(z - z)",
]  # fmt: skip


@pytest.mark.every(3)
@pytest.mark.parametrize("text", FUNCTIONS)
def test_every_function_at_many_places(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compilers turn 8**z into exp2 and z**0.5 into sqrt, which differ in the last bits."""
    monkeypatch.setattr(calls, "AT_ONCE", 0.0)
    values = _argument_values()
    program = lower(_function(text), Prescribed("0"))
    y = np.column_stack([np.zeros(len(values)), values])
    mode = np.zeros((len(values), program.layout.modes), dtype=np.int64)
    wanted, out = np.empty((len(values), 5)), [0.0] * 5
    for row, place in enumerate(y.tolist()):
        program.ieee["observe"](0.0, place, [0], program.live, program.p, out)
        wanted[row] = out
    for _ in range(2):  # one by one, then side by side
        found = compiled.observe_rows(program, np.zeros(len(values)), y, mode, range(5))
        same_numbers(wanted[:, 1], found[:, 1])


def same_numbers(one: FloatArray, other: FloatArray) -> None:
    """Assert that two arrays have the same bits; a NaN is a NaN, whatever its payload."""
    np.testing.assert_array_equal(np.isnan(one), np.isnan(other))
    assert one[~np.isnan(one)].tobytes() == other[~np.isnan(one)].tobytes()


@each(("pulled mass", "twelve elements", "lugre slider", "runs down", "system two blocks"))
def test_rows_side_by_side_show_what_each_of_them_shows(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(calls, "AT_ONCE", 0.0)
    made = trace(name, "ifelse")
    one_by_one = observed.Observed(made.program, made.rows, compiled=False)
    for _ in range(2):  # first by code that is compiled at once
        side_by_side = observed.Observed(made.program, made.rows, compiled=True)
        for quantity, wanted in one_by_one.items():
            same_numbers(wanted, side_by_side[quantity])
