"""Output of the phenomena bench: the table as Markdown and CSV, and the figures."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

from gms_fsm.app._own_files import OwnFile, contacts_error, own_file
from gms_fsm.charts.parameters import Parameter
from gms_fsm.errors import MissingExtraError, ParameterError, shown
from gms_fsm.foundation.files import output_folder, write_text
from gms_fsm.phenomena.measure import Bench, Progress, chosen_phenomena, measure_phenomena
from gms_fsm.phenomena.results import MARKS, PhenomenaTable
from gms_fsm.systems.models import ChartModel, Model
from gms_fsm.systems.system import Contact

__all__ = ["numbers_given", "own_models", "page", "write", "write_table"]


def write(
    folder: str | Path,
    models: Sequence[str] | Mapping[str, str | Model | Contact] | None = None,
    phenomena: Sequence[str] | None = None,
    *,
    bench: Bench | None = None,
    progress: Progress | None = None,
) -> tuple[PhenomenaTable, list[Path]]:
    """Measure, and write table and figures.

    Parameters
    ----------
    folder : str or Path
        Output folder; created if it does not exist.
    models, phenomena, bench, progress
        As for `gms_fsm.measure_phenomena`.

    Returns
    -------
    PhenomenaTable, list of Path
        The table and the files written, ``phenomena.md`` first.

    Raises
    ------
    ParameterError
        If a name is unknown.
    OutputError
        If the folder is not writable (checked before the runs).
    """
    from plots.output import formats

    chosen = [each.name for each in chosen_phenomena(phenomena)]
    drawn = [file for name in ("matrix", *chosen) for file in formats.files(name, "figure")]
    folder = output_folder(folder, ["phenomena.md", "phenomena.csv", *drawn])
    table = measure_phenomena(models, chosen, bench=bench, progress=progress)
    return table, write_table(table, folder)


def write_table(table: PhenomenaTable, folder: Path) -> list[Path]:
    """Write a table and its figures.

    Parameters
    ----------
    table : PhenomenaTable
        The results.
    folder : Path
        From `gms_fsm.foundation.files.output_folder`.

    Returns
    -------
    list of Path
        ``phenomena.md`` first.
    """
    texts = {"phenomena.md": page(table), "phenomena.csv": table.csv()}
    files = [write_text(folder / name, text) for name, text in texts.items()]
    try:
        files += _draw(table, folder)
    except MissingExtraError as error:
        warnings.warn(f"no figures were drawn: {error}", stacklevel=2)
    return files


def _draw(table: PhenomenaTable, folder: Path) -> list[Path]:
    from plots import figures
    from plots.output import formats

    pictures = {each.name: figures.phenomenon_figure(table, each.name) for each in table.phenomena}
    pictures = {"matrix": figures.phenomena_matrix(table), **pictures}
    return [
        figures.save(figure, folder / file)
        for name, figure in pictures.items()
        if figure is not None
        for file in formats.files(name, "figure")
    ]


def page(table: PhenomenaTable) -> str:
    """Return a table with its experiments and limits as a Markdown page.

    Parameters
    ----------
    table : PhenomenaTable
        The results.

    Returns
    -------
    str
        Markdown.
    """
    signs = ", ".join(f"{mark} {verdict}" for verdict, mark in MARKS.items())
    lines = ["# Models and phenomena", "", f"{signs}.", "", table.markdown()]
    if left := table.left_out():
        lines += [f"- {model} does not take part: {reason}." for model, reason in left.items()]
        lines.append("")
    for each in table.phenomena:
        lines += [f"## {each.title}", "", each.experiment, ""]
        lines += [
            f"Limit: {limit.value:g}{'' if limit.unit == '1' else ' ' + limit.unit} for "
            f"{limit.meaning}. Reason: {limit.reason}."
            for limit in each.limits.values()
        ]
        lines.append("")
        for model in table.models:
            found = table.cell(model, each.name)
            if found.numbers:
                numbers = "; ".join(f"{one.name} {one}" for one in found.numbers)
                lines.append(f"- **{model}** {found.verdict}: {found.said}. {numbers}.")
            elif found.verdict == "failed":
                lines.append(f"- **{model}** failed: {found.said}")
        lines.append("")
    return "\n".join(lines)


# --------------------------------------------------------------------------- files
def own_models(
    names: Sequence[str], contact: str = "", values: Mapping[str, float] | None = None
) -> dict[str, Model | Contact]:
    """Return the models of files: chart, system and scenario files.

    Parameters
    ----------
    names : sequence of str
        Files ending in ``.toml``.
    contact : str
        Which contact of a system; needed if it has several.
    values : mapping of str to float, optional
        Parameters of chart files, which have no numbers of their own.

    Returns
    -------
    dict of str to Model or Contact
        By the name of the file without its ending.

    Raises
    ------
    GMSError
        If a file cannot be read, or has several contacts, or a parameter has no value.
    """
    found: dict[str, Model | Contact] = {}
    for name in names:
        file = own_file(name)
        if file is None:
            raise ParameterError(
                f"{shown(name)} is not a file", advice="included charts are named by --model"
            )
        found[file.path.stem] = _model_of(file, contact, values or {})
    return found


def _model_of(file: OwnFile, contact: str, values: Mapping[str, float]) -> Model | Contact:
    if file.system is not None:
        contacts = file.system.contacts
        if contact:
            return file.system.contact(contact)
        if len(contacts) > 1:
            raise contacts_error(file.path, [each.name for each in contacts], "say which one:")
        return contacts[0]
    assert file.chart is not None
    missing = [each for each in file.chart.parameters if each.name not in values]
    if missing:
        raise ParameterError(
            f"it is a chart file, and {_listed(missing)} have no value",
            place=str(file.path),
            advice=f"give --value {missing[0].name}=..., or a system file",
        )
    own = {name: values[name] for name in file.chart.parameter_names}
    return ChartModel(file.chart, own, title=file.path.stem)


def _listed(parameters: Sequence[Parameter]) -> str:
    return ", ".join(f"{each.name} [{each.unit}]" for each in parameters)


def numbers_given(option: str, texts: Sequence[str]) -> dict[str, float]:
    """Return the numbers of options such as ``--set F_s=1.5``.

    Parameters
    ----------
    option : str
        For the message.
    texts : sequence of str
        Each ``name=number``.

    Returns
    -------
    dict of str to float
        By name.

    Raises
    ------
    ParameterError
        If a text is not of this form.

    Examples
    --------
    >>> numbers_given("--set", ["F_s=1.5"])
    {'F_s': 1.5}
    """
    found = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            found[name.strip()] = float(number)
        except ValueError:
            raise ParameterError(
                f"{option} {shown(text)}: it must be name=number, for example F_s=1.5"
            ) from None
    return found
