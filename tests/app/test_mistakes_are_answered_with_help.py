"""Formats are told from one table, no bar stands before an error, and numbers are plain."""

from __future__ import annotations

import functools
import operator
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import graphviz
import numpy as np
import pytest

import gms_fsm as package
from gms_fsm import Prescribed, Session, simulate
from gms_fsm.app.fits import load_fit
from gms_fsm.app.scenario import load_scenario, session_of
from gms_fsm.charts import gms_element
from gms_fsm.errors import GMSError, ParameterError, shown
from gms_fsm.foundation.toml import written
from gms_fsm.run.simulate import Moment
from gms_fsm.scenarios import shipped
from plots import block_diagram, mermaid, render, statechart
from plots.output.formats import of
from tests.helpers import pulled_mass, stick_slip
from tests.scenario_files import MEASURED, OPEN_LOOP, CommandLine, changed, sine_table


@pytest.mark.slow
def test_the_formats_are_named_from_one_table(tmp_path: Path, gms_fsm: CommandLine) -> None:
    done = gms_fsm("chart", "lugre", "-o", "x.tex")
    assert done.code == 2
    for each in of("graph", "chart"):
        assert each.name in done.message
        assert f" for {each.kind}" in done.message
        assert each.name in gms_fsm("chart", "--help").out
    chart = gms_element("signed")
    written = render(statechart(chart, 4, names=True), tmp_path / "chart.MMD")
    assert written.read_text(encoding="utf-8") == mermaid(chart)
    for graph in (block_diagram(2), graphviz.Digraph("own")):  # only a chart is Mermaid text
        with pytest.raises(ParameterError, match=r"must end in \.svg.*\.gv for DOT text$"):
            render(graph, tmp_path / "x.mmd")


@pytest.mark.parametrize(
    ("arguments", "cure"),
    [
        ("simulate a.toml", "Did you mean 'run'?"),
        ("trust a.toml", "Did you mean 'run --trust'?"),
        ("copy servo my.toml", "-o my.toml"),
        ("run servo -out res", "named by -o res"),
        ("run servo own", "It runs one scenario at a time: gms-fsm run own"),
        ("run pulled mass", "Did you mean 'pulled_mass'?"),
        ("run pulled_mass.toml", "no such file; that of the package is 'pulled_mass'"),
        ("class pack", "named by -o pack"),
        ("play servo --vary numbers.k_p 1..2", "without blanks: --vary numbers.k_p=1..2"),
        ("run servo --trust 5", "--trust takes no value: leave 5 out"),
        ("check servo.tml", "did you mean the file 'servo.toml'?"),
        ("check pulled", "did you mean the file 'pulled.toml'?"),
        ("run a.toml --set rig.mass = 2", "without blanks: --set rig.mass=2"),
        ("run a.toml -t 2", "--set run.t_end=2"),
        ("run a.toml --set run.t_end 2", "without blanks: --set run.t_end=2"),
        ("run a.toml -s run.t_end=2", "No such option: -s. A key is changed by --set run.t_end=2"),
        ("run a.toml t_end=10", "changed by --set t_end=10"),
        ("run a.toml --law signed", "--set model.law=signed"),
        ("debug servo --speed 2", "debug takes --light, --set, --tui"),
        ("chart gms signed", "chosen by --law signed"),
        ("code lugre -o lugre.py", "gms-fsm code ... > FILE"),
    ],
)
def test_arguments_that_are_not_taken_are_answered_with_what_is_meant(
    arguments: str, cure: str, gms_fsm: CommandLine
) -> None:
    for name in ("servo.toml", "pulled.toml"):
        Path(name).touch()
    done = gms_fsm(*arguments.split())
    assert done.code == 2
    assert cure in " ".join(done.err.replace("│", " ").split())


@pytest.mark.parametrize(
    "arguments",
    [
        ("paper", "--velocity", "1 +", "-o", "p"),
        ("animate", "run.npz", "--frames", "1"),
        ("animate", "run.npz", "--start", "9"),
    ],
)
def test_no_bar_before_an_error(arguments: tuple[str, ...], gms_fsm: CommandLine) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    simulate(stick_slip("signed"), Prescribed("0.2"), 1.0).save("run.npz")
    done = gms_fsm(*arguments)
    assert done.code == 2
    assert done.err.startswith("error: "), done.err
    assert done.out == ""


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.float64(20.0), "20.0"),
        (np.bool_(True), "True"),
        (np.str_("a"), "'a'"),
        ([np.float32(0.5), (np.float64(1.0), 2)], "[0.5, (1.0, 2)]"),
        ({np.str_("k"): np.float64(1.0)}, "{'k': 1.0}"),
        (np.array(2.0), "2.0"),
        (np.array([1.0]), "array([1.])"),
    ],
    ids=repr,
)
def test_numbers_are_shown_as_plain_numbers(value: object, text: str) -> None:
    assert shown(value) == text


@pytest.mark.parametrize(
    ("name", "cure"), [("velocity", "write trace.v"), ("plot", "write plots.overview(trace)")]
)
def test_a_trace_says_what_is_called_otherwise(name: str, cure: str) -> None:
    trace = simulate(stick_slip("signed"), Prescribed("0.2"), 0.1)
    with pytest.raises(AttributeError, match=f"a Trace has no '{name}'; {re.escape(cure)}$"):
        getattr(trace, name)


def test_a_session_says_how_it_sends_an_event() -> None:
    session = Session(stick_slip("signed"), Prescribed("0.2"), 0.1)
    with pytest.raises(AttributeError, match=r"a Session has no 'send'; write session\.poke"):
        session.send("hot")  # type: ignore[attr-defined]


def test_the_package_suggests_a_name() -> None:
    with pytest.raises(AttributeError, match="no attribute 'simulte'; did you mean 'simulate'"):
        _ = package.simulte


def test_a_moment_knows_where_the_slider_is() -> None:
    moments: list[tuple[float, Any]] = []

    def note(moment: Moment) -> None:
        moments.append((moment.t, moment.values["x"]))

    trace = simulate(*pulled_mass(), 10.0, progress=note)
    for t, x in moments:
        assert x in trace.x[trace.t == t].tolist()
    assert moments[-1][1] > 0.0


def keys_of(table: Any, before: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the keys of a table and of the tables in it."""
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        yield (*before, key)
        if isinstance(value, dict) or (
            value and isinstance(value, list) and isinstance(value[0], dict)
        ):
            yield from keys_of(value, (*before, key))


PULLED = (
    OPEN_LOOP.replace(
        'kind = "prescribed"\nvelocity = "0.1*sin(t)"',
        'kind = "pulled"\nmass = 1.0\nstiffness = 100.0\nspeed = 0.01',
    )
    + """\
every = 0.1
[initial]
z = [0.0, 0.0]
states = ["stick", "stick"]
v = 0.0
"""
)
RUN = """\
t_end = 1.0
method = "dp45"
rtol = 1e-6
atol = { z = [1e-9, 1e-9] }
monitors = ["passivity", "abs(z) < 1"]
"""
FIT = """\
[fit]
free = ["k"]
fixed = { C = 21.0 }
measured = "F"
train = [0.0, 0.5]
bounds = { k = [10.0, 1e5] }
"""
FILES = {
    "a model on a rig": changed(PULLED, "t_end = 1.0\n", RUN),
    "a fit of a record": MEASURED.replace('file = "own', 'where = "time >= 0 s"\nfile = "own')
    + FIT,
    "a system": shipped()["servo"].read_text(encoding="utf-8"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_every_key_that_is_mistyped_is_found_on_its_line(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own.csv").write_text(sine_table())
    said = list[str]()
    for *tables, key in keys_of(tomllib.loads(FILES[name])):
        for wrong in (-1, "abc", ["abc"]):
            data = tomllib.loads(FILES[name])
            functools.reduce(operator.getitem, tables, data)[key] = wrong
            Path("a.toml").write_text(written(data))
            try:
                session_of(load_scenario("a.toml"))
                if "fit" in data:
                    load_fit("a.toml")
            except GMSError as error:
                said.append(str(error))
    assert len(said) > 50
    assert [each for each in said if not re.match(r"a\.toml: line \d+[:, ]", each)] == []
