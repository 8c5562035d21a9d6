"""An error is its fields: its text is made from them, and copies have them."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import pytest

import gms_fsm
from gms_fsm import ExpressionError, GMSError, ParameterError, RecordError, simulate
from gms_fsm.errors import shown
from gms_fsm.traces.failures import SimulationError
from tests.helpers import open_loop, stick_slip

KINDS = [
    each
    for each in (getattr(gms_fsm, name) for name in gms_fsm.__all__)
    if isinstance(each, type) and issubclass(each, GMSError)
]
PLAIN = [each for each in KINDS if not issubclass(each, ExpressionError | SimulationError)]


def _failed() -> SimulationError:
    with pytest.raises(SimulationError) as caught:
        simulate(stick_slip("signed"), open_loop(), 100.0, max_steps=50)
    return caught.value


def _made() -> list[GMSError]:
    fields = {"place": "step", "value": -1.0, "advice": "leave it out"}
    found: list[GMSError] = [each("it must be > 0", **fields) for each in PLAIN]
    return [*found, ExpressionError("unknown name 'u'", "z > u", 5, "z", "guard"), _failed()]


@pytest.mark.parametrize("kind", PLAIN, ids=lambda kind: kind.__name__)
def test_the_text_is_made_from_the_fields(kind: type[GMSError]) -> None:
    assert str(kind("it is damaged")) == "it is damaged"
    assert str(kind("it is damaged", place="a.npz")) == "a.npz: it is damaged"
    assert str(kind("it must be > 0", place="k", value=None)) == "k is None; it must be > 0"
    error = kind("it must be > 0", place="k", value=-1.0, advice="leave it out")
    assert str(error) == "k is -1.0; it must be > 0; leave it out"
    assert str(error.replaced(advice="")) == "k is -1.0; it must be > 0"


def test_a_failed_run_states_the_time_and_where_the_run_is_kept() -> None:
    error = _failed()
    assert error.t == error.trace.t[-1]
    assert str(error) == (
        f"t = {error.t!r} s: {error.reason}; {error.advice}; the run so far is kept in .trace"
    )
    assert str(error.replaced(kept="partial.npz")).endswith("is kept in partial.npz")
    assert error.happened == str(error).removesuffix("; the run so far is kept in .trace")


@pytest.mark.parametrize("error", _made(), ids=lambda error: type(error).__name__)
def test_copies_have_the_same_fields(error: GMSError) -> None:
    """A trace is compared by its text, because it is large."""
    error = error.inside("run.toml")
    for again in (copy.copy(error), pickle.loads(pickle.dumps(error))):
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert {**vars(again), "trace": None} == {**vars(error), "trace": None}


def test_places_nest() -> None:
    error = GMSError("it must be > 0", place="step", value=0).inside("[run]").inside(Path("a.toml"))
    assert str(error) == "a.toml: [run]: step is 0; it must be > 0"
    assert (error.outer, error.place) == ("a.toml: [run]", "step")


def test_an_error_can_be_made_from_another() -> None:
    error = ParameterError("it must be > 0", place="step", value=0, advice="leave it out")
    made = RecordError.of(error.inside("a.csv"))
    assert type(made) is RecordError
    assert str(made) == "a.csv: step is 0; it must be > 0; leave it out"


def test_what_cannot_be_shown_is_left_out() -> None:
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    assert shown(deep) == shown(10**5000) == "..."
