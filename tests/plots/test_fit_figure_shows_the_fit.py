"""Claim: the figure of a fit shows its arrays, its held-out rows, and what cannot be told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="figures need the extra 'plots'")

from gms_fsm.errors import ParameterError
from plots.figures import fit_figure
from plots.presets import SCREEN
from tests.identification.fits_made import small, two_records, with_table, without_test
from tests.plots.printed import drawn_texts, problems


def lettered(figure: Any) -> list[Any]:
    """Return the panels in the order of their letters."""
    return sorted((ax for ax in figure.axes if ax.get_title()), key=lambda ax: ax.get_title())


def drawn(ax: Any, label: str) -> Any:
    (line,) = (each for each in ax.lines if each.get_label() == label)
    return line


def test_axes_have_names_and_units() -> None:
    over_time, residual, loop, over_x, bars = lettered(fit_figure(small()))
    assert [ax.get_xlabel() for ax in (over_time, residual)] == ["t [s]", "t [s]"]
    assert [ax.get_xlabel() for ax in (loop, over_x)] == ["x [mm]", "x [mm]"]
    assert [ax.get_ylabel() for ax in (over_time, loop)] == ["F [N]", "F [N]"]
    assert residual.get_ylabel() == over_x.get_ylabel() == "measured − model [N]"
    assert bars.get_xlabel() == "interval relative to the value [%]"


def test_curves_are_those_of_the_fit() -> None:
    (part,) = small().residuals()
    over_time, residual, loop, over_x, _ = lettered(fit_figure(small(), window=(2.0, 4.0)))
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


def test_directions_differ_without_colour() -> None:
    over_x = lettered(fit_figure(small()))[3]
    means = [each for each in over_x.lines if "ward" in str(each.get_label())]
    assert [each.get_label() for each in means] == ["forward (v > 0)", "backward (v < 0)"]
    assert means[0].get_linestyle() != means[1].get_linestyle()
    assert means[0].get_linewidth() != means[1].get_linewidth()


def test_held_out_rows_are_shaded() -> None:
    residual = lettered(fit_figure(small()))[1]
    (shade,) = residual.patches
    left, right = shade.get_extents().transformed(residual.transData.inverted()).intervalx
    assert (left, right) == pytest.approx((8.0, 11.98))
    assert not lettered(fit_figure(without_test()))[1].patches


def test_the_floor_is_drawn_on_both_sides() -> None:
    residual = lettered(fit_figure(small()))[1]
    floor = small().floor
    assert floor is not None
    flat = [each.get_ydata() for each in residual.lines if len(each.get_xdata()) == 2]
    assert sorted(y[0] for y in flat) == pytest.approx([-floor, floor])


def test_what_cannot_be_told_has_words_and_no_bar() -> None:
    bars = lettered(fit_figure(with_table(5)))[4]
    assert [text.get_text() for text in bars.texts] == [
        "cannot be told: no influence on this record"
    ]
    dots = [each for each in bars.lines if each.get_marker() == "o"]
    assert [each.get_ydata()[0] for each in dots] == [0, 1, 3, 4]
    ends = {each.get_marker() for each in bars.lines if each.get_ydata()[0] == 1}
    assert ">" in ends  # five times its value is beyond the axis


def test_the_scores_are_those_of_the_fit() -> None:
    name = lettered(fit_figure(small()))[1].get_title(loc="left")
    held = small().held_out
    assert held is not None
    assert name == f"residual; RMSE {small().training['rmse']:.3g}, held out {held['rmse']:.3g} N"


def test_the_worst_record_is_shown() -> None:
    sizes = [np.std(each.measured - each.modelled) for each in two_records().residuals()]
    name = two_records().records[int(np.argmax(sizes))].name
    title = fit_figure(two_records())._suptitle.get_text()  # type: ignore[attr-defined]
    assert title.endswith(f"fitted to {name} (worst of 2 records)")
    title = fit_figure(two_records(), 1)._suptitle.get_text()  # type: ignore[attr-defined]
    assert title.endswith("fitted to short (of 2 records)")


@pytest.mark.parametrize("count", [5, 41])
def test_texts_have_room_with_many_parameters(count: int) -> None:
    figure = fit_figure(with_table(count))
    assert problems(figure, SCREEN.smallest) == []
    shown = sum(text.get_text().startswith("parameter_") for text, _ in drawn_texts(figure))
    assert shown == (count if count <= 40 else 0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"which": 1}, "which is 1; it must be an integer from 0 to 0"),
        ({"which": True}, "which is True; it must be an integer"),
        ({"window": (3.0, 2.0)}, r"window is \(3.0, 2.0\); it must be two increasing times"),
        ({"window": (20.0, 30.0)}, "that overlap the record, 0 to 11.98 s"),
        ({"window": 2.0}, "it must be two increasing times"),
    ],
)
def test_wrong_arguments(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        fit_figure(small(), **given)


def test_something_else_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"it must be a Fit, from gms_fsm\.fit"):
        fit_figure("fit")  # type: ignore[arg-type]
