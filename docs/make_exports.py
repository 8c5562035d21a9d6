"""Fill the table of docs/howto/exports.md from what foreign tools have run.

``make foreign`` runs them, keeps the rows in tests/foreign/exports.json, and then runs this.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

from gms_fsm.exporters import formats
from gms_fsm.foundation.files import write_whole

HERE = Path(__file__).parent
PAGE = HERE / "howto" / "exports.md"
ROWS = HERE.parent / "tests" / "foreign" / "exports.json"
BEGIN = "<!-- measured table: begin; made by `make foreign` -->\n"
END = "<!-- measured table: end -->"
HEADS = ("format", "tool", "what was run", "result")
BAR = "\\|"  # within a cell


def rows() -> list[list[str]]:
    """Return what was run: format, tool with version, what, result."""
    found: list[list[str]] = json.loads(ROWS.read_text(encoding="utf-8"))
    return found


def programs() -> list[str]:
    """Return the formats in which friction is a program."""
    return [name for name, each in formats().items() if each.subject == "friction"]


def unrun(names: Iterable[str], known: Sequence[Sequence[str]]) -> list[str]:
    """Return the formats that no tool has run."""
    done = {form for form, *_ in known}
    return [each for each in names if each not in done]


def table(programs: Iterable[str], known: Sequence[Sequence[str]]) -> str:
    """Return the table as Markdown, and below it the formats without a row."""
    lines = [f"| {' | '.join(HEADS)} |", "|---|---|---|---|"]
    names = {each: f"`{each}`" for each in programs}  # the others are pictures
    for row in known:
        form, *cells = (each.replace("|", BAR) for each in row)
        lines.append(f"| {names.get(form, form)} | {' | '.join(cells)} |")
    if missing := unrun(names, known):
        listed = ", ".join(names[each] for each in missing)
        lines += ["", f"Not run by any tool, and therefore not supported: {listed}."]
    return "\n".join(lines) + "\n"


def filled(page: str, made: str) -> str:
    """Return the page with the table between its marks."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    if not after:
        raise ValueError(f"{PAGE.name} has no {BEGIN.strip()} with an end")
    return f"{before}{BEGIN}\n{made}\n{END}{after}"


def main() -> None:
    """Write the table into the page."""
    text = filled(PAGE.read_text(encoding="utf-8"), table(programs(), rows()))
    write_whole(PAGE, lambda file: file.write(text.encode()))


if __name__ == "__main__":
    main()
