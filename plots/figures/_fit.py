"""Figure of a fit: measurement and model, residuals, parameters with their intervals."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.foundation.quantities import Scale, scale_of
from gms_fsm.language import latex_name
from plots.figures._layout import fitted, legend_above, low, narrow, sheet
from plots.figures._parts import last_cycles, letter_panels
from plots.panels.parts.axes import VECTOR_ROWS, draw_curve, time_axis
from plots.panels.parts.selection import dotted, is_number, is_whole, scaled
from plots.style import INK, LINE_GREY, PALE_GREY, REPORTED, TEXT_GREY, colour
from plots.style.matplotlib import Axes, Figure, rc_context
from plots.style.presets import font, pt, settings, to_scale
from plots.views.window import Window

if TYPE_CHECKING:
    from gms_fsm.identification.problem.runs import ComparedColumn
from gms_fsm.identification.result import Estimate, Fit, Residuals

Floats = NDArray[np.float64]

MOST_PARAMETERS = 40  # more rows are a table, not a picture
LANE = 0.22  # inches: the row of a parameter
WIDEST = 100.0  # %: a longer interval ends in arrows
BINS, FEWEST = 40, 5  # of a mean residual over x, and rows in a bin
DOT = 1.6  # points, of a residual among thousands
NEAR = 0.01  # of the largest measured value: a smaller residual has a unit of its own
SYMBOLS = {"weights": "w", "shares": "alpha", "sigma": "sigma_1"}  # of elements
MOVING = 0.05  # of the largest speed; slower rows have no direction
DIRECTIONS: tuple[tuple[int, str, dict[str, Any]], ...] = (
    (1, "forward ($v > 0$)", {"color": INK, "linestyle": "-", "linewidth": 1.6}),
    (
        -1,
        "backward ($v < 0$)",
        {"color": LINE_GREY, "linestyle": (0, (4.0, 1.5)), "linewidth": 2.2},
    ),
)


def _largest(values: Floats) -> float:
    return float(np.nanmax(np.abs(values), initial=0.0))


@dataclass(frozen=True)
class _Compared:
    """One record of a fit: what was measured, what the model gives, in units for the figure."""

    name: str
    scale: Scale  # of the measurement
    small: str  # unit of the residual
    place: str  # unit of x
    t: Floats
    x: Floats
    v: Floats
    measured: Floats
    modelled: Floats
    residual: Floats
    factor: float  # from SI to `small`

    @classmethod
    def of(cls, residuals: Residuals, quantity: str, column: ComparedColumn) -> _Compared:
        """Return a record with rows that are not compared left blank."""
        kept = residuals.rows | residuals.held
        measured = np.where(kept, residuals.measured, np.nan)
        difference = measured - residuals.modelled
        scale = scale_of(_largest(measured), column.unit)
        small, short = scaled(difference, column.unit)
        if _largest(difference) > NEAR * _largest(measured):
            small, short = scale.factor, scale.unit
        far, place = scaled(residuals.x - residuals.x[0], column.length)
        return cls(
            quantity,
            scale,
            short,
            place,
            residuals.t,
            far * (residuals.x - residuals.x[0]),
            residuals.v,
            scale.factor * measured,
            scale.factor * np.where(kept, residuals.modelled, np.nan),
            small * difference,
            small,
        )

    @property
    def ends(self) -> Window:
        """The first and the last time that is compared, s."""
        compared = self.t[np.isfinite(self.measured)]
        return float(compared[0]), float(compared[-1])


def fit_figure(
    fit: Fit, which: int | None = None, *, window: Window | None = None, title: str = ""
) -> Figure:
    """Draw a fit: measurement and model over t and x, residual over t and x, parameters.

    Parameters
    ----------
    fit : Fit
        From `gms_fsm.fit` or `gms_fsm.choose`.
    which : int, optional
        The record, counted from 0; by default the one with the largest residual (RMSE).
    window : (float, float), optional
        Time interval of the first panel, s; by default the last three cycles of a long record.
    title : str
        Of the figure; by default the model and the record.

    Returns
    -------
    Figure
        x is relative to its start. Rows that were held out are shaded. Intervals are relative to
        the value of the parameter; one that is longer than 100 % ends in arrows. On a slide, or
        with more than 40 parameters, parameters are left out.

    Raises
    ------
    ParameterError
        If there is no such record, or the window does not overlap it.
    """
    from gms_fsm.identification.result import Fit as Kind

    checked_kind("fit", fit, Kind, "a Fit, from gms_fsm.fit")
    every = fit.residuals()
    number = _worst(every) if which is None else _checked_which(which, len(every))
    chosen = every[number]
    part = _Compared.of(chosen, fit.measured, fit.task.measured)
    shown = _checked_window(chosen, part.ends, window)
    listed = fit.table if not low() and len(fit.table) <= MOST_PARAMETERS else ()
    with rc_context(settings()):
        figure, (over_time, residual, loop, over_x), bars = _sheet(len(listed))
        _over_time(over_time, part, shown, fit.test)
        _residual_over_time(residual, part, fit)
        _loop(loop, part)
        _residual_over_x(over_x, part)
        begin, end = shown
        whole = begin <= part.ends[0] and end >= part.ends[1]
        names = [
            "measurement and model" + ("" if whole else f", {begin:.4g} to {end:.4g} s"),
            _score_name(chosen, part),
            "loop",
            "residual",
        ]
        axes = [over_time, residual, loop, over_x]
        if bars is not None:
            _parameters(bars, listed, (fit.task.measured.unit, part.scale))
            axes.append(bars)
            names.append("parameters with 95 % intervals")
        letter_panels(axes, names)
        figure.suptitle(title or _title(fit, chosen, len(every), which), x=0.01, ha="left")
    return fitted(figure)


# --------------------------------------------------------------------------- what is shown
def _worst(every: Sequence[Residuals]) -> int:
    """Return the record with the largest root mean square of the residual."""
    return int(np.nanargmax([_size(each, each.rows | each.held) for each in every]))


def _checked_which(which: Any, count: int) -> int:
    if not is_whole(which) or not 0 <= which < count:
        raise ParameterError(
            f"it must be an integer from 0 to {count - 1}, one of the records of the fit",
            place="which",
            value=which,
        )
    return int(which)


def _checked_window(shown: Residuals, compared: Window, window: Any) -> Window:
    if window is None:
        begin, end = last_cycles(shown)
        return max(begin, compared[0]), min(end, compared[1])
    first, last = float(shown.t[0]), float(shown.t[-1])
    pair = isinstance(window, (tuple, list)) and len(window) == 2 and all(map(is_number, window))
    if not pair or not (window[0] < window[1] and window[0] < last and window[1] > first):
        raise ParameterError(
            f"it must be two increasing times that overlap the record, {first:g} to {last:g} s",
            place="window",
            value=window,
        )
    return max(first, float(window[0])), min(last, float(window[1]))


def _title(fit: Fit, chosen: Residuals, count: int, which: int | None) -> str:
    others = "" if count == 1 else f" ({'worst ' if which is None else ''}of {count} records)"
    return f"{fit.title}, fitted to {chosen.record.name}{others}"


def _score_name(chosen: Residuals, part: _Compared) -> str:
    """Name the panel of the residual, with its size in the rows of this record."""
    parts = [("RMSE", chosen.rows), ("held out", chosen.held)]
    sizes = [
        f"{name} {part.factor * _size(chosen, rows):#.3g} {part.small}"
        for name, rows in parts
        if rows.any()
    ]
    return f"residual; {', '.join(sizes)}"


def _size(each: Residuals, rows: NDArray[np.bool_]) -> float:
    """Return the root mean square of the residual at some rows."""
    return float(np.sqrt(np.mean((each.measured - each.modelled)[rows] ** 2)))


# --------------------------------------------------------------------------- panels
def _sheet(parameters: int) -> tuple[Figure, Sequence[Axes], Axes | None]:
    """Return an empty figure; its panels over time and x; and that of the parameters, if any."""
    above = 8.9 if narrow() else 4.9
    below = 0.75 + LANE * parameters if parameters else 0.0
    figure = sheet(4.2 if narrow() else 11.0, above + below, grows=True)
    tall = [
        *((1.7, 1.5, 2.0, 1.7) if narrow() else (1.7, 1.7)),
        *([LANE * parameters] * bool(below)),
    ]
    wide = (1.0,) if narrow() else (1.5, 1.0)
    grid = figure.add_gridspec(len(tall), len(wide), height_ratios=tall, width_ratios=wide)
    places = [(row, column) for column in range(len(wide)) for row in range(4 // len(wide))]
    axes = [figure.add_subplot(grid[place]) for place in places]
    return figure, axes, figure.add_subplot(grid[-1, :]) if below else None


def _over_time(ax: Axes, part: _Compared, shown: Window, test: Window | None) -> None:
    inside = (part.t >= shown[0]) & (part.t <= shown[1])
    _shaded(ax, part, test, shown)
    t = part.t[inside]
    measured: dict[str, Any] = {"color": LINE_GREY, "linewidth": pt(2.4), "label": "measured"}
    draw_curve(ax, t, part.measured[inside], **measured)
    draw_curve(ax, t, part.modelled[inside], color=INK, label="model")
    ax.set_ylabel(f"${latex_name(part.name)}$ [{part.scale.unit}]")
    time_axis(ax, *shown)
    legend_above(ax)


def _residual_over_time(ax: Axes, part: _Compared, fit: Fit) -> None:
    _shaded(ax, part, fit.test, part.ends, label="held out")
    draw_curve(ax, part.t, part.residual, color=INK, linewidth=pt(0.6))
    if fit.floor is not None:
        for sign, label in ((1, "± repeatability"), (-1, None)):
            ax.axhline(sign * part.factor * fit.floor, label=label, **to_scale(REPORTED))
    ax.set_ylabel(f"measured − model [{part.small}]")
    time_axis(ax, *part.ends)
    if ax.get_legend_handles_labels()[1]:
        legend_above(ax)


def _shaded(ax: Axes, part: _Compared, test: Window | None, shown: Window, label: str = "") -> None:
    """Shade the rows that were held out, as far as they are shown."""
    if test is None:
        return
    begin, end = max(test[0], shown[0], part.t[0]), min(test[1], shown[1], part.t[-1])
    if begin < end:
        ax.axvspan(
            begin, end, color=PALE_GREY, alpha=0.35, linewidth=0, zorder=0, label=label or None
        )


def _loop(ax: Axes, part: _Compared) -> None:
    draw_curve(ax, part.x, part.measured, color=LINE_GREY, linewidth=pt(2.0), label="measured")
    draw_curve(ax, part.x, part.modelled, color=INK, linewidth=pt(0.7), label="model")
    ax.set(xlabel=f"$x$ [{part.place}]", ylabel=f"${latex_name(part.name)}$ [{part.scale.unit}]")


def _residual_over_x(ax: Axes, part: _Compared) -> None:
    """Draw the residual over x in two shades, and its mean for each direction."""
    slow = MOVING * float(np.nanmax(np.abs(part.v)))
    means = []
    for sign, name, look in DIRECTIONS:
        chosen = (sign * part.v > slow) & np.isfinite(part.residual)
        dots: dict[str, Any] = {"linestyle": "", "marker": ".", "markeredgewidth": 0, "alpha": 0.35}
        size = pt(DOT if chosen.sum() > VECTOR_ROWS else 2.0 * DOT)
        draw_curve(
            ax,
            part.x[chosen],
            part.residual[chosen],
            color=look["color"],
            markersize=size,
            **dots,
        )
        means.append((_binned(part.x[chosen], part.residual[chosen]), name, look))
    for (x, mean), _, look in means:
        ax.plot(x, mean, color=colour("paper"), linewidth=pt(look["linewidth"] + 2.0))
    for (x, mean), name, look in means:
        ax.plot(x, mean, label=name, **to_scale(look))
    ax.set(xlabel=f"$x$ [{part.place}]", ylabel=f"measured − model [{part.small}]")
    legend_above(ax)


def _binned(x: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return means over parts of x; NaN where there are few rows."""
    if not x.size or np.ptp(x) == 0.0:
        return np.empty(0), np.empty(0)
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    counts = np.bincount(place, minlength=BINS)
    sums = np.bincount(place, weights=values, minlength=BINS)
    mean = np.where(counts >= FEWEST, sums / np.maximum(counts, 1), np.nan)
    return 0.5 * (edges[1:] + edges[:-1]), mean


def _parameters(ax: Axes, table: Sequence[Estimate], measured: tuple[str, Scale]) -> None:
    """Draw a row for each parameter: a dot with its interval, or that it cannot be told."""
    spans = [_relative(each) for each in table]
    told = [max(map(abs, span)) for span in spans if span is not None]
    limit = min(WIDEST, 1.15 * max(told, default=WIDEST)) or 1.0
    for row, (each, span) in enumerate(zip(table, spans, strict=True)):
        if span is None:
            ax.barh(row, 2 * limit, left=-limit, height=0.72, color=colour("chosen"))
            said = each.note or "cannot be told"
            ax.text(0.0, row, said, ha="center", va="center", color=TEXT_GREY, fontsize=font(8.5))
            continue
        left, right = max(span[0], -limit), min(span[1], limit)
        ax.plot([left, right], [row, row], color=TEXT_GREY, linewidth=pt(1.6), zorder=2)
        ax.plot([0.0], [row], "o", color=INK, markersize=pt(4.0), zorder=3)
        for end, given, marker in ((left, span[0], "<"), (right, span[1], ">")):
            mark = marker if abs(given) > limit else "|"
            ax.plot([end], [row], mark, color=TEXT_GREY, markersize=pt(5.0), zorder=2)
    ax.axvline(0.0, color=PALE_GREY, linewidth=pt(0.8), zorder=0)
    rows = range(len(table))
    ax.set(xlim=(-1.04 * limit, 1.04 * limit), ylim=(len(table) - 0.5, -0.5))
    ax.set_yticks(rows, [_symbol(each.name) for each in table])
    ax.set_xlabel("interval relative to the value [%]")
    ax.tick_params(axis="y", length=0, labelsize=font(8.5))
    if not narrow():
        scales = _scales(table, measured)
        values = ax.secondary_yaxis("right")
        values.set_yticks(rows, [_value(each, scales[each.unit]) for each in table])
        values.tick_params(axis="y", length=0, labelsize=font(8.5))
        values.spines["right"].set_visible(False)


def _relative(each: Estimate) -> tuple[float, float] | None:
    """Return the ends of an interval relative to the value, %; None if it cannot be told."""
    if not each.told or not np.isfinite([each.low, each.high]).all():
        return None
    size = abs(each.value) or max(abs(each.low), abs(each.high)) or 1.0
    return 100 * (each.low - each.value) / size, 100 * (each.high - each.value) / size


def _symbol(name: str) -> str:
    """Return a parameter as in formulas; words stay words."""
    part = re.fullmatch(r"(\w*[a-zA-Z])(\d+)", name)  # of an element, with its number
    whole = f"{SYMBOLS.get(part[1], part[1])}_{part[2]}" if part else SYMBOLS.get(name, name)
    symbol = latex_name(whole)
    return name if symbol.startswith(r"\mathrm") else f"${symbol}$"


def _scales(table: Sequence[Estimate], measured: tuple[str, Scale]) -> dict[str, Scale]:
    """Return one scale for all parameters of a unit: of the measured quantity, its own."""
    values: dict[str, list[float]] = {}
    for each in table:
        values.setdefault(each.unit, []).append(each.value)
    return {unit: scale_of(every, unit) for unit, every in values.items()} | dict([measured])


def _value(each: Estimate, scale: Scale) -> str:
    note = f", {each.note}" if each.note and each.told else ""
    mantissa = each.shown[0].partition("e")[0]
    digits = len(re.sub(r"\D", "", mantissa).lstrip("0")) or 1
    return dotted(scale.text(each.value, digits)).replace("-", "−") + note
