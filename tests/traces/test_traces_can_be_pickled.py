"""A trace can be pickled at any time: also after something was computed from it."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, Prescribed, simulate


@pytest.mark.parametrize("engine", ["machines", "ifelse", "compiled"])
def test_after_the_force_was_asked_for(engine: str) -> None:
    if engine == "compiled":
        pytest.importorskip("llvmlite")
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    trace = simulate(model, Prescribed("0.2*sin(t)"), 3.0, engine=engine)
    F, s = trace.F.copy(), trace.s.copy()
    again = pickle.loads(pickle.dumps(trace))
    np.testing.assert_array_equal(again.F, F)
    np.testing.assert_array_equal(again.s, s)
    assert again.transitions.tolist() == trace.transitions.tolist()
