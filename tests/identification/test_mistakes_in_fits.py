"""A mistake in the arguments of a fit gives one message: what, where, which value, what to do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import GMSError, ParameterError, Record, RecordError, fit
from tests.identification.records import bank

MODEL = bank([1e4, 1e4], [4e-5, 8e-5])
T = np.linspace(0.0, 4.0, 201)
X = 2e-4 * np.sin(2.0 * T)


def _record(**given: Any) -> Record:
    columns = {"time": T, "position": X, "force": np.sign(np.cos(2.0 * T)) + 1e3 * X}
    return Record.from_arrays(**(columns | given))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"free": ["kk"]}, "free: there is no parameter 'kk'; did you mean 'k'?"),
        ({"free": ["k3"]}, "free: there is no parameter 'k3'"),
        ({"free": ["k", "k2"]}, "free: 'k2' is given twice"),
        ({"free": []}, "free: nothing is to be found"),
        ({"tied": ["C"]}, "tied: 'C' is not among the free parameters"),
        ({"fixed": {"k": 2.0}}, "fixed: 'k' is free, too"),
        ({"fixed": {"q": 2.0}}, "fixed: there is no parameter 'q'"),
        ({"fixed": {"v_c": -1.0}}, "v_c is -1.0; it must be > 0"),
        ({"bounds": {"C": (0, 1)}}, "bounds: 'C' is not among the free parameters"),
        ({"bounds": {"k": (2, 1)}}, "bounds of 'k1': the lowest value 2.0 is not below"),
        ({"bounds": {"k": 3}}, "bounds of 'k1' is 3; it must be a pair"),
        ({"nuisance": ["bias"]}, "'offset' or 'drift' or 'inertia'"),
        ({"search": "anneal"}, "'hops' or 'local' or 'de'"),
        ({"begin": "warm"}, "'relaxed' or 'run in'"),
        ({"measured": "x"}, "there is nothing called 'x' to compare"),
        ({"drive": "v"}, "drive is 'v'; a model is driven by the velocity of the record"),
        ({"train": (3, 1)}, "train: it ends at 1 s, not after its start at 3 s"),
        ({"train": (30, 40)}, "no selected row is from 30 s to 40 s"),
        ({"train": 3}, "train is 3; it must be two times"),
        ({"linear": ["q"]}, "linear: there is no parameter 'q'"),
        ({"most_steps": 0}, "most_steps is 0"),
        ({"cycles": -1.0}, "cycles is -1.0; it must be > 0"),
        ({"model": 3}, "model is 3; it must be a model or a system"),
        ({"records": []}, "records: there is none"),
        ({"records": [3]}, "records is 3; it must be a Record"),
    ],
)
def test_arguments(changed: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"records": _record(), "model": MODEL, "free": ["k"]} | changed
    with pytest.raises(GMSError) as error:
        fit(**given)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"force": None}, "it has no force, with which to compare; give force=(name, unit)"),
        ({"force": np.full(201, 2.5)}, "the force is constant (2.5) in the rows to train on"),
        ({"position": np.zeros(201)}, "nothing moves in the rows to train on"),
    ],
)
def test_records(columns: dict[str, Any], message: str) -> None:
    with pytest.raises(RecordError) as error:
        fit(_record(**columns), MODEL, free=["k"])
    assert message in str(error.value)


def test_ten_rows_are_too_few() -> None:
    short = Record.from_arrays(time=T[:10], position=X[:10], force=np.cos(T[:10]))
    with pytest.raises(RecordError, match=r"10 rows to train on are too few for 2 parameters"):
        fit(short, MODEL, free=["k"])


def test_a_parameter_without_influence() -> None:
    small = _record(position=1e-6 * np.sin(2.0 * T))  # nothing ever slips
    with pytest.raises(ParameterError, match=r"does not depend on v_s; free parameters that act"):
        fit(small, MODEL, free=["v_s"])
