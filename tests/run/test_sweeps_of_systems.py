"""A sweep of a system is many runs: each equals, to the last bit, a run with these numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import GMS, Body, Contact, GMSParameters, Sampled, Sweep, System, simulate, sweep
from gms_fsm.errors import ParameterError, TraceFileError
from tests.systems_cases import BACKLASH, STICTION

BANK = GMSParameters.paper("stick-slip")


def _system(m: float = 1.0, F_s: float = 1.5, k: float | None = None, gap: float = 0.01) -> System:
    bank = (
        BANK
        if k is None
        else GMSParameters(
            [k] * 4,
            BANK.sigma,
            BANK.C,
            sigma_2=BANK.sigma_2,
            stribeck=BANK.stribeck,
            v_c=BANK.v_c,
            weights=BANK.weights,
        )
    )
    return System(
        "pair",
        bodies=(
            Body("one", inertia="m", force="2 * (0.1 * t - x1) + u", x="x1", v="v1"),
            Body("two", inertia=0.5, x="x2", v="v2"),
        ),
        contacts=(
            Contact("pad", STICTION, {"F_c": 1.0, "F_s": F_s, "b": 0.0}, v="v1"),
            Contact("gear", BACKLASH, {"k": 100.0, "d": 1.0, "gap": gap}, v="v1 - v2"),
            Contact("bank", GMS(bank, law="signed"), v="v2"),
        ),
        numbers={"m": m},
        sampled=(Sampled("control", period=0.5, updates={"u": "-0.1 * v1"}),),
    )


VARIED = {
    "numbers.m": [1.0, 2.0],
    "pad.F_s": [1.5, 1.2],
    "gear.gap": [0.01, 0.02],
    "bank.k": [[20.0] * 4, [30.0] * 4],
}


@pytest.fixture(scope="module")
def found() -> Sweep:
    options = {"output": "t_eval", "t_eval": [0.0, 5.0, 9.0]}
    return sweep(_system(), 9.0, VARIED, engine="ifelse", **options)  # type: ignore[arg-type]


def test_each_run_equals_simulate(found: Sweep) -> None:
    assert found.outcome.tolist() == ["ok", "ok"]
    for run in (0, 1):
        m, F_s, gap = (VARIED[name][run] for name in ("numbers.m", "pad.F_s", "gear.gap"))
        system = _system(m, F_s, VARIED["bank.k"][run][0], gap)  # type: ignore[arg-type, index]
        trace = simulate(system, 9.0, engine="ifelse", t_eval=[0.0, 5.0, 9.0])
        assert found.ends["one.x"][run] == trace.body("one").x[-1]
        assert found.ends["u"][run] == trace.value("u")[-1]
        assert found.rows["two.v"][run].tolist() == trace.body("two").v.tolist()
        for name in ("pad", "gear", "bank"):
            part, contact = found.contact(name), trace.contact(name)
            assert part.F[run] == contact.F[-1]
            assert part.rows["F"][run].tolist() == contact.F.tolist()
            np.testing.assert_array_equal(part.z[run], contact.z[-1])
            assert part.states[run].tolist() == contact.states[-1].tolist()
            log = contact.transitions
            assert part.sequence(run) == list(zip(log.element, log.edge, strict=True))
        assert found.transition_count[run] == len(trace.transitions) > 2


def test_edges_and_columns_have_the_contact_s_name(found: Sweep) -> None:
    assert found.sequence(0)[0] == (0, "pad.release_forward")
    columns = found.columns()
    assert {"one.x", "two.v", "u", "pad.F", "gear.state1", "bank.z4", "numbers.m"} < set(columns)
    assert columns["bank.z4"].tolist() == found.z[:, 5].tolist()


def test_a_file_reads_back_equal(found: Sweep, tmp_path: Path) -> None:
    other = Sweep.load(found.save(tmp_path / "runs.npz"))
    for name, column in found.columns().items():
        np.testing.assert_array_equal(column, other.columns()[name], name)
    np.testing.assert_array_equal(found.rows["F"], other.rows["F"])
    assert other.contacts == ("pad", "gear", "bank")
    with np.load(tmp_path / "runs.npz") as file:
        arrays = {name: file[name] for name in file.files}
    np.savez(tmp_path / "wrong.npz", **(arrays | {"owners": arrays["owners"][:3]}))
    with pytest.raises(TraceFileError, match="owners"):
        Sweep.load(tmp_path / "wrong.npz")


def test_a_value_that_breaks_its_rule_is_the_outcome_of_its_run() -> None:
    result = sweep(
        _system(), 0.1, {"numbers.m": [0.0, 1.0], "pad.F_s": [1.5, 0.5]}, engine="ifelse"
    )
    assert result.outcome.tolist() == ["ParameterError", "ParameterError"]
    assert "is not positive" in result.message[0]
    assert "(F_s >= F_c)" in result.message[1]
    assert np.isnan(result.ends["one.x"]).all()


def test_a_single_contact_has_plain_columns() -> None:
    system = System(
        "one",
        bodies=(Body("mass", inertia="m", force="2 * t"),),
        contacts=(Contact("pad", STICTION, {"F_c": 1.0, "F_s": 1.5, "b": 0.0}),),
        numbers={"m": 1.0},
    )
    result = sweep(system, 1.0, {"pad.F_s": [1.0, 1.5]}, engine="ifelse")
    assert result.F.shape == (2,)
    assert result.sequence(0) == [(0, "release_forward")]
    assert result.contact("pad") is result
    with pytest.raises(ParameterError, match="there is no contact 'pat'; did you mean 'pad'"):
        result.contact("pat")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (({"m": [1.0]},), "there is no parameter 'm'; there are numbers.m, pad.F_c"),
        (({"pad.F_s": [[1.5, 1.6]]},), r"parameters\['pad.F_s'\] has shape \(1, 2\)"),
        (({"bank.k": [[1.0, 2.0]]},), r"it must be \(runs,\) or \(runs, 4\)"),
        (([1.0],), r"sweep\(system, t_end, parameters\)"),
        ((9.0, {"numbers.m": [1.0]}), "a system has no rig"),
    ],
)
def test_wrong_parameters_are_refused(arguments: tuple[object, ...], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        sweep(_system(), 9.0, *arguments, engine="ifelse")  # type: ignore[arg-type]
