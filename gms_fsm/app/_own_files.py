"""Files of the user's own where a verb takes a chart: a chart file, or a system that has charts."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gms_fsm.app.scenario import kind_of, load_scenario, load_system
from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.toml import parsed
from gms_fsm.scenarios import scenario_path
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import System, system_of
from gms_fsm.verification.facts import ContactFacts, facts_of


@dataclass(frozen=True)
class OwnFile:
    """What a file describes: a chart, or a system.

    Parameters
    ----------
    path : Path
        The file.
    chart : Chart or None
        The chart of a chart file.
    system : System or None
        The system of a system file, or of a scenario file, also of a model on a rig.
    """

    path: Path
    chart: Chart | None = None
    system: System | None = None

    @functools.cached_property
    def run(self) -> Mapping[str, Any]:
        """The run of a scenario file, as arguments of `gms_fsm.simulate`; else empty."""
        data = parsed(self.path)
        kind = kind_of(data)
        if kind == "rig" or (kind == "system" and "run" in data):
            return load_scenario(self.path).arguments
        return {}

    def charts(self, contact: str = "") -> dict[str, Chart]:
        """Return its charts."""
        return {names: each.chart for names, each in self.facts(contact).items()}

    def facts(self, contact: str = "") -> dict[str, ContactFacts]:
        """Return its charts, with what a run makes of them; contacts alike stand together."""
        if self.chart is not None:
            if contact:
                raise ParameterError(
                    "it is a chart file, which has no contacts",
                    place=f"--contact {contact}: {self.path}",
                    advice="leave --contact out",
                )
            return {self.path.stem: facts_of(self.chart)}
        assert self.system is not None
        chosen = [self.system.contact(contact)] if contact else self.system.machines
        found: list[tuple[list[str], ContactFacts]] = []
        for each in chosen:
            facts = facts_of(self.system, each.name)
            names = next((names for names, other in found if other == facts), None)
            if names is None:
                found.append(([each.name], facts))
            else:
                names.append(each.name)
        return {", ".join(names): facts for names, facts in found}

    def only_model(self, contact: str = "") -> Model:
        """Return the model of its contact."""
        if self.system is None:
            raise ParameterError(
                "it is a chart file, which has no numbers",
                place=str(self.path),
                advice="give a scenario file",
            )
        several = self.system.machines
        if len(several) > 1 and not contact:
            raise contacts_error(self.path, [each.name for each in several], "give")
        chosen: Any = self.system.contact(contact) if contact else several[0]
        single: Model = chosen if len(several) > 1 or chosen.model is None else chosen.model
        return single

    def only_chart(self, contact: str = "") -> Chart:
        """Return its chart."""
        first, *others = self.charts(contact).values()
        if any(each != first for each in others):
            assert self.system is not None
            names = [each.name for each in self.system.machines]
            raise contacts_error(self.path, names, "give", ", with different charts")
        return first


def contacts_error(path: Path, names: Sequence[str], advice: str, more: str = "") -> ParameterError:
    """Return what is said of a file with several contacts, one of which must be chosen."""
    return ParameterError(
        f"it has the contacts {', '.join(map(repr, names))}{more}",
        place=str(path),
        advice=f"{advice} --contact {names[0]}",
    )


def own_file(name: str, law: str = "") -> OwnFile | None:
    """Return what a file describes, if a name on the command line is that of a file."""
    path = scenario_path(name)
    if path.suffix != ".toml" and not (len(path.parts) > 1 and path.exists()):
        return None
    if law:
        raise ParameterError(f"{name} is a file, which takes no --law", advice="leave --law out")
    kind = kind_of(parsed(path)) or "chart"
    if kind == "chart":
        return OwnFile(path, chart=Chart.load(path))
    if kind == "system":
        return OwnFile(path, system=load_system(path))
    loaded = load_scenario(path)
    period = loaded.arguments.get("step") if loaded.scenario.run.events == "held" else None
    return OwnFile(path, system=system_of(loaded.model, loaded.rig, period))
