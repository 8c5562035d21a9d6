"""What the cells of a lesson's notebook call: predictions are compared, a parameter is varied."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import Any


def reveal(predicted: float | str | None, measured: float | str, unit: str = "") -> None:
    """Print what was predicted next to what was measured.

    Examples
    --------
    >>> reveal(5.0, 6.25, "um")
    You predicted 5 um. Measured: 6.25 um; your answer is 20 % too low.
    >>> reveal("open", "closed")
    You predicted open. Measured: closed.
    >>> reveal(None, 6.25, "um")
    You predicted nothing. Measured: 6.25 um.
    """
    answer = "nothing" if predicted is None else _said(predicted, unit)
    print(f"You predicted {answer}. Measured: {_said(measured, unit)}{_off(predicted, measured)}.")


def _said(value: float | str, unit: str) -> str:
    return value if isinstance(value, str) else f"{value:.4g} {unit}".rstrip()


def _off(predicted: float | str | None, measured: float | str) -> str:
    if predicted is None or isinstance(predicted, str) or isinstance(measured, str) or not measured:
        return ""
    error = 100 * (predicted / measured - 1)
    if abs(error) < 0.5:
        return "; your answer is right"
    if not math.isfinite(error) or predicted / measured < 0 or abs(error) > 900:
        return "; your answer is far off"
    return f"; your answer is {abs(error):.0f} % too {'high' if error > 0 else 'low'}"


def vary(
    draw: Callable[[Any], object],
    initial: float,
    least: float,
    most: float,
    step: float,
    label: str,
    *,
    log: bool = False,
) -> None:
    """Show what a function draws, with a slider for its argument if ipywidgets is installed."""
    display: Any = import_module("IPython.display").display
    if find_spec("ipywidgets") is None:
        display(draw(initial))
        print(
            f"{label} = {initial:g}; for another value call {getattr(draw, '__name__', 'draw')}"
            "(value). With ipywidgets (pip install ipywidgets) there is a slider here."
        )
        return
    ipywidgets: Any = import_module("ipywidgets")
    whole = all(isinstance(each, int) for each in (initial, least, most, step))
    kind = "FloatLogSlider" if log else "IntSlider" if whole else "FloatSlider"
    options: dict[str, Any] = {"min": least, "max": most, "step": step, "description": label}
    options |= {"continuous_update": False} | ({} if whole else {"readout_format": ".4g"})
    argument = next(iter(inspect.signature(draw).parameters))
    ipywidgets.interact(draw, **{argument: getattr(ipywidgets, kind)(initial, **options)})
