"""One `Settings` object means the same to simulate, sessions and sweeps."""

from __future__ import annotations

import dataclasses
from typing import Any, get_type_hints

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    GMSParameters,
    Prescribed,
    Session,
    Settings,
    simulate,
    sweep,
)
from gms_fsm.run.settings import SettingOptions

MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")
RIG = Prescribed("0.2*sin(2*pi*t/20)")
FIXED = Settings(method="rk4", step=0.01, rtol=1e-4, max_steps=5000, engine="ifelse")


def test_the_arguments_are_the_fields() -> None:
    fields = {each.name: each for each in dataclasses.fields(Settings)}
    assert set(get_type_hints(SettingOptions)) == set(fields)


def test_simulate_a_session_and_a_sweep_run_alike() -> None:
    trace = simulate(MODEL, RIG, 12.0, settings=FIXED)
    assert trace.settings["method"] == "rk4"
    session = Session(MODEL, RIG, 12.0, settings=FIXED)
    session.branch.complete()
    swept = sweep(MODEL, RIG, 12.0, {"F_s": [1.5]}, settings=FIXED)
    np.testing.assert_array_equal(session.branch.trace().z, trace.z)
    np.testing.assert_array_equal(swept.z[0], trace.z[-1])
    assert len(trace.transitions) == swept.transition_count[0] > 0


@pytest.mark.parametrize("options", [{"step": 0.02}, {"method": "heun"}, {"engine": "machines"}])
def test_an_option_overrides_the_settings(options: dict[str, Any]) -> None:
    one = simulate(MODEL, RIG, 6.0, settings=FIXED, **options)
    other = simulate(MODEL, RIG, 6.0, settings=dataclasses.replace(FIXED, **options))
    np.testing.assert_array_equal(one.z, other.z)
    assert one.settings == other.settings
    assert one.settings[next(iter(options))] == next(iter(options.values()))


def test_wanted_times_may_follow_settings_that_keep_all() -> None:
    trace = simulate(MODEL, RIG, 6.0, settings=FIXED, t_eval=[1.0, 2.5])
    assert trace.t.tolist() == [1.0, 2.5]


def test_a_saved_session_has_its_settings(tmp_path: Any) -> None:
    session = Session(MODEL, RIG, 6.0, settings=FIXED, t_start=0.5)
    again = Session.load(session.save(tmp_path / "session.json"))
    assert (again.settings, again.t_start) == (FIXED, 0.5)
