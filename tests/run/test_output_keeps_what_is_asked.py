"""output= decides only which rows are recorded: "all", the times in t_eval, or the end.

Which rows these are is in tests/laws/test_output_observes.py; contradictions are refused.
"""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from tests.helpers import FASTEST, open_loop, pulled_mass, same_bits, stick_slip

JUMPS = [(0, 0.1), (1, 0.2), (1, -0.3), (6, -0.3), (6, 0.4), (9, 0.4)]
CASES: dict[str, tuple[Model, Rig, float]] = {
    "open loop": (stick_slip("signed"), open_loop(), 31.0),
    "pulled mass": (*pulled_mass(), 10.0),
    "jumps": (stick_slip("published"), Prescribed(JUMPS), 12.0),
}


def test_the_end_can_be_saved_and_sampled(tmp_path: Any) -> None:
    model, rig, t_end = CASES["open loop"]
    end = simulate(model, rig, t_end, output="end", engine=FASTEST)
    for name in ("end.npz", "end.csv"):
        same_bits(end, Trace.load(end.save(tmp_path / name)))
    assert end.sample([t_end]).z.tolist() == end.z.tolist()
    with pytest.raises(ValueError, match="outside the run"):
        end.sample([0.5 * t_end])


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
