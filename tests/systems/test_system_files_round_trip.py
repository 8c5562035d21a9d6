"""A system read from the file it was saved to runs as it did, to the last bit."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm import (
    GMS,
    ChartModel,
    GMSParameters,
    LuGre,
    Stribeck,
)
from gms_fsm.charts import LUGRE
from gms_fsm.lowering.program import lower
from gms_fsm.systems.system import Body, Contact, Sampled, Spring, System
from tests.systems_cases import DRY, STICTION

CURVE = Stribeck(1.0, 1.5, 1e-3)
OWN = replace(STICTION, name="own stiction")
CONTACTS: dict[str, dict[str, Any]] = {
    "own chart": {"chart": OWN, "values": {"F_c": 1.0, "F_s": 1.5, "b": 0.1}},
    "included chart": {
        "chart": LUGRE,
        "values": {"sigma_0": [1e3, 2e3], "sigma_1": 31.6},
        "n": 2,
        "inputs": {"s": "1 + 0.1 * r"},
    },
    "GMS": {"chart": GMS(GMSParameters.paper("stick-slip"), law="published")},
    "LuGre": {"chart": LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=CURVE)},
    "chart model": {
        "chart": ChartModel(LUGRE, {"sigma_0": 1e3, "sigma_1": [1.0, 2.0]}, n=2, stribeck=CURVE)
    },
}
SIGNALS = st.sampled_from(
    [
        "0.5 * sin(t)",
        "A * t",
        0.25,
        [(0, 0), (1, 0.1 + 0.2)],
        (np.array([-1.0, 99.0]), np.array([0.0, 1e-7])),
    ]
)


def system_with(contacts: list[str], signal: Any = "0.5 * sin(t)", m: float = 1.5) -> System:
    return System(
        "two masses on a belt",
        bodies=(
            Body("one", inertia=m, force="4 * r + i", x="q1", v="w1"),
            Body("two", inertia="2 * k / k", x="q2", v="w2", motion="turning"),
            Body("belt", velocity="A * r", x="q_b", v="w_b"),
        ),
        springs=(
            Spring("shaft", "one", "two", k="k", ratio=1.5, rest="0.1 * r"),
            Spring("ground", "two", k=0.5, d="0.1 * k"),
        ),
        contacts=[
            Contact(f"contact_{i}", **CONTACTS[name], v=["w1 - w_b", "w2", "w1 - 2 * w2"][i])
            for i, name in enumerate(contacts)
        ],
        signals={"r": signal},
        numbers={"k": 40.0, "A": 0.1},
        flow={"i": "(r - i) / 0.3"},
    )


@pytest.mark.slow
@given(
    contacts=st.lists(st.sampled_from([*CONTACTS]), min_size=1, max_size=3),
    signal=SIGNALS,
    m=st.floats(1e-3, 1e3),
)
@settings(max_examples=15, deadline=None)
def test_any_system_has_the_same_program_and_numbers(
    contacts: list[str], signal: Any, m: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    system = system_with(contacts, signal, m)
    again = System.load(system.save(tmp_path_factory.mktemp("system") / "own.toml"))
    one, other = lower(system), lower(again)
    assert other.source == one.source
    assert other.p == one.p
    assert other.knots == one.knots
    assert again == system
    assert hash(again) == hash(system)


def test_samplers_and_periods_are_kept(tmp_path: Path) -> None:
    sampled = Sampled(
        "pid", period=1e-3, updates={"u": "k * x", "w": "u"}, initial={"w": -0.0}, offset=0.5
    )
    system = System(
        "servo",
        bodies=(Body("load", inertia="m", force="-u"),),
        contacts=(Contact("pad", STICTION, DRY, period=2e-3),),
        numbers={"m": 1.0, "k": 2.0},
        sampled=(sampled,),
    )
    again = System.load(system.save(tmp_path / "own.toml"))
    assert repr(again.sampled) == repr(system.sampled)
    assert again.contact("pad").period == 2e-3


def test_a_chart_may_be_a_file_next_to_it_or_a_name(tmp_path: Path) -> None:
    OWN.save(tmp_path / "stiction.toml")
    (tmp_path / "own.toml").write_text(
        """
        name = "two pads"
        numbers = { K = 2.0 }
        body = { name = "mass", inertia = 1, force = "K * (t - x)" }
        [[contact]]
        name = "pad"
        chart = "stiction.toml"
        values = { F_c = 1, F_s = 1.5, b = 0 }
        [[contact]]
        name = "brush"
        chart = "lugre"
        inputs.s = 1
        values = { sigma_0 = 1e3, sigma_1 = 31.6 }
        [[contact]]
        name = "gms"
        model = { kind = "GMS", law = "signed", preset = "stick-slip" }
        """.replace("body = {", "body = [{").replace('- x)" }', '- x)" }]'),
        encoding="utf-8",
    )
    system = System.load(tmp_path / "own.toml")
    assert system.contact("pad").chart == OWN
    assert system.contact("brush").chart == LUGRE
    assert system.contact("gms").n == 4
    data = tomllib.loads(system.save(tmp_path / "again.toml").read_text(encoding="utf-8"))
    assert data["contact"][1]["chart"] == "lugre"
    assert data["contact"][0]["chart"]["name"] == "own stiction"
    assert data["contact"][2]["model"]["kind"] == "GMS"
