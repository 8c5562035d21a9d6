"""The formats that friction can be written in, and the one function that writes any of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

from gms_fsm.charts.chart import Chart
from gms_fsm.coupling.compensator import Compensator
from gms_fsm.errors import ParameterError, shown
from gms_fsm.exporters._names import identifier
from gms_fsm.exporters._subject import Subject
from gms_fsm.formats import Format, of
from gms_fsm.foundation.arguments import checked_path, either, refusing, unknown
from gms_fsm.foundation.display import asked
from gms_fsm.foundation.files import output_folder, write_together
from gms_fsm.foundation.text import encoded
from gms_fsm.run.settings import Settings
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact, System


def formats() -> dict[str, Format]:
    """Return what `export` can write: the formats of friction, and those of its chart.

    Returns
    -------
    dict of str to Format
        By name.

    Examples
    --------
    >>> {"c99", "fmu3", "scxml", "transitions", ".mmd"} <= {*formats()}
    True
    """
    table = asked("formats") or of  # what draws is above, and registers its formats first
    return {each.name: each for each in table("friction", "chart")}


@refusing()
def export(
    system: System | Model | Contact | Chart | Compensator,
    format: str,  # noqa: A002 (as the command line calls it)
    folder: str | Path,
    *,
    name: str = "",
    initial: Mapping[str, Any] | None = None,
    t_start: float = 0.0,
    settings: Settings | None = None,
    t_end: float | None = None,
) -> tuple[Path, ...]:
    """Write friction for another program.

    Everything is computed before the first file is written.

    Parameters
    ----------
    system : System, Model, Contact, Chart or Compensator
        What is handed over. A model or a contact is one friction whose velocity is an input. The
        inputs of a system are those of its signals that are records. A chart alone has no numbers:
        only formats for charts take it. A compensator is its friction, and as c99 what calls it.
    format : str
        A key of `formats()`.
    folder : str or Path
        Where the files are written; created if missing.
    name : str, optional
        Of the files and of what is defined in them; from the name of the system or chart if
        omitted.
    initial : mapping, optional
        As for `gms_fsm.simulate`.
    t_start : float
        s: when it starts.
    settings : Settings, optional
        Method and tolerances, for the formats that contain the engine: c99, js, fmu2 and
        fmu3.
    t_end : float, optional
        s: when it ends, for a system as js.

    Returns
    -------
    tuple of Path
        The files.

    Raises
    ------
    ParameterError
        If there is no such format, or the format cannot express something; which is named.
    OutputError
        If the folder cannot be written, or a file is there that gms-fsm did not write.

    Examples
    --------
    >>> import tempfile
    >>> from gms_fsm import GMS, GMSParameters, export
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     files = export(model, "c99", folder, name="gms")
    >>> "gms.h" in [file.name for file in files]
    True
    """
    known = formats()
    if not isinstance(format, str) or format not in known:
        error, word = unknown("format", format, known), str(format).lower()
        kinds = {each.name: re.findall(r"\w+", each.kind.lower()) for each in known.values()}
        serving = [name for name, words in kinds.items() if word in words]
        if isinstance(folder, str) and folder in known:
            advice = f"format and folder are swapped: export(..., {folder!r}, {shown(format)})"
            raise error.replaced(advice=advice)
        if serving:
            raise error.replaced(advice=f"{shown(format)} is served by {either(serving)}")
        raise error
    where = checked_path("folder", folder)
    form = known[format]
    subject = Subject.of(
        system, format, name=name, initial=initial, t_start=t_start, settings=settings, t_end=t_end
    )
    identifier(subject.name, form.words, f"name {subject.name!r}")
    for each, unused in (
        ("initial", not initial),
        ("t_start", t_start == 0.0),
        ("settings", settings is None),
        ("t_end", t_end is None),
    ):
        if not unused and each not in form.takes:
            raise ParameterError(
                f"format {format!r} does not use it", place=each, advice="leave it out"
            )
    if subject.compensator is not None and "compensator" not in form.takes:
        raise ParameterError(
            f"format {format!r} cannot express a compensator",
            place="system",
            advice="export its friction, compensator.model, or choose format 'c99'",
        )
    files: Mapping[str, str | bytes]
    if form.subject == "chart":
        files = {f"{subject.name}{form.name}": form.write(subject.chart)}
    else:
        files = form.write(subject)
    output_folder(where, files)
    write_together({where / each: _writer(content) for each, content in files.items()})
    return tuple(where / each for each in files)


def _writer(content: str | bytes) -> Callable[[IO[bytes]], object]:
    data = encoded(content) if isinstance(content, str) else content
    return lambda file: file.write(data)
