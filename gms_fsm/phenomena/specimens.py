"""The models on the bench: those of the registry, and any model or contact of the user's own."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.registry import Entry, registered
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ExpressionError, ParameterError, shown
from gms_fsm.foundation.arguments import checked_kind, listed, unknown
from gms_fsm.language import parse_value
from gms_fsm.phenomena._bench import Bench, BenchMotion, run
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.models import ChartModel, Model, demonstration, is_model
from gms_fsm.systems.system import Contact

# Charts that do not take part, with the reason.
UNFIT = {
    "backlash": "backlash is play with elastic flanks, not friction",
    "end-stop": "an end stop transmits a force on one side only and is not friction",
    "prandtl-tomlinson": "its force is the slope of a periodic potential plus damping: it has no "
    "pre-sliding of its own, and the period of the potential sets the scale of all signals",
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

    def run(self, motion: BenchMotion, t_end: float, t_eval: Any = None) -> Any:
        """Run it; see `gms_fsm.phenomena._bench.run`."""
        assert self.contact is not None
        return run(self.contact, self.bench, motion, t_end, t_eval)

    @functools.cached_property
    def break_away(self) -> float:
        """Break-away force at the slowest rate, N; the forces of other experiments refer to it."""
        from gms_fsm.phenomena._break_away import RATES, pulled

        return pulled(self, RATES[0] * self.bench.F_s).force


def bench_bank(bench: Bench, n: int) -> GMSParameters:
    """Return GMS elements with the numbers of the bench."""
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
        entry.chart(law),
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


# The demonstrations of these are on scales of their own, such as the paper's columns; the bench
# gives them its numbers. All others run with those of their demonstration.
RENUMBERED: Mapping[str, Callable[[Entry, str, Bench], ChartModel]] = {
    "gms": _gms,
    "lugre": _lugre,
}


def specimens_of(
    models: Iterable[str] | Mapping[str, str | Model | Contact] | None, bench: Bench
) -> tuple[Specimen, ...]:
    """Return the models to be compared."""
    known = {
        "-".join(filter(None, (each.name, law))): (each, law)
        for each in registered().values()
        if not each.wrong
        for law in each.laws or ("",)
    }
    given: Mapping[str, str | Model | Contact]
    if isinstance(models, Mapping):
        given = models
    elif isinstance(models, str):
        given = {models: models}
    else:
        names = (
            known if models is None else listed("models", models, "names of models, or a mapping")
        )
        given = {checked_kind("models", name, str, "names of models"): name for name in names}
    found = []
    for name, model in given.items():
        if not isinstance(model, str):
            found.append(_own(name, model, bench))
        elif model in known:
            found.append(_included(name, *known[model], bench))
        else:
            raise unknown("model", model, known)
    return tuple(found)


def _included(name: str, entry: Entry, law: str, bench: Bench) -> Specimen:
    chart = entry.chart(law)
    why_not = UNFIT.get(entry.name, "") or unfit(chart)
    if why_not:
        return Specimen(name, chart.name, None, bench, why_not)
    make = RENUMBERED.get(entry.name)
    try:
        model = demonstration(entry, law) if make is None else make(entry, law, bench)
    except ParameterError as error:  # it reads an input for which there is no number
        return Specimen(name, chart.name, None, bench, str(error))
    return Specimen(name, model.title, Contact("friction", model), bench)


def unfit(chart: Chart) -> str:
    """Return why a chart cannot be put on the bench."""
    if len(chart.velocities) > 1:
        along = " and ".join(chart.velocities)
        return f"it moves along {along}, and the bench has one direction"
    return ""


def _own(name: str, model: Model | Contact, bench: Bench) -> Specimen:
    if not isinstance(model, Contact):
        if not is_model(model):
            raise ParameterError(
                "it must be a model such as GMS(parameters, law='signed'), or a Contact",
                place=f"models[{name!r}]",
                value=model,
            )
        return Specimen(name, model.title, Contact("friction", model), bench)
    if why_not := unfit(model.chart):
        raise ParameterError(why_not, place=f"models[{name!r}]")
    for each, text in model.inputs.items():
        if not _constant(text):
            raise ParameterError(
                f"the input {each} of its contact is {shown(text)}",
                place=f"models[{name!r}]",
                advice="on the bench an input must be a number",
            )
    inputs = dict(model.inputs)
    if model.model is not None:
        contact = Contact("friction", model.model, inputs=inputs)
    else:
        contact = Contact("friction", model.chart, model.values, n=model.n, inputs=inputs)
    return Specimen(name, model.chart.name, contact, bench)


def _constant(text: Any) -> bool:
    try:
        parse_value(str(text), ())
    except ExpressionError:
        return False
    return True
