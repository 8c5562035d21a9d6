"""The live pages of docs/play.md, and the replay on the first page.

`write_all` makes them again when their sources have changed.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from dark import dark_picture, dark_svg, webp
from notebooks import common_sources
from PIL import Image

from gms_fsm.app.scenario import load_scenario
from plots import LiveChart, play
from plots.page.replay import replay_html

END = 1.0  # s, of the pulled mass
REPLAYED = (0.0, 0.4)  # s, on the first page
PAGES: dict[str, tuple[str, dict[str, tuple[float, float] | None]]] = {  # titles, and sliders
    "pulled_mass": (
        "Pulled mass",
        {"F_s": (1.0, 2.5), "v_s": (1e-5, 2e-3), "speed": (1e-4, 1e-2), "stiffness": None},
    ),
    "paper_fig4_stick_slip": ("Stick-slip of the paper", {"F_s": (0.5, 3.0), "k": None}),
    "two_blocks_on_a_belt": (
        "Two blocks on a belt",
        {"numbers.k": None, "numbers.k_c": None, "pad_1.F_s": None, "pad_2.F_s": None},
    ),
    "drill_string": (
        "Drill string",
        {"numbers.u": (3000.0, 12000.0), "rock.W": None, "rock.mu_s": (0.5, 1.5)},
    ),
    "servo": (
        "Servo with friction on the load",
        {"numbers.k_p": None, "numbers.k_d": None, "numbers.k_i": None, "bearing.F_s": (1.0, 4.0)},
    ),
    "friction_damper": (
        "Friction damper",
        {"numbers.A": None, "numbers.k": None, "pad.F_c": (1.0, 5.0), "joint.gap": None},
    ),
}


def both(data: bytes | str) -> Iterator[tuple[str, bytes]]:
    """Yield the endings and contents of a picture's light and dark files."""
    if isinstance(data, str):
        yield ".svg", data.encode()
        yield "_dark.svg", dark_svg(data).encode()
    else:
        image = Image.open(io.BytesIO(data)).convert("RGB")
        yield ".webp", webp(image)
        yield "_dark.webp", webp(dark_picture(image))


def write_replay(folder: Path) -> None:
    """Write the replay of the first page, and its picture for browsers without JavaScript."""
    trace = load_scenario("pulled_mass", (f"run.t_end={END}",)).simulate(engine="ifelse")
    page = replay_html(trace, title="Pulled mass", window=REPLAYED)
    (folder / "replay.html").write_text(page, encoding="utf-8")
    slipping = (trace.states == "slip").sum(axis=1)
    row = int(np.flatnonzero((slipping == 2) & (trace.t > 0.2))[0])
    for ending, content in both(LiveChart(trace, values=True).frame(row)):
        (folder / f"replay{ending}").write_bytes(content)


def write_live(folder: Path, name: str) -> None:
    """Write a live page."""
    loaded, (title, vary) = load_scenario(name), PAGES[name]
    given: dict[str, Any] = dict(loaded.arguments)
    for each in ("t_end", "engine"):
        given.pop(each, None)
    play(*loaded.subject, vary=vary, title=title, **given).save(folder / f"{name}.html")


def write_all(folder: Path) -> None:
    """Write all pages into an own folder, unless those there are of the same sources."""
    own = b"".join(Path(__file__).with_name(u).read_bytes() for u in ("live_pages.py", "dark.py"))
    now, stamp = hashlib.sha256(common_sources() + own).hexdigest(), folder / "stamp"
    if stamp.exists() and stamp.read_text() == now:
        return
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for name in PAGES:
        write_live(folder, name)
    write_replay(folder)
    stamp.write_text(now)
