"""The verb that hands friction over to other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gms_fsm.app.verbs.console import note, put
from gms_fsm.app.verbs.options import ContactName, Law
from gms_fsm.errors import ParameterError

if TYPE_CHECKING:
    from gms_fsm import Chart, Contact, Model, System


SETTINGS = ("method", "step", "rtol", "atol", "max_step", "max_steps", "events")  # of a scenario


def export_command(
    name: Annotated[
        str,
        typer.Argument(
            help="Name of an included chart, or a chart file, a system file or a scenario file "
            "(.toml).",
            show_default=False,
        ),
    ] = "",
    to: Annotated[str, typer.Option(help="Format; --list shows all.", show_default=False)] = "",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Output folder; <name>-<format> by default."),
    ] = None,
    called: Annotated[
        str,
        typer.Option(
            "--name", help="Name of the files and of what is defined in them.", show_default=False
        ),
    ] = "",
    law: Law = "",
    contact: ContactName = "",
    listed: Annotated[bool, typer.Option("--list", help="List the formats.")] = False,
) -> None:
    """Write friction for another program: C, JavaScript, an FMU, MATLAB, Modelica, a PLC ...

    A chart, or one contact of a system (--contact), is friction whose velocity
    is an input. The inputs of a whole system are its records.
    """
    from gms_fsm.exporters import export, formats

    known = formats()

    if listed:
        wide = max(map(len, known))
        put("\n".join(f"{each.name:<{wide}}  {each.kind}" for each in known.values()))
        return
    if not to:
        raise ParameterError(
            "no format is given", place="--to", advice=f"give one of {', '.join(known)}"
        )
    given, default, more = _given(name, law, contact)
    contacts: tuple[Contact, ...] = getattr(given, "contacts", ())
    whole = [each.name for each in known.values() if each.whole]
    supervisors: tuple[Contact, ...] = getattr(given, "supervisors", ())
    if to in known and to not in whole and supervisors:
        raise ParameterError(
            f"{to} takes friction only, and {name} has the supervisors "
            f"{', '.join(repr(each.name) for each in supervisors)}",
            place="--to",
            advice=f"give one of {', '.join(whole)}, or the chart file of one of them",
        )
    if to in known and to not in whole and len(contacts) == 1:
        given, _, more = _given(name, law, contacts[0].name)
        note(f"{to} takes friction only: written is that of {name}, with its velocity as an input")
    if to in known:
        more = {each: value for each, value in more.items() if each in known[to].takes}
    chosen = called or default
    folder = Path(f"{chosen or 'friction'}-{to}") if output is None else output
    for path in export(given, to, folder, name=chosen, **more):
        put(str(path))


def _given(
    name: str, law: str, contact: str
) -> tuple[Chart | Model | Contact | System, str, dict[str, Any]]:
    """Return what is exported, its default name, and the settings of a scenario."""
    from gms_fsm.app._own_files import own_file
    from gms_fsm.app.verbs.catalogue import chosen
    from gms_fsm.app.verbs.charts import no_contact
    from gms_fsm.run.settings import Settings
    from gms_fsm.systems.models import demonstration

    own = own_file(name, law)
    no_contact(contact, own)
    if own is None:
        found, _ = chosen("export", name, law)
        return demonstration(found, law), found.name.replace("-", "_"), {}
    if own.system is None:
        return own.only_chart(contact), "", {}
    more: dict[str, Any] = {}
    if run := own.run:
        used = {each: run[each] for each in SETTINGS if each in run}
        more = {"settings": Settings(**used), "t_start": run["t_start"]}
        more["initial"] = run.get("initial") or {}
        more["t_end"] = run["t_end"]
    if not contact:
        return own.system, own.path.stem, more
    if "initial" in more:
        more["initial"] = _of_contact(own.system.contact(contact), more["initial"])
    return own.system.contact(contact), contact, more


def _of_contact(contact: Contact, initial: dict[str, Any]) -> dict[str, Any]:
    """Return the initial values of a contact, by its own names."""
    names = {*contact.chart.variables, "states"}
    plain = {name.removeprefix(f"{contact.name}."): value for name, value in initial.items()}
    return {name: value for name, value in plain.items() if name in names}
