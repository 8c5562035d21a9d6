"""The benchmark as a page and as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from gms_fsm.app.benchmark.card import Card, Row, Section
from gms_fsm.foundation.files import output_folder, write_text

FILES = ("benchmark.md", "benchmark.json")
COMMAND = "gms-fsm benchmark --data FOLDER -o FOLDER"
NOTES = {
    "damper": "Each test is predicted by models trained on the other twelve. The first split is "
    "searched in full; the later ones are refined from it, and keep the kind of model that "
    "`choose` found there.",
    "tribometer": "`choose` compares its candidates on four stretches of the training rows, and "
    "is scored once.",
}
SUBMIT = """\
## Submit yours

Write the forces that your model predicts for the held-out rows into a JSON file:

<!-- file: mine.json -->
```json
{"name": "my model", "dataset": "tribometer", "F": {"tribometer": [2.31, 2.30, 2.30]}}
```

`F` has one list for each record of the data set (`tribometer`; `test00` to `test12` of the damper):
the force at each held-out row in N, in the order of the record. `"rows": {"tribometer": [20120]}`
scores only some of them, by their line in the file (the header is line 1; rows of the tribometer
with a normal force of at most 4.5 N do not count). What is held out must not have been trained on.
Then `python benchmarks/score.py mine.json --data FOLDER` prints your row of the table. To have it
listed here, open an issue with the file and a sentence on how the model was trained.
"""


def page(card: Card) -> str:
    """Return a card as a Markdown page."""
    lines = [
        "# Benchmark",
        "",
        f"Friction models on public records, made by `{COMMAND}`. Errors are of rows that were "
        f"held out of the training. Made with {card.machine}.",
        "",
    ]
    if not card.complete:
        lines += ["The run was interrupted; models that are missing were not reached.", ""]
    for section in card.sections:
        lines += _section(section)
    return "\n".join([*lines, SUBMIT])


def _section(section: Section) -> list[str]:
    lines = [f"## {section.title}", "", f"Held out: {section.held_out}. {section.licence}.", ""]
    lines += [table(section.rows), ""]
    if section.name in NOTES:
        lines += [NOTES[section.name], ""]
    records = list(dict.fromkeys(name for row in section.rows for name in row.by_record))
    if len(records) > 1:
        lines += ["RMSE by record, N:", "", _by_record(section.rows, records), ""]
    return lines


def table(rows: Sequence[Row]) -> str:
    """Return rows as a Markdown table.

    Examples
    --------
    >>> table([Row("mine", 3, 0.05, 0.0712, 0.99891, 2.0)]).splitlines()[-1]
    '| mine | 3 | 0.05 | 0.0712 | 0.99891 | 2.0 |  |'
    """
    lines = [
        "| model | free | training RMSE N | held-out RMSE N | held-out R² | CPU s | |",
        "|---|--:|--:|--:|--:|--:|---|",
    ]
    lines += [
        f"| {row.model} | {_number(row.free, 'd')} | {_force(row.train_rmse)} "
        f"| {_force(row.rmse)} | {_number(row.r2, '.5f')} | {_number(row.seconds, '.1f')} "
        f"| {row.note} |"
        for row in rows
    ]
    return "\n".join(lines)


def _by_record(rows: Sequence[Row], records: Sequence[str]) -> str:
    lines = [f"| model | {' | '.join(records)} |", "|---|" + "--:|" * len(records)]
    lines += [
        f"| {row.model} | "
        + " | ".join(_number(row.by_record.get(name), ".0f") for name in records)
        + " |"
        for row in rows
        if row.by_record
    ]
    return "\n".join(lines)


def _force(value: float | None) -> str:
    return _number(value, ".0f" if value is not None and value >= 1e4 else ".4g")


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else f"{value:{form}}"


def write(card: Card, folder: Path) -> list[Path]:
    """Write a card."""
    target = output_folder(folder, FILES)
    texts = (page(card), json.dumps(card.as_data(), indent=1, ensure_ascii=False) + "\n")
    return [write_text(target / name, text) for name, text in zip(FILES, texts, strict=True)]
