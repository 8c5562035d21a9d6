"""Measure the phenomena for docs/howto/phenomena.md; run it with ``make gallery``."""

from __future__ import annotations

from pathlib import Path

from gms_fsm import measure_phenomena
from gms_fsm.foundation.files import write_whole
from plots import figures

HERE = Path(__file__).parent
TABLE = HERE / "howto" / "phenomena_table.txt"
SHOWN = ("drift", "memory", "lag", "passivity")


def main() -> None:
    """Write the table and the pictures."""
    table = measure_phenomena()
    lines = [table.markdown()]
    lines += [f"- {name} does not take part: {why}." for name, why in table.left_out().items()]
    failed = [each for each in table if each.measured.verdict == "failed"]
    lines += [
        f"- {each.model}, {each.phenomenon.name}: not measured; {each.measured.said}"
        for each in failed
    ]
    text = "\n".join(lines) + "\n"
    write_whole(TABLE, lambda file: file.write(text.encode()))
    figures.save(
        figures.phenomena_matrix(table, title="Which model shows what"),
        HERE / "images" / "phenomena_matrix.png",
    )
    for name in SHOWN:
        figure = figures.phenomenon_figure(table, name)
        if figure is not None:
            figures.save(figure, HERE / "images" / f"phenomena_{name}.png")


if __name__ == "__main__":
    main()
