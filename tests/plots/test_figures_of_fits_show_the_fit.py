"""Figures of fits show the fit: curves, scores, what cannot be told; profiles; held outputs.

A notebook shows a fit: its parameters, what cannot be told, its scores, a picture.
"""

from __future__ import annotations

import html
import re
from base64 import b64decode
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="figures need the extra 'plots'")

from gms_fsm.app.paper.held import Lag
from gms_fsm.identification.certainty.assess import Estimate
from gms_fsm.identification.certainty.profile import LIMIT
from plots import figures
from plots.figures import fit_figure, profiles_figure
from plots.output import notebook
from plots.style.presets import SCREEN
from tests.identification.fits_made import (
    small,
    with_profiles,
    with_table,
    without_test,
)
from tests.plots.printed import drawn_texts, problems

pytestmark = pytest.mark.slow


def lettered(figure: Any) -> list[Any]:
    """Return the panels in the order of their letters."""
    return sorted((ax for ax in figure.axes if ax.get_title()), key=lambda ax: ax.get_title())


def drawn(ax: Any, label: str) -> Any:
    (line,) = (each for each in ax.lines if each.get_label() == label)
    return line


def test_curves_are_those_of_the_fit_with_units() -> None:
    (part,) = small().residuals()
    over_time, residual, loop, over_x, bars = lettered(fit_figure(small(), window=(2.0, 4.0)))
    assert [ax.get_xlabel() for ax in (over_time, loop)] == ["$t$ [s]", "$x$ [µm]"]
    assert (over_time.get_ylabel(), over_x.get_ylabel()) == ("$F$ [N]", "measured − model [N]")
    assert bars.get_xlabel() == "interval relative to the value [%]"
    inside = (part.t >= 2.0) & (part.t <= 4.0)
    assert np.array_equal(drawn(over_time, "measured").get_xdata(), part.t[inside])
    assert np.array_equal(drawn(over_time, "measured").get_ydata(), part.measured[inside])
    assert np.array_equal(drawn(over_time, "model").get_ydata(), part.modelled[inside])
    assert np.array_equal(drawn(loop, "model").get_ydata(), part.modelled)
    difference = part.measured - part.modelled
    (line,) = (each for each in residual.lines if len(each.get_xdata()) == part.t.size)
    assert np.array_equal(line.get_ydata(), difference)
    forward, backward = over_x.lines[:2]
    assert set(forward.get_ydata()) <= set(difference[part.v > 0])
    assert set(backward.get_ydata()) <= set(difference[part.v < 0])
    assert len(forward.get_ydata()) + len(backward.get_ydata()) > 0.9 * part.t.size


def test_directions_differ_without_colour_and_held_out_rows_are_shaded() -> None:
    _, residual, _, over_x, _ = lettered(fit_figure(small()))
    means = [each for each in over_x.lines if "ward" in str(each.get_label())]
    assert [each.get_label() for each in means] == ["forward ($v > 0$)", "backward ($v < 0$)"]
    assert means[0].get_linestyle() != means[1].get_linestyle()
    assert means[0].get_linewidth() != means[1].get_linewidth()

    (shade,) = residual.patches
    left, right = shade.get_extents().transformed(residual.transData.inverted()).intervalx
    assert (left, right) == pytest.approx((8.0, 11.98))
    assert not lettered(fit_figure(without_test()))[1].patches

    floor, held = small().floor, small().held_out  # the floor is drawn on both sides
    assert floor is not None
    assert held is not None
    flat = [each.get_ydata() for each in residual.lines if len(each.get_xdata()) == 2]
    assert sorted(y[0] for y in flat) == pytest.approx([-floor, floor])
    name = residual.get_title(loc="left")
    sizes = [f"{each['rmse']:#.3g} N" for each in (small().training, held)]
    assert name == f"residual; RMSE {sizes[0]}, held out {sizes[1]}"


def test_parameters_are_symbols_with_one_unit_for_each_quantity() -> None:
    estimates = [
        Estimate("k1", 20400.0, 20076.0, 20729.0, "N/m"),
        Estimate("k12", 951.0, 940.0, 962.0, "N/m"),
        Estimate("weights2", 2.9443e-5, 2.9e-5, 3.0e-5, "m/N"),
        Estimate("sigma3", 0.3, 0.29, 0.31, "Ns/m"),
        Estimate("offset", 0.0192, 0.0136, 0.0248, "N"),
    ]
    bars = lettered(
        fit_figure(replace(small(), assessed=replace(small().assessed, table=tuple(estimates))))
    )[4]
    assert [label.get_text() for label in bars.get_yticklabels()] == [
        "$k_{1}$",
        r"$k_{\mathrm{12}}$",
        "$w_{2}$",
        r"$\sigma_{\mathrm{1,3}}$",
        "offset",
    ]
    (values,) = bars.child_axes
    units = [label.get_text().split()[1] for label in values.get_yticklabels()]
    assert units == ["kN/m", "kN/m", "µm/N", "mN·s/m", "N"]


def test_times_that_are_not_compared_are_not_shown() -> None:
    (part,) = small().residuals()
    compared = part.t[part.rows | part.held]
    for ax in lettered(fit_figure(small()))[:2]:
        assert ax.get_xlim() == pytest.approx((compared[0], compared[-1]))


def test_what_cannot_be_told_has_words_and_no_bar() -> None:
    bars = lettered(fit_figure(with_table(5)))[4]
    assert [text.get_text() for text in bars.texts] == [
        "cannot be told: no influence on this record"
    ]
    dots = [each for each in bars.lines if each.get_marker() == "o"]
    assert [each.get_ydata()[0] for each in dots] == [0, 1, 3, 4]
    ends = {each.get_marker() for each in bars.lines if each.get_ydata()[0] == 1}
    assert ">" in ends  # five times its value is beyond the axis
    figure = fit_figure(with_table(41))
    assert problems(figure, SCREEN.smallest) == []
    assert not [t for t, _ in drawn_texts(figure) if t.get_text().startswith("parameter_")]


# --------------------------------------------------------------------------- profiles
def panels(figure: Any) -> list[Any]:
    return [ax for ax in figure.axes if ax.get_title()]


def test_dots_are_those_of_the_profile_in_units_that_fit() -> None:
    fit = with_profiles(5)
    shown = panels(profiles_figure(fit))
    assert [ax.get_xlabel() for ax in shown] == [
        "v_c0 [m/s]",
        "k1 [$10^{4}$ N/m]",
        "delta2",
        "offset3 [$10^{-2}$ N]",
        "v_s4 [$10^{-4}$ m/s]",
    ]
    assert [ax.get_xscale() for ax in shown] == ["log", "linear", "log", "linear", "log"]
    factors = (1.0, 1e-4, 1.0, 1e2, 1e4)
    for ax, each, factor in zip(shown, fit.open_profiles, factors, strict=True):
        line, fitted = drawn(ax, "least rise met"), drawn(ax, "fitted value")
        assert np.allclose(line.get_xdata(), factor * each.values, rtol=1e-12)
        assert np.array_equal(line.get_ydata(), each.rise)
        assert fitted.get_xdata()[0] == pytest.approx(factor * fit[each.name].value)
        assert fitted.get_ydata()[0] == 0.0
        edges = [one for one in ax.lines if len(one.get_xdata()) == 2]
        assert [one.get_ydata()[0] for one in edges] == [LIMIT]


def test_a_better_fit_the_fitted_value_and_a_single_value_are_inside() -> None:
    """Where the walk met lower costs, and the search from there found nothing."""
    found = with_profiles(1)
    (given,) = found.open_profiles

    def figure_of(profile: Any) -> Any:
        return profiles_figure(
            replace(found, assessed=replace(found.assessed, open_profiles=(profile,)))
        )

    lower = replace(given, rise=given.rise - 20.0)
    (ax,) = panels(figure_of(lower))
    low, high = ax.get_ylim()
    assert low < lower.rise.min() < -LIMIT
    assert LIMIT < high <= 2.0 * LIMIT
    left, right = ax.get_xlim()
    assert left < drawn(ax, "fitted value").get_xdata()[0] < right
    one = replace(given, values=given.values[5:6], rise=given.rise[5:6])
    assert problems(figure_of(one), SCREEN.smallest) == []


@pytest.mark.every(2)
@pytest.mark.parametrize(("count", "columns"), [(3, 3), (14, 4)])
def test_profiles_have_room(count: int, columns: int) -> None:
    figure: Any = profiles_figure(with_profiles(count))
    assert problems(figure, SCREEN.smallest) == []
    assert len(panels(figure)) == min(count, 12)
    assert len({round(ax.get_position().x0, 2) for ax in panels(figure)}) == columns
    texts = [text.get_text() for text, _ in drawn_texts(figure)]
    assert any("the first 12 of 14" in text for text in texts) == (count == 14)


# --------------------------------------------------------------------------- notebooks
def test_a_notebook_shows_the_table_the_scores_and_the_picture(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("llvmlite", reason="fits take long without machine code")
    shown = small()._repr_html_()  # type: ignore[attr-defined]
    for each in small().table:
        cells = (each.name, *each.shown, each.unit)
        assert "".join(f'<td style="text-align:left">{cell}</td>' for cell in cells) in shown
    assert f"training RMSE {small().training['rmse']:.4g} N" in shown
    assert html.escape(small().weakest[:40]) in shown
    (picture,) = re.findall(r'src="data:image/png;base64,([^"]+)"', shown)
    assert b64decode(picture).startswith(b"\x89PNG")
    monkeypatch.setattr(notebook, "fit_png", lambda _: None)  # as without matplotlib
    shown = with_table(5)._repr_html_()  # type: ignore[attr-defined]
    row = shown.partition("parameter_2")[2].partition("</tr>")[0]
    assert "cannot be told" in row
    assert ">inf<" not in row
    assert "<img" not in shown


# --------------------------------------------------------------------------- held outputs
def lag(period: float) -> Lag:
    t = np.arange(round(6.0 / period)) * period
    size = np.where(t < 2.0, 0.1, -0.5) * period  # N
    return Lag(period, t, size, -size, 1e-2 * size)


def test_each_panel_of_held_outputs_shows_its_numbers() -> None:
    lags = [lag(h) for h in (2e-3, 1e-3, 5e-4)]
    sheet = figures.held_residuals(
        lags, (1e-4, 1e-6), title="held", phases={"ramp": (0.0, 2.0), "rest": (2.0, 6.0)}
    )
    force, place, between, period = sheet.axes
    for each, line in zip(lags, force.lines, strict=False):
        np.testing.assert_allclose(line.get_ydata(), 1e3 * each.force)
    for each, line in zip(lags, place.lines, strict=False):
        np.testing.assert_allclose(line.get_ydata(), 1e6 * each.place)
    np.testing.assert_allclose(between.lines[0].get_ydata()[:4], [0.2, -0.2, 0.2, -0.2])
    marks = {line.get_label(): np.asarray(line.get_ydata()) for line in period.lines}
    np.testing.assert_allclose(marks["$F$, ramp"], [2.0, 1.0, 0.5])
    np.testing.assert_allclose(marks["$x$, rest"], [10.0, 5.0, 2.5])
    assert all("[" in text for ax in sheet.axes for text in (ax.get_xlabel(), ax.get_ylabel()))
    shown = [text.get_text() for text in sheet.legends[0].get_texts()]
    assert shown == ["$h$ = 2 ms", "$h$ = 1 ms", "$h$ = 0.5 ms", "the paper's residual"]


def test_one_record_is_chosen() -> None:
    one, usual = fit_figure(small(), which=0), fit_figure(small())
    assert [ax.get_title() for ax in one.axes] == [ax.get_title() for ax in usual.axes]
