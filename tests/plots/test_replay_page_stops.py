"""Breakpoints and `until` stop where they become true; `until` is read as the language is."""

from __future__ import annotations

import pytest

from gms_fsm.errors import ExpressionError
from gms_fsm.inspection.session import Session
from gms_fsm.language import CONSTANTS, FUNCTIONS, SEVERAL, evaluate, parse_condition
from tests.plots.browser import (
    Open,
    browser,
    events,
    fig4,
    frame,
    last,
    open_page,
    pages,
    said,
    wait,
)

__all__ = ["browser", "open_page", "pages"]

pytestmark = pytest.mark.slow


def test_a_breakpoint_by_click_stops_where_its_guard_becomes_true(open_page: Open) -> None:
    page = open_page()
    guard = page.locator("#element2-guard-arrest")
    guard.click()
    assert guard.get_attribute("aria-pressed") == "true"
    page.click("#continue")
    assert "breakpoint: element 2, arrest" in said(page)
    here = frame(page)
    assert page.evaluate(
        "views[0].contact.clauses(2, views[0].contact.scope(1, frame)).map((c) => c.truth)"
    ) == [1, 1]
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    assert "element 2 slip → stick (arrest)" in said(page)
    page.keyboard.press("c")
    assert frame(page) > here + 2
    guard.click()
    assert guard.get_attribute("aria-pressed") == "false"
    page.keyboard.press("c")
    assert "end of the run: no breakpoint" in said(page)


def test_breakpoints_by_keyboard_on_the_guard_and_in_the_table(open_page: Open) -> None:
    page = open_page()
    guard = page.locator("#element1-guard-break_away_forward")
    guard.focus()
    page.keyboard.press("Enter")
    assert guard.get_attribute("aria-pressed") == "true"
    page.keyboard.press("Space")
    assert guard.get_attribute("aria-pressed") == "false"
    assert frame(page) == 0  # the space was the guard's
    button = page.locator("tbody button").first
    button.focus()
    page.keyboard.press("Space")
    assert button.get_attribute("aria-pressed") == "true"
    assert guard.get_attribute("aria-pressed") == "true"
    assert button.evaluate("node => node === document.activeElement")
    page.keyboard.press("c")
    assert frame(page) == events(page)[0] - 1


def test_playing_stops_at_a_breakpoint(open_page: Open) -> None:
    page = open_page()
    page.locator("#element1-guard-break_away_forward").click()
    page.evaluate("show(events[0] - 4)")
    page.click("#play")
    wait(page, "!play.on")
    assert frame(page) == events(page)[0] - 1


# --------------------------------------------------------------------------- until
def test_until_stops_on_the_first_row_where_it_holds(open_page: Open) -> None:
    page = open_page()
    page.fill("#until", "F > 1")
    page.press("#until", "Enter")
    assert page.evaluate("runs[0].names.F(frame) > 1 && runs[0].names.F(frame - 1) <= 1")
    assert "F > 1 became true" in said(page)
    page.fill("#until", "state(2) == slip and not z1 < 0")
    page.click("#continue")
    assert page.evaluate("runs[0].contacts[0].modes[1][frame]") == 1
    page.fill("#until", "t > 1e9")
    page.press("#until", "Enter")
    assert "end of the run: nothing stopped it" in said(page)
    page.fill("#until", "c -")
    assert frame(page) == last(page)
    page.press("#until", "Escape")
    page.keyboard.press("Home")
    assert frame(page) == 0


CANNOT_BE_READ = [
    ("F >", 4, "the text ends too early"),
    ("F == 1", 3, "only < <= > >="),
    ("alert(1) > 0", 1, 'unknown "alert"'),
    ("constructor > 0", 1, 'unknown "constructor"'),
    ("F", 1, "a comparison is needed"),
    ("(F > 1) + 1 > 0", 1, "a number is needed"),
    ("F > 1; x", 6, "cannot read"),
    ("state(9) == slip", 7, "an element, 1 to 4"),
    ("state(1) == melt", 13, "a state: stick, slip"),
    ("F > 1 F", 7, "cannot be read from"),
    ("min(F) > 1", 1, "min got 1 arguments"),
    ("(F > 1", 7, "a closing bracket"),
]


def test_until_reports_a_syntax_error_with_its_column(open_page: Open) -> None:
    page = open_page()
    for text, column, reason in CANNOT_BE_READ:
        page.fill("#until", text)
        page.press("#until", "Enter")
        assert f"column {column}: " in said(page), text
        assert reason in said(page), text
        assert page.locator("#until").get_attribute("aria-invalid") == "true", text
        assert frame(page) == 0, text


def test_until_reads_what_the_expression_language_reads(open_page: Open) -> None:
    """Same texts accepted, same texts rejected, same truths, up to rounding."""
    page, trace = open_page(), fig4("published")
    session = Session(trace.model, trace.rig, 1.0)
    texts = [
        "F > 1",
        "-1 < F < 1",
        "not F > 1 or v < 0 and z1 > 0.2",
        "(F > 1 or v > 0) and x > 0.1",
        "abs(z1) >= s1",
        "2 * F1 + 3 > F2 ** 2 / 4 - 1",
        "-x ** 2 < -0.01",
        "2 ** -1 < x",
        "min(z1, z2, z3) < max(v, 0.1)",
        "sgn(v) <= 0",
        "sqrt(s) > 1.1",
        "sin(pi * t) > .5",
        "state(3) == slip",
        "state(3) != slip and t > 20",
        "((F)) > ((1))",
        "cos(t) * tanh(v) < 0",
        "exp(-t) < 1e-3",
        "t >= 3.5e1 or t < 2.",
        "+F > - -1",
        "not not v > 0",
        "1 / v > 20",
        "F >",
        "",
        "F = 1",
        "F > 1 and",
        "v",
        "not 3",
        "(v > 0) > 1",
        "abs v > 1",
        "abs(1, 2) > 1",
        "z9 > 1",
        "F > 1 &&  v > 0",
        "'a' > 1",
        "F[0] > 1",
        "F.x > 1",
        "state(0) == slip",
        "state(1) > 1",
        "v > 0 if 1 else 0",
        "1 < v == 2",
        "()",
        "min(1, 2) > 1, 2",
        "3x > 1",
        "lambda: 1",
        "a := 1",
        "not(v > 0)",
        "v > (0",
        "v > 0)",
        "__proto__ > 0",
        "toString > 1",
        "v <> 1",
        "1 > 2 > not v > 0",
        "**v > 1",
        "F neg 1 > 0",
        "F not > 1",
        *(f"{name}({'v, z1' if name in SEVERAL else 'v'}) > 0.1" for name in FUNCTIONS),
        *(f"{name} * v > 0.1" for name in CONSTANTS),
    ]
    rows = page.evaluate(
        """() => [...frames.t].map((_, row) => Object.fromEntries([
            ...Object.entries(runs[0].names).map(([name, f]) => [name, f(row)]),
            ...runs[0].contacts[0].modes.map((mode, i) =>
                [`state(${i + 1})`, runs[0].contacts[0].states[mode[row]]]),
        ]))"""
    )
    accepted = 0
    for text in texts:
        got = page.evaluate(
            """(text) => {
                try {
                    const f = condition(text, runs[0]);
                    return [...frames.t].map((_, row) => f(row));
                } catch (error) { return error.message; }
            }""",
            text,
        )
        try:
            tree = parse_condition(text, session.names, ("stick", "slip"), 4)
        except ExpressionError:
            assert isinstance(got, str), text
            assert got.startswith("until, column"), (text, got)
            continue
        accepted += 1
        assert isinstance(got, list), (text, got)
        for values, truth in zip(rows, got, strict=True):
            try:
                expected = bool(evaluate(tree, values))
            except (ArithmeticError, ValueError):  # not computable is not true
                expected = False
            assert truth == expected, (text, values)
    assert accepted > 20


def test_until_rejects_number_formats_that_only_python_has(open_page: Open) -> None:
    page = open_page()
    for text in ("F > 1_000", "F > 0x10"):
        page.fill("#until", text)
        page.press("#until", "Enter")
        assert "column 5: cannot read" in said(page)
