"""The models on the bench: those of the registry, and any model or contact of the user's own."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.charts.chart import SUPPLIED, Chart
from gms_fsm.charts.gms import gms_element
from gms_fsm.charts.registry import Entry, registered
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ParameterError, shown
from gms_fsm.phenomena._bench import Bench, Motion, run
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.models import ChartModel, Model
from gms_fsm.systems.system import Contact

__all__ = ["Specimen", "specimens_of"]

NOT_FRICTION = {
    "backlash": "backlash is play with elastic flanks, not friction",
    "end-stop": "an end stop transmits a force on one side only and is not friction",
    "dog-clutch": "a dog clutch is locked or open by time and has no friction force of its own",
}
V_C = 1e-8  # m/s: far below the speed of the slowest ramp in pre-sliding, rate / sigma_0 = 1e-6 m/s
C = 50.0  # N/s: in slip the friction follows the Stribeck curve with the time constant F / C


@dataclass(frozen=True, eq=False)
class Specimen:
    """A model to be put on the bench.

    Parameters
    ----------
    name, title : str
        In tables and in pictures.
    contact : Contact or None
        Called ``friction``, on the velocity ``v``; None if the model does not take part.
    bench : Bench
        Numbers of the signals.
    why_not : str
        Why it does not take part.
    """

    name: str
    title: str
    contact: Contact | None
    bench: Bench
    why_not: str = ""

    def run(self, motion: Motion, t_end: float, t_eval: Any = None) -> Any:
        """Run it; see `gms_fsm.phenomena._bench.run`."""
        assert self.contact is not None
        return run(self.contact, self.bench, motion, t_end, t_eval)

    @functools.cached_property
    def break_away(self) -> float:
        """Break-away force at the slowest rate, N; the forces of other experiments refer to it."""
        from gms_fsm.phenomena._break_away import RATES, pulled

        return pulled(self, RATES[0] * self.bench.F_s).force


def bench_bank(bench: Bench, n: int) -> GMSParameters:
    """Return GMS elements with the numbers of the bench.

    Parameters
    ----------
    bench : Bench
        Sum of the stiffness, damping and Stribeck curve.
    n : int
        Number of elements: equal shares of the friction; each has half the stiffness of the one
        before, so that they break away one after another.

    Returns
    -------
    GMSParameters
        The numbers.
    """
    share = 0.5 ** np.arange(n)
    share /= share.sum()
    return GMSParameters.from_shares(
        np.full(n, 1.0 / n),
        share * bench.sigma_0,
        C=C,
        stribeck=Stribeck(bench.F_c, bench.F_s, bench.v_s),
        v_c=V_C,
        sigma=share * bench.sigma_1,
        sigma_2=bench.sigma_2,
    )


def _gms(entry: Entry, law: str, bench: Bench) -> ChartModel:
    p = bench_bank(bench, entry.demonstration.n)
    return ChartModel(
        gms_element(law),  # type: ignore[arg-type]
        {"k": p.k, "sigma": p.sigma, "C": p.C, "v_c": p.v_c},
        n=p.n,
        stribeck=p.stribeck,
        sigma_2=p.sigma_2,
        weights=p.weights,
        title=f"GMS, {p.n} elements, {law} law",
    )


def _lugre(entry: Entry, law: str, bench: Bench) -> ChartModel:
    return ChartModel(
        entry.chart(law),
        {"sigma_0": bench.sigma_0, "sigma_1": bench.sigma_1},
        stribeck=Stribeck(bench.F_c, bench.F_s, bench.v_s),
        sigma_2=bench.sigma_2,
        title="LuGre",
    )


# The demonstrations of these are the paper's columns; the bench gives them its own numbers.
RENUMBERED: Mapping[str, Callable[[Entry, str, Bench], ChartModel]] = {"gms": _gms, "lugre": _lugre}


def specimens_of(
    models: Iterable[str] | Mapping[str, Model | Contact] | None, bench: Bench
) -> tuple[Specimen, ...]:
    """Return the models to be compared.

    Parameters
    ----------
    models : iterable of str, mapping, or None
        Names of included charts; or models or contacts by a name; None for all included charts.
    bench : Bench
        Numbers of the signals.

    Returns
    -------
    tuple of Specimen
        In this order.

    Raises
    ------
    ParameterError
        If there is no such chart, or a model of the user's own cannot be put on the bench.
    """
    if isinstance(models, Mapping):
        return tuple(_own(name, model, bench) for name, model in models.items())
    known = {
        "-".join(filter(None, (each.name, law))): (each, law)
        for each in registered().values()
        if not each.wrong
        for law in each.laws or ("",)
    }
    names = known if models is None else [models] if isinstance(models, str) else list(models)
    for name in names:
        if name not in known:
            raise ParameterError(
                f"there is no model {shown(name)}", advice=f"there are {', '.join(known)}"
            )
    return tuple(_included(name, *known[name], bench) for name in names)


def _included(name: str, entry: Entry, law: str, bench: Bench) -> Specimen:
    chart = entry.chart(law)
    title = chart.name
    why_not = NOT_FRICTION.get(entry.name, "") or unfit(chart)
    if why_not:
        return Specimen(name, title, None, bench, why_not)
    given = entry.demonstration
    if entry.name in RENUMBERED:
        model = RENUMBERED[entry.name](entry, law, bench)
        return Specimen(name, model.title, Contact("friction", model), bench)
    inputs = normal_force(chart, given.values, bench)
    if inputs:
        contact = Contact("friction", chart, given.values, n=given.n, inputs=inputs)
        return Specimen(name, title, contact, bench)
    numbers: Any = {"values": given.values, "weights": given.weights}
    model = ChartModel(
        chart, **numbers, n=given.n, stribeck=given.stribeck, sigma_2=given.sigma_2
    )
    return Specimen(name, title, Contact("friction", model), bench)


def unfit(chart: Chart) -> str:
    """Return why a chart cannot be put on the bench.

    Parameters
    ----------
    chart : Chart
        Any chart.

    Returns
    -------
    str
        Empty if it can.
    """
    if len(chart.velocities) > 1:
        along = ", ".join(chart.velocities)
        return f"it moves along {along}; the bench has one direction"
    unknown = [name for name in chart.inputs if name not in (*SUPPLIED, "N")]
    if unknown:
        return f"it reads the input {unknown[0]}, which the bench does not supply"
    return ""


def normal_force(chart: Chart, values: Mapping[str, Any], bench: Bench) -> dict[str, float]:
    """Return the constant normal force for a chart that reads one.

    Parameters
    ----------
    chart : Chart
        Any chart.
    values : mapping
        Its parameters; with a coefficient ``mu`` the friction mu N is F_c.
    bench : Bench
        With N and F_c.

    Returns
    -------
    dict of str to float
        The input N; empty for other charts.
    """
    if "N" not in chart.inputs:
        return {}
    coefficient = float(np.mean(values["mu"])) if "mu" in values else 0.0
    return {"N": bench.F_c / coefficient if coefficient > 0.0 else bench.N}


def _own(name: str, model: Model | Contact, bench: Bench) -> Specimen:
    if not isinstance(model, Contact):
        if not hasattr(model, "chart") or not hasattr(model, "weights"):
            raise ParameterError(
                "it must be a model such as GMS(parameters, law='signed'), or a Contact",
                place=f"models[{name!r}]",
                value=model,
            )
        return Specimen(name, model.title, Contact("friction", model), bench)
    why_not = unfit(model.chart)
    missing = [each for each in model.inputs if each not in (*SUPPLIED, "N")]
    if why_not and not missing:
        raise ParameterError(why_not, place=f"models[{name!r}]")
    inputs = {**normal_force(model.chart, model.values, bench), **model.inputs}
    for each, text in inputs.items():
        if not isinstance(text, int | float):
            raise ParameterError(
                f"the input {each} of its contact is {shown(text)}",
                place=f"models[{name!r}]",
                advice="on the bench an input must be a number",
            )
    if model.model is not None:
        contact = Contact("friction", model.model, inputs=inputs)
    else:
        contact = Contact("friction", model.chart, model.values, n=model.n, inputs=inputs)
    return Specimen(name, model.chart.name, contact, bench)
