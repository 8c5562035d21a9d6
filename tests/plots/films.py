"""Films for the tests: what `plots.animate` made, frame by frame, before it is written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="films need the extra 'plots'")

from matplotlib.colors import to_rgb
from PIL import Image

import plots
from gms_fsm import Trace
from plots.film._movie import Movie
from plots.output.formats import FORMATS, Format, register
from tests.corpus import trace


def cascade() -> Trace:
    """Return four elements that break away in one instant, at 3.8 s, and are caught in one."""
    return trace("open loop, published")


def with_movie(run: Trace, folder: Path, use: Callable[[Movie], Any], **options: Any) -> Any:
    """Return what a function makes of a film."""
    found: list[Any] = []
    form = Format(".grab", "animation", "a film", "test", _keep(use, found))
    register(form)
    try:
        plots.animate(run, folder / "film.grab", **options)
    finally:
        FORMATS.remove(form)
    return found[0]


def _keep(use: Callable[[Movie], Any], found: list[Any]) -> Callable[[Any], bytes]:
    def write(movie: Any) -> bytes:
        found.append(use(movie))
        return b""

    return write


def count(picture: Image.Image, colour: str) -> int:
    """Return the number of pixels of exactly this colour."""
    wanted = np.round(255 * np.array(to_rgb(colour))).astype(np.uint8)
    return int((np.asarray(picture) == wanted).all(axis=2).sum())


def frames_of(path: Path) -> list[Image.Image]:
    """Return the pictures stored in a GIF."""
    with Image.open(path) as film:
        found = []
        for k in range(film.n_frames):  # type: ignore[attr-defined]
            film.seek(k)
            found.append(film.convert("RGB"))
        return found
