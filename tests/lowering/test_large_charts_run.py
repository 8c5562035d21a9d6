"""Claim: a chart with many states runs in all engines; one that is too large is refused at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gms_fsm.charts.files.from_scxml as from_scxml
from gms_fsm import Chart, ChartError, ChartModel, Prescribed, Settings, State, Transition, simulate
from tests.corpus import ENGINES


def hub(n: int) -> Chart:
    """Return a chart whose hub leads to n states, each with a jump of its flow, and back."""
    at = range(1, n + 1)
    flows = {f"at{i}": {"z": f"v * (1 + 0.1 * sgn(z - {i}.1))"} for i in at}
    return Chart(
        "hub",
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("hub", flow={"z": "v"}), *(State(*each) for each in flows.items())),
        transitions=(
            *(Transition(f"to{i}", "hub", f"at{i}", guard=f"abs(z - {i}) < 0.25") for i in at),
            *(Transition(f"from{i}", f"at{i}", "hub", guard=f"z > {i}.5") for i in at),
        ),
        outputs={"F": "k * z"},
    )


@pytest.mark.matrix
@pytest.mark.slow
def test_engines_agree_where_branches_are_halved() -> None:
    model, rig = ChartModel(hub(60), {"k": 1.0}), Prescribed("t")
    runs = [simulate(model, rig, 11.5, settings=Settings(engine=each)) for each in ENGINES]
    assert len(runs[0].transitions) == 2 * 60
    for run in runs[1:]:
        np.testing.assert_array_equal(run.F, runs[0].F)
        assert run.transitions.edge.tolist() == runs[0].transitions.edge.tolist()


@pytest.mark.matrix
@pytest.mark.slow
def test_a_ring_of_500_states_runs() -> None:
    states = tuple(State(f"s{i}", flow={"z": "v"}) for i in range(500))
    edges = (
        Transition(f"e{i}", f"s{i}", f"s{(i + 1) % 500}", guard=f"z > {i + 1} * k")
        for i in range(500)
    )
    chart = Chart("ring", ("v",), ("z",), ("k",), states, tuple(edges), {"F": "k * z"})
    run = simulate(ChartModel(chart, {"k": 1.0}), Prescribed("1"), 499.5)
    assert run.transitions.t == pytest.approx(np.arange(1.0, 500.0))
    assert run.modes[-1].tolist() == [499]


def test_a_document_is_counted_before_it_is_read(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def read(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(from_scxml, "_Document", read)
    path = tmp_path / "large.scxml"
    states = "".join(f'<state id="s{i}"/>' for i in range(5_001))
    path.write_text(f'<scxml xmlns="{from_scxml.SCXML}">{states}</scxml>')
    with pytest.raises(ChartError, match="5,001 states"):
        Chart.from_scxml(path)
