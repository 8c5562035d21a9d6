"""Results of the bench: curves, measured numbers with units, verdicts, and the table of them."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Literal, get_args

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ParameterError, shown
from gms_fsm.foundation.arguments import refusing, unknown
from gms_fsm.phenomena.limits import LIMITS, Limit

__all__ = [
    "MARKS",
    "VERDICTS",
    "Cell",
    "Curve",
    "MeasuredNumber",
    "PhenomenaTable",
    "PhenomenonResult",
]
__all__ += ["Phenomenon", "Verdict"]

Verdict = Literal["shows", "does not show", "shows wrongly", "does not apply", "failed"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


SMALLEST = 1e-3  # in its unit: a smaller number is printed as 0.000; tables in CSV have all digits


@dataclass(frozen=True)
class MeasuredNumber:
    """A measured number.

    Parameters
    ----------
    name : str
        What was measured.
    value : float
        In the unit.
    unit : str
        ``"1"`` for a ratio.
    """

    name: str
    value: float
    unit: str

    def __str__(self) -> str:
        value = self.value
        text = f"{value:.3g}" if value == 0.0 or abs(value) >= SMALLEST else "0.000"
        return f"{text} {self.unit}".removesuffix(" 1")


@dataclass(frozen=True, eq=False)
class Curve:
    """A measured curve, in the units of its phenomenon's axes.

    Parameters
    ----------
    label : str
        For the legend.
    x, y : ndarray, shape (points,)
        The points.
    """

    label: str
    x: FloatArray
    y: FloatArray


@dataclass(frozen=True, eq=False)
class PhenomenonResult:
    """What one model does in one experiment.

    Parameters
    ----------
    verdict : str
        One of `VERDICTS`.
    numbers : tuple of MeasuredNumber
        The measured numbers, the one that is shown in the table first. Empty only if the
        experiment does not apply or failed.
    said : str
        One sentence; the reason, where there is no number.
    curves : tuple of Curve
        For the picture.
    instead : str
        What the table says where the first number would tell nothing: "slides away", "no loop".
    """

    verdict: Verdict
    numbers: tuple[MeasuredNumber, ...]
    said: str
    curves: tuple[Curve, ...] = field(default=(), repr=False)
    instead: str = ""

    def number(self, name: str) -> float:
        """Return a measured number.

        Parameters
        ----------
        name : str
            Name of one of `numbers`.

        Returns
        -------
        float
            Its value.

        Raises
        ------
        ParameterError
            If there is none of this name.
        """
        for each in self.numbers:
            if each.name == name:
                return each.value
        raise unknown("number", name, (each.name for each in self.numbers))


@dataclass(frozen=True)
class Phenomenon:
    """An experiment, and what it decides.

    Parameters
    ----------
    name : str
        As on the command line.
    title : str
        Of the picture.
    short : str
        Of the column in a table.
    experiment : str
        What is done and what is measured, in one or two sentences.
    axes : (str, str)
        Labels of the curves' axes, with units.
    measure : callable
        ``measure(specimen)`` returns a `PhenomenonResult`.
    log : bool
        Whether the horizontal axis is logarithmic.
    decimals : int
        Of the first number in a table.
    shows_if : str
        What the first number of a model that shows it is, in a few words; symbols in ``$``.
    """

    name: str
    title: str
    short: str
    experiment: str
    axes: tuple[str, str]
    measure: Callable[..., PhenomenonResult] = field(repr=False)
    log: bool = False
    decimals: int = 3
    shows_if: str = ""

    def brief(self, found: PhenomenonResult) -> str:
        """Return what a table says of a result; empty if nothing was measured.

        Parameters
        ----------
        found : PhenomenonResult
            Of this experiment.

        Returns
        -------
        str
            The first number, with as many decimals as in the results of all other models.
        """
        if found.instead or not found.numbers:
            return found.instead
        first = found.numbers[0]
        value = round(first.value, self.decimals) + 0.0  # no -0
        return f"{value:.{self.decimals}f} {first.unit}".removesuffix(" 1").replace("-", "−")

    @property
    def limits(self) -> dict[str, Limit]:
        """The limits of its verdict, by name."""
        return {name: each for name, each in LIMITS.items() if name.startswith(f"{self.name}.")}


@dataclass(frozen=True, eq=False)
class Cell:
    """A measurement, with the model and the phenomenon it belongs to.

    Parameters
    ----------
    model : str
        Name of the model.
    phenomenon : Phenomenon
        The experiment.
    measured : PhenomenonResult
        The result.
    """

    model: str
    phenomenon: Phenomenon
    measured: PhenomenonResult


@refusing()
@dataclass(frozen=True, eq=False)
class PhenomenaTable:
    """Models against phenomena: the result of `measure_phenomena`.

    Parameters
    ----------
    titles : mapping of str to str
        Titles of the models by name.
    phenomena : tuple of Phenomenon
        The experiments.
    cells : tuple of Cell
        One per model and phenomenon.
    """

    titles: dict[str, str]
    phenomena: tuple[Phenomenon, ...]
    cells: tuple[Cell, ...] = field(repr=False)

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models."""
        return tuple(self.titles)

    def cell(self, model: str, phenomenon: str) -> PhenomenonResult:
        """Return what was measured.

        Parameters
        ----------
        model, phenomenon : str
            The names.

        Returns
        -------
        Measured
            Verdict, numbers and curves.

        Raises
        ------
        ParameterError
            If the table has no such model or phenomenon.
        """
        for each in self.cells:
            if (each.model, each.phenomenon.name) == (model, phenomenon):
                return each.measured
        raise ParameterError(
            f"the table has no cell {shown((model, phenomenon))}",
            advice=f"models: {', '.join(self.models)}; "
            f"phenomena: {', '.join(each.name for each in self.phenomena)}",
        )

    def markdown(self) -> str:
        """Return the verdicts and first numbers as a Markdown table.

        Returns
        -------
        str
            A row per model that takes part, a column per phenomenon.
        """
        head = ["model", *(each.short for each in self.phenomena)]
        lines = [_row(head), _row(["---"] * len(head))]
        for model in self.models:
            found = [(each, self.cell(model, each.name)) for each in self.phenomena]
            if any(result.verdict != "does not apply" for _, result in found):
                lines.append(_row([model, *(_marked(each, result) for each, result in found)]))
        return "\n".join(lines) + "\n"

    def left_out(self) -> dict[str, str]:
        """Return the models to which no phenomenon applies, with the reason.

        Returns
        -------
        dict of str to str
            Reasons by the name of the model.
        """
        return {
            model: self.cell(model, self.phenomena[0].name).said
            for model in self.models
            if all(
                self.cell(model, each.name).verdict == "does not apply" for each in self.phenomena
            )
        }

    def csv(self) -> str:
        """Return all numbers as CSV, one row per number.

        Returns
        -------
        str
            With a header line; models without a number have a row with the reason.
        """
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(["model", "phenomenon", "verdict", "quantity", "value", "unit", "said"])
        for each in self.cells:
            found = each.measured
            start = [each.model, each.phenomenon.name, found.verdict]
            for number in found.numbers:
                table.writerow([*start, number.name, repr(number.value), number.unit, found.said])
            if not found.numbers:
                table.writerow([*start, "", "", "", found.said])
        return text.getvalue()

    def __iter__(self) -> Iterator[Cell]:
        return iter(self.cells)


MARKS = {
    "shows": "●",
    "does not show": "○",
    "shows wrongly": "✗",
    "does not apply": "–",
    "failed": "?",
}


def _marked(phenomenon: Phenomenon, found: PhenomenonResult) -> str:
    return f"{MARKS[found.verdict]} {phenomenon.brief(found)}".strip()


def _row(cells: list[str]) -> str:
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"
