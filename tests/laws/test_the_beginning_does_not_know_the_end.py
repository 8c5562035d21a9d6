"""The planned length of a run changes nothing before its end: not a bit of rows, states, switches.

The resolution of time once depended on t_end: another horizon changed forces by 5e-8 N. The same
holds where a run fails or is interrupted later: what is kept is the beginning of the whole run.
"""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Trace
from tests.corpus import FEW, Run, each, in_turn, outcome, run, trace
from tests.helpers import FASTEST

LONG = (  # the first step of a short run is a part of it
    "open loop", "open loop, published", "pulled mass", "slider", "lugre slider",
    "wear, pulled", "fig. 3, slipping, published",
)  # fmt: skip


def begins(whole: Trace, part: Trace, rows: int) -> None:
    """Assert that so many rows, and the switches up to there, are those of the whole run."""
    assert rows > 1
    for name in ("t", "microstep", "y", "mode"):
        ours, theirs = (getattr(each.rows, name)[:rows] for each in (part, whole))
        np.testing.assert_array_equal(ours, theirs, err_msg=name)
    last = part.t[rows - 1]
    ours, theirs = ([*each.transitions[each.transitions.t < last]] for each in (part, whole))
    assert repr(ours) == repr(theirs)


def all_rows(name: str) -> Trace:
    if "t_eval" in run(name).how:
        return run(name)(engine=in_turn(name), t_eval=None)
    return trace(name, in_turn(name))


@each(LONG)
def test_another_end(name: str) -> None:
    """Nearer, or so far away that the run never reaches it; the last step is cut at the end."""
    whole, at = all_rows(name), run(name)
    near = Run(at.subject, 0.61 * at.t_end, at.how)(engine=in_turn(name))
    begins(whole, near, int((near.t < near.t[-1]).sum()) - 1)
    far, said = Run(at.subject, 123456.789, {**at.how, "max_steps": 300}).outcome()
    assert said.startswith("StepLimitError")
    assert far is not None
    begins(whole, far, int((far.t < min(far.t[-1], at.t_end)).sum()) - 1)


@pytest.mark.parametrize("name", ["the record ends", "root of a negative"])
def test_a_failure_later(name: str) -> None:
    (whole, _), at = outcome(name), run(name)
    assert whole is not None
    near = Run(at.subject, 0.7 * whole.t[-1], at.how)(engine=FASTEST)
    begins(whole, near, int((near.t < near.t[-1]).sum()) - 1)
    assert whole.settings["t_end"] == at.t_end


@each(FEW)
def test_ctrl_c_keeps_the_beginning(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In every engine; what is kept can be saved."""
    monkeypatch.setattr("gms_fsm.run.recording.compiled_run.STEPS_AT_ONCE", 30)
    whole, start = all_rows(name), run(name).how.get("t_start", 0.0)

    def strike(moment: Any) -> None:
        if moment.t > start + 0.3 * (run(name).t_end - start):
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt) as caught:
        run(name)(engine=in_turn(name), progress=strike)
    part: Trace = caught.value.trace  # type: ignore[attr-defined]
    assert len(part) <= len(whole)
    begins(whole, part, len(part))
    begins(whole, Trace.load(part.save(tmp_path / "part.npz")), len(part))
