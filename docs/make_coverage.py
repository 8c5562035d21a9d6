"""Generate motions for all charts, for docs/howto/coverage.md; run it with ``make gallery``.

How many mutants of guards they kill is counted by `tests.difference.mutants`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from gms_fsm import Chart, generate
from gms_fsm.charts.registry import charts
from gms_fsm.foundation.files import write_whole

HERE = Path(__file__).parent
TABLE = HERE / "howto" / "coverage_table.txt"
HEAD = (
    "| chart | motions | edges | pairs | out of reach | open | MC/DC | mutants killed | alike |\n"
    f"{'|---' * 9}|\n"
)


def row(name: str, chart: Chart) -> str:
    """Return the row of a chart."""
    sys.path.insert(0, str(HERE.parent))  # the tests are no package that is installed
    from tests.difference.mutants import judged

    found = generate(chart)
    verdicts = judged(found, chart)
    killed, left = len(verdicts["killed"]), len(verdicts["left"])
    scores = found.coverage.scores
    shares = [f"{each.seen} of {each.of}" for each in (scores["edges"], found.pairs)]
    decided = scores["MC/DC"]
    cells = [
        f"`{name}`",
        len(found.runs),
        *shares,
        len(found.unreached) - len(found.open),
        len(found.open),
        f"{decided.seen} of {decided.of}",
        f"{killed} of {killed + left}",
        len(verdicts["same"]),
    ]
    return f"| {' | '.join(map(str, cells))} |\n"


def main() -> None:
    """Write the table."""
    every = charts().items()
    rows = [row(name, chart) for name, chart in every if chart.transitions]
    smooth = ", ".join(f"`{name}`" for name, chart in every if not chart.transitions)
    text = f"{HEAD}{''.join(rows)}\nWithout edges, one motion each: {smooth}.\n"
    write_whole(TABLE, lambda file: file.write(text.encode()))


if __name__ == "__main__":
    main()
