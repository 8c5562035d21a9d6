"""The charts in the folder are found, and files that do not fit there are reported.

Each built-in chart has numbers that run, with the same result on two engines.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import gms_fsm.charts
from gms_fsm import (
    Chart,
    ChartModel,
    Parameter,
    Prescribed,
    Stribeck,
    simulate,
)
from gms_fsm.charts import CHARTS, GMS_ELEMENT, LAWS, LUGRE
from gms_fsm.charts.broken import BROKEN
from gms_fsm.charts.registry import Demonstration, Entry, entry, registered
from gms_fsm.errors import ChartError, ParameterError
from gms_fsm.systems.models import demonstration
from gms_fsm.traces.failures import LivelockError
from tests.helpers import same_bits

CURVE = Stribeck(1.0, 1.5, 1e-3)


def every() -> list[tuple[str, str]]:
    return [(name, law) for name, each in registered().items() for law in each.laws or ("",)]


def test_the_registry_is_the_only_list() -> None:
    wanted = [
        each.chart(law)
        for each in registered().values()
        if not each.wrong
        for law in each.laws or ("",)
    ]
    assert list(CHARTS.values()) == wanted
    for name in {*CHARTS} & {*registered()} - {"lugre"}:  # the others than the paper's
        assert CHARTS[name].reference
        assert registered()[name].demonstration.source.startswith("chosen by us")


def test_the_built_in_charts_are_found() -> None:
    assert entry("lugre").chart() is LUGRE
    assert [entry("gms").chart(law) for law in LAWS] == [GMS_ELEMENT[law] for law in LAWS]
    for name, broken in BROKEN.items():
        found = entry(f"broken:{name}")
        assert (found.chart(), found.wrong, found.domain) == (
            broken.chart,
            broken.wrong,
            broken.domain,
        )
    faulty = [bool(each.wrong) for each in registered().values()]
    assert faulty == sorted(faulty)


@pytest.mark.parametrize(("name", "law"), every())
def test_every_parameter_has_a_unit_and_a_meaning(name: str, law: str) -> None:
    assert entry(name).demonstration.source
    for each in entry(name).chart(law).parameters:
        assert each.unit
        assert each.meaning


FAULTY = [name for name, each in registered().items() if each.wrong]


@pytest.mark.slow
@pytest.mark.parametrize("name", FAULTY)
def test_a_faulty_reading_runs_alike_on_two_engines(name: str) -> None:
    """The others are runs of the corpus of `tests/laws`."""
    model, rig = demonstration(entry(name), ""), Prescribed("0.2*sin(t)")
    runs = []
    for engine in ("machines", "ifelse"):
        try:
            runs.append(simulate(model, rig, 8.0, engine=engine))
        except LivelockError as error:
            runs.append(error.trace)
    same_bits(*runs)
    assert len(runs[0]) > 2


@pytest.mark.parametrize(
    ("name", "law", "words"),
    [
        ("gms", "", r"law is ''; gms has 'signed' and 'published', which differ"),
        ("gms", "al-bender", "law is 'al-bender'; gms has"),
        ("lugre", "signed", "lugre has only one law; leave out law='signed'"),
    ],
)
def test_a_law_is_chosen_where_there_are_several_and_only_there(
    name: str, law: str, words: str
) -> None:
    with pytest.raises(ParameterError, match=words):
        entry(name).chart(law)


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ParameterError, match=r"there is no model 'coulomb'; .*there are .*gms"):
        entry("coulomb")


# --------------------------------------------------------------------------- invalid entries
def chart(*parameters: Parameter | str, inputs: tuple[str, ...] = ("v",)) -> Chart:
    return Chart("c", inputs, ("z",), parameters, (gms_fsm.State("a", {"z": "v"}),), (), {"F": "z"})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((LUGRE, Demonstration({"sigma_0": 1.0}, "", stribeck=CURVE)), r"missing .*'sigma_1'"),
        ((LUGRE, Demonstration({"sigma_0": 1.0, "sigma_1": 0.0}, "")), "takes a curve"),
        ((chart(), Demonstration({}, "", stribeck=CURVE)), "any other chart takes none"),
        ((chart(), Demonstration({"k": 1.0}, "")), r"unknown: \['k'\]"),
        ((chart(Parameter("k", "N/m", "> 0")), Demonstration({"k": 0.0}, "")), "k is 0.0; .* > 0"),
        ((chart("law"), Demonstration({"law": 0.0}, "")), "'law' has the name of a key"),
        (({}, Demonstration({}, "")), "it has no chart"),
        (
            ({"a": chart("k"), "b": chart()}, Demonstration({"k": 0.0}, "")),
            "give each its own entry",
        ),
    ],
)
def test_an_entry_that_does_not_fit_is_refused(arguments: Any, words: str) -> None:
    with pytest.raises(ChartError, match=f"entry 'mine'.*{words}"):
        Entry("mine", *arguments)


# --------------------------------------------------------------------------- files
@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose modules count as built-in charts."""
    monkeypatch.setattr(gms_fsm.charts, "__path__", [*gms_fsm.charts.__path__, str(tmp_path)])
    before = set(sys.modules)
    registered.cache_clear()
    yield tmp_path
    registered.cache_clear()
    for name in set(sys.modules) - before:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("CHARTS = (", "odd.py: it cannot be imported .SyntaxError"),
        ("import nothing_of_that_name", "odd.py: it cannot be imported .ModuleNotFoundError"),
        ("from gms_fsm import State; State('a', flow=3)", "odd.py: state 'a': flow is 3"),
        ("CHARTS = [1]", r"odd.py: CHARTS is \[1\]; it must be a tuple of Entry"),
        ("CHARTS = (1,)", r"odd.py: CHARTS is \(1,\); it must be a tuple of Entry"),
        (
            "from gms_fsm.charts.zoo.bristles.lugre import CHARTS",
            "odd.py: the name 'lugre' is already used by gms_fsm/charts/zoo/bristles/lugre.py",
        ),
    ],
)
def test_an_invalid_file_is_named(text: str, words: str, folder: Path) -> None:
    (folder / "odd.py").write_text(text)
    with pytest.raises(ChartError, match=f"^gms_fsm/charts/{words}"):
        registered()


def test_a_module_without_charts_is_skipped(folder: Path) -> None:
    (folder / "helpers_of_mine.py").write_text("HALF = 0.5\n")
    assert "lugre" in registered()


def test_the_order_of_the_values_does_not_matter() -> None:
    """The tolerance of z comes from guards and forces, computed with the parameters by name."""
    element = GMS_ELEMENT["signed"]
    values = {"k": 40.0, "sigma": 0.3, "C": 0.02, "v_c": 1e-6}
    turned = dict(reversed(values.items()))
    runs = [
        simulate(ChartModel(element, given, stribeck=CURVE), Prescribed("0.2*sin(t)"), 9.0)
        for given in (values, turned)
    ]
    same_bits(*runs)
    assert runs[0].settings == runs[1].settings
