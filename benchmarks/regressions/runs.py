"""Runs, sweeps, files and starts. Only public names: older commits must have them too."""

from __future__ import annotations

import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from cases import PROBLEMS, pulled

from gms_fsm import Trace, simulate, sweep


class Runs:
    """A whole call: building the model, 6,001 rows, friction."""

    params = (list(PROBLEMS), ["compiled", "machines"])
    param_names = ("problem", "engine")

    def setup(self, problem: str, engine: str) -> None:
        """Compile."""
        self.times = np.linspace(0.0, PROBLEMS[problem].t_end, 6001)
        self.time_rows(problem, engine)
        self.time_end(problem, engine)

    def time_rows(self, problem: str, engine: str) -> None:
        """Keep rows, and read the friction."""
        one = PROBLEMS[problem]
        one.compared(simulate(*one.build(), one.t_end, engine=engine, t_eval=self.times))

    def time_end(self, problem: str, engine: str) -> None:
        """Keep the end state only."""
        one = PROBLEMS[problem]
        simulate(*one.build(), one.t_end, engine=engine, output="end")


class Sweeps:
    """End states."""

    def setup(self) -> None:
        """Draw the stiffnesses, and compile."""
        k = pulled()[0].parameters.k * np.random.default_rng(1).uniform(0.8, 1.2, (100, 4))
        self.varied = {"k": k, "weights": 1 / (4 * k)}
        self.time_sweep()

    def time_sweep(self) -> None:
        """Run a hundred pulled masses on one core."""
        with ThreadPoolExecutor(1) as executor:
            sweep(*pulled(), 60.0, self.varied, executor=executor)


class Files:
    """A trace of 41,000 rows."""

    params = ("npz", "csv")
    param_names = ("kind",)

    def setup(self, kind: str) -> None:
        """Run, and write the file that is read."""
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name, f"run.{kind}")
        self.trace = simulate(*pulled(), 1200.0, engine="compiled")
        self.time_save(kind)

    def teardown(self, _: str) -> None:
        """Remove the file."""
        self.folder.cleanup()

    def time_save(self, _: str) -> None:
        """Write."""
        self.trace.save(self.path)

    def time_load(self, _: str) -> None:
        """Read."""
        Trace.load(self.path)


class Starts:
    """Fresh processes."""

    def timeraw_import(self) -> str:
        """Import what a script needs."""
        return "from gms_fsm import GMS, GMSParameters, PulledSlider, Stribeck, simulate"

    def timeraw_help(self) -> str:
        """Ask the command line what it can do."""
        return """
        import contextlib, os, sys
        from gms_fsm.app.cli import main
        sys.argv[1:] = ["--help"]
        with open(os.devnull, "w") as out, contextlib.redirect_stdout(out):
            with contextlib.suppress(SystemExit):
                main()
        """
