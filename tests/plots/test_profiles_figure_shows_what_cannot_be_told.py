"""Claim: the figure of open profiles has a panel for each: values, edge, fitted value."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="figures need the extra 'plots'")

from gms_fsm.errors import ParameterError
from gms_fsm.identification._profile import LIMIT
from plots.figures import profiles_figure
from plots.presets import SCREEN
from tests.identification.fits_made import two_records, with_profiles
from tests.plots.printed import drawn_texts, problems


def panels(figure: Any) -> list[Any]:
    return [ax for ax in figure.axes if ax.get_title()]


def drawn(ax: Any, label: str) -> Any:
    (line,) = (each for each in ax.lines if each.get_label() == label)
    return line


def test_axes_have_names_and_units() -> None:
    shown = panels(profiles_figure(with_profiles(5)))
    assert [ax.get_xlabel() for ax in shown] == [
        "v_c0 [m/s]",
        "k1 [$10^{4}$ N/m]",
        "delta2",
        "offset3 [$10^{-2}$ N]",
        "v_s4 [$10^{-4}$ m/s]",
    ]
    assert [ax.get_xscale() for ax in shown] == ["log", "linear", "log", "linear", "log"]
    assert [ax.get_title(loc="left") for ax in shown][2:4] == ["Stribeck exponent", "offset3"]


def test_dots_are_those_of_the_profile() -> None:
    fit = with_profiles(4)
    factors = (1.0, 1e-4, 1.0, 1e2)
    for ax, each, factor in zip(
        panels(profiles_figure(fit)), fit.open_profiles, factors, strict=True
    ):
        line, fitted = drawn(ax, "least rise met"), drawn(ax, "fitted value")
        assert np.allclose(line.get_xdata(), factor * each.values, rtol=1e-12)
        assert np.array_equal(line.get_ydata(), each.rise)
        assert fitted.get_xdata()[0] == pytest.approx(factor * fit[each.name].value)
        assert fitted.get_ydata()[0] == 0.0
        edges = [one for one in ax.lines if len(one.get_xdata()) == 2]
        assert [one.get_ydata()[0] for one in edges] == [LIMIT]
        assert [text.get_text() for text in ax.texts] == ["95 %"]


def test_a_better_fit_and_the_fitted_value_are_inside() -> None:
    """Where the walk met lower costs, and the search from there found nothing."""
    found = with_profiles(1)
    (given,) = found.open_profiles
    lower = replace(given, rise=given.rise - 20.0)
    found = replace(found, assessed=replace(found.assessed, open_profiles=(lower,)))
    (ax,) = panels(profiles_figure(found))
    low, high = ax.get_ylim()
    assert low < lower.rise.min() < -LIMIT
    assert LIMIT < high <= 2.0 * LIMIT
    left, right = ax.get_xlim()
    assert left < drawn(ax, "fitted value").get_xdata()[0] < right


@pytest.mark.parametrize(("count", "columns"), [(1, 1), (3, 3), (9, 3), (14, 4)])
def test_texts_have_room(count: int, columns: int) -> None:
    figure: Any = profiles_figure(with_profiles(count))
    assert problems(figure, SCREEN.smallest) == []
    assert len(panels(figure)) == min(count, 12)
    assert len({round(ax.get_position().x0, 2) for ax in panels(figure)}) == columns
    texts = [text.get_text() for text, _ in drawn_texts(figure)]
    assert any("the first 12 of 14" in text for text in texts) == (count == 14)


def test_one_value_is_enough() -> None:
    fit = with_profiles(1)
    (each,) = fit.open_profiles
    one = replace(each, values=each.values[5:6], rise=each.rise[5:6])
    fit = replace(fit, assessed=replace(fit.assessed, open_profiles=(one,)))
    assert problems(profiles_figure(fit), SCREEN.smallest) == []


def test_without_open_profiles_it_says_so() -> None:
    with pytest.raises(ParameterError, match=r"has no open profile.*fit\.profile\(name\)"):
        profiles_figure(two_records())


def test_something_else_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"it must be a Fit, from gms_fsm\.fit"):
        profiles_figure("fit")  # type: ignore[arg-type]
