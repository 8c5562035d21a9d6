"""Widths and characters of the fonts are those of the fonts; what cannot be shown is said."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pytest

from gms_fsm.charts.chart import Chart, State, Transition
from plots.charts.statechart import statechart
from plots.style.fonts import MONO_EM, missing_glyphs, width


def mono_font() -> object:
    """Return the DejaVu Sans Mono that matplotlib ships."""
    matplotlib = pytest.importorskip(
        "matplotlib", reason="matplotlib is the optional extra 'plots'"
    )
    from matplotlib.ft2font import FT2Font

    return FT2Font(str(Path(matplotlib.get_data_path(), "fonts/ttf/DejaVuSansMono.ttf")))


@pytest.mark.slow
def test_the_characters_are_those_of_the_font() -> None:
    private = range(0xE000, 0xF900)
    shown = {chr(c) for c in mono_font().get_charmap() if c not in private}  # type: ignore[attr-defined]
    # The ends of all ranges, and some between.
    numbers = {ord(each) + step for each in shown for step in (-1, 0, 1)}
    numbers |= {*range(32, sys.maxunicode, 97), sys.maxunicode}
    everything = "".join(map(chr, sorted(numbers)))
    assert set(everything) - set(missing_glyphs(everything)) == shown


def test_every_character_of_the_font_is_as_wide_as_said() -> None:
    font = mono_font()
    font.set_size(1000, 72)  # type: ignore[attr-defined]
    for character in "aW.m|≥∧σ✓":
        found = font.load_char(ord(character)).linearHoriAdvance / 65536  # type: ignore[attr-defined]
        assert found == pytest.approx(1000 * MONO_EM, rel=1e-3)
        assert width(character, 1000) == pytest.approx(1000 * MONO_EM)


def test_titles_have_room_in_helvetica_and_in_its_stand_ins() -> None:
    assert width("slip_forward", 12, mono=False) == pytest.approx(12 * 5.946 * 1.08, rel=0.03)
    assert width("iiii", 12, mono=False) < width("WWWW", 12, mono=False)
    assert width("力", 10) == pytest.approx(20 * MONO_EM)
    assert width("z\u0302", 10) == width("z", 10)  # a mark above takes no room


def chart(state: str = "slip", variable: str = "z") -> Chart:
    return Chart(
        "glyphs",
        inputs=("v",),
        variables=(variable,),
        states=(State("stick", flow={variable: "v"}), State(state)),
        transitions=(Transition("break_away", "stick", state, guard="v > 0"),),
        outputs={"F": variable},
    )


def test_a_missing_character_is_said_once_and_where() -> None:
    with pytest.warns(UserWarning, match=r"no '滑' \(U\+6ED1\) in state '滑'") as caught:
        statechart(chart(state="滑"))
    assert len(caught) == 1
    assert caught[0].filename == __file__
    with pytest.warns(UserWarning, match=r"in state 'stick'"):
        statechart(chart(variable="変"))
    with pytest.warns(UserWarning, match=r"'😀' \(U\+1F600\) in the note"):
        statechart(chart(), note="😀 and 😀")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        statechart(chart(state="слип", variable="Δζ"), notation="math", note="≥ ∧ ✓ ● Σ")
