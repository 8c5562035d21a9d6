"""The site works from disk in a browser: replay, live pages, cards, both themes."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from tests.docs.conftest import Built
from tests.helpers import ROOT
from tests.plots.browser import Browser, Page, browser, expect, faults

__all__ = ["browser"]

pytestmark = [
    pytest.mark.matrix,  # building the site takes a minute
    pytest.mark.skipif(
        importlib.util.find_spec("furo") is None or importlib.util.find_spec("nbclient") is None,
        reason="building the site needs the extra 'docs'",
    ),
]

SIZES = {400: 850, 800: 1000, 1366: 768, 1920: 1080}
LIVE = (
    "pulled_mass",
    "paper_fig4_stick_slip",
    "two_blocks_on_a_belt",
    "drill_string",
    "servo",
    "friction_damper",
)
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
        page.on("request", lambda r: r.url.startswith(("file://", "blob:")) or wrong.append(r.url))
        page.on("requestfailed", lambda r: wrong.append(f"failed: {r.url}"))
        page.goto((built.site / name).as_uri())
        return page

    yield opened
    for context in contexts:
        context.close()
    assert [each for each in wrong if not each.startswith("data:")] == []


def alive(page: Page) -> None:
    """Wait until the replay is there."""
    page.locator(".replay.alive").first.wait_for()


# --------------------------------------------------------------------------- the first page
@pytest.mark.parametrize(("width", "scheme"), [(400, "light"), (1366, "dark")])
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
    assert link.get_attribute("href") == "_live/replay.html"
    page = visit("play.html", java_script_enabled=False)
    assert page.get_by_role("link", name="open the page alone").count() == len(LIVE)


# --------------------------------------------------------------------------- live pages
def test_a_live_page_computes_in_its_frame_and_has_the_theme_of_the_site(visit: Visit) -> None:
    page = visit("play.html", scheme="dark")
    alive(page)
    frame = page.frame_locator('iframe[title="Pulled mass"]')
    expect(frame.locator("#took")).to_contain_text("transitions")
    before = frame.locator("#took").inner_text().partition(", in")[0]
    frame.locator("[data-name=F_s] input[type=range]").focus()
    page.keyboard.press("End")
    expect(frame.locator("#took")).not_to_contain_text(before)
    expect(frame.locator("html")).to_have_attribute("data-theme", "dark")


def test_live_pages_are_single_files_of_the_site(built: Built) -> None:
    page = (built.site / "play.html").read_text(encoding="utf-8")
    for name in LIVE:
        assert f'data-page="_live/{name}.html"' in page
        assert (built.site / f"_live/{name}.html").stat().st_size < 1_000_000


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
    ("width", "scheme"), [(width, "light") for width in SIZES] + [(1366, "dark")]
)
def test_axe_finds_nothing_and_nothing_is_wider_than_the_screen(
    visit: Visit, width: int, scheme: str
) -> None:
    for name in ("index.html", "gallery.html", "play.html", "zoo/lugre.html"):
        page = visit(name, width, scheme)
        if name == "index.html":
            alive(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        # Only this document: axe would fetch style sheets, and the replay page has its own test.
        assert faults(page, options={"preload": False, "iframes": False}) == [], name
