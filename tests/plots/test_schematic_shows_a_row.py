"""The schematic shows one row: contacts follow the deflections, and are hatched where they slip."""

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

from plots.style import STATE_FILLS, state_look
from plots.systems import elements
from plots.systems.mechanism import schematic_figure
from tests.helpers import pulled_mass
from tests.plots.printed import problems
from tests.plots.systems_to_draw import GMS12


@pytest.fixture(scope="module")
def run() -> Trace:
    return simulate(*pulled_mass(), 60.0)


def parts(drawn: list[Artist], kind: str) -> list[Artist]:
    return [a for a in drawn if (a.get_gid() or "").startswith(kind + " ")]


def texts(drawn: list[Artist]) -> list[str]:
    return [a.get_text() for a in drawn if isinstance(a, Text)]


def test_contact_positions_follow_the_deflections(run: Trace) -> None:
    drawn = elements.elements_at(Figure().subplots(), elements=3)  # symbols without a run
    assert len(parts(drawn, "contact")) == len(parts(drawn, "spring")) == 3
    assert {"$k_{1}$", r"$\sigma_{1,3}$", "$z_{2}$", "E3"} <= set(texts(drawn))
    for row in (0, 400, -1):
        drawn = elements.elements_at(Figure().subplots(), run, row)
        centres = [c.get_x() + c.get_width() / 2 for c in parts(drawn, "contact")]  # type: ignore[attr-defined]
        shift = elements.WALL - elements.REST - np.array(centres)
        expected = elements.SWING * run.z[row] / np.abs(run.z).max()
        np.testing.assert_allclose(shift, expected, atol=1e-12)


def test_sticking_contacts_are_plain_and_slipping_ones_hatched(run: Trace) -> None:
    slipping = (run.states == "slip").sum(axis=1)
    row = int(np.flatnonzero(slipping == 2)[5])
    drawn = elements.elements_at(Figure().subplots(), run, row)
    for i, box in enumerate(parts(drawn, "contact")):
        assert isinstance(box, Rectangle)
        look = state_look(int(run.states[row, i] == "slip"))
        assert to_hex(box.get_facecolor()).upper() == look["facecolor"]
        assert (box.get_hatch() or "") == look["hatch"]
        assert f"E{i + 1} {run.states[row, i]}" in texts(drawn)
    full = elements.elements_at(Figure().subplots(), run, 0)

    def arrows(artists: list[Artist]) -> int:
        return sum(isinstance(a, FancyArrowPatch) for a in artists)

    assert arrows(full) == 2  # v and F; nothing slips or is deflected in the first row
    assert arrows(drawn) > 4


def test_numbers_have_units_equal_digits_and_a_true_minus(run: Trace) -> None:
    for row in (100, 900):
        drawn = elements.elements_at(Figure().subplots(), run, row)
        shown = texts(drawn)
        units = {
            "$k_{1}$": "N/m",
            r"$\sigma_{1,4}$": "N·s/m",
            "$z_{2}$": "m",
            "$v$": "m/s",
            "$F$": "N",
        }
        for symbol, unit in units.items():
            (text,) = [t for t in shown if t.startswith(symbol + " = ")]
            assert text.endswith(unit)
        number = text.split()[2].replace("\N{MINUS SIGN}", "-")
        assert float(number) == pytest.approx(run.F[row], rel=5e-3)
        numbers = [text.split()[2] for text in shown if text.startswith("$z_")]
        assert len(numbers) == run.n
        assert len({len(number.partition(".")[2]) for number in numbers}) == 1
        assert not [text for text in shown if "-" in text]


@pytest.mark.slow
def test_twelve_elements_fit_on_a_page_without_overlaps() -> None:
    run = simulate(GMS12, Prescribed("0.3*sin(t)"), 4.0)
    figure = schematic_figure(run, len(run) // 2)
    wide, tall = figure.get_size_inches()
    assert wide <= 8.27
    assert tall <= 11.69
    assert len([each for each in figure.axes[0].texts if each.get_text()]) == 12 * 4 + 3
    assert problems(figure, 7.0) == []


def test_lugre_is_one_bristle_that_neither_sticks_nor_slips() -> None:
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    run = simulate(model, Prescribed("0.01"), 0.1)
    drawn = elements.elements_at(Figure().subplots(), run)
    shown = texts(drawn)
    assert r"$\sigma_0$ = 1 kN/m" in shown
    assert r"$\sigma_1$ = 31.6 N·s/m" in shown
    assert "E1 bristle" in shown
    (box,) = parts(drawn, "contact")
    assert to_hex(box.get_facecolor()).upper() not in STATE_FILLS  # type: ignore[attr-defined]
