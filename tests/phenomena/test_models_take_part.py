"""Claim: every included chart is on the bench or left out with a reason, and so is one's own."""

from __future__ import annotations

import pytest

from gms_fsm import Chart, ChartModel, Contact, State, measure_phenomena
from gms_fsm.charts import CHARTS
from gms_fsm.errors import GMSError
from gms_fsm.phenomena import _bench
from gms_fsm.phenomena.measure import Bench
from gms_fsm.phenomena.results import PhenomenonResult
from gms_fsm.phenomena.specimens import specimens_of
from tests.phenomena.cases import BENCH, DRY, LUGRE

LOADED = Chart(
    "loaded",
    inputs=("v", "N"),
    parameters=("mu",),
    states=(State("slip", outputs={"F": "mu * N * v"}),),
)


def test_every_included_chart() -> None:
    specimens = specimens_of(None, BENCH)
    assert {each.name for each in specimens} == set(CHARTS)
    for each in specimens:
        assert (each.contact is None) == bool(each.why_not), each.name


def test_the_paper_models_have_the_numbers_of_the_bench() -> None:
    gms, lugre = specimens_of(["gms-signed", "lugre"], BENCH)
    assert gms.contact is not None
    assert lugre.contact is not None
    assert sum(gms.contact.values["k"]) == pytest.approx(1e5)
    assert gms.contact.n == 4
    assert lugre.contact.values["sigma_0"] == 1e5
    assert lugre.contact.stribeck == gms.contact.stribeck


def test_a_contact_of_ones_own_needs_constant_inputs() -> None:
    (held,) = specimens_of({"mine": Contact("pad", LOADED, {"mu": 0.1}, inputs={"N": 2.0})}, BENCH)
    assert held.contact is not None
    (paired,) = specimens_of({"mine": Contact("pad", DRY)}, BENCH)
    assert repr(paired.contact) == repr(Contact("friction", DRY))
    with pytest.raises(GMSError, match=r"the input N of its contact is 'N_0 \+ x'"):
        specimens_of({"mine": Contact("pad", LOADED, {"mu": 0.1}, inputs={"N": "N_0 + x"})}, BENCH)


def test_what_is_no_model_and_no_bench_is_refused() -> None:
    """Unknown names are in tests/refusals.py."""
    with pytest.raises(GMSError, match=r"models\['mine'\] is 3; it must be a model"):
        measure_phenomena({"mine": 3})  # type: ignore[dict-item]
    with pytest.raises(GMSError, match="bench: F_s is -1"):
        Bench(F_s=-1.0)


def _on_bench(phenomenon: str, force: str, flow: str = "v") -> PhenomenonResult:
    """Return what a model of one state does; its friction is ``force``, in N."""
    state = State("on", flow={"z": flow})
    model = ChartModel(Chart("own", variables=("z",), states=(state,), outputs={"F": force}), {})
    return measure_phenomena({"own": model}, [phenomenon]).cell("own", phenomenon)


@pytest.mark.matrix
@pytest.mark.slow
def test_what_is_hardly_friction_is_told_apart() -> None:
    """A thin oil slides at any force, a soft spring is not released, an echo comes too late."""
    away = "it slides away although the break-away force is not reached"
    said = {
        ("hysteresis", "v"): ("shows wrongly", away),
        ("memory", "v"): ("does not show", away),
        ("stick-slip", "v"): ("does not show", "it slides steadily"),
        ("stick-slip", "1e5 * z - 5 * v"): ("does not show", "it oscillates and never sticks"),
        ("vibration", "1e3 * z + v"): (
            "does not show",
            "it is not released, although the peak force is far above the break-away force",
        ),
        ("lag", "1e3 * z", "3 * (v - z)"): (
            "shows wrongly",
            "there is less friction while the speed rises",
        ),
    }
    for given, expected in said.items():
        found = _on_bench(*given)
        assert (found.verdict, found.said) == expected


def test_a_model_with_too_many_steps_is_run_with_an_implicit_method(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fall = []
    for steps in (_bench.MOST_STEPS, 30):
        monkeypatch.setattr(_bench, "MOST_STEPS", steps)
        found = measure_phenomena({"lugre": LUGRE}, ["stribeck"]).cell("lugre", "stribeck")
        assert found.verdict == "shows"
        fall.append(found.number("fall of the friction"))
    assert fall[1] == pytest.approx(fall[0], rel=1e-6)
    assert fall[1] != fall[0], "both were run in the same way"


@pytest.mark.slow
def test_a_model_that_cannot_be_measured_fails_with_the_reason() -> None:
    stiff = Bench(F_s=1e-3)  # a break-away of 1.5 N is then out of reach
    found = measure_phenomena({"dry": DRY}, ["break-away"], bench=stiff).cell("dry", "break-away")
    assert found.verdict == "failed"
    assert "it did not break away" in found.said
    assert not found.numbers
