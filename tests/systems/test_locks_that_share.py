"""Contacts may lock the same motion: earlier contacts carry the force, and the trace marks it."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace
from tests.systems_cases import clutched_bearings, pushed_against_a_stop


def shared(trace: Trace, contact: str) -> np.ndarray:
    """Return where the force of a locked contact is carried by earlier ones."""
    found: np.ndarray = trace.contact(contact).shared
    return found


def states(trace: Trace, contact: str) -> np.ndarray:
    found: np.ndarray = trace.contact(contact).states[:, 0]
    return found


@pytest.mark.parametrize("stop_first", [False, True])
def test_a_mass_with_stiction_comes_to_rest_at_a_stop_and_leaves_again(stop_first: bool) -> None:
    trace = pushed_against_a_stop(stop_first=stop_first).run("ifelse")
    stop, log = trace.contact("stop"), trace.transitions
    rest = states(trace, "stop") == "rest"
    assert rest.any()
    np.testing.assert_array_equal(trace.body("mass").v[rest], 0.0)
    push = 4.0 * np.sin(0.5 * trace.t)
    np.testing.assert_allclose((stop.F + trace.contact("pad").F)[rest], push[rest], atol=1e-9)
    assert [str(each) for each in log.edge[log.contact == "stop"]][-1] == "lift"
    assert trace.body("mass").x[-1] < 0.2
    assert {"release_forward", "release_backward"} <= {str(each) for each in log.edge}


def test_two_bearings_and_a_clutch_let_go_one_after_the_other() -> None:
    """The first bearing carries all, up to its stiction; then the second carries the rest."""
    trace = clutched_bearings().run("ifelse")
    log, R = trace.transitions, 0.5
    assert [(str(row.contact), str(row.edge)) for row in log] == [
        ("dog", "engage"),
        ("bearing_a", "release_forward"),
        ("bearing_b", "release_forward"),
    ]
    np.testing.assert_allclose(log.t, [1.0, 1.5 / R, (1.0 + 3.0) / R], rtol=0, atol=1e-9)
    both = (trace.t > 1.0) & (trace.t < log.t[1])
    assert both.any()
    np.testing.assert_array_equal(shared(trace, "bearing_b")[both], True)
    np.testing.assert_array_equal(trace.contact("bearing_b").F[both], 0.0)
    np.testing.assert_allclose(trace.contact("bearing_a").F[both], R * trace.t[both], atol=1e-12)
    for earlier in ("bearing_a", "dog"):
        np.testing.assert_array_equal(shared(trace, earlier), False)
    later = trace.t > log.t[1]
    np.testing.assert_array_equal(shared(trace, "bearing_b")[later], False)
    moving = trace.t > log.t[2]
    np.testing.assert_array_equal(trace.body("a").v[moving], trace.body("b").v[moving])
    assert trace.body("b").v[-1] > 0.0
