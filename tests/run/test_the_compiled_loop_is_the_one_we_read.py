"""`record`, run by Python over the compiled engine's arrays, gives the same rows.

So the loop that fills the columns is correct as source, whatever a compiler makes of it; that the
compiled code does the same is the claim of test_compiled_is_bit_identical.py.
"""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("llvmlite", reason="needs the extra fast")

import integrators.runners.compiled
from gms_fsm import Slider, simulate
from gms_fsm.lowering import compiling as compiled
from gms_fsm.lowering.observing import on_surfaces
from gms_fsm.run.recording import compiled_run
from gms_fsm.traces import observed
from gms_fsm.traces.failures import LivelockError
from integrators.loop import Machines
from integrators.machine_code.layout import BlockLayout
from integrators.runners import columns
from integrators.runners.observing import observe_rows as rows_observed
from integrators.sliding import Functions
from tests.helpers import one_element, open_loop, pulled_mass, stick_slip
from tests.traces.test_monitors_see_what_happens import SLOWING, memoryless

TIMES = np.linspace(0.0, 20.0, 41)


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Make engine="compiled" run the Python source over its own arrays; return what it returned."""
    returned = []

    def engine(program, run):
        inside = (
            integrators.runners.compiled._longest(run)
            <= integrators.runners.compiled.LONGEST_INSIDE
        )
        return SimpleNamespace(
            layout=BlockLayout(run, integrators.runners.compiled.is_known, inside=inside)
        )

    def run(self, most_steps, *, pause):
        code = self.start.program.ieee
        flow = code["flow" if self.start.options.located else "flow_live"]
        names = ("arm", "margins", "normal", "follow")
        functions = Functions(flow, *(code[name] for name in names), self.p)
        machines = Machines(*(code[name] for name in ("switch", "act", "tick", "jolts", "observe")))
        recorded = self.run_of.recorded
        with np.errstate(all="ignore"):
            event = columns.record(
                functions, machines, self.buffers, self.log, recorded, most_steps, pause
            )
        returned.append(event)
        return event

    def observe_rows(program, t, y, mode, kept):
        table, seen = np.empty((t.size, len(kept))), np.empty(program.layout.observed.size)
        on = on_surfaces(program, program.ieee, compiled.packed(program.p))
        observe, rows = program.ieee["observe"], (t, y, mode)
        rows_observed(
            on.functions, observe, on.held, on.sliding, *rows, seen, table, kept.start, t.size
        )
        return table

    monkeypatch.setattr(compiled, "engine", engine)
    monkeypatch.setattr(compiled_run, "_known", {})
    monkeypatch.setattr(compiled_run.Columns, "run", run)
    monkeypatch.setattr(observed, "observe_rows", observe_rows)
    return returned


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"output": "end"},
        {"t_eval": TIMES},
        {"method": "rk4", "step": 9.03e-3},
        {"events": "step", "method": "heun", "step": 0.01},
        {"max_step": 0.01},
    ],
    ids=["all", "end", "t_eval", "rk4", "step", "many rows"],
)
@pytest.mark.parametrize("case", ["open loop", "pulled mass"])
def test_the_same_rows_and_the_same_log(case, options, read):
    model, rig = (stick_slip("signed"), open_loop()) if case == "open loop" else pulled_mass()
    ours = simulate(model, rig, 20.0, engine="compiled", **options)
    theirs = simulate(model, rig, 20.0, engine="ifelse", **options)
    assert len(theirs.transitions) > 2
    assert read, "the source was run"
    for name in ("t", "microstep", "y", "mode"):
        np.testing.assert_array_equal(getattr(ours.rows, name), getattr(theirs.rows, name))
        np.testing.assert_array_equal(getattr(ours.stops, name), getattr(theirs.stops, name))
    np.testing.assert_array_equal(ours.transitions, theirs.transitions)
    for name in ("v", "F", "s", "F_elements", "dz"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))


def test_sliding_gives_the_same_rows(read):
    model = one_element("published", F_c=1.0, F_s=1.5, v_s=0.05, C=0.1, sigma=5.0, k=1.0)
    start = {"z": [-2.5], "states": ["slip"], "v": 0.05}
    runs = [
        simulate(model, Slider(1.0, "-2.4 - 2*t"), 5.0, initial=start, engine=engine)
        for engine in ("compiled", "ifelse")
    ]
    assert len(runs[0].sliding) == 1
    for name in ("t", "microstep", "y", "mode"):
        np.testing.assert_array_equal(*(getattr(run.rows, name) for run in runs))


def test_failures_end_the_run_at_the_same_point(read):
    model, rig = memoryless([0.5, 0.4]), SLOWING
    scenes = []
    for engine in ("compiled", "ifelse"):
        with pytest.raises(LivelockError) as caught:
            simulate(model, rig, 10.0, engine=engine)
        scenes.append((str(caught.value), caught.value.trace))
    (text, ours), (same, theirs) = scenes
    assert text == same
    np.testing.assert_array_equal(ours.rows.y, theirs.rows.y)
