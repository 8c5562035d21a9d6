"""A film's file has the frames, the size and the length of the film, in every format.

Each frame has the chart and the cursor of its row. The chart is laid out once, whatever the number
of frames. A failure leaves the old file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="films need the extra 'plots'")

from matplotlib.colors import to_rgb
from PIL import Image

from gms_fsm.errors import MissingExtraError, OutputError
from plots.film import _chart
from plots.film.animation import animate
from plots.output.formats import endings
from plots.output.graphviz import available
from plots.style import CHART_THEMES
from tests.plots.films import cascade, count, frames_of, with_movie

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not available(), reason="no Graphviz")]
VIDEOS = [ending for ending in endings("animation") if ending != ".gif"]
FRAMES, FPS = 20, 10.0
WINDOW = {"t_start": 3.3, "t_end": 5.0, "frames": FRAMES, "fps": FPS}  # four micro-steps at 3.8 s


@pytest.fixture(scope="module")
def wanted(tmp_path_factory: pytest.TempPathFactory) -> list[Image.Image]:
    """The frames before they are written."""
    folder = tmp_path_factory.mktemp("frames")
    return list(with_movie(cascade(), folder, lambda movie: list(movie.pictures()), **WINDOW))


def test_a_gif_shows_the_frames_for_the_right_time(
    wanted: list[Image.Image], tmp_path: Path
) -> None:
    path = animate(cascade(), tmp_path / "film.gif", **WINDOW)
    stored = frames_of(path)
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


@pytest.mark.matrix
@pytest.mark.every(2)
@pytest.mark.parametrize("ending", VIDEOS)
def test_a_video_shows_the_frames_for_the_right_time(
    ending: str, wanted: list[Image.Image], tmp_path: Path
) -> None:
    av = pytest.importorskip("av", reason="videos need the extra 'film'")
    path = animate(cascade(), tmp_path / f"film{ending}", **WINDOW)
    assert list(tmp_path.iterdir()) == [path]
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
        animate(cascade(), tmp_path / "film.mp4", **WINDOW)
    assert not list(tmp_path.iterdir())


def test_frames_have_the_theme_one_layout_the_active_states_and_the_cursor(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    layouts: list[Any] = []
    draw = _chart.rendered
    monkeypatch.setattr(_chart, "rendered", lambda *each: layouts.append(each) or draw(*each))
    told: list[tuple[int, int]] = []
    more = {"theme": "dark", "notation": "math", "progress": lambda *each: told.append(each)}
    path = animate(cascade(), tmp_path / "run.gif", seconds=0.3, fps=10, **more)
    assert list(tmp_path.iterdir()) == [path]
    assert len(layouts) == 1
    assert told == [(k, 3) for k in range(1, 4)]
    with Image.open(path) as film:
        assert film.info["duration"] == 100
        assert film.info["loop"] == 0
    pictures = frames_of(path)
    assert min(pictures[0].size) > 300
    assert len({picture.tobytes() for picture in pictures}) == 3
    colours = CHART_THEMES["dark"]
    assert pictures[0].getpixel((3, 3)) == tuple(round(255 * c) for c in to_rgb(colours.paper))
    for picture in pictures:
        assert count(picture, colours.active) > 500
        assert count(picture, colours.fired) > 50  # the cursor


@pytest.mark.matrix
def test_a_failure_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "run.gif"
    path.write_bytes(b"the film of yesterday")

    def stop(done: int, _: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        animate(cascade(), path, frames=5, progress=stop)
    assert path.read_bytes() == b"the film of yesterday"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(OutputError, match="nowhere"):
        animate(cascade(), tmp_path / "nowhere" / "run.gif", frames=2)
