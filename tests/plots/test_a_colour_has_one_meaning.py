"""A colour has one meaning: all are roles of `plots.style`, in the docs, readable in grey."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import combinations, pairwise
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")

import plots
from plots import style
from plots.style import CHART_THEMES, PAGE_THEMES, ROLES, THEMES, Theme, ramp
from tests.helpers import open_loop, stick_slip
from tests.page_blocks import blocks_of
from tests.plots.vision import contrast, deuteranopia, luminance

PACKAGE = Path(plots.__file__).parent
DOCS = Path(__file__).parents[2] / "docs" / "colours.md"
# Hexadecimal, or a named or numbered colour of matplotlib or CSS where a colour is expected.
HEXADECIMAL = re.compile(r"(?<!&)#(?:[0-9a-fA-F]{6}|[0-9a-fA-F]{3})\b(?![\w-])")
NAMED = re.compile(
    r"""(?:colou?rs?|facecolor|edgecolor|fill|stroke|fillStyle|strokeStyle)["']?\s*[=:]\s*\[?["']"""
    r"(?:tab:\w+|C\d|0?\.\d+|white|black|red|blue|green|gr[ae]y|orange|purple)"
)
IN_A_TERMINAL = re.compile(
    r"[\"' ](?:(?:1;)?[39][0-7]|(?:bold )?(?:green|blue|yellow|magenta|cyan|dark_\w+))[\"']"
)
CSS_NAMED = re.compile(r"(?:color|fill|stroke|background)\s*:\s*(?:white|black|red|blue|gr[ae]y)\b")


def sources() -> Iterable[Path]:
    found = [path for path in PACKAGE.rglob("*") if path.suffix in {".py", ".css", ".js", ".html"}]
    assert len(found) > 50
    return (path for path in found if path != PACKAGE / "style" / "__init__.py")


def test_no_other_module_has_colours() -> None:
    found = [
        f"{path.relative_to(PACKAGE)}: {match[0]}"
        for path in sources()
        for pattern in (HEXADECIMAL, NAMED, CSS_NAMED)
        for match in pattern.finditer(path.read_text(encoding="utf-8"))
    ]
    assert not found
    # The patterns find colours.
    assert HEXADECIMAL.search('color="#0072B2"')
    assert not HEXADECIMAL.search("url(#hatch0)")
    assert NAMED.search('ax.plot(x, color="0.6")')
    assert CSS_NAMED.search("color: white")


def test_faces_in_a_terminal_have_no_colours_of_their_own() -> None:
    rooms = [PACKAGE.parent / "gms_fsm" / name for name in ("app", "debugger")]
    found = [
        f"{path.name}: {match[0]}"
        for room in rooms
        for path in room.rglob("*")
        if path.suffix in (".py", ".tcss")
        and path.name != "l0_first_chart.py"  # a traffic light is green as a state
        for pattern in (HEXADECIMAL, IN_A_TERMINAL)
        for match in pattern.finditer(path.read_text(encoding="utf-8"))
    ]
    assert not found
    assert IN_A_TERMINAL.search('style="bold dark_orange3"')
    assert IN_A_TERMINAL.search('{"fired": "1;33"}')


def test_code_in_the_docs_draws_in_these_colours() -> None:
    drawing = [
        block.body
        for path in DOCS.parent.rglob("*.md")
        for block in blocks_of(path.read_text(encoding="utf-8"))
        if block.kind == "python" and ".plot(" in block.body
    ]
    assert drawing
    assert all("rc_context(RC)" in code for code in drawing)


@pytest.mark.parametrize("theme", THEMES)
def test_the_full_screen_debugger_has_the_colours_of_the_roles(theme: Theme) -> None:
    pytest.importorskip("textual")
    from gms_fsm.debugger.tui._spans import DARK, LIGHT

    seen = {
        role: {_hue(each) for each in HEXADECIMAL.findall(look)} - {None}
        for role, look in {"light": LIGHT, "dark": DARK}[theme].items()
    }
    states = {role for role in seen if role.startswith("state")} | {"active"}
    assert {role for role, hues in seen.items() if hues == {"blue"}} == states
    assert {role for role, hues in seen.items() if hues == {"orange"}} == {"fired", "now"}
    assert {role for role, hues in seen.items() if hues == {"green"}} == {"true"}
    used = {each for look in (LIGHT, DARK) for text in look.values() for each in text.split()}
    known = {each for role in ROLES.values() for each in (*role.light, *role.dark)}
    assert used - {"bold", "on"} <= known


def test_prompt_and_live_view_show_states_in_the_colour_of_the_active_state() -> None:
    """Whichever state comes first: the default one is plain, the others are bold."""
    from rich.console import Console

    from gms_fsm import simulate
    from gms_fsm.app.live import LiveView
    from gms_fsm.debugger._terminal import WORDS
    from gms_fsm.run.simulate import Moment

    assert WORDS["true"] == style.ansi("holds")
    assert WORDS["false"] == style.ansi("fails")
    assert WORDS["fired"] == WORDS["FIRED"] == style.ansi("now", bold=True)
    screen = Console(force_terminal=True, color_system="standard", width=100)
    looks: list[tuple[str, int | None, bool | None]] = []

    def note(moment: Moment) -> None:
        for table in LiveView(screen, 0.0, 1.0, detail=True).tables(moment):
            looks.extend(
                (
                    each.text.strip(),
                    each.style.color and each.style.color.number,
                    bool(each.style.bold),
                )
                for each in screen.render(table)
                if each.style is not None and each.text.strip() in ("stick", "SLIP")
            )

    initial = {"states": ["slip", "stick", "stick", "stick"]}
    simulate(stick_slip("signed"), open_loop(), 0.1, initial=initial, progress=note)
    assert set(looks) == {
        ("stick", style.ANSI["active"], False),
        ("SLIP", style.ANSI["active"], True),
    }


def test_the_docs_list_every_role() -> None:
    rows = [
        f"| {role.name} | {_listed(role.light)} | {_listed(role.dark)} | {role.meaning} |"
        for role in ROLES.values()
    ]
    text = DOCS.read_text(encoding="utf-8").splitlines()
    assert [line for line in text if line.startswith("| ")][1:] == rows


def _listed(colours: Iterable[str]) -> str:
    return " ".join(f"`{each}`" for each in colours)


@pytest.mark.parametrize("theme", THEMES)
def test_no_two_meanings_share_a_hue(theme: Theme) -> None:
    """Greys recur: a hatch, a dash or a sign distinguishes them. Colours do not."""
    families = {
        "blue": {"active", "active fill", "states", "hatches", "slipping"},
        "orange": {"now", "now text", "now fill"},
        "purple": {"elements"},
        "green": {"holds"},
    }
    for name, role in ROLES.items():
        for colour in role.colours(theme):
            hue = _hue(colour)
            if hue is None:
                assert not any(name in family for family in families.values()), name
            else:
                assert name in families[hue], (name, colour)


def _hue(colour: str) -> str | None:
    """Return the family of a colour; None if it is a grey."""
    import colorsys

    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    hue, light, saturation = colorsys.rgb_to_hls(*parts)
    if saturation * (1 - abs(2 * light - 1)) < 0.08 and not (light > 0.85 and saturation > 0.4):
        return None
    degrees = 360 * hue
    ends = {"orange": (5, 50), "green": (140, 175), "blue": (190, 230), "purple": (255, 290)}
    return next(name for name, (low, high) in ends.items() if low <= degrees <= high)


@pytest.mark.parametrize("theme", THEMES)
def test_lines_and_texts_have_contrast(theme: Theme) -> None:
    ground = style.colour("paper", theme)
    for name, role in ROLES.items():
        if role.least <= 1:
            continue
        grounds = [ground]
        if role.kind == "text" and name not in ("now text", "active"):
            grounds += [style.colour(each, theme) for each in ("panel", "chosen")]
        if name in ("ink", "now text"):
            grounds.append(style.colour("now fill", theme))
        if name in ("ink", "active"):
            grounds += ROLES["states"].colours(theme)[: 1 if name == "active" else None]
        least = 3.0 if name == "active" else role.least  # text in blue stands on paper only
        for colour in ramp(name, 12, theme) if len(role.light) > 1 else role.colours(theme):
            assert contrast(colour, ground) >= role.least, name
            assert all(contrast(colour, each) >= least for each in grounds), (name, colour)


@pytest.mark.parametrize("theme", THEMES)
def test_states_differ_in_grey_and_scales_are_monotone_for_every_eye(theme: Theme) -> None:
    page = PAGE_THEMES[theme]
    for one, other in combinations(page.fills, 2):
        assert contrast(one, other) >= 1.15
    # The first two are in nearly every picture.
    assert contrast(page.fills[0], page.fills[1]) >= 1.4
    for fill, hatch in zip(page.fills, page.hatches, strict=True):
        assert contrast(fill, hatch) >= 3.0
    for name in ("elements", "slipping", "heat"):
        steps = ramp(name, 25, theme)
        for seen in (steps, [deuteranopia(each) for each in steps]):
            changes = [b - a for a, b in pairwise(luminance(each) for each in seen)]
            assert all(c > 0 for c in changes) or all(c < 0 for c in changes)
        assert all(contrast(a, b) >= 1.25 for a, b in pairwise(ramp(name, 5, theme)))


def test_families_stay_apart_for_deuteranopes() -> None:
    """What cannot be told by shape alone: now against elements and states, at equal places."""
    now = deuteranopia(style.colour("now"))
    for name in ("active", "elements"):
        for other in ROLES[name].light:
            assert _distance(now, deuteranopia(other)) > 60


def _distance(one: str, other: str) -> float:
    a, b = ([int(each[k : k + 2], 16) for k in (1, 3, 5)] for each in (one, other))
    return float(sum((x - y) ** 2 for x, y in zip(a, b, strict=True)) ** 0.5)


def test_themes_are_the_roles() -> None:
    known = {
        theme: {c for role in ROLES.values() for c in role.colours(theme)}
        | set(ramp("elements", style.ELEMENT_STEPS, theme))
        | set(ramp("slipping", 7, theme))
        for theme in THEMES
    }
    for theme in THEMES:
        used = set(vars(CHART_THEMES[theme]).values())
        for value in vars(PAGE_THEMES[theme]).values():
            used |= {value} if isinstance(value, str) else set(value)
        assert used <= known[theme]
