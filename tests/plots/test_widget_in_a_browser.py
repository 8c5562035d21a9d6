"""The widget's controls, in Chromium without Jupyter: slide, poke, compare, name, export."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from gms_fsm import Prescribed
from tests.helpers import FIG4_SINE, stick_slip
from tests.plots.browser import Browser, browser, expect, faults

pytest.importorskip("anywidget", reason="the widget needs the extra 'jupyter'")

import plots
from tests.plots.widget_host import Host

__all__ = ["browser"]

pytestmark = pytest.mark.slow
FORCES = "Array.from({length: runs[0].rows}, (_, k) => runs[0].contacts[0].columns.F(k))"


@pytest.fixture
def host(browser: Browser) -> Iterator[Host]:
    ranges = {"F_s": (0.5, 3.0), "v_c": (1e-9, 1e-3)}
    widget = plots.explore(stick_slip("published"), Prescribed(FIG4_SINE), 50.0, sliders=ranges)
    host = Host(browser, widget)
    yield host
    host.close()
    assert host.wrong == []


def settle(host: Host, runs: int) -> None:
    """Wait until all requests are answered and the page shows so many runs."""
    host.wait(lambda: not host.busy and host.replay("runs.length") == runs)


def test_sliders_and_numbers_change_the_plots_in_place(host: Host) -> None:
    host.replay("setFollowing(), go(events[13]), chooseElement(2), zoomTo(20, 30)")
    host.replay("openPane('right', 'phase')")
    before = host.replay("[frames.t[frame], span.min, span.max, views[0].element]")
    forces, page = host.replay(FORCES), host.page
    page.get_by_label("F_s, N").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("PageUp")
    host.wait(lambda: host.replay(FORCES) != forces)
    settle(host, 1)
    assert host.widget.values["F_s"] == pytest.approx(1.5 + 0.0025 * 101)
    assert page.get_by_label("F_s, exact").input_value() == "1.7525"
    now = host.replay("[frames.t[frame], span.min, span.max, views[0].element]")
    assert now[0] == pytest.approx(before[0], abs=0.5)  # the row before it, if the run has moved
    assert now[1:] == before[1:] == [20, 30, 2]
    assert host.replay("document.querySelector('.phase').hidden") is False
    assert "ms" in page.locator(".gms-took").inner_text()
    count = len(host.requests)
    host.hold(True)  # the answer to the first request waits, and then the latest value wins
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    host.hold(False)
    settle(host, 1)
    sent = [each["values"]["F_s"] for each in host.requests[count:]]
    assert sent == pytest.approx([1.755, 1.8025])
    box = page.get_by_label("v_c, exact")
    box.fill("1e-5")
    box.press("Enter")
    host.wait(lambda: host.widget.values["v_c"] == 1e-5)
    middle = page.get_by_label("v_c, m/s").input_value()
    assert int(middle) == round(1000 * 4 / 6)  # of its logarithm
    box.fill("-1")
    box.press("Enter")
    expect(page.locator(".gms-said")).to_contain_text("v_c")
    assert host.widget.values["v_c"] == 1e-5
    expect(box).to_have_value("0.00001")


def test_branches_are_made_compared_named_exported_and_deleted(host: Host) -> None:
    page = host.page
    host.replay("go(events[14])")  # element 1 is in slip, the others have arrested
    expect(page.get_by_role("button", name="poke at 24.99997 s")).to_be_visible()
    page.get_by_label("New value").fill("-1.4")
    page.get_by_role("button", name="poke at").click()
    settle(host, 2)
    assert host.widget.shown == (0, 1)
    branches = page.locator(".gms-branch")
    expect(branches).to_have_count(2)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        assert faults(page, context=".gms-explore", options={"iframes": False}) == []
    pin = page.locator(".gms-pin")
    expect(pin).to_contain_text("in run 1 element 1 is in slip; arrest does not fire: |z| < s")
    pin.click()
    host.wait(lambda: host.replay("frame === pinned"))
    tokens = host.inner.locator(".run").first.locator(".token")
    differs = [each.evaluate("e => e.classList.contains('differs')") for each in tokens.all()]
    assert differs == [True, False, False, False]
    second = host.inner.locator(".run").nth(1)
    assert second.locator(".region.differs").count() == 1
    expect(host.inner.locator("h3", has_text="F [N]")).to_contain_text("Δ")
    branches.first.click()
    settle(host, 1)
    assert (host.widget.shown, host.widget.current) == ((0,), 0)
    branches.nth(1).focus()
    page.keyboard.press("Shift+Enter")
    settle(host, 2)
    assert (host.widget.shown, host.widget.current) == ((0, 1), 1)
    assert page.evaluate("document.activeElement.dataset.branch") == "1"
    page.get_by_label("Compare the current branch with").select_option("")
    settle(host, 1)
    assert host.widget.shown == (1,)
    page.get_by_role("button", name="delete").click()
    settle(host, 1)
    host.replay("toggleBreak(views[0], 0, 2)")
    found = "[...breakpoints.values()][0].frames.size"
    assert host.replay(found) > 0
    page.get_by_label("Slip law").select_option("signed")
    settle(host, 2)
    made = max(host.widget.branches)
    assert host.widget.branches[made].law == "signed"
    name = page.get_by_label("Name of the current branch")
    name.fill("signed, as in the book")
    name.press("Enter")
    expect(branches.nth(1)).to_contain_text(f"{made} signed, as in the book")
    with page.expect_download() as download:
        page.get_by_role("button", name="export").click()
    text = Path(download.value.path()).read_text(encoding="utf-8")
    assert 'title = "signed, as in the book"' in text
    branches.nth(1).click()
    settle(host, 1)
    assert host.replay(found) > 0  # breakpoints and charts follow the data
    assert host.replay("$('.chart svg').namespaceURI") == "http://www.w3.org/2000/svg"
    assert "C * (sgn(v) - z / s)" in host.inner.locator(".chart svg").first.text_content()
    page.get_by_role("button", name="delete").click()
    settle(host, 1)
    assert list(host.widget.branches) == [0]
    expect(page.get_by_label("Slip law")).to_have_value("published")


@pytest.mark.matrix
def test_the_page_listens_to_its_host_only_and_pictures_cannot_act(host: Host) -> None:
    title = host.replay("document.title")
    host.replay("dispatchEvent(new MessageEvent('message', {data: {go: 30}, source: window}))")
    assert host.replay("frame") == 0
    assert host.replay("document.title") == title
    host.page.evaluate(
        "document.querySelector('iframe').contentWindow.postMessage({ go: 30 }, '*')"
    )
    host.wait(lambda: host.replay("frame") > 0)
    host.page.evaluate(
        """() => {
            const xmlns = "http://www.w3.org/2000/svg", act = "document.title = 'acted'";
            const svg = `<svg xmlns="${xmlns}" viewBox="0 0 9 9"><script>${act}</script></svg>`;
            const load = { data: host_traits.runs, charts: [svg] };
            document.querySelector("iframe").contentWindow.postMessage({ load }, "*");
        }"""
    )
    host.wait(lambda: host.replay("$('.chart svg script') !== null"))
    assert host.replay("document.title") != "acted"
    refused = [text for text in host.wrong if "Content Security Policy" in text]
    host.wrong = [text for text in host.wrong if text not in refused]
