"""A chart without the input s has no Stribeck curve: none is invented, offered, printed or saved.

Code that shows thresholds copes: they are NaN in the trace and omitted in texts for people.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from gms_fsm import (
    Chart,
    ChartModel,
    Prescribed,
    PulledSlider,
    Session,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.app.live import LiveView
from gms_fsm.app.report import _parameters
from gms_fsm.errors import ExpressionError, ParameterError
from gms_fsm.lowering.generated import standalone
from gms_fsm.lowering.program import arguments, lower
from gms_fsm.run.simulate import Moment
from gms_fsm.run.sweep import sweep
from gms_fsm.systems.models import parameter_names, with_values
from gms_fsm.systems.system import system_of

CHART = Chart(
    "a latch",
    ("v",),
    ("z",),
    ("k", "F_c"),
    (State("free", {"z": "v"}), State("fixed", {"z": "-z"})),
    (
        Transition("catch", "free", "fixed", "z > F_c"),
        Transition("release", "fixed", "free", "z < 0.5 * F_c"),
    ),
    {"F": "k * z"},
)
RIG = Prescribed("0.2")


@pytest.fixture(scope="module")
def model() -> ChartModel:
    return ChartModel(CHART, {"k": [1.0, 2.0], "F_c": 0.1}, n=2)


@pytest.fixture(scope="module")
def trace(model: ChartModel) -> Trace:
    return simulate(model, RIG, 5.0, monitors="all")


def test_none_is_invented_and_one_of_the_users_is_kept(trace: Trace) -> None:
    assert trace.model.stribeck is None
    assert len(trace.transitions) == 20
    assert np.isnan(trace.s).all()
    assert np.isnan(trace.transitions.s).all()
    curve = Stribeck(1.0, 1.5, 0.1)
    model = ChartModel(CHART, {"k": 1.0, "F_c": 0.1}, stribeck=curve)
    assert model.stribeck == curve
    assert simulate(model, Prescribed("0"), 1.0).s.tolist()[0] == [1.5]


def test_no_number_of_it_is_in_the_program(model: ChartModel) -> None:
    program = lower(model, PulledSlider(1.0, 2.0, 0.1))
    shared, own, _ = arguments(system_of(model, PulledSlider(1.0, 2.0, 0.1)))
    assert shared == [0.0, 1.0, 2.0, 0.1, 0.1]  # sigma_2, mass, stiffness, speed, F_c
    assert own == [[1.0, 1.0], [1.0, 2.0]]
    for word in ("F_s", "v_s", "exp", " S ", "weight"):
        assert word not in program.source
    assert "from math import nan\n" in standalone(program.source)


def test_nothing_is_offered_for_varying(model: ChartModel) -> None:
    assert parameter_names(model) == ("k", "F_c", "sigma_2")
    other = with_values(model, {"F_c": 0.3, "F_s": 9.0, "weights": 7.0})
    assert other.stribeck is None
    assert other.values["F_c"] == 0.3
    assert other.weights.tolist() == [1.0, 1.0]
    for name in ("F_s", "v_s", "weights"):
        with pytest.raises(ParameterError, match=f"'{name}'; .*there are k, F_c, sigma_2, v$"):
            sweep(model, RIG, 3.0, {name: [1.0, 2.0]}, engine="machines")


def test_conditions_cannot_use_s(model: ChartModel, tmp_path: Path) -> None:
    session = Session(model, RIG, 5.0)
    session.next_transition()
    assert session.names == ["t", "x", "v", "F", "z1", "z2", "F1", "F2"]
    for text in ("s > 1", "z1 > s1"):
        with pytest.raises(ExpressionError, match="unknown name 's"):
            session.parse(text)
    assert "catch fired here" in str(session.why(0))
    with pytest.raises(ExpressionError, match="unknown name 's'"):
        simulate(model, RIG, 1.0, monitors="abs(z) <= s")
    again = Session.load(session.save(tmp_path / "walk.session"))
    assert again.model.stribeck is None
    assert again.here.t == session.here.t


def test_texts_for_people_mention_no_curve(trace: Trace) -> None:
    assert _parameters(trace) == "k = [1, 2], F_c = 0.1, sigma_2 = 0 Ns/m"
    for text in (str(trace), *(verdict.text for verdict in trace.monitors.values())):
        assert "nan" not in text


def test_the_live_table_shows_no_ratio(model: ChartModel) -> None:
    console = Console(record=True, width=100, force_terminal=False)
    view = LiveView(console, 0.0, 5.0, detail=True)
    moments: list[Moment] = []
    simulate(model, RIG, 5.0, progress=moments.append)
    console.print(*view.tables(moments[-1]))
    said = console.export_text()
    assert "E2" in said
    assert "nan" not in said


@pytest.mark.matrix
@pytest.mark.slow
def test_pictures(trace: Trace, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    from matplotlib.figure import Figure

    from plots import figures, panels

    for number, draw in enumerate(
        (figures.overview, figures.ribbons_figure, figures.cascade_figure)
    ):
        figures.save(draw(trace), tmp_path / f"{number}.png")
    with pytest.raises(ParameterError, match="a latch: its chart has no input s, and therefore no"):
        panels.stribeck(Figure().subplots(), trace)


def test_the_replay_page_omits_s(trace: Trace) -> None:
    pytest.importorskip("uplot", reason="the page needs the extra 'replay'")
    from plots.page.replay import replay_html

    data = replay_html(trace).partition('id="data">')[2].partition("</script>")[0]
    (run,) = json.loads(data)["runs"]
    assert set(run["names"]) == {"t", "x", "v", "F", "z1", "z2", "F1", "F2"}
    assert "NaN" not in data
