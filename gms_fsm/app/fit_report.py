"""Report of a fit: a page, a figure, tables of parameters and residuals, a scenario that runs."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import MissingExtraError, OutputError
from gms_fsm.foundation.arguments import checked_kind, checked_path
from gms_fsm.foundation.files import csv_text, output_folder, refuse_input, write_text
from gms_fsm.foundation.quantities import in_words
from gms_fsm.foundation.text import plain, table_lines
from gms_fsm.identification.certainty.profile import LIMIT, Profile
from gms_fsm.identification.reach import measures
from gms_fsm.identification.result import Choice, Estimate, Fit, Residuals

__all__ = ["report_files", "report_folder", "write_report"]

PAGE, PARAMETERS, RESIDUALS, FITTED = "report.md", "parameters.csv", "residuals.csv", "fitted.toml"
MOTION = "fitted.csv"  # beside the scenario, if it is long
PROFILES = "profiles"  # a figure, if there is anything to draw


def write_report(fit: Fit, folder: str | Path) -> Path:
    """Write the report of a fit into a folder.

    Parameters
    ----------
    fit : Fit
        From `gms_fsm.fit` or `gms_fsm.choose`.
    folder : str or Path
        Created if it does not exist.

    Returns
    -------
    Path
        The page, ``report.md``. Beside it are the figure, one of the profiles of what cannot be
        told (if anything), ``parameters.csv``, ``residuals.csv``, and ``fitted.toml``, a scenario
        that runs. What could not be written, such as the figure
        without matplotlib, is said on the page.

    Raises
    ------
    OutputError
        If the folder is not writable, or a file would replace one that was not written by gms-fsm
        or that is an input.
    """
    from plots.output import formats

    checked_kind("fit", fit, Fit, "a Fit, from gms_fsm.fit")
    inputs = [each.path for each in fit.records if each.path is not None]
    place = report_folder(folder, inputs)
    residuals, written, lacking = fit.residuals(), [PARAMETERS, RESIDUALS], []
    unit = fit.task.measured.unit
    write_text(place / PARAMETERS, csv_text(_parameter_rows(fit.table)))
    write_text(place / RESIDUALS, csv_text(_residual_rows(residuals, unit)))
    try:
        fit.save(place / FITTED)
        written += [name for name in (FITTED, MOTION) if (place / name).exists()]
    except OutputError as error:  # what a file cannot hold: a very long motion, a function
        lacking.append(f"no scenario was written: {error}")
    for name in formats.files(PROFILES, "figure"):  # of a fit that was here before
        (place / name).unlink(missing_ok=True)
    try:
        written = [*_draw(fit, place), *written]
    except MissingExtraError as error:
        lacking.append(f"no figure was drawn: {error}")
    for each in lacking:
        warnings.warn(each, stacklevel=2)
    return write_text(place / PAGE, _page(fit, residuals, written, lacking))


def report_folder(folder: str | Path, inputs: Sequence[Path] = ()) -> Path:
    """Create the folder of a report and check that the report can be written there.

    Parameters
    ----------
    folder : str or Path
        The folder.
    inputs : sequence of Path
        Files that must not be replaced.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    OutputError
        As `write_report` does.
    """
    names = report_files()
    place = output_folder(checked_path("folder", folder), names)
    for name in names:
        refuse_input(place / name, *inputs)
    return place


def report_files() -> list[str]:
    """Return the names of the files of a report, ``report.md`` first."""
    from plots.output import formats

    drawn = [name for stem in ("fit", PROFILES) for name in formats.files(stem, "figure")]
    return [PAGE, *drawn, PARAMETERS, RESIDUALS, FITTED, MOTION]


def _draw(fit: Fit, folder: Path) -> list[str]:
    """Write the figures in the usual formats; return their names."""
    from plots import figures
    from plots.output import formats

    drawn = {"fit": figures.fit_figure(fit)}
    if fit.open_profiles:
        drawn[PROFILES] = figures.profiles_figure(fit)
    files = {
        name: figure for stem, figure in drawn.items() for name in formats.files(stem, "figure")
    }
    for name, figure in files.items():
        figures.save(figure, folder / name)
    return list(files)


# --------------------------------------------------------------------------- tables
def _parameter_rows(table: Sequence[Estimate]) -> Iterator[Sequence[object]]:
    yield "name", "value", "low", "high", "unit", "note", "meaning"
    for each in table:
        numbers = (repr(float(number)) for number in (each.value, each.low, each.high))
        yield each.name, *numbers, each.unit, each.note, each.meaning


def _residual_rows(residuals: Sequence[Residuals], unit: str) -> Iterator[Sequence[object]]:
    """Yield all rows of all records; those that were neither fitted nor held out are named so."""
    written = unit.replace("/", "_")
    quantities = [f"{name}_{written}" for name in ("measured", "modelled", "residual")]
    yield "record", "t_s", "x_m", "v_m_s", *quantities, "use"
    for part in residuals:
        use = np.where(part.rows, "training", np.where(part.held, "held out", "left out"))
        columns = (part.t, part.x, part.v, part.measured, part.modelled)
        difference = part.measured - part.modelled
        rows = zip(*(each.tolist() for each in (*columns, difference)), use, strict=True)
        yield from ((part.record.name, *map(repr, numbers), used) for *numbers, used in rows)


# --------------------------------------------------------------------------- the page
def _page(
    fit: Fit, residuals: Sequence[Residuals], written: Sequence[str], lacking: Sequence[str]
) -> str:
    """Return the page as Markdown, with what was written beside it and what was not."""
    drawn = [name for name in written if name.startswith("fit.")]
    profiles = [name for name in written if name.startswith(f"{PROFILES}.")]
    sections = [
        _head(fit),
        [f"![Measurement and model, residuals, parameters]({drawn[0]})"] if drawn else [],
        [f"- {plain(each)}" for each in lacking],
        ["## Parameters", "", *_parameter_table(fit)],
        ["## What the record cannot tell", "", *_doubts(fit)],
        _profiles(profiles),
        ["## How well it fits", "", *_scores(fit, residuals)],
        ["## How far it reaches", "", *_reach(fit)],
        ["## Choice among candidates", "", *_choice(fit.choice)] if fit.choice else [],
        ["## What was done", "", *_done(fit)],
        ["## Records", "", *_records(fit)],
        ["## Files", "", *_files(written)],
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def _head(fit: Fit) -> list[str]:
    names = ", ".join(each.name for each in fit.records[:3])
    more = len(fit.records) - 3
    names += f" and {more} more" if more > 0 else ""
    lines = [f"# {plain(fit.title)}, fitted to {plain(names)}"]
    if fit.stopped:
        lines += ["", f"**{plain(fit.stopped)}**"]
    return lines


def _parameter_table(fit: Fit) -> list[str]:
    rows = [
        [
            plain(each.name),
            *each.shown,
            plain(each.unit),
            plain(each.note),
            plain(each.meaning),
        ]
        for each in fit.table
    ]
    return [
        *table_lines(["parameter", "value", "95 % interval", "unit", "note", "meaning"], rows),
        "",
        f"The intervals count {fit.effective_rows:.0f} independent rows: residuals correlate over "
        f"{fit.correlation_time:.3g} rows.",
    ]


def _doubts(fit: Fit) -> list[str]:
    lines = [f"- {plain(fit.weakest)}"] if fit.weakest else []
    if fit.open:
        lines.append(f"- cannot be told: {plain(', '.join(fit.open))}")
        lines += _as_good(fit.open_profiles)
    if fit.never_slipped:
        numbers = ", ".join(map(str, fit.never_slipped))
        lines.append(
            f"- never slipped: element {numbers}; it acts as a spring, and may act otherwise on a "
            "longer stroke"
        )
    return lines or ["- nothing: every parameter has an interval"]


def _as_good(profiles: Sequence[Profile]) -> list[str]:
    """Say how far open parameters go while the fit is as good, and whether a better fit was met."""
    if not profiles:
        return []
    ranges = [
        f"{each.name} from {each.low:.3g} to {each.high:.3g}"
        + ("" if each.unit in ("", "1") else f" {each.unit}")
        for each in profiles
    ]
    lines = [
        f"- fit as well (rise below {LIMIT:.2f}), if all others follow: values of "
        f"{plain(', of '.join(ranges))}"
    ]
    lowest = min(float(each.rise.min()) for each in profiles)
    if lowest < -LIMIT:
        lines.append(
            f"- a better fit was met on the way (rise {lowest:.3g}): the search had not found the "
            "best; search again, for example with another seed"
        )
    return lines


def _profiles(drawn: Sequence[str]) -> list[str]:
    if not drawn:
        return []
    words = "The dots were met on a walk from the fitted values; a profile is at most as high."
    return [f"![Profiles of what cannot be told]({drawn[0]})", "", words]


def _scores(fit: Fit, residuals: Sequence[Residuals]) -> list[str]:
    unit = fit.task.measured.unit
    named = {"training": fit.training, "held out": fit.held_out}
    rows = [
        [name, f"{score['rmse']:.4g}", f"{score['r2']:.4f}", f"{score['rows']:.0f}"]
        for name, score in named.items()
        if score is not None
    ]
    lines = table_lines(["rows", f"RMSE [{unit}]", "R²", "number"], rows)
    lines.append("")
    if fit.held_out is None:
        lines.append("- no rows were held out: how well the model predicts is not known")
    if fit.floor is not None:
        lines.append(
            f"- repeatability: {fit.floor:.4g} {unit}, the distance of cycles from their mean; a "
            "model that repeats itself cannot do better"
        )
    else:
        lines.append("- repeatability is not known: no period was given (cycles)")
    if len(residuals) > 1:
        own = [
            [plain(each.record.name), *(_rmse(each, mask) for mask in (each.rows, each.held))]
            for each in residuals
        ]
        heads = ["record", f"training [{unit}]", f"held out [{unit}]"]
        lines += ["", *table_lines(heads, own)]
    return lines


def _reach(fit: Fit) -> list[str]:
    """Return what was met in training; what lies outside of it is not known."""
    met = fit.reach
    shares = {
        state: [each.shares[state] for each in met] for each in met[:1] for state in each.shares
    }
    told = [f"{state} {min(own):.0%} to {max(own):.0%}" for state, own in shares.items()]
    return [
        *(
            f"- {what}: up to {in_words(max(getattr(each, name) for each in met), unit, 3)}"
            for name, (what, unit) in measures(fit.task.measured).items()
        ),
        f"- share of time by state: {plain(', '.join(told)) or 'one state'}",
        "- what a motion does beyond, `found.outside(record)` says, and a prediction warns of it",
    ]


def _rmse(each: Residuals, mask: NDArray[np.bool_]) -> str:
    difference = (each.measured - each.modelled)[mask]
    return f"{float(np.sqrt(np.mean(difference**2))):.4g}" if difference.size else "–"


def _choice(choice: Choice) -> list[str]:
    rows = [
        [
            f"**{plain(each.name)}**" if each.name == choice.chosen else plain(each.name),
            plain(each.reason),
            str(each.free),
            f"{each.rmse:.4g}",
            f"{each.r2:.4f}",
            f"{each.bic:.4g}",
            *(
                "–" if np.isnan(value) else f"{value:.4g}"
                for value in (each.by_amplitude, each.by_speed)
            ),
            f"{each.seconds:.3g}",
            plain(each.note or each.why),
        ]
        for each in choice.rows
    ]
    heads = ["candidate", "reason", "free", "RMSE", "R²", "BIC", "by amplitude", "by speed"]
    return [
        *table_lines([*heads, "time [s]", "note"], rows),
        "",
        "RMSE and R² are of the rows left out in each fold; by amplitude and by speed, of all "
        "records of one amplitude or speed left out at a time. BIC counts effective rows.",
    ]


def _done(fit: Fit) -> list[str]:
    def rows(window: tuple[float, float] | None, without: str) -> str:
        return without if window is None else f"{window[0]:g} s <= t < {window[1]:g} s"

    lines = [
        f"- compared: {plain(fit.measured)} [{fit.task.measured.unit}]",
        f"- fitted to: {rows(fit.train, 'all rows')}; held out: {rows(fit.test, 'none')}",
        f"- besides the model: {plain(', '.join(fit.nuisance)) or 'nothing'}",
        f"- {fit.runs} runs in {fit.seconds:.3g} s",
    ]
    return [*lines, *_notes(fit)]


def _notes(fit: Fit) -> list[str]:
    """Return what was done; what was done with several records once, licences with the records."""
    names = [each.name for each in fit.records]
    about: dict[str, list[str]] = {}
    for note in fit.notes:
        name, _, text = note.partition(": ")
        if name in names:
            about.setdefault(text, []).append(name)
        else:
            about[note] = []
    return [
        f"- {plain(f'{_those(own, names)}: {text}' if own else text)}"
        for text, own in about.items()
        if not text.startswith("licence: ")
    ]


def _those(own: Sequence[str], every: Sequence[str]) -> str:
    """Return the names of some of the records."""
    return "all records" if len(own) == len(every) > 1 else ", ".join(own)


def _records(fit: Fit) -> list[str]:
    rows = [
        [
            plain(each.name),
            "" if each.path is None else plain(each.path.name),
            str(int(each.chosen.sum())),
        ]
        for each in fit.records
    ]
    names, licences = [each.name for each in fit.records], dict[str, list[str]]()
    for each in fit.records:
        if each.licence:
            licences.setdefault(each.licence, []).append(each.name)
    said = [
        f"- licence of {plain(_those(own, names))}: {plain(licence)}"
        for licence, own in licences.items()
    ]
    return [*table_lines(["record", "file", "rows"], rows), *(["", *said] if said else [])]


def _files(written: Sequence[str]) -> list[str]:
    said: Mapping[str, str] = {
        PARAMETERS: "the table of parameters, with all digits",
        RESIDUALS: "measurement, model and residual of every row",
        FITTED: f"a scenario that runs: `gms-fsm run {FITTED}`",
        MOTION: "its motion",
    }
    return [f"- [{name}]({name}): {said.get(name, 'the figure above')}" for name in written]
