"""`gms_fsm.charts.CHARTS` has every chart that is a model, by name, from the registry."""

from __future__ import annotations

from gms_fsm import Chart
from gms_fsm.charts import CHARTS, GMS_ELEMENT, LUGRE
from gms_fsm.charts.registry import registered

SHIPPED = {
    "gms-signed": GMS_ELEMENT["signed"],
    "gms-published": GMS_ELEMENT["published"],
    "lugre": LUGRE,
}
NEW = {
    "stiction",
    "backlash",
    "end-stop",
    "dog-clutch",
    "karnopp",
    "modelica",
    "dahl",
    "lugre-sigma1",
    "reset-integrator",
    "elasto-plastic",
    "maxwell-slip",
    "prandtl-tomlinson",
}


def test_the_names_are_those_of_the_models() -> None:
    assert set(CHARTS) >= {*SHIPPED} | NEW
    assert all(isinstance(chart, Chart) for chart in CHARTS.values())
    assert {name: CHARTS[name] for name in SHIPPED} == SHIPPED


def test_the_registry_is_the_only_list() -> None:
    wanted = [
        each.chart(law)
        for each in registered().values()
        if not each.wrong
        for law in each.laws or ("",)
    ]
    assert list(CHARTS.values()) == wanted


def test_new_charts_say_where_they_come_from_and_that_their_numbers_are_ours() -> None:
    for name in NEW:
        assert CHARTS[name].reference
        assert registered()[name].demonstration.source == "chosen by us"
