"""Widths and characters are those of the shipped fonts; what cannot be shown is said."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from gms_fsm.charts.chart import Chart, State, Transition
from plots.charts.statechart import statechart
from plots.style.fonts import FOLDER, missing_glyphs, width

FONTS = sorted(path.name for path in FOLDER.glob("*.ttf"))


@pytest.mark.parametrize("name", FONTS)
def test_the_shipped_fonts_are_those_of_matplotlib(name: str) -> None:
    matplotlib = pytest.importorskip(
        "matplotlib", reason="matplotlib is the optional extra 'plots'"
    )
    own = Path(matplotlib.get_data_path(), "fonts/ttf", name)
    assert own.read_bytes() == (FOLDER / name).read_bytes()


@pytest.mark.parametrize("name", FONTS)
def test_every_character_is_as_wide_as_in_the_font(name: str) -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is the optional extra 'plots'")
    from matplotlib.ft2font import FT2Font

    font = FT2Font(str(FOLDER / name))
    font.set_size(1000, 72)
    look = {"mono": "Mono" in name, "bold": "Bold" in name}
    for character in "aW.m|i≥∧σ✓Ж":
        found = font.load_char(ord(character)).linearHoriAdvance / 65536
        assert width(character, 1000, **look) == pytest.approx(found, abs=0.5)
    if name == "DejaVuSansMono.ttf":  # the font of formulas, in which others are looked for
        everything = "".join(map(chr, range(32, 0x3000)))
        shown = {chr(c) for c in font.get_charmap()} & {*everything}
        assert {*everything} - {*missing_glyphs(everything)} == shown


def test_marks_take_no_room_and_characters_of_other_fonts_two_places() -> None:
    assert width("力", 10) == pytest.approx(2 * width("x", 10))
    assert width("z\u0302", 10) == width("z", 10)


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
