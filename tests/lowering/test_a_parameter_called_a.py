"""A chart may have a parameter called a; it is not the acceleration of the contact."""

from __future__ import annotations

import pytest

from gms_fsm import Chart, ChartModel, PulledSlider, State, simulate
from tests.helpers import same_bits


def _chart(name: str) -> Chart:
    return Chart(
        "spring",
        variables=("z",),
        parameters=(name,),
        states=(State("on", flow={"z": "v"}),),
        outputs={"F": f"{name} * z"},
    )


@pytest.mark.parametrize("engine", ["ifelse", "machines"])
def test_its_value_is_read(engine: str) -> None:
    rig = PulledSlider(1.0, 2.0, 0.1)
    one, other = (
        simulate(ChartModel(_chart(name), {name: 3.0}), rig, 2.0, engine=engine)
        for name in ("a", "k")
    )
    same_bits(one, other)
    assert one.F[-1] == 3.0 * one.z[-1, 0] > 0.0
