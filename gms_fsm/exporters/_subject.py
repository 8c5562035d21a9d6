"""What is exported, in the same form whatever it was given as."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gms_fsm.charts.chart import Chart
from gms_fsm.coupling.compensator import Compensator
from gms_fsm.coupling.steppable import alone, start_of, start_of_system
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._names import slug
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
from gms_fsm.run.stepped.beginning import begin
from gms_fsm.systems.models import Model
from gms_fsm.systems.signals import Corners
from gms_fsm.systems.system import Contact, System


@dataclass(frozen=True, eq=False)
class Subject:
    """What is exported.

    Parameters
    ----------
    name : str
        Of the files and of what is defined in them.
    title : str
        For people.
    format : str
        Name of the format, for messages.
    whole : System or None
        None if one friction is exported, whose velocity is an input.
    friction : Contact or None
        None if it has no numbers, or a system is exported.
    own_chart : Chart or None
        Of the one friction.
    initial : mapping or None
        As given.
    t_start : float
        s.
    settings : Settings
        Method and tolerances.
    t_end : float or None
        s: the end of a run, for formats that contain one.
    compensator : Compensator or None
        What calls the one friction.
    """

    name: str
    title: str
    format: str
    whole: System | None
    friction: Contact | None
    own_chart: Chart | None
    initial: Mapping[str, Any] | None
    t_start: float
    settings: Settings
    t_end: float | None = None
    compensator: Compensator | None = None

    @classmethod
    def of(
        cls,
        given: System | Model | Contact | Chart | Compensator,
        format: str,  # noqa: A002
        *,
        name: str = "",
        initial: Mapping[str, Any] | None = None,
        t_start: float = 0.0,
        settings: Settings | None = None,
        t_end: float | None = None,
    ) -> Subject:
        """Check what is exported; see `gms_fsm.export`."""
        compensator, friction_of = (
            (given, given.model) if isinstance(given, Compensator) else (None, given)
        )
        if compensator is not None and initial is None:
            initial = compensator.initial
        whole, friction, chart = _parts(friction_of)
        checked_kind("name", name, str, "a text")
        kind, named = ("chart", chart) if whole is None else ("system", whole)
        assert named is not None
        chosen = name or slug(named.name, f"{kind} {named.name!r}")
        used = Settings() if settings is None else settings
        checked_kind("settings", used, Settings, "Settings(...)")
        if initial is not None:
            checked_kind("initial", initial, Mapping, "a mapping")
        begin(t_start)
        more = (initial, t_start, used, t_end, compensator)
        return cls(chosen, named.name, format, whole, friction, chart, *more)

    @property
    def chart(self) -> Chart:
        """Its chart.

        Raises
        ------
        ParameterError
            If it is a system.
        """
        if self.own_chart is None:
            raise self._refused_system("a chart")
        return self.own_chart

    @property
    def alone(self) -> bool:
        """Whether it is one friction, which names need not tell from others."""
        return self.whole is None

    @property
    def contact(self) -> Contact:
        """One friction whose velocity is an input.

        Raises
        ------
        ParameterError
            If it is a system, or a chart without numbers, or a friction that needs more than its
            velocity.
        """
        found = self.numbers
        if found is None:
            raise ParameterError(
                f"format {self.format!r} needs numbers",
                place=f"chart {self.chart.name!r}",
                advice="give a model, for example ChartModel(chart, values), or a scenario file",
            )
        return found

    @property
    def numbers(self) -> Contact | None:
        """As `contact`; None for a chart without numbers."""
        if self.whole is not None:
            raise self._refused_system("one friction, whose velocity is an input")
        return None if self.friction is None else alone(self.friction)

    @property
    def system(self) -> System:
        """The system, or one in which a friction has its velocity as an input."""
        return self.start.system if self.whole is None else self.whole

    @functools.cached_property
    def start(self) -> Problem:
        """A system whose inputs are straight lines during each call: records, or the velocity.

        Raises
        ------
        ParameterError
            If it cannot be stepped; what is in the way is named.
        """
        settings = self.settings
        if self.whole is None:
            given = (self.contact, self.t_start, self.initial, settings.rtol)
            return start_of(*given, settings=settings)
        return start_of_system(self.whole, self.t_start, self.initial, settings)

    @functools.cached_property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs of `start`."""
        signals = self.start.system.signals
        return tuple(name for name, each in signals.items() if isinstance(each, Corners))

    def _refused_system(self, what: str) -> ParameterError:
        names = [each.name for each in self.system.contacts]
        some = names[0] if names else "contact"
        return ParameterError(
            f"format {self.format!r} expresses {what}, not a system of bodies",
            place=f"system {self.title!r}",
            advice=f"export one contact, such as system.contact({some!r}) (--contact {some})",
        )


def _parts(
    given: System | Model | Contact | Chart,
) -> tuple[System | None, Contact | None, Chart | None]:
    """Return the system, or the friction and its chart: the only place that asks what was given."""
    match given:
        case System():
            return given, None, None
        case Contact():
            return None, given, given.chart
        case Chart():
            return None, None, given
    if isinstance(getattr(given, "chart", None), Chart):
        return None, Contact("friction", given), given.chart
    raise ParameterError(
        "it must be a system, a model, a contact or a chart, for example "
        "GMS(parameters, law='signed')",
        place="system",
        value=given,
    )
