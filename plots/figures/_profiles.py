"""Figure of what a fit cannot tell: how little the fit suffers as each such parameter moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.identification.certainty.profile import LIMIT, Profile
from plots.figures._layout import fitted, legend_below, sheet
from plots.figures._parts import letter_panels
from plots.style import INK, LINE_GREY, PAPER, TEXT_GREY
from plots.style.matplotlib import Axes, Figure, MaxNLocator, NullLocator, rc_context
from plots.style.presets import font, pt, room, settings, to_scale

if TYPE_CHECKING:
    from gms_fsm.identification.result import Fit


MOST_PROFILES = 12
COLUMNS, PANEL, NARROWEST = 4, (2.7, 1.9), 2.1  # inches
WIDE = 5.0  # largest over smallest value: from here on the axis is logarithmic
DECADES = 100.0  # from here on only powers of ten are named
HIGHEST = 2.0 * LIMIT
MARGIN = 0.06  # of an axis, beyond the values
TICKS = 4  # most powers of ten on an axis
PLAIN = (-1, 3)  # powers of ten that need no factor
EDGE: dict[str, Any] = {"color": TEXT_GREY, "linestyle": (0, (4.0, 2.0)), "linewidth": 1.0}


def profiles_figure(fit: Fit) -> Figure:
    """Draw how little the fit suffers as each parameter that cannot be told is moved.

    Parameters
    ----------
    fit : Fit
        From `gms_fsm.fit` or `gms_fsm.choose`.

    Returns
    -------
    Figure
        A panel for each of `Fit.open_profiles`, at most twelve: the least rise of twice the
        negative log-likelihood met at values of the parameter, in its unit, all others being free.
        Below the dashed line, at 3.84, the fit is as good (95 %). A dot below zero is a better fit.

    Raises
    ------
    ParameterError
        If there is no such profile.
    """
    from gms_fsm.identification.result import Fit as Kind

    checked_kind("fit", fit, Kind, "a Fit, from gms_fsm.fit")
    profiles = fit.open_profiles[:MOST_PROFILES]
    if not profiles:
        raise ParameterError(
            "it has no open profile: every parameter is told, or has no influence at all",
            place="fit",
            advice="fit.profile(name) is the profile of one parameter; fit_figure draws the fit",
        )
    most = min(max(1, int(room(COLUMNS * PANEL[0]) / NARROWEST)), COLUMNS)
    rows = -(-len(profiles) // most)
    columns = -(-len(profiles) // rows)
    with rc_context(settings()):
        size = (max(columns, 2) * PANEL[0] + 0.5, rows * PANEL[1] + 1.0)
        figure = sheet(*size, grows=True)
        grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
        panels, unused = list(grid.flat[: len(profiles)]), grid.flat[len(profiles) :]
        for ax, profile in zip(panels, profiles, strict=True):
            _panel(ax, profile, fit[profile.name].value)
        for ax in unused:
            ax.set_axis_off()
        lowest = min(0.0, *(float(each.rise.min()) for each in profiles))
        panels[0].set_ylim(lowest - MARGIN * (HIGHEST - lowest), HIGHEST)
        letter_panels(panels, [fit[each.name].meaning or each.name for each in profiles])
        figure.supylabel("rise of −2 ln L", fontsize=font(9.0))
        figure.suptitle(_title(fit, len(profiles)), x=0.01, ha="left")
        handles, labels = panels[0].get_legend_handles_labels()
        legend_below(figure, handles, labels)
    return fitted(figure)


def _title(fit: Fit, shown: int) -> str:
    count = len(fit.open_profiles)
    left_out = f" (the first {shown} of {count})" if shown < count else ""
    return f"{fit.title}: what cannot be told{left_out}"


def _panel(ax: Axes, profile: Profile, value: float) -> None:
    """Draw one profile, the edge of the region, and the fitted value."""
    factor, unit = _axis(ax, np.append(profile.values, value), profile.unit)
    ax.axhline(LIMIT, **to_scale(EDGE), zorder=1)
    place = ax.get_yaxis_transform()
    ax.text(1.02, LIMIT, "95 %", transform=place, va="center", color=TEXT_GREY, fontsize=font(7.5))
    look: dict[str, Any] = {"color": LINE_GREY, "linewidth": pt(0.8), "marker": "o"}
    ax.plot(
        factor * profile.values,
        profile.rise,
        markersize=pt(3.5),
        markerfacecolor=INK,
        markeredgewidth=0,
        label="least rise met",
        **look,
    )
    ax.plot(
        [factor * value],
        [0.0],
        linestyle="",
        marker="D",
        markersize=pt(6.0),
        markerfacecolor=PAPER,
        markeredgecolor=INK,
        markeredgewidth=pt(1.2),
        label="fitted value",
    )
    ax.set_xlabel(f"{profile.name} [{unit}]" if unit else profile.name)
    ax.yaxis.set_major_locator(MaxNLocator(4, integer=True))


# --------------------------------------------------------------------------- axis of the values
def _axis(ax: Axes, values: NDArray[np.float64], unit: str) -> tuple[float, str]:
    """Scale the axis of a parameter; return the factor of the values, and the unit it makes."""
    unit = "" if unit == "1" else unit
    low, high = float(values.min()), float(values.max())
    logarithmic = low > 0.0 and high > WIDE * low
    if logarithmic and high > DECADES * low:
        powers = _powers(low, high)
        ax.set_xscale("log")
        ax.set_xticks(10.0**powers, [f"$10^{{{power}}}$" for power in powers])
        ax.set_xlim(low * (high / low) ** -MARGIN, high * (high / low) ** MARGIN)
        ax.xaxis.set_minor_locator(NullLocator())
        return 1.0, unit
    largest = max(abs(low), abs(high))
    power = int(np.floor(np.log10(largest))) if largest > 0.0 else 0
    power = 0 if PLAIN[0] <= power <= PLAIN[1] else power
    factor = 10.0**-power
    if logarithmic:
        ax.set_xscale("log")
        ticks = _ticks(factor * low, factor * high)
        ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        ax.xaxis.set_minor_locator(NullLocator())
    else:
        ax.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    return factor, f"$10^{{{power}}}$ {unit}".rstrip() if power else unit


def _powers(low: float, high: float) -> NDArray[np.int64]:
    """Return powers of ten from low to high, every second or third if there are many."""
    found = np.arange(np.ceil(np.log10(low)), np.floor(np.log10(high)) + 1).astype(np.int64)
    return found[:: -(-found.size // TICKS)]


def _ticks(low: float, high: float) -> NDArray[np.float64]:
    """Return one, two and five times powers of ten, from low to high."""
    powers = np.arange(np.floor(np.log10(low)), np.floor(np.log10(high)) + 1)
    every = np.outer(10.0**powers, (1.0, 2.0, 5.0)).ravel()
    return every[(every >= low) & (every <= high)]
