"""Generated motions take every edge and pair of edges of a chart, or it is proved why not."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    Contact,
    Generated,
    GMSParameters,
    ParameterError,
    State,
    System,
    Transition,
    coverage,
    generate,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts.registry import charts
from gms_fsm.generation.stand import CONTACT
from gms_fsm.language import Relation
from gms_fsm.systems.any_model import any_contact
from gms_fsm.verification.reaching.points import GuardPoints, TurningPoint
from gms_fsm.verification.reaching.unreachable import Nowhere

SOME = ("backlash", "elasto-plastic", "gms-signed", "maxwell-slip", "seven-parameter", "stiction")


@pytest.fixture(scope="module")
def backlash() -> Generated:
    return generate(charts()["backlash"])


@pytest.mark.every(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", SOME)
def test_every_edge_every_pair_and_every_comparison_is_tried(name: str) -> None:
    found = generate(charts()[name])
    assert found.unreached == ()
    assert found.pairs.percent == 100.0
    assert {share.percent for share in found.coverage.scores.values()} == {100.0}


def test_what_time_forbids_is_proved_to_be_out_of_reach() -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    found = generate(charts()["dog-clutch"])
    (never,) = found.unreached
    assert (never.what, never.verdict) == ("engage from open, after disengage", "proved")
    assert never.reason == "after disengage, t >= t_off holds as long as open lasts"
    assert found.open == ()


@pytest.mark.matrix
def test_without_a_proof_it_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gms_fsm.generation.generate.numbers_fit", lambda _: False)
    (never,) = generate(charts()["dog-clutch"]).open
    assert never.what == "engage from open, after disengage"
    assert never.reason.startswith("not proved, and not reached by ")


def test_saved_motions_are_scenarios_with_the_same_coverage(
    backlash: Generated, tmp_path: Path
) -> None:
    paths = backlash.save(tmp_path / "out")
    assert [path.name for path in paths[:2]] == ["motion_01.toml", "motion_02.toml"]
    runs = [load_scenario(path).simulate(monitors=(), t_eval=None) for path in paths]
    assert coverage(runs).contact() == backlash.coverage.contact()


def test_no_motion_can_be_left_out_of_the_pairs(backlash: Generated) -> None:
    assert len(backlash.runs) < 20
    assert len({run.title for run in backlash.runs}) > 8


def test_equal_seeds_give_equal_motions(backlash: Generated) -> None:
    again = generate(charts()["backlash"])
    assert [run.system for run in again.runs] == [run.system for run in backlash.runs]
    assert [run.initial for run in again.runs] == [run.initial for run in backlash.runs]


def test_motions_keep_to_their_bounds() -> None:
    found = generate(charts()["maxwell-slip"], bounds={"v": (-0.01, 0.02)})
    assert found.bounds["v"] == (-0.01, 0.02)
    assert found.pairs.percent == 100.0
    values = [u for run in found.runs for u in run.trace.v]
    assert -0.01 <= min(values) < max(values) <= 0.02


@pytest.mark.matrix
def test_what_bounds_forbid_is_open() -> None:
    found = generate(charts()["backlash"], bounds={"v": (0.0, 1.0)})
    assert "touch_left from apart" in {each.what for each in found.open}


def test_a_model_keeps_its_elements_and_numbers() -> None:
    model = GMS(GMSParameters.paper("non-drifting"), law="signed")
    found = generate(model)
    assert found.unreached == ()
    assert {run.system.contact(CONTACT).model for run in found.runs} == {model}


@pytest.mark.matrix
def test_of_a_system_one_contact_is_tried_alone() -> None:
    stops = [
        Contact(name, charts()["end-stop"], {"x_s": u, "e": 0.5, "v_r": 0.01}, v=v)
        for name, u, v in (("left", 1.0, "-v"), ("right", 2.0, "v"))
    ]
    system = System("cart", bodies=[Body("cart", inertia=1.0, force="1")], contacts=stops)
    found = generate(system, "right")
    assert found.pairs.percent == 100.0
    assert {float(run.system.contact(CONTACT).values["x_s"]) for run in found.runs} == {2.0}
    with pytest.raises(ParameterError, match="contact='left'"):
        generate(system)


def test_a_chart_without_edges_has_one_motion() -> None:
    found = generate(charts()["lugre"])
    assert (len(found.runs), found.pairs.of, found.unreached) == (1, 0, ())


def test_an_edge_behind_another_one_is_proved_never_to_be_taken() -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    edges = (
        Transition("one", "a", "b", guard="v > 0"),
        Transition("other", "a", "b", guard="v > 1"),
        Transition("back", "b", "a", guard="v < 0"),
    )
    chart = Chart("hidden", states=(State("a"), State("b")), transitions=edges, outputs={"F": "0"})
    found = generate(chart)
    reasons = {each.what: (each.verdict, each.reason) for each in found.unreached}
    why = "never taken: wherever its guard holds, an earlier edge takes precedence (one)"
    assert reasons == {
        "other from a": ("proved", why),
        "back from b, after other": ("proved", why),
        "other from a, after back": ("proved", why),
    }


def test_a_frozen_value_forbids_a_pair() -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    edges = (
        Transition("mark", "a", "b", guard="v > 0", actions={"z": "1"}),
        Transition("far", "b", "a", guard="z > 2"),
        Transition("near", "b", "a", guard="z < 2 and v < 0"),
    )
    chart = Chart(
        "marked",
        variables=("z",),
        states=(State("a"), State("b")),
        transitions=edges,
        outputs={"F": "0"},
    )
    proofs = Nowhere(chart)
    mark, far, near = chart.transitions
    assert proofs.pair(mark, far) == "after mark, z <= 2 holds as long as b lasts"
    assert proofs.pair(mark, near) == ""
    assert proofs.edge(far) == ""


def test_a_value_that_flows_forbids_nothing() -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    edges = (
        Transition("mark", "a", "b", guard="v > 0", actions={"z": "1"}),
        Transition("far", "b", "a", guard="z > 2"),
    )
    states = (State("a"), State("b", flow={"z": "v"}))
    force = {"F": "0"}
    chart = Chart("marked", variables=("z",), states=states, transitions=edges, outputs=force)
    assert Nowhere(chart).pair(*chart.transitions) == ""


@pytest.mark.parametrize("name", ["gms-signed", "stiction", "elasto-plastic"])
def test_a_turning_point_is_where_the_last_digit_decides(name: str) -> None:
    contact = any_contact(charts()[name])
    drives = dict.fromkeys(contact.chart.velocities, "velocity")
    guards = GuardPoints(contact, 1.0, {}, 0, drives)
    for state in contact.chart.states:
        points = list(guards.turning(state.name))
        assert points
        for each in points:
            written, full = guards.pairs[each.edge.source, each.edge.name][each.number]
            assert isinstance(written, Relation)
            margin = guards.margin(full, each.values)
            assert (margin == 0.0) == each.equal
            sides = full.op in ("<=", ">="), guards.holds(full, each.values)
            assert (sides[0] == sides[1]) == each.equal
            assert each.equal or _near(guards, each)


def _near(guards: GuardPoints, point: TurningPoint) -> bool:
    """Return whether the truth is another one at a float beside a point, in some direction."""
    _, full = guards.pairs[point.edge.source, point.edge.name][point.number]
    here = guards.holds(full, point.values)
    for name in guards.names(full) & {*guards.free}:
        u = point.values.get(name, 0.0)
        beside = (0.0, math.nextafter(u, math.inf), math.nextafter(u, -math.inf))
        if any(guards.holds(full, {**point.values, name: w}) != here for w in beside):
            return True
    return False


def test_a_supervisor_is_tried_by_its_inputs_and_its_events_are_open() -> None:
    edges = (
        Transition("on", "cold", "warm", guard="T > 21"),
        Transition("off", "warm", "cold", guard="T < 19"),
        Transition("stop", "warm", "cold", event="alarm"),
    )
    outputs = State("cold", outputs={"u": "1"}), State("warm", outputs={"u": "0"})
    found = generate(Chart("room", ("T",), states=outputs, transitions=edges, velocities=()))
    stopped = ("stop from warm", "stop from warm, after on", "on from cold, after stop")
    assert {each.what for each in found.open} == {*stopped}
    assert {each.reason for each in found.open} == {
        "it waits for the event alarm, which no motion sends"
    }
    assert found.pairs.seen == 2
