"""The planned length of a run does not change its results: the resolution of time depends on t.

It once depended on t_end: another horizon changed forces by 5e-8 N.
"""

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from tests.helpers import pulled_mass, stick_slip


@pytest.mark.parametrize("engine", ["machines", "ifelse", "compiled"])
@pytest.mark.parametrize("longer", [20.0, 1e3, 123456.789])
def test_a_longer_horizon_gives_the_same_bits_up_to_the_shorter(longer, engine):
    if engine == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    cases = [pulled_mass(), (stick_slip("published"), Prescribed("0.15*sin(2*pi*t/25)"))]
    for model, rig in cases:
        short = simulate(model, rig, 15.0, engine=engine)
        far = simulate(model, rig, min(longer, 60.0), engine=engine)
        if longer > 60.0:  # distant in time, but never reached
            from gms_fsm.traces.failures import StepLimitError

            with pytest.raises(StepLimitError) as caught:
                simulate(model, rig, longer, engine=engine, max_steps=len(short) + 200)
            far = caught.value.trace
        count = len(short) - 2  # the last step is cut at the end
        assert count > 30
        for name in ("t", "v", "x", "z", "F"):
            assert np.array_equal(getattr(short, name)[:count], getattr(far, name)[:count])
        log = short.transitions[short.transitions.t < short.t[count - 1]]
        assert log.tolist() == far.transitions[: len(log)].tolist()
