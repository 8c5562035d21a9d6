"""A film has the requested number of frames, each with the chart and cursor of its row.

The chart is laid out once, whatever the number of frames, and drawn again only where it changes.
"""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="animations need the extra 'plots'")

from matplotlib.colors import to_rgb
from PIL import Image

import plots.live_chart
from gms_fsm import Trace, simulate
from gms_fsm.errors import OutputError, ParameterError
from plots.animation import animate
from plots.style import CHART_THEMES
from tests.helpers import one_element, open_loop, stick_slip
from tests.plots.films import count, frames_of

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def _graphviz() -> None:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")


@cache
def bank() -> Trace:
    return simulate(stick_slip("signed"), open_loop(), 45.0)


@cache
def one() -> Trace:
    return simulate(one_element("signed"), open_loop(), 45.0)


@pytest.mark.parametrize("theme", CHART_THEMES)
def test_frames(theme: str, tmp_path: Path) -> None:
    path = animate(bank(), tmp_path / "run.gif", frames=6, fps=10, theme=theme, notation="math")
    assert list(tmp_path.iterdir()) == [path]
    with Image.open(path) as film:
        assert film.format == "GIF"
        assert film.n_frames == 6  # type: ignore[attr-defined]
        assert film.info["duration"] == 100
        assert film.info["loop"] == 0
    pictures = frames_of(path)
    assert {picture.size for picture in pictures} == {pictures[0].size}
    assert min(pictures[0].size) > 300
    assert len({picture.tobytes() for picture in pictures}) == 6
    colours = CHART_THEMES[theme]
    assert pictures[0].getpixel((3, 3)) == tuple(round(255 * c) for c in to_rgb(colours.paper))
    for picture in pictures:
        assert count(picture, colours.active) > 500
        assert count(picture, colours.fired) > 50  # the cursor


def test_the_active_state_moves_with_the_run(tmp_path: Path) -> None:
    trace, colours = one(), CHART_THEMES["light"]
    first = float(trace.transitions.t[0])
    path = animate(trace, tmp_path / "one.gif", frames=2, t_start=first - 0.5, t_end=first + 0.5)
    before, after = frames_of(path)

    def centre(picture: Image.Image) -> float:
        """Return the height of the border of the active state."""
        wanted = tuple(round(255 * part) for part in to_rgb(colours.active))
        width, height = picture.size
        rows = [
            y
            for y in range(height)
            for x in range(0, width, 2)
            if picture.getpixel((x, y)) == wanted
        ]
        return sum(rows) / len(rows)

    assert centre(after) > centre(before) + 50  # slip is below stick
    assert count(after, colours.fired) > count(before, colours.fired) + 40  # the edge


def test_one_layout_serves_all_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    real = plots.live_chart.picture

    def counted(*arguments: Any) -> bytes:
        calls.append(arguments)
        return real(*arguments)

    monkeypatch.setattr(plots.live_chart, "picture", counted)
    told: list[tuple[int, int]] = []
    animate(
        bank(),
        tmp_path / "run.gif",
        elements=[1],
        frames=20,
        progress=lambda *each: told.append(each),
    )
    assert len(calls) == 1
    assert told == [(k, 20) for k in range(1, 21)]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"path": "run.avi"}, r"path is 'run\.avi'; it must end in \.gif, \.mp4 or \.webm"),
        ({"seconds": 0.05}, r"seconds is 0\.05; it must be a time of at least two frames, 0\.1 s"),
        ({"seconds": float("nan")}, "seconds is nan"),
        ({"seconds": 3.0, "frames": 60}, r"frames is 60 and seconds is 3\.0; give only one"),
        ({"frames": 1}, "frames is 1; it must be an integer of at least 2"),
        ({"frames": 2.5}, r"frames is 2\.5"),
        ({"frames": True}, "frames is True"),
        ({"fps": 0}, "fps is 0; it must be above 0 and at most 50"),
        ({"fps": 51}, "fps is 51"),
        ({"fps": float("nan")}, "fps is nan"),
        ({"t_start": 5.0, "t_end": 5.0}, r"t_start is 5\.0 s and t_end is 5\.0 s; .* 0 to 45 s"),
        ({"t_end": 46.0}, r"t_end is 46\.0 s"),
        ({"t_start": float("nan")}, "t_start is nan s"),
        ({"theme": "grey"}, r"theme is 'grey'; it must be 'light' or 'dark'"),
        ({"notation": "tex"}, "notation is 'tex'"),
        ({"elements": [7]}, r"elements is \[7\].*the run has 4"),
    ],
)
def test_wrong_options_are_rejected(
    options: dict[str, Any], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ParameterError, match=message):
        animate(bank(), **({"path": "run.gif"} | options))
    assert not list(tmp_path.iterdir())


def test_a_failure_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "run.gif"
    path.write_bytes(b"the film of yesterday")

    def stop(done: int, _: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        animate(one(), path, frames=5, progress=stop)
    assert path.read_bytes() == b"the film of yesterday"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(OutputError, match="nowhere"):
        animate(one(), tmp_path / "nowhere" / "run.gif", frames=2)
