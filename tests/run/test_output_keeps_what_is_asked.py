"""output= decides only which rows are recorded: "all", the times in t_eval, or the end.

Which rows these are is in tests/laws/test_output_observes.py; contradictions are refused.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from tests.helpers import FASTEST, open_loop, pulled_mass, same_bits, stick_slip

JUMPS = [(0, 0.1), (1, 0.2), (1, -0.3), (6, -0.3), (6, 0.4), (9, 0.4)]
CASES: dict[str, tuple[Model, Rig, float]] = {
    "open loop": (stick_slip("signed"), open_loop(), 31.0),
    "pulled mass": (*pulled_mass(), 10.0),
    "jumps": (stick_slip("published"), Prescribed(JUMPS), 12.0),
}


def test_the_default_output_depends_on_t_eval() -> None:
    model, rig, t_end = CASES["open loop"]

    def shapes(**options: Any) -> tuple[int, int, int]:
        trace = simulate(model, rig, t_end, engine=FASTEST, **options)
        return len(trace), len(trace.stops), len(trace.transitions)

    assert shapes() == shapes(output="all")
    assert shapes(t_eval=[1.0, 2.0]) == shapes(output="t_eval", t_eval=[1.0, 2.0])
    assert shapes(t_eval=[1.0, 2.0])[0] == 2
    assert shapes(output="end")[0] == 1


def test_both_sides_of_every_stop_are_recorded_with_requested_rows() -> None:
    """So that samples between distant rows do not cross a switch or a jump."""
    model, rig, t_end = CASES["jumps"]
    trace = simulate(model, rig, t_end, t_eval=[0.0, t_end], engine="ifelse")
    stops = trace.stops
    assert stops.t[0] == 0.0
    assert (np.diff(stops.t) >= 0).all()
    for t in trace.transitions.t:
        assert (stops.t == t).sum() >= 2, "before and after"
    for jump in (1.0, 6.0):
        assert {np.nextafter(jump, 0.0), jump} <= set(stops.t.tolist())
    whole = simulate(model, rig, t_end, engine="ifelse")
    times = np.linspace(0.0, t_end, 101)
    between, sampled = trace.sample(times), whole.sample(times)
    np.testing.assert_array_equal(between.states, sampled.states)


def test_the_end_can_be_saved_and_sampled(tmp_path: Any) -> None:
    model, rig, t_end = CASES["open loop"]
    end = simulate(model, rig, t_end, output="end", engine=FASTEST)
    for name in ("end.npz", "end.csv"):
        same_bits(end, Trace.load(end.save(tmp_path / name)))
    assert end.sample([t_end]).z.tolist() == end.z.tolist()
    with pytest.raises(ValueError, match="outside the run"):
        end.sample([0.5 * t_end])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"output": "rows"}, ("output is 'rows'", "'all', 't_eval' or 'end'")),
        ({"output": 3}, ("output is 3", "'all'")),
        ({"output": True}, ("output is True", "'all'")),
        ({"output": "t_eval"}, ("output='t_eval' needs t_eval=",)),
        (
            {"output": "end", "t_eval": [0.5]},
            ("output is 'end'", "t_eval", "leave one of them out"),
        ),
        (
            {"output": "all", "t_eval": [0.5]},
            ("output is 'all'", "t_eval", "leave one of them out"),
        ),
        ({"output": "t_eval", "t_eval": [0.5, 2.0]}, ("t_eval has 2.0", "t_end = 1.0")),
        ({"output": "t_eval", "t_eval": []}, ("t_eval",)),
    ],
)
def test_contradictions_are_refused(options: dict[str, Any], words: tuple[str, ...]) -> None:
    with pytest.raises(ParameterError) as caught:
        simulate(*CASES["open loop"][:2], 1.0, engine=FASTEST, **options)
    for word in words:
        assert word in str(caught.value)


def test_progress_is_reported_for_a_run_that_records_only_its_end() -> None:
    """The last reported moment is before the end, in order of time, with finite values."""
    seen: list[tuple[float, float]] = []
    simulate(
        *CASES["pulled mass"],
        output="end",
        progress=lambda moment: seen.append((moment.t, moment.values["F"])),
    )
    assert len(seen) > 3
    assert [t for t, _ in seen] == sorted(t for t, _ in seen)
    assert np.isfinite(seen).all()


@pytest.mark.parametrize(
    ("events", "options"),
    [
        ("located", {"output": "all"}),
        ("located", {"output": "end"}),
        ("located", {"t_eval": [0.0, 45.0]}),
        ("step", {"output": "all"}),
        ("step", {"output": "end"}),
        ("step", {"t_eval": [0.0, 45.0]}),
    ],
)
def test_a_long_compiled_run_checks_for_ctrl_c(events: str, options: dict[str, Any]) -> None:
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    seen: list[float] = []
    simulate(
        stick_slip("signed"),
        Prescribed("0.2"),
        45.0,
        engine="compiled",
        method="euler",
        step=1e-3,
        events=events,
        progress=lambda moment: seen.append(moment.t),
        **options,
    )
    assert seen, "45,000 steps without checking for Ctrl-C"
    assert seen == sorted(seen)
