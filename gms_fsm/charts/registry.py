"""The built-in charts, discovered by scanning this folder, so that a new chart needs only one file.

A module of `gms_fsm.charts` is discovered if it has a tuple ``CHARTS`` of entries. The command
line, the scenario files and the documentation then know its charts by name.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import Parameter, check_names, checked_values
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ChartError, GMSError, ParameterError, shown, why
from gms_fsm.foundation.arguments import unknown

__all__ = ["Demonstration", "Entry", "chart_named", "charts", "entry", "registered"]

# Keys of a scenario's table [model] that are not parameters.
KEYS = ("chart", "law", "n", "stribeck", "inputs")


@dataclass(frozen=True)
class Demonstration:
    """Numbers with which to try out a chart; the same as `ChartModel` takes.

    Parameters
    ----------
    values : mapping of str to float or tuple of float
        A number, or one per element, for each parameter of the chart.
    source : str
        Where they are published, or ``"chosen by us"``.
    stribeck : Stribeck, optional
        The curve behind the input ``s``; None for charts without that input.
    sigma_2 : float
        Viscous friction, Ns/m.
    weights : tuple of float, optional
        Threshold weights, m/N; 1 if omitted.
    inputs : mapping of str to str
        What the chart's other inputs are, over t: a normal force ``{"N": "10"}``.
    """

    values: Mapping[str, float | tuple[float, ...]]
    source: str
    stribeck: Stribeck | None = None
    sigma_2: float = 0.0
    weights: tuple[float, ...] | None = None
    inputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """Number of elements: the length of the longest list."""
        lists = [self.weights or (), *self.values.values()]
        return max((len(each) for each in lists if isinstance(each, tuple)), default=0) or 1


@dataclass(frozen=True)
class Entry:
    """A chart as known to the command line, scenario files and tables.

    Parameters
    ----------
    name : str
        For example ``"lugre"``.
    charts : Chart or mapping of str to Chart
        The chart; for a model with several laws, one chart per law, by the law's name.
    demonstration : Demonstration
        Numbers with which to try it out.
    title : str, optional
        The chart's name if omitted.
    wrong : str, optional
        What is wrong with it, for a chart that demonstrates a fault.
    domain : sequence of str, optional
        What a proof assumes; `gms_fsm.verification.prove.default_domain` if omitted.

    Raises
    ------
    ChartError
        If the charts' inputs and parameters differ, or the demonstration does not fit them.

    Examples
    --------
    >>> entry("gms").laws
    ('signed', 'published')
    """

    name: str
    charts: Chart | Mapping[str, Chart]
    demonstration: Demonstration
    title: str = ""
    wrong: str = ""
    domain: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        here = f"entry {shown(self.name)}"
        charts = [self.charts] if isinstance(self.charts, Chart) else list(self.charts.values())
        if not charts:
            raise ChartError("it has no chart", place=here, advice="give one")
        first = charts[0]
        object.__setattr__(self, "title", self.title or first.name)
        for other in charts[1:]:
            if (other.inputs, other.parameters) != (first.inputs, first.parameters):
                raise ChartError(
                    f"{first.name!r} and {other.name!r} have different inputs or parameters",
                    place=here,
                    advice="give each its own entry",
                )
        for name in KEYS:
            if name in first.parameter_names:
                raise ChartError(
                    f"the parameter {name!r} has the name of a key of scenario files",
                    place=here,
                    advice="rename it",
                )
        self._check_demonstration()

    def _check_demonstration(self) -> None:
        here, given = f"entry {shown(self.name)}, demonstration", self.demonstration
        check_names(self._any.parameters, given.values, here, ChartError)
        if self.curve != (given.stribeck is not None):
            raise ChartError(
                f"stribeck is {shown(given.stribeck)}",
                place=here,
                advice="a chart with the input s takes a curve, Stribeck(F_c, F_s, v_s); any "
                "other chart takes none",
            )
        try:
            checked_values(self._any.parameters, given.values, given.n)
        except ParameterError as error:
            raise ChartError.of(error).inside(here) from None

    @property
    def _any(self) -> Chart:
        return self.charts if isinstance(self.charts, Chart) else next(iter(self.charts.values()))

    @property
    def laws(self) -> tuple[str, ...]:
        """Names of the laws to choose from; empty if there is only one chart."""
        return () if isinstance(self.charts, Chart) else tuple(self.charts)

    @property
    def curve(self) -> bool:
        """Whether its charts need a Stribeck curve."""
        return "s" in self._any.inputs

    @property
    def inputs(self) -> tuple[str, ...]:
        """The inputs of its charts."""
        return self._any.inputs

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters of its charts."""
        return self._any.parameters

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self._any.parameter_names

    def chart(self, law: str = "") -> Chart:
        """Return the chart for a law.

        Parameters
        ----------
        law : str
            One of `laws`; empty if there are none.

        Returns
        -------
        Chart
            The chart.

        Raises
        ------
        ParameterError
            If a law is missing or unknown.
        """
        if isinstance(self.charts, Chart):
            if law:
                raise ParameterError(
                    f"{self.name} has only one law", advice=f"leave out law={law!r}"
                )
            return self.charts
        if law not in self.charts:
            raise ParameterError(
                f"{self.name} has {' and '.join(map(repr, self.laws))}, which differ",
                place="law",
                value=law,
                advice="choose one",
            )
        return self.charts[law]


@functools.cache
def registered() -> Mapping[str, Entry]:
    """Return the built-in charts by name; those that demonstrate a fault come last.

    Returns
    -------
    mapping of str to Entry
        The contents of ``CHARTS`` in the modules of this folder.

    Raises
    ------
    ChartError
        If a module cannot be imported, or two of them use the same name.

    Examples
    --------
    >>> registered()["gms"].title
    'Generalized Maxwell Slip element'
    """
    found: dict[str, tuple[Entry, str]] = {}
    for module in registered_modules():
        place = f"{module.replace('.', '/')}.py"
        for each in _entries(module, place):
            if each.name in found:
                raise ChartError(
                    f"the name {each.name!r} is already used by {found[each.name][1]}",
                    place=place,
                    advice="choose another",
                )
            found[each.name] = each, place
    entries = sorted((each for each, _ in found.values()), key=lambda each: bool(each.wrong))
    return {each.name: each for each in entries}


def charts() -> Mapping[str, Chart]:
    """Return the charts that are models, without those that demonstrate a fault.

    Returns
    -------
    mapping of str to Chart
        By the name of the entry; with several laws, one per law: ``"gms-signed"``.

    Examples
    --------
    >>> charts()["gms-signed"].name
    'GMS element, signed law'
    """
    return {
        "-".join(filter(None, (each.name, law))): each.chart(law)
        for each in registered().values()
        if not each.wrong
        for law in each.laws or ("",)
    }


def domain_of(chart: Chart) -> tuple[str, ...] | None:
    """Return what a proof of a chart assumes, if it is an included one that says so."""
    for each in registered().values():
        if chart in [each.chart(law) for law in each.laws or ("",)]:
            return each.domain
    return None


def registered_modules() -> list[str]:
    """Return the modules of this folder and of those in it, by the last part of their names."""
    found = pkgutil.walk_packages(sys.modules["gms_fsm.charts"].__path__, "gms_fsm.charts.")
    return sorted((each.name for each in found), key=lambda name: name.rpartition(".")[2])


def _entries(module: str, place: str) -> tuple[Entry, ...]:
    try:
        page: Any = importlib.import_module(module)
    except GMSError as error:
        raise ChartError.of(error).inside(place) from error
    except Exception as error:
        raise ChartError(
            f"it cannot be imported ({why(error)})", place=place, advice="fix it"
        ) from error
    entries = getattr(page, "CHARTS", ())
    if not isinstance(entries, tuple) or not all(isinstance(each, Entry) for each in entries):
        raise ChartError(
            f"CHARTS is {shown(entries)}", place=place, advice="it must be a tuple of Entry(...)"
        )
    return entries


def entry(name: str) -> Entry:
    """Return a built-in chart.

    Parameters
    ----------
    name : str
        For example ``"gms"``.

    Returns
    -------
    Entry
        Its charts and numbers.

    Raises
    ------
    ParameterError
        If there is no chart of that name.

    Examples
    --------
    >>> entry("lugre").chart().default_state.name
    'bristle'
    """
    if name not in registered():
        raise unknown("model", name, registered())
    return registered()[name]


def chart_named(name: str) -> Chart:
    """Return an included chart by name.

    Parameters
    ----------
    name : str
        As in `charts`.

    Returns
    -------
    Chart
        That one.

    Raises
    ------
    ParameterError
        If there is none.

    Examples
    --------
    >>> chart_named("lugre").default_state.name
    'bristle'
    """
    known = charts()
    if name not in known:
        error = unknown("chart", name, known)
        raise error.replaced(advice=f"{error.advice}; the name of a chart file ends in .toml")
    return known[name]
