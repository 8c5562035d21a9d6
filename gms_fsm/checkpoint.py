"""Checkpoints: a long run that is interrupted goes on where it was, bit for bit."""

from __future__ import annotations

import hashlib
import time
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gms_fsm.errors import CheckpointError, ParameterError, why
from gms_fsm.files import written_whole
from gms_fsm.header import Header
from gms_fsm.start import Start
from integrators import hybrid

__all__ = ["Keeper"]

_FORMAT = "gms-fsm checkpoint 1"


class Resumable(Protocol):
    """A run whose state can be taken and put back."""

    start: Start

    @property
    def buffers(self) -> hybrid.Buffers:
        """Where the loop keeps its state."""

    def kept(self) -> dict[str, Any]:
        """Return what the recorder holds, as arrays."""

    def go_on_from(self, kept: dict[str, Any]) -> None:
        """Take over what `kept` returned; the buffers are filled already."""


class Keeper:
    """Writes a run's state to a file now and then, and starts it from there.

    Parameters
    ----------
    run : Resumable
        A run that has not begun.
    path : Path
        The file.
    every : float
        s of the computer's time between two checkpoints.

    Raises
    ------
    CheckpointError
        If the file is there and damaged, or belongs to another run.
    ParameterError
        If a SciPy solver takes the steps: its history cannot be kept.
    OutputError
        If the file cannot be written.
    """

    def __init__(self, run: Resumable, path: Path, every: float) -> None:
        if run.buffers.plan.foreign:
            raise ParameterError(
                "checkpoint: a SciPy solver's history cannot be kept; use method='dp45' or another "
                "of our own, or leave checkpoint out"
            )
        self.run, self.path, self.every = run, path, every
        self.identity = _identity(run.start)
        if path.exists():
            self._restore()
        else:
            self.save()
        self.saved_at = time.monotonic()

    def look(self) -> None:
        """Write a checkpoint if it is time."""
        if time.monotonic() - self.saved_at >= self.every:
            self.save()
            self.saved_at = time.monotonic()

    def save(self) -> None:
        """Write a checkpoint: the old file or the new, never a half."""
        state = {f"loop_{name}": u for name, u in hybrid.state_of(self.run.buffers).items()}
        kept = {f"kept_{name}": u for name, u in self.run.kept().items()}
        head: dict[str, Any] = {"format": _FORMAT, "identity": self.identity}
        written_whole(self.path, lambda file: np.savez(file, **head, **state, **kept))

    def finish(self) -> None:
        """Remove the file: the run is over."""
        self.path.unlink(missing_ok=True)

    def _restore(self) -> None:
        try:
            # Opened here: np.load leaves a damaged file open.
            with self.path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            if str(arrays["format"]) != _FORMAT:
                raise ValueError(f"format {arrays['format']}")
            identity = str(arrays["identity"])
            loop, kept = (
                {name.removeprefix(f"{part}_"): u for name, u in arrays.items()
                 if name.startswith(f"{part}_")}
                for part in ("loop", "kept")
            )  # fmt: skip
        except Exception as error:  # numpy and zipfile raise many kinds over damaged files
            raise CheckpointError(
                f"{self.path}: not a checkpoint, or damaged ({why(error)}); "
                "remove it to start the run anew"
            ) from None
        if identity != self.identity:
            raise CheckpointError(
                f"{self.path}: belongs to a run with another model, rig, signal or setting; remove "
                "it, or give this run a file of its own"
            )
        for name, place in hybrid.state_of(self.run.buffers).items():
            place[:] = loop[name] if isinstance(place, np.ndarray) else loop[name].tolist()
        self.run.go_on_from(kept)


def _identity(start: Start) -> str:
    """Return a short name for all that decides a run."""
    head = Header.of(start.model, start.rig, start.settings).model_dump_json()
    what = head, start.output, start.options.times, start.y, start.mode
    return hashlib.sha256(repr(what).encode()).hexdigest()
