"""What is exported, in the same form whatever it was given as."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gms_fsm._arguments import checked_kind
from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._names import slug
from gms_fsm.run._steppable import alone, begin, start_of, start_of_system
from gms_fsm.run.settings import Settings
from gms_fsm.run.start import Start
from gms_fsm.systems.models import Model
from gms_fsm.systems.signals import Corners
from gms_fsm.systems.system import Contact, System

__all__ = ["Subject"]


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
    given : System, Contact or Chart
        A system; or one friction, whose velocity is an input; or a chart without numbers.
    initial : mapping or None
        As given.
    t_start : float
        s.
    settings : Settings
        Method and tolerances.
    t_end : float or None
        s: the end of a run, for formats that contain one.
    """

    name: str
    title: str
    format: str
    given: System | Contact | Chart
    initial: Mapping[str, Any] | None
    t_start: float
    settings: Settings
    t_end: float | None = None

    @classmethod
    def of(
        cls,
        given: System | Model | Contact | Chart,
        format: str,  # noqa: A002
        *,
        name: str = "",
        initial: Mapping[str, Any] | None = None,
        t_start: float = 0.0,
        settings: Settings | None = None,
        t_end: float | None = None,
    ) -> Subject:
        """Check what is exported; see `gms_fsm.export`."""
        what: System | Contact | Chart
        if isinstance(given, System | Contact | Chart):
            what = given
        elif isinstance(getattr(given, "chart", None), Chart):
            what = Contact("friction", given)
        else:
            raise ParameterError(
                "it must be a system, a model, a contact or a chart, for example "
                "GMS(parameters, law='signed')",
                place="system",
                value=given,
            )
        checked_kind("name", name, str, "a text")
        kind = "system" if isinstance(what, System) else "chart"
        title = what.chart.name if isinstance(what, Contact) else what.name
        chosen = name or slug(title, f"{kind} {title!r}")
        used = Settings() if settings is None else settings
        checked_kind("settings", used, Settings, "Settings(...)")
        if initial is not None:
            checked_kind("initial", initial, Mapping, "a mapping")
        begin(t_start)
        return cls(chosen, title, format, what, initial, t_start, used, t_end)

    @property
    def chart(self) -> Chart:
        """Its chart.

        Raises
        ------
        ParameterError
            If it is a system.
        """
        if isinstance(self.given, System):
            raise self._refused_system("a chart")
        return self.given if isinstance(self.given, Chart) else self.given.chart

    @property
    def contact(self) -> Contact:
        """One friction whose velocity is an input.

        Raises
        ------
        ParameterError
            If it is a system, or a chart without numbers, or a friction that needs more than its
            velocity.
        """
        if isinstance(self.given, System):
            raise self._refused_system("one friction, whose velocity is an input")
        return alone(self._with_numbers())

    @functools.cached_property
    def start(self) -> Start:
        """A system whose inputs are straight lines during each call: records, or the velocity.

        Raises
        ------
        ParameterError
            If it cannot be stepped; what is in the way is named.
        """
        if isinstance(self.given, System):
            return start_of_system(self.given, self.t_start, self.initial, self.settings)
        given, settings = self._with_numbers(), self.settings
        return start_of(given, self.t_start, self.initial, settings.rtol, settings=settings)

    @functools.cached_property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs of `start`."""
        signals = self.start.system.signals
        return tuple(name for name, each in signals.items() if isinstance(each, Corners))

    def _with_numbers(self) -> Contact:
        if isinstance(self.given, Chart):
            raise ParameterError(
                f"format {self.format!r} needs numbers",
                place=f"chart {self.given.name!r}",
                advice="give a model, for example ChartModel(chart, values), or a scenario file",
            )
        assert isinstance(self.given, Contact)
        return self.given

    def _refused_system(self, what: str) -> ParameterError:
        assert isinstance(self.given, System)
        names = [each.name for each in self.given.contacts]
        some = names[0] if names else "contact"
        return ParameterError(
            f"format {self.format!r} expresses {what}, not a system of bodies",
            place=f"system {self.given.name!r}",
            advice=f"export one contact, such as system.contact({some!r}) (--contact {some})",
        )
