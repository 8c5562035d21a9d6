"""Questions: what a reader predicts, and the verdict. A slider for the notebooks of lessons."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gms_fsm.app.lessons.engine.lesson import Result


WHOLE = 0.5  # the tolerance of a number that is counted


@dataclass(frozen=True)
class Question:
    """What a reader predicts before a run, and when the prediction is right.

    Parameters
    ----------
    name : str
        What a notebook calls the answer; the run measures a value of the same name.
    unit : str
        Of both, if they are numbers.
    choices : tuple of str
        The possible answers, if they are words.
    rtol, atol : float
        A number is right within ``max(atol, rtol * abs(measured))``. Where the physics says "none",
        what is measured is rounding, and only `atol` counts.

    Examples
    --------
    >>> Question("first_slip", "um", rtol=0.05).hint, Question("lag", choices=("yes", "no")).hint
    ('um, within 5 %', '"yes" or "no"')
    """

    name: str
    unit: str = ""
    choices: tuple[str, ...] = ()
    rtol: float = 0.0
    atol: float = 0.0

    @property
    def tolerance(self) -> str:
        """Within what a number is right."""
        parts = [f"{100 * self.rtol:.3g} %"] * bool(self.rtol)
        parts += [f"{self.atol:g} {self.unit}".rstrip()] * bool(self.atol)
        return " or ".join(parts)

    @property
    def hint(self) -> str:
        """What an answer looks like."""
        if self.choices:
            *others, last = (f'"{each}"' for each in self.choices)
            return f"{', '.join(others)} or {last}"
        if self.atol == WHOLE and not self.unit:
            return "a whole number"
        of = " of the value" * (self.unit.startswith("%") and bool(self.rtol))
        return ", ".join(filter(None, [self.unit, f"within {self.tolerance}{of}"]))


def judged(
    question: Question, predicted: float | str | None, measured: float | str
) -> tuple[bool, str]:
    """Return whether a prediction is right, and what is said of it.

    Examples
    --------
    >>> slip = Question("first_slip", "um", rtol=0.05)
    >>> judged(slip, 5.0, 6.25)
    (False, 'You predicted 5 um. Measured: 6.25 um. Your answer is 20 % too low.')
    >>> judged(Question("gap", "N", atol=1e-3), 0, 5e-8)
    (True, 'You predicted 0 N. Measured: 5e-08 N. Right, within 0.001 N.')
    >>> judged(Question("at_20", choices=("on", "off")), "on", "off")
    (False, 'You predicted on. Measured: off. Not right.')
    """
    unit = question.unit
    if predicted is None:
        return False, f"You predicted nothing. Measured: {_said(measured, unit)}."
    head = f"You predicted {_said(predicted, unit)}. Measured: {_said(measured, unit)}."
    if isinstance(predicted, str) or isinstance(measured, str):
        right = str(predicted).strip().casefold() == str(measured).casefold()
        return right, f"{head} {'Right.' if right else 'Not right.'}"
    off = _off(float(predicted), float(measured), question.rtol, question.atol)
    return not off, f"{head} {off or f'Right, within {question.tolerance}'}."


def compare(result: Result, **predictions: float | str | None) -> None:
    """Print what was predicted, what was measured, and the verdict, question by question.

    Examples
    --------
    >>> from gms_fsm.app.lessons import lesson
    >>> compare(lesson(9).run(), released=None)
    You predicted nothing. Measured: 7.5 s.
    """
    for question in result.lesson.questions:
        if question.name in predictions:
            print(judged(question, predictions[question.name], result.values[question.name])[1])


def _said(value: float | str, unit: str) -> str:
    return value if isinstance(value, str) else f"{value:.4g} {unit}".rstrip()


def _off(predicted: float, measured: float, rtol: float, atol: float) -> str:
    """Return in words how far a number is off, or nothing; `judge.js` says the same."""
    if abs(predicted - measured) <= max(atol, rtol * abs(measured)):
        return ""
    side = "high" if predicted > measured else "low"
    if not math.isfinite(predicted) or abs(measured) <= atol or predicted * measured < 0:
        return f"Your answer is too {side}"
    ratio = predicted / measured
    if 0.1 < ratio < 10:
        return f"Your answer is {100 * abs(ratio - 1):.0f} % too {side}"
    return f"Your answer is much too {side}"


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
