"""A number too large for a float is refused, and a long value does not make a long message."""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import Prescribed, Stribeck, simulate
from gms_fsm.errors import ParameterError, SignalError
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.signals import as_signal
from tests.helpers import stick_slip


@pytest.mark.parametrize("number", [10**400, -(10**400)])
def test_whole_numbers_that_no_float_holds_are_refused(number: int) -> None:
    with pytest.raises(ParameterError, match="F_s: it is too large"):
        Stribeck(1.0, number, 1.0)
    with pytest.raises(ParameterError, match=r"k.*it is too large"):
        GMSParameters([number], [0], [1], sigma_2=0, stribeck=Stribeck(1, 1, 1), v_c=1e-6)
    with pytest.raises(ParameterError, match="t_end: it is too large"):
        simulate(stick_slip("signed"), Prescribed("0"), number)
    for given in (number, [(0, number), (1, 0)], ([0, 1], [0, number])):
        with pytest.raises(SignalError):
            as_signal(given)  # type: ignore[arg-type]


def test_long_values_do_not_make_long_messages() -> None:
    wrong: list[Any] = ["x"] * 100_000
    with pytest.raises(ParameterError) as refused:
        Stribeck(wrong, 1.0, 1.0)  # type: ignore[arg-type]
    with pytest.raises(ParameterError) as also_refused:
        GMSParameters(wrong, [0], [1], sigma_2=0, stribeck=Stribeck(1, 1, 1), v_c=1e-6)
    with pytest.raises(SignalError) as no_signal:
        as_signal(wrong)
    for caught in (refused, also_refused, no_signal):
        assert len(str(caught.value)) < 500
