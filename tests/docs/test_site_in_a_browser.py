"""The site works from disk in a browser: replay, sliders, cards, and both themes, for everybody."""

from __future__ import annotations

import importlib.util
import json
import re
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from tests.docs.conftest import Built
from tests.helpers import ROOT, matrix
from tests.plots.browser import Browser, Page, browser, expect, faults

__all__ = ["browser"]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        importlib.util.find_spec("furo") is None or importlib.util.find_spec("nbclient") is None,
        reason="building the site needs the extra 'docs'",
    ),
]

SIZES = {400: 850, 800: 1000, 1366: 768, 1920: 1080}
# In `make test` axe reads each of the pages once; at the other sizes, `make foreign`, all of them.
ONCE = {
    (400, "light"): ("gallery.html", "zoo/lugre.html"),
    (1366, "dark"): ("index.html", "play.html"),
}
SLIDERS = ("peak", "velocity", "elements", "time")
GROUNDS = {"light": (255, 255, 255), "dark": (0x13, 0x14, 0x16)}
# Of a picture when it has been loaded.
WIDTH = "async (image) => { await image.decode(); return image.naturalWidth }"

Visit = Callable[..., Page]


@pytest.fixture
def visit(browser: Browser, built: Built) -> Iterator[Visit]:
    """Open a page of the site; nothing is asked of a network, and no script fails."""
    assert built.code == 0, built.said
    contexts, wrong = [], []

    def opened(name: str, width: int = 1366, scheme: str = "light", **options: object) -> Page:
        viewport = {"width": width, "height": SIZES[width]}
        context = browser.new_context(viewport=viewport, color_scheme=scheme, **options)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: wrong.append(message.text))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda r: r.url.startswith("file://") or wrong.append(r.url))
        page.on("requestfailed", lambda r: wrong.append(f"failed: {r.url}"))
        page.goto((built.site / name).as_uri())
        return page

    yield opened
    for context in contexts:
        context.close()
    assert [each for each in wrong if not each.startswith("data:")] == []


def alive(page: Page) -> None:
    """Wait until the replay is there."""
    page.locator(".replay.alive").wait_for()


# --------------------------------------------------------------------------- the first page
@pytest.mark.parametrize(
    ("width", "scheme"), matrix([(400, "light"), (1366, "dark")], [(1366, "dark")])
)
def test_the_replay_is_alive_walks_by_keys_and_has_the_theme_of_the_site(
    visit: Visit, width: int, scheme: str
) -> None:
    page = visit("index.html", width, scheme)
    alive(page)
    replay = page.frame_locator(".replay iframe")
    before = replay.locator("#now").inner_text()
    assert before.startswith("t = 0")
    replay.locator("#scrubber").focus()
    page.keyboard.press("Shift+ArrowRight")
    expect(replay.locator("#now")).not_to_have_text(before)
    expect(replay.locator("#say")).to_contain_text("break_away_forward")
    assert page.locator(".replay iframe").get_attribute("title") == "Replay of the pulled mass"
    expect(replay.locator("html")).to_have_attribute("data-theme", scheme)
    ground = "(body) => getComputedStyle(body).backgroundColor"
    assert (replay.locator("body").evaluate(ground) == "rgb(255, 255, 255)") == (scheme == "light")
    page.evaluate("document.body.dataset.theme = 'light'")
    expect(replay.locator("html")).to_have_attribute("data-theme", "light")
    assert replay.locator("body").evaluate(ground) == "rgb(255, 255, 255)"


def test_without_javascript_there_are_pictures_and_a_link(visit: Visit) -> None:
    page = visit("index.html", java_script_enabled=False)
    link = page.locator(".replay a")
    assert link.locator("img:visible").count() == 1
    assert link.get_attribute("href") == "_frames/replay.html"
    page = visit("play.html", java_script_enabled=False)
    assert page.locator("figure.frames label:visible").count() == 0
    assert page.locator("#frames-peak .frame img:visible").count() == 2


# --------------------------------------------------------------------------- sliders
def test_sliders_change_picture_value_and_text_by_keys(visit: Visit) -> None:
    page = visit("play.html")
    for name in SLIDERS:
        figure = page.locator(f"#frames-{name}")
        picture, slider = figure.locator(".frame img:visible").first, figure.get_by_role("slider")
        address, text = picture.get_attribute("src"), slider.get_attribute("aria-valuetext")
        value = figure.locator("output").inner_text()
        assert address is not None
        slider.focus()
        page.keyboard.press("ArrowRight")
        expect(picture).not_to_have_attribute("src", address)
        expect(figure.locator("output")).not_to_have_text(value)
        assert slider.get_attribute("aria-valuetext") != text
        assert picture.evaluate(WIDTH) > 100
        page.keyboard.press("ArrowLeft")
        expect(picture).to_have_attribute("src", address)
        expect(figure.locator("output")).to_have_text(value)
    page = visit("play.html", scheme="dark")
    page.locator("#frames-peak").get_by_role("slider").focus()
    page.keyboard.press("End")
    picture = page.locator("#frames-peak .frame img:visible").first
    expect(picture).to_have_attribute("src", re.compile(r"peak_(03|15)a_dark\.webp$"))


def test_every_position_of_a_slider_has_its_pictures_and_its_own_text(built: Built) -> None:
    assert (built.site / "_frames/replay.html").stat().st_size < 600_000
    page = (built.site / "play.html").read_text(encoding="utf-8")
    for name in SLIDERS:
        figure = page.partition(f'id="frames-{name}"')[2]
        known = json.loads(re.search(r'"application/json">(.*?)</script>', figure)[1])  # type: ignore
        values = [value for value, _, _ in known["frames"]]
        assert len(values) >= 3
        assert len(set(values)) >= len(values) - 8
        for k in range(len(known["frames"])):
            for part in known["parts"]:
                for theme in ("", "_dark"):
                    path = built.site / f"{known['first']}{k:02}{part}{theme}{known['ending']}"
                    assert 2000 < path.stat().st_size < 60_000, path.name


# --------------------------------------------------------------------------- gallery and themes
def test_every_entry_has_a_card_whose_picture_loads_and_whose_link_leads_there(
    visit: Visit,
) -> None:
    page = visit("gallery.html")
    entries = re.findall(r"^### (.+)$", (ROOT / "docs/gallery.md").read_text("utf-8"), re.MULTILINE)
    assert [*page.locator("ul.cards b").all_inner_texts()] == entries
    for card in page.locator("ul.cards li").all():
        card.scroll_into_view_if_needed()
        image = card.locator("img:visible")
        assert image.count() == 1
        assert image.evaluate(WIDTH) >= 100
        assert card.locator("code").inner_text()
        target = card.locator("a").get_attribute("href")
        assert page.locator(f"section{target} > :is(h3, span)").count() >= 1


def test_pictures_follow_the_theme(visit: Visit) -> None:
    for scheme in ("light", "dark"):
        page = visit("concepts/chart.html", scheme=scheme)
        for chosen in ("auto", "light", "dark"):
            page.evaluate(f"document.body.dataset.theme = {chosen!r}")
            shown = page.locator('img[alt="The chart of one GMS element"]:visible')
            assert shown.count() == 1
            theme = scheme if chosen == "auto" else chosen
            assert shown.get_attribute("class") == f"only-{theme}"
            assert shown.evaluate(WIDTH) > 100


def test_dark_pictures_lie_on_the_dark_ground_and_keep_their_hues(built: Built) -> None:
    image = pytest.importorskip("PIL.Image")
    for theme, name in (("light", "chart_element.png"), ("dark", "chart_element_dark.webp")):
        with image.open(built.site / "_images" / name) as picture:
            assert picture.convert("RGB").getpixel((2, 2)) == GROUNDS[theme]
    with image.open(built.site / "_images/figure_overview.png") as light:
        before = np.asarray(light.convert("RGB").convert("HSV"), dtype=int)
    with image.open(built.site / "_images/figure_overview_dark.webp") as dark:
        after = np.asarray(dark.convert("RGB").convert("HSV"), dtype=int)
    coloured = (before[..., 1] > 100) & (after[..., 1] > 100)
    turned = ((before - after)[..., 0][coloured] + 128) % 256 - 128
    assert turned.size > 2000
    assert (abs(turned) < 16).mean() > 0.9  # of 256


# --------------------------------------------------------------------------- for everybody
@pytest.mark.parametrize(
    ("width", "scheme"),
    matrix(
        [(width, "light") for width in SIZES] + [(1366, "dark")], [(400, "light"), (1366, "dark")]
    ),
)
def test_axe_finds_nothing_and_nothing_is_wider_than_the_screen(
    visit: Visit, width: int, scheme: str
) -> None:
    for name in ("index.html", "gallery.html", "play.html", "zoo/lugre.html"):
        page = visit(name, width, scheme)
        if name == "index.html":
            alive(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        if name not in ONCE.get((width, scheme), (name,)):
            continue
        # Only this document: axe would fetch style sheets, and the replay page has its own test.
        assert faults(page, options={"preload": False, "iframes": False}) == [], name
