"""A film's file has the frames, the size and the length of the film, in every format."""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="films need the extra 'plots'")

from PIL import Image

import plots
from gms_fsm import Trace, simulate
from gms_fsm.errors import MissingExtraError
from plots.formats import endings
from plots.style import CHART_THEMES
from tests.helpers import open_loop, stick_slip
from tests.plots.films import count, frames_of, with_movie

pytestmark = pytest.mark.slow
VIDEOS = [ending for ending in endings("animation") if ending != ".gif"]
FRAMES, FPS = 30, 10.0
WINDOW = {"t_start": 3.3, "t_end": 5.0, "frames": FRAMES, "fps": FPS}  # four micro-steps at 3.8 s


@pytest.fixture(autouse=True)
def _graphviz() -> None:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")


@cache
def bank() -> Trace:
    return simulate(stick_slip("published"), open_loop(), 8.0)


def drawn(folder: Path) -> list[Image.Image]:
    found: list[Image.Image] = with_movie(
        bank(), folder, lambda movie: list(movie.pictures()), **WINDOW
    )
    return found


def test_a_gif_shows_the_frames_for_the_right_time(tmp_path: Path) -> None:
    path = plots.animate(bank(), tmp_path / "film.gif", **WINDOW)
    wanted, stored = drawn(tmp_path), frames_of(path)
    with Image.open(path) as film:
        lasts = []
        for k in range(film.n_frames):  # type: ignore[attr-defined]
            film.seek(k)
            lasts.append(film.info["duration"])
    assert sum(lasts) == 1000 * FRAMES / FPS
    assert len(lasts) < FRAMES  # what does not change is stored once
    assert {picture.size for picture in stored} == {wanted[0].size}
    ends = np.cumsum(lasts)
    for number, picture in enumerate(wanted):
        shown = stored[int(np.searchsorted(ends, 1000 * number / FPS, side="right"))]
        far = np.abs(np.asarray(shown).astype(int) - np.asarray(picture)).max(axis=2)
        assert np.mean(far > 40) < 1e-3, number
        assert count(shown, CHART_THEMES["light"].paper) > 0.5 * shown.size[0] * shown.size[1]


def test_a_gif_of_constant_frames_is_one_frame(tmp_path: Path) -> None:
    from plots.film._files import gif

    class Still:
        frames, fps, size, colours = 5, 7.0, (8, 6), ["black"]

        def held(self) -> list[int]:
            return []

        def picture(self, number: int) -> Image.Image:
            return Image.new("RGB", self.size, (12, 200, 31))

        def pictures(self) -> list[Image.Image]:
            return [self.picture(k) for k in range(self.frames)]

    path = tmp_path / "still.gif"
    path.write_bytes(gif(Still()))  # type: ignore[arg-type]
    with Image.open(path) as film:
        assert film.n_frames == 1  # type: ignore[attr-defined]
        assert film.info["duration"] == 710
        assert film.convert("RGB").getpixel((3, 3)) == (12, 200, 31)


@pytest.mark.parametrize("ending", VIDEOS)
def test_a_video_shows_the_frames_for_the_right_time(ending: str, tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="videos need the extra 'film'")
    path = plots.animate(bank(), tmp_path / f"film{ending}", **WINDOW)
    assert list(tmp_path.iterdir()) == [path]
    wanted = drawn(tmp_path)
    with av.open(str(path)) as file:
        (stream,) = file.streams
        context = stream.codec_context
        assert (context.width, context.height) == wanted[0].size
        assert context.width % 2 == context.height % 2 == 0
        assert context.pix_fmt == "yuv420p"
        assert context.name == {".mp4": "h264", ".webm": "vp9"}[ending] or "vp9" in context.name
        assert file.duration / 1e6 == pytest.approx(FRAMES / FPS, abs=0.06)
        stored = [frame.to_ndarray(format="rgb24") for frame in file.decode(stream)]
    assert len(stored) == FRAMES
    for shown, picture in zip(stored, wanted, strict=True):
        assert np.abs(shown.astype(int) - np.asarray(picture)).mean() < 6
    if ending == ".mp4":  # the index comes first, so that a browser can start
        text = path.read_bytes()
        assert text.index(b"moov") < text.index(b"mdat")


def test_a_missing_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "av", None)
    with pytest.raises(MissingExtraError, match=r"videos need av.*gms-fsm\[film\].*as a \.gif"):
        plots.animate(bank(), tmp_path / "film.mp4", **WINDOW)
    assert not list(tmp_path.iterdir())
