"""Make the pictures kept under docs/images; run it with ``make gallery``."""

from __future__ import annotations

from pathlib import Path

import plots
from gms_fsm import GMS, GMSParameters, Prescribed, simulate
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.paper import FIG4_END, VELOCITY
from plots import figures

FOLDER = Path(__file__).parent / "images"


def main() -> None:
    """Write every picture."""
    runs = {
        title: simulate(
            GMS(GMSParameters.paper("stick-slip"), law=law), Prescribed(VELOCITY), FIG4_END
        )
        for title, law in (
            ("published law, eq. (1) as printed", "published"),
            ("signed law (Al-Bender et al. 2005)", "signed"),
        )
    }
    figures.save(figures.compare_laws(runs), FOLDER / "fig4_laws.png")
    plots.render(plots.statechart(GMS_ELEMENT["signed"]), FOLDER / "chart_element.png")


if __name__ == "__main__":
    main()
