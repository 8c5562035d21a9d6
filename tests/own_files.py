"""Chart and system files of a user's, for the tests of the command line."""

from __future__ import annotations

from pathlib import Path

STICTION = """\
name = "stiction"

[[parameter]]
name = "F_c"
unit = "N"
rule = "> 0"

[[parameter]]
name = "F_s"
unit = "N"
rule = ">= F_c"

[[state]]
name = "stuck"
locked = true

[[state]]
name = "forward"
outputs.F = "F_c"

[[state]]
name = "backward"
outputs.F = "-F_c"

[[edge]]
name = "release_forward"
from = "stuck"
to = "forward"
guard = "F > F_s"

[[edge]]
name = "release_backward"
from = "stuck"
to = "backward"
guard = "F < -F_s"

[[edge]]
name = "arrest_forward"
from = "forward"
to = "stuck"
guard = "v < 0"

[[edge]]
name = "arrest_backward"
from = "backward"
to = "stuck"
guard = "v > 0"
"""

PULLED = """\
name = "pulled mass"
numbers = { m = 1.0, K = 2.0, V = 0.1 }

[[body]]
name = "mass"
inertia = "m"
force = "K * (V * t - x)"

[[contact]]
name = "pad"
chart = "own.toml"
values = { F_c = 1.0, F_s = 1.5 }
"""

RUN = """
[run]
t_end = 20.0

[output]
figures = []
"""

# Two masses with the same chart, coupled by a gear with another one, a current and a controller.
PAIR = """\
name = "pair"
numbers = { K = 2.0, V = 0.1 }
flow = { i = "(u - i) / 0.1" }
signals = { w = "0.01 * sin(t)" }

[[body]]
name = "one"
inertia = 1.0
force = "K * (V * t - x1) + i"
x = "x1"
v = "v1"

[[body]]
name = "two"
inertia = 0.5
force = "w"
x = "x2"
v = "v2"

[[contact]]
name = "pad1"
v = "v1"
chart = "own.toml"
values = { F_c = 1.0, F_s = 1.5 }

[[contact]]
name = "pad2"
v = "v2"
chart = "own.toml"
values = { F_c = 0.2, F_s = 0.3 }

[[contact]]
name = "gear"
v = "v1 - v2"
chart = "backlash"
values = { k = 100.0, d = 1.0, gap = 0.01 }

[[sampled]]
name = "controller"
period = 0.1
updates.u = "-0.1 * v1"

[run]
t_end = 12.0

[initial]
one.x = 1e-3
two.v = 0.0
pad1.states = ["stuck"]
i = 0.01

[output]
figures = []
"""


def write(folder: Path) -> None:
    """Write own.toml, pulled.toml and pair.toml."""
    for name, text in (("own", STICTION), ("pulled", PULLED + RUN), ("pair", PAIR)):
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
