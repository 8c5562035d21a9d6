"""The included charts, as named and listed by the command line."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from pathlib import Path

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.gms import LAWS, WHICH_LAW
from gms_fsm.charts.registry import Entry, entry, registered
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import nearest

WIDTH = 78
OWN = "gms-fsm chart --list shows all; a chart of your own is named by its file, own.toml"


def chosen(verb: str, name: str, law: str) -> tuple[Entry, Chart]:
    """Return the chart named on the command line."""
    try:
        found = entry(name)
    except ParameterError as error:
        near = nearest(name, [each.name for each in Path().glob("*.toml")], 0.75)
        file = f"did you mean the file {near!r}? " if near else ""
        raise error.replaced(advice=f"{file}{error.advice}; {OWN}") from None
    options = " or ".join(f"--law {each}" for each in found.laws)
    if law and not options:
        others = [each.name for each in registered().values() if each.laws]
        raise ParameterError(
            f"{verb} {name} takes no --law", advice=f"only {', '.join(others)} takes one"
        )
    if options and not law:
        raise ParameterError(
            f"{verb} {name} needs {options}",
            advice=WHICH_LAW if found.laws == LAWS else "the laws differ",
        )
    if law not in found.laws and options:
        raise ParameterError(f"{verb} {name} has no law {law!r}", advice=f"give {options}")
    return found, found.chart(law)


def catalogue() -> str:
    """Return a list of the included charts, with their parameters.

    Examples
    --------
    >>> "  v_c      arrest velocity, m/s, > 0" in catalogue().splitlines()
    True
    """
    sound = [each for each in registered().values() if not each.wrong]
    return "\n\n".join(["\n".join(_described(each)) for each in sound] + [_faulty()])


def checkable() -> str:
    """Return a list of the charts that can be checked, with the faults of the faulty ones."""
    sound = [_name(each) for each in registered().values() if not each.wrong]
    return f"{', '.join(sound)}, and as demonstrations:\n{_faulty()}"


def _name(each: Entry) -> str:
    return ", ".join(f"{each.name} --law {law}" for law in each.laws) or each.name


def _described(each: Entry) -> Iterator[str]:
    yield f"{_name(each)}: {each.title}"
    rows = [(one.name, one.described) for one in each.parameters]
    rows.append(("numbers", each.demonstration.source))
    wide = max(len(name) for name, _ in rows)
    for name, text in rows:
        lead, rest = f"  {name:<{wide}}  ", " " * (wide + 4)
        yield textwrap.fill(lead + text, WIDTH, subsequent_indent=rest).rstrip()


def _faulty() -> str:
    found = [each for each in registered().values() if each.wrong]
    text = (f"{each.name}  {each.wrong}" for each in found)
    return "\n".join(textwrap.fill(each, WIDTH, subsequent_indent="  ") for each in text)
