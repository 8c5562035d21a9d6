"""Arguments and options shared by several verbs of the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

INTERRUPTED = 130  # the conventional exit code after Ctrl-C

ScenarioFile = Annotated[
    Path,
    typer.Argument(
        help="Scenario file, or the name of one of the package, such as pulled_mass or servo "
        "(`gms-fsm run --list` shows all).",
        show_default=False,
    ),
]
OutputFolder = Annotated[Path, typer.Option("--output", "-o", help="Output folder.")]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", help="Override a key, for example --set model.law=published."),
]
TraceFile = Annotated[Path, typer.Argument(help="Trace file, .npz or .csv.", show_default=False)]
PresetName = Annotated[
    str,
    typer.Option(
        "--preset",
        help="Sizes of figures: screen, ieee1 (one column), ieee2 (two), slide or poster.",
    ),
]
Start = Annotated[float | None, typer.Option(help="Start time in s.")]
End = Annotated[float | None, typer.Option(help="End time in s.")]
ChartName = Annotated[
    str,
    typer.Argument(
        help="Name of an included chart (--list shows all) or scenario, or a chart file, a system "
        "file or a scenario file (.toml).",
        show_default=False,
    ),
]
ContactName = Annotated[
    str, typer.Option("--contact", help="Contact, of a system with several.", show_default=False)
]
Law = Annotated[
    str,
    typer.Option(
        help="Law of a chart that has several, such as gms; there is no default, because the laws "
        "differ.",
        show_default=False,
    ),
]
