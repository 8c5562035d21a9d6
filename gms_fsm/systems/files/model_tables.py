"""Tables of a scenario or system file that define the friction model.

Their keys, units and rules are those of the parameters of the charts. ``kind`` names a model of
`gms_fsm.systems.models`, which has additional keys (columns of Table I, shares); ``chart`` names
any included chart, and the other keys are then its parameters.
"""

from __future__ import annotations

import functools
import operator
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import (
    Discriminator,
    Field,
    ModelWrapValidatorHandler,
    PrivateAttr,
    Tag,
    create_model,
    model_validator,
)

from gms_fsm.charts.gms import LAWS, PARAMETERS, WHICH_C, WHICH_LAW, Law
from gms_fsm.charts.parameters import SIGMA_2, WEIGHTS, Parameter
from gms_fsm.charts.parts import SUPPLIED
from gms_fsm.charts.registry import Entry, registered
from gms_fsm.charts.zoo.bristles.lugre import LUGRE
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.tables import Numbers, Table
from gms_fsm.foundation.tables import Value as TextOrNumber
from gms_fsm.systems.files.tables import StribeckTable
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.models import GMS, ChartModel, LuGre

__all__ = [
    "BY_CHART",
    "BY_KIND",
    "GMSTable",
    "IncludedChartTable",
    "LuGreTable",
    "ModelTable",
]

# Tags of union members in pydantic's errors; no key of a file looks like these.
BY_KIND, BY_CHART = "<kind>", "<chart>"


_DESCRIBED: Mapping[str, str] = {
    each.name: each.described for each in (*PARAMETERS, *LUGRE.parameters, SIGMA_2, WEIGHTS)
}


class GMSTable(Table):
    """A GMS model: a column of Table I of the paper, or all parameters."""

    kind: Literal["GMS"]
    law: Law = Field(description=WHICH_LAW)
    preset: Literal["non-drifting", "stick-slip"] | None = Field(
        None, description="column of Table I, instead of parameters"
    )
    k: list[float] | None = Field(None, description=_DESCRIBED["k"])
    sigma: list[float] | None = Field(None, description=_DESCRIBED["sigma"])
    C: Numbers | None = Field(
        None, description=f"{_DESCRIBED['C']}; with shares, one number in N/s"
    )
    sigma_2: float | None = Field(None, description=_DESCRIBED["sigma_2"])
    v_c: float | None = Field(None, description=_DESCRIBED["v_c"])
    stribeck: StribeckTable | None = None
    weights: list[float] | None = Field(None, description=_DESCRIBED["weights"])
    shares: list[float] | None = Field(None, description="share of the friction of each element")
    _integers: frozenset[str] = PrivateAttr(frozenset())  # lists written without a decimal point

    @model_validator(mode="wrap")
    @classmethod
    def _fits(cls, data: Any, handler: ModelWrapValidatorHandler[GMSTable]) -> GMSTable:
        made = handler(data)
        lists = ((k, u) for k, u in data.items() if isinstance(u, list)) if data is not made else ()
        made._integers = frozenset(k for k, u in lists if all(type(each) is int for each in u))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the warning is issued when the model is built for use
            made.build()
        return made

    def build(self) -> GMS:
        """Return the model."""
        own = ("k", "sigma", "C", "sigma_2", "v_c", "stribeck", "shares")
        if self.preset is not None:
            given = [name for name in own if getattr(self, name) is not None]
            if given:
                raise ValueError(
                    f"preset can be combined with weights only; remove {', '.join(given)}"
                )
            parameters = GMSParameters.paper(self.preset)
            if self.weights is not None:
                parameters = parameters.with_weights(self.weights)
            return GMS(parameters, law=self.law)
        needed = ("k", "C", "v_c", "stribeck")
        missing = [name for name in needed if getattr(self, name) is None]
        if missing:
            help_ = f"; {WHICH_C}" if "C" in missing else ""
            raise ValueError(f"missing {', '.join(missing)}; give them, or a preset{help_}")
        assert self.k is not None
        assert self.v_c is not None
        assert self.stribeck is not None
        self._check_lengths()
        n, sigma_2 = len(self.k), self.sigma_2 or 0.0
        sigma = [0.0] * n if self.sigma is None else self.sigma
        if self.shares is not None:
            if isinstance(self.C, list) or self.weights is not None:
                raise ValueError(f"shares need C as one number [N/s], and no weights; {WHICH_C}")
            assert self.C is not None
            try:
                parameters = GMSParameters.from_shares(
                    self.shares,
                    self.k,
                    C=self.C,
                    stribeck=self.stribeck.build(),
                    v_c=self.v_c,
                    sigma=sigma,
                    sigma_2=sigma_2,
                )
            except ParameterError as error:
                if not error.place.startswith("alpha"):
                    raise
                place = "shares" + error.place.removeprefix("alpha")
                raise error.replaced(place=place) from None
        else:
            if not isinstance(self.C, list):
                raise ValueError(
                    "C is one number [N/s], which needs shares; without them, C is a list with one "
                    "number [m/s] for each element"
                )
            parameters = GMSParameters(
                self.k,
                sigma,
                self.C,
                sigma_2=sigma_2,
                stribeck=self.stribeck.build(),
                v_c=self.v_c,
                weights=self.weights,
            )
        return GMS(parameters, law=self.law)

    def _check_lengths(self) -> None:
        """Refuse lists of different lengths, with the cure of those with decimal commas."""
        given = {name: getattr(self, name) for name in ("k", "sigma", "C", "weights", "shares")}
        lists = {name: value for name, value in given.items() if isinstance(value, list)}
        lengths = {len(value) for value in lists.values()}
        if len(lengths) < 2:
            return
        advice = "give one number for each element"
        for name, value in lists.items():
            if (
                name in self._integers
                and min(value, default=0) >= 0
                and 0 < len(value) == 2 * min(lengths)
            ):
                pairs = zip(value[::2], value[1::2], strict=True)
                numbers = ", ".join(f"{a:.0f}.{b:.0f}" for a, b in pairs)
                advice = f"a number has a decimal point: {name} = [{numbers}]"
        counts = " and ".join(f"{len(value)} in {name}" for name, value in lists.items())
        raise ParameterError(f"there are {counts}", advice=advice)


class LuGreTable(Table):
    """The LuGre model."""

    kind: Literal["LuGre"]
    sigma_0: float = Field(description=_DESCRIBED["sigma_0"])
    sigma_1: float = Field(description=_DESCRIBED["sigma_1"])
    sigma_2: float = Field(description=_DESCRIBED["sigma_2"])
    stribeck: StribeckTable

    @model_validator(mode="after")
    def _fits(self) -> LuGreTable:
        self.build()
        return self

    def build(self) -> LuGre:
        """Return the model."""
        return LuGre(
            sigma_0=self.sigma_0,
            sigma_1=self.sigma_1,
            sigma_2=self.sigma_2,
            stribeck=self.stribeck.build(),
        )


# --------------------------------------------------------------------------- any chart
class IncludedChartTable(Table):
    """An included chart; the table of each has its parameters as further keys."""

    chart: str
    n: int | None = Field(
        None, ge=1, description="number of elements; by default the length of the longest list"
    )

    @model_validator(mode="after")
    def _fits(self) -> IncludedChartTable:
        self.build()
        return self

    def build(self) -> ChartModel:
        """Return the model."""
        given: dict[str, Any] = vars(self)
        entry = registered()[self.chart]
        values = {name: given[_FIELD.format(name)] for name in entry.parameter_names}
        curve: StribeckTable | None = given.get("stribeck")
        weights: Any = given.get("weights")
        lists = [each for each in (weights, *values.values()) if isinstance(each, list)]
        return ChartModel(
            entry.chart(given.get("law", "")),
            values,
            n=self.n or max(map(len, lists), default=1) or 1,
            stribeck=None if curve is None else curve.build(),
            sigma_2=given.get("sigma_2") or 0.0,
            weights=weights,
            inputs=given.get("inputs", {}),
        )


_FIELD = "parameter_{}"  # internal name of a parameter; pydantic reserves some names


def _chart_table(entry: Entry) -> type[IncludedChartTable]:
    """Return the table of a chart, with its parameters as keys."""
    kind: Any = Literal[entry.name]
    fields: dict[str, Any] = {"chart": (kind, Field(description=entry.title))}
    if entry.laws:
        law: Any = Literal[entry.laws]
        fields["law"] = (law, Field(description=WHICH_LAW if entry.laws == LAWS else None))
    for each in entry.parameters:
        numbers: Any = Numbers if each.per_element else float
        description = each.described
        fields[_FIELD.format(each.name)] = (
            numbers,
            Field(alias=each.name, description=description),
        )
    if entry.curve:
        fields["stribeck"] = (StribeckTable, Field(description="the curve that gives the input s"))
        shared: tuple[Parameter, ...] = (SIGMA_2, WEIGHTS)
    else:
        shared = (SIGMA_2,)
    if others := [name for name in entry.inputs if name not in SUPPLIED]:
        bound = f"what the inputs {', '.join(others)} are, over t and the names of the rig"
        fields["inputs"] = (dict[str, TextOrNumber], Field(description=bound))
    for each in shared:
        if each.name not in entry.parameter_names:
            optional: Any = (list[float] if each.per_element else float) | None
            fields[each.name] = (optional, Field(None, description=_DESCRIBED[each.name]))
    return create_model(
        f"Chart {entry.name}", __base__=IncludedChartTable, __doc__=entry.title, **fields
    )


def _model_form(given: Any) -> str:
    by_chart = isinstance(given, IncludedChartTable) or (
        isinstance(given, dict) and "chart" in given and "kind" not in given
    )
    return BY_CHART if by_chart else BY_KIND


if TYPE_CHECKING:
    ModelTable: TypeAlias = GMSTable | LuGreTable | IncludedChartTable
else:
    _CHARTS = functools.reduce(operator.or_, map(_chart_table, registered().values()))
    ModelTable = Annotated[
        Annotated[GMSTable | LuGreTable, Field(discriminator="kind"), Tag(BY_KIND)]
        | Annotated[_CHARTS, Field(discriminator="chart"), Tag(BY_CHART)],
        Discriminator(_model_form),
    ]
