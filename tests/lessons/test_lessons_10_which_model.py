"""Lesson 10: what each model shows, the numbers behind the verdicts, and the model to choose."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import GMS, measure_phenomena
from gms_fsm.app.lessons import l10_which_model as lesson
from gms_fsm.phenomena._specimens import bench_bank
from tests.lesson_checks import check_figure, check_lines

pytestmark = pytest.mark.slow

# "+" shows, "-" does not show, "!" shows wrongly; in the order of lesson.PHENOMENA.
EXPECTED = {
    "stiction": "--+-+",
    "lugre": "+-!++",
    "elasto-plastic": "+-+++",
    "gms-signed": "+++++",
    "gms-published": "+-++!",
}
SIGNS = {"shows": "+", "does not show": "-", "shows wrongly": "!"}


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


@pytest.mark.parametrize("model", lesson.MODELS)
def test_the_verdicts_are_those_of_the_lesson(result: lesson.Result, model: str) -> None:
    verdicts = [result.table.cell(model, name).verdict for name in lesson.PHENOMENA]
    assert "".join(SIGNS[each] for each in verdicts) == EXPECTED[model]


def test_lugre_drifts_where_elasto_plastic_and_gms_rest(result: lesson.Result) -> None:
    limit = result.threshold("lugre", "drift")
    assert limit == pytest.approx(0.015)  # µm
    assert result.number("lugre", "drift") > 100 * limit
    for model in ("stiction", "elasto-plastic", "gms-signed"):
        assert abs(result.number(model, "drift")) < 0.01 * limit


def test_only_a_model_with_several_states_closes_an_inner_loop(result: lesson.Result) -> None:
    assert result.states == {
        "stiction": 0,
        "lugre": 1,
        "elasto-plastic": 1,
        "gms-signed": 4,
        "gms-published": 4,
    }
    for model in ("lugre", "elasto-plastic"):
        assert result.number(model, "memory") > 30  # %
    assert result.number("gms-signed", "memory") < 0.01
    assert result.number("gms-signed", "memory", "width of the inner loop at F = 0") > 10  # µm


@pytest.mark.parametrize("model", ["stiction", "gms-published"])
def test_no_gap_is_no_memory_without_a_loop(result: lesson.Result, model: str) -> None:
    """Their gap is 0, which is not memory: they have no inner loop."""
    assert result.number(model, "memory") < result.threshold(model, "memory")
    width = result.number(model, "memory", "width of the inner loop at F = 0")
    assert width == pytest.approx(0.0, abs=1e-3)  # µm


def test_a_bank_of_one_element_is_a_spring_without_a_loop() -> None:
    one = GMS(bench_bank(lesson.BENCH, 1), law="signed")
    found = measure_phenomena({"one": one}, ["memory"]).cell("one", "memory")
    assert (found.verdict, found.said) == ("does not show", "there is no inner loop")


def test_the_replayed_runs_are_those_of_the_table(result: lesson.Result) -> None:
    for model, trace in result.nested.items():
        np.testing.assert_array_equal(
            1e6 * trace.x, result.table.cell(model, "memory").curves[0].x, strict=True
        )
    elements = result.replayed["GMS, signed law"].transitions
    assert {"break_away_forward", "break_away_backward", "arrest"} <= set(elements.edge.tolist())


def test_a_fast_pull_meets_less_friction_except_with_stiction(result: lesson.Result) -> None:
    assert result.number("stiction", "break-away") < 1e-6  # N
    for model in ("lugre", "elasto-plastic", "gms-signed"):
        slow = result.number(model, "break-away", "break-away force at 0.1 N/s")
        fast = result.number(model, "break-away", "break-away force at 50 N/s")
        assert slow == pytest.approx(lesson.BENCH.F_s, rel=0.01)
        assert slow - fast > 10 * result.threshold(model, "break-away")


def test_lag_needs_a_state(result: lesson.Result) -> None:
    limit = result.threshold("lugre", "lag")
    assert limit == pytest.approx(7.5)  # mN
    for model, states in result.states.items():
        width = result.number(model, "lag", "width of the loop at 25 rad/s")
        assert (width > 4 * limit) == (states > 0)


def test_the_published_law_makes_energy(result: lesson.Result) -> None:
    for model in lesson.MODELS:
        made, limit = result.number(model, "passivity"), result.threshold(model, "passivity")
        assert (made > 100 * limit) if model == "gms-published" else (made == 0.0)
    # In all, it gives back more than it takes.
    taken = result.number("gms-published", "passivity", "energy taken in all cycles")
    assert taken == pytest.approx(-result.number("gms-published", "passivity"), rel=1e-3)


@pytest.mark.parametrize(
    ("wanted", "chosen"),
    [
        ([], "stiction"),
        (["drift"], "stiction"),
        (["drift", "lag"], "elasto-plastic"),
        (["break-away"], "elasto-plastic"),  # not LuGre, which drifts
        (["memory"], "gms-signed"),
        (lesson.PHENOMENA, "gms-signed"),
        (["stick-slip"], ""),  # not measured here
    ],
)
def test_the_choice(result: lesson.Result, wanted: list[str], chosen: str) -> None:
    assert result.choice(wanted) == chosen


def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    lines = result.lines()
    assert "0.00, 1.96, 0.00, 0.00, 0.00 µm" in lines[2]
    assert "0.00, 0.00, 0.00, 0.00, 3.86 mJ" in lines[2]
    assert "0.0, 36.0, 32.5, 129.5, 129.5 mN" in lines[3]
    check_figure(lesson, result)
