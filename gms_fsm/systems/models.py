"""Friction models: a chart, its parameters, and what the elements share.

A model says nothing about how it is run or what it is mounted on.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.gms import GIVE_LAW, GMS_ELEMENT, Law, check_law
from gms_fsm.charts.parameters import (
    SIGMA_2,
    STRIBECK,
    WEIGHTS,
    FloatArray,
    Parameter,
    adapted,
    as_numbers,
    check_names,
    checked_array,
    checked_scalar,
    checked_values,
    with_shared,
)
from gms_fsm.charts.parts import SUPPLIED
from gms_fsm.charts.registry import Entry
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.charts.zoo.bristles.lugre import LUGRE
from gms_fsm.errors import ParameterError, shown
from gms_fsm.foundation.arguments import refusing
from gms_fsm.foundation.display import displayed, short_repr
from gms_fsm.foundation.equality import by_value
from gms_fsm.systems.given import Text, texts_of
from gms_fsm.systems.gms_parameters import GMSParameters


class Model(Protocol):
    """The interface of a friction model to a simulation."""

    @property
    def title(self) -> str:
        """Name and law, for figures and summaries."""

    @property
    def chart(self) -> Chart:
        """The chart that every element runs."""

    @property
    def n(self) -> int:
        """Number of elements."""

    @property
    def values(self) -> Mapping[str, float | FloatArray]:
        """For each parameter of the chart, one number or one per element, shape (n,)."""

    @property
    def weights(self) -> FloatArray:
        """Threshold weights, shape (n,), m/N; ``s_i = weights[i] * s(v)``."""

    @property
    def stribeck(self) -> Stribeck | None:
        """The common Stribeck curve; None if the chart has no input ``s``."""

    @property
    def sigma_2(self) -> float:
        """Viscous friction, Ns/m."""


def is_model(given: object) -> bool:
    """Tell whether an object has what marks a `Model`."""
    marked = hasattr(given, "chart") and hasattr(given, "weights")
    return marked and not isinstance(given, type)


@refusing(law=GIVE_LAW)
@displayed("svg", "html")
@short_repr
@by_value()
@dataclass(frozen=True, eq=False)
class GMS:
    """A bank of Generalized Maxwell Slip elements in parallel.

    ``F = sum(k_i z_i + sigma_i dz_i/dt) + sigma_2 v``, eq. (3) and (4).

    Parameters
    ----------
    parameters : GMSParameters
        The numbers.
    law : {"published", "signed"}
        The slip law; see `gms_fsm.charts.gms`. There is no default: the two differ for v < 0.

    Raises
    ------
    ParameterError
        If the law is not one of the two.

    Warns
    -----
    UserWarning
        If the published law is used with F_s = F_c: such an element never arrests.

    Examples
    --------
    >>> GMS(GMSParameters.paper("stick-slip"), law="published").title
    'GMS, 4 elements, published law'
    """

    parameters: GMSParameters
    law: Law = field(kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.parameters, GMSParameters):
            raise ParameterError(
                "it must be a GMSParameters, for example GMSParameters.paper('stick-slip')",
                place="parameters",
                value=self.parameters,
            )
        check_law(self.law)
        if self.law == "published" and self.stribeck.F_s == self.stribeck.F_c:
            warnings.warn(
                f"published law with F_s = F_c = {self.stribeck.F_c!r} N: a slipping element stays "
                "exactly on |z| = s, where the law is at rest, and never arrests; use law='signed' "
                "or F_s > F_c",
                stacklevel=4,
            )

    @property
    def title(self) -> str:
        """Name and law."""
        plural = "element" if self.n == 1 else "elements"
        return f"GMS, {self.n} {plural}, {self.law} law"

    @property
    def chart(self) -> Chart:
        """The chart of one element."""
        return GMS_ELEMENT[self.law]

    @property
    def n(self) -> int:
        """Number of elements."""
        return self.parameters.n

    @property
    def values(self) -> Mapping[str, float | FloatArray]:
        """The chart's parameters."""
        p = self.parameters
        return {"k": p.k, "sigma": p.sigma, "C": p.C, "v_c": p.v_c}

    @property
    def weights(self) -> FloatArray:
        """Threshold weights, shape (n,), m/N."""
        return self.parameters.weights

    @property
    def stribeck(self) -> Stribeck:
        """The Stribeck curve."""
        return self.parameters.stribeck

    @property
    def sigma_2(self) -> float:
        """Viscous friction, Ns/m."""
        return self.parameters.sigma_2


@refusing()
@displayed("svg", "html")
@short_repr
@by_value()
@dataclass(frozen=True, eq=False, kw_only=True)
class LuGre:
    """The LuGre model: one bristle, one state, no edges.

    ``dz = v - sigma_0 |v| z / s(v)``, ``F = sigma_0 z + sigma_1 dz + sigma_2 v``.

    Parameters
    ----------
    sigma_0 : float
        Bristle stiffness, N/m, > 0.
    sigma_1 : float
        Bristle damping, Ns/m, >= 0.
    sigma_2 : float
        Viscous friction, Ns/m, >= 0.
    stribeck : Stribeck
        The curve.

    Examples
    --------
    >>> LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3)).n
    1
    """

    sigma_0: float
    sigma_1: float
    sigma_2: float
    stribeck: Stribeck

    def __post_init__(self) -> None:
        for each in (*LUGRE.parameters, SIGMA_2):
            value = checked_scalar(each.name, getattr(self, each.name), each.rule)
            object.__setattr__(self, each.name, value)
        if not isinstance(self.stribeck, Stribeck):
            raise ParameterError("it must be a Stribeck", place="stribeck", value=self.stribeck)

    title = "LuGre"
    chart = LUGRE
    n = 1

    @property
    def values(self) -> Mapping[str, float | FloatArray]:
        """The chart's parameters."""
        return {"sigma_0": self.sigma_0, "sigma_1": self.sigma_1}

    @property
    def weights(self) -> FloatArray:
        """One weight of 1; LuGre uses s(v) itself."""
        return np.ones(1)


@refusing(
    ParameterError,
    "numbers of the chart are given by name: ChartModel(chart, {'k': 100.0}), and those of n "
    "elements as lists, ChartModel(chart, {'k': [100.0, 50.0]}, n=2)",
    chart="a chart, such as gms_fsm.charts.CHARTS['lugre']",
    values="a number for each parameter of the chart, for example {'k': 1.0}",
)
@displayed("svg", "html")
@short_repr
@by_value()
@dataclass(frozen=True, eq=False)
class ChartModel:
    """Any chart run as a bank of n elements, for example with your own guards or states.

    Parameters
    ----------
    chart : Chart
        The element's chart.
    values : mapping
        For each parameter of the chart, a number or an array of shape (n,).
    n : int, optional
        Number of elements; 1 if omitted.
    stribeck : Stribeck, optional
        The curve behind the input ``s``; None for charts without that input.
    sigma_2 : float
        Viscous friction, Ns/m, >= 0.
    weights : array_like, shape (n,), optional
        Threshold weights, m/N; 1 if omitted.
    title : str, optional
        For figures; the chart's name if omitted.
    inputs : mapping of str to str or float, optional
        What the chart's other inputs are: ``{"N": "10 + sin(t)"}``, over t and the names of the rig
        or system.

    Raises
    ------
    ParameterError
        If a value is missing, unknown, not finite or of the wrong length, or if the chart needs an
        input that no model supplies, or ``s`` without a curve.

    Examples
    --------
    >>> from gms_fsm.charts import gms_element
    >>> ChartModel(gms_element("signed"), {"k": 1, "sigma": 0, "C": 1, "v_c": 1e-6}, n=2,
    ...            stribeck=Stribeck(1, 1.5, 1e-3)).title
    'GMS element, signed law'
    """

    chart: Chart
    values: Mapping[str, float | FloatArray]
    n: int = field(default=1, kw_only=True)
    stribeck: Stribeck | None = field(default=None, kw_only=True)
    sigma_2: float = field(default=0.0, kw_only=True)
    weights: FloatArray = field(default=None, kw_only=True)  # type: ignore[arg-type]
    title: str = field(default="", kw_only=True)
    inputs: Mapping[str, Text] = field(default_factory=dict, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.chart, Chart):
            raise ParameterError(
                "it must be a gms_fsm.Chart (the transitions machine is built from it: "
                "ElementMachines(model).machine)",
                place="chart",
                value=self.chart,
                advice=f"an included one is gms_fsm.charts.CHARTS[{self.chart!r}]"
                if isinstance(self.chart, str)
                else "",
            )
        if isinstance(self.n, bool) or not isinstance(self.n, int) or self.n < 1:
            raise ParameterError(
                "the number of elements must be an integer, at least 1", place="n", value=self.n
            )
        curve: Any = self.stribeck
        if not isinstance(curve, Stribeck) and (curve is not None or "s" in self.chart.inputs):
            raise ParameterError(
                f"stribeck is {shown(curve)}",
                place=f"chart {self.chart.name!r}",
                advice="if the chart has the input s, give its curve, stribeck=Stribeck(F_c, F_s, "
                "v_s); otherwise leave it out",
            )
        inputs = texts_of(self.inputs, f"chart {self.chart.name!r}: inputs")
        object.__setattr__(self, "inputs", inputs)
        for name in self.chart.inputs:
            if name not in SUPPLIED and name not in inputs:
                raise ParameterError(
                    f"chart {self.chart.name!r} needs the input {name!r}",
                    advice=f"a model supplies {', '.join(SUPPLIED)}; give inputs={{{name!r}: ...}}",
                )
        if not isinstance(self.values, Mapping):
            raise ParameterError(
                "it must give a number for each parameter of the chart, for example {'k': 1.0}",
                place="values",
                value=self.values,
            )
        check_names(self.chart.parameters, self.values, f"chart {self.chart.name!r}")
        check_bank(self.chart, self.n, f"chart {self.chart.name!r}")
        if len(self.chart.velocities) > 1:
            raise ParameterError(
                f"its velocities are {', '.join(self.chart.velocities)}, and a rig has only one",
                place=f"chart {self.chart.name!r}",
                advice="use it in a System, Contact(name, chart, values, v=(...))",
            )
        values = checked_values(self.chart.parameters, self.values, self.n)
        object.__setattr__(self, "values", values)
        sigma_2 = checked_scalar(SIGMA_2.name, self.sigma_2, SIGMA_2.rule)
        object.__setattr__(self, "sigma_2", sigma_2)
        weights: ArrayLike = np.ones(self.n) if self.weights is None else self.weights
        weights = checked_array(WEIGHTS.name, weights, self.n, WEIGHTS.rule)
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "title", self.title or self.chart.name)


def check_bank(chart: Chart, n: int, here: str) -> None:
    """Refuse banks whose elements would lock the same motion."""
    if chart.locks and n != 1:
        raise ParameterError(
            f"n is {n}, and the chart has a locked state",
            place=here,
            advice="elements that lock the same motion cannot share the force; use n = 1",
        )


def demonstration(entry: Entry, law: str = "") -> ChartModel:
    """Return a model of a built-in chart with its demonstration numbers.

    Parameters
    ----------
    entry : Entry
        From `gms_fsm.charts.registry`.
    law : str
        One of its laws; empty if it has none.

    Returns
    -------
    ChartModel
        With as many elements as there are numbers.

    Raises
    ------
    ParameterError
        If a law is missing or unknown.

    Examples
    --------
    >>> from gms_fsm.charts.registry import entry
    >>> demonstration(entry("gms"), "signed").n
    4
    """
    given = entry.demonstration
    numbers: dict[str, Any] = {"values": given.values, "weights": given.weights}
    return ChartModel(
        entry.chart(law),
        **numbers,
        n=given.n,
        stribeck=given.stribeck,
        sigma_2=given.sigma_2,
        inputs=given.inputs,
    )


# --------------------------------------------------------------------------- varying
def parameters_of(model: Model) -> tuple[Parameter, ...]:
    """Return the parameters that `with_values` can vary in a model.

    Parameters
    ----------
    model : Model
        Any model.

    Returns
    -------
    tuple of Parameter
        The chart's parameters and those shared by all models: ``sigma_2`` and, if there is a
        Stribeck curve, its parameters and the weights.

    Examples
    --------
    >>> [each.unit for each in parameters_of(GMS(GMSParameters.paper("stick-slip"), law="signed"))]
    ['N/m', 'Ns/m', 'm/s', 'm/s', 'm/N', 'Ns/m', 'N', 'N', 'm/s', '1']
    """
    every = with_shared(model.chart.parameters, curve=model.stribeck is not None)
    fixed = isinstance(model, LuGre)  # its bristle uses the curve unweighted
    return tuple(adapted(each, model.chart) for each in every if not (fixed and each == WEIGHTS))


def parameter_names(model: Model) -> tuple[str, ...]:
    """Return the names that `with_values` accepts for a model.

    Parameters
    ----------
    model : Model
        Any model.

    Returns
    -------
    tuple of str
        The names from `parameters_of`.

    Examples
    --------
    >>> parameter_names(GMS(GMSParameters.paper("stick-slip"), law="signed"))
    ('k', 'sigma', 'C', 'v_c', 'weights', 'sigma_2', 'F_c', 'F_s', 'v_s', 'delta')
    """
    return tuple(each.name for each in parameters_of(model))


def with_values(model: Model, values: Mapping[str, ArrayLike]) -> Model:
    """Return a model with some of its parameters replaced.

    Parameters
    ----------
    model : GMS, LuGre or ChartModel
        The model that supplies all other parameters.
    values : mapping
        By a name from `parameter_names`; a single number applies to all elements. Other names are
        ignored. A chart's own parameter takes precedence over a shared one of the same name.

    Returns
    -------
    Model
        A new model, checked.

    Raises
    ------
    ParameterError
        If a value violates its rule.

    Examples
    --------
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> with_values(model, {"k": 2.0, "F_s": 1.0}).values["k"].tolist()
    [2.0, 2.0, 2.0, 2.0]
    """

    def number(name: str, old: float) -> float:
        return checked_scalar(name, values.get(name, old), "finite")

    def array(name: str, old: float | FloatArray) -> FloatArray:
        given = as_numbers(name, values.get(name, old))
        return (
            checked_array(name, given, model.n, "finite") if given.ndim else given.repeat(model.n)
        )

    own_names = model.values
    common = {name for name in values if name not in own_names}
    stribeck = model.stribeck
    if stribeck is not None and common & {each.name for each in STRIBECK}:
        numbers = vars(stribeck).items()
        stribeck = Stribeck(**{u: number(u, v) if u in common else v for u, v in numbers})
    sigma_2 = number("sigma_2", model.sigma_2) if "sigma_2" in common else model.sigma_2
    shared: Any = {"stribeck": stribeck, "sigma_2": sigma_2}
    if isinstance(model, LuGre):
        own: Any = {name: number(name, float(value)) for name, value in model.values.items()}
        return LuGre(**own, **shared)
    if isinstance(model, GMS):
        new_ones = {
            each.name: array(each.name, 0.0) if each.per_element else number(each.name, 0.0)
            for each in (*model.chart.parameters, WEIGHTS)
            if each.name in values
        }
        return GMS(model.parameters.replaced(**new_ones, **shared), law=model.law)
    fixed = stribeck is None or "weights" in own_names
    weights = model.weights if fixed else array("weights", model.weights)
    new = {
        name: number(name, value) if isinstance(value, float) else array(name, value)
        for name, value in model.values.items()
    }
    kept: Any = {"title": model.title, "inputs": getattr(model, "inputs", {})}
    return ChartModel(model.chart, new, n=model.n, weights=weights, **kept, **shared)
