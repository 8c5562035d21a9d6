"""The schematic shows one row: contacts follow the deflections, and are open where they slip."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import LuGre, Prescribed, Stribeck, Trace, simulate

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.artist import Artist
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle
from matplotlib.text import Text

from plots import schematic
from plots.style import BLUE, PAPER
from tests.helpers import pulled_mass


@pytest.fixture(scope="module")
def run() -> Trace:
    return simulate(*pulled_mass(), 60.0)


def parts(drawn: list[Artist], kind: str) -> list[Artist]:
    return [a for a in drawn if (a.get_gid() or "").startswith(kind + " ")]


def texts(drawn: list[Artist]) -> list[str]:
    return [a.get_text() for a in drawn if isinstance(a, Text)]


def test_symbols_without_a_run() -> None:
    drawn = schematic.schematic(Figure().subplots(), elements=3)
    for kind in ("contact", "spring", "damper"):
        assert len(parts(drawn, kind)) == 3
    wanted = {"$k_{1}$", r"$\sigma_{3}$", "$z_{2}$", "$v$", "$F$", "slider", "E3"}
    assert wanted <= set(texts(drawn))


def test_contact_positions_follow_the_deflections(run: Trace) -> None:
    for row in (0, 400, -1):
        drawn = schematic.schematic(Figure().subplots(), run, row)
        centres = [c.get_x() + c.get_width() / 2 for c in parts(drawn, "contact")]  # type: ignore[attr-defined]
        shift = schematic.WALL - schematic.REST - np.array(centres)
        expected = schematic.SWING * run.z[row] / np.abs(run.z).max()
        np.testing.assert_allclose(shift, expected, atol=1e-12)


def test_sticking_contacts_are_filled_and_slipping_ones_open(run: Trace) -> None:
    slipping = (run.states == "slip").sum(axis=1)
    row = int(np.flatnonzero(slipping == 2)[5])
    drawn = schematic.schematic(Figure().subplots(), run, row)
    for i, box in enumerate(parts(drawn, "contact")):
        assert isinstance(box, Rectangle)
        open_one = run.states[row, i] == "slip"
        assert to_hex(box.get_facecolor()).upper() == (PAPER if open_one else BLUE)
        assert box.get_linestyle() == ("--" if open_one else "-")
        assert f"E{i + 1} {run.states[row, i]}" in texts(drawn)
    full = schematic.schematic(Figure().subplots(), run, 0)

    def arrows(artists: list[Artist]) -> int:
        return sum(isinstance(a, FancyArrowPatch) for a in artists)

    assert arrows(full) == 2  # v and F; nothing slips or is deflected in the first row
    assert arrows(drawn) > 4


def test_numbers_have_units(run: Trace) -> None:
    drawn = schematic.schematic(Figure().subplots(), run, 900)
    shown = texts(drawn)
    for symbol, unit in (
        ("$k_{1}$", "N/m"),
        (r"$\sigma_{4}$", "Ns/m"),
        ("$z_{2}$", "m"),
        ("$v$", "m/s"),
        ("$F$", "N"),
    ):
        (text,) = [t for t in shown if t.startswith(symbol + " = ")]
        assert text.endswith(unit)
    (force,) = [t for t in shown if t.startswith("$F$")]
    assert float(force.split()[2]) == pytest.approx(run.F[900], rel=1e-3)


def test_lugre_is_one_bristle_that_neither_sticks_nor_slips() -> None:
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    run = simulate(model, Prescribed("0.01"), 0.1)
    drawn = schematic.schematic(Figure().subplots(), run)
    shown = texts(drawn)
    assert r"$\sigma_0$ = 1000 N/m" in shown
    assert r"$\sigma_1$ = 31.6 Ns/m" in shown
    assert "E1 bristle" in shown
    (box,) = parts(drawn, "contact")
    assert to_hex(box.get_facecolor()).upper() not in (BLUE, PAPER)  # type: ignore[attr-defined]
