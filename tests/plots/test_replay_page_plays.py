"""Playing follows the clock of the run, stays at transitions, and stops at the end."""

from __future__ import annotations

import pytest

from tests.plots.browser import Open, browser, frame, last, open_page, pages, said, wait

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


def test_playing_moves_silently_and_space_stops_it(open_page: Open) -> None:
    page = open_page()
    page.keyboard.press("Space")
    wait(page, "frame > 3")
    assert page.locator("#say").get_attribute("aria-live") == "off"
    assert page.locator("#play").get_attribute("aria-pressed") == "true"
    page.keyboard.press("Space")
    here = frame(page)
    page.wait_for_timeout(100)
    assert frame(page) == here
    assert page.locator("#say").get_attribute("aria-live") == "polite"
    page.click("#play")
    wait(page, f"frame > {here}")
    page.click("#play")
    assert page.locator("#play").get_attribute("aria-pressed") == "false"


def test_playing_stops_at_the_end(open_page: Open) -> None:
    page = open_page()
    page.keyboard.press("End")
    page.keyboard.press("ArrowLeft")
    page.click("#play")
    wait(page, "!play.on")
    assert frame(page) == last(page)
    assert "end of the run" in said(page)


# Every frame shown while the clock of the page is moved by hand, in steps of 1/60 s.
PLAYED = """(speed) => {
    document.querySelector("#speed").value = speed;
    Object.assign(play, { on: true, t: frames.t[frame], held: 0, at: 0 });
    const shown = [];
    let now = 0;
    while (play.on && now < 90000) {
        now += 1000 / 60;
        play.held -= 1000 / 60;
        if (play.held <= 0) move(1000 / 60, speed);
        shown.push([now, frame]);
    }
    return shown;
}"""


def test_playing_stays_at_every_micro_step_and_is_uniform_between(open_page: Open) -> None:
    page = open_page("mass")
    shown = page.evaluate(PLAYED, "20")
    times = page.evaluate("[...frames.t]")
    transitions = page.evaluate("[...eventFrames]")
    first = {}
    for now, k in shown:
        first.setdefault(k, now)
    assert set(transitions) <= first.keys()  # none is passed over
    hold = min(400.0, 20_000.0 / page.evaluate("events.length"))
    stays = {k: sum(each == k for _, each in shown) * 1000 / 60 for k in transitions}
    assert min(stays.values()) >= hold - 1000 / 30
    # Away from transitions the clock takes 20 s for the whole run.
    moving = [
        (now, times[k], times[after])
        for (now, k), (_, after) in zip(shown, shown[60:], strict=False)
        if not any(k <= event <= after for event in transitions) and after < page.evaluate("last")
    ]
    assert len(moving) > 100
    for _, begin, end in moving[:: len(moving) // 40]:
        assert end - begin == pytest.approx(3.0, abs=0.4)  # 60 s / 20 s times one second


def test_row_by_row_every_row_is_shown_for_half_a_second(open_page: Open) -> None:
    page = open_page()
    page.evaluate("show(last - 6)")
    shown = page.evaluate(PLAYED, "rows")
    rows = [k for _, k in shown]
    assert sorted(set(rows)) == list(range(last(page) - 5, last(page) + 1))
    assert rows.count(last(page) - 3) == pytest.approx(30, abs=1)


def test_reduced_motion_plays_row_by_row(open_page: Open) -> None:
    assert open_page(reduced_motion="reduce").locator("#speed").input_value() == "rows"
    assert open_page().locator("#speed").input_value() == "20"
