"""A live page computes the run of `simulate`, with other numbers too, and shows its rows."""

from __future__ import annotations

import base64
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, PulledSlider, State, Transition, simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import ChartModel
from gms_fsm.systems.numbers import numbers_of, with_elements, with_law
from plots.page._rows import PageRows
from plots.page._run import stored_run, views_of
from plots.page.live import play
from tests.helpers import FASTEST, matrix
from tests.plots.browser import SIZES, Open, browser, faults, open_page, said, wait
from tests.plots.live_pages import FOUND, differing, live_scenario
from tests.plots.stored import column

__all__ = ["browser", "open_page"]

pytestmark = pytest.mark.slow

PAGES: dict[str, Path] = {}
COLUMNS = """() => {
    const run = runs[0], text = (get) => {
        const column = Float64Array.from({ length: run.rows }, (_, row) => get(row));
        const bytes = new Uint8Array(column.buffer), letters = [];
        for (let k = 0; k < bytes.length; k += 8192)
            letters.push(String.fromCharCode(...bytes.subarray(k, k + 8192)));
        return btoa(letters.join(""));
    };
    const all = (columns) => Object.fromEntries(
        Object.entries(columns).map(([name, each]) => [name, [each].flat().map(text)]));
    return {
        contacts: run.contacts.map((contact) => ({
            values: all(contact.columns),
            forces: contact.forces.map(text),
            modes: contact.modes.map((mode) => Array.from(mode)),
            log: contact.log.map(({ row, element, edge }) => [row, element, edge]),
        })),
        names: all(run.names),
    };
}"""


@pytest.fixture
def live(open_page: Open, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Open the live page of a scenario; each is written once."""

    def opened(name: str, fragment: str = "", **options: Any) -> Any:
        if name not in PAGES:
            path = tmp_path_factory.mktemp("live") / "page.html"
            PAGES[name] = live_scenario(name).page(path, title=name)
        page = open_page(PAGES[name], **options)
        if fragment:
            page.evaluate(f"location.hash = {fragment!r}")
        wait(page, "typeof runs === 'object' && document.querySelector('#took').textContent !== ''")
        return page

    return opened


def turned(page: Any, numbers: dict[str, float]) -> None:
    """Change numbers, and wait for their run."""
    page.evaluate(
        "(given) => { for (const [name, u] of Object.entries(given)) turn(dials.get(name), u); }",
        numbers,
    )
    wait(page, "!live.busy")


@pytest.mark.parametrize("name", matrix(["pulled_mass", "servo", "ball_screw_table"], ["servo"]))
def test_its_floats_are_those_of_python(live: Any, name: str) -> None:
    scenario, page = live_scenario(name), live(name)
    sets = scenario.sets(4, page.evaluate("Object.keys(variant().engine)"))
    for numbers, found in zip(sets, page.evaluate(FOUND, sets), strict=True):
        bad, count = differing(found, scenario.run(numbers))
        assert bad == 0
        assert count > 1000


@pytest.mark.parametrize(
    "name", matrix(["pulled_mass", "servo", "two_blocks_on_a_belt"], ["servo"])
)
def test_its_columns_are_those_that_a_replay_page_stores(live: Any, name: str) -> None:
    scenario, page = live_scenario(name), live(name)
    (numbers,) = scenario.sets(1, page.evaluate("Object.keys(variant().engine)"), seed=4)
    turned(page, numbers)
    trace, shown = scenario.run(numbers), page.evaluate(COLUMNS)
    rows = np.arange(len(trace))
    page_rows = PageRows(trace, rows, np.zeros_like(rows))
    stored = stored_run(page_rows, [0] * len(views_of(trace)), ())

    def same(text: str, number: Any) -> bool:
        made, wanted = np.frombuffer(base64.b64decode(text)), column(stored, number)
        if wanted.dtype == np.float32:  # forces that nothing but plots read
            return np.array_equal(made.astype(np.float32), wanted, equal_nan=True)
        return np.array_equal(made, wanted, equal_nan=True)

    for name, number in stored["names"].items():
        assert same(shown["names"][name][0], number), name
    for mine, theirs in zip(shown["contacts"], stored["contacts"], strict=True):
        for name, each in theirs["values"].items():
            wanted = each.get("by") or [each["all"]]
            if not name.startswith("#"):
                assert all(map(same, mine["values"][name], wanted)), name
        assert all(map(same, mine["forces"], theirs["forces"]))
    views = views_of(trace)
    for mine, theirs, view in zip(shown["contacts"], stored["contacts"], views, strict=True):
        assert np.array_equal(np.array(mine["modes"]).T, view.modes)
        edges = [theirs["edges"][edge]["name"] for _, _, edge in mine["log"]]
        assert edges == view.transitions.edge.tolist()
        assert [each for _, each, _ in mine["log"]] == view.transitions.element.tolist()
        assert np.array_equal(view.t[[row for row, _, _ in mine["log"]]], view.transitions.t)


def test_sliders_have_the_numbers_units_and_rules(live: Any) -> None:
    page, known = live("pulled_mass"), numbers_of(live_scenario("pulled_mass").what)
    for name, value, unit in page.evaluate(
        "variant().numbers.map((u) => [u.name, u.value, u.unit])"
    ):
        assert (value, unit) == (known[name].value, known[name].parameter.unit)
    page.fill("[data-name=F_s] input[type=text]", "500 mN")
    page.press("[data-name=F_s] input[type=text]", "Enter")
    assert page.inner_text("#refused") == "F_s must be at least F_c, 1"
    page.fill("[data-name=F_s] input[type=text]", "1800 mN")
    page.press("[data-name=F_s] input[type=text]", "Enter")
    assert page.inner_text("#refused") == ""
    assert page.evaluate("dials.get('F_s').value") == 1.8
    page.fill("[data-name=F_c] input[type=text]", "1 m")
    page.press("[data-name=F_c] input[type=text]", "Enter")
    assert "is not a number, or not in N" in page.inner_text("#refused")


def test_sliders_are_moved_by_keys_which_do_not_walk_the_run(live: Any) -> None:
    page = live("pulled_mass")
    page.evaluate("go(10)")
    page.locator("[data-name=F_s] input[type=range]").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("dials.get('F_s').value") > 1.5
    assert page.evaluate("frame") == 10
    page.keyboard.press("End")
    text = page.locator("[data-name=F_s] input[type=range]").get_attribute("aria-valuetext")
    assert text == "4.700 N"
    assert page.evaluate("dials.get('v_c').box.value") == "1e-6"


def test_the_base_run_stays_behind_and_the_first_difference_is_named(live: Any) -> None:
    page = live("servo")
    before = page.evaluate("[runs[1].rows, runs[1].t(runs[1].rows - 1)]")
    turned(page, {"numbers.k_p": 500.0})
    assert said(page).startswith("first difference, transition ")
    assert "base run: " in said(page)
    assert page.evaluate("[runs[1].rows, runs[1].t(runs[1].rows - 1)]") == before
    page.get_by_role("button", name="reset").click()
    wait(page, "!live.busy && !isChanged()")
    assert page.evaluate("runs[0].rows === runs[1].rows && first.frame === null")


def test_an_address_has_the_state_exactly(live: Any) -> None:
    page = live("pulled_mass")
    numbers = {"F_s": 1.1 + 0.7000000000000003, "k2": 123456.78901234567, "speed": 1e-3 / 3}
    turned(page, numbers)
    page.evaluate("go(100)")
    text = page.evaluate("stateText()")
    time = page.evaluate("frames.t[frame]")
    page.get_by_role("button", name="reset").click()
    wait(page, "!live.busy && !isChanged() && !location.hash.includes('F_s')")
    page.evaluate(f"location.hash = {text!r}")
    for _ in range(2):
        wait(page, "isChanged() && !live.busy")
        found = page.evaluate(
            "Object.fromEntries([...dials].map(([name, { value }]) => [name, value]))"
        )
        assert {name: found[name] for name in numbers} == numbers
        assert page.evaluate("frames.t[frame]") == time
        assert "first difference" in page.inner_text("#say")
        page.evaluate(f"location.hash = {text!r}")
        page.reload()
    page.evaluate("location.hash = 'F_s=0.1&nothing=3'")
    wait(page, "document.querySelector('#refused').textContent !== ''")
    refused = page.inner_text("#refused")
    assert refused == "not taken from the address: nothing=3; F_s must be at least F_c, 1"


@pytest.mark.parametrize("name", matrix(["pulled_mass", "ball_screw_table"], ["pulled_mass"]))
def test_the_scenario_of_a_page_is_its_run(live: Any, name: str, tmp_path: Path) -> None:
    scenario, page = live_scenario(name), live(name)
    (numbers,) = scenario.sets(1, page.evaluate("Object.keys(variant().engine)"), seed=2)
    turned(page, numbers)
    text = page.evaluate("scenarioText()")
    tomllib.loads(text)
    (tmp_path / "scenario.toml").write_text(text, encoding="utf-8")
    trace, wanted = load_scenario(tmp_path / "scenario.toml").simulate(), scenario.run(numbers)
    assert np.array_equal(trace.t, wanted.t)
    assert np.array_equal(np.asarray(trace.rows.y), np.asarray(wanted.rows.y))


def test_a_run_that_cannot_begin_is_refused_as_by_python(live: Any) -> None:
    page = live("two_blocks_on_a_belt")
    turned(page, {"numbers.V": 0.13})
    assert page.inner_text("#refused").startswith(
        "pad_1 starts in stuck, which holds v at 0, with v = −30"
    )
    with pytest.raises(ParameterError, match="starts in state 'stuck', which holds v at 0"):
        live_scenario("two_blocks_on_a_belt").start({"numbers.V": 0.13})


def test_of_changes_during_a_run_the_latest_is_computed(live: Any) -> None:
    page = live("pulled_mass")
    turned(page, {"F_s": 1.7})
    wanted = page.evaluate("Array.from(runs[0].found.y)")
    page.evaluate("for (const u of [1.9, 1.8, 1.7]) turn(dials.get('F_s'), u)")
    wait(page, "!live.busy")
    assert page.evaluate("Array.from(runs[0].found.y)") == wanted


def test_while_a_slider_moves_lines_have_the_extremes_of_each_column_of_pixels(live: Any) -> None:
    page = live("pulled_mass")
    drawn = """() => views[0].open.right.plots.map(({ plot }) =>
        plot.data.slice(1).filter((_, k) => plot.series[k + 1].show).map((u) =>
            [u.length, ...[Math.min, Math.max].map((of) => of(...u.filter(Number.isFinite)))]))"""
    # In one task of the page: the sketch ends by itself. Of the base run one line alone is shown.
    sketched, width = page.evaluate(f"""async () => {{
        turn(dials.get('F_s'), 1.1 * dials.get('F_s').value);
        while (first.frame === null || !sketching) await new Promise(requestAnimationFrame);
        chooseElement(2);
        return [({drawn})(), views[0].open.right.width()];
    }}""")
    wait(page, "!sketching")
    whole, frames = page.evaluate(drawn), page.evaluate("frames.t.length")
    assert all(0 < each[0] <= 2 * (width + 1) < frames for lines in sketched for each in lines)
    assert all(each[0] == frames for lines in whole for each in lines)
    assert [[each[1:] for each in lines] for lines in sketched] == [
        [each[1:] for each in lines] for lines in whole
    ]


def test_a_window_may_change_its_size_before_the_first_run(browser: Any, tmp_path: Path) -> None:
    path = live_scenario("chair_squeak").page(tmp_path / "page.html")
    page, wrong = browser.new_page(), list[str]()
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.add_init_script(
        "addEventListener('DOMContentLoaded', () => dispatchEvent(new Event('resize')));"
        "new MutationObserver(() => dispatchEvent(new Event('resize')))"
        ".observe(document, { childList: true, subtree: true });"
    )
    page.goto(path.as_uri())
    wait(page, "(document.querySelector('#took') ?? {}).textContent")
    page.close()
    assert wrong == []


def test_its_policy_has_hashes_only(live: Any) -> None:
    live("servo")
    text = PAGES["servo"].read_text(encoding="utf-8")
    found = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert found is not None
    rules = dict(each.strip().partition(" ")[::2] for each in found[1].split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["worker-src"] == "blob:"
    for name in ("script-src", "style-src"):
        assert all(re.fullmatch(r"'sha256-[\w+/]+='", each) for each in rules[name].split())


def test_the_first_run_is_begun_before_the_rest_of_the_page_is_read(live: Any) -> None:
    live("servo")
    text = PAGES["servo"].read_text(encoding="utf-8")
    assert text.index("const begun = ") < text.index("<header") < text.index('id="data"')


@pytest.mark.every(4)
@pytest.mark.parametrize("size", SIZES)
def test_axe_finds_nothing_and_nothing_is_beside_the_page(live: Any, size: str) -> None:
    page = live("servo", size=size)
    page.evaluate("document.querySelector('#numbers details').open = true")
    turned(page, {"numbers.k_p": 300.0})
    assert faults(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.emulate_media(color_scheme="dark")
    assert faults(page) == []


def test_a_sweep_has_the_extremes_and_switches_of_python(live: Any) -> None:
    scenario, page = live_scenario("servo"), live("servo", tab="Sweep")
    turned(page, {"numbers.k_p": 300.0})
    page.locator(".sweep-of select").first.select_option("numbers.k_i")
    pane = "views[0].open.right"
    wait(page, f"{pane}.named === 'numbers.k_iv' && {pane}.found.length === 50")
    found = page.evaluate(f"{pane}.found")
    for each in found[::20]:
        trace = scenario.run({"numbers.k_p": 300.0, "numbers.k_i": each["value"]})
        view = trace.contact("bearing")
        half = trace.t >= (trace.t[0] + trace.t[-1]) / 2
        assert (each["low"], each["high"]) == (view.v[half].min(), view.v[half].max())
        assert each["fired"] == len(view.transitions)
    page.locator(".pane.sweep .plane").first.click(position={"x": 300, "y": 60})
    wait(page, "dials.get('numbers.k_i').value !== 500")


@pytest.mark.every(3)
@pytest.mark.parametrize(("law", "elements"), [("published", 4), ("signed", 3), ("signed", 5)])
def test_another_law_or_an_element_more_or_less_is_the_run_of_python(
    live: Any, law: str, elements: int
) -> None:
    scenario, page = live_scenario("pulled_mass"), live("pulled_mass")
    turned(page, {"F_s": 1.4})
    page.evaluate(f"take({law!r}, {elements})")
    wait(page, "!live.busy && runs[0].engineNumber === live.number")
    assert page.evaluate("[variant().law, runs[0].contacts[0].n]") == [law, elements]
    other = replace(scenario, what=with_elements(with_law(scenario.what, law), elements))
    (found,) = page.evaluate(FOUND, [{"F_s": 1.4}])
    bad, count = differing(found, other.run({"F_s": 1.4}))
    assert bad == 0
    assert count > 1000
    assert said(page).startswith(("first difference", "both runs"))
    page.evaluate("openPane('right', 'phase'); openPane('left', 'bristles')")
    text = page.evaluate("stateText()")
    page.get_by_role("button", name="reset").click()
    wait(page, "!live.busy && !isChanged() && !location.hash.includes('F_s')")
    page.evaluate(f"location.hash = {text!r}")
    wait(page, "isChanged() && !live.busy")
    assert page.evaluate("[variant().law, runs[0].contacts[0].n]") == [law, elements]


def test_thresholds_masses_and_numbers_of_guards_are_changed_in_the_picture(live: Any) -> None:
    page = live("pulled_mass", tab="Landscape")
    page.evaluate("go(300)")
    at = page.evaluate("""() => {
        const pane = views[0].open.right, { left, top } = pane.plane.svg.getBoundingClientRect();
        for (let x = 80; x < pane.plane.width; x += 10)
            for (let y = 20; y < pane.plane.height - 60; y += 4)
                if (thresholdAt(pane, [x, y])?.name === "F_s") return [x + left, y + top];
    }""")
    page.mouse.move(*at)
    page.mouse.down()
    for k in range(1, 4):
        page.mouse.move(at[0], at[1] - 5 * k)
    wait(page, "dials.get('F_s').value !== 1.5")
    page.mouse.up()
    value = page.evaluate("dials.get('F_s').value")
    page.mouse.move(at[0], at[1] - 40)
    assert page.evaluate("dials.get('F_s').value") == value
    page.evaluate("openPane('left', 'bristles')")
    block = page.locator(".pane.bristles .elements .slider").bounding_box()
    assert block is not None
    page.mouse.move(block["x"] + 5, block["y"] + 20)
    page.mouse.down()
    page.mouse.move(block["x"] + 5 + 300, block["y"] + 20)
    page.mouse.up()
    assert page.evaluate("dials.get('mass').value") == pytest.approx(3.2)  # the slider's end
    box = page.get_by_label("v_c in this guard").first
    box.fill("2 um/s")
    box.press("Enter")
    assert page.evaluate("dials.get('v_c').value") == 2e-6
    wait(page, "!live.busy")
    assert page.evaluate("runs[0].contacts[0].parameters.v_c") == 2e-6


def test_numbers_in_guards_are_changed_as_parameters_are(open_page: Open, tmp_path: Path) -> None:
    def started(tears: float, wait: float) -> tuple[ChartModel, PulledSlider, float]:
        edges = (
            Transition("tears", "holds", "torn", f"abs(z) > {tears}"),
            Transition("closes", "torn", "holds", f"abs(v) < 0.25 and after({wait}) and v**2 > 0"),
        )
        states = State("holds", flow={"z": "v"}), State("torn", flow={"z": "-10 * z"})
        velcro = Chart("velcro", ("v",), ("z",), ("k",), states, edges, {"F": "k * z"})
        return ChartModel(velcro, {"k": 100.0}), PulledSlider(1.0, 2.0, 0.1), 20.0

    page = open_page(play(*started(0.03, 0.2)).save(tmp_path / "page.html"))
    wait(page, "typeof runs === 'object' && document.querySelector('#took').textContent !== ''")
    hidden = page.evaluate("variant().numbers.flatMap((u) => u.first ? [] : [[u.name, u.unit]])")
    assert hidden == [["tears_at", "m"], ["closes_at", "m/s"], ["closes_at_2", "s"]]
    assert page.get_by_label("tears_at in this guard").first.input_value() == "0.03"
    found = page.evaluate(FOUND, [{}, {"tears_at": 0.04, "closes_at_2": 0.1}])
    for each, numbers in zip(found, [(0.03, 0.2), (0.04, 0.1)], strict=True):
        bad, count = differing(each, simulate(*started(*numbers), engine=FASTEST))
        assert bad == 0
        assert count > 1000


@pytest.mark.matrix
def test_a_sweep_of_another_contact_has_its_quantities(live: Any) -> None:
    page = live("ball_screw_table", tab="Sweep")
    page.locator("select.contact").select_option("guide")
    pane = "views[0].open.right"
    wait(page, f"{pane}.found.filter(Boolean).length > 3")
    place = page.evaluate(f"{pane}.view.run.recipes[views[0].contact.values.v.all]")
    assert place[0] in ("y", "seen")
    assert page.evaluate(f"JSON.parse({pane}.asked)[2]") == "guide"


def test_bars_say_how_much_each_number_matters(live: Any) -> None:
    scenario, page = live_scenario("pulled_mass"), live("pulled_mass")
    page.evaluate("go(lastAt(frames.t, 0.55 * frames.t[last])); lookLater()")
    wait(page, "document.querySelector('#matters').textContent !== ''")
    t, names = page.evaluate("[frames.t[frame], [...matters.found.keys()]]")
    found = page.evaluate("[...matters.found.values()].map(({ slope, same }) => [slope, same])")
    known = numbers_of(scenario.what)
    given = {**scenario.arguments, "t_eval": [t], "sensitivities": names}
    trace = simulate(*scenario.loaded.subject[:-1], scenario.t_end, **given)
    wanted = [known[name].value * trace.sensitivity("F", name)[0] for name in names]
    assert all(same for _, same in found)
    most = np.abs(wanted).max()
    np.testing.assert_allclose([slope for slope, _ in found], wanted, atol=0.02 * most)
    largest = names[int(np.argmax(np.abs(wanted)))]
    assert f"most {largest}: " in page.inner_text("#matters")
    assert page.locator(f"[data-name={largest}] .matter").get_attribute("aria-label") is not None
